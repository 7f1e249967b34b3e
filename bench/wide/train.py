import torch, torch.nn as nn, torch.nn.functional as F, numpy as np, os, sys, time, threading, struct, math, glob, random
T0=time.time()
DEV='cuda' if torch.cuda.is_available() else 'cpu'
OUT=os.environ.get('OUT','work/out'); C=int(os.environ.get('WIDTH','96')); B=int(os.environ.get('BLOCKS','6'))
CELL=4; UNIT_IN=256.; UNIT_OUT=64.
torch.backends.cudnn.benchmark=True; torch.backends.cuda.matmul.allow_tf32=True; torch.backends.cudnn.allow_tf32=True
MODE=os.environ.get('MODE','auto')
class Conv(nn.Module):
    """A 3-D convolution of 3^3, zero padding; as one of 3-D or of images of three planes' channels."""
    mode='3d'
    def __init__(s,ci,co,gain=1.):
        super().__init__(); s.w=nn.Parameter(torch.randn(co,ci,3,3,3)*gain*math.sqrt(2/(27*ci)))
    def forward(s,x):
        if Conv.mode=='3d': return F.conv3d(x,s.w.to(x.dtype),padding=1)
        b,c,d,h,w=x.shape
        p=x.permute(0,2,1,3,4) # b d c h w
        z=torch.zeros_like(p[:,:1]); q=torch.cat([z,p,z],1)
        t=torch.cat([q[:,:-2],q[:,1:-1],q[:,2:]],2).reshape(b*d,3*c,h,w).contiguous(memory_format=torch.channels_last)
        k=s.w.permute(0,2,1,3,4).reshape(s.w.shape[0],3*c,3,3).to(x.dtype).contiguous(memory_format=torch.channels_last)
        y=F.conv2d(t,k,padding=1)
        return y.reshape(b,d,-1,h,w).permute(0,2,1,3,4)
def act(x): return F.leaky_relu(x,.1)
class Net(nn.Module):
    def __init__(s,C,B,K):
        super().__init__(); s.first=Conv(64,C); s.a=nn.ModuleList([Conv(C,C) for _ in range(B)]); s.b=nn.ModuleList([Conv(C,C,.2) for _ in range(B)])
        s.last=Conv(C,64,0.); s.err=Conv(C,1,0.); s.cond=nn.Linear(K,C*(1+B)); nn.init.normal_(s.cond.weight,0,.05); nn.init.zeros_(s.cond.bias)
        s.register_buffer('ti',torch.eye(64)); s.register_buffer('tou',torch.eye(64)); s.bb=nn.ParameterList([nn.Parameter(torch.zeros(C)) for _ in range(B)]); s.lb=nn.Parameter(torch.zeros(64)); s.eb=nn.Parameter(torch.full((1,),-5.))
    def forward(s,x,k):
        with torch.autocast(DEV,enabled=False): x=torch.einsum('oc,bcdhw->bodhw',s.ti,x)
        x=fmt(x.bfloat16() if DEV=='cuda' else x)
        dt=x.dtype; k=s.cond(k).to(dt).reshape(x.shape[0],-1,x.shape[1]*0+C); v=lambda t:t[:,:,None,None,None]
        x=act(s.first(x)+v(k[:,0]))
        for i in range(len(s.a)):
            y=act(s.a[i](x)+v(k[:,1+i])); x=x+s.b[i](y)+s.bb[i].to(dt)[None,:,None,None,None]
        h=s.last(x).float()+s.lb[None,:,None,None,None]
        with torch.autocast(DEV,enabled=False): h=torch.einsum('oc,bcdhw->bodhw',s.tou,h)
        return h, s.err(x.detach()).float()[:,0]+s.eb
K=8
def dct():
    i=torch.arange(4.); m=torch.cos(math.pi*(i[None]+.5)*i[:,None]/4); m[0]*=math.sqrt(.5); m*=math.sqrt(.5)
    return torch.einsum('ax,by,cz->abcxyz',m,m,m).reshape(64,64)
