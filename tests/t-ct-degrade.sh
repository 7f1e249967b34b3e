#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-degrade and ct-upsample: streams, statuses, what travels, and SciPy's word on the numbers.
. "$srcdir/tests/tap.sh"
if ! python_with nibabel,scipy; then
	echo '1..0 # skip no nibabel, scipy'
	exit 0
fi
"$PY" - <<'PY'
import nibabel as nib, numpy as np
rng = np.random.default_rng(1)
n = (40, 30, 26)
x, y, z = np.indices(n)
a = 400*np.sin(x/5)*np.cos(y/4) + 30*z + 80*rng.standard_normal(n)
affine = np.array([[0, -.8, 0, 10], [.7, 0, 0, -20], [0, 0, 1.5, 33], [0, 0, 0, 1.]])
nib.save(nib.Nifti1Image(a.astype(np.float32), affine), 'hr.nii')
a[3, 4, 5] = np.nan
nib.save(nib.Nifti1Image(a.astype(np.float32), affine), 'nan.nii')
PY
exits 0 'ct-degrade reduces by a factor for each axis' ct-degrade -x 4,4,2 hr.nii lr.nii
exits 0 'upsamples by what the file says' ct-upsample lr.nii up.nii
exits 0 'upsamples by the same number' ct-upsample -x 4,4,2 lr.nii same.nii
exits 2 'refuses another factor than the file says' ct-upsample -x 4 lr.nii no.nii
has err 'lr.nii' 'and names the file'
[ ! -e no.nii ]; ok $? 'ct-upsample that refuses a factor leaves no output'
exits 2 'does not upsample twice unasked' ct-upsample up.nii no.nii
exits 0 'chooses a factor for a file that has none' ct-upsample -m linear hr.nii chosen.nii
exits 2 'needs a factor to degrade' ct-degrade hr.nii no.nii
exits 2 'refuses a factor below 1' ct-degrade -x 0.5 hr.nii no.nii
exits 2 'refuses a negative blur' ct-degrade -x 2 --sigma -1 hr.nii no.nii
exits 5 'refuses an axis shorter than its factor' ct-degrade -x 32 hr.nii no.nii
has err 'hr.nii: .*30 voxels' 'the error of an axis shorter than its factor gives its length'
exits 6 'ct-degrade refuses a NaN with status 6' ct-degrade -x 2 nan.nii no.nii
has err 'nan.nii: voxel (3,4,5)' 'the error of ct-degrade for a NaN names the voxel'
exits 6 'ct-upsample refuses a NaN with status 6' ct-upsample -x 2 nan.nii no.nii
exits 4 'ct-degrade refuses to overwrite a file with status 4' ct-degrade -x 2 hr.nii lr.nii
exits 3 'names a file that is cut short' sh -c 'head -c 5000 hr.nii | ct-degrade -x 2 - -'
[ ! -e no.nii ]; ok $? 'nothing is left by a failure'

ct-degrade -x 4 hr.nii - | ct-upsample -m linear - - >pipe.nii
ct-degrade -x 4 hr.nii f.nii; ct-upsample -m linear f.nii g.nii.gz
"$PY" - <<'PY'; ok $? 'a pipe gives the voxels that files give'
import nibabel as nib, numpy as np
a, b = nib.load('pipe.nii'), nib.load('g.nii.gz')
assert np.array_equal(a.get_fdata(), b.get_fdata()) and np.array_equal(a.affine, b.affine)
PY
for t in 1 4; do
	ct-degrade -t $t -x 3 --noise 11 -s 5 - - <hr.nii | ct-upsample -t $t - - >t$t.nii
