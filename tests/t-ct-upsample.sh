#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-upsample: inverting the operator, estimating it, starting from a volume; ct-compose --consistent.
. "$srcdir/tests/tap.sh"
psnr() { ct-metrics --ssim none --range 2000 "$1" "$2" 2>/dev/null | awk '$1 == "psnr" {print $2}'; }
above() { awk -v a="$1" -v b="$2" -v by="${3:-0}" 'BEGIN {exit !(a > b + by)}'; }

ct-phantom shepp-logan --size 48x48x48 hu.nii
for p in P1 P2 P3; do ct-degrade -x 4 -p $p hu.nii $p.nii; done
ct-degrade -x 1,1,4 --sigma 0 --decimate mean hu.nii thick.nii
ct-degrade -x 2.5 hu.nii fraction.nii
for lr in P1 P2 P3 thick; do
	ct-upsample -f -m cubic $lr.nii cubic.nii
	exits 0 "$lr: the default method inverts the operator" ct-upsample -f -v $lr.nii up.nii
	has err 'agrees with the low resolution within [0-9.]*e-0' "$lr: the result agrees with the scan within 1e-4 HU RMS"
	a=$(psnr hu.nii up.nii); b=$(psnr hu.nii cubic.nii)
	above "$a" "$b"; ok $? "$lr: the inversion is better than cubic ($a, $b dB)"
done
ct-upsample -v P1.nii a.nii 2>err; has err ', tv, ' 'a band-limited scan is inverted with total variation'
ct-upsample -v P3.nii b.nii 2>err; has err ', htv, ' 'an aliased scan is inverted with second-order variation'
ct-degrade -x 4 a.nii again.nii
a=$(psnr P1.nii again.nii); above "$a" 100; ok $? "the result, degraded again, is the input ($a dB)"
for m in linear cubic bspline lanczos sinc dc tv htv; do
	case $m in *tv) few='--iterations 20' ;; *) few= ;; esac
	# shellcheck disable=SC2086
	exits 0 "$m accepts a factor of 2.5" ct-upsample -f -m $m $few fraction.nii f.nii
done
ct-degrade -x 2.5 f.nii f2.nii; a=$(psnr fraction.nii f2.nii)
above "$a" 100; ok $? "the inversion at 2.5 times, degraded again, is the input ($a dB)"

# without a header: the operator from options, or measured
ct-upsample -f -m cubic P1.nii cubic.nii
exits 2 'a file that is already upsampled is refused without a factor' ct-upsample cubic.nii no.nii
exits 2 '-m tv without an operator is refused with status 2' ct-upsample -m tv -x 2 hu.nii no.nii
has err 'sigma' 'the error of -m tv without an operator names --sigma'
exits 2 'a --sigma that contradicts the file is refused with status 2' ct-upsample --sigma 1 P1.nii no.nii
exits 2 'a --decimate that contradicts the file is refused with status 2' ct-upsample --decimate mean P1.nii no.nii
exits 0 '-m tv accepts an operator given by --sigma' ct-upsample -v -m tv -x 2 --sigma 0.8 --iterations 5 hu.nii given.nii
exits 0 '--estimate measures the operator of a volume' ct-upsample -v -x 2 --estimate --iterations 5 hu.nii seen.nii
has err 'axis 2: spread' '--estimate -v prints the spread of each axis'
[ ! -e no.nii ]; ok $? 'refused runs of ct-upsample leave no output'

# a start, the nearest consistent volume, and the same through ct-compose
ct-upsample -m dc --start cubic.nii P1.nii near.nii; ok $? '-m dc starts from the volume of --start'
ct-degrade -f -x 4 near.nii again.nii; a=$(psnr P1.nii again.nii)
above "$a" 100; ok $? "-m dc makes the volume of --start agree with the scan ($a dB)"
exits 5 'a --start on the grid of the scan is refused with status 5' ct-upsample -m dc --start P1.nii P1.nii no.nii
exits 2 'interpolation with --start is refused with status 2' ct-upsample -m linear --start cubic.nii P1.nii no.nii
if python_with nibabel; then
	"$PY" - <<'PY'
import nibabel as nib, numpy as np
a = nib.load('cubic.nii')
nib.save(nib.Nifti1Image(np.zeros(a.shape, np.float32), a.affine), 'none.nii')
PY
	ct-compose --floor -100000 --consistent P1.nii cubic.nii none.nii composed.nii
	ok $? 'ct-compose --consistent runs on the same volume'
	a=$(psnr near.nii composed.nii)
	above "$a" 100
	ok $? "ct-compose --consistent gives the volume of -m dc ($a dB)"
	ct-phantom cube --size 40x40x40 cube.nii; ct-degrade -x 4 cube.nii other.nii
	exits 5 'ct-compose --consistent refuses a scan on another grid' ct-compose --consistent other.nii cubic.nii none.nii no.nii
	exits 3 'ct-compose --consistent refuses a scan that records no operator' ct-compose --consistent hu.nii hu.nii none.nii no.nii
	"$PY" - <<'PY'
import nibabel as nib, numpy as np
n = 16
i, j, k = np.indices((n, n, n))
save = lambda name, a, zoom=(1, 1, 1): nib.save(
    nib.Nifti1Image(a.astype(np.int16), np.diag([*zoom, 1])), name)
save('constant.nii', np.full((n, n, n), -1000))
save('range.nii', np.where((i // 8 + j // 8 + k // 8) % 2, 32767, -32768))
impulse = np.zeros((n, n, n)); impulse[8, 8, 8] = 3000
save('impulse.nii', impulse)
save('slice.nii', (100 * i - 1100)[:, :, :1], (1, 1, 5))
save('line.nii', (100 * i - 1100)[:, :1, :1])
PY
	for v in constant range impulse slice line; do
		case $v in slice) x=4,4,1 ;; line) x=4,1,1 ;; *) x=4 ;; esac
		ct-degrade --units hu -x $x $v.nii $v-lr.nii
		for m in auto htv; do
			ct-upsample -m $m -f $v-lr.nii $v-up.nii && ct-degrade -f -x $x $v-up.nii again.nii
			a=$(psnr $v-lr.nii again.nii)
			[ "$a" = inf ] || above "$a" 100; ok $? "$v, $m: the result agrees with the scan ($a dB)"
		done
	done
	a=$(psnr constant.nii constant-up.nii)
	[ "$a" = inf ] || above "$a" 120; ok $? "a constant volume stays constant ($a dB)"
else
	skip 'constant, extreme and flat volumes agree with the scan' 'no nibabel'
fi
# threads, signals, a dry run
for t in 1 3; do ct-upsample -t $t --iterations 12 P1.nii - >t$t.nii; done
cmp -s t1.nii t3.nii; ok $? 'the inversion writes the same bytes with 1 and 3 threads'
for m in tv htv; do
	ct-upsample -m $m --iterations 100000 --tolerance 0 P1.nii stop.nii &
	listens $!; kill -TERM $!; wait $!; status=$?
	[ $status -eq 75 ] && [ ! -e stop.nii ]
	ok $? "$m: SIGTERM ends it with status 75 and without an output (got $status)"
done
exits 0 'ct-upsample --dry-run reports the cost' ct-upsample --dry-run P1.nii no.nii
has out '^memory .* MiB$' 'the dry run of ct-upsample prints the memory'
[ ! -e no.nii ]; ok $? 'the dry run of ct-upsample writes no output'
done_testing
