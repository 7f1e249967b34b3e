#!/bin/sh
# DICOM out: what is written is what was there, in any orientation; it belongs to the patient and study of its
# template, or to nobody; dciodvfy finds no error; nothing half-written is left.
. "$srcdir/tests/tap.sh"
ct-phantom -q --size 7x6x5 --spacing 2,2.5,3 marks f.nii && ct-convert -q --type i16 f.nii v.nii
ct-convert v.nii first/ 2>err
if grep -q 'with-vtk' err; then skip 'DICOM out' 'built without vtk-dicom'; done_testing; fi
py() { PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-dicom-out.py" "$@"; }
python_with pydicom && "$PY" -c 'import nibabel' && oracle=1 || oracle=
clean() { # clean NAME FILE...: dciodvfy finds no error
	name_=$1; shift
	if ! command -v dciodvfy >/dev/null; then skip "$name_: dciodvfy" 'no dciodvfy'; return; fi
	# it wants these of all frames; PS3.3 C.8.15.2 only of those that are original: what is not known is not said
	for f; do dciodvfy "$f" 2>&1 | grep -i 'error\|abort\|not present in standard'; done |
		grep -v 'Type 1C Conditional Element=<\(BurnedInAnnotation\|LossyImageCompression\)> Module=<EnhancedCTImage>' >errors
	[ ! -s errors ]; ok $? "$name_: dciodvfy finds no error"; sed 's/^/# /' errors
	if command -v dcmdump >/dev/null; then
		for f; do dcmdump "$f" >/dev/null 2>>dump || echo "$f" >>dump; done
		[ ! -s dump ]; ok $? "$name_: dcmdump reads it"
	fi
}
voxels() { tail -c +"$(($(od -An -j108 -N4 -tf4 "$1" | cut -d. -f1) + 1))" "$1" | cksum; }

# every way that axes can run, the left-handed ones too: in a folder, and in one file
[ "$(ls first | tr '\n' ' ')" = 'ctsr0001.dcm ctsr0002.dcm ctsr0003.dcm ctsr0004.dcm ctsr0005.dcm ' ]; ok $? 'a file a slice'
ways=0 kind=1
for x in L R; do for y in A P; do for z in S I; do
	for axes in $x$y$z $x$z$y $y$x$z $y$z$x $z$x$y $z$y$x; do
		ct-convert -q --reorient $axes v.nii in-$axes.nii
		case $kind in 1) kind=0 d=$axes/ ;; *) kind=1 d=$axes.dcm ;; esac
		ct-convert -q in-$axes.nii $d; ct-convert -qf --reorient $axes $d back.nii
		for f in in-$axes.nii back.nii; do ct-info $f | sed -n 3,11p; voxels $f; done >seen
		[ "$(sort seen | uniq -c | awk '$1 % 2' | wc -l)" -eq 0 ] && ways=$((ways + 1)) || echo $d
		echo in-$axes.nii $d >>pairs
	done
done; done; done >wrong
[ $ways -eq 48 ]; ok $? "all 48 orientations come back, voxels and affine ($ways)"; sed 's/^/# /' wrong
clean 'without a template' first/* [LR]??/ctsr0002.dcm RSA.dcm LSA.dcm
ct-convert -q v.nii one.dcm; clean 'one file' one.dcm
ct-info first >info; has info '^fit  *yes$' 'ct-info finds a series that is fit'; has info '^gap-mm  *3 3 3$' 'with its spacing'
ct-info one.dcm >info; has info '^fit  *yes$' 'and in one file'
if [ "$oracle" ]; then
	py all pairs >wrong 2>&1
	[ ! -s wrong ]; ok $? 'pydicom reads the same voxels at the same places'; sed 's/^/# /' wrong
	py oblique; ok $? 'a volume at an angle is made'
	for o in o/ o.dcm; do
		exits 0 "$o of it" ct-convert oblique.nii $o; py same oblique.nii $o; ok $? 'is where it was'
		ct-convert -qf $o back.nii; py back oblique.nii back.nii; ok $? 'and comes back'
	done
	exits 5 'a sheared one' ct-convert sheared.nii sheared/; has err 'sheared.nii: .*right angles' 'is refused'
	[ ! -e sheared ]; ok $? 'nothing is made'
	if command -v dcm2niix >/dev/null; then
		for axes in $(ls -d */ | sed -n "s/^\([LRAPSI]\{3\}\).$/\1/p" | head -n 8); do
			dcm2niix -z n -f d2n-$axes -o . $axes >/dev/null 2>&1
			py back in-$axes.nii d2n-$axes.nii || echo $axes
		done >wrong 2>&1
		[ ! -s wrong ]; ok $? 'so does dcm2niix'; sed 's/^/# /' wrong
	else
		skip 'so does dcm2niix' 'no dcm2niix'
	fi
