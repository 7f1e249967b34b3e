#!/usr/bin/python3
"""Rows of edges of CTs that were reduced by known operators, for fit.py.

rows.py SEED TIMES OUT.npz CT.nii...   (Debian: python3-nibabel, python3-scipy)

Of each CT so many times a part, at a scale of its own, reduced along all axes or along one:
band-limited (45 %) or not, with or without noise, clipped, with a field of view. A name that ends in
.xy.nii.gz is a CT whose third axis is itself blurred: it is reduced along the other two only.
OUT: X, Y rows along the axis and along another, Y averaged over as many voxels; l: what is true; p:
which CT. src/resolution/edge-lines.h says what a row is.
"""
import numpy as np, nibabel as nib, sys, os
from scipy.ndimage import gaussian_filter
N = 256  # rows of a scan
L = 12  # voxels of a line
def exact(n, s, sig, kind):
    m=int(np.floor(n/s+1e-9)); N=int(np.ceil(m*s-1e-9)); off=(n-N)//2
    x=np.arange(N)
    # gaussian with reflection
    G=np.eye(N)
    if sig>0:
        r=int(np.ceil(4*sig)); k=np.exp(-.5*(np.arange(-r,r+1)/sig)**2); k/=k.sum()
        G=np.zeros((N,N))
        for d,w in zip(range(-r,r+1),k):
            j=(x+d)%(2*N); j=np.where(j>=N,2*N-1-j,j)
            G[x,j]+=w
    c=(np.arange(m)+.5)*s-.5
    if kind=='sinc':
        kk=np.arange(m)
        C=np.cos(np.pi*(x[None]+.5)*kk[:,None]/N)*np.where(kk[:,None]==0,1,2)/N
        D=np.cos(np.pi*(c[:,None]+.5)*kk[None]/N)@C
    elif kind=='point':
        D=np.zeros((m,N)); i=np.floor(c).astype(int); f=c-i
        for a in range(m):
            D[a,i[a]]+=1-f[a]
            if f[a]>0: D[a,min(i[a]+1,N-1)]+=f[a]
    else:
        D=np.zeros((m,N))
        for a in range(m):
            lo,hi=a*s,(a+1)*s
            for j in range(int(np.floor(lo)),int(np.ceil(hi-1e-9))):
                D[a,j]=max(0,min(hi,j+1)-max(lo,j))/s
    M=np.zeros((m,n)); M[:,off:off+N]=D@G
    return M.astype(np.float32)
def apply(v,Ms):
    for a,M in enumerate(Ms):
        if M is not None: v=np.moveaxis(np.tensordot(M,v,(1,a)),0,a)
    return np.ascontiguousarray(v)
def box(n,s,sig,w):
    """aliased: Gaussian sig (HR voxels), box of w*s voxels, sampled at centres"""
    M=exact(n,s,sig,'point') if w==0 else None
    if M is not None: return M
    m=int(np.floor(n/s+1e-9)); Nn=int(np.ceil(m*s-1e-9)); off=(n-Nn)//2
    P=exact(Nn,1.0,sig,'point')[:, :] if sig>0 else np.eye(Nn,dtype=np.float32)
    c=(np.arange(m)+.5)*s; D=np.zeros((m,Nn),np.float32)
    for a in range(m):
        lo,hi=max(0,c[a]-w*s/2),min(Nn,c[a]+w*s/2)
        j=np.arange(int(np.floor(lo)),int(np.ceil(hi-1e-9)))
        D[a,j]=np.clip(np.minimum(hi,j+1)-np.maximum(lo,j),0,1)
    D/=D.sum(1,keepdims=True)
    M=np.zeros((m,n),np.float32); M[:,off:off+Nn]=D@P
    return M
def patches(v, a, rng, N=N):
    v=np.moveaxis(v,a,2); n0,n1,n2=v.shape; h=L//2
    lo=v.min()
    pad=(v==lo); pad=pad[:,:,1:]&pad[:,:,:-1]      # two neighbours at the lowest value
    cs=np.cumsum(np.concatenate([np.zeros(pad.shape[:2]+(1,),np.int32),pad],2),axis=2)
    bad=(cs[:,:,L-1:]-cs[:,:,:-(L-1)])>0             # any in the L-1 pairs of the line
    c=v[1:-1,1:-1]
    g=np.abs(np.diff(c,axis=2))[:,:,h-1:n2-h]
    t0=np.abs(v[2:,1:-1]-v[:-2,1:-1])/2; t1=np.abs(v[1:-1,2:]-v[1:-1,:-2])/2
    T=np.maximum(t0,t1); T=np.maximum(T[:,:,:-1],T[:,:,1:])[:,:,h-1:n2-h]
    q=g*(g>T*.5)*~bad[1:-1,1:-1]
    flat=q.ravel(); K=min(flat.size,max(N*3,int(.03*flat.size)))
    idx=np.argpartition(-flat,K-1)[:K]; idx=idx[flat[idx]>20]
    if len(idx)<24: return None
    p=flat[idx]**.5; pick=rng.choice(idx,N,replace=len(idx)<N,p=p/p.sum())
    i,j,k=np.unravel_index(pick,q.shape); i=i+1;j=j+1;k=k+h-1
    kk=k[:,None]+np.arange(-h+1,h+1)
    line=v[i[:,None],j[:,None],kk]; k4=k[:,None]+np.arange(-1,3)
    nb=[v[(i+a_)[:,None],(j+b_)[:,None],k4] for a_,b_ in((1,0),(-1,0),(0,1),(0,-1))]
    mu=(v[i,j,k]+v[i,j,k+1])/2; d=v[i,j,k+1]-v[i,j,k]
    X=np.concatenate([line]+nb,1)-mu[:,None]; X*=np.sign(d)[:,None]; X/=np.abs(d)[:,None]
    return np.concatenate([np.clip(X,-8,8),np.log(np.abs(d)[:,None]/100)],1).astype(np.float16)
