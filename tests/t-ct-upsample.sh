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

# The error to expect of a solver alone: ct-upsample --std, ct-upsample -m prior --std of what the prior does not
# know, ct-sr -Q draft --confidence: about the one there is, in slabs and in little memory too.
part error
hash() { ct-info --json "$1" | sed -n 's/.*"hash": "\(.*\)".*/\1/p'; }
same() { [ -n "$(hash "$1")" ] && [ "$(hash "$1")" = "$(hash "$2")" ]; }
apart() { ct-metrics --range 1 --ssim none --json "$1" "$2" | sed -n 's/.*"rmse-hu": \([0-9.e+-]*\).*/\1/p'; }
# bodies with a texture: of what is flat between its edges the solver lacks nothing
ct-phantom -q -s 5 --size 48x48x48 ellipsoids flat.nii && ct-degrade -q -x 1 --noise 100 flat.nii rough.nii &&
	ct-degrade -q -x 1 --sigma .5,.5,.5 rough.nii truth.nii || exit 99

# calibrated NAME STD RESULT: the error is about the expected one, as a whole and in what expects most, which is
# more than that of what expects least
calibrated() {
	ct-metrics --ssim none --uncertainty "$2" truth.nii "$3" >out
	awk '/^std-all/ {a = $3 / $4; b = $5; c = $6} /^std-[0-9]/ {if (!n++) {l = $4; le = $3} h = $4; he = $3}
		END {exit !(a > .8 && a < 1.8 && b > .5 && b < .8 && c > .75 && he / h < 2.5 && h > 1.4 * l && he > 4 * le)}' out
	ok $? "$1: about the one there is ($(grep std-all out))"
}
for o in '-x 4' '-x 2' '-x 4 -p P3' '-x 4 --noise 15' '-x 1,1,4 --sigma 0 --decimate mean'; do
	# shellcheck disable=SC2086
	ct-degrade -q -f $o truth.nii lo.nii && ct-upsample -q -f lo.nii plain.nii
	exits 0 "$o" ct-upsample -q -f --std s.nii lo.nii hi.nii
	same hi.nii plain.nii; ok $? 'the same voxels as without'
	calibrated "$o" s.nii hi.nii
done
has_history() { ct-info -v "$1" | sed -n '/^history/,$p' | grep -q "$2 xxh3:"; ok $? "knows of $2"; }
has_history s.nii lo.nii
head -c 6912 /dev/zero >zero.raw && ct-convert -q --raw 12x12x12:f32:8 zero.raw zero.nii
for n in 0 30; do
	ct-upsample -q -x 2 --sigma .85 --noise $n --std z$n.nii zero.nii z.nii -f; ct-info -v z$n.nii | sed -n 's/^mean *//p'
done | tr '\n' ' ' >of; awk '{exit !($1 >= 1 && $1 < 2 && $2 > 20)}' of; ok $? "of noise more is expected, where nothing varies, too ($(cat of))"
dd if=s.nii bs=1 skip=148 count=80 2>/dev/null | tr '\0' '\n' | grep -q '^expected error, HU; ct-upsample [0-9.]*$'; ok $? 'says what it is'
ct-upsample -q -t 3 --std s3.nii lo.nii hi3.nii && same s3.nii s.nii; ok $? 'any number of threads'

# where the prior knows nothing: the same as of ct-upsample
p=$builddir/slices.safetensors
for o in '-x 1,1,4' '-x 1,1.25,10'; do
	# shellcheck disable=SC2086
	ct-degrade -q -f $o truth.nii lo.nii && ct-upsample -q -f --std s.nii lo.nii hi.nii
	exits 0 "$o, left to the solver" ct-upsample -m prior -f -p "$p" --std r.nii lo.nii x.nii
	has err 'the prior adds nothing$' 'a prior that adds nothing says so'
	same r.nii s.nii && same x.nii hi.nii; ok $? "where the prior adds nothing --std is that of the inversion ($o)"
