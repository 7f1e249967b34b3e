#include "config.h"
#include "restore/restore.h"
#include "formats/format.h"
#include "core/par.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
int main(int c,char**v){ struct ct_err e={0}; struct ct_tensors w={0}; struct ct_slice_prior p={0}; struct ct_par*par; double tot=0,tm=0;
 if(ct_tensors_read(v[1],&w,&e)||ct_slice_prior_alloc(&p,&w,&e)||ct_par_alloc(&par,atoi(v[2]),&e)){puts(e.msg);return 1;} struct ct_env env={.par=par};
 for(int i=3;i<c;i++){ FILE*f=fopen(v[i],"rb"); int n[6]; float g[4]; if(!fread(n,24,1,f)||!fread(g,16,1,f))return 1; size_t m=(size_t)n[0]*n[1]*n[2]; short*o=malloc(4*m); if(!fread(o,4,m,f))return 1; fclose(f);
  float*x=malloc(4*m),*h=calloc(m,4),*q=calloc(m,4); for(size_t k=0;k<m;k++)x[k]=o[k]/8.f; char on[999]; snprintf(on,999,"%s.h",v[i]); f=fopen(on,"rb"); if(f){if(!fread(q,4,m,f))return 1; fclose(f);}
  struct ct_regime rg={g[0],g[1],n[3]}; size_t nn[3]={n[0],n[1],n[2]}; clock_t t=clock(); if(ct_wide_predict(&p.wide,h,x,nn,&rg,&env,&e)){puts(e.msg);return 1;} tm+=(double)(clock()-t)/CLOCKS_PER_SEC/m*2097152;
  double d=0,r=0; for(size_t k=0;k<m;k++){double t=o[m+k]/16.-q[k]; d+=(t-h[k])*(t-h[k]); r+=t*t;} printf("%s %.4f %g\n",strrchr(v[i],'/')+1,d/r,h[m/2]); tot+=d/r; free(o);free(x);free(h);free(q);}
 printf("mean %.4f, CPU s of 128^3 %.2f\n",tot/(c-3),tm/(c-3)); return 0;}