def any_op(rng):
    if rng.random()<.45: return 'sinc',rng.uniform(.15,.6),0
    w=[0,1,rng.uniform(.3,2)][rng.choice(3,p=[.4,.4,.2])]
    s=rng.uniform(.1,.6) if w==0 else (0 if rng.random()<.5 else rng.uniform(0,.4))
    return 'alias',s,w
def mat(n,f,k,s,w): return exact(n,f,s*f,'sinc') if k=='sinc' else box(n,f,s*f,w)
def gof(k,s,w,f):
    if k=='sinc': return s
    if w==0: return np.sqrt(s*s+(.25/f/f if f==int(f) and f%2==0 else 0))
    return np.sqrt(s*s+w*w/12)
def one(c,ax,rng,thick,k,s,w,f,noise=0,corr=0,clip=-1024,fov=0):
    c=np.clip(c,clip,3071) if clip is not None else c
    if fov:
        x=(np.arange(c.shape[0])/c.shape[0]-.5)[:,None]; y=(np.arange(c.shape[1])/c.shape[1]-.5)[None]
        r2=(x-rng.uniform(-.1,.1))**2+(y-rng.uniform(-.1,.1))**2
    Ms=[None]*3; res=[]
    if thick: a=ax[rng.integers(len(ax))]; Ms[a]=mat(c.shape[a],f,k,s,w); todo=[a]
    else: Ms=[mat(n,f,k,s,w) for n in c.shape]; todo=list(ax)
    lr=apply(c,Ms)
    if noise:
        e=rng.normal(0,1,lr.shape).astype(np.float32)
        if corr: e=gaussian_filter(e,[0 if (thick and q==todo[0]) else corr for q in range(3)]); e/=e.std()
        lr=lr+noise*e
    if fov:
        xs=((np.arange(lr.shape[0])+.5)/lr.shape[0]-.5)[:,None]; ys=((np.arange(lr.shape[1])+.5)/lr.shape[1]-.5)[None]
        lr[(xs**2+ys**2)>fov**2]=-1024
    lr=np.rint(lr)
    if clip is not None: lr=np.maximum(lr,clip)
    for a in todo:
        if lr.shape[a]<L+1: continue
        X=patches(lr,a,rng)
        if X is None: continue
        Y=None
        if thick:
            for b in [q for q in range(3) if q!=a]:
                R=[None]*3; R[b]=exact(lr.shape[b],f,0.0,'mean')
                if R[b].shape[0]<L+1: continue
                Y=patches(apply(lr,R),b,rng)
                if Y is not None: break
        res.append((X,Y if Y is not None else np.zeros_like(X),[thick,f,noise,k=='alias',s,gof(k,s,w,f),a,w,Y is not None,corr,clip if clip is not None else -9999,fov]))
    return res
def main():
    seed, times, out = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
    rng, rows = np.random.default_rng(seed), []
    for p, f in enumerate(sys.argv[4:]):
        ax = [0, 1] if f.endswith('.xy.nii.gz') else [0, 1, 2]
        V = np.asanyarray(nib.load(f).dataobj).astype(np.float32)[:280, :280, :280]
        for _ in range(times):
            rows += [r + (p,) for r in part(V, ax, rng)]
        print(f, len(rows), flush=True)
    np.savez(out, X=np.array([r[0] for r in rows]), Y=np.array([r[1] for r in rows]),
             l=np.array([r[2] for r in rows], np.float32), p=np.array([r[3] for r in rows]))

def part(V, ax, rng):
    c = V
    if rng.random() < .5:  # a coarser, sharper patient
        q = rng.uniform(1.2, 2.5)
        kind = ['sinc', 'alias'][rng.integers(2)]
        c = apply(c, [mat(n, q, kind, .3 if kind == 'sinc' else 0, 1) for n in c.shape])
    if rng.random() < .2:  # a sharp kernel
        c = c + rng.uniform(.2, .8) * (c - gaussian_filter(c, 1))
    side = rng.integers(90, 170)
    o = [rng.integers(0, max(1, n - side + 1)) for n in c.shape]
    c = c[tuple(slice(x, x + side) for x in o)]
    thick = rng.random() < .5
    kind, s, w = any_op(rng)
    f = rng.choice([2, 2.5, 3, 4, 5, 6, 8]) if rng.random() < .7 else rng.uniform(1.5, 8)
    f = min(f, side / 15, min(c.shape) / 14)
    if (c > -500).mean() < .1 or f < 1.5:
        return []
    noise = 0 if rng.random() < .4 else np.exp(rng.uniform(np.log(3), np.log(60)))
    return one(c, ax, rng, thick, kind, s, w, f, noise, rng.uniform(.4, .8) if rng.random() < .3 else 0,
               [None, -1024, -1024, -512][rng.integers(4)], rng.uniform(.3, .5) if rng.random() < .15 else 0)

main()