done
rm -f r.nii x.nii
exits 5 'with a weight it is an error' ct-upsample -m prior -p "$p" --expert weight=1 --std r.nii lo.nii x.nii
exits 3 'as is a volume that another program made' ct-upsample -m prior -p "$p" --start hi.nii --std r.nii lo.nii x.nii
ct-phantom -q --size 32x32x32 cube cube.nii && ct-convert -q --type f32 cube.nii - | tail -c 131072 | head -c 4096 >cube.raw
ct-convert -q --raw 16x8x8:f32:8 cube.raw even.nii
exits 3 'a scan whose edges do not say how it was made' ct-upsample --estimate -x 4 --std r.nii even.nii x.nii
has err '^ct-upsample: even.nii: its edges do not show how it was made, which the predicted error needs: pass --sigma$' 'has no predicted error'
exits 2 'an inversion whose estimate finds no blur is refused with status 2' ct-upsample -m tv --estimate -x 4 even.nii x.nii
has err '^ct-upsample: even.nii: its edges do not show how it was made, which method tv needs: pass --sigma$' 'its error does not advise to estimate the blur again'
exits 2 'or that does not say it itself' ct-upsample -x 4 --std r.nii even.nii x.nii
has err '^ct-upsample: even.nii: holds no operator (how it was reduced): pass --sigma' 'the error of a scan without its operator names it'
exits 3 'ct-sr refuses a scan whose operator is not known' ct-sr -Q draft --confidence r.nii even.nii x.nii
exits 0 'but not for a page of it' ct-sr -Q draft --report page.html even.nii page.nii
has page.html '<li>No predicted error was given' 'which says that there is no predicted error'
exits 0 'nor for the page of a small factor' ct-sr -x 1.2 --report page.html -f even.nii page.nii
has page.html '<li>No predicted error was given' 'which is only interpolated and has none'
[ ! -e r.nii ] && [ ! -e x.nii ]; ok $? 'and nothing is left of what failed'

# ct-sr, whole and in slabs
ct-degrade -q -f -x 4 -p P3 truth.nii lo.nii && ct-upsample -q -f --std s.nii lo.nii hi.nii
exits 0 'ct-sr writes --confidence of a draft' ct-sr -Q draft --confidence c.nii --report r.html lo.nii o.nii
same c.nii s.nii && same o.nii hi.nii; ok $? 'a draft of ct-sr expects the errors of ct-upsample'
grep -q 'id="error"' r.html; ok $? 'the page shows it'
ct-degrade -q -f -x 1,1.25,10 truth.nii lo5.nii && ct-upsample -q -f --std s5.nii lo5.nii hi5.nii
exits 0 'fast, of factors that no prior knows' ct-sr -Q fast -x 1,1.25,10 --prior "$p" --confidence c5.nii lo5.nii o5.nii
same c5.nii s5.nii; ok $? 'expects that of the solver'
ct-phantom -q -s 5 --size 48x48x400 ellipsoids long.nii && ct-degrade -q -f -x 4 -p P3 long.nii lo.nii && ct-upsample -q -f --std s.nii lo.nii hi.nii
exits 0 '--std is written in slabs' ct-upsample -v --memory 84M --std s2.nii lo.nii h2.nii
awk -v d="$(apart s.nii s2.nii)" 'BEGIN {exit !(d != "" && d < .05)}'; ok $? "the same error ($(apart s.nii s2.nii) HU apart)"

# ct-upsample: the operator that the file, the options or the edges say, what OUT says of it, and the limits
# of all of them; those of ct-degrade, ct-info and ct-phantom too.
part operator
command -v python3 >/dev/null || { skip 'ct-upsample' 'no python3'; done_testing; }
says() { # says FILE FACTOR SIGMA DECIMATE METHOD: exactly, or to 6 digits
	ct-info "$1" | awk -v want="$2 $3 $4 $5" '/^  (factor|sigma|decimate|upsample) / {v[$1] = $2}
		function all(s,  n, p, i, t) {if (s == "-") return ""; n = split(s, p, ","); for (i = 1; i <= n; i++) t = t sprintf("%.6g,", p[i]); return t}
		END {split(want, w, " "); exit !(all(v["factor"]) == all(w[1]) && all(v["sigma"]) == all(w[2]) &&
			(v["decimate"] "-") ~ "^" w[3] "-?$" && (v["upsample"] "-") ~ "^" w[4] "-?$")}'
	ok $? "$1 records factor $2, sigma $3, sampling $4, method $5"
	ct-info "$1" | sed -n 's/^  \(factor\|sigma\|decimate\|upsample\) /# &/p'
}
bare() { # bare FILE N MM: its voxels without a word
	ct-convert -q --type f32 "$1" - | tail -c $(($2 * $2 * $2 * 4)) >raw
	ct-convert -q --raw "$2x$2x$2:f32:$3" --orient RAS raw "bare-$1"
}
ct-phantom -q --size 96x96x96 --spacing 1 sphere hi.nii
for p in P1 P3; do ct-degrade -q -x 3 -p $p hi.nii $p.nii; bare $p.nii 32 3; done
up() { ct-upsample -f -v --iterations 3 "$@" >out 2>err; } # up ARGS...

