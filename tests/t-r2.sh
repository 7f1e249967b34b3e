#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Gaussians as a pickle of numpy arrays, as R2-Gaussian keeps them: theirs are read, ours are loaded by
# Python, and none is executed.
. "$srcdir/tests/tap.sh"
python_with numpy || { echo '1..0 # SKIP no numpy'; exit 0; }
ct-phantom -q --size=16x12x8 --spacing=2 sphere base.nii; ok $? 'a base is made'
cat >make.py <<'END'
import os, pickle, numpy as np
r = np.random.default_rng(3)
n = 5
d = {'xyz': r.uniform(-.4, .4, (n, 3)).astype('f4'), 'density': r.uniform(-4, -1, (n, 1)).astype('f4'),
     'scale': r.uniform(-3, 0, (n, 3)).astype('f4'), 'rotation': r.normal(size=(n, 4)).astype('f4'),
     'scale_bound': np.array([.01, .3])}
def save(name, d, p=4, old=False):
    b = pickle.dumps(d, p)
    assert b'numpy.core' in b or b'numpy._core' in b
    if old:  # the names of the other numpy
        b = b.replace(b'\x8c\x15numpy.core.multiarray', b'\x8c\x16numpy._core.multiarray') \
             .replace(b'numpy.core.multiarray\n', b'numpy._core.multiarray\n')
        at = 2 if b[2] != 0x95 else 11
        if b[2] == 0x95:
            b = b[:3] + (len(b) - 11).to_bytes(8, 'little') + b[11:]
    open(name, 'wb').write(b)
