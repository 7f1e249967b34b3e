#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# examples/cohort.mk: a folder of scans, and the table of what came out.
. "$srcdir/tests/tap.sh"
mkdir scans truth
for n in a b; do
	ct-phantom -q -s 3 --size 24x24x48 --spacing 3 ellipsoids truth/$n.nii
	ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean truth/$n.nii scans/$n.nii
done
gzip scans/b.nii && mv scans/b.nii.gz 'scans/b $c.nii.gz' && rm truth/b.nii # a name with a blank and more
ct-phantom -q --size 24x24x12 marks c.nii && ct-convert -q c.nii scans/c/
: >scans/bad.nii
[ -x /usr/bin/time ] || time=TIME=./time
printf '#!/bin/sh\nout=$2; shift 4; "$@" && echo 1 1 >$out\n' >time && chmod +x time
run() { make -s -f "$srcdir/examples/cohort.mk" TRUTH=truth OUT=fine OPTIONS='-x 1,1,4 -Q draft' THREADS=1 ${time:-} "$@"; }
exits 0 'cohort.mk refines a folder of scans' run
has err '^scans/bad.nii: ct-sr: ' 'an unreadable scan is reported and does not stop the others'
sed 's/^# //' fine/cohort.csv | sed 's/^/# /'
cat >want <<'EOF'
scan,size,factor,seconds,memory-mib,cubic-psnr-db,psnr-db,ssim,residual-rms-hu
"a",24x24x48,1x1x4,S,M,C,P,I,
"b $c",24x24x48,1x1x4,S,M,,,,R
"bad",failed,,,,,,,
EOF
sed 's/,1x1x4,[0-9.]*,[0-9]*,/,1x1x4,S,M,/; s/M,[0-9][0-9.]*,[0-9][0-9.]*,[0-9.]*,/M,C,P,I,/; s/M,,,,[0-9].*/M,,,,R/; /^"c"/d; /^mean/d; /^deviation/d' fine/cohort.csv | cmp -s - want
ok $? 'cohort.csv has one row for each scan with its size, factor, time and memory'
p=$(ct-metrics truth/a.nii fine/a.nii.gz | awk '$1 == "psnr" {print $2}')
has fine/cohort.csv "^\"a\",.*,$p,[0-9.]*,\$" 'a scan with a truth has its PSNR in cohort.csv'
awk -F, '$1 == "\"b $c\"" {near = $9 > 0 && $9 < .01} END {exit !near}' fine/cohort.csv
ok $? 'a scan without a truth has its data consistency in cohort.csv'
has fine/cohort.csv '^"c",24x24x48,1x1x4,' 'cohort.csv has a row for a DICOM folder'
ct-upsample -q -m cubic scans/a.nii cubic.nii
p=$(ct-metrics truth/a.nii cubic.nii | awk '$1 == "psnr" {print $2}')
has fine/cohort.csv "^\"a\",.*,$p,[0-9.]*,[0-9.]*,\$" 'a scan with a truth has the PSNR of cubic interpolation in cohort.csv'
[ "$(grep -c '^|' fine/cohort.md)" = 8 ] && [ "$(awk -F'|' '{print NF}' fine/cohort.md | sort -u)" = 11 ]
ok $? 'cohort.md has a row of nine columns for each scan, the mean and the deviation'
awk -F, '/^"/ && $4 ~ /^[0-9]/ {n++; s += $4} $1 == "mean" {m = $4} END {exit !(n == 3 && s - 3 * m < .01 && 3 * m - s < .01)}' fine/cohort.csv
ok $? 'the mean of cohort.csv is that of its scans'
grep -q '<svg' fine/cohort.svg && [ "$(grep -c '<circle' fine/cohort.svg)" = 2 ]; ok $? 'cohort.svg has a point for cubic and one for the result'
cp fine/a.nii.gz first.nii.gz; cp "fine/b \$c.row" b.row
rm fine/a.nii.gz
exits 0 'cohort.mk runs again after a result was removed' run
cmp -s fine/a.nii.gz first.nii.gz; ok $? 'a second run makes the result that was removed, with the same bytes'
cmp -s "fine/b \$c.row" b.row; ok $? 'a second run leaves the other rows as they were'
cp truth/a.nii scans/bad.nii
exits 0 'cohort.mk runs again after a bad scan was mended' run
! grep -q failed fine/cohort.csv; ok $? 'a scan that was mended is no longer listed as failed'
exits 0 'cohort.mk runs with other OPTIONS' run OPTIONS='-x 1,1,2 --sigma 0'
has fine/cohort.csv '^"c",24x24x24,1x1x2,' 'other OPTIONS make another table'
cp fine/cohort.csv again.csv
exits 0 'cohort.mk runs again with the same OPTIONS' run OPTIONS='-x 1,1,2 --sigma 0'
cmp -s fine/cohort.csv again.csv; ok $? 'the same OPTIONS leave the table as it was'
mkdir one && cp scans/a.nii one
exits 0 'cohort.mk accepts CONFIDENCE=yes with REPORT=yes' run SCANS=one OUT=page OPTIONS="-x 1,1,4 --prior $builddir/slices.safetensors" CONFIDENCE=yes REPORT=yes
[ "$(cd page && echo a.*)" = 'a.html a.log a.nii.gz a.row a.std.nii.gz' ]
ok $? 'CONFIDENCE=yes and REPORT=yes give a map and a page for each scan'
done_testing
