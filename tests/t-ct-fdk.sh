#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-fdk: pipes, statuses, grids, units, and scikit-image as a second opinion.
. "$srcdir/tests/tap.sh"
grid='--size 48x48x24 --spacing 2'
# shellcheck disable=SC2086
ct-phantom $grid ellipsoids v.nii
ct-project -n 90 --arc 360 v.nii p.exr
exits 0 'ct-fdk reconstructs a volume from a full turn' ct-fdk p.exr r.nii
ct-project -n 90 --arc 360 v.nii - | ct-fdk - - >pipe.nii 2>err
[ -s pipe.nii ] && [ ! -s err ]; ok $? 'in a pipe, quietly'
ct-fdk -t 1 p.exr - >one.nii; ct-fdk -t 4 p.exr - >four.nii
[ -s one.nii ] && cmp -s one.nii four.nii; ok $? 'one and four threads make the same file'
ct-metrics -w -1024:3071 --min psnr=30 v.nii r.nii >out; ok $? 'HU come back: 30 dB of the window'
exits 4 'ct-fdk refuses to overwrite a file with status 4' ct-fdk p.exr r.nii
ct-info r.nii >info
has info 'window *-1024:3071' 'the volume has the window of its projections'
grep -q 'scan.dso\|volume.size\|lineIntegral' info; [ $? -eq 1 ]; ok $? 'what describes projections does not'
exits 0 'ct-fdk reconstructs density with --quantity density' ct-fdk --quantity density p.exr d.nii
exits 0 'a volume of density is projected again' ct-project --like p.exr d.nii q.exr
exits 2 'no filter makes no HU' ct-fdk --filter none p.exr new.nii
exits 0 '--filter none makes a volume of density' ct-fdk --filter none --quantity density p.exr n.nii
for f in shepp-logan cosine hamming hann; do
	exits 0 "filter $f" ct-fdk --filter $f p.exr $f.nii
	cmp -s $f.nii r.nii; [ $? -eq 1 ]; ok $? "filter $f makes another volume than the default"
done
exits 0 'another number of voxels' ct-fdk --grid 24 p.exr g.nii
ct-info g.nii >info; has info '^size *24 24 12' 'along the longest side'
exits 0 'the grid of a volume' ct-fdk --grid g.nii p.exr g2.nii
ct-metrics g.nii g2.nii | grep -q 'rmse-hu 0.000000$'; ok $? 'is the same grid'
exact ellipsoids bare.exr "$grid" -n 60 --arc 360
exits 0 'a stack that knows no volume' ct-fdk bare.exr b.nii
for n in 0 2.5 65537 -3; do
	exits 2 "a grid of $n voxels" ct-fdk --grid="$n" p.exr new.nii
done
exits 3 'a name that is no file' ct-fdk --grid 3x p.exr new.nii
exits 3 'a grid that is not there' ct-fdk --grid none.nii p.exr new.nii
exits 2 'fbp of a cone' ct-fdk -m fbp p.exr new.nii
exits 2 'cgls has no bounds' ct-fdk -m cgls --nonnegative p.exr new.nii
exits 2 'cgls with --filter is refused with status 2' ct-fdk -m cgls --filter hann p.exr new.nii
exits 2 'a window that contradicts' ct-fdk -w -512:3071 p.exr new.nii
for m in sirt cgls tv; do
	exits 0 "$m" ct-fdk -m $m --iterations 12 p.exr $m.nii
	ct-metrics -w -1024:3071 --min psnr=24 v.nii $m.nii >out; ok $? 'is near the volume'
done
exits 0 'how long and how large' ct-fdk --dry-run p.exr new.nii
has out '^memory' 'a dry run of ct-fdk prints the memory it needs'
exits 0 'an iterative method too' ct-fdk -m sirt --dry-run p.exr new.nii
[ ! -e new.nii ]; ok $? 'and nothing is made'