# on edges: what is told is what OUT says, in voxels of OUT; an axis that is not refined has none
told() { # told N: as many axes as err tells of; what it assumes is in $s
	sed -n 's/^ct-upsample: axis [0-2]: spread [0-9.]* +- [0-9.]* voxels, aliases with [0-9]* %, assumed blur \([0-9.]*\) voxels of OUT, [0-9]* edges$/\1/p' err >axes
	[ "$(wc -l <axes)" -eq "$1" ] && ct-info e.nii | awk 'NR == FNR {want[n++] = $1; next}
		$1 == "sigma" {split($2, got, ",")} END {for (k = 0; k < n; k++) bad += (got[k + 1] - want[k])^2 > 1e-4; exit bad > 0}' axes -
}
sampled() { [ "$(ct-info e.nii | awk '$1 == "decimate" {print $2}')" = "$1" ]; }
up -x 3 --estimate bare-P1.nii e.nii
told 3 && sampled sinc
ok $? '--estimate -v prints the blur and sampling that the result records'
near() { awk -v lo="$1" -v hi="$2" '$1 >= lo && $1 <= hi {n++} END {exit n != 3}' axes; } # near LEAST MOST: all three
near 0.95 1.3; ok $? "the estimated blur is near the 1.27 voxels that made the scan: $(tr '\n' ' ' <axes)"
up -x 3,3,1 --estimate bare-P1.nii e.nii
told 2 && sampled sinc
ok $? 'an axis that is not refined has no estimate'
up -x 3 --estimate bare-P3.nii e.nii
told 3 && sampled point
ok $? 'a point-sampled scan is estimated as points'
near 0 0.4; ok $? "the estimated blur of a point-sampled scan is small: $(tr '\n' ' ' <axes)"
up -x 3 --estimate --decimate mean bare-P1.nii e.nii
told 3 && sampled mean
ok $? '--decimate is used beside --estimate'
near 0.5 0.9; ok $? "beside --decimate mean the estimated blur is smaller: $(tr '\n' ' ' <axes)"
# 12 slices are too few for edges
ct-degrade -q -x 1,1,8 --sigma 0 --decimate mean hi.nii few.nii
ct-convert -q --type f32 few.nii - | tail -c $((96 * 96 * 12 * 4)) >raw && ct-convert -q --raw 96x96x12:f32:1,1,8 --orient RAS raw bare-few.nii
up -x 1,1,8 --estimate bare-few.nii e.nii
sampled mean
ok $? 'twelve slices are too few for edges and assumed as means'
has err 'axis 2: spread .* voxels, aliases with 50 %' 'of slices of which nothing is known aliasing is even odds'
up -x 3 --estimate P1.nii e.nii; says e.nii 3,3,3 1.27399354,1.27399354,1.27399354 sinc tv
! grep -q 'axis 0' err; ok $? 'a file that records its operator is not measured'
ct-phantom -q --size 12x12x12 --spacing 3 constant flat.nii; bare flat.nii 12 3
ct-upsample -q -x 3 --estimate bare-flat.nii e.nii -f; says e.nii - - - bspline

# of options
ct-upsample -q -f -m dc -x 3,2,1 --sigma 0.7 bare-P1.nii o.nii; says o.nii 3,2,1 0.7,0.7,0 sinc dc
ct-upsample -q -f -m dc -x 3,2,1 --sigma 0.7,0.6,0.5 --decimate point bare-P1.nii o.nii; says o.nii 3,2,1 0.7,0.6,0.5 point dc
ct-upsample -q -f -m dc -x 3 --sigma 0 bare-P1.nii o.nii; says o.nii 3,3,3 0,0,0 sinc dc
ct-upsample -q -f -x 3 bare-P1.nii o.nii; says o.nii - - - bspline
ct-upsample -q -f -m dc -x 3 --sigma 1.2739935 --decimate sinc P1.nii o.nii; says o.nii 3,3,3 1.27399354,1.27399354,1.27399354 sinc dc
no() { # no CODE WORDS COMMAND...
	code=$1 words=$2; shift 2
	exits "$code" "refused with status $code: $*" "$@" no.nii
	has err "$words" "the error reads: $words"
}

