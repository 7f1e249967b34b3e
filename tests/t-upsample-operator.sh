#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-upsample: the operator that the file, the options or the edges say, what OUT says of it, and the limits
# of all of them; those of ct-degrade, ct-info and ct-phantom too.
. "$srcdir/tests/tap.sh"
command -v python3 >/dev/null || { echo '1..0 # SKIP no python3'; exit 0; }
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
ct-upsample -q -x 3 --estimate bare-flat.nii e.nii -f; says e.nii 3,3,3 0,0,0 sinc bspline

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
