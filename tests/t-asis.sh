#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Scans that say nothing of how they were made, by small and other factors: what ct-sr makes stays in their range.
. "$srcdir/tests/tap.sh"
command -v python3 >/dev/null || { skip 'scans as they come' 'python3 is not here'; done_testing; }
ct-phantom -q --size 48x48x48 --spacing 1.5 --window=-1024:3071 ellipsoids made.nii || exit 99
ct-degrade -q -x 1 --noise 12 made.nii loud.nii
for v in made loud; do python3 "$srcdir/examples/blind.py" bare $v.nii $v-bare.nii; done
asis() { make -s -f "$srcdir/examples/asis.mk" CUBE=40 RESULT=56 OUT=o "$@" >table; }
wrong() { grep 'wrong$' table | sed 's/^/# /'; }
# every factor: the result stays in the range of the scan
asis VOLUMES=made-bare.nii FACTORS='1.01 1.02 1.05 1.1 1.2 1.25 1.5 2 3 1,1,1.1 1,1,1.5 1.5,1.5,1 1.1,1.2,3 1,1,3'
ok $? "a draft of a noise-free scan stays in its range at each factor: $(tail -n 1 table)"; wrong
asis VOLUMES=loud-bare.nii FACTORS='1.02 1.2 1.3 2'
ok $? "a draft of a noisy scan stays in its range at each factor: $(tail -n 1 table)"
wrong
asis VOLUMES=made-bare.nii CUBE=32 QUALITY='fast balanced' FACTORS='1.05 1.3 2'
ok $? "fast and balanced results stay in the range of the scan: $(tail -n 1 table)"
wrong
[ "$(grep -c '^made' table)" -eq 6 ]; ok $? 'the table has one row for each factor and preset'
same() { ct-metrics --ssim none "$1" "$2" | awk '$1 == "max-hu" {exit !($2 == 0)}'; }

# small factors
ct-upsample -q -x 1.1 -m cubic made-bare.nii cubic.nii
for q in draft fast balanced; do
	ct-sr -q -f -Q $q -x 1.1 made-bare.nii sr.nii && same cubic.nii sr.nii
	ok $? "ct-sr -Q $q -x 1.1 gives the voxels of cubic interpolation"
done
exits 0 'ct-upsample --estimate takes a factor of 1.1' ct-upsample -m tv --estimate -x 1.1 made-bare.nii up.nii
same cubic.nii up.nii
ok $? 'ct-upsample --estimate -x 1.1 gives the voxels of cubic interpolation'
exits 0 'ct-sr takes a factor of 1.1' ct-sr -f -x 1.1 made-bare.nii sr.nii
has err 'assumed: along x,y,z only interpolated (cubic), as the factor is below 1.25; --sigma and --decimate say it better' 'ct-sr reports that it only interpolates factors below 1.25'
ct-info sr.nii | grep -q 'assumed .*only interpolated (cubic), as the factor is below 1.25'
ok $? 'ct-info of a result at 1.1 times says that it is only interpolated'
ct-info --operator -x 1.1 made-bare.nii | grep -q 'assumed .*only interpolated'
ok $? 'ct-info --operator says before the run that 1.1 times is only interpolated'
exits 0 'ct-sr takes a spacing that is a factor of 1.15' ct-sr -Q draft --spacing 1.3 made-bare.nii mm.nii
has err 'only interpolated (cubic)' 'a factor below 1.25 that follows from --spacing is only interpolated'
exits 3 '--confidence of an interpolated factor is refused with status 3' ct-sr -Q draft -x 1.1 --confidence e.nii made-bare.nii no.nii
has err 'made-bare.nii: factors below 1.25 are only interpolated' 'the error of --confidence for an interpolated factor names the file'
exits 0 'ct-sr takes --sigma with a factor of 1.1' ct-sr -f -Q draft -x 1.1 --sigma .4 made-bare.nii given.nii
has err '; h\{0,1\}tv, .*iterations' 'with --sigma a factor of 1.1 is inverted, not interpolated'
ct-degrade -q -x 1.2 --protocol P1 made.nii lr.nii
exits 0 'ct-sr takes a factor of 1.2 that ct-degrade recorded in the scan' ct-sr -f -Q draft -x 1.2 lr.nii file.nii
has err '; h\{0,1\}tv, .*iterations' 'with an operator recorded in the scan a factor of 1.2 is inverted'
exits 0 'small and large factors may stand in one -x' ct-sr -Q draft -x 1.1,1.1,3 made-bare.nii mixed.nii
grep -q 'wide (FWHM) along z, .*along x,y only interpolated' err
ok $? 'of small and large factors only the small ones are interpolated'
has err '48x48x48 to 53x53x144, 1.1,1.1,3 times; .*tv, [0-9]* iterations' 'with small and large factors the inversion runs on the grid of all of them'
ct-info mixed.nii | grep -q ' factor  *1.1,1.1,3'; ok $? 'ct-info of a result of mixed factors shows all three'
ct-upsample -q -x 1.1,1.1,3 -m cubic made-bare.nii grid.nii
ct-metrics --ssim none grid.nii mixed.nii >/dev/null
ok $? '-x 1.1,1.1,3 gives the grid that cubic interpolation gives'

# what is damped
exits 0 'ct-sr takes a factor of 1.5' ct-sr -f -Q draft -x 1.5 made-bare.nii sr.nii
has err 'the result left the range of the scan by up to [0-9]* HU: [0-9.]* % of the voxels are blended with cubic' 'ct-sr reports how many voxels it blended with cubic interpolation'
ct-info sr.nii | grep -q 'assumed .*of the voxels are blended with cubic'
ok $? 'ct-info of the result says that voxels were blended with cubic interpolation'
ct-report -q made-bare.nii sr.nii page.html
has page.html '<li>The result left the range of the scan by up to [0-9]* HU: [0-9.]* % of the voxels are blended with cubic.</li>' 'the page of ct-report warns of voxels that are blended with cubic interpolation'
grep -q '"row">Known from</th><td>profile [^<]*sure[^<]*[^; ]</td>' page.html && ! grep -q '<td>[^<]*left the range' page.html
ok $? 'the page of ct-report lists them among the warnings alone'
ct-sr -q -f -t 1 -Q draft -x 1.5 made-bare.nii one.nii; ct-sr -q -f -t 3 -Q draft -x 1.5 made-bare.nii three.nii
same one.nii three.nii; ok $? 'voxels blended with cubic are the same with one and three threads'
ct-phantom -q --size 72x72x72 --spacing 1 --window=-1024:3071 ellipsoids truth.nii
ct-upsample -q -x 1.5 -m cubic made-bare.nii c.nii
psnr() { ct-metrics --ssim none truth.nii "$1" | awk '$1 == "psnr" {print $2}'; }
awk -v a="$(psnr sr.nii)" -v b="$(psnr c.nii)" 'BEGIN {exit !(a > b + 2)}'
ok $? 'a blended result is 2 dB nearer to the truth than cubic interpolation'
ct-metrics --harm --ssim none truth.nii sr.nii | awk '$1 == "structures-false" {exit !($2 == 0)}'
ok $? 'a blended result at 1.5 times has no false structures'
exits 0 'ct-sr takes a --sigma that is wider than the blur of the scan' ct-sr -f -Q draft -x 1.3 --sigma 1.2 --noise 0 made-bare.nii wide.nii
has err 'the result leaves the range of the scan by [0-9]* HU, more than all of it' 'a --sigma that is too wide gives a warning about the range of the result'
done_testing
