#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# examples/blind.mk: the same voxels without metadata, and what not knowing the operator costs.
. "${srcdir:?}/tests/tap.sh"
command -v python3 >/dev/null || { skip 'blind.mk' 'python3 is not here'; done_testing; }
py=$srcdir/examples/blind.py
ct-phantom -q --size 48x48x48 --spacing 1.5 --window=-512:3071 ellipsoids v.nii || exit 99
# the scans that blind.mk makes, and their bare copies
exits 0 'blind.mk measures a scan with two cases' make -s -f "$srcdir/examples/blind.mk" VOLUMES=v.nii CUBE=48 CASES='P1-2 g40n-4' QUALITY=draft OUT=o
[ "$(cut -d, -f1-3 o/blind.csv | tail -n +2 | tr '\n' ' ')" = 'v,P1-2,cubic v,P1-2,known v,P1-2,blind v,g40n-4,cubic v,g40n-4,known v,g40n-4,blind ' ]
ok $? 'blind.csv has a line for each case and method in order'
ct-info --json o/v/g40n-4/lr.nii | tr -d ' \n' | grep -q '"factor":"1,1,4".*"sigma":"0,0,1.6","decimate":"point"'
ok $? 'case g40n-4 blurs with a Gaussian of 40 % of the thickness'
ct-info o/v/g40n-4/lr.nii | grep -q '^  noise  *15$'; ok $? 'case g40n-4 adds noise of 15 HU'
exits 0 'blind.mk makes single scans averaged over cells' make -s -f "$srcdir/examples/blind.mk" CUBE=48 OUT=o VOLUMES=v.nii CASES='mean-2 meann-2' o/v/mean-2/lr.nii o/v/meann-2/lr.nii
! ct-info o/v/mean-2/lr.nii | grep -q '^  noise  *15$'; ok $? 'case mean-2 adds no noise to the scan'
ct-info o/v/meann-2/lr.nii | grep -q '^  noise  *15$'; ok $? 'case meann-2 adds noise of 15 HU'
ct-info o/v/g40n-4/bare.nii >info
! grep -qE '^  (factor|sigma|decimate|noise|history)' info
ok $? 'the bare copy records neither factor nor blur, noise or history'
ct-metrics --ssim none o/v/g40n-4/lr.nii o/v/g40n-4/bare.nii | awk '$1 == "max-hu" {exit !($2 > 0 && $2 <= .5)}'
ok $? 'the bare copy has the voxels of the scan, rounded to whole HU'
# scans whose slices were interpolated before: softer along z by themselves
ct-phantom -q --size 60x60x60 --spacing 1.5 --window=-512:3071 ellipsoids w.nii || exit 99
exits 0 'blind.mk makes scans that were interpolated along z' make -s -f "$srcdir/examples/blind.mk" VOLUMES=w.nii CUBE=60 CASES='mean-2-i15 mean-2-i25' QUALITY=draft OUT=o
awk -F, 'NR == 1 {for (i = 1; i <= NF; i++) if ($i == "psnr") c = i} {p[$2 $3] = $c}
	END {exit !(p["mean-2-i15blind"] > p["mean-2-i15cubic"] && p["mean-2-i25blind"] > p["mean-2-i25cubic"])}' o/blind.csv
ok $? 'slices that were interpolated are refined better than by cubic interpolation'
# such slices are undone with care, unless the measured blur is trusted
bare=o/w/mean-2-i25/bare.nii
psnr() { ct-metrics --csv --ssim none o/w/hr-i25.nii "$1" | tail -n 1 | cut -d, -f5; }
exits 0 'ct-sr refines slices that were interpolated' ct-sr -f -x 1,1,2 "$bare" careful.nii
has err '^ct-sr: slices may be soft by themselves: less blur is undone, without the network; --trust does not$' 'the log says that soft slices are undone with care'
exits 0 'ct-sr refines soft slices as measured' ct-sr -f --trust -Q draft -x 1,1,2 "$bare" trusted.nii
! grep -q 'soft by themselves' err; ok $? 'with --trust the log says nothing of care'
awk "BEGIN {exit !($(psnr careful.nii) > $(psnr trusted.nii) + 1)}"; ok $? 'care is more accurate than trust by 1 dB'
exits 0 'ct-sr refines soft slices whose operator is known' ct-sr -f o/w/mean-2-i25/lr.nii known.nii
has err '^ct-sr: slices are softer than they were made: undone without the network; --trust does not$' 'the log says that slices of a known operator are soft'
exits 0 'ct-sr adds the network to soft slices that it trusts' ct-sr -f --trust o/w/mean-2-i25/lr.nii trusted.nii
has err 'then the prior' 'with --trust the prior adds to slices of a known operator'
awk "BEGIN {exit !($(psnr known.nii) > $(psnr trusted.nii))}"; ok $? 'soft slices of a known operator are more accurate without the network'
exits 2 'ct-sr refuses --trust beside --sigma' ct-sr --trust --sigma 1 "$bare" no.nii
# blind.py: its table, and what it refuses
ct-convert -q -f o/v/hr.nii hr.mha && ! python3 "$py" bare hr.mha x.nii 2>err && [ -s err ]
ok $? 'blind.py refuses a scan that is not NIfTI of float32 or int16'
printf 'scan,case,run,psnr,ssim-r2,structures-false,deep-smooth-rmse-hu,banding-rms-hu\na,P1-4,cubic,30,.8,1,5,.1\na,P1-4,known,34,.9,1,4,.2\na,P1-4,blind,33.5,.89,2,6,1\nb,P1-4,cubic,31,.8,3,,\nb,P1-4,known,32,.9,1,,\nb,P1-4,blind,32.1,.9,1,,\n' >t.csv
python3 "$py" table t.csv >t.txt; ok $? 'blind.py table accepts a CSV of measurements'
grep -qE '^a +P1-4 +30.00 +34.00 +33.50 +0.8000 0.9000 0.8900 +0.50 +1 +1 +2 +5.00 +4.00 +6.00 +0.10 +0.20 +1.00$' t.txt
ok $? 'the table of blind.py has one line for each scan and case'
grep -q '^2 cases: blind loses 0.20 dB in the mean, 0.50 at worst; gains 2.30 dB over cubic in the mean, 1.10 at least$' t.txt
ok $? 'below the table stand the losses and gains of blind in dB'
grep -q '^more false structures than with the operator known: 1; a larger error inside soft tissue than cubic: 1; more banding than cubic: 1$' t.txt
ok $? 'below the table stand the cases where blind does harm'
sed 1q t.csv >none.csv
! python3 "$py" table none.csv 2>err && grep -q 'none.csv: no results' err
ok $? 'a CSV without results is refused, with its name'
done_testing