for p in 2, 3, 4, 5: save('p%d.pickle' % p, d, p)
for p in 2, 4: save('new%d.pickle' % p, d, p, True)
save('swapped.pickle', {k: v.astype('>f8') for k, v in d.items()})
save('fortran.pickle', {k: np.asfortranarray(v) for k, v in d.items()})
free = dict(d, scale_bound=None, scale=np.log(.01 + .29 / (1 + np.exp(-d['scale']))).astype('f4'))
save('free.pickle', free)
bad = d['xyz'].copy(); bad[3, 1] = np.nan
save('nan.pickle', dict(d, xyz=bad))
save('shape.pickle', dict(d, rotation=d['rotation'][:, :3]))
save('few.pickle', dict(d, density=d['density'][:2]))
save('words.pickle', dict(d, xyz='far'))
save('bound.pickle', dict(d, scale_bound=np.array([.3, .01])))
save('less.pickle', {k: v for k, v in d.items() if k != 'density'})
save('empty.pickle', dict(d, xyz=d['xyz'][:0]))
b = open('p4.pickle', 'rb').read()
open('cut.pickle', 'wb').write(b[:len(b) // 2])
class Evil:
    def __reduce__(self): return os.system, ('touch executed',)
pickle.dump({'xyz': Evil()}, open('evil.pickle', 'wb'), 4)
pickle.dump({'xyz': Evil()}, open('evil2.pickle', 'wb'), 2)
pickle.dump({'xyz': (1).__add__}, open('getattr.pickle', 'wb'), 4)
# the density on the grid of the base: +-1 is half the longest axis, 16 mm
q = d['rotation'] / np.linalg.norm(d['rotation'], axis=1, keepdims=True)
w, x, y, z = q.T
R = np.array([[1-2*(y*y+z*z), 2*(x*y-w*z), 2*(x*z+w*y)], [2*(x*y+w*z), 1-2*(x*x+z*z), 2*(y*z-w*x)],
              [2*(x*z-w*y), 2*(y*z+w*x), 1-2*(x*x+y*y)]]).transpose(2, 0, 1)
s = 16 * (.01 + .29 / (1 + np.exp(-d['scale'].astype('f8'))))
i, j, k = np.indices((16, 12, 8))
at = np.stack([2 * i - 15, 2 * j - 11, 2 * k - 7], -1).reshape(-1, 3)
rho = np.log1p(np.exp(d['density'][:, 0].astype('f8')))
def field(rho):
    f = 0
    for m in range(n):
        u = ((at - 16 * d['xyz'][m]) @ R[m]) / s[m]
        f = f + rho[m] * np.exp(-.5 * (u * u).sum(1))
    return f
raw = d['density'][:, 0].astype('f8')
np.save('want.npy', np.stack([field(rho), field(np.where(raw < 0, .25 * raw, raw))]))
END
"$PY" make.py 2>log; ok $? 'Python makes the pickles of this test'
sed 's/^/# /' log
cat >look.py <<'END'
"""The residual of a volume, HU, against the density at each voxel by the formula."""
import struct, sys, numpy as np
b = open(sys.argv[1], 'rb').read()
got = np.frombuffer(b[-16 * 12 * 8 * 4:], '<f4').reshape(8, 12, 16).transpose(2, 1, 0).ravel() / 4095.
want = np.load('want.npy')[int(sys.argv[2])]
off = np.abs(got - want).max()
print(off, np.abs(want).max())
sys.exit(not off < 0.015 * np.abs(want).max())  # they are cut where they are a hundredth
END
drawn() { # drawn FILE WHICH NAME [OPTION...]
	file=$1 which=$2 name=$3; shift 3
	ct-compose -q -f "$@" --residual-out=res.nii base.nii "$file" out.nii 2>err && ct-convert -q -f --type f32 res.nii f.nii &&
		"$PY" look.py f.nii "$which" >log 2>&1; ok $? "$name"
	sed 's/^/# /' err log
}
for p in 2 3 4 5; do drawn p$p.pickle 0 "a pickle of protocol $p is read: each voxel has its density"; done
for p in 2 4; do drawn new$p.pickle 0 "the names of the other numpy are read, protocol $p"; done
drawn swapped.pickle 0 'doubles of the other order of bytes are read'
drawn fortran.pickle 0 'columns first are read'
drawn free.pickle 0 'without scale_bound the scales are logarithms'
drawn p4.pickle 1 'a slope makes them PReLU' --expert gamma=0.25
ct-compose -q -f base.nii p4.pickle by.nii && "$builddir/tests/one-step" compose base.nii p4.pickle lib.nii && ct-convert -q -f --type f32 by.nii a.nii &&
	ct-convert -q -f --type f32 lib.nii b.nii && tail -c 6144 a.nii >a && tail -c 6144 b.nii >b && cmp -s a b
ok $? 'the library composes a pickle to the voxels of ct-compose'
exits 0 'ct-info tells of Gaussians of R2-Gaussian' ct-info p4.pickle
has out '^gaussians  *5' 'ct-info counts the Gaussians of a pickle'
no() { # no FILE WORDS NAME
	exits 3 "$3 is refused with status 3" ct-info "$1"
	has err "$1: $2" "the error of $3 names file and key"
}
no nan.pickle "key 'xyz': number 1 of Gaussian 3 is not finite" 'a number that is not finite'
no shape.pickle "key 'rotation': is not of shape 5x4" 'another shape'
no few.pickle "key 'density': is not of shape 5x1" 'too few densities'
no words.pickle "key 'xyz': " 'a word for an array'
no bound.pickle "key 'scale_bound': 0.3 and 0.01" 'a bound that is none'
no less.pickle "key 'density' is missing" 'a key that is missing'
no empty.pickle "key 'xyz': " 'an empty set'
no cut.pickle '.*ends ' 'a pickle that is cut'
no evil.pickle 'STACK_GLOBAL at byte .*: posix.system is nothing' 'a pickle that would run a command'
no evil2.pickle 'GLOBAL at byte .*: posix.system is nothing' 'an old pickle that would run a command'
no getattr.pickle 'STACK_GLOBAL at byte .*getattr is nothing' 'a pickle that looks for a function'
[ ! -e executed ]; ok $? 'no command of a pickle is run'

# ours
ct-project -q -n 4 base.nii p.exr && ct-degrade -q -x 2 base.nii lr.nii && ct-upsample -q lr.nii up.nii
exits 0 'ct-nabgs writes a pickle' ct-nabgs -q -b up.nii -g 40 -n 3 p.exr g.pickle
exits 0 'and PLY of the same' ct-nabgs -q -b up.nii -g 40 -n 3 p.exr g.ply
"$PY" - >log 2>&1 <<'END'; ok $? 'Python loads our pickle: arrays, shapes and no bound'
import pickle, numpy as np
d = pickle.load(open('g.pickle', 'rb'))
assert d['xyz'].dtype == np.float32 and d['xyz'].shape == (40, 3) and np.abs(d['xyz']).max() <= 1.1, d['xyz']
assert d['density'].shape == (40, 1) and d['scale'].shape == (40, 3) and d['rotation'].shape == (40, 4)
assert d['scale_bound'] is None and d['scale'].max() < 0
assert d['activation'] == 'prelu' and 0 < float(d['gamma']) <= 1
END
sed 's/^/# /' log
ct-compose -q -f --residual-out=ra.nii up.nii g.pickle a.nii && ct-compose -q -f --residual-out=rb.nii up.nii g.ply b.nii && ct-metrics --range 1000 ra.nii rb.nii >m
awk '$1 == "max-hu" && $2 < 0.05 {good = 1} END {exit !good}' m && [ "$(ct-info rb.nii | awk '$1 == "sd" {print ($2 > 0.1)}')" != 0 ]; ok $? 'ours is read again, and makes the same CT'
sed 's/^/# /' m
# axes that are no world's, in another order and mirrored
for o in LPS ASR LAS; do
	ct-convert -q -f --reorient=$o up.nii o.nii
	ct-nabgs -q -f -b o.nii -g 40 -n 3 p.exr o.pickle; ct-nabgs -q -f -b o.nii -g 40 -n 3 p.exr o.ply
	ct-compose -q -f --residual-out=ra.nii o.nii o.pickle a.nii && ct-compose -q -f --residual-out=rb.nii o.nii o.ply b.nii &&
		ct-metrics --range 1000 ra.nii rb.nii >m; awk '$1 == "max-hu" && $2 < 0.01 {good = 1} END {exit !good}' m
	ok $? "a pickle keeps Gaussians on a grid of axes $o"
done
done_testing