else
	skip 'pydicom, dcm2niix' 'no pydicom or no nibabel'
fi

# the same input: the same bytes; another voxel, another folder of bytes
sum() { cat "$1"/* | cksum; }
mkdir elsewhere; cp v.nii elsewhere; ct-convert -q elsewhere/v.nii again/; [ "$(sum first)" = "$(sum again)" ]; ok $? 'the same bytes twice'
ct-convert -q --type i16 --reorient LAS v.nii w.nii
head -c -2 v.nii >other.nii; printf '\001\000' >>other.nii; ct-convert -q other.nii other/
strings_of() { strings -n 20 "$1" | grep -o '2\.25\.[0-9]*' | sort -u; }
if command -v strings >/dev/null; then
	strings_of first/ctsr0001.dcm >a; strings_of other/ctsr0001.dcm >b
	[ "$(comm -12 a b | wc -l)" -eq 1 ]; ok $? 'a voxel in another slice: all UIDs are others but that of the program'
	for f in first/*; do strings_of "$f"; done | sort | uniq -c >u # program, study, series, space in all 5, one a slice
	[ "$(awk '$1 == 1' u | wc -l) $(awk '$1 == 5' u | wc -l)" = '5 4' ]; ok $? 'one UID a slice, the others are shared'
	[ -z "$(awk 'length($2) > 64' u)" ]; ok $? 'no longer than 64 characters'
fi
SOURCE_DATE_EPOCH=86399 ct-convert -q v.nii dated/; ct-convert -q v.nii dated.dcm
grep -aq '19700101' dated/ctsr0001.dcm && grep -aq 235959 dated/ctsr0001.dcm; ok $? 'SOURCE_DATE_EPOCH is its date'
! grep -aq "$(date +%Y%m)" first/ctsr0001.dcm dated.dcm; ok $? 'today is not'

# values
ct-convert -q --type f32 f.nii f32.nii; exits 0 'values between' ct-convert -fv f.nii r/; has err 'rounded to whole HU' 'are rounded, with -v said'
exits 0 'whole ones' ct-convert -fv v.nii r/; ! grep -q rounded err; ok $? 'are not'
printf '\000\000\000\000\000\000\000\107\000\000\000\307' >w.raw # 0, 32768, -32768
exits 6 'values that do not fit' ct-convert --raw 3x1x1:f32:1 --units hu w.raw no/
has err '32768 at voxel 1,0,0 does not fit' 'are named, with their place'
printf '\000\000\000\000\000\377\377\106\000\000\000\307' >w.raw # 0, 32767.5, -32768
exits 6 'nor those that do not when rounded' ct-convert --raw 3x1x1:f32:1 --units hu w.raw no/
printf '\000\000\000\000\000\000\200\077\000\000\000\077\000\000\200\077' >w.raw # 0, 1, 0.5, 1
exits 3 'what cannot be HU' ct-convert --raw 2x1x2:f32:1 w.raw no/; has err '^ct-convert: w.raw: values from 0 to 1 are not HU' 'is refused by name'
ct-convert -q --units other --raw 2x1x2:f32:1 w.raw o.nii
exits 3 'what says it is not' ct-convert o.nii no/; has err 'its values are not HU, says its metadata' 'too'
exits 0 'unless it is said' ct-convert --units other o.nii us/; exits 3 'and then' ct-convert us d.nii; has err 'RescaleType' 'the files say so'; rm -f d.nii; clean 'of no unit' us/*
[ ! -e no ]; ok $? 'nothing is made of what is refused'

# names
exits 4 'a folder that holds files' ct-convert v.nii first/; has err 'first/: holds files' 'is refused'
exits 4 'so without a slash' ct-convert v.nii first
exits 0 '--force' ct-convert -f w.nii first; [ "$(sum first)" != "$(sum again)" ]; ok $? 'replaces a series'
ct-convert -q --reorient SAR v.nii more.nii; ct-convert -qf more.nii first; ct-convert -qf v.nii first; [ "$(sum first)" = "$(sum again)" ]; ok $? 'all of it'
: >first/notes.txt; exits 4 'but no other files' ct-convert -f w.nii first; has err 'holds notes.txt' 'and names one'
rm first/notes.txt; [ "$(sum first)" = "$(sum again)" ]; ok $? 'nothing has changed'
mkdir empty; chmod 750 empty; exits 0 'an empty folder' ct-convert v.nii empty; [ "$(stat -c %a empty) $(ls empty | wc -l)" = '750 5' ]; ok $? 'is filled, with its rights'
(umask 027; ct-convert -q v.nii mine/); [ "$(stat -c %a mine) $(stat -c %a mine/ctsr0001.dcm)" = '750 640' ]; ok $? 'umask holds'
ln -s empty link; exits 0 'a link' ct-convert -f w.nii link; [ -L link ] && [ "$(ls empty | wc -l)" -eq 5 ]; ok $? 'is followed'
exits 4 'a file with a slash' ct-convert v.nii v.nii/; exits 4 'no folder above' ct-convert v.nii none/x/
exits 4 'a folder of the series itself' ct-convert first first/out/; has err 'first/out/: lies in first, an input' 'is refused'
exits 4 'a file there' ct-convert first first/out.dcm; exits 4 'one in the template' ct-convert --template first v.nii first/out.dcm
exits 4 'one file that is there' ct-convert v.nii one.dcm; exits 0 'with --force' ct-convert -f v.nii one.dcm
for o in '--template first' --deid; do exits 2 "$o without DICOM" ct-convert $o v.nii d.nii; has err "^ct-convert: ${o%% *}: needs OUT to be DICOM" 'says so'; done
exits 2 '--type with it' ct-convert --type i16 v.nii no/; exits 3 'a template that is not there' ct-convert --template none v.nii no/; has err 'none: No such file' 'is named'; exits 3 'a template that is none' ct-convert --template v.nii w.nii no/; has err 'v.nii: is not DICOM' 'says so'
exits 2 'projections' ct-convert --scanner s.json v.nii no/
exits 2 'another command' ct-degrade -x 2 v.nii no.dcm; [ ! -e no ] && [ ! -e no.dcm ]; ok $? 'nothing is made'

# nothing half-written
room() { # room OUT SIZE: with no file allowed to grow to SIZE, the words go through a pipe
	for k in 0 1 2 3 4 5 6 7 8 9; do
		{ (trap '' XFSZ; prlimit --fsize=$(($2 * k / 10)) ct-convert -q v.nii "$1"; echo $? >&3); } 2>&1 3>status | cat >err
		[ "$(cat status) $(ls -d full* 2>/dev/null)" = '4 ' ] && grep -q "^ct-convert: $1.*: [FN]" err || { cat status err; ls -d full*; }
	done
}
if command -v prlimit >/dev/null; then
	{ room full/ "$(stat -c %s first/ctsr0001.dcm)"; room full.dcm "$(stat -c %s one.dcm)"; } >wrong 2>&1
	[ ! -s wrong ]; ok $? 'no room: status 4, and nothing is left'; sed 's/^/# /' wrong
	(trap '' XFSZ; prlimit --fsize=100 ct-convert -qf w.nii first/ 2>/dev/null); [ "$(sum first)" = "$(sum again)" ]; ok $? 'what was there stays'
else
	skip 'no room' 'no prlimit'
fi
ct-phantom -q --size 24x24x1500 --spacing 1 cube long.nii; ct-convert -q long.nii ref.dcm
for sig in 2 15 9; do
	for o in long/ long.dcm; do
		signalled 100 $sig ct-convert -q long.nii $o 2>/dev/null
		echo "$sig $o $? $(ls -d long* .ctsr-* 2>/dev/null | tr '\n' ' ')"
	done
done >stopped
[ "$(grep -c '^[21].* 75 long.nii $' stopped)" -eq 4 ]; ok $? 'SIGINT and SIGTERM leave nothing'
[ "$(grep '^9.* 137 ' stopped | grep -c '\.ctsr-tmp-.* long')" -eq 2 ]; ok $? 'SIGKILL leaves what it had begun'
[ -z "$(awk '{for (i = 4; i <= NF; i++) if ($i == "long" || $i == "long.dcm") print}' stopped)" ]; ok $? 'but nothing of that name'
exits 0 'the next run' ct-convert -q long.nii long/; exits 0 'of either kind' ct-convert -q long.nii long.dcm
[ "$(ls -d long* .ctsr-* 2>/dev/null | tr '\n' ' ')" = 'long long.dcm long.nii ' ]; ok $? 'sweeps up what was left'
[ "$(ls long | wc -l) $(ls long | tail -n 1)" = '1500 ctsr1500.dcm' ]; ok $? 'and is whole'

# whose it is
[ "$oracle" ] || { skip 'templates' 'no pydicom or no nibabel'; done_testing; }
py make; ok $? 'a template is made'
ct-convert -q template t.nii; ct-convert -q --iso 1.25 t.nii iso.nii
for t in '' --deid; do
	exits 0 "DICOM to DICOM $t" ct-convert -q $t template "own$t/"
	exits 0 "of a folder $t" ct-convert -q $t --template template t.nii "folder$t/"
	exits 0 "of a file $t" ct-convert -q $t --template template/03.dcm iso.nii "iso$t/"
	exits 0 "one file $t" ct-convert -q $t --template template iso.nii "iso$t.dcm"
	clean "with a template $t" own$t/* iso$t/ctsr0002.dcm iso$t.dcm
done
for d in own folder iso iso.dcm; do py kept $d; ok $? "$d: patient, study, space and scan are the template's, what is stale is not"; done
for d in own--deid folder--deid iso--deid iso--deid.dcm; do py removed $d; ok $? "$d: nothing of it tells who that is"; done
py nearest iso; ok $? 'each slice names those that it lies between'
py alone own; ok $? 'or the one that it was'
py dated iso.dcm 20010206 141516.5; ok $? 'the content of one file is as old as the oldest slice'
py dated iso--deid.dcm 19000101 000000; ok $? 'or of no time'
SOURCE_DATE_EPOCH=86399 ct-convert -qf --template template iso.nii dated.dcm; py dated dated.dcm 19700101 235959; ok $? 'or of SOURCE_DATE_EPOCH'
mkdir undated; cp template/* undated; "$PY" -c 'import glob, pydicom
for f in glob.glob("undated/*"): d = pydicom.dcmread(f); d.ContentDate = "20010206"; d.ContentTime = "1415"; d.save_as(f)'
ct-convert -q --template undated iso.nii undated.dcm; py dated undated.dcm 19000101 000000; ok $? 'half a time is none'
grep -aq 'Spatially-related' folder/ctsr0001.dcm && grep -aq 'Spatial resampling' iso/ctsr0001.dcm; ok $? 'what was done to them is told'
tar cf template.tar template
if ct-convert -q --template template.tar iso.nii tar/ 2>err || ! grep -q ': not DICOM$' err; then
	[ "$(sum tar)" = "$(sum iso)" ]; ok $? 'an archive of it is as good'
else
	skip 'an archive' 'built without libarchive'
fi
ct-convert -q --sidecar side.json template side.nii; exits 3 'a sidecar' ct-convert --template side.json side.nii x/; has err 'side.json: is not DICOM' 'is no template'
mkdir Secret_Patricia; cp template/* Secret_Patricia; cp iso.nii SECRET.nii
ct-convert -q --deid Secret_Patricia names/ && ct-convert -q --deid --template Secret_Patricia SECRET.nii names.dcm
py removed names && py removed names.dcm; ok $? 'nor do names of files get in'
ct-sr -q -Q draft -x 2 --deid --report names.html Secret_Patricia/ Patricia/; ! grep -q Patricia names.html && grep -q 'times as many as IN:' names.html; ok $? 'nor into the report'
ct-convert -q Secret_Patricia past.nii; ct-sr -qf -Q draft -x 2 --deid --report names.html past.nii Patricia/; ! grep -q Patricia names.html && grep -q 'times as many as IN:' names.html; ok $? 'nor that of what IN was made of'
mkdir gap; "$PY" -c 'import glob, pydicom
for k, f in enumerate(sorted(glob.glob("template/*"))): d = pydicom.dcmread(f); d.InstanceNumber = k + 1 + 2 * (k > 2); d.SliceThickness = 2; d.save_as("gap/Patricia%d.dcm" % k)'
uid=$("$PY" -c 'import pydicom; print(pydicom.dcmread("gap/Patricia0.dcm").SeriesInstanceUID)')
exits 0 'numbers that are left out' ct-sr -f -Q draft -x 2 --deid --series "$uid" --report names.html --confidence names.nii gap Patricia.dcm
has err 'InstanceNumber .*: slices may be missing' 'is a warning'; has names.html 'slices may be missing' 'and in the report'
! grep -q "Patricia\|$uid" names.html names.nii; ok $? 'without the name of the slice, and the UID of the series is nowhere'
ct-phantom -q --size 12x12x12 sphere Patricia.nii; echo '{"SliceThickness": -3}' >Patricia.json
exits 0 'NIfTI' ct-sr -f -Q draft -x 2 --deid --report names.html Patricia.nii Patricia.dcm; has names.html 'the JSON beside IN' 'and what lies beside it'; ! grep -q Patricia names.html; ok $? 'nor the names of NIfTI, of JSON beside it and of OUT'
exits 2 'a report of projections' ct-sr -x 2 --paper --deid --report n.html Secret_Patricia no/; has err '^ct-sr: --deid: .*: not with --report' 'would tell'
ct-sr -q -Q draft -x 2 --report names.html -f Secret_Patricia/ Patricia/; grep -q 'times as many as Secret_Patricia:' names.html && grep -q '<title>Patricia: report' names.html; ok $? 'which names the folders otherwise'
tag() { dcmdump +P "$1" "$2" | sed -n 's/.*\[\(.*\)\].*/\1/p' | sort -u; }
if command -v dcmdump >/dev/null; then
	for t in StudyInstanceUID FrameOfReferenceUID PatientID; do
		a=$(tag $t own--deid/ctsr0001.dcm); [ "$a" ] && [ "$a" = "$(tag $t iso--deid.dcm)" ] || echo $t
	done >wrong
	[ ! -s wrong ]; ok $? 'the same study, space and patient have the same names without one'
	[ "$(tag SeriesInstanceUID own/ctsr0001.dcm)" != "$(tag SeriesInstanceUID iso/ctsr0001.dcm)" ]; ok $? 'series have their own'
fi
exits 0 'no template' ct-convert -v t.nii none/; has err 'none/: of no patient and no study.*--template' 'says so'
mkdir two; cp template/* two; cp first/* two; exits 5 'two series' ct-convert --template two iso.nii x/; has err 'series' 'are one too many'
exits 0 '--series' ct-convert --template two --series 1.2.840.4711.3 iso.nii two.dcm; py kept two.dcm; ok $? 'takes one'
"$PY" -c 'import nibabel
v = nibabel.load("t.nii"); v.affine[2, 3] += 500; nibabel.Nifti1Image(v.dataobj, v.affine).to_filename("far.nii")'
exits 5 'a volume beside the template' ct-convert --template template far.nii x/; has err 'template/.*not of one space' 'is of another'
cp -r template patient-b; cp -r template space-b; "$PY" -c 'import glob, pydicom
def put(folder, key, value):
    for f in glob.glob(folder + "/*"): d = pydicom.dcmread(f); setattr(d, key, value); d.save_as(f)
put("patient-b", "PatientID", "4711-B"); put("space-b", "FrameOfReferenceUID", "1.2.840.99")'
for d in patient-b space-b; do
	for in in template t.nii iso.nii; do
		exits 5 "$in with the template $d" ct-convert --template $d $in x/; has err "$d/.* another patient or space ([0-9a-f]\{8\}) than IN ([0-9a-f]\{8\})" 'is refused, by hashes'
	done
	exits 5 'what ct-sr made of it' sh -c "ct-sr -qf -x 2 -Q draft t.nii hr.nii && ct-convert --template $d hr.nii x/"
	exits 0 'unless it is meant' ct-convert -q --template-other-patient --template $d template "meant-$d/"
done
! grep -qa 4711-B meant-space-b/*1.dcm && grep -qa 4711-B meant-patient-b/*1.dcm; ok $? 'then its patient has the pixels'
exits 2 'without a template' ct-convert --template-other-patient t.nii x/
cp -r template mr; "$PY" -c 'import glob, pydicom
for f in glob.glob("mr/*"): d = pydicom.dcmread(f); d.Modality = "MR"; d.save_as(f)'
exits 3 'one of another modality' ct-convert --units other mr x/; has err "mr/.*modality is 'MR'" 'is not written as CT'
[ ! -e x ]; ok $? 'nothing is made'
exits 0 'from one file to files' ct-convert -q iso.dcm from-one/; clean 'of frames' from-one/ctsr0002.dcm
ct-convert -qf from-one back.nii; ct-convert -q iso.dcm b.nii; [ "$(voxels back.nii)" = "$(voxels b.nii)" ]; ok $? 'are the same'

# the chain
ct-sr -q -x 2 -Q draft template sr/ 2>err; ok $? 'ct-sr from DICOM to DICOM'
clean 'of ct-sr' sr/ctsr0001.dcm; py kept sr; ok $? 'is of the same study'
grep -aq 'SECRETSERIES SR x2' sr/ctsr0001.dcm && grep -aq 'ctsr [0-9.]*: ct-sr' sr/ctsr0001.dcm; ok $? 'and says what it is'
ct-info sr >info; has info '^size  *24 20$' 'twice as fine'; has info '^fit  *yes$' 'and fit'
ct-phantom -q --size 24x24x24 marks ring.nii && ct-degrade -q -x 2 ring.nii ring2.nii && ct-sr -q -Q draft ring2.nii rings.nii && ct-sr -q -Q draft ring2.nii rings/ 2>/dev/null && ct-convert -q rings rung.nii
least() { ct-info "$1" | sed -n 's/^min *//p'; }
awk "BEGIN {exit !($(least rings.nii) < -1025 && $(least rung.nii) >= $(least ring2.nii) - .5)}"; ok $? "nothing below the scan is written as DICOM ($(least rings.nii), $(least rung.nii), $(least ring2.nii))"
by() { ct-sr -x 4 --paper --expert views=3,iterations=3,gaussians=50 "$@"; } # by ARGS...: by way of projections
exits 0 'with --keep' by -q --keep work template kept/; by -q template sr4/ 2>err; [ "$(sum kept)" = "$(sum sr4)" ]; ok $? 'the same bytes'
exits 0 'to MetaImage' by -q template sr4.mha; head -c 10 sr4.mha | grep -q '^ObjectType'; ok $? 'no study is asked'
sh work/commands.sh 2>err; ok $? 'and by its script'; [ "$(sum kept)" = "$(sum sr4)" ]; ok $? 'once more'
exits 0 'goes on' by -v --keep work template kept/; has err '8 of 8 steps were done' 'with all that is done'
rm kept/ctsr0003.dcm; exits 0 'where a slice is gone' by -q --keep work template kept/; [ "$(sum kept)" = "$(sum sr4)" ]; ok $? 'they are written again'
exits 0 'one of two series' ct-sr -q -x 2 -Q draft --series 1.2.840.4711.3 two two-sr.dcm; py kept two-sr.dcm; ok $? 'is that'
exits 0 'NIfTI of a template' sh -c 'ct-sr -q -x 2 -Q draft t.nii - | ct-convert --template two --series 1.2.840.4711.3 - templated/'; py kept templated; ok $? 'is of its study'
exits 0 'without what tells who' ct-sr -q -x 2 -Q draft --deid template sr-deid/; py removed sr-deid; ok $? 'has nothing of it'
exits 0 'NIfTI to DICOM' ct-sr -q -x 2 -Q draft t.nii of-nii/; exits 4 'what is there' ct-sr -q -x 2 -Q draft template sr; exits 4 'the folder between' by -q --keep both template both/
done_testing