def whiten(net,pool):
    r=random.Random(7); a=b=c=0.
    for _ in range(8):
        x,t,m,k,w=pool.batch(r,16*80**3 if DEV=='cuda' else 4*48**3); D=dct().to(DEV)
        y=torch.einsum('oc,bcdhw->bodhw',D,x); z=torch.einsum('oc,bcdhw->bodhw',D,t)
        a=a+(y**2).mean((0,2,3,4)); b=b+(z**2*w[:,None,None,None,None]).mean((0,2,3,4)); c=c+(w).mean()
    a=a/8; b=b/8
    net.ti.copy_(D/torch.sqrt(a+(3/UNIT_IN)**2)[:,None]); g=torch.sqrt(b/b.mean()+1e-3)
    net.tou.copy_((D*g[:,None]).t())
    print('in',[round(v,3) for v in (a.sqrt()*UNIT_IN).tolist()[:8]],'out',[round(v,3) for v in g.tolist()[:8]],flush=True)
def cond(sigma,noise,dec,coarse,S):
    return [4*sigma-1, float(dec==1), float(dec==2), noise/15, float(not coarse[0]), float(not coarse[1]), float(not coarse[2]), float(S==2)]
class Pool:
    def __init__(s,folder,held,thick,S):
        s.f=folder; s.seen=set(); s.by={}; s.val=[]; s.held=held; s.S=S; s.thick=thick; s.stop=False; s.lock=threading.Lock(); s.n=0
    def load(s,path,name):
        b=np.fromfile(path,dtype=np.uint8); n=b[:24].view('<i4'); g=b[24:40].view('<f4'); m=int(n[0])*int(n[1])*int(n[2])
        d=torch.from_numpy(b[40:].view('<i2').reshape(2,n[2],n[1],n[0])).to(DEV)
        coarse=[bool(n[4]>>a&1) for a in (2,1,0)] # z y x
        if s.thick and not coarse[0]:
            o=[0,1,2]; c=coarse.index(True); o[0],o[c]=c,0
            d=d.permute(0,*[1+a for a in o]).contiguous(); coarse=[coarse[a] for a in o]
        sh=[k//4*4 for k in d.shape[1:]]; d=d[:,:sh[0],:sh[1],:sh[2]].contiguous()
        return (d,float(g[0]),float(g[1]),int(n[3]),coarse,float(g[2]))
    def scan(s):
        fs=[f for f in os.listdir(s.f) if f.endswith('.bin') and f not in s.seen] if os.path.isdir(s.f) else []
        random.shuffle(fs)
        for f in fs:
            if s.stop: return
            s.seen.add(f); e=s.load(s.f+'/'+f,f); v=f[:f.rfind('-')]
            with s.lock:
                if any(h in f for h in s.held): s.val.append((f,e))
                else: s.by.setdefault(v,[]).append(e); s.n+=1
    def run(s):
        while not s.stop: s.scan(); time.sleep(1)
    def start(s): threading.Thread(target=s.run,daemon=True).start()
    def batch(s,rng,voxels=16*80**3):
        k=rng.choices([20,16,12],[.45,.4,.15])[0]; n=max(1,int(voxels/(4*k)**3)); out=[]
        with s.lock: names=list(s.by)
        tries=0
        while len(out)<n:
            l=s.by[rng.choice(names)]; e=l[rng.randrange(len(l))]; d=e[0]; tries+=1
            if min(d.shape[1:])<4*k:
                if tries>400*n: k=12; tries=0; out=[]; n=max(1,int(voxels/(4*k)**3))
                continue
            at=[rng.randrange(d.shape[1+a]//4-k+1) for a in range(3)]
            out.append((e,at))
        base,rest,mask,kk,w=[],[],[],[],[]
        for e,at in out:
            d,sig,noi,dec,co,dev=e
            c=d[:,at[0]*4:(at[0]+k)*4,at[1]*4:(at[1]+k)*4,at[2]*4:(at[2]+k)*4]
            if s.thick: o=[0]+rng.sample([1,2],2)
            else: o=rng.sample([0,1,2],3)
            c=c.permute(0,*[1+a for a in o]); fl=[1+a for a in range(3) if rng.random()<.5]
            if fl: c=c.flip(fl)
            a=math.exp(rng.uniform(-.7,.7)) if rng.random()<.3 else 1.; off=rng.uniform(-200,200) if rng.random()<.3 else 0.
            base.append(c); rest.append((a,off))
            lim=[]
            for ax in range(3):
                t=at[o[ax]]; N=d.shape[1+o[ax]]//4; lo=0 if t==0 else 2; hi=0 if t+k==N else 2
                if 1+ax in fl: lo,hi=hi,lo
                lim.append((lo,k-hi))
            mask.append(lim); kk.append(cond(sig,noi*a,dec,[co[q] for q in o],s.S)); w.append(UNIT_OUT**2/max(dev*dev,25.)/a/a)
        m=torch.zeros(len(out),k,k,k)
        for i,l in enumerate(mask): m[i,l[0][0]:l[0][1],l[1][0]:l[1][1],l[2][0]:l[2][1]]=1
        q=torch.stack(base).float(); ab=torch.tensor(rest).to(DEV,non_blocking=True)[:,:,None,None,None]
        return s2d((q[:,0]*(ab[:,0]/8)+ab[:,1])/UNIT_IN),s2d(q[:,1]*(ab[:,0]/16/UNIT_OUT)),m.to(DEV,non_blocking=True),torch.tensor(kk).to(DEV,non_blocking=True),torch.tensor(w).to(DEV,non_blocking=True)
def s2d(x):
    b,d,h,w=x.shape
    return x.reshape(b,d//4,4,h//4,4,w//4,4).permute(0,2,4,6,1,3,5).reshape(b,64,d//4,h//4,w//4)
def fmt(x): return x.contiguous(memory_format=torch.channels_last_3d) if Conv.mode=='3d' else x
def validate(net,pool):
    s={}
    with torch.no_grad():
        for f,e in pool.val[:60]:
            d=e[0]; x=s2d((d[:1].float()/8/UNIT_IN)); r=s2d(d[1:2].float()/16/UNIT_OUT)
            k=torch.tensor([cond(e[1],e[2],e[3],e[4],pool.S)]).to(DEV)
            with torch.autocast(DEV,torch.bfloat16,enabled=DEV=='cuda'): h,u=net(x,k)
            q=((h-r)**2).sum().item()/max((r**2).sum().item(),1e-9); key=(f[:4],e[3])
            s.setdefault(key,[]).append(q)
    tot=[q for l in s.values() for q in l]
    return (sum(tot)/max(len(tot),1),{k:round(sum(v)/len(v),3) for k,v in sorted(s.items())})
def train(net,pools,weights,seconds,lr,name,val_every=90,warm=300):
    import queue
    ema={k:v.detach().clone() for k,v in net.state_dict().items()}
    opt=torch.optim.AdamW(net.parameters(),lr=lr,betas=(.9,.99),weight_decay=.01,**({'fused':True} if DEV=='cuda' else {}))
    Q=queue.Queue(6); end=threading.Event(); side=torch.cuda.Stream() if DEV=='cuda' else None
    ready=lambda p: p.n>=60 and len(p.by)>=(20 if DEV=='cuda' else 2)
    def feed(seed):
        r=random.Random(seed)
        while not end.is_set():
            on=[i for i,p in enumerate(pools) if i==0 or ready(p)]; i=r.choices(on,[weights[q] for q in on])[0]
            if side:
                with torch.cuda.stream(side): b=pools[i].batch(r); ev=torch.cuda.Event(); ev.record(side)
            else: b=pools[i].batch(r,4*48**3); ev=None
            while not end.is_set():
                try: Q.put((b,ev,i),timeout=.5); break
                except queue.Full: pass
    for i in range(2): threading.Thread(target=feed,args=(100+i,),daemon=True).start()
    start=time.time(); step=0; nextv=val_every; run={}; pend={}; good={k:v.detach().clone() for k,v in net.state_dict().items()}; bad=0
    def say(tag):
        v=[validate(net,p) if p.val else (0,{}) for p in pools]
        print(name,tag,'%.0fs step %d'%(time.time()-start,step),'train',{k:round(x,4) for k,x in sorted(run.items())},'val',[round(x[0],4) for x in v],[x[1] for x in v],'pool',[p.n for p in pools],flush=True)
        return [x[0] for x in v]
    while True:
        t=(time.time()-start)/seconds
        if t>=1: break
        for g in opt.param_groups: g['lr']=lr*min(1,(step+1)/warm)*.5*(1+math.cos(math.pi*t))
        b,ev,i=Q.get()
        if ev: torch.cuda.current_stream().wait_event(ev); [z.record_stream(torch.cuda.current_stream()) for z in b]
        x,r,m,k,w=b
        with torch.autocast(DEV,torch.bfloat16,enabled=DEV=='cuda'): h,u=net(x,k)
        d=((h-r)**2).mean(1); ww=w[:,None,None,None]*m; n=m.sum()
        loss=(ww*d).sum()/n; lerr=(m*(u+(d.detach()*torch.exp(-u)).clamp(max=20))).sum()/n
        opt.zero_grad(set_to_none=True); (loss+.005*lerr).backward()
        gn=nn.utils.clip_grad_norm_(net.parameters(),.5); bad=bad+(~torch.isfinite(gn)).float() if step else (~torch.isfinite(gn)).float()
        for q in net.parameters(): q.grad.nan_to_num_(0,0,0)
        opt.step(); step+=1
        if step%100==0 and (float(bad)>0 or not math.isfinite(float(loss))):
            print('not finite at step',step,'lr',lr,flush=True); lr*=.6; bad=bad*0; net.load_state_dict(good)
            opt.state.clear(); ema={k:v.detach().clone() for k,v in good.items()}; last=0
        elif step%100==0: good={k:v.detach().clone() for k,v in ema.items()}
        a=min(.999,(1+step)/(10+step))
        with torch.no_grad():
            sd=net.state_dict(); ks=list(ema)
            E_=[ema[q] for q in ks]; torch._foreach_mul_(E_,a); torch._foreach_add_(E_,[sd[q] for q in ks],alpha=1-a)
        if step%20==0:
            whole=(ww*(r**2).mean(1)).sum()/n
            p=pend.setdefault(i,[]); p.append((loss.detach(),whole))
            if len(p)>=25: run[i]=sum(float(a) for a,_ in p)/sum(float(b) for _,b in p); pend[i]=[]
        if step in(100,400,1500) or time.time()-start>nextv:
            if time.time()-start>nextv: nextv+=val_every
            keep={q:v.clone() for q,v in net.state_dict().items()}; net.load_state_dict(ema); say('')
            if step>1000: save(net,name,step,[])
            net.load_state_dict(keep)
    end.set(); net.load_state_dict(ema); v=say('END'); save(net,name,step,v)
def save(net,name,step,v):
    np.savez(OUT+'/part.npz',steps=step,val=np.array(v),**{k:t.detach().cpu().numpy().astype(np.float16 if t.numel()>6000 else np.float32) for k,t in net.state_dict().items()})
    os.replace(OUT+'/part.npz',OUT+'/'+name+'.npz')
def bench():
    if DEV!='cuda' or MODE!='auto':
        Conv.mode='2d' if MODE=='2d' else '3d'; return
    res={}
    for mode in ('3d','2d'):
        Conv.mode=mode; net=Net(C,B,K).to(DEV); x=torch.randn(16,64,20,20,20,device=DEV); k=torch.randn(16,K,device=DEV)
        for it in range(6):
            if it==3: torch.cuda.synchronize(); t=time.time()
            with torch.autocast('cuda',torch.bfloat16): h,u=net(x,k)
            (h.mean()+u.mean()).backward()
        torch.cuda.synchronize(); res[mode]=(time.time()-t)/3
    Conv.mode=min(res,key=res.get); print('bench',res,Conv.mode,flush=True)
if __name__=='__main__':
    os.makedirs(OUT,exist_ok=True); bench()
    held=('lidc0003','fullhead','tciasts047')
    plan=[p.split(':') for p in os.environ['PLAN'].split(',')] # folder:weight:thick:S
    pools=[Pool(f,held,th=='1',int(S)) for f,w,th,S in plan]
    for p in pools: p.start()
    net=Net(C,B,K).to(DEV); print('parameters',sum(p.numel() for p in net.parameters()),flush=True)
    while pools[0].n<60 or len(pools[0].by)<(25 if DEV=='cuda' else 3):
        time.sleep(.3)
        if DEV!='cuda' and pools[0].n>8: break
    print('data after %.0fs'%(time.time()-T0),[p.n for p in pools],flush=True)
    whiten(net,pools[0])
    train(net,pools,[float(p[1]) for p in plan],float(os.environ['SECONDS_']),float(os.environ.get('LR','8e-4')),'net')
    print('whole %.0fs'%(time.time()-T0),flush=True); os._exit(0)
