import numpy as np, json, struct, sys
src,base,out,scale=sys.argv[1],sys.argv[2],sys.argv[3],float(sys.argv[4]) if len(sys.argv)>4 else 1.
z=np.load(src); g=lambda k: z[k].astype(np.float64)
C=g('first.w').shape[0]; B=sum(1 for k in z.files if k.startswith('a.'))
T={}
T['wide-4.shape']=np.array([4,C,B],np.float32)
T['wide-4.first']=(np.einsum('noabc,oi->niabc',g('first.w'),g('ti'))/256).reshape(C,-1).astype(np.float32)
T['wide-4.one']=np.concatenate([g('a.%d.w'%i).reshape(C,-1) for i in range(B)]).astype(np.float16)
T['wide-4.second']=np.concatenate([g('b.%d.w'%i).reshape(C,-1) for i in range(B)]).astype(np.float16)
T['wide-4.second_bias']=np.stack([g('bb.%d'%i) for i in range(B)]).astype(np.float32)
T['wide-4.last']=(scale*64*np.einsum('po,ocxyz->pcxyz',g('tou'),g('last.w'))).reshape(64,-1).astype(np.float32)
T['wide-4.last_bias']=(scale*64*g('tou')@g('lb'))[None].astype(np.float32)
T['wide-4.regime']=np.concatenate([g('cond.weight')[:,:4],g('cond.bias')[:,None]],1).astype(np.float32)
b=open(base,'rb').read(); n=struct.unpack('<Q',b[:8])[0]; h=json.loads(b[8:8+n]); data=b[8+n:]
drop=sys.argv[5].split(',') if len(sys.argv)>5 else []
H={}; D=b''
if '__metadata__' in h: H['__metadata__']=h['__metadata__']
for k,v in sorted(((k,v) for k,v in h.items() if k!='__metadata__'),key=lambda kv: kv[1]['data_offsets'][0]):
    if k.startswith('wide-') or any(k.startswith(d+'.') for d in drop): continue
    a,e=v['data_offsets']; H[k]={'dtype':v['dtype'],'shape':v['shape'],'data_offsets':[len(D),len(D)+e-a]}; D+=data[a:e]
for k,t in T.items():
    t=np.ascontiguousarray(t); H[k]={'dtype':'F16' if t.dtype==np.float16 else 'F32','shape':list(t.shape),'data_offsets':[len(D),len(D)+t.nbytes]}; D+=t.tobytes()
j=json.dumps(H,separators=(',',':')).encode(); j+=b' '*(-len(j)%8)
open(out,'wb').write(struct.pack('<Q',len(j))+j+D); print(out,len(D)/1e6)
