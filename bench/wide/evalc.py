import os,sys,glob; os.environ['WIDTH']='96'; os.environ['BLOCKS']='8'
import train; from train import *
Conv.mode='3d'; z=np.load(sys.argv[1]); net=Net(96,8,8); net.load_state_dict({k:torch.from_numpy(z[k].astype(np.float32)) for k in net.state_dict()}); net.eval()
p=Pool('val4',(),False,4); tot=0; fs=sorted(glob.glob('val4/*.bin'))
with torch.no_grad():
    for f in fs:
        e=p.load(f,f); d=e[0]; x=s2d(d[:1].float()/8/UNIT_IN); r=s2d(d[1:2].float()/16/UNIT_OUT)
        h,u=net(x,torch.tensor([cond(e[1],e[2],e[3],e[4],4)])); q=((h-r)**2).sum().item()/(r**2).sum().item(); tot+=q; print(f[5:40],e[3],'%.2f %.0f: %.4f'%(e[1],e[2],q))
print('mean %.4f'%(tot/len(fs)))
