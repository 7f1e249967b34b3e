#include "config.h"
#include "restore/restore.h"
#include "restore/predict.h"
#include "formats/format.h"
#include "core/par.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
int main(int c,char**v){ struct ct_err e={0}; struct ct_tensors w={0}; struct ct_slice_prior p={0}; struct ct_env env={0}; double tot=0;
 if(ct_tensors_read(v[1],&w,&e)||ct_slice_prior_alloc(&p,&w,&e)){puts(e.msg);return 1;}
 for(int i=2;i<c;i++){ FILE*f=fopen(v[i],"rb"); int n[6]; float g[4]; if(!fread(n,24,1,f)||!fread(g,16,1,f))return 1; size_t m=(size_t)n[0]*n[1]*n[2]; short*o=malloc(4*m); if(!fread(o,4,m,f))return 1; fclose(f);
  float*x=malloc(4*m),*h=calloc(m,4); for(size_t k=0;k<m;k++)x[k]=o[k]/8.f;
  struct ct_scene s={.x=x,.n={n[0],n[1],n[2]},.coarse={true,true,true},.regime={g[0],g[1],n[3]}}; struct ct_guess q={.h=h}; size_t a=0,b=0; bool all[3]={1,1,1}; int k4=-1;
  for(size_t k=0;k<p.n;k++) if(p.r[k].shape.cell==4&&p.r[k].shape.swap&&!p.again[k])k4=k;
  if(ct_predict(&q,&s,&p.r[k4],all,&a,&b,&env,&e)){puts(e.msg);return 1;}
  double d=0,r=0; for(size_t k=0;k<m;k++){double t=o[m+k]/16.; d+=(t-h[k]/q.axes)*(t-h[k]/q.axes); r+=t*t;} {char on[999]; snprintf(on,999,"%s.h",v[i]); FILE*fo=fopen(on,"wb"); for(size_t k=0;k<m;k++)h[k]/=q.axes; fwrite(h,4,m,fo); for(size_t k=0;k<m;k++)h[k]*=q.axes; fclose(fo);} printf("%s dec %d sigma %.2f noise %.0f: %.4f\n",strrchr(v[i],'/')+1,n[3],g[0],g[1],d/r); tot+=d/r; free(o);free(x);free(h);}
 printf("mean %.4f\n",tot/(c-2)); return 0;}
