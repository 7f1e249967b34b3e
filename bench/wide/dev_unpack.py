import numpy as np, lzma, struct, sys, os, glob
from multiprocessing import Pool
def one(f):
    b=open(f,'rb').read(); *n,step,base,m=struct.unpack('<6i',b[:24]); k=n[0]*n[1]*n[2]
    r=np.frombuffer(lzma.decompress(b[24:]),'u1'); d=(r[:k].astype('<u2')|(r[k:].astype('<u2')<<8)).view('<i2').reshape(n).astype(np.int32)
    q=np.cumsum(d,axis=0) if m else d
    x=(q*step+base).astype('<i2')
    h=bytearray(352); h[0:4]=struct.pack('<i',348); h[40:56]=struct.pack('<8h',3,n[2],n[1],n[0],1,1,1,1)
    h[70:74]=struct.pack('<2h',4,16); h[76:108]=struct.pack('<8f',1,1,1,1,1,1,1,1); h[108:120]=struct.pack('<3f',352,1,0); h[123]=2
    h[252:256]=struct.pack('<2h',1,1); h[280:328]=struct.pack('<12f',1,0,0,0, 0,1,0,0, 0,0,1,0); h[344:348]=b'n+1\0'
    o=sys.argv[2]+'/'+os.path.basename(f)[:-3]+'.nii'
    open(o+'.part','wb').write(bytes(h)+x.tobytes()); os.rename(o+'.part',o)
if __name__=='__main__':
    os.makedirs(sys.argv[2],exist_ok=True)
    with Pool() as p: p.map(one,sorted(glob.glob(sys.argv[1]+'/*.pk'),key=lambda f:-os.path.getsize(f)),chunksize=1)
