import numpy as np, lzma, struct, os
def make(seed,n=176):
    r=np.random.default_rng(seed); v=np.full((n,n,n),-1000.,np.float32)
    def shape(kind,c,rad,R,val,mode='set'):
        m=int(rad.max()*1.75)+3
        lo=np.maximum(np.floor(c-m).astype(int),0); hi=np.minimum(np.ceil(c+m).astype(int),n)
        if np.any(hi<=lo): return
        z,y,x=np.meshgrid(*[np.arange(a,b,dtype=np.float32) for a,b in zip(lo,hi)],indexing='ij')
        p=np.stack([z-c[0],y-c[1],x-c[2]],-1)@R.astype(np.float32)
        if kind==0: q=p/rad; l=np.linalg.norm(q,axis=-1)+1e-6; g=np.linalg.norm(q/rad,axis=-1)+1e-6; sd=l*(l-1)/g
        elif kind==1: sd=np.max(np.abs(p)-rad,-1)
        else: sd=np.maximum(np.hypot(p[...,0],p[...,1])-rad[0],np.abs(p[...,2])-rad[2])
        a=np.clip(.5-sd,0,1); s=v[lo[0]:hi[0],lo[1]:hi[1],lo[2]:hi[2]]
        s[...]=s*(1-a)+a*val
    def rot():
        q,_=np.linalg.qr(r.normal(size=(3,3))); return q
    shape(0,np.full(3,n/2.),np.array([.46,.42,.44])*n,rot(),r.choice([0,40,120,-100]))
    for i in range(220):
        k=r.integers(3); size=np.exp(r.uniform(np.log(1.5),np.log(30)))
        rad=size*np.exp(r.uniform(-.9,.3,3)); c=r.uniform(.08*n,.92*n,3)
        val=r.choice([r.uniform(-1000,1900),r.uniform(-150,150),r.uniform(20,90),r.uniform(300,1500)])
        if k==2: rad=np.array([rad[0]*.5,rad[0]*.5,rad[2]*2.2])
        shape(k,c,np.maximum(rad,.8),rot(),val)
    v+=r.choice([0,3,6])*r.normal(size=v.shape)
    return v
os.makedirs('pk',exist_ok=True)
for s in range(3):
    v=make(s); q=np.clip(np.round((v+1024)/4),0,1023).astype(np.int32); d=np.diff(q,axis=0,prepend=0).astype('<i2')
    lo=(d&255).astype('u1').tobytes(); hi=((d>>8)&255).astype('u1').tobytes(); z=lzma.compress(lo+hi,preset=6)
    open('pk/synth_%d.pk'%s,'wb').write(struct.pack('<6i',*q.shape,4,-1024,1)+z); print(s,len(z))
