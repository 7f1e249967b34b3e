import os,sys,glob; os.environ['WIDTH']='96'; os.environ['BLOCKS']='8'
import train; from train import *
Conv.mode='3d'; z=np.load(sys.argv[1]); net=Net(96,8,8); net.load_state_dict({k:torch.from_numpy(z[k].astype(np.float32)) for k in net.state_dict()}); net.eval()
p=Pool('val4',(),False,4); R=[]
def d2s(h):
    b,_,d,hh,w=h.shape; return h.reshape(b,4,4,4,d,hh,w).permute(0,4,1,5,2,6,3).reshape(b,d*4,hh*4,w*4)
with torch.no_grad():
    for f in sorted(glob.glob('val4/*.bin')):
        e=p.load(f,f); d=e[0]; x=s2d(d[:1].float()/8/UNIT_IN)
        h,u=net(x,torch.tensor([cond(e[1],e[2],e[3],e[4],4)])); c=d2s(h*UNIT_OUT)[0].numpy().ravel(); r=(d[1].float()/16).numpy().ravel()
        m=np.fromfile(f+'.h','<f4'); 
        if m.size!=r.size: print('size',f); continue
        E=(r**2).sum(); A=np.array([[m@m,m@c],[m@c,c@c]]); b=np.array([m@r,c@r]); w=np.linalg.solve(A,b)
        v=lambda h: ((r-h)**2).sum()/E
        R.append((v(m),v(c),v(.7*m+.3*c),v(.8*m+.2*c),v(m+.3*c),*w,v(w[0]*m+w[1]*c))); print(f[5:25],*['%.4f'%q for q in R[-1]])
print(np.mean(R,0))
