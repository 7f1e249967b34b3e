#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-metrics against scikit-image, and its statuses.
. "$srcdir/tests/tap.sh"
if ! python_with nibabel,skimage.metrics; then
	echo '1..0 # skip no nibabel, scikit-image'
	exit 0
fi
"$PY" - <<'PY'
import nibabel as nib, numpy as np
rng = np.random.default_rng(2)
n = (44, 37, 19)
x, y, z = np.indices(n)
a = 700*np.sin(x/6)*np.cos(y/5) + 40*z
a[(x - 20)**2 + (y - 18)**2 > 300] = -1000
b = a + 60*rng.standard_normal(n)
affine = np.diag([1., 1, 2, 1])
def save(v, name, m=affine):
    nib.save(nib.Nifti1Image(v.astype(np.float32), m), name)
save(a, 'ref.nii')
save(b, 'test.nii')
save(np.where(np.arange(n[2]) < 9, b, np.nan), 'nan.nii')
save(b, 'moved.nii', np.diag([1., 1, 3, 1]))
save(b[:, :, 1:], 'short.nii')
save(a[:6, :6], 'tiny.nii')
save((x > 20) & (z > 3), 'mask.nii'); save(0*x, 'no-mask.nii')
save(np.where(a == -1000, -1024, b), 'noisy.nii')
PY
exits 0 'ct-metrics compares two volumes with --ssim all' ct-metrics --ssim all --json ref.nii test.nii
mv out all.json
exits 0 'ct-metrics compares two volumes within a mask' ct-metrics --ssim all --json --mask mask.nii ref.nii test.nii
mv out mask.json
ct-convert -q --crop 0:9,0:9,0:9 mask.nii small-mask.nii
exits 5 'a mask of another grid' ct-metrics --mask small-mask.nii ref.nii test.nii; has err '^ct-metrics: small-mask.nii: grids differ' 'the error of a mask of another grid names the mask'
exits 3 'an empty mask is refused' ct-metrics --mask no-mask.nii ref.nii test.nii; has err '^ct-metrics: no-mask.nii: the mask is empty' 'the error of an empty mask names the mask'
exits 0 'ct-metrics compares two volumes with --mask padding' ct-metrics --ssim none --json --mask padding noisy.nii test.nii
"$PY" - >log 2>&1 <<'PY'; ok $? 'the padding of REF does not count'
import json
n = sum((x - 20)**2 + (y - 18)**2 <= 300 for x in range(44) for y in range(37))*19
assert json.load(open('out'))['voxels'] == n, (json.load(open('out'))['voxels'], n)
PY
exits 0 'ct-metrics compares two volumes with a range' ct-metrics --ssim all --json --range 2500 ref.nii test.nii
mv out range.json
exits 0 'ct-metrics compares two volumes in a window' ct-metrics --ssim none --window -200:300 ref.nii test.nii
mv out window.txt
"$PY" - >log 2>&1 <<'PY'; ok $? 'PSNR, SSIM and errors are those of scikit-image and NumPy'
import json, nibabel as nib, numpy as np
from skimage.metrics import structural_similarity as ssim, peak_signal_noise_ratio as psnr
a, b = (nib.load(f).get_fdata().astype(np.float64) for f in ('ref.nii', 'test.nii'))
mask = nib.load('mask.nii').get_fdata() > 0
def window(v, lo=-512, hi=3071):
    return (np.clip(v, lo, hi) - lo)/(hi - lo)
box = dict(win_size=7, gaussian_weights=False, use_sample_covariance=True)
wang = dict(gaussian_weights=True, sigma=1.5, use_sample_covariance=False)
def near(name, got, want, tol):
    print(name, got, want, abs(got - want))
    assert abs(got - want) < tol
def zero_padded(x, y):
    """11x11 Gaussian, zeros outside, all pixels."""
    from scipy.ndimage import convolve1d
    g = np.exp(-np.arange(-5, 6)**2/4.5)
    g /= g.sum()
    f = lambda v: convolve1d(convolve1d(v, g, 0, mode='constant'), g, 1, mode='constant')
    mx, my = f(x), f(y)
    sx, sy, sxy = f(x*x) - mx*mx, f(y*y) - my*my, f(x*y) - mx*my
    return ((2*mx*my + 1e-4)*(2*sxy + 9e-4)/((mx*mx + my*my + 1e-4)*(sx + sy + 9e-4))).mean()
def slices(f, x, y, axis, **k):
    return [f(np.take(x, i, axis), np.take(y, i, axis), **k) for i in range(x.shape[axis])]
r = json.load(open('all.json'))
x, y = window(a), window(b)
near('psnr', r['psnr'], psnr(x, y, data_range=1), 1e-6)
near('skimage', r['ssim-skimage'], np.mean(slices(ssim, x, y, 2, data_range=1, **box)), 1e-5)
near('wang', r['ssim-wang'], np.mean(slices(ssim, x, y, 2, data_range=1, **wang)), 1e-5)
axes = []
for axis in range(3):
    kept = [i for i in range(x.shape[axis]) if np.take(x, i, axis).max() > 0]
    axes.append(np.mean([zero_padded(np.take(x, i, axis), np.take(y, i, axis)) for i in kept]))
assert sum(np.take(x, i, 0).max() <= 0 for i in range(x.shape[0])) > 0   # some are left out
near('r2', r['ssim-r2'], np.mean(axes), 1e-5)
u11 = dict(win_size=11, gaussian_weights=False, use_sample_covariance=True)
near('skimage11', r['ssim-skimage11'], np.mean(slices(ssim, x, y, 2, data_range=1, **u11)), 1e-5)
near('3d', r['ssim-3d'], ssim(x, y, data_range=1), 1e-5)
near('3d-gauss', r['ssim-3d-gauss'], ssim(x, y, data_range=1, **wang), 1e-5)
for axis, mm in zip(range(3), (1, 1, 2)):
    g = np.diff(b - a, axis=axis)/mm
    near('gradient', r['gradient-%s-hu-mm' % 'ijk'[axis]], np.sqrt((g**2).mean()), 1e-6)
near('max', r['max-hu'], np.abs(b - a).max(), 1e-6)
near('mae', r['mae-hu'], np.abs(b - a).mean(), 1e-6)
near('rmse', r['rmse-hu'], np.sqrt(((b - a)**2).mean()), 1e-6)
near('bias', r['bias-hu'], (b - a).mean(), 1e-6)
r = json.load(open('mask.json'))
near('mask psnr', r['psnr'], psnr(x[mask], y[mask], data_range=1), 1e-6)
kept = []
for i in range(x.shape[2]):
    s = ssim(x[..., i], y[..., i], data_range=1, full=True, **box)[1]
    inside = mask[..., i].copy()
    inside[:3] = inside[-3:] = inside[:, :3] = inside[:, -3:] = False
    if inside.any():
        kept.append(s[inside].mean())
