#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# examples/, and what the documents tell to run.
. "$srcdir/tests/tap.sh"

# examples/cohort.mk: a folder of scans, and the table of what came out.
mkdir scans truth
for n in a b; do
	ct-phantom -q -s 3 --size 24x24x48 --spacing 3 ellipsoids truth/$n.nii
	ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean truth/$n.nii scans/$n.nii
done
gzip scans/b.nii && mv scans/b.nii.gz 'scans/b $c.nii.gz' && rm truth/b.nii # a name with a blank and more
ct-phantom -q --size 24x24x12 marks c.nii && if with_dicom; then ct-convert -q c.nii scans/c/; else cp c.nii scans; fi
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

mkdir 'one here' 'truths here' && cp scans/a.nii 'one here/d e.nii' && cp truth/a.nii 'truths here/d e.nii'
exits 0 'cohort.mk accepts names with blanks throughout' run SCANS='one here' TRUTH='truths here' OUT='out here'
has 'out here/cohort.csv' "^\"d e\",24x24x48,1x1x4,[^,]*,[^,]*,$p,[0-9]" 'a scan with a blank in its name is compared with its truth'
cp one/a.nii kept.nii && gzip -c one/a.nii >one/b.nii.gz && cp one/b.nii.gz kept.nii.gz
exits 2 'cohort.mk refuses to write into the folder of the scans' run SCANS=one OUT=one
has err 'OUT=one holds files that are not of cohort.mk' 'cohort.mk names the folder that holds files of others'
cmp -s one/a.nii kept.nii && cmp -s one/b.nii.gz kept.nii.gz; ok $? 'cohort.mk leaves the scans as they were'
rm one/b.nii.gz
exits 2 'cohort.mk refuses a folder without a scan' run SCANS=nowhere OUT=none
has err '^nowhere: no scan: SCANS is a folder of .nii, .nii.gz or folders of DICOM' 'cohort.mk names the folder without a scan'

exits 2 'cohort.mk refuses a folder of truths that does not exist' run SCANS=one TRUTH=nowhere OUT=none
has err '^nowhere: no folder: TRUTH' 'cohort.mk names the folder of truths that does not exist'
mkdir alike && cp scans/a.nii alike && gzip -c scans/a.nii >alike/a.nii.gz
exits 2 'cohort.mk refuses two scans of one name' run SCANS=alike OUT=none
has err '^alike: two scans are called a: give each another name' 'cohort.mk names the scans of one name'
tab=$(printf 'a\tb') && mkdir tabs && cp scans/a.nii "tabs/$tab.nii"
exits 2 'cohort.mk refuses a scan with a tab in its name' run SCANS=tabs OUT=none
has err "^tabs/$tab.nii: a scan with a tab or a line break in its name" 'cohort.mk names the scan with a tab in its name'
run SCANS=one TRUTH= OUT=late >out && run SCANS=one OUT=late >out
has late/cohort.csv "^\"a\",.*,$p,[0-9.]*,[0-9.]*,\$" 'a cohort without truths is compared once TRUTH names them'
ct-degrade -q -x 1 --sigma 0 --noise 9 truth/a.nii loud.nii && touch -d '1 hour ago' loud.nii && cp -p loud.nii truth/a.nii
exits 0 'cohort.mk runs again with another truth' run SCANS=one OUT=late
grep -q '^"a",24x24x48,' late/cohort.csv && ! grep -q "^\"a\",.*,$p," late/cohort.csv; ok $? 'a truth that was changed is compared anew, also by an older one'
mkdir day night && cp -p loud.nii night/a.nii && cp late/a.nii.gz first.nii.gz
run SCANS=night OUT=late >out; ! cmp -s late/a.nii.gz first.nii.gz; ok $? 'an older scan of the same name in another folder is refined anew'
cp c.nii day/a.nii && exits 0 'cohort.mk runs with a truth that does not fit' run SCANS=one OUT=odd TRUTH=day
has odd/cohort.csv '^"a",failed' 'a scan that cannot be compared with its truth is in the table as failed'
has odd/a.log '^ct-metrics: .* grids differ' 'the log says why a scan cannot be compared with its truth'
exits 0 'cohort.mk runs with OPTIONS that make no result' run SCANS=one OUT=dry OPTIONS='-x 1,1,4 --dry-run'
has dry/cohort.csv '^"a",failed' 'a scan of which ct-sr made no result is in the table as failed'
mkdir "it's" && cp one/a.nii "it's" && cp -r truths\ here "it's/truth" && cp "it's/truth/d e.nii" "it's/truth/a.nii"
(cd "it's" && ln -sf ../time time && run SCANS=. OUT=cohort && run SCANS=. OUT=cohort) >out 2>err
ok $? 'the folder of the scans may hold those of the truths and results'
[ "$(cut -d, -f1 "it's/cohort/cohort.csv" | tr '\n' ' ')" = 'scan "a" mean deviation ' ]; ok $? 'the folders of truths and results are no scans'
exits 0 'cohort.mk accepts a folder with a quote in its name' run SCANS="it's" TRUTH="it's/truth" OUT="it's/cohort"
mkdir pair && cp one/a.nii pair/a.nii && cp one/a.nii pair/a.std.nii
exits 2 'a scan whose name a predicted error takes is refused' run SCANS=pair OUT=none CONFIDENCE=yes
if with_dicom; then
	mkdir -p both/s && ct-convert -q scans/a.nii a/ && cp scans/c/* both/s && for f in a/*; do cp "$f" "both/s/a-${f##*/}"; done
	exits 0 'cohort.mk runs with a folder of two series' run SCANS=both OUT=two
	has err '^both/s: ct-sr: .*--series' 'the reason that cohort.mk prints is the error, not a line of a list below it'
	mkdir in && cp -r scans/c in/c && run SCANS=in OUT=slices OPTIONS='-x 1,1,4 -Q draft' >out
	touch -d '1 hour ago' in/c in/c/* slices/* && touch "$(find in/c -name '*.dcm' | head -n 1)" && touch stamp
	touch -d '1 hour ago' in/c && run SCANS=in OUT=slices OPTIONS='-x 1,1,4 -Q draft' >out
	[ slices/c.nii.gz -nt in/c ] && ! [ stamp -nt slices/c.nii.gz ]; ok $? 'a slice of a series that was changed makes the result anew'
else
	skip 'a slice of a series that was changed makes the result anew' 'built without vtk-dicom'
fi

# OUT is a folder of one makefile, which writes over no file of others.
part folders
mkdir mine && echo mine >mine/table && mkdir empty && : >file
for m in "$srcdir"/examples/*.mk; do
	[ "${m##*/}" != scan.mk ] || continue
	exits 2 "a folder with files of others is refused by ${m##*/}" env MAKEFLAGS= make -s -f "$m" OUT=mine HTC=.
	has err "OUT=mine holds files that are not of ${m##*/}" "the folder of others is named by ${m##*/}"
	MAKEFLAGS= make -n -f "$m" OUT=new >/dev/null 2>&1
	! [ -e new ]; ok $? "${m##*/} makes no folder on make -n"