done
cmp -s t1.nii t4.nii; ok $? '1 and 4 threads, same bytes'
ct-degrade -x 3 --noise 11 -s 6 - - <hr.nii | ct-upsample - - | cmp -s - t1.nii
[ $? -eq 1 ]; ok $? 'another seed, other noise'
ct-degrade -x 3 --noise 11 hr.nii noisy.nii && ct-degrade -x 2 noisy.nii twice.nii
[ "$(ct-info noisy.nii twice.nii | awk '/noise/ {print $2}' | head -n 1)" = 11 ]; ok $? 'the header records the noise that was added'
equal() { ct-metrics --ssim none --max rmse-hu=0 "$1" "$2" >/dev/null; }
ct-degrade -x 3 -p P1n hr.nii n1.nii && ct-degrade -x 3 --noise 15 hr.nii n2.nii && equal n1.nii n2.nii; ok $? 'P1n: P1 and 15 HU'
ct-degrade -x 3 -p P3n hr.nii n3.nii && ct-degrade -x 3 -p P3 --noise 15 hr.nii n4.nii && equal n3.nii n4.nii; ok $? 'P3n: P3 and 15 HU'
ct-degrade -x 3 -p P3n --noise 0 hr.nii n5.nii && ct-degrade -x 3 -p P3 hr.nii n6.nii && equal n5.nii n6.nii; ok $? 'or as much as is said'
exits 0 'a protocol of which only its noise is left is accepted' ct-degrade -x 3 -p P1n --sigma 1 --decimate mean hr.nii n7.nii
ct-degrade -x 3 --sigma 1 --decimate mean --noise 15 hr.nii n8.nii && equal n7.nii n8.nii; ok $? 'is left its noise'
ct-info twice.nii >out; ! grep -q '^  *[a-z.]*noise ' out; ok $? 'and not when it was reduced again'

for p in P1 P2 P3; do ct-degrade -f -x 4,4,2 -p $p --clip -300:600 hr.nii $p.nii; done
ct-degrade -x 4,4,2 --sigma 0.8 --decimate mean hr.nii mean.nii
ct-upsample -m bspline P1.nii spline.nii
"$PY" - >log 2>&1 <<'PY'; ok $? 'blur, low-pass, sampling, spline and grid are those of SciPy'
import nibabel as nib, numpy as np
from scipy.fft import dctn, idctn
from scipy.ndimage import gaussian_filter, zoom
hr = nib.load('hr.nii')
raw = hr.get_fdata()[:, 1:29, :]            # 30 = 7*4 + 2: one left out at each end
x = np.clip(raw, -300, 600)
s = np.array([4, 4, 2])
m = np.array(x.shape)//s
def close(name, want, tol=2e-3):
    got = nib.load(name)
    err = np.abs(got.get_fdata() - want).max()
    print(name, err)
    assert got.shape == want.shape and err < tol
    return got
def sinc(v):
    c = dctn(v, norm='ortho')[:m[0], :m[1], :m[2]]
    return idctn(c*np.sqrt(np.prod(m)/v.size), norm='ortho')
lr = sinc(gaussian_filter(x, s/2.3548, mode='reflect'))
img = close('P1.nii', lr)
close('P2.nii', sinc(gaussian_filter(x, s/4, mode='reflect')))
def middle(v):
    for a in range(3):
        i = np.arange(m[a])*s[a] + s[a]//2
        v = (np.take(v, i, a) + np.take(v, i - 1, a))/2
    return v
close('P3.nii', middle(gaussian_filter(x, s/8, mode='reflect')))
b = gaussian_filter(raw, .8, mode='reflect')
close('mean.nii', b.reshape(m[0], 4, m[1], 4, m[2], 2).mean((1, 3, 5)))
close('spline.nii', zoom(lr, s, order=3, mode='grid-mirror', grid_mode=True))
want = hr.affine.copy()
want[:3, :3] *= s
want[:3, 3] = (hr.affine @ [1.5, 2.5, .5, 1])[:3]
assert np.allclose(img.affine, want, atol=1e-5), (img.affine, want)
up = nib.load('up.nii')
want = hr.affine.copy()
want[:3, 3] = (hr.affine @ [0, 1, 0, 1])[:3]
assert np.allclose(up.affine, want, atol=1e-5), (up.affine, want)
PY
sed 's/^/# /' log
grep -aq 'factor": *"4,4,2"' P3.nii && grep -aq 'decimate": *"point"' P3.nii
ok $? 'the operator travels in the file'
ct-upsample -q -f P3.nii refined.nii && ct-degrade -q -f -x 2 refined.nii again.nii && ct-upsample -q -f again.nii twice.nii
ok $? 'what was refined is reduced as any other'
ct-degrade -q -f -x 1 --clip=-100:100 refined.nii clipped.nii &&
	ct-info clipped.nii | grep -q '^  upsample' && ! ct-info again.nii | grep -q '^  upsample'
ok $? 'and is refined as long as it is only clipped'
exits 2 'one blur where no axis is reduced is refused' ct-degrade -x 1 --sigma 2 hr.nii never.nii

