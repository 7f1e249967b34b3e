#!/bin/sh
# examples/cohort.mk: a folder of scans, and the table of what came out.
. "$srcdir/tests/tap.sh"
mkdir scans truth
for n in a b; do
	ct-phantom -q -s 3 --size 24x24x48 --spacing 3 ellipsoids truth/$n.nii
	ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean truth/$n.nii scans/$n.nii
done
gzip scans/b.nii && rm truth/b.nii
ct-phantom -q --size 24x24x12 marks c.nii && ct-convert -q c.nii scans/c/
: >scans/bad.nii
[ -x /usr/bin/time ] || time=TIME=./time
printf '#!/bin/sh\nout=$2; shift 4; "$@" && echo 1 1 >$out\n' >time && chmod +x time
run() { make -s -f "$srcdir/examples/cohort.mk" TRUTH=truth OUT=fine OPTIONS='-x 1,1,4 -Q draft' THREADS=1 ${time:-} "$@"; }
exits 0 'a folder of scans' run
has err '^scans/bad.nii: ct-sr: ' 'one that is none does not hold up the others'
cat >want <<'EOF'
scan,size,factor,seconds,memory-mib,psnr-db,residual-rms-hu
"a",24x24x48,1x1x4,S,M,P,
"b",24x24x48,1x1x4,S,M,,R
"bad",failed,,,,,
EOF
sed 's/,1x1x4,[0-9.]*,[0-9]*,/,1x1x4,S,M,/; s/M,[0-9][0-9.]*,/M,P,/; s/M,,[0-9].*/M,,R/; /^"c"/d' fine/cohort.csv | cmp -s - want; ok $? 'a row each'
p=$(ct-metrics truth/a.nii fine/a.nii.gz | awk '$1 == "psnr" {print $2}')
has fine/cohort.csv "^\"a\",.*,$p,\$" 'with the PSNR against the truth'
awk -F, '$1 == "\"b\"" {near = $7 > 0 && $7 < .01} END {exit !near}' fine/cohort.csv; ok $? 'or how far it is from the scan'
has fine/cohort.csv '^"c",24x24x48,1x1x4,' 'DICOM too'
[ "$(grep -c '^|' fine/cohort.md)" = 6 ] && [ "$(awk -F'|' '{print NF}' fine/cohort.md | sort -u)" = 9 ]; ok $? 'and a table'
cp fine/a.nii.gz first.nii.gz; cp fine/b.row b.row
rm fine/a.nii.gz
exits 0 'again' run
cmp -s fine/a.nii.gz first.nii.gz; ok $? 'makes what is not there'
cmp -s fine/b.row b.row; ok $? 'and nothing else'
cp truth/a.nii scans/bad.nii
exits 0 'mended' run
! grep -q failed fine/cohort.csv; ok $? 'none has failed'
mkdir one && cp scans/a.nii one
exits 0 'with the predicted error, and a page' run SCANS=one OUT=page OPTIONS="-x 1,1,4 --prior $builddir/slices.safetensors" CONFIDENCE=yes REPORT=yes
[ "$(cd page && echo a.*)" = 'a.html a.log a.nii.gz a.row a.std.nii.gz' ]; ok $? 'a file each'
done_testing