near('mask ssim', r['ssim-skimage'], np.mean(kept), 1e-5)
assert r['voxels'] == mask.sum()
s3 = ssim(x, y, data_range=1, full=True)[1]
inside = mask.copy()
for axis in range(3):
    np.moveaxis(inside, axis, 0)[[0, 1, 2, -3, -2, -1]] = False
near('mask 3d', r['ssim-3d'], s3[inside].mean(), 1e-5)
both = mask[:, :, 1:] & mask[:, :, :-1]
g = np.diff(b - a, axis=2)[both]/2
near('mask gradient', r['gradient-k-hu-mm'], np.sqrt((g**2).mean()), 1e-6)
r = json.load(open('range.json'))
near('range psnr', r['psnr'], psnr(a, b, data_range=2500), 1e-6)
near('range ssim', r['ssim-skimage'], np.mean(slices(ssim, a, b, 2, data_range=2500, **box)), 1e-5)
t = dict(l.split() for l in open('window.txt'))
near('window psnr', float(t['psnr']), psnr(window(a, -200, 300), window(b, -200, 300), data_range=1), 2e-6)
assert t['window'] == '-200:300' and 'ssim-r2' not in t
PY
sed 's/^/# /' log
ct-metrics ref.nii test.nii >text
awk '{print $1}' text | tr '\n' ' ' >names
[ "$(cat names)" = 'window range voxels psnr ssim-r2 mae-hu rmse-hu bias-hu max-hu '\
'gradient-i-hu-mm gradient-j-hu-mm gradient-k-hu-mm ' ]; ok $? 'a line a name'
for t in 1 4; do
	ct-metrics -t $t --ssim all --json --per-slice s$t.csv ref.nii test.nii >t$t
done
cmp -s s1.csv s4.csv; ok $? '1 and 4 threads, same table'
cmp -s t1 t4; ok $? '1 and 4 threads, same bytes'
exits 0 'ct-metrics reads TEST from a stream' sh -c 'cat test.nii | ct-metrics ref.nii -'
cmp -s out text; ok $? 'TEST from a stream gives the same metrics'
exits 0 'equal volumes pass a PSNR of 99 and an SSIM of 1' ct-metrics --min psnr=99,ssim-r2=1 ref.nii ref.nii
has out '^psnr inf$' 'equal volumes have an infinite PSNR'
ct-metrics --json ref.nii ref.nii >json; "$PY" -c 'import json; assert json.load(open("json"))["psnr"] is None'
ok $? 'an infinite PSNR is null in JSON'
exits 3 'a PSNR below --min ends with status 3' ct-metrics --min psnr=60 ref.nii test.nii
has out '^psnr' 'a PSNR below --min is reported all the same'
has err 'below 60' 'a PSNR below --min is named in the error'
exits 3 'an SSIM below --min ends with status 3' ct-metrics --min ssim-r2=0.99999 ref.nii test.nii
exits 5 'a TEST of another spacing is refused with status 5' ct-metrics ref.nii moved.nii
exits 5 'a TEST of another size is refused with status 5' ct-metrics ref.nii short.nii
exits 5 'refuses slices smaller than the window' ct-metrics --ssim skimage tiny.nii tiny.nii; has err '^ct-metrics: tiny.nii: .* are smaller than the window of SSIM skimage: .ct-metrics --ssim none. leaves it out$' 'slices smaller than the window are refused with what leaves it out'
exits 6 'a NaN in TEST is refused with status 6' ct-metrics ref.nii nan.nii
has err 'nan.nii: voxel (0,0,9) is NaN' 'the error of a NaN in TEST names the voxel'
exits 2 'window and range exclude each other' ct-metrics --window 0:1 --range 1 ref.nii test.nii
exits 2 'one stream cannot be both' ct-metrics - -

# Tables.
"$PY" - >log 2>&1 <<'PY'; ok $? 'the tables are those of scikit-image and NumPy'
import csv, nibabel as nib, numpy as np
from skimage.metrics import structural_similarity as ssim, peak_signal_noise_ratio as psnr
a, b = (nib.load(f).get_fdata().astype(np.float64) for f in ('ref.nii', 'test.nii'))
x, y = ((np.clip(v, -512, 3071) + 512)/3583 for v in (a, b))
np.seterr(divide='ignore')   # slices that clip to equal ones have infinite PSNR
rows = list(csv.DictReader(open('s1.csv')))
assert len(rows) == sum(a.shape)
def near(got, want, tol):
    assert float(got) == want or abs(float(got) - want) < tol, (got, want)
for r in rows:
    axis, k = 'ijk'.index(r['axis']), int(r['slice'])
    p, q, u, v = (np.take(f, k, axis) for f in (a, b, x, y))
    assert int(r['voxels']) == p.size
    near(r['psnr'], psnr(u, v, data_range=1), 1e-5)
    near(r['mae-hu'], np.abs(q - p).mean(), 1e-4)
    near(r['rmse-hu'], np.sqrt(((q - p)**2).mean()), 1e-4)
    near(r['bias-hu'], (q - p).mean(), 1e-4)
    near(r['ssim-skimage'], ssim(u, v, data_range=1), 1e-5)
    assert (r['ssim-r2'] == '') == (u.max() <= 0)
    if axis < 2:
        assert r['ssim-3d'] == ''
    elif 3 <= k < a.shape[2] - 3:
        near(r['ssim-3d'], ssim(x[..., k-3:k+4], y[..., k-3:k+4], data_range=1), 1e-5)
    if k + 1 < a.shape[axis]:
        d = (np.take(b - a, k + 1, axis) - (q - p))/(1, 1, 2)[axis]
        near(r['gradient-hu-mm'], np.sqrt((d**2).mean()), 1e-4)
    else:
        assert r['gradient-hu-mm'] == ''
PY
sed 's/^/# /' log
ct-metrics --per-slice - ref.nii test.nii >out
[ "$(wc -l <out)" -eq $((44 + 37 + 19 + 1)) ]; ok $? 'a table to standard output takes the place of the report'
exits 4 'an old table is kept' ct-metrics --per-slice s1.csv ref.nii test.nii
exits 2 '--csv and a table of slices cannot both be standard output' ct-metrics --per-slice - --csv ref.nii test.nii

# Thresholds.
exits 0 'figures within all of --min and --max end with status 0' ct-metrics --min psnr=20,ssim-r2=0.1 \
	--max mae-hu=60,rmse-hu=70,gradient-i-hu-mm=95 ref.nii test.nii
exits 3 'an MAE above --max ends with status 3' ct-metrics --max mae-hu=40 ref.nii test.nii
has err 'mae-hu .* is above 40' 'an error above --max in HU is named in the error'
exits 3 'an RMSE above --max ends with status 3' ct-metrics --max mae-hu=60,rmse-hu=50 ref.nii test.nii
exits 3 'misses a gradient error' ct-metrics --max gradient-k-hu-mm=20 ref.nii test.nii
exits 2 'a limit for a figure of two numbers' ct-metrics --max window=3 ref.nii test.nii; exits 2 'a limit for a figure that is not reported' ct-metrics --max residual-max-hu=1 ref.nii test.nii
has err "^ct-metrics: --max: the report has no figure 'residual-max-hu' of one number$" 'is refused by name'
for v in rmse-hu rmse-hu= rmse-hu=a rmse-hu=1a =1 '' rmse-hu=70, rmse-hu=nan a_name_that_is_longer_than_any_figure_is=1; do
	exits 2 "--max '$v' is refused before a file is read" ct-metrics --max "$v" none.nii none.nii