# short scans, wrong scans
ct-project -n 90 --arc 180 v.nii half.exr
exits 0 'projections of half a turn are reconstructed' ct-fdk half.exr half.nii
has err 'short scan of 180 .*(--parker, which weighs them, needs [0-9.]* degrees)$' 'a warning tells that half a turn is a short scan, and does not advise what would fail'
exits 5 'but not with Parker weights' ct-fdk --parker half.exr new.nii
has err 'Parker weights need' 'the error of --parker for half a turn says what it needs'
exits 5 'the axis is not looked for in half a turn of a cone' ct-fdk --find-centre half.exr new.nii
has err '^ct-fdk: half.exr: --find-centre: Parker weights need' 'the error of an axis that is not found names the option'
ct-project -n 90 --arc 225 v.nii short.exr
exits 0 'a short scan with them' ct-fdk --parker short.exr short.nii
[ ! -s err ]; ok $? 'a short scan with Parker weights gives no warning'
ct-metrics -w -1024:3071 --min psnr=29 v.nii short.nii >out; ok $? 'and is as good'
ct-project -n 1 v.nii single.exr
exits 5 'fdk of a single view is refused with status 5' ct-fdk single.exr new.nii
exits 0 'cgls reconstructs from one view' ct-fdk -m cgls --iterations 2 single.exr single.nii
ct-project -n 30 --arc 360 --det 1 --expert pitch=5 v.nii pixel.exr
exits 5 'a detector of one pixel' ct-fdk pixel.exr new.nii
exits 0 'sirt reconstructs from a detector of one pixel' ct-fdk -m sirt --iterations 2 pixel.exr pixel.nii
ct-project --beam fan -n 90 --arc 360 v.nii fan.exr
exits 0 'projections of a fan are reconstructed' ct-fdk fan.exr fan.nii
ct-info fan.nii >info; has info '^size *48 48 1' 'projections of a fan make one slice'
exits 5 'a fan on a grid of many slices is refused with status 5' ct-fdk --grid v.nii fan.exr new.nii
exits 3 'a volume is no stack' ct-fdk v.nii new.nii
[ ! -e new.nii ]; ok $? 'runs of ct-fdk that fail leave no output'

# stopped: nothing is left
ct-fdk -m sirt --iterations 100000 p.exr new.nii 2>err & pid=$!
listens $pid; kill -TERM $pid; wait $pid; [ $? -eq 75 ]; ok $? 'stopped on request: 75'
# shellcheck disable=SC2012
[ "$(ls | grep -c '^\.*new')" -eq 0 ]; ok $? 'a run of ct-fdk that is stopped leaves no half-written output'

if python_with nibabel && "$PY" -c 'import skimage' 2>/dev/null; then
	# parallel rays: the same picture as skimage's, which numbers angles and columns its own way
	ct-phantom --size 96x96x96 --spacing 1 shepp-logan whole.nii
	"$PY" -c "import nibabel as n; v = n.load('whole.nii'); n.save(v.slicer[:, :, 46:49], 's.nii')"
	ct-project --beam parallel -n 120 --det 96x3 --expert pitch=1 s.nii s.exr
	ct-fdk --quantity density s.exr sr.nii
	"$PY" - <<-'PY' >out 2>&1
		import nibabel, numpy as np, warnings
		warnings.simplefilter('ignore')
		from skimage.transform import radon, iradon
		load = lambda f: nibabel.load(f).get_fdata()[:, :, 1]
		x = np.clip((load('s.nii') + 1024) / 4095, 0, 1)
		ours = load('sr.nii')
		# skimage: rows down, its centre is pixel n//2 where ours is (n-1)/2: pad to an odd size
		pad = np.zeros((97, 97)); pad[:96, :96] = x
		fine = np.kron(x, np.ones((2, 2)))
		angles = np.arange(120) * 1.5
		big = np.zeros((193, 193)); big[:192, :192] = fine
		import scipy.ndimage as nd
		big = nd.shift(big, 0.5, order=1)
		theirs = iradon(radon(big, angles, circle=False) / 2, angles, filter_name='ramp', circle=False,
			output_size=193) * 2
		theirs = nd.shift(theirs, -0.5, order=1)[:192, :192].reshape(96, 2, 96, 2).mean((1, 3))
		i = np.arange(96) - 47.5
		disc = np.hypot(*np.meshgrid(i, i)) < 44
		rms = lambda d: np.sqrt((d[disc] ** 2).mean())
		a, b, c = rms(ours - x), rms(theirs - x), rms(ours - theirs)
		print('ours %.5f theirs %.5f apart %.5f' % (a, b, c))
		assert a < 1.2 * b and c < 1.5 * b and abs((ours - theirs)[disc].mean()) < 1e-3
	PY
	ok $? 'parallel: agrees with scikit-image'; sed 's/^/# /' out
else
	skip 'parallel: agrees with scikit-image' 'no nibabel or skimage'
fi
done_testing