# the default factor: thick slices to the voxels in plane, at most 8 times, else all axes twice
head -c 2048 /dev/zero >eight.raw
chooses() { # chooses SPACING SIZE NAME: 8x8x8 voxels of that size become so many
	ct-convert -q -f --raw "8x8x8:f32:$1" eight.raw eight.nii
	exits 0 "$3 are upsampled without a factor" ct-upsample -f -m linear eight.nii chosen.nii
	ct-info --json chosen.nii | tr -d ' \n' | grep -q "\"size\":\[$2\]"; ok $? "$3 become $2 voxels without a factor"
}
chooses .7,.7,5 8,8,56 'thick slices'
chooses .5,.5,5 8,8,64 'slices ten times as thick'
chooses .7,.7,1 16,16,16 'slices that are hardly thicker'
chooses 1,1.6,1 8,16,8 'voxels that are longer along y'
no 2 'o.nii: was upsampled already: give the factor, -x' ct-upsample o.nii
no 2 'P1.nii: the factor 3,3,3.00001 contradicts the file, which was reduced 3,3,3 times' ct-upsample -x 3,3,3.00001 P1.nii
no 2 'P1.nii: sigma 1.27398 contradicts the file, which was blurred by 1.27' ct-upsample --sigma 1.27398 P1.nii
# of a scan that is stored otherwise, by its own axes
ct-degrade -q -x 2,1,3 hi.nii ras.nii; ct-convert -q --reorient PSR ras.nii psr.nii
no 2 'psr.nii: the factor 1,2.5,2 contradicts the file, which was reduced 1,3,2 times' ct-upsample -x 1,2.5,2 psr.nii
no 2 'psr.nii: sigma 1.2 contradicts the file, which was blurred by 0,1.27399,0.849329' ct-upsample --sigma 0,1.2,0.849329 psr.nii
no 2 'psr.nii: --sigma contradicts --profile, which says the blur along axis 1' ct-upsample --sigma 0,1.27399355,0.84932903 --profile box psr.nii
for x in 0.99 1025 1,1,0.5; do no 2 '--factor: .* is outside \[1, 1024\]' ct-upsample -x $x bare-P1.nii; done
for x in -0.1 1001 1,1,-1; do no 2 '--sigma: .* is outside \[0, 1000\]' ct-upsample -x 3 --sigma=$x bare-P1.nii; done
# --spacing; bare-P1.nii has voxels of 3 mm
ct-upsample -q -f -m linear -x 3 bare-P1.nii o.nii
exits 0 '--spacing 1 is accepted for voxels of 3 mm' ct-upsample -m linear --spacing 1 bare-P1.nii mm.nii
cmp -s o.nii mm.nii || ct-metrics --json o.nii mm.nii | grep -q '"max-hu": 0[,.]'
ok $? '--spacing 1 for voxels of 3 mm is a factor of 3'
exits 0 '--spacing accepts an axis that is already finer' ct-upsample -m linear --spacing 4,2,3 bare-P1.nii mm2.nii
ct-info --json mm2.nii | tr -d ' \n' | grep -q '"size":\[32,48,32\],"spacing-mm":\[3.0,2.0,3.0\]'
ok $? 'an axis that is already finer keeps its spacing'
exits 0 '--spacing is accepted if the factor is that of the file' ct-upsample -m linear --spacing 1 P1.nii mm3.nii
no 2 'P1.nii: the factor 2.9703,2.9703,2.9703 contradicts the file, which was reduced 3,3,3 times' ct-upsample --spacing 1.01 P1.nii
no 2 'spacing: -1 is not positive' ct-upsample --spacing=1,-1,1 bare-P1.nii
no 2 'spacing 0.002 mm is 1/1500 of a voxel, below 1/1024' ct-upsample --spacing 0.002 bare-P1.nii
exits 0 'a factor of 1 along every axis is accepted' ct-upsample -x 1 -m linear bare-P1.nii one.nii
exits 0 'a factor that differs from that of the file by 1e-6 is accepted' ct-upsample -f -m linear -x 3.000001 P1.nii o.nii

