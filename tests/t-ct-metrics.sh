#!/bin/sh
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
save((x > 20) & (z > 3), 'mask.nii')
PY
exits 0 'compares' ct-metrics --ssim all --json ref.nii test.nii
mv out all.json
exits 0 'with a mask' ct-metrics --ssim all --json --mask mask.nii ref.nii test.nii
mv out mask.json
exits 0 'with a range' ct-metrics --ssim all --json --range 2500 ref.nii test.nii
mv out range.json
exits 0 'with a window' ct-metrics --psnr --window -200:300 ref.nii test.nii
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
[ "$(cat names)" = 'window range voxels psnr ssim-r2 mae-hu rmse-hu bias-hu ' ]; ok $? 'a line a name'
for t in 1 4; do ct-metrics -t $t --ssim all --json ref.nii test.nii >t$t; done
cmp -s t1 t4; ok $? '1 and 4 threads, same bytes'
exits 0 'reads a stream' sh -c 'cat test.nii | ct-metrics ref.nii -'
cmp -s out text; ok $? 'and says the same'
exits 0 'equal volumes' ct-metrics --min-psnr 99 --min-ssim 1 ref.nii ref.nii
has out '^psnr inf$' 'have infinite PSNR'
ct-metrics --json ref.nii ref.nii >json; "$PY" -c 'import json; assert json.load(open("json"))["psnr"] is None'
ok $? 'null in JSON'
exits 3 'misses a PSNR' ct-metrics --min-psnr 60 ref.nii test.nii
has out '^psnr' 'and reports it'
has err 'below 60' 'and says so'
exits 3 'misses an SSIM' ct-metrics --min-ssim 0.99999 ref.nii test.nii
exits 5 'refuses another spacing' ct-metrics ref.nii moved.nii
exits 5 'refuses another size' ct-metrics ref.nii short.nii
exits 5 'refuses slices smaller than the window' ct-metrics --ssim skimage tiny.nii tiny.nii
exits 6 'refuses NaN' ct-metrics ref.nii nan.nii
has err 'nan.nii: voxel (0,0,9) is NaN' 'and says where'
exits 2 'window and range exclude each other' ct-metrics --window 0:1 --range 1 ref.nii test.nii
exits 2 'one stream cannot be both' ct-metrics - -
done_testing
