#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# --profile and --slice-thickness: what they mean, what they contradict, what carries them on.
. "${srcdir:?}/tests/tap.sh"
ct-phantom -q --size 32x32x60 --spacing 1 ellipsoids hi.nii || exit 99
line() { ct-info "$1" | awk -v k="$2" '$1 == k {$1 = ""; sub(/^ /, ""); print}'; } # line FILE KEY
bare() { ct-convert -q --type f32 "$1" - | tail -c $((32 * 32 * $2 * 4)) >raw; ct-convert -q -f --raw "32x32x$2:f32:1,1,$3" --orient RAS raw "$4"; }
no() { # no STATUS WORDS COMMAND...
	status=$1 words=$2; shift 2
	exits "$status" "refused with status $status: $*" "$@" no.nii
	has err "$words" "the error reads: $words"
	[ ! -e no.nii ] || ok 1 "no output is left by: $*"
}

# profiles that other options can state too
ct-degrade -q -x 1,1,5 --slice-thickness 4 hi.nii a.nii && ct-degrade -q -x 1,1,5 --sigma 0,0,1.484 --decimate point hi.nii b.nii
ct-metrics --ssim none a.nii b.nii >m
has m '^max-hu 0[.]0*$' '--slice-thickness is a Gaussian with a sigma of .371 of it, point-sampled'
ct-degrade -q -x 1,1,5 --profile gaussian --slice-thickness 4 hi.nii c.nii
ct-metrics --ssim none a.nii c.nii >m
has m '^max-hu 0[.]0*$' '--profile gaussian is the same as --slice-thickness alone'
ct-degrade -q -f -x 1,1,5 --profile box hi.nii a.nii && ct-degrade -q -f -x 1,1,5 --sigma 0 --decimate mean hi.nii b.nii
ct-metrics --ssim none a.nii b.nii >m
has m '^max-hu 0[.]0*$' '--profile box as thick as the spacing is --decimate mean'
ct-degrade -q -x 1,1,4 --profile box --slice-thickness 2 hi.nii gap.nii
[ "$(line gap.nii profile | cut -d' ' -f1)" = 2 ]
ok $? 'a box thinner than the spacing is recorded in the file as samples'

# a profile from a file, and the header of the result
printf '# mm weight\n-1 .25\n0 .5\n1 .25\n' >p.txt
ct-degrade -q -f -x 1,1,5 --profile p.txt hi.nii a.nii
[ "$(line a.nii decimate),$(line a.nii sigma)" = point,0,0,0.763762616 ]
ok $? 'beside the samples of a profile a Gaussian of the same spread is recorded'
bare a.nii 12 5 bare.nii
exits 0 'ct-upsample uses a profile recorded in the header' ct-upsample -m dc -x 1,1,5 a.nii up.nii
exits 0 'ct-upsample uses a profile given by --profile' ct-upsample -m dc -x 1,1,5 --profile p.txt bare.nii up2.nii
ct-metrics --ssim none up.nii up2.nii | awk '$1 == "max-hu" {exit !($2 < .01)}'
ok $? 'a profile in the header and by --profile give the same volume'
exits 0 'ct-upsample uses a thickness instead of a profile' ct-upsample -f -m dc -x 1,1,5 --slice-thickness 5 bare.nii up3.nii
ct-metrics --ssim none up.nii up3.nii | awk '$1 == "max-hu" {exit !($2 > 1)}'
ok $? 'another profile gives another volume'
exits 0 'ct-sr accepts a profile by --profile' ct-sr -Q draft -x 1,1,5 --profile p.txt --noise 0 bare.nii sr.nii
has err 'with a slice profile (given)' 'ct-sr reports that the profile was given'
! grep -q 'assumed:' err; ok $? 'with a given profile ct-sr assumes nothing'
[ "$(line sr.nii profile | wc -w)" -eq 4 ]; ok $? 'the result of ct-sr records the profile'
ct-metrics --consistency bare.nii sr.nii | awk '$1 == "residual-rms-hu" {exit !($2 < .01)}'
ok $? 'the result with a given profile agrees with the scan'
ct-convert -q --reorient SAR a.nii turned.nii
[ "$(line turned.nii profile | cut -d' ' -f1)" = 0 ]
ok $? 'a recorded profile turns with its axis'
exits 0 'ct-upsample uses a profile along another axis' ct-upsample -m dc turned.nii up4.nii
ct-convert -q --reorient RAS up4.nii back.nii && ct-metrics --ssim none up.nii back.nii | awk '$1 == "max-hu" {exit !($2 < .01)}'
ok $? 'a profile along another axis gives the same volume'
ct-convert -q --iso 2 a.nii coarse.nii
[ -z "$(line coarse.nii profile)" ]; ok $? 'a recorded profile is dropped on another grid'
exits 0 'ct-sr accepts a blur in plane with a profile of slices' ct-sr -Q draft -x 2,2,5 --sigma .7,.7,0 --decimate mean --profile p.txt --noise 0 bare.nii sr2.nii
exits 0 'ct-sr measures the blur in plane beside a profile of slices' ct-sr -Q draft -x 2,2,5 --profile p.txt --noise 0 bare.nii sr3.nii
! grep -q 'along x,y,z' err; ok $? 'with a profile of slices the blur along z is not measured'

# contradictions
no 2 '--sigma contradicts --profile, which says the blur along axis 2' ct-upsample -x 1,1,5 --sigma 1 --profile box bare.nii
no 2 '--decimate contradicts --slice-thickness, which says how axis 2 was sampled' ct-sr -x 1,1,5 --decimate mean --slice-thickness 5 bare.nii
no 2 '--sigma contradicts --slice-thickness' ct-degrade -x 1,1,5 --sigma 1 --slice-thickness 5 hi.nii
no 2 '--decimate contradicts --profile' ct-degrade -x 1,1,5 --decimate mean --profile triangle hi.nii
no 2 'a slice profile leaves nothing of it' ct-degrade -x 1,1,5 -p P1 --profile triangle hi.nii
no 2 'a.nii: --profile and --slice-thickness contradict the file, which says its operator' ct-upsample -x 1,1,5 --profile triangle a.nii
no 2 'slice-thickness: the file of --profile says it' ct-upsample -x 1,1,5 --profile p.txt --slice-thickness 5 bare.nii
no 2 'bare.nii: a slice thickness of 90 mm at a spacing of 5 mm is not above 0 and up to 16 times that' ct-upsample -x 1,1,5 --slice-thickness 90 bare.nii
# files
no 3 'none.txt: no file, and no shape of --profile: gaussian' ct-upsample -x 1,1,5 --profile none.txt bare.nii
printf -- '-1 1\n0 x\n1 1\n' >bad.txt
no 3 'bad.txt: line 2: field 2, weight, is no number' ct-upsample -x 1,1,5 --profile bad.txt bare.nii
printf -- '-1 1\n0 1\n\0001 1\n' >bad.txt
no 3 'bad.txt: a slice profile is text, and this is none' ct-sr -x 1,1,5 --profile bad.txt bare.nii
awk 'BEGIN {for (i = -70; i < 71; i++) print i / 100, 1}' >long.txt
no 3 'long.txt: line 129: more than 128 samples' ct-degrade -x 1,1,5 --profile long.txt hi.nii
done_testing