# noise that the file records, and --noise
ct-degrade -q -x 3 --noise 5 hi.nii noisy.nii
no 2 'noisy.nii: the noise 4 contradicts the file, whose noise is 5 HU' ct-upsample --noise 4 noisy.nii
exits 0 '--noise that is that of the file is accepted' ct-upsample -f --noise 5 --iterations 3 noisy.nii o.nii
ct-info noisy.nii | grep -Eq '^  noise +5$'; ok $? 'ct-degrade records the noise that it adds'
# noise that nothing records
noise() { ct-info "$1" | awk '$1 == "noise" {print $2}'; }
ct-degrade -q -f -x 3 --noise 20 hi.nii loud.nii; bare loud.nii 32 3
ct-info -e -x 3 bare-loud.nii >out; sure=$(awk '$1 == "noise-sure-hu" {print $2}' out)
awk "BEGIN {exit !($sure > 18 && $sure < 21)}"; ok $? "ct-info measures the noise of 20 HU: $sure"
up -x 3 --estimate bare-loud.nii e.nii; awk "BEGIN {d = $(noise e.nii) - $sure; exit !(d * d < 1e-8)}"
ok $? '--estimate assumes the measured noise and records it'
ct-upsample -q -f -x 3 --estimate --noise 3 --iterations 3 bare-loud.nii o.nii
[ "$(noise o.nii)" = 3 ]; ok $? '--noise is used instead of the measured noise'
! cmp -s e.nii o.nii; ok $? 'another --noise gives another volume'
up -x 3 --estimate --noise 0 bare-loud.nii e.nii; [ -z "$(noise e.nii)" ]; ok $? '--noise 0 records no noise'
ct-upsample -m prior -q -f -x 3 --estimate bare-loud.nii r.nii; awk "BEGIN {d = $(noise r.nii) - $sure; exit !(d * d < 1e-8)}"
ok $? '-m prior records the measured noise'
ct-degrade -q -x 1 noisy.nii again.nii
! ct-info again.nii | grep -q '^  noise'
ok $? 'ct-degrade does not copy the noise of its input'
[ "$(noise P1.nii)" = 0 ]; ok $? 'ct-degrade records a noise of 0'
up -x 3 --sigma 1.274 bare-loud.nii e.nii; awk "BEGIN {d = $(noise e.nii) - $sure; exit !(d * d < 1e-8)}"
ok $? 'noise is measured beside a blur that is given'
ct-upsample -q -f -x 3 -m linear bare-loud.nii o.nii
[ -z "$(noise o.nii)" ]
ok $? '-m linear measures and records no noise'

# --start
ct-upsample -q -f -m linear P1.nii start.nii
exits 0 '-m dc accepts a volume by --start' ct-upsample -f -m dc --start start.nii P1.nii o.nii
ct-info o.nii | grep -q ' P1.nii xxh3:.* start.nii xxh3:'; ok $? 'the history names scan and start with checksums'

# ct-degrade: operators and their limits
# shellcheck disable=SC2086
deg() { want=$1; shift; ct-degrade -q -f "$@" hi.nii d.nii; set -- $want; says d.nii "$1" "$2" "$3" -; }
deg '4,4,4 1.69865806,1.69865806,1.69865806 sinc' -x 4
deg '4,4,1 1,1,0 sinc' -x 4,4,1 -p P2
deg '4,2,1 0.5,0.25,0 point' -x 4,2,1 -p P3
deg '4,4,1 0.9,0.9,0 point' -x 4,4,1 -p P3 --sigma 0.9
deg '4,4,1 0.9,0.8,0.7 mean' -x 4,4,1 --sigma 0.9,0.8,0.7 --decimate mean
ct-degrade -q -x 3 --clip=-100:20.5 hi.nii clip.nii
ct-info clip.nii | grep -Eq '^  clip +-100:20.5$'; ok $? 'ct-degrade --clip is recorded in the file'
for x in 0.99 1025; do no 2 '--factor: .* is outside \[1, 1024\]' ct-degrade -x $x hi.nii; done
for x in -0.1 1001; do no 2 '--sigma: .* is outside \[0, 1000\]' ct-degrade -x 3 --sigma=$x hi.nii; done
exits 2 'ct-info -x 1025 is refused with status 2' ct-info -e -x 1025 hi.nii
has err 'outside \[1, 1024\]' 'the error of ct-info -x 1025 says its range'
exits 2 'ct-phantom --spacing 0 is refused with status 2' ct-phantom --spacing 0 --size 4x4x4 sphere no.nii
has err 'is not positive' 'the error of a spacing of 0 says not positive'
done_testing