done
[ "$(ls -A mine)" = table ] && [ "$(cat mine/table)" = mine ]; ok $? 'a refused folder keeps its files as they were'
printf 'all:\n\t@echo ran\ninclude %s/examples/scan.mk\n' "$srcdir" >a.mk && cp a.mk b.mk
made() { MAKEFLAGS= make -s -f "$@"; }
exits 0 'an empty folder becomes that of the makefile' made a.mk OUT=empty
exits 0 'a makefile accepts the folder that it made' made a.mk OUT=empty
exits 2 'the folder of another makefile is refused' made b.mk OUT=empty
exits 0 'a new folder of the makefile may have blanks and quotes' made a.mk QUOTED=yes OUT="it's new/one"
[ "$(cat "it's new/one/made-by")" = a.mk ]; ok $? 'made-by names the makefile that a folder is of'
exits 2 'two VOLUMES of one name are refused' made a.mk OUT=new VOLUMES='one/a.nii two/a.nii.gz'
has err 'VOLUMES=one/a.nii two/a.nii.gz has two files of one name' 'the error of VOLUMES of one name lists them'
exits 2 'an OUT that is a file is refused' made a.mk OUT=file
exits 2 'an OUT without a name is refused' made a.mk OUT=
exits 2 'an OUT with a blank is refused' made a.mk OUT='my table'
has err 'OUT=my table is a name that make does not take' 'the error of an OUT with a blank says that make does not take it'

# What is in OUT follows from VOLUMES and settings.
ct-phantom -q --size 16x16x16 --spacing 3 ellipsoids v.nii && cp v.nii 'v(1).nii' && mkdir dcm || exit 99
exits 2 'no VOLUMES at all are refused' made "$srcdir/examples/accuracy.mk" OUT=acc
has err 'VOLUMES=: name scans' 'the error of no VOLUMES says what to name'
exits 2 'a volume that is not there is refused' made "$srcdir/examples/accuracy.mk" OUT=acc VOLUMES='v.nii no.nii'
has err ': no.nii: no file or folder of this name' 'the error names the volume that is not there'
exits 2 'a volume with a bracket in its name is refused' made "$srcdir/examples/accuracy.mk" OUT=acc VOLUMES='v(1).nii'
has err ': v(1).nii is a name that make does not take' 'the error names the volume with a bracket'
printf 'all:\n\t@echo $(NAMES)\nVOLUMES =\ninclude %s/examples/scan.mk\n' "$srcdir" >names.mk
exits 0 'a volume may be a folder with a slash behind it' made names.mk OUT=names VOLUMES='dcm/ v.nii'
has out '^dcm v$' 'a folder with a slash behind it has its name'
exits 0 'a cube is cut of a volume' made names.mk OUT=cut CUBE=8 VOLUMES=v.nii cut/v/hr.nii
touch -r cut/v/hr.nii stamp && made names.mk OUT=cut CUBE=8 VOLUMES=v.nii cut/v/hr.nii && ! [ cut/v/hr.nii -nt stamp ]
ok $? 'a cube of the same volume is not cut again'
ct-degrade -q -x 1 --noise 9 v.nii dcm/v.nii && touch -d '1 day ago' dcm/v.nii && cp cut/v/hr.nii first.nii
exits 0 'a cube is cut of a volume of the same name' made names.mk OUT=cut CUBE=8 VOLUMES=dcm/v.nii cut/v/hr.nii
! cmp -s cut/v/hr.nii first.nii; ok $? 'an older volume of the same name is not taken for the one before it'
rm dcm/v.nii
acc() { made "$srcdir/examples/accuracy.mk" ${time:+TIME=../time} VOLUMES=v.nii CUBE=16 METHODS='cubic linear' PROTOCOLS=P1 FACTORS=4 OUT=acc "$@"; }
broken() { (PATH=$PWD/bin:$PATH; acc); }
mkdir bin && printf '#!/bin/sh\nexit 5\n' >bin/ct-metrics && chmod +x bin/ct-metrics
exits 2 'a step of a pipe that fails ends a makefile' broken
[ -e acc/v/P1x4/lr.nii ] && [ ! -e acc/v/P1x4/cubic.row ]; ok $? 'a step of a pipe that fails leaves no row of the table'
exits 0 'the same makefile goes on once the step works' acc
exits 0 'gains are told of one method alone' acc OUT=acc1 METHODS=linear; has out 'v  *P1  *linear .* -[0-9.]* ' 'the gain of linear is one over cubic'
exits 2 'other settings in the same folder are refused' acc CUBE=8
has err 'OUT=acc was made with ct-sr .* CUBE=16 .*, not ct-sr .* CUBE=8 ' 'the error of other settings names both'
exits 2 'other values of HU that are kept are refused in the same folder' acc CLIP=-500:500
has err ', not ct-sr .* CLIP=-500:500:' 'the error of other values of HU that are kept names them'
exits 2 'measured.mk without the folder of the challenge is refused' made "$srcdir/examples/measured.mk" OUT=meas
has err 'HTC=FOLDER: where are' 'the error of measured.mk names what it needs'
[ ! -e meas ]; ok $? 'measured.mk that is refused leaves nothing'
exits 0 'asis.mk makes rows of two factors' made "$srcdir/examples/asis.mk" VOLUMES=v.nii CUBE=8 FACTORS='2 3'
exits 0 'asis.mk makes rows of one factor' made "$srcdir/examples/asis.mk" VOLUMES=v.nii CUBE=8 FACTORS=2
has out '^1 rows' 'a table of fewer rows is made of these alone'
for s in leave-one-out.sh cranium.sh; do
	exits 1 "a folder with files of others is refused by $s" sh "$srcdir/examples/$s" mine mine
	has err "$s: .*mine holds files of others" "the folder of others is named by $s"
done
[ "$(ls -A mine)" = table ]; ok $? 'a folder that a script refused keeps its files as they were'
mkdir -p void && exits 1 'leave-one-out.sh refuses a folder without a CT' sh "$srcdir/examples/leave-one-out.sh" void loo
has err 'void: no volume in HU' 'leave-one-out.sh names the folder without a CT'
exits 1 'leave-one-out.sh refuses a file that is not of its folder' sh "$srcdir/examples/leave-one-out.sh" void loo "$PWD/v.nii"
has err "leave-one-out.sh: $PWD/v.nii: is no file of void" 'leave-one-out.sh names the file that is not of its folder'

# The Snakefile, on this machine.
if command -v snakemake >/dev/null; then
	mkdir snake && ct-phantom -q --size 16x16x16 --spacing 3 ellipsoids 'snake/a b.nii' || exit 99
	snake() { HOME=$PWD snakemake -s "$srcdir/examples/cluster/Snakefile" --profile "$srcdir/examples/cluster/local" --config scans=snake "$@"; }
	exits 0 'the Snakefile refines a folder of scans' snake out=s options='-Q draft -x 2'
	exits 0 'the Snakefile runs with other options' snake out=s options='-Q draft -x 1,1,2'
	ct-info 's/a b.nii.gz' | grep -q '^size  *16 16 32'; ok $? 'other options of the Snakefile make the results anew'
	mkdir theirs && echo mine >'theirs/a b.nii.gz' && touch -d '1 hour ago' 'theirs/a b.nii.gz'
	exits 1 'a folder with files of others is refused by the Snakefile' snake out=theirs
	has err 'theirs holds files that are not of this Snakefile' 'the folder of others is named by the Snakefile'
	[ "$(cat theirs/*)" = mine ]; ok $? 'the Snakefile leaves the file of others as it was'
	exits 1 'the Snakefile refuses a folder without a scan' snake scans=dcm out=s2
	snake out=snake/fine options='-Q draft -x 2' >out 2>&1; exits 0 'the Snakefile goes on in a folder among the scans' snake out=snake/fine options='-Q draft -x 2'
	has err 'Nothing to be done' 'the Snakefile takes its own results for no scan'
	cp 'snake/a b.nii' 'snake/a b.std.nii'
	exits 1 'the Snakefile refuses a scan of the name of an error map' snake out=s2 confidence=yes; has err 'two scans of one name' 'the name of an error map is an error of the Snakefile'
	cp 'snake/a b.nii' 'snake/a{b}.nii'; rm 'snake/a b.std.nii'
	exits 1 'the Snakefile refuses a name with braces' snake out=s2; has err 'snake/a{b}.nii: a name with braces' 'the name with braces is told by the Snakefile'
else
	skip 'the Snakefile refines a folder of scans' 'no snakemake'
fi

# The pipeline of README.md and of ct-pipeline(7) is what ct-sr --paper runs, and is run here as it stands
# there, on a small phantom with fewer views, Gaussians and iterations.
part pipeline
# The lines from ct-convert to ct-compose of a text, one command a line, nothing else.
commands() {
	sed -n '/^ *ct-convert scan/,/^ *ct-compose/p' "$1" | sed 's/ *#.*//; s/\\e$/\\/' |
		sed -e ':a' -e '/\\$/N; s/ *\\\n */ /; ta' | sed 's/^ *//; /^$/d'
}
commands "$srcdir/README.md" >readme
commands "$srcdir/man/ct-pipeline.7" >page
[ "$(wc -l <readme)" -eq 7 ]; ok $? 'README has a pipeline'
cmp -s readme page; ok $? 'and ct-pipeline(7) the same'
mkdir scan
ct-sr --dry-run --paper --keep . scan/ hr.nii | sed 's,\./,,g; s, --prior=[^ ]*,,' >runs
cmp -s readme runs; ok $? 'which is what ct-sr runs'
diff readme runs | sed 's/^/# /'

ct-phantom -q -w -512:3071 ellipsoids --size 32x32x32 --spacing 4 truth.nii && ct-degrade -q --clip -512:3071 -x 4 truth.nii scan.nii
ok $? 'a scan to refine is made'
few='s/--views=[0-9]*/--views=16/; s/--iterations=[0-9]*/--iterations=200/; s/--gaussians=[0-9]*/--gaussians=4000/'
sed "s,scan/,scan.nii,; $few" readme >script
sh -e script >/dev/null 2>err; ok $? 'the script of ct-pipeline(7) runs as it stands'
sed 's/^/# /' err
ct-sr -q --paper --expert views=16,iterations=200,gaussians=4000 scan.nii sr.nii; ok $? 'ct-sr --paper runs on the same scan'
voxels() { ct-convert -q --type f32 "$1" - | tail -c 131072; }
voxels hr.nii >a; voxels sr.nii >b
[ "$(wc -c <a)" -eq 131072 ] && cmp -s a b; ok $? 'to the same voxels'
ct-upsample -q -m cubic scan.nii cubic.nii
db() { ct-metrics "$@" | awk '/^psnr/ {print $2}'; }
awk "BEGIN {exit !($(db truth.nii hr.nii) > $(db truth.nii cubic.nii) - 1.5)}"
ok $? "at most 1.5 dB below cubic, of few views: $(db truth.nii hr.nii), $(db truth.nii cubic.nii)"

# Scans that say nothing of how they were made, by small and other factors: what ct-sr makes stays in their range.
part asis
command -v python3 >/dev/null || { skip 'scans as they come' 'python3 is not here'; done_testing; }
ct-phantom -q --size 48x48x48 --spacing 1.5 --window=-1024:3071 ellipsoids made.nii || exit 99
ct-degrade -q -x 1 --noise 12 made.nii loud.nii
for v in made loud; do python3 "$srcdir/examples/blind.py" bare $v.nii $v-bare.nii; done
asis() { make -s -f "$srcdir/examples/asis.mk" CUBE=40 RESULT=56 OUT=o "$@" >table; }
wrong() { grep 'wrong$' table | sed 's/^/# /'; }
# every factor: the result stays in the range of the scan
asis VOLUMES=made-bare.nii FACTORS='1.01 1.2 1.25 1.5 2 3 1,1,1.5 1.1,1.2,3 1,1,3'
ok $? "a draft of a noise-free scan stays in its range at each factor: $(tail -n 1 table)"; wrong
asis VOLUMES=loud-bare.nii FACTORS='1.2 1.3 2'
ok $? "a draft of a noisy scan stays in its range at each factor: $(tail -n 1 table)"
wrong
asis VOLUMES=made-bare.nii OUT=o2 CUBE=32 QUALITY='fast balanced' FACTORS='1.3 2'
ok $? "fast and balanced results stay in the range of the scan: $(tail -n 1 table)"
wrong
[ "$(grep -c '^made' table)" -eq 4 ]; ok $? 'the table has one row for each factor and preset'
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
has err '; .*tv, .*iterations' 'with --sigma a factor of 1.1 is inverted, not interpolated'
ct-degrade -q -x 1.2 --protocol P1 made.nii lr.nii
exits 0 'ct-sr takes a factor of 1.2 that ct-degrade recorded in the scan' ct-sr -f -Q draft -x 1.2 lr.nii file.nii
has err '; .*tv, .*iterations' 'with an operator recorded in the scan a factor of 1.2 is inverted'
exits 0 'small and large factors may stand in one -x' ct-sr -Q draft -x 1.1,1.1,3 made-bare.nii mixed.nii
grep -q 'wide (2.35 standard deviations) along z, .*along x,y only interpolated' err
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
grep -q '"row">Estimated</th><td>profile [^<]*sure[^<]*[^; ]</td>' page.html && ! grep -q '<td>[^<]*left the range' page.html
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

# examples/blind.mk: the same voxels without metadata, and what not knowing the operator costs.
part blind
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
exits 0 'blind.mk makes single scans averaged over cells' make -s -f "$srcdir/examples/blind.mk" CUBE=48 OUT=m VOLUMES=v.nii CASES='mean-2 meann-2' m/v/mean-2/lr.nii m/v/meann-2/lr.nii
! ct-info m/v/mean-2/lr.nii | grep -q '^  noise  *15$'; ok $? 'case mean-2 adds no noise to the scan'
ct-info m/v/meann-2/lr.nii | grep -q '^  noise  *15$'; ok $? 'case meann-2 adds noise of 15 HU'
ct-info o/v/g40n-4/bare.nii >info
! grep -qE '^  (factor|sigma|decimate|noise|history)' info
ok $? 'the bare copy records neither factor nor blur, noise or history'
ct-metrics --ssim none o/v/g40n-4/lr.nii o/v/g40n-4/bare.nii | awk '$1 == "max-hu" {exit !($2 > 0 && $2 <= .5)}'
ok $? 'the bare copy has the voxels of the scan, rounded to whole HU'
# scans whose slices were interpolated before: softer along z by themselves
ct-phantom -q --size 60x60x60 --spacing 1.5 --window=-512:3071 ellipsoids w.nii || exit 99
exits 0 'blind.mk makes scans that were interpolated along z' make -s -f "$srcdir/examples/blind.mk" VOLUMES=w.nii CUBE=60 CASES='mean-2-i15 mean-2-i25' QUALITY=draft OUT=i
awk -F, 'NR == 1 {for (i = 1; i <= NF; i++) if ($i == "psnr") c = i} {p[$2 $3] = $c}
	END {exit !(p["mean-2-i15blind"] > p["mean-2-i15cubic"] && p["mean-2-i25blind"] > p["mean-2-i25cubic"])}' i/blind.csv
ok $? 'slices that were interpolated are refined better than by cubic interpolation'
# such slices are undone with care, unless the measured blur is trusted
bare=i/w/mean-2-i25/bare.nii
psnr() { ct-metrics --csv --ssim none i/w/hr-i25.nii "$1" | tail -n 1 | cut -d, -f5; }
exits 0 'ct-sr refines slices that were interpolated' ct-sr -f -x 1,1,2 "$bare" careful.nii
has err '^ct-sr: slices may be soft by themselves: less blur is undone, without the network; --trust does not$' 'the log says that soft slices are undone with care'
exits 0 'ct-sr refines soft slices as measured' ct-sr -f --trust -Q draft -x 1,1,2 "$bare" trusted.nii
! grep -q 'soft by themselves' err; ok $? 'with --trust the log says nothing of care'
awk "BEGIN {exit !($(psnr careful.nii) > $(psnr trusted.nii) + .1)}"; ok $? 'care is more accurate than trust there'
exits 0 'ct-sr refines soft slices whose operator is known' ct-sr -f i/w/mean-2-i25/lr.nii known.nii
has err '^ct-sr: slices are softer than they were made: undone without the network; --trust does not$' 'the log says that slices of a known operator are soft'
exits 0 'ct-sr adds the network to soft slices that it trusts' ct-sr -f --trust i/w/mean-2-i25/lr.nii trusted.nii
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

# examples/pair.mk: thick and thin slices of one scan, the thin ones as the truth.
part pair
command -v python3 >/dev/null || { skip 'pair.mk' 'python3 is not here'; done_testing; }
pair() { MAKEFLAGS= make -s -f "$srcdir/examples/pair.mk" OPTIONS='-Q draft' "$@"; }
ct-phantom -q -s 3 --size 48x44x60 --spacing 1.5 ellipsoids clean.nii && ct-degrade -q -x 1 --sigma 0 --noise 8 clean.nii thin.nii &&
	ct-degrade -q -x 1,1,4 --sigma 0,0,1.6 --decimate point clean.nii said.nii && python3 "$srcdir/examples/blind.py" bare said.nii thick.nii || exit 99
cp thick.nii kept.nii
exits 2 'pair.mk refuses a folder that holds files of others' pair THICK=thick.nii THIN=thin.nii OUT=.
has err 'OUT=. holds files that are not of pair.mk' 'pair.mk names the folder that holds files of others'
cmp -s thick.nii kept.nii; ok $? 'pair.mk leaves a scan in the folder of its results as it was'
exits 0 'pair.mk judges thick and thin slices as NIfTI' pair THICK=thick.nii THIN=thin.nii OUT=o
cmp -s out o/pair.md && grep -q '<html' o/pair.html; ok $? 'pair.mk leaves the table that it prints and a page of ct-sr'
cut_() { awk -F' *[|] *' -v row="$1" -v at="$2" 'index($2, row) == 1 {print $at; exit}' "${3:-o/pair.md}"; }
near() { awk "BEGIN {d = ($1) - ($2); exit !(d <= $3 && -d <= $3)}"; ok $? "$4 ($1, $2)"; } # near A B TOLERANCE NAME
psnr_of() { ct-metrics -w -1024:3071 thin.nii - | awk '$1 == "psnr" {print $2}'; }
near "$(cut_ 'PSNR, dB' 3)" "$(ct-upsample -q -m cubic -x 1,1,4 thick.nii - | psnr_of)" .01 'the PSNR of cubic interpolation is that of ct-metrics on the grid of THIN'
near "$(cut_ 'PSNR, dB' 4)" "$(ct-sr -q -Q draft -x 1,1,4 thick.nii - | psnr_of)" .05 'the PSNR of ct-sr is that of a run by hand'
ct-profile -q thick.nii thin.nii p.txt
near "$(cut_ 'PSNR, dB' 5)" "$(ct-sr -q -Q draft -x 1,1,4 --profile=p.txt thick.nii - | psnr_of)" .05 'the PSNR of the measured profile is that of ct-profile and ct-sr'
awk "BEGIN {exit !($(cut_ 'PSNR, dB' 5) > $(cut_ 'PSNR, dB' 4) && $(cut_ 'PSNR, dB' 4) > $(cut_ 'PSNR, dB' 3) + 1)}"
ok $? 'ct-sr gains over cubic interpolation, and more with the measured profile'
if python_with nibabel,scipy.ndimage; then
	"$PY" - o >log 2>&1 <<'PY'; ok $? 'averaged PSNR, errors and predicted errors of pair.mk are those of NumPy and SciPy'
import re, nibabel as nib, numpy as np
from scipy.ndimage import gaussian_filter
load = lambda f: nib.load(f).get_fdata().astype(float)
thin = load('o/thin.nii')
rows = {}
for line in open('o/pair.md'):
    cells = [c.strip() for c in line.strip().strip('|').split('|')]
    rows[re.sub(r' \(.*', '', cells[0])] = (line, cells[1:])
def near(name, got, want, tolerance):
    print(name, got, want)
    assert abs(float(got) - want) <= tolerance, name
clip = lambda v: np.clip(v, -1024, 3071)
noise = float(re.search(r'\(([0-9.]+) HU', rows['error less noise of the thin slices'][0]).group(1))
near('noise', noise, 8, .5)
for column, run in enumerate(('cubic', 'sr', 'profile')):
    v = load('o/%s-on.nii' % run)
    for sigma, row in (1, 'PSNR, averaged in plane, sigma 1 pixel, dB'), (2, 'PSNR, averaged in plane, sigma 2 pixels, dB'):
        a, b = (clip(gaussian_filter(x, (sigma, sigma, 0), mode='reflect', truncate=6)) for x in (thin, v))
        near(row, rows[row][1][column], 20*np.log10(4095/np.sqrt(((a - b)**2).mean())), .03)
    rms = np.sqrt(((v - thin)**2).mean())
    near('rms', rows['error'][1][column], rms, .06)
    near('less noise', rows['error less noise of the thin slices'][1][column], np.sqrt(rms**2 - noise**2), .1)
std, error = load('o/std-on.nii'), load('o/sr-on.nii') - thin
line = rows['all: %.1f' % np.sqrt((std**2).mean())][1]
near('measured', line[0], np.sqrt((error**2).mean()), .06)
tenth = np.argsort(std, axis=None)[-std.size//10:]
last, line = list(rows.items())[[k[:3] for k in rows].index('all') - 1]
near('last tenth, predicted', last, np.sqrt((std.flat[tenth]**2).mean()), 1)
near('last tenth, measured', line[1][0], np.sqrt((error.flat[tenth]**2).mean()), 1)
near('last tenth, less noise', line[1][1], np.sqrt((error.flat[tenth]**2).mean() - noise**2), 1)
PY
	sed 's/^/# /' log
else
	skip 'averaged PSNR, errors and predicted errors of pair.mk' 'no nibabel, SciPy'
fi
ct-metrics --harm -x 1,1,4 --surface=250,-500 o/thin.nii o/sr-on.nii >figures
figure() { awk -v n="$1" '$1 == n {print $2}' figures; }
near "$(cut_ 'rise of edges' 4)" "$(figure edge-rise-test-mm)" .006 'the rise of edges of pair.mk is that of ct-metrics'
near "$(cut_ 'MTF 50' 4)" "$(figure mtf50-test)" .0006 'the MTF of pair.mk is that of ct-metrics'
near "$(cut_ 'false str' 4)" "$(figure structures-false)" 0 'false structures of pair.mk are those of ct-metrics'
near "$(cut_ 'missed str' 4)" "$(figure structures-missed)" 0 'missed structures of pair.mk are those of ct-metrics'
near "$(cut_ 'surface at -500 HU, mean' 4)" "$(figure surface-mean-mm-2)" .0006 'the mean error of a surface of pair.mk is that of ct-metrics'
near "$(cut_ 'surface at 250 HU, 95' 4)" "$(figure surface-p95-mm-1)" .0006 'the 95th percentile of a surface of pair.mk is that of ct-metrics'
newer() { find o -type f -newer stamp | sort | tr '\n' ' '; }
touch stamp; exits 0 'pair.mk runs a second time' pair THICK=thick.nii THIN=thin.nii OUT=o
[ "$(newer)" = 'o/pair.md ' ]; ok $? 'a second run of pair.mk writes the table alone'
[ "$(pair THICK=thick.nii THIN=thin.nii OUT=o PROFILE=no | sed -n 1p)" = '| | cubic | `ct-sr` |' ]; ok $? 'PROFILE=no leaves the column of the profile out'
exits 0 'pair.mk accepts other SURFACES' pair THICK=thick.nii THIN=thin.nii OUT=o SURFACES=0
has out '^| surface at 0 HU, mean, mm |' 'other SURFACES are in the table'
! newer | grep -q fine.nii; ok $? 'other SURFACES do not refine the scan again'
exits 0 'pair.mk accepts a THICK that says how it was made' pair THICK=said.nii THIN=thin.nii OUT=o
has out '^pair.mk: THICK says how it was made: no profile was measured$' 'the table says why no profile was measured'
[ "$(sed -n 1p out)" = '| | cubic | `ct-sr` |' ]; ok $? 'the table of another pair has no column of the pair before it'
ct-convert -q --crop 4:40,3:44,5:50 thin.nii part.nii
exits 0 'pair.mk crops to what both cover' pair THICK=said.nii THIN=part.nii OUT=part PROFILE=no
ct-convert -q --crop 4:40,3:44,8:48 thin.nii box.nii
ct-info box.nii | grep -E '^(size|extent|centre)' >want; ct-info part/thin.nii | grep -E '^(size|extent|centre)' | cmp -s - want
ok $? 'of both there are left the whole thick slices that THIN covers'
exits 2 'pair.mk refuses a THIN that is nowhere' pair THICK=thick.nii THIN=nowhere OUT=no; has err "^pair.mk: 'nowhere': no file or folder" 'pair.mk names the THIN that is nowhere'
exits 2 'pair.mk refuses thick and thin the wrong way round' pair THICK=thin.nii THIN=thick.nii OUT=no; has err '^pair.mk: slices of THICK are 1.5 mm apart, of THIN 6 mm' 'pair.mk names the spacing of slices that are the wrong way round'
ct-convert -q --iso 1.7 thin.nii iso.nii
exits 2 'pair.mk refuses other voxels in plane' pair THICK=thick.nii THIN=iso.nii OUT=no; has err '^pair.mk: voxels in plane differ: 1.5 and 1.7 mm' 'pair.mk names the voxels in plane that differ'
ct-convert -q --crop 0:48,0:44,0:14 thin.nii few.nii
exits 2 'pair.mk refuses a THIN that covers too few slices' pair THICK=thick.nii THIN=few.nii OUT=no; has err '^pair.mk: THIN covers 3 whole slices of THICK' 'pair.mk says how many slices THIN covers'
if with_dicom; then
	mkdir 'a scan' && ct-convert -q thin.nii 'a scan/thin/' && ct-convert -q --template 'a scan/thin/' thick.nii 'a scan/thick/' &&
		ct-phantom -q -s 9 --size 48x44x60 --spacing 1.5 ellipsoids other.nii && ct-convert -q other.nii other/ || exit 99
	exits 0 'pair.mk judges two folders of DICOM' pair THICK='a scan/thick' THIN='a scan/thin' OUT=d
	pair THICK=thick.nii THIN=thin.nii OUT=o >/dev/null
	near "$(cut_ 'PSNR, dB' 3 d/pair.md)" "$(cut_ 'PSNR, dB' 3)" .05 'DICOM and NIfTI of a pair have the same PSNR of cubic interpolation'
	exits 2 'pair.mk refuses series of two frames of reference' pair THICK='a scan/thick' THIN=other OUT=no
	has err '^pair.mk: THICK and THIN are of two patients or frames of reference' 'pair.mk says that the frames of reference differ'
else
	skip 'pair.mk judges two folders of DICOM' 'built without vtk-dicom'
fi

# What documents tell to run, on phantoms and with few steps: the recipe of the shipped prior, and the tutorials.
part recipes
mkdir ct xray
ct-phantom -q --size 24x24x24 ellipsoids ct/a.nii.gz
ct-view -q -p axial -o xray/a.png ct/a.nii.gz || exit 99
readme=$srcdir/src/prior/README.md
# options FILE: what stands behind its name in README's command, on one line
options() { sed -n "/make-$1.sh .* $1.safetensors/,/^$/p" "$readme" | tr -d '\\\n' | sed "s/.*$1.safetensors//"; }
said=$(options prior | sed 's/--validate HELD_OUT//; s/,validate-every=250//; s/3200/1/; s/--patch 96/--patch 32/; s/batch=8/batch=1/')
echo "$said" | grep -q 'steps 1 '; ok $? "README has options:$said"
if pictures; then
	# shellcheck disable=SC2086
	exits 0 'they make a prior' sh "$srcdir/src/prior/make-prior.sh" ct xray work prior.safetensors $said --arch model_channels=32,channel_mult=1
	exits 0 'which can be read' ct-info prior.safetensors; has out 'scales=1,2' 'as it was made'
	[ "$(ls work | wc -l)" -eq 6 ]; ok $? 'the recipe of poses makes six files'
else
	skip 'the recipe of the shipped prior' 'no OpenImageIO'
fi
# shells that thick slices are learnt from, small
sed -n '/^\tct-phantom/,/shells\$i/p' "$srcdir/src/prior/make-slices.sh" | sed 's/224x224x224/24x24x24/' >shells.sh
mkdir -p work/shells
exits 0 'the recipe of slices makes plain shells' sh -ec 'i=1 work=work; . ./shells.sh'; [ -s work/shells/shells1.nii.gz ]; ok $? 'plain shells are a volume'
with_dicom || { skip 'the tutorials' 'built without vtk-dicom'; done_testing; }
# every command of the tutorials, and every picture in them is made by one
ln -s "$srcdir/examples" examples && mkdir truths
for n in a b; do ct-phantom -q -f --size 24x24x32 --spacing 2 ellipsoids truths/$n.nii.gz || exit 99; done
ct-degrade -q -x 1,1,5 truths/a.nii.gz thick.nii && ct-convert -q thick.nii scan/ && ct-phantom -q -w -512:3071 --size 32x32x32 --spacing 2 ellipsoids hr.nii &&
	ct-degrade -q -x 4 --clip=-512:3071 hr.nii lr.nii || exit 99
[ -x /usr/bin/time ] || { printf '#!/bin/sh\nout=$2; shift 4; "$@" && echo 1 1 >$out\n' >time; chmod +x time; export MAKEFLAGS=TIME=./time; }
for page in patient evaluate paper; do
	sed -n 's/^    //p' "$srcdir/doc/tutorial-$page.md" >commands
	while IFS= read -r line; do
		fast=$(echo "$line" | sed 's/--views=[0-9]*/--views=4/; s/--steps=50/--steps=2/; s/--iterations=5000/--iterations=20/; s/--gaussians=50000/--gaussians=50/; s/--lr=/--iterations=20 --gaussians=50 &/')
		sh -c "$fast" >out 2>err </dev/null; rc=$?
		[ $rc -eq 0 ]; ok $? "tutorial-$page.md: $(echo "$line" | cut -c1-100)"
		[ $rc -eq 0 ] || sed 's/^/# /' err
	done <commands
	grep -o '](tutorial-[a-z]*\.svg)' "$srcdir/doc/tutorial-$page.md" | sed 's/.*tutorial-//; s/.svg.*//' | while read -r name; do
		[ -s "$srcdir/doc/tutorial-$name.svg" ] && [ -n "$(find . -name "$name.svg")" ] || echo "$name"
	done >lost
	[ ! -s lost ]; ok $? "tutorial-$page.md: each picture is made by a command in it"
done

# examples/trade.mk and trade.py: what was measured, what is on the front, what is made again; paper.mk: its tables.
part trade
python_with matplotlib || { skip 'trade.py writes a table and a plot' 'no matplotlib'; done_testing; }
py=$srcdir/examples/trade.py
row() { printf '%s,P1,%s,%s,0,%s,%s,%s,%s,1,%s,%s\n' "$@"; }
{
	echo 'scan,case,run,cpu-s,seconds,peak-mib,psnr,ssim-r2,structures-false,structures-missed,deep-smooth-rmse-hu,edge-rise-test-mm'
	row a quick 1 10 30 .8 5 3 2; row b quick 3 30 32 .9 7 5 2
	row a worse 4 20 30 .85 6 4 2; row b worse 4 20 32 .85 6 4 2
	row a slow 9 20 33 .95 4 2 ''; row b slow 9 20 35 .95 4 2 ''
	row a same 2 20 30 .8 5 3 2; row b same 4 20 32 .9 7 5 2
} >t.csv
"$PY" "$py" t.csv t.svg >t.txt; ok $? 'trade.py writes a table and a plot'
[ "$(sed -n 1p t.txt)" = 'means of 2 scans' ]; ok $? 'the table of trade.py gives the number of scans'
grep -qE '^P1 +quick +2\.00 +30 +31\.000 +0\.8500 +6\.0 +1\.0 +4\.00 +2\.00 +\*$' t.txt
ok $? 'a row of trade.py has means over scans and the largest memory'
grep -qE '^P1 +worse .* 2\.00$' t.txt; ok $? 'a slower run that is no better is not on the front'
grep -qE '^P1 +slow .* - +\*$|^P1 +slow .* 2\.00 +- +\*$|^P1 +slow .*\*$' t.txt
ok $? 'a slower run that is better is on the front'
grep -qE '^P1 +same .* 2\.00$' t.txt; ok $? 'a slower run that is as good is not on the front'
grep -q '<svg' t.svg; ok $? 'the plot of trade.py is SVG'
"$PY" "$py" t.csv t2.svg >/dev/null; cmp -s t.svg t2.svg; ok $? 'trade.py draws the same bytes twice'
sed 's/,[^,]*$//' t.csv >few.csv; "$PY" "$py" few.csv t2.svg >/dev/null; ok $? 'trade.py reads a table of scans that are too small for their edges'
sed 1q t.csv >none.csv
! "$PY" "$py" none.csv x.svg 2>err && grep -q 'none.csv: no results' err
ok $? 'a CSV without results is refused with its name'

# trade.mk
ct-phantom -q --size 40x40x40 --spacing 1.5 --window=-512:3071 ellipsoids v.nii || exit 99
trade() { make -s -f "$srcdir/examples/trade.mk" PYTHON="$PY" VOLUMES=v.nii CUBE=32 CASES='P3n thick' RUNS="$1" OUT=o; }
exits 0 'trade.mk measures a scan with two cases and methods' trade 'cubic htv:iterations=5:tolerance=0'
[ "$(grep -c . o/trade.csv)" = 5 ] && [ "$(cut -d, -f1-3 o/trade.csv | tail -n +2 | tr '\n' ' ')" = 'v,P3n,cubic v,P3n,htv:iterations=5:tolerance=0 v,thick,cubic v,thick,htv:iterations=5:tolerance=0 ' ]
ok $? 'trade.csv has a line for each case and method'
ct-metrics --ssim none -w -1024:3071 o/v/hr.nii o/v/P3n/cubic.nii | awk '$1 == "psnr" {print $2}' >want
awk -F, 'NR == 1 {for (i = 1; i <= NF; i++) if ($i == "psnr") at = i} $2 == "P3n" && $3 == "cubic" {print $at}' o/trade.csv | cmp -s - want
ok $? 'trade.csv has the PSNR of ct-metrics'
ct-info o/v/P3n/lr.nii | grep -qE '^ *noise +15$' && ct-info o/v/thick/lr.nii | grep -qE '^ *factor +1,1,4$'
ok $? 'the cases of trade.mk are P3n with noise and thick slices'
ct-info o/v/P3n/htv_iterations-5_tolerance-0.nii | grep -q 'iterations'
ok $? 'trade.mk passes the options of a run to the method'
touch -r o/v/P3n/cubic.nii stamp
exits 0 'trade.mk runs again with one more method' trade 'cubic htv:iterations=5:tolerance=0 dc'
[ "$(grep -c . o/trade.csv)" = 7 ] && [ ! o/v/P3n/cubic.nii -nt stamp ]
ok $? 'a second run of trade.mk makes the new method alone'
exits 2 'an unknown method is refused by trade.mk' trade 'none'
mkdir bin && printf '#!/bin/sh\necho "$CT_THREADS $*" >>"%s/said"\nexec "%s" "$@"\n' "$PWD" "$(command -v ct-ddnm)" >bin/ct-ddnm && chmod +x bin/ct-ddnm
grid() { PATH=$PWD/bin:$PATH make -s -f "$srcdir/examples/trade.mk" PYTHON="$PY" VOLUMES=v.nii CUBE=32 CASES=P3 RUNS=cubic PROJECTIONS='3:2:50:4 2:1:60:3' THREADS="$1" OUT=g; }
exits 0 'trade.mk accepts settings of views, steps, Gaussians and iterations' grid ''
[ "$(cut -d, -f3 g/trade.csv | tail -n +2 | tr '\n' ' ')" = 'cubic paper:views=3:steps=2:gaussians=50:iterations=4 paper:views=2:steps=1:gaussians=60:iterations=3 ' ]
ok $? 'trade.csv has a line for each setting'
[ "$(sed 's/.*\(--steps=[0-9]*\).*/\1/' said | tr '\n' ' ')" = '--steps=2 --steps=1 ' ]
ok $? 'trade.mk passes the steps of each setting to ct-ddnm'
ct-info g/v/P3/paper_views-2_steps-1_gaussians-60_iterations-3.nii >info; grep -q ct-compose info && [ ! -e g/v/P3/paper_views-2_steps-1_gaussians-60_iterations-3.nii.work ]
ok $? 'each setting runs to its last step and leaves no working folder'
rm said; exits 0 'trade.mk accepts several numbers of threads' grid '1 2'
[ "$(grep -c . g/trade.csv)" = 7 ] && [ "$(cut -d' ' -f1 said | tr '\n' ' ')" = '1 2 1 2 ' ]
ok $? 'each setting is measured with each number of threads'

# paper.mk
paper() {
	make -s -f "$srcdir/examples/paper.mk" VOLUMES=v.nii CUBE=16 FACTORS=4 VIEWS=4 STEPS=2 ITERATIONS=4 GAUSSIANS=50 BUDGET=2 \
		NETWORK=1x8 BIRD=2 OUT=p
}
exits 0 'paper.mk makes the results of the published tables' paper
paper >tables
figures='[0-9.]+ +-?[01]\.[0-9]+ +[0-9.]+ +[1-9][0-9]*'
[ "$(grep -c '^table [123], 4x' tables)" = 3 ] && grep -qE "^paper +$figures +25\.42 +\.8957$" tables
ok $? 'paper.mk prints three tables beside the published figures'
grep -qE "^ctsr +$figures +- +-$" tables; ok $? 'the row of ctsr has no published figures'
for m in nerf cunerf arssr rdn omni bird naf sax-nerf; do
	grep -qE "^$m +$figures +[0-9.]+ +\.[0-9]+$" tables
	ok $? "the row of $m has published figures"
done
ct-metrics -w -512:3071 --ssim wang p/v/hr.nii p/v/4x/fdk.nii | awk '$1 == "psnr" {p = $2} /^ssim/ {printf "fdk %.2f %.4f\n", p, $2}' >want
awk '$1 == "fdk" {printf "fdk %.2f %.4f\n", $2, $3}' tables | cmp -s - want
ok $? 'the row of fdk has the figures of ct-metrics'

# stages.mk
stages() {
	make -s -f "$srcdir/examples/stages.mk" VOLUMES=v.nii CUBE=24 VIEWS=6 ITERATIONS=40 GAUSSIANS=200 WINDOW=-512:3071 OUT=s ROWS="$1"
}
all='cubic:none:none cubic:published:published cubic:truth:fdk cubic:truth:r2 auto:none:none auto:ddnm:gaussians auto:ddnm:voxels
	auto:truth:gaussians prior:none:none prior:ddnm:gaussians'
exits 0 'stages.mk makes a line for each stage' stages "$(echo $all)"
cp out lines
[ "$(grep -c '^v ' lines)" = 10 ]; ok $? 'stages.mk prints a line for each row of ROWS'
column() { awk -v b="$1" -v p="$2" -v f="$3" '$4 == b && $5 == p && $6 == f {print $'"$4"'}' lines; }
[ "$(column auto truth gaussians 7)" = inf ]; ok $? 'the projections of the truth have no error in stages.mk'
ct-metrics -w -512:3071 --ssim none s/v/hr.nii s/v/4x-P1/auto.nii | awk '$1 == "psnr" {printf "%.2f\n", $2}' >want
column auto none none 8 | cmp -s - want; ok $? 'the row of the inversion has the PSNR of ct-metrics'
awk "BEGIN {exit !($(column auto ddnm gaussians 8) > $(column auto none none 8) - .05)}"
ok $? "the default chain is not below the inversion: $(column auto none none 8), $(column auto ddnm gaussians 8)"
awk "BEGIN {exit !($(column prior ddnm gaussians 8) > $(column prior none none 8) - .05)}"
ok $? "nor below the prior of slices: $(column prior none none 8), $(column prior ddnm gaussians 8)"
# A prior that was trained again, in the file of the same name.
cp "$srcdir/src/prior/prior.safetensors" mine.safetensors && touch -d '1 minute ago' mine.safetensors
judged() {
	make -f "$srcdir/examples/stages.mk" VOLUMES=v.nii CUBE=16 VIEWS=2 WINDOW=-512:3071 DDNM='--steps=1 -p mine.safetensors' OUT=j ROWS=cubic:ddnm:none
}
exits 0 'stages.mk judges a prior in a file of ours' judged
judged | grep -q ct-ddnm; [ $? -eq 1 ]; ok $? 'stages.mk does not judge the same prior again'
touch -d '1 minute' mine.safetensors
judged | grep -q ct-ddnm; ok $? 'stages.mk judges a prior that was changed again'
done_testing