done

# Volumes that are out of the ordinary.
"$PY" - <<'PY'
import nibabel as nib, numpy as np
def save(v, name, dtype=np.float32):
    nib.save(nib.Nifti1Image(v.astype(dtype), np.eye(4)), name)
n = (24, 23, 22)
save(np.full(n, 100), 'flat100.nii')
save(np.full(n, 300), 'flat300.nii')
v = np.zeros(n); v[12, 11, 10] = 1e20
save(v, 'impulse.nii')
save(np.zeros(n), 'zero.nii')
x, y, z = np.indices(n)
v = np.where((x + y + z) % 2, 32767, -32768)
save(v, 'low16.nii', np.int16)
save(np.roll(v, 1, 0), 'high16.nii', np.int16)
rng = np.random.default_rng(5)
a = 300*rng.standard_normal((30, 25, 1)); b = a + 50*rng.standard_normal(a.shape)
save(a, 'thin-a.nii'); save(b, 'thin-b.nii')
save(a.reshape(1, 30, 25), 'side-a.nii'); save(b.reshape(1, 30, 25), 'side-b.nii')
big = 1e6 + 40*rng.standard_normal(n)
bright = 2900 + 100*rng.standard_normal(n)
save(bright, 'bright-a.nii'); save(bright + 100*rng.standard_normal(n), 'bright-b.nii')
save(big, 'big-a.nii'); save(big + 10*rng.standard_normal(n), 'big-b.nii')
PY
ct-metrics --ssim all --json flat100.nii flat300.nii >flat.json
ct-metrics --ssim all --json --range 255 impulse.nii zero.nii >impulse.json
ct-metrics --ssim all --json --range 65535 low16.nii high16.nii >int16.json
exits 0 'volumes of one slice are compared with --ssim all' ct-metrics --ssim all --json thin-a.nii thin-b.nii
mv out thin.json
has err 'ssim-3d is left out: its window is larger than the volume' 'what needs more is left out, and said so'
exits 5 'and refused if asked for' ct-metrics --ssim 3d thin-a.nii thin-b.nii
exits 5 'as is a thin slice' ct-metrics --ssim wang side-a.nii side-b.nii
exits 0 'volumes of one voxel along i are compared by default' ct-metrics side-a.nii side-b.nii
has out '^gradient-i-hu-mm nan$' 'an axis of one voxel has no gradient'
ct-metrics --ssim all --json bright-a.nii bright-b.nii >bright.json
ct-metrics --ssim all --json --range 1600 bright-a.nii bright-b.nii >near.json
ct-metrics --ssim all --json --range 400 big-a.nii big-b.nii >big.json
exits 3 'a reference all below the window has no slices to count' \
	ct-metrics -w 500:600 flat100.nii flat300.nii
has err '^ct-metrics: flat100.nii: no value is above 500' 'the error names the reference and the end of the window'
"$PY" - >log 2>&1 <<'PY'; ok $? 'constant, impulse, int16, thin and far from zero: as stated'
import json, math, nibabel as nib, numpy as np
from skimage.metrics import structural_similarity as ssim
load = lambda f: json.load(open(f))
data = lambda f: nib.load(f).get_fdata().astype(np.float64)
def near(got, want, tol=1e-5):
    print(got, want)
    assert abs(got - want) < tol
wang = dict(gaussian_weights=True, sigma=1.5, use_sample_covariance=False)
r = load('flat.json')
u, v = 612/3583, 812/3583
near(r['psnr'], -20*math.log10(200/3583))
for k in ('skimage', 'wang', 'skimage11', '3d', '3d-gauss'):
    near(r['ssim-' + k], (2*u*v + 1e-4)/(u*u + v*v + 1e-4), 1e-6)
assert r['max-hu'] == 200 and r['gradient-k-hu-mm'] == 0
r = load('impulse.json')
a, b = data('impulse.nii'), data('zero.nii')
near(r['psnr'], 20*math.log10(255*math.sqrt(a.size)/a.max()), 1e-6)
near(r['ssim-3d'], ssim(a, b, data_range=255))
near(r['ssim-skimage'], np.mean([ssim(a[..., k], b[..., k], data_range=255) for k in range(22)]))
r = load('int16.json')
a, b = data('low16.nii'), data('high16.nii')
near(r['rmse-hu'], np.sqrt(((a - b)**2).mean()), 1e-6)
near(r['ssim-3d'], ssim(a, b, data_range=65535))
near(r['ssim-3d-gauss'], ssim(a, b, data_range=65535, **wang))
r = load('thin.json')
x, y = ((np.clip(data(f), -512, 3071) + 512)[..., 0]/3583 for f in ('thin-a.nii', 'thin-b.nii'))
near(r['ssim-skimage'], ssim(x, y, data_range=1))
near(r['ssim-wang'], ssim(x, y, data_range=1, **wang))
assert 'ssim-3d' not in r and r['gradient-k-hu-mm'] is None
# bright noise, in the window, and about twice the range: as inexact as single precision gets
a, b = data('bright-a.nii'), data('bright-b.nii')
x, y = ((np.clip(v, -512, 3071) + 512)/3583 for v in (a, b))
for r, u, v, top in (load('bright.json'), x, y, 1), (load('near.json'), a, b, 1600):
    near(r['ssim-3d'], ssim(u, v, data_range=top), 2e-6)
    near(r['ssim-3d-gauss'], ssim(u, v, data_range=top, **wang), 2e-6)
    near(r['ssim-wang'], np.mean([ssim(u[..., k], v[..., k], data_range=top, **wang)
                                  for k in range(22)]), 2e-6)
r = load('big.json')
a, b = data('big-a.nii'), data('big-b.nii')
# means of 1e6 leave a luminance term of 1: what is left is that of the volumes less 1e6
near(r['ssim-3d'], ssim(a - 1e6, b - 1e6, data_range=400, K1=1e6))
PY
sed 's/^/# /' log

# The data residual needs no ground truth.
ct-degrade -x 4,4,2 ref.nii lr.nii && ct-upsample lr.nii up.nii
exits 0 'ct-metrics --consistency compares a result with its scan' ct-metrics --consistency lr.nii up.nii
has out '^factor 4,4,2$' 'ct-metrics --consistency reports the factor of the scan'
exits 0 'certifies beside a reference, as JSON' \
	ct-metrics --json --consistency lr.nii --map map.nii.gz ref.nii test.nii