# as the paper's release reduces
exits 0 'the release takes every third voxel' ct-degrade -x 3,3,1 -p release hr.nii first.nii
"$PY" - >log 2>&1 <<'PY'; ok $? 'the voxels of the release are those of SciPy, and lie where they were'
import nibabel as nib, numpy as np
from scipy.ndimage import gaussian_filter
hr, lr = nib.load('hr.nii'), nib.load('first.nii')
want = gaussian_filter(np.maximum(hr.get_fdata(), -512), (1, 1, 0), mode='reflect')[:39:3, ::3, :]
assert lr.shape == (13, 10, 26) and np.abs(lr.get_fdata() - want).max() < 2e-3
step = hr.affine @ np.diag([3, 3, 1, 1])
assert np.allclose(lr.affine, step, atol=1e-5), (lr.affine, step)
PY
sed 's/^/# /' log
ct-info first.nii >out; has out '^  clip  *-512:' 'the release clips from below, and says so'
has out '^  first  *yes' 'the release says that samples are first voxels'
ct-phantom -q -w -512:1000 --size 25x24x23 ellipsoids whole.nii; ct-degrade -q -p release -x 3 whole.nii third.nii
ct-sr -q -Q draft -x 3 third.nii about.nii
for f in whole about; do
	exits 0 "every third voxel agrees with $f.nii" ct-metrics --max residual-max-hu=0.01 --consistency third.nii $f.nii
done
ct-degrade -q -x 3,3,1 -p release --clip -100:100 hr.nii clipped.nii -f; ct-info clipped.nii >out
has out '^  clip  *-100:100' 'a clip that is given is the one of the release too'
# what the release makes of them: V_up is scipy.ndimage.zoom on the grid of the volume, and the box of its projections too
exits 0 'samples are zoomed as the release does' ct-upsample -x 3,3,1 -m linear --expert zoom=yes first.nii zoom.nii
ct-convert -q --crop=0:39,0:30,0:26 hr.nii box.nii
"$PY" - >log 2>&1 <<'PY'; ok $? 'the zoom is that of SciPy, on the grid of the volume'
import nibabel as nib, numpy as np
from scipy.ndimage import zoom
lr, up, box = (nib.load(f + '.nii') for f in ('first', 'zoom', 'box'))
want = zoom(lr.get_fdata(), (3, 3, 1), order=1)
assert up.shape == want.shape == box.shape and np.abs(up.get_fdata() - want).max() < 1e-3, np.abs(up.get_fdata() - want).max()
assert np.allclose(up.affine, box.affine, atol=1e-5), (up.affine, box.affine)
PY
sed 's/^/# /' log
ct-project -q -n 2 --expert cells=yes first.nii cells.exr && ct-project -q -n 2 box.nii box.exr
ct-info cells.exr | grep '^  scan' >out; ct-info box.exr | grep '^  scan' >want
paste out want | awk '/scan.iso/ {split($2, a, ","); split($4, b, ","); for (k = 1; k <= 3; k++) if ((d = a[k] - b[k]) < -1e-4 || d > 1e-4) bad = 1; n++}
	END {exit bad || n != 1}'; ok $? 'the box of the samples is that of the volume'
exits 2 'a zoom of another method than linear is refused' ct-upsample -m cubic --expert zoom=yes first.nii no.nii
exits 2 'the release takes no factor that is not whole' ct-degrade -x 2.5 -p release hr.nii no.nii
has err '2.5 is not whole' 'a factor of the release that is not whole is named'
exits 2 'the release takes no other sampling' ct-degrade -x 3 -p release --decimate mean hr.nii no.nii
exits 2 'the release takes no slice profile' ct-degrade -x 1,1,3 -p release --profile box hr.nii no.nii
if command -v ct-convert >/dev/null 2>&1; then
	make -s -f "$srcdir/examples/release.mk" PYTHON="$PY" VOLUMES=hr.nii FACTORS=2 OUT=o MOST=24 >table 2>err
	awk '$1 == "hr" && NF == 10 && $7 > $3 + .5 && $7 > $5 + .5 {good = 1} END {exit !good}' table
	ok $? 'release.mk shows that interpolation is better where the samples are'
	cat table err | sed 's/^/# /'
	ct-convert hr.nii - | ct-degrade -x 4 - - | ct-upsample -x 4 -m cubic - conv.nii.gz
	[ -s conv.nii.gz ]; ok $? 'ct-convert | ct-degrade | ct-upsample'
else
	skip 'ct-convert | ct-degrade | ct-upsample' 'no ct-convert'
fi
done_testing
