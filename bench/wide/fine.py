import os,sys,copy,signal; os.environ['WIDTH']='96'; os.environ['BLOCKS']='8'
import train; from train import *
from concurrent.futures import ThreadPoolExecutor
Conv.mode='3d'; torch.set_num_threads(1)
SEC=float(sys.argv[1]); LR=float(sys.argv[2]); INIT=sys.argv[3]; OUTF=sys.argv[4]
class P2(Pool):
    def scan(s):
        fs=[f for f in os.listdir(s.f) if f.endswith('.bin.h') and f not in s.seen]; random.shuffle(fs)
        for f in fs:
            if time.time()-os.path.getmtime(s.f+'/'+f)<3: continue
            s.seen.add(f); b=s.f+'/'+f[:-2]; e=s.load(b,f); n=np.fromfile(b,dtype='<i4',count=3)
            h=np.fromfile(s.f+'/'+f,'<f4').reshape(n[2],n[1],n[0]); d=e[0].numpy(); sh=d.shape[1:]
            h=h[:sh[0],:sh[1],:sh[2]]; d[1]=np.clip(np.round(d[1].astype(np.float32)-16*h),-32768,32767).astype(np.int16)
            dev=max(float((d[1].astype(np.float32)**2).mean())**.5/16,1.)
            e=(torch.from_numpy(d),*e[1:5],dev)
            with s.lock: s.by.setdefault(f[:f.rfind('-')],[]).append(e); s.n+=1
pool=P2('exf',(),False,4); val=P2('val4',(),False,4); val.scan(); vals=[e for l in val.by.values() for e in l]; pool.scan(); pool.start()
z=np.load(INIT); net=Net(96,8,8); net.load_state_dict({k:torch.from_numpy(z[k].astype(np.float32)) for k in net.state_dict()})
if 'gpu' in INIT:
    with torch.no_grad(): net.last.w*=.43; net.lb*=.43
for q in (net.err.w,net.eb): q.requires_grad_(False)
def rep():
    c=copy.deepcopy(net)
    for a,b in zip(c.parameters(),net.parameters()): a.data=b.data
    return c
reps=[rep(),rep()]; ex=ThreadPoolExecutor(2); ema={k:v.clone() for k,v in net.state_dict().items()}
ps=[p for p in net.parameters() if p.requires_grad]; opt=torch.optim.AdamW(ps,lr=LR,betas=(.9,.99),weight_decay=.01)
def part(a):
    c,r=a; x,t,m,k,w=pool.batch(r,2*48**3); h,u=c(x,k); d=((h-t)**2).mean(1); ww=w[:,None,None,None]*m; n=m.sum(); loss=(ww*d).sum()/n
    c.zero_grad(); loss.backward(); return loss.item(),((ww*(t**2).mean(1)).sum()/n).item()
def vone(a):
    c,e=a
    with torch.no_grad():
        d=e[0]; x=s2d(d[:1].float()/8/UNIT_IN); r=s2d(d[1:2].float()/16/UNIT_OUT); h,u=c(x,torch.tensor([cond(e[1],e[2],e[3],e[4],4)])); return ((h-r)**2).sum().item()/(r**2).sum().item()
def validate_(nets):
    return float(np.mean(list(ex.map(vone,[(nets[i%2],e) for i,e in enumerate(vals)]))))
def save_(): 
    np.savez(OUTF+'.part.npz',step=step,**{k:v.numpy() for k,v in ema.items()}); os.replace(OUTF+'.part.npz',OUTF)
step=0; start=time.time(); rs=[random.Random(11),random.Random(12)]; A=B=0.; nextv=0; stop=[]
signal.signal(signal.SIGTERM,lambda *a: stop.append(1))
while not stop:
    t=(time.time()-start)/SEC
    if time.time()-start>=nextv or t>=1:
        nextv+=600; keep={k:v.clone() for k,v in net.state_dict().items()}
        for k,v in net.state_dict().items(): v.copy_(ema[k])
        print('%.0fs step %d val %.4f pool %d %d'%(time.time()-start,step,validate_(reps),pool.n,len(pool.by)),flush=True)
        for k,v in net.state_dict().items(): v.copy_(keep[k])
        save_()
    if t>=1: break
    for g in opt.param_groups: g['lr']=LR*min(1,(step+1)/50)*.5*(1+math.cos(math.pi*min(t,1)))
    out=list(ex.map(part,zip(reps,rs)))
    for q,(a,b) in zip(net.parameters(),zip(*[c.parameters() for c in reps])):
        if q.requires_grad: q.grad=(a.grad+b.grad)/2
    gn=nn.utils.clip_grad_norm_(ps,.5)
    if math.isfinite(float(gn)): opt.step()
    step+=1
    with torch.no_grad():
        al=min(.995,(1+step)/(10+step))
        for k,v in net.state_dict().items(): ema[k].mul_(al).add_(v,alpha=1-al)
    A+=sum(o[0] for o in out); B+=sum(o[1] for o in out)
    if step%50==0: print(step,'%.0fs train %.4f'%(time.time()-start,A/B),flush=True); A=B=0.
save_(); os._exit(0)