mv out both.json; exits 0 'the volume that it was made of' ct-metrics --max residual-max-hu=0.01 --consistency lr.nii ref.nii
exits 3 'a data residual above --max ends with status 3' ct-metrics --max residual-rms-hu=1 --consistency lr.nii test.nii
has err 'residual-rms-hu .* is above 1' 'a residual above --max is named in the error'
"$PY" - >log 2>&1 <<'PY'; ok $? 'the residual is that of ct-degrade, and its figures those of NumPy'
import json, nibabel as nib, numpy as np, subprocess
subprocess.run(['ct-degrade', '-x', '4,4,2', 'test.nii', 'redo.nii'], check=True)
lr, redo = nib.load('lr.nii'), nib.load('redo.nii')
want = redo.get_fdata() - lr.get_fdata()
m = nib.load('map.nii.gz')
assert np.allclose(m.affine, lr.affine)
assert np.abs(m.get_fdata() - want).max() < 1e-3
r, a = json.load(open('both.json')), np.abs(want)
for k, v in dict(max=a.max(), p95=np.percentile(a, 95), rms=np.sqrt((a*a).mean()),
                 mean=want.mean()).items():
    print(k, r['residual-%s-hu' % k], v)
    assert abs(r['residual-%s-hu' % k] - v) < 1e-3
assert r['residual-voxels'] == want.size and r['psnr'] > 0
PY
sed 's/^/# /' log
ct-info map.nii.gz >info; has info 'residual' 'the map says what it is'
for t in 1 4; do ct-metrics -t $t --consistency lr.nii --map m$t.nii test.nii >c$t; done; cmp -s c1 c4; ok $? '1 and 4 threads, same data residual'
exits 0 'ct-metrics --consistency reads a stream' sh -c 'cat test.nii | ct-metrics --consistency lr.nii -'
cmp -s out c1; ok $? '--consistency of a stream gives the same residual'
exits 0 'the map as a stream' sh -c 'ct-metrics --consistency lr.nii --map - test.nii >m.nii'
cmp -s m.nii m1.nii || "$PY" -c 'import nibabel as n, numpy as np
assert (n.load("m.nii").get_fdata() == n.load("m1.nii").get_fdata()).all()'
ok $? 'is the same map'
exits 3 'a header without operator' ct-metrics --consistency ref.nii test.nii
has err 'ref.nii: the header names no operator' 'a reference without an operator is named in the error'
exits 3 'an upsampled volume is no LR' ct-metrics --consistency up.nii test.nii
exits 5 '--consistency refuses a volume of another grid with status 5' ct-metrics --consistency lr.nii moved.nii; ct-convert --reorient PSR lr.nii lr-psr.nii
exits 5 '--consistency refuses a volume of other axes with status 5' ct-metrics --consistency lr-psr.nii test.nii; has err 'test.nii: its axes are stored .*--reorient RAS of both' '--consistency of a volume of other axes says what mends it'
exits 6 '--consistency refuses a NaN with status 6' ct-metrics --consistency lr.nii nan.nii
exits 2 'one file needs --consistency' ct-metrics ref.nii
has err 'missing TEST' 'a missing TEST is named in the error'
exits 2 'what needs a reference' ct-metrics --consistency lr.nii --ssim r2 test.nii; has err 'ssim: needs REF and TEST$' 'what needs a reference is refused with the names of both'
exits 2 'a map needs --consistency' ct-metrics --map map-none.nii ref.nii test.nii

# Sharpness: a ball and slanted planes under Gaussians of known width.
"$PY" - <<'PY'
import nibabel as nib, numpy as np
from scipy.special import erf
x, y, z = np.indices((56, 52, 50))*.8
def save(sigma, name):
    d = .53*x + .36*y + .77*z
    v = -1000 + 1100*.5*(1 + erf((d - 33)/np.sqrt(2)/sigma))
    nib.save(nib.Nifti1Image(v.astype(np.float32), np.diag([.8, .8, .8, 1])), name)
save(.7, 'sharp.nii'); save(1.3, 'soft.nii')
PY
exits 0 'ct-metrics --edges accepts a slanted edge' ct-metrics --ssim none --edges --json sharp.nii soft.nii
"$PY" - >log 2>&1 <<'PY'; ok $? 'rise and MTF of a slanted edge under a Gaussian: closed form'
import json, math
r = json.load(open('out'))
print(r)
assert r['edges'] > 50
for name, sigma in (('ref', .7), ('test', 1.3)):
    assert abs(r['edge-rise-%s-mm' % name]/(2.5631*sigma) - 1) < .02
    assert abs(r['mtf50-' + name]*sigma/.18739 - 1) < .02
    assert abs(r['mtf10-' + name]*sigma/.34154 - 1) < .03
PY
sed 's/^/# /' log
exits 5 'too small for edges' ct-metrics --ssim none --edges tiny.nii tiny.nii

# structures, through the command
head -c 55296 /dev/zero >zero.raw
ct-convert -q --raw 24x24x24:f32:2 zero.raw water.nii
exits 0 'ct-metrics --edges accepts a volume without edges' ct-metrics --ssim none --edges water.nii water.nii
has out '^mtf50-ref nan$' 'a volume without edges has nan as mtf50-ref'; ct-metrics --edges --max mtf50-ref=1 water.nii water.nii >out 2>err; has err 'mtf50-ref is nan' 'a limit of a figure that is nan says so'
ct-metrics --structures water.nii water.nii >out
[ "$(grep -E '^(soft|struct|false|missed)' out | tr '\n' ' ')" = "soft-tissue-cm3 85.184 structures-bright 0 structures-dark 0 false-bright 0 false-dark 0 missed-bright 0 missed-dark 0 false-bright-per-cm3 0.000000 false-dark-per-cm3 0.000000 missed-bright-per-cm3 0.000000 missed-dark-per-cm3 0.000000 structures-false 0 structures-missed 0 " ]
ok $? 'water is soft tissue without structures'
if python_with nibabel; then
	"$PY" - <<'E2'
import nibabel as n, numpy as np
v = n.load('water.nii'); x = v.get_fdata()
i, j, k = np.mgrid[:24, :24, :24]
x += 100 * np.exp(-((i - 12) ** 2 + (j - 12) ** 2 + (k - 12) ** 2) / 8)
n.save(n.Nifti1Image(x.astype('f4'), v.affine), 'blob.nii')
E2
	got() { ct-metrics --json "$@" | tr ',' '\n' | sed -n 's/.*"\(false-[a-z]*\|missed-[a-z]*\)": \([0-9]*\).*/\1 \2/p' | tr '\n' ' '; }
	[ "$(got --structures water.nii blob.nii)" = 'false-bright 1 false-dark 0 missed-bright 0 missed-dark 0 ' ]
	ok $? 'a blob that the truth does not have is false'
	[ "$(got --structures blob.nii water.nii)" = 'false-bright 0 false-dark 0 missed-bright 1 missed-dark 0 ' ]
	ok $? 'and missed the other way'
