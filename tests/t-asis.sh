#!/bin/sh
# Scans that say nothing of how they were made, by small and other factors: what ct-sr makes stays in their range.
. "$srcdir/tests/tap.sh"
command -v python3 >/dev/null || { skip 'scans as they come' 'python3 is not here'; done_testing; }
ct-phantom -q --size 48x48x48 --spacing 1.5 --window=-1024:3071 ellipsoids made.nii || exit 99
ct-degrade -q -x 1 --noise 12 made.nii loud.nii
for v in made loud; do python3 "$srcdir/examples/blind.py" bare $v.nii $v-bare.nii; done
asis() { make -s -f "$srcdir/examples/asis.mk" CUBE=40 RESULT=56 OUT=o "$@" >table; }
wrong() { grep 'wrong$' table | sed 's/^/# /'; }
asis VOLUMES=made-bare.nii FACTORS='1.01 1.02 1.05 1.1 1.2 1.25 1.5 2 3 1,1,1.1 1,1,1.5 1.5,1.5,1 1.1,1.2,3 1,1,3'
ok $? "draft: $(tail -n 1 table)"; wrong
asis VOLUMES=loud-bare.nii FACTORS='1.02 1.2 1.3 2'; ok $? "with noise: $(tail -n 1 table)"; wrong
asis VOLUMES=made-bare.nii CUBE=32 QUALITY='fast balanced' FACTORS='1.05 1.3 2'; ok $? "with the prior: $(tail -n 1 table)"; wrong
[ "$(grep -c '^made' table)" -eq 6 ]; ok $? 'a row a factor and preset'
same() { ct-metrics --ssim none "$1" "$2" | awk '$1 == "max-hu" {exit !($2 == 0)}'; }

# small factors
ct-upsample -q -x 1.1 -m cubic made-bare.nii cubic.nii
for q in draft fast balanced; do
	ct-sr -q -f -Q $q -x 1.1 made-bare.nii sr.nii && same cubic.nii sr.nii; ok $? "$q: 1.1 times is cubic interpolation"
done
exits 0 'an estimate' ct-upsample -m tv --estimate -x 1.1 made-bare.nii up.nii; same cubic.nii up.nii; ok $? 'so is that of ct-upsample'
exits 0 'without -q' ct-sr -f -x 1.1 made-bare.nii sr.nii
has err 'assumed: along x,y,z only interpolated (cubic), as the factor is below 1.25; --sigma and --decimate say it better' 'it says so'
ct-info sr.nii | grep -q 'assumed .*only interpolated (cubic), as the factor is below 1.25'; ok $? 'and the result does'
ct-info --operator -x 1.1 made-bare.nii | grep -q 'assumed .*only interpolated'; ok $? 'and ct-info before'
exits 0 'by voxels of 1.3 mm' ct-sr -Q draft --spacing 1.3 made-bare.nii mm.nii
has err 'only interpolated (cubic)' 'a spacing is a factor too'
exits 3 'there is no predicted error of it' ct-sr -Q draft -x 1.1 --confidence e.nii made-bare.nii no.nii
has err 'made-bare.nii: factors below 1.25 are only interpolated' 'which is said'
exits 0 'an operator that is given' ct-sr -f -Q draft -x 1.1 --sigma .4 made-bare.nii given.nii
has err '; h\{0,1\}tv, .*iterations' 'is inverted'
ct-degrade -q -x 1.2 --protocol P1 made.nii lr.nii
exits 0 'an operator of the file' ct-sr -f -Q draft -x 1.2 lr.nii file.nii
has err '; h\{0,1\}tv, .*iterations' 'is inverted, too'
exits 0 'small and large factors' ct-sr -Q draft -x 1.1,1.1,3 made-bare.nii mixed.nii
grep -q 'wide (FWHM) along z, .*along x,y only interpolated' err; ok $? 'the large one is inverted'
has err '48x48x48 to 53x53x144, 1.1,1.1,3 times; .*tv, [0-9]* iterations' 'on the grid of both'
ct-info mixed.nii | grep -q ' factor  *1.1,1.1,3'; ok $? 'of which the result says the factors'
ct-upsample -q -x 1.1,1.1,3 -m cubic made-bare.nii grid.nii; ct-metrics --ssim none grid.nii mixed.nii >/dev/null; ok $? 'as interpolation does'

# what is damped
exits 0 'a factor between' ct-sr -f -Q draft -x 1.5 made-bare.nii sr.nii
has err 'the result left the range of the scan by up to [0-9]* HU: [0-9.]* % of the voxels are blended with cubic' 'what is damped is said'
ct-info sr.nii | grep -q 'assumed .*of the voxels are blended with cubic'; ok $? 'and kept'
ct-sr -q -f -t 1 -Q draft -x 1.5 made-bare.nii one.nii; ct-sr -q -f -t 3 -Q draft -x 1.5 made-bare.nii three.nii
same one.nii three.nii; ok $? 'the same voxels with three threads'
ct-phantom -q --size 72x72x72 --spacing 1 --window=-1024:3071 ellipsoids truth.nii
ct-upsample -q -x 1.5 -m cubic made-bare.nii c.nii
psnr() { ct-metrics --ssim none truth.nii "$1" | awk '$1 == "psnr" {print $2}'; }
awk -v a="$(psnr sr.nii)" -v b="$(psnr c.nii)" 'BEGIN {exit !(a > b + 2)}'; ok $? 'it is still 2 dB nearer to the truth than cubic'
ct-metrics --harm --ssim none truth.nii sr.nii | awk '$1 == "structures-false" {exit !($2 == 0)}'; ok $? 'without false structures'
exits 0 'a blur that was never there' ct-sr -f -Q draft -x 1.3 --sigma 1.2 --noise 0 made-bare.nii wide.nii
has err 'the result leaves the range of the scan by [0-9]* HU, more than all of it' 'is warned of'
done_testing