fi
# Projections, beside Python: PSNR of all pixels, SSIM of Wang in each view, the means of pixels.
cp "$srcdir/tests/exr.py" .
ct-phantom -q --size 40x40x40 ellipsoids p.nii && ct-phantom -q -s 3 --size 40x40x40 ellipsoids q.nii && ct-project -q -n 3 p.nii p.exr &&
	ct-project -q -n 3 q.nii q.exr && ct-project -q -n 3 --coarsen 4 --pixel mean p.nii low.exr && ct-project -q -n 3 --coarsen 4 --pixel sinc p.nii sinc.exr
exits 0 'two stacks of projections are compared' ct-metrics --ssim all --per-slice views.csv --consistency low.exr --json p.exr q.exr
"$PY" - >log 2>&1 <<'PY'; ok $? 'PSNR, SSIM, errors and the residual of projections are those of NumPy and scikit-image'
import csv, json, numpy as np
from exr import read, size
from skimage.metrics import structural_similarity as ssim
w, h = size('p.exr')
a, b, low = (np.array(read(f)).reshape(3, n, n) for f, n in (('p.exr', h), ('q.exr', h), ('low.exr', h // 4)))
r, top = json.load(open('out')), a.max()
wang = [ssim(x, y, data_range=top, gaussian_weights=True, sigma=1.5, use_sample_covariance=False) for x, y in zip(a, b)]
psnr = lambda x, y: 10 * np.log10(top ** 2 / ((x - y) ** 2).mean())
res = b.reshape(3, h // 4, 4, h // 4, 4).mean((2, 4)) - low
for k, v in dict(range=top, views=3, psnr=psnr(a, b), mae=abs(b - a).mean(), rmse=np.sqrt(((b - a) ** 2).mean()), bias=(b - a).mean(),
                 max=abs(b - a).max()).items():
    assert abs(r[k] - v) < 1e-4, (k, r[k], v)
assert abs(r['ssim-wang'] - np.mean(wang)) < 1e-5 and 'ssim-r2' not in r
assert abs(r['ssim-skimage'] - np.mean([ssim(x, y, data_range=top) for x, y in zip(a, b)])) < 1e-5
assert abs(r['residual-rms'] - np.sqrt((res ** 2).mean())) < 1e-4 and abs(r['residual-percent'] - 100 * np.sqrt((res ** 2).mean()) / low.max()) < 1e-3
for k, row in enumerate(csv.DictReader(open('views.csv'))):
    assert int(row['view']) == k and abs(float(row['psnr']) - psnr(a[k], b[k])) < 1e-4 and abs(float(row['ssim-wang']) - wang[k]) < 1e-5
assert k == 2
PY
sed 's/^/# /' log
exits 0 'projections agree with the pixels they were made of' ct-metrics --max residual-percent=0.001 --consistency low.exr p.exr
exits 0 'pixels cut at their Nyquist frequency are compared as such' ct-metrics --max residual-percent=0.001 --consistency sinc.exr p.exr
exits 3 'projections that miss a limit end with status 3' ct-metrics --max residual-percent=0.001 --consistency low.exr q.exr
exits 0 'REF of projections is read from a stream' sh -c 'ct-metrics - q.exr <p.exr'; ct-project -q -n 3 --beam fan p.nii fan.exr
exits 0 'all definitions of SSIM that fit views of one row are none' ct-metrics --ssim all fan.exr fan.exr; has err 'warning: ssim-wang is left out: its window is larger than the views' 'SSIM of views of one row is left out with a warning'
for t in 1 4; do ct-metrics -t $t --ssim all p.exr q.exr >t$t; done; cmp -s t1 t4; ok $? 'projections give the same figures with 1 and 4 threads'
exits 2 'projections have no window' ct-metrics -w 0:1 p.exr q.exr
exits 2 'projections have no mask' ct-metrics --mask padding p.exr q.exr
exits 2 'projections have no SSIM of volumes' ct-metrics --ssim 3d p.exr q.exr
exits 5 'low-resolution projections of another scan are refused' ct-metrics --consistency q.exr low.exr
exits 3 'projections beside a CT are refused' ct-metrics p.exr p.nii; has err "p.nii: not an EXR file, but a volume" 'the error names what is no projections'

# Several pairs.
exits 0 'several pairs make a line each' ct-metrics --csv p.exr q.exr p.exr p.exr
[ "$(wc -l <out)" -eq 3 ] && sed -n 3p out | grep -q '^"p.exr",.*,inf,1.00000000,'; ok $? 'below one line of names'
head -n 2 out >two; ct-metrics --csv p.exr q.exr | cmp -s - two; ok $? 'the first two lines are those of the first pair alone'
exits 3 'a limit that a pair misses ends the run' ct-metrics --csv --min psnr=99 p.exr q.exr p.exr p.exr
[ "$(wc -l <out)" -eq 3 ]; ok $? 'after all pairs are reported'; has err 'q.exr: psnr .* is below 99' 'the error names the pair that misses a limit'
exits 3 'pairs of other figures are refused' ct-metrics --csv p.exr q.exr p.nii q.nii
exits 2 'several pairs need --csv' ct-metrics p.exr q.exr p.exr q.exr
exits 2 'a REF of several pairs needs its TEST' ct-metrics --csv p.exr q.exr p.exr; has err 'the last REF is p.exr' 'the error names the REF that has no TEST'
exits 2 'a table of slices is of one pair' ct-metrics --csv --per-slice none.csv p.exr q.exr p.exr q.exr

# a thin volume: what can be measured
ct-phantom -q -f --size 32x32x12 ellipsoids thin.nii; ct-phantom -q -f -s 2 --size 32x32x12 ellipsoids thin2.nii
exits 0 'ct-metrics --harm accepts a thin volume' ct-metrics --harm --factor 4 thin.nii thin2.nii
has err '^ct-metrics: warning: thin.nii: 12 voxels along axis 2 are too few for edges, which need 19: left out$' 'says what cannot be measured'
has out '^structures-false' 'and measures the rest'; ! grep -q '^edges' out; ok $? 'a thin volume has no figures of edges'
exits 5 '--edges of a thin volume is refused with status 5' ct-metrics --edges thin.nii thin2.nii

# Surfaces, beside VTK: points by NumPy, nearest places on the triangles of vtkMarchingCubes.
part surface
"$PY" - <<'PY' || exit 99
import nibabel as nib, numpy as np
from scipy.ndimage import gaussian_filter
n, mm = (48, 44, 30), (.7, .8, 1.5)
x, y, z = (i*s for i, s in zip(np.indices(n), mm))
bone = (x - 16)**2 + (y - 17)**2 + (z - 22)**2 < 11**2
a = np.where(bone, 1000., np.where((x - 17)**2 + (y - 17)**2 < 15**2, 40, -1000))
a = gaussian_filter(a, 1) + 8*np.random.default_rng(3).standard_normal(n)
def save(v, name):
    nib.save(nib.Nifti1Image(v.astype(np.float32), np.diag(mm + (1,))), name)
save(a, 'a.nii'); save(gaussian_filter(a, (0, .4, 1.2)) + 30, 'b.nii')
save(np.where(bone, 40, a).clip(max=300), 'soft.nii'); save(x < 18, 'half.nii')
PY
exits 0 'ct-metrics measures two surfaces and prints JSON' ct-metrics --ssim none --surface=520,-500 --json a.nii b.nii; mv out two.json
exits 0 'ct-metrics measures a surface within a mask' ct-metrics --ssim none --surface=520 --json --mask half.nii a.nii b.nii; mv out half.json
if python_with vtk,nibabel; then
	"$PY" - >log 2>&1 <<'PY'; ok $? 'distances of surfaces are those of VTK within 1 %, and counts those of NumPy'
import json, nibabel as nib, numpy as np, vtk
from vtk.util.numpy_support import numpy_to_vtk
mm = (.7, .8, 1.5)
a, b, half = (nib.load(f).get_fdata() for f in ('a.nii', 'b.nii', 'half.nii'))
def points(v, level, mask):
    out = []
    for d in range(3):
        lo, hi = [slice(None)]*3, [slice(None)]*3
        lo[d], hi[d] = slice(0, -1), slice(1, None)
        p, q = v[tuple(lo)], v[tuple(hi)]
        at = np.argwhere(((p >= level) != (q >= level)) & (mask[tuple(lo)] > 0) & (mask[tuple(hi)] > 0))
        i = tuple(at.T)
        at = at.astype(float)
        at[:, d] += (level - p[i])/(q[i] - p[i])
        out.append(at*mm)
    return np.concatenate(out)
def distances(p, v, level):
    image = vtk.vtkImageData()
    image.SetDimensions(v.shape); image.SetSpacing(mm)
    image.GetPointData().SetScalars(numpy_to_vtk(v.ravel('F'), deep=True))
    cubes = vtk.vtkMarchingCubes()
    cubes.SetInputData(image); cubes.SetValue(0, level); cubes.Update()
    locator = vtk.vtkCellLocator()
    locator.SetDataSet(cubes.GetOutput()); locator.BuildLocator()
    near, cell, i, d = [0, 0, 0], vtk.reference(0), vtk.reference(0), vtk.reference(0.)
    out = []
    for q in p:
        locator.FindClosestPoint(q, near, cell, i, d)
        out.append(np.sqrt(d.get()))
    return np.array(out)
def check(r, level, mask, end):
    p, q = points(a, level, mask), points(b, level, mask)
    d = np.concatenate([distances(p, b, level), distances(q, a, level)])
    assert (r['surface-points-ref' + end], r['surface-points-test' + end]) == (len(p), len(q))
    for name, want in ('mean', d.mean()), ('rms', np.sqrt((d*d).mean())), ('p95', np.percentile(d, 95)):
        got = r['surface-%s-mm%s' % (name, end)]
        print(level, name, got, want)
        assert abs(got/want - 1) < .01
every = np.ones(a.shape)
r = json.load(open('two.json'))
check(r, 520, every, '-1'); check(r, -500, every, '-2'); assert r['surface-hu-2'] == -500
check(json.load(open('half.json')), 520, half, '')
PY
	sed 's/^/# /' log
else
	skip 'distances of surfaces are those of VTK' 'no VTK'
fi
for t in 1 4; do ct-metrics -t $t --ssim none --surface=520,-500 --csv a.nii b.nii >t$t; done
cmp -s t1 t4; ok $? 'surfaces give the same bytes with 1 and 4 threads'
head -n 1 t1 | grep -q ',surface-hu-1,surface-points-ref-1,surface-points-test-1,surface-mean-mm-1,surface-rms-mm-1,surface-p95-mm-1,surface-hu-2,'
ok $? 'the figures of several surfaces are columns that end in -1 and -2'
exits 3 'a surface further off than --max ends with status 3' ct-metrics --ssim none --surface=520 --max surface-mean-mm=.001 a.nii b.nii
for v in soft.nii,a.nii a.nii,soft.nii soft.nii,soft.nii; do
	exits 0 "a surface that is not in both of $v is no error" ct-metrics --ssim none --surface=520 "${v%,*}" "${v#*,}"
	has out '^surface-mean-mm nan$' "a surface that is not in both of $v has no distance"
	has err '^ct-metrics: warning: soft.nii: no surface at 520 HU: no distance$' "a warning names the one of $v without a surface"
done
ct-metrics --ssim none --surface=520 --json a.nii soft.nii | tr -d ' ' | grep -q '"surface-p95-mm":null'; ok $? 'JSON has null for a surface that one volume does not have'
exits 3 'no distance passes no limit' ct-metrics --ssim none --surface=520 --max surface-mean-mm=9 a.nii soft.nii
for v in 1,2,3,4,5 a '1,' nan 1e10 ''; do
	exits 2 "a surface of '$v' is refused with status 2" ct-metrics --surface="$v" a.nii b.nii
	has err 'surface' "the error of a surface of '$v' names the option"
done
exits 2 'a surface needs a reference' ct-metrics --consistency a.nii --surface=1 b.nii
exits 2 'projections have no surface' ct-metrics --surface=1 ../p.exr ../q.exr

# What ct-metrics says of harm, against NumPy and SciPy, and how it says it.
part harm
ct-phantom -q --size 40x36x30 --spacing 1.5 ellipsoids hr.nii && ct-degrade -q -x 2 hr.nii lr.nii &&
	ct-upsample -q -m cubic lr.nii up.nii || exit 99
value() { awk -v n="$1" '$1 == n {print $2}' "${2:-out}"; } # value NAME [FILE]

# a line a name, and those of --harm are those of its parts
exits 0 'ct-metrics --harm compares a result with the truth' ct-metrics --harm hr.nii up.nii
mv out harm.txt
ct-metrics --edges --structures --tissues hr.nii up.nii >parts; s=$?
grep -vxFf parts harm.txt | awk '{print $1}' | tr '\n' ' ' >more
[ $s -eq 0 ] && [ "$(cat more)" = 'hfen fsc50 fsc50-mm flat-voxels flat-ref flat-test banding-pieces banding-rms-hu ' ]
ok $? '--harm adds eight figures to those of --edges, --structures and --tissues'
for t in 1 4; do ct-metrics -t $t --harm --json hr.nii up.nii >t$t; done
cmp -s t1 t4; ok $? '--harm prints the same bytes with 1 and 4 threads'

# sizes of structures
sizes() { ct-metrics --ssim none --structures "$@" | sed -n 's/^blob-sigma[-12345]* //p' | tr '\n' ' '; }
[ "$(sizes hr.nii up.nii)" = '1.5 3 ' ]; ok $? 'the sizes of structures follow the factor in the header of TEST'
[ "$(sizes up.nii hr.nii)" = '1.5 ' ]; ok $? 'a TEST that is not refined has one size of structures'
[ "$(sizes -x 4 hr.nii up.nii)" = '3 6 ' ]; ok $? 'the sizes of structures follow -x 4'
[ "$(sizes -x 1,1,4 hr.nii up.nii)" = '0.75,0.75,3 1.5,1.5,6 ' ]
ok $? 'the sizes of structures follow -x for each axis'
[ "$(sizes --expert blob-sigma=1,2.5,7 hr.nii up.nii)" = '1 2.5 7 ' ]
ok $? 'the sizes of structures are those of blob-sigma'
[ "$(sizes --expert blob-sigma=2 hr.nii up.nii)" = '2 ' ]; ok $? 'blob-sigma accepts a single size'
[ "$(sizes -x 100 hr.nii up.nii)" = '75 100 ' ]; ok $? 'no size of structures is larger than 100'
ct-convert -q --iso 1 hr.nii hr1.nii && ct-convert -q --iso 1 up.nii up1.nii
ct-info up1.nii | grep -q '^  upsample'; ok $? 'a refined volume keeps its factor on another grid'
[ "$(sizes hr1.nii up1.nii)" = '1.5 ' ]; ok $? 'a refined volume on another grid has one size of structures'
ct-degrade -q -x 1 --clip -1024:3071 lr.nii other.nii
[ "$(sizes lr.nii other.nii)" = '1.5 ' ]; ok $? 'a scan that is not refined has one size of structures'
for v in 0.2 101 1,2,3,4,5 a '1,' 1,nan ''; do
	exits 2 "a blob-sigma of '$v' is refused with status 2" ct-metrics --structures --expert "blob-sigma=$v" hr.nii up.nii
	has err 'blob-sigma' "the error of a blob-sigma of '$v' names blob-sigma"
done
for v in 0.5 1025 1,2 a; do
	exits 2 "a factor of '$v' is refused with status 2" ct-metrics --structures -x "$v" hr.nii up.nii
	has err 'factor' "the error of a factor of '$v' names the factor"
done

# CSV
ct-metrics --harm --csv -x 1,1,2 hr.nii up.nii >table
[ "$(wc -l <table)" -eq 2 ]; ok $? '--csv prints two lines for one comparison'
ct-metrics --harm -x 1,1,2 hr.nii up.nii | awk '{print $1}' | tr '\n' ',' >names
[ "test,$(cat names)" = "$(head -n 1 table)," ]; ok $? 'the columns of --csv are the names of the report'
exits 2 '--csv with --json is refused with status 2' ct-metrics --csv --json hr.nii up.nii
exits 2 '--csv with --per-slice to standard output is refused with status 2' ct-metrics --csv --per-slice - hr.nii up.nii
cp up.nii 'a "b", c.nii'
exits 0 '--csv accepts a file name with quotes and commas' ct-metrics --csv --ssim none hr.nii 'a "b", c.nii'
has out '^"a ""b"", c.nii",' 'a file name with quotes and commas is quoted in CSV'
exits 0 '--csv accepts --consistency without a truth' ct-metrics --csv --consistency lr.nii up.nii
has out '^test,factor,sigma,decimate,noise,residual-voxels' '--csv --consistency has columns for the operator'
has out '^"up.nii","2,2,2",' 'a list of factors is quoted in CSV'

# banding: a wave of 6 HU and four voxels in water
python3 -c '
import array, math
array.array("f", (40 + 6 * math.cos(math.pi * (i // 576) / 2 + 1) for i in range(576 * 48))).tofile(open("band.raw", "wb"))
array.array("f", [40] * 576 * 48).tofile(open("flat.raw", "wb"))' || exit 99
for v in band flat; do ct-convert -q --raw 24x24x48:f32:2 $v.raw $v.nii || exit 99; done
banding() { value banding-rms-hu; } # of the last report
exits 0 'ct-metrics accepts stripes across slices' ct-metrics --harm --ssim none -x 1,1,4 flat.nii band.nii
banding | awk '{exit !(($1 - 4.243)^2 < .01)}'; ok $? 'stripes have the RMS of their amplitude'
[ "$(value banding-pieces)" -eq 1728 ]; ok $? 'stripes are measured on every line of voxels'
exits 0 'ct-metrics accepts stripes across an axis that is not refined' ct-metrics --harm --ssim none -x 1,4,1 flat.nii band.nii
[ "$(banding)" = 0.000000 ]; ok $? 'stripes across an axis that is not refined give no banding'
exits 0 'ct-metrics --harm accepts a volume without a factor' ct-metrics --harm --ssim none flat.nii band.nii
[ "$(banding)" = nan ]; ok $? 'without a factor there is no figure of banding'
exits 0 'ct-metrics --harm accepts slices eight times as thick' ct-metrics --harm --ssim none -x 1,1,8 flat.nii band.nii
[ "$(banding) $(value banding-pieces)" = 'nan 0' ]; ok $? 'fewer than 1000 pieces give no figure of banding'
exits 3 'banding above --max ends with status 3' ct-metrics --harm --max banding-rms-hu=1 -x 1,1,4 flat.nii band.nii
has err 'banding-rms-hu 4.2' 'the error of banding above --max gives the value'

# limits
head -c 55296 /dev/zero >zero.raw
ct-convert -q --raw 24x24x24:f32:2 zero.raw water.nii && ct-degrade -q -x 1 --noise 60 water.nii noisy.nii || exit 99
ct-metrics --structures --expert blob-sigma=.7 water.nii noisy.nii >some
f=$(value structures-false some); [ "$f" -gt 3 ]; ok $? "noise gives false structures ($f)"
[ "$f" -eq $(($(value false-bright some) + $(value false-dark some))) ]
ok $? 'false structures are the sum of bright and dark ones'
exits 0 '--max accepts as many false structures as there are' ct-metrics --structures --expert blob-sigma=.7 --max structures-false=$f water.nii noisy.nii
exits 3 'one false structure more than --max ends with status 3' ct-metrics --structures --expert blob-sigma=.7 --max structures-false=$((f - 1)) water.nii noisy.nii
has err "noisy.nii: structures-false $f is above" 'the error of too many false structures gives their number'
exits 2 'a --max that is NaN is refused with status 2' ct-metrics --structures --max structures-false=nan water.nii noisy.nii
two=$(ct-metrics --structures --expert blob-sigma=.7,.9 water.nii noisy.nii >two; value structures-false two)
[ "$two" -eq $((f + $(value false-bright-2 two) + $(value false-dark-2 two))) ]
ok $? 'false structures of two sizes are the sum of each'
[ "$(value false-bright two)" -eq $(($(value false-bright-1 two) + $(value false-bright-2 two))) ]
ok $? 'bright false structures of two sizes are the sum of each'
awk '{v[$1] = $2} END {exit !(v["false-dark-2"] > 0 && (v["false-dark-2"] / v["soft-tissue-cm3-2"] - v["false-dark-per-cm3-2"])^2 < 1e-10)}' two
ok $? 'false structures of a size are also given for each cm3'

python_with nibabel,scipy.ndimage || { skip 'all figures are those of NumPy and SciPy' 'they are not here'; done_testing; }
"$PY" - <<'PY' || exit 99
import nibabel as nib, numpy as np
rng = np.random.default_rng(4)
n = (45, 38, 33)
i, j, k = np.indices(n)
a = np.choose((i // 9) % 5, [-1000., -700., -100., 40., 700.]) + 25*rng.standard_normal(n)
a[:, 8:32, 5:28] = 40 + 30*rng.standard_normal((n[0], 24, 23))
b = a + 60*rng.standard_normal(n) + 3*np.sin(i/3)
b[:, 12:22, 5:18] = np.round(b[:, 12:22, 5:18]/400)*400
for v, f in ((a, 'a.nii'), (b, 'b.nii'), ((i + j) % 7 > 0, 'm.nii')):
    nib.save(nib.Nifti1Image(v.astype(np.float32), np.diag([.7, .8, 2.5, 1])), f)
PY
what='--ssim none --harm --expert blob-sigma=1,2'
# shellcheck disable=SC2086
ct-metrics --json $what a.nii b.nii >all.json && ct-metrics --json $what --mask m.nii a.nii b.nii >mask.json
"$PY" - >log 2>&1 <<'PY'; ok $? 'all figures are those of NumPy and SciPy'
import json, nibabel as nib, numpy as np
from scipy import ndimage as nd
a, b, m = (nib.load(f).get_fdata() for f in ('a.nii', 'b.nii', 'm.nii'))
mm = np.array([.7, .8, 2.5])
def near(name, got, want, tol=1e-4):
    print(name, got, want)
    assert got == want or abs(got - want) <= tol*max(abs(want), 1), name
G = lambda v, s: nd.gaussian_filter(v, s, truncate=4, mode='reflect')
near3 = np.ones((3, 3, 3))
around = near3.copy(); around[1, 1, 1] = 0
inner = np.zeros(a.shape, bool); inner[1:-1, 1:-1, 1:-1] = True
def blobs(r, mask, s, end):
    da, db = (G(v, s) - G(v, s*10/3) for v in (a, b))
    soft = (abs(G(a, s)) < 150) & (abs(G(a, s*10/3)) < 150) & mask & inner
    cm3 = soft.sum()*mm.prod()/1000
    near('cm3', r['soft-tissue-cm3' + end], cm3, 1e-3)
    for sign, name in ((1, 'bright'), (-1, 'dark')):
        def found(x, y):
            top = soft & (sign*x > 15) & (sign*x > nd.maximum_filter(sign*x, footprint=around))
            return top.sum(), (top & (nd.maximum_filter(sign*y, footprint=near3) < 7.5)).sum()
        n, missed = found(da, db)
        false = found(db, da)[1]
        near('is ' + name, r['structures-%s%s' % (name, end)], n)
        near('missed ' + name, r['missed-%s%s' % (name, end)], missed)
        near('false ' + name, r['false-%s%s' % (name, end)], false)
        near('false a cm3', r['false-%s-per-cm3%s' % (name, end)], false/cm3, 1e-6)
        near('missed a cm3', r['missed-%s-per-cm3%s' % (name, end)], missed/cm3, 1e-6)
    return r['false-dark' + end] + r['false-bright' + end]
def check(r, mask):
    assert blobs(r, mask, 1, '-1') + blobs(r, mask, 2, '-2') == r['structures-false'] > 0
    L = lambda v: nd.gaussian_laplace(v, 1.5, mode='reflect', truncate=4)[mask]
    near('hfen', r['hfen'], np.linalg.norm(L(b) - L(a))/np.linalg.norm(L(a)), 1e-5)
    s, d = G(a, 1), b - a
    kinds = {'air': (-1e9, -950), 'lung': (-950, -500), 'fat': (-190, -30), 'soft': (-30, 150),
             'brain': (15, 60), 'bone': (300, 1e9)}
    is_ = {k: (s >= lo) & (s < hi) for k, (lo, hi) in kinds.items()}
    is_['deep'] = nd.binary_erosion(is_['soft'], np.ones((9, 9, 9)), border_value=1)
    for k, v in is_.items():
        v = v & mask
        near(k, r[k + '-voxels'], v.sum())
        assert v.sum() > 50
        near(k + ' rmse', r[k + '-rmse-hu'], np.sqrt((d[v]**2).mean()))
        near(k + ' bias', r[k + '-bias-hu'], d[v].mean())
    near('smooth', r['deep-smooth-rmse-hu'], np.sqrt((G(d, 1)[is_['deep'] & mask]**2).mean()))
    v = (is_['soft'] & mask)[:-1, :-1, :-1]
    near('flat voxels', r['flat-voxels'], v.sum())
    for name, x in (('ref', a), ('test', b)):
        steps = [abs(np.diff(x, axis=q))[tuple(slice(n - 1) for n in x.shape)] for q in range(3)]
        flat = (np.max(steps, 0) < 1)[v].mean()
        near('flat ' + name, r['flat-' + name], flat, 1e-6)
    assert r['flat-test'] > .05
check(json.load(open('all.json')), np.ones(a.shape, bool))
check(json.load(open('mask.json')), m != 0)
w = [np.sin(np.pi*(np.arange(q) + .5)/q)**2 for q in a.shape]
w = w[0][:, None, None]*w[1][:, None]*w[2]
F, H = (np.fft.fftn((v - v.mean())*w) for v in (a, b))
f = np.sqrt(sum(q**2 for q in np.meshgrid(*[np.fft.fftfreq(q, d) for q, d in zip(a.shape, mm)], indexing='ij')))
width = max(1/(q*d) for q, d in zip(a.shape, mm))
shell = np.floor(f/width + .5).astype(int)
value = []
for s in range(int(.5/.7/width + .5) + 1):
    v = shell == s
    value.append((F[v]*H[v].conj()).real.sum()/np.sqrt((abs(F[v])**2).sum()*(abs(H[v])**2).sum()))
assert min(value) < .5
s = next(i for i in range(1, len(value)) if value[i] < .5)
before = 1 if s == 1 else value[s - 1]
r = json.load(open('all.json'))
near('fsc50', r['fsc50'], width*(s - (.5 - value[s])/(before - value[s])), 1e-6)
near('fsc50-mm', r['fsc50-mm']*r['fsc50'], 1, 1e-9)
near('fsc50 of all, with a mask too', json.load(open('mask.json'))['fsc50'], r['fsc50'])
PY
sed 's/^/# /' log
"$PY" - >log 2>&1 <<'PY'; ok $? 'Python reads the CSV with its columns'
import csv
r = list(csv.DictReader(open('table')))
assert len(r) == 1 and r[0]['test'] == 'up.nii' and r[0]['blob-sigma-2'] == '1.5,1.5,3' and r[0]['window'] == '-512:3071'
PY
sed 's/^/# /' log
done_testing
