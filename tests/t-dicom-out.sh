#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What is written beside or as DICOM: sidecars, which never name the patient; and series.
. "$srcdir/tests/tap.sh"

# ct-convert --sidecar: what is known of a volume, and where each plane comes from; never the patient.
part sidecar
ct-phantom -q --size 6x5x4 --spacing 2 marks a.nii
# sidecars of NIfTI: what they say, pipes, refusals
exits 0 'ct-convert --sidecar writes a sidecar of NIfTI' ct-convert --sidecar a.json a.nii b.nii
has a.json '"SourceFile": "a.nii"' 'the sidecar of NIfTI names its source file'
has a.json '"ConversionSoftware": "ctsr"' 'the sidecar of NIfTI names the software'
! grep -q Units a.json; ok $? 'the sidecar of NIfTI has no units that nobody stated'
exits 0 'ct-convert --sidecar accepts --units' ct-convert --units hu --sidecar h.json a.nii h.nii
has h.json '"Units": "HU"' 'the sidecar has the units of --units'
! grep -q Slice a.json; ok $? 'the sidecar of NIfTI has no slices'
exits 0 'ct-convert --sidecar accepts --reorient and --iso' ct-convert --reorient PIL --iso 3 --sidecar i.json a.nii i.nii
cmp -s i.json a.json; ok $? 'the sidecar describes the input before its grid is changed'
exits 0 'ct-convert --sidecar accepts --units other' ct-convert --units other --sidecar u.json a.nii u.nii
has u.json '"Units": "other"' 'the sidecar has the units other'
exits 0 'ct-convert --sidecar - writes the sidecar to standard output' sh -c 'ct-convert --sidecar - a.nii c.nii >s.json'
cmp -s s.json a.json; ok $? 'the sidecar on standard output is that of the file'
exits 0 'ct-convert --sidecar accepts a volume from a pipe' sh -c 'ct-convert --sidecar p.json - - <a.nii >c2.nii'
! grep -q SourceFile p.json; ok $? 'the sidecar of a pipe names no source file'
tail -c 240 b.nii >1
tail -c 240 c.nii | cmp -s - 1
ok $? 'the volume is the same with the sidecar in a file or on standard output'
exits 2 'sidecar and volume on standard output are refused with status 2' ct-convert --sidecar - a.nii -
exits 4 'an existing sidecar is not overwritten' ct-convert --sidecar h.json a.nii d.nii
has err 'h.json: exists' 'the error of an existing sidecar names it'
[ ! -e d.nii ]; ok $? 'an existing sidecar is refused before the volume is written'
ln a.nii n.json
exits 4 'a sidecar that is the input is refused even with --force' ct-convert -f --sidecar n.json a.nii d.nii
cp a.json was.json; ln -s a.nii link.nii; ln -s a.json link.json
for o in 'ct-convert a.nii' 'ct-convert link.nii' 'ct-sr -q -Q draft -x 2 a.nii'; do
	exits 4 "the sidecar beside the input of $o is not written over" $o d.nii -f --sidecar a.json
	has err 'a.json: would be written over the scanner of [a-z]*.nii, an input' "the error of $o over a sidecar names its input"
done
cmp -s a.json was.json; ok $? 'the sidecar beside the input stays as it was'
exits 2 'a sidecar named .nii is refused with status 2' ct-convert --sidecar x.nii a.nii d.nii
ln -s /dev/full full.json
exits 4 'a full disk ends ct-convert --sidecar with status 4' ct-convert --sidecar full.json a.nii d.nii
# sidecars of ct-sr
exits 0 'ct-sr --sidecar writes a sidecar of its result' ct-sr -q -Q draft -x 1,1,2 --sidecar r.json a.nii r.nii
for i in '"SourceFile": "a.nii"' '"Factor": "1,1,2"' '"Method": "' '"DERIVED"' '"Units": "HU"'; do
	has r.json "$i" "the sidecar of a refined scan says $i"
done
exits 2 'ct-sr --sidecar with --paper is refused with status 2' ct-sr --sidecar no.json --paper a.nii no.nii
exits 4 'a full disk ends ct-sr --sidecar with status 4' ct-sr -q -Q draft -x 1,1,2 --sidecar full.json a.nii r2.nii

# DICOM out: what is written is what was there, in any orientation; it belongs to the patient and study of its
# template, or to nobody; dciodvfy finds no error; nothing half-written is left.
part out
ct-phantom -q --size 7x6x5 --spacing 2,2.5,3 marks f.nii && ct-convert -q --type i16 f.nii v.nii
ct-convert v.nii first/ 2>err
if grep -q 'with-vtk' err; then skip 'DICOM out' 'built without vtk-dicom'; done_testing; fi
python_with pydicom && "$PY" -c 'import nibabel' && oracle=1 || oracle=
[ -z "$oracle" ] || calls numpy nibabel pydicom dicom
py() { called "$srcdir/tests/t-dicom-out.py" "$@"; }
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
[ "$(ls first | tr '\n' ' ')" = 'ctsr0001.dcm ctsr0002.dcm ctsr0003.dcm ctsr0004.dcm ctsr0005.dcm ' ]
ok $? 'a folder gets one DICOM file for each slice'
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
clean 'series without a template' first/* [LR]??/ctsr0002.dcm RSA.dcm LSA.dcm
ct-convert -q v.nii one.dcm; clean 'one file without a template' one.dcm
ct-info first >info
has info '^fit  *yes$' 'ct-info finds a folder of slices fit'
has info '^gap-mm  *3 3 3$' 'ct-info shows the spacing of a folder of slices'
ct-info one.dcm >info; has info '^fit  *yes$' 'ct-info finds a DICOM file of all slices fit'
if [ "$oracle" ]; then
	py all pairs >wrong 2>&1
	[ ! -s wrong ]; ok $? 'pydicom reads the same voxels at the same places'; sed 's/^/# /' wrong
	py oblique; ok $? 'pydicom makes a volume at an angle'
	for o in o/ o.dcm; do
		exits 0 "a volume at an angle is written to $o" ct-convert oblique.nii $o
		py same oblique.nii $o
		ok $? "pydicom finds every voxel of $o where it was"
		ct-convert -qf $o back.nii; py back oblique.nii back.nii; ok $? "a volume at an angle comes back from $o"
	done
	exits 5 'a sheared volume is refused as DICOM with status 5' ct-convert sheared.nii sheared/
	has err 'sheared.nii: .*right angles' 'the error of a sheared volume names the file and right angles'
	[ ! -e sheared ]; ok $? 'a sheared volume leaves no folder'
	if command -v dcm2niix >/dev/null; then
		for axes in $(ls -d */ | sed -n "s/^\([LRAPSI]\{3\}\).$/\1/p" | head -n 8); do
			dcm2niix -z n -f d2n-$axes -o . $axes >/dev/null 2>&1
			py back in-$axes.nii d2n-$axes.nii || echo $axes
		done >wrong 2>&1
		[ ! -s wrong ]; ok $? 'dcm2niix reads the same voxels at the same places'; sed 's/^/# /' wrong
	else
		skip 'dcm2niix reads the same voxels at the same places' 'no dcm2niix'
	fi
else
	skip 'pydicom and dcm2niix read the same voxels' 'no pydicom or no nibabel'
fi

# bytes, UIDs, dates
sum() { cat "$1"/* | cksum; }
mkdir elsewhere
cp v.nii elsewhere
ct-convert -q elsewhere/v.nii again/
[ "$(sum first)" = "$(sum again)" ]
ok $? 'the same voxels from another folder give the same bytes'
ct-convert -q --type i16 --reorient LAS v.nii w.nii
head -c -2 v.nii >other.nii; printf '\001\000' >>other.nii; ct-convert -q other.nii other/
strings_of() { strings -n 20 "$1" | grep -o '2\.25\.[0-9]*' | sort -u; }
if command -v strings >/dev/null; then
	strings_of first/ctsr0001.dcm >a; strings_of other/ctsr0001.dcm >b
	[ "$(comm -12 a b | wc -l)" -eq 1 ]; ok $? 'a change of one voxel changes every UID but that of the program'
	for f in first/*; do strings_of "$f"; done | sort | uniq -c >u # program, study, series, space in all 5, one a slice
	[ "$(awk '$1 == 1' u | wc -l) $(awk '$1 == 5' u | wc -l)" = '5 4' ]
	ok $? 'each slice has one UID of its own and shares the others'
	[ -z "$(awk 'length($2) > 64' u)" ]; ok $? 'no UID is longer than 64 characters'
fi
SOURCE_DATE_EPOCH=86399 ct-convert -q v.nii dated/; ct-convert -q v.nii dated.dcm
grep -aq '19700101' dated/ctsr0001.dcm && grep -aq 235959 dated/ctsr0001.dcm
ok $? 'SOURCE_DATE_EPOCH is the date in the files'
for t in x 253402300800 -1; do
	exits 2 "SOURCE_DATE_EPOCH=$t is refused with status 2" env SOURCE_DATE_EPOCH=$t ct-convert -q v.nii none.dcm
	has err "SOURCE_DATE_EPOCH is '$t'" "the error of SOURCE_DATE_EPOCH=$t gives its value"
done
! grep -aq "$(date +%Y%m)" first/ctsr0001.dcm dated.dcm
ok $? 'without SOURCE_DATE_EPOCH the date of today is not in the files'

# values
ct-convert -q --type f32 f.nii f32.nii
exits 0 'values that are not whole HU are written as DICOM' ct-convert -fv f.nii r/
has err 'rounded to whole HU' 'ct-convert -v reports that values are rounded to whole HU'
exits 0 'values that are whole HU are written as DICOM' ct-convert -fv v.nii r/
! grep -q rounded err
ok $? 'whole HU give no message about rounding'
printf '\000\000\000\000\000\000\000\107\000\000\000\307' >w.raw # 0, 32768, -32768
exits 6 'a value of 32768 HU is refused with status 6' ct-convert --raw 3x1x1:f32:1 --units hu w.raw no/
has err 'no/: 32768 at voxel 1,0,0 does not fit' 'the error of a value that does not fit gives the output, the value and its voxel'
printf '\000\000\000\000\000\377\377\106\000\000\000\307' >w.raw # 0, 32767.5, -32768
exits 6 'a value that rounds to 32768 HU is refused with status 6' ct-convert --raw 3x1x1:f32:1 --units hu w.raw no/
printf '\000\000\000\000\000\000\200\077\000\000\000\077\000\000\200\077' >w.raw # 0, 1, 0.5, 1
exits 3 'values from 0 to 1 are refused as DICOM with status 3' ct-convert --raw 2x1x2:f32:1 w.raw no/
has err '^ct-convert: w.raw: values from 0 to 1 are not HU' 'the error of values from 0 to 1 names the file'
ct-convert -q --units other --raw 2x1x2:f32:1 w.raw o.nii
exits 3 'a volume that records another unit is refused as DICOM' ct-convert o.nii no/
has err 'its values are not HU, says its metadata' 'the error of a volume of another unit mentions its metadata'
exits 0 '--units other writes a volume of another unit as DICOM' ct-convert --units other o.nii us/
exits 3 'a series of another unit is refused without --units' ct-convert us d.nii
has err 'RescaleType' 'the error of a series of another unit names RescaleType'
rm -f d.nii
clean 'a series of another unit' us/*
[ ! -e no ]; ok $? 'refused values leave no DICOM folder'

# names of outputs: what is replaced and what is kept
exits 4 'a folder that holds files is not overwritten' ct-convert v.nii first/
has err 'first/: holds files' 'the error of a folder that holds files names it'
exits 4 'a folder that holds files is not overwritten without a slash' ct-convert v.nii first
exits 0 '--force accepts a folder that holds a series' ct-convert -f w.nii first
[ "$(sum first)" != "$(sum again)" ]
ok $? '--force replaces the series of the folder'
ct-convert -q --reorient SAR v.nii more.nii
ct-convert -qf more.nii first
ct-convert -qf v.nii first
[ "$(sum first)" = "$(sum again)" ]
ok $? '--force removes the slices that the new series does not have'
: >first/notes.txt
exits 4 '--force refuses a folder that holds other files' ct-convert -f w.nii first
has err 'holds notes.txt' 'the error of a folder with other files names one'
rm first/notes.txt; [ "$(sum first)" = "$(sum again)" ]; ok $? 'a folder that is refused keeps its series'
mkdir empty
chmod 750 empty
exits 0 'a series is written into an empty folder' ct-convert v.nii empty
[ "$(stat -c %a empty) $(ls empty | wc -l)" = '750 5' ]
ok $? 'an empty folder keeps its mode when it is filled'
(umask 027; ct-convert -q v.nii mine/)
[ "$(stat -c %a mine) $(stat -c %a mine/ctsr0001.dcm)" = '750 640' ]
ok $? 'a new folder and its files obey the umask'
ln -s empty link
exits 0 'a series is written through a symbolic link' ct-convert -f w.nii link
[ -L link ] && [ "$(ls empty | wc -l)" -eq 5 ]
ok $? 'a symbolic link to a folder stays a link'
exits 4 'an existing file with a slash behind it is refused' ct-convert v.nii v.nii/
exits 4 'a folder whose parent does not exist is refused' ct-convert v.nii none/x/
exits 4 'an output folder inside the input folder is refused' ct-convert first first/out/
has err 'first/out/: lies in first, an input' 'the error of an output folder inside the input names both'
exits 4 'an output file inside the input folder is refused' ct-convert first first/out.dcm
exits 4 'an output file inside the template folder is refused' ct-convert --template first v.nii first/out.dcm
for o in first first/ ./first; do
	exits 4 "--force does not replace the folder $o of a file that is read" ct-convert -f first/ctsr0001.dcm $o
	has err 'holds first/ctsr0001.dcm, an input, and would be replaced' "the error of the folder $o names the input in it"
done
exits 4 '--force does not write over a slice beside the file that is read' \
	ct-convert -f first/ctsr0001.dcm first/ctsr0002.dcm
has err 'first/ctsr0002.dcm: would be written over first/ctsr0002.dcm, a slice of the input' \
	'the error of an output that is a slice of the input names both'
exits 4 'ct-sr does not write over a slice beside the file that is read' \
	ct-sr -Q draft -f first/ctsr0001.dcm first/ctsr0002.dcm
has err 'a slice of the input' 'the error of ct-sr says that OUT is a slice of the input'
exits 4 '--force does not write over a slice beside the template' \
	ct-convert -f --template first/ctsr0001.dcm v.nii first/ctsr0002.dcm
exits 0 'a new file may lie beside the series of the file that is read' ct-convert first/ctsr0001.dcm first/out.dcm
exits 0 '--force replaces a file of another series beside the one that is read' ct-convert -f first/ctsr0001.dcm first/out.dcm
rm first/out.dcm
exits 4 'a list of slices without OUT does not write over the last one' ct-convert -f first/*.dcm
has err "$(ls first/*.dcm | tail -n 1): would be written over, and is a slice of the series that is read" 'the error of a list without OUT names its last slice'
cp -r first bare; for f in bare/*.dcm; do mv "$f" "${f%.dcm}"; done; cp -r bare was
for o in 'ct-convert bare d.nii --sidecar' 'ct-convert bare/ctsr0001 d.nii --sidecar' 'ct-sr -q -x 2 -Q draft bare d.nii --report' \
	'ct-sr -q -x 2 -Q draft bare/ctsr0001 d.nii --sidecar' 'ct-phantom cube'; do
	exits 4 "$o does not write over DICOM" $o bare/ctsr0002 -f
	has err 'bare/ctsr0002: is DICOM, and is replaced only by DICOM: remove it first' "the error of $o over DICOM says what to do"
done
exits 4 'a list of slices without an ending and without OUT is refused' ct-convert -f bare/*
diff -r bare was >/dev/null; ok $? 'DICOM without an ending stays as it was'
tail -c +$((145 + $(od -An -tu4 -j140 -N4 was/ctsr0002))) was/ctsr0002 >bare/ctsr0002; cp bare/ctsr0002 no-preamble
for o in 'ct-convert bare d.nii --sidecar' 'ct-sr -q -x 2 -Q draft bare d.nii --report' 'ct-phantom cube'; do
	exits 4 "$o does not write over a slice without preamble" $o bare/ctsr0002 -f
done
cmp bare/ctsr0002 no-preamble; ok $? 'a slice without preamble stays as it was'
rm -r bare was
[ "$(sum first)" = "$(sum again)" ]; ok $? 'outputs that are refused leave the series of the input as it was'
mkdir named; echo scan >named/ctsr0001.dcm; cp v.nii named/ctsr0002.dcm
exits 4 '--force does not replace files of the user with names like ours' ct-convert -f w.nii named/
has err 'named/: holds ctsr000..dcm, which is not of a series that was written here' \
	'the error of files with names like ours names one of them'
[ "$(cat named/ctsr0001.dcm)" = scan ]; ok $? 'files of the user with names like ours are as they were'
exits 4 'an existing DICOM file is not overwritten' ct-convert v.nii one.dcm
exits 0 '--force replaces an existing DICOM file' ct-convert -f v.nii one.dcm
for o in '--template first' --deid; do
	exits 2 "$o with an output that is not DICOM is refused" ct-convert $o v.nii d.nii
	has err "^ct-convert: ${o%% *}: needs OUT to be DICOM" "the error of $o names the option and says that OUT must be DICOM"
done
exits 2 '--type with a DICOM output is refused with status 2' ct-convert --type i16 v.nii no/
exits 3 'a template that does not exist is refused with status 3' ct-convert --template none v.nii no/
has err 'none: No such file' 'the error of a template that does not exist names it'
exits 3 'a template that is NIfTI is refused with status 3' ct-convert --template v.nii w.nii no/
has err 'v.nii: is not DICOM' 'the error of a template that is NIfTI names it'
exits 2 '--scanner with a DICOM output is refused with status 2' ct-convert --scanner s.json v.nii no/
exits 2 'ct-degrade refuses to write DICOM with status 2' ct-degrade -x 2 v.nii no.dcm
[ ! -e no ] && [ ! -e no.dcm ]
ok $? 'refused options leave no DICOM output'

# a full disk and signals leave nothing half-written
room() { # room OUT SIZE: with no file allowed to grow to SIZE, the words go through a pipe
	for k in 0 1 2 3 4 5 6 7 8 9; do
		{ (trap '' XFSZ; prlimit --fsize=$(($2 * k / 10)) ct-convert -q v.nii "$1"; echo $? >&3); } 2>&1 3>status | cat >err
		[ "$(cat status) $(ls -d full* 2>/dev/null)" = '4 ' ] && grep -q "^ct-convert: $1.*: [FN]" err || { cat status err; ls -d full*; }
	done
}
if command -v prlimit >/dev/null; then
	{ room full/ "$(stat -c %s first/ctsr0001.dcm)"; room full.dcm "$(stat -c %s one.dcm)"; } >wrong 2>&1
	[ ! -s wrong ]; ok $? 'a full disk ends with status 4 and leaves nothing'; sed 's/^/# /' wrong
	(trap '' XFSZ; prlimit --fsize=100 ct-convert -qf w.nii first/ 2>/dev/null)
	[ "$(sum first)" = "$(sum again)" ]
	ok $? 'a full disk leaves the series that was there'
else
	skip 'a full disk leaves nothing' 'no prlimit'
fi
ct-phantom -q --size 24x24x1500 --spacing 1 cube long.nii; ct-convert -q long.nii ref.dcm
for sig in 2 15 9; do
	for o in long/ long.dcm; do
		signalled 100 $sig ct-convert -q long.nii $o 2>/dev/null
		echo "$sig $o $? $(ls -d long* .ctsr-* 2>/dev/null | tr '\n' ' ')"
	done
done >stopped
[ "$(grep -c '^[21].* 75 long.nii $' stopped)" -eq 4 ]; ok $? 'SIGINT and SIGTERM end with status 75 and leave nothing'
[ "$(grep '^9.* 137 ' stopped | grep -c '\.ctsr-tmp-.* long')" -eq 2 ]
ok $? 'SIGKILL leaves a temporary folder or file'
[ -z "$(awk '{for (i = 4; i <= NF; i++) if ($i == "long" || $i == "long.dcm") print}' stopped)" ]
ok $? 'a signal leaves no output of the final name'
exits 0 'the run after a SIGKILL writes the folder' ct-convert -q long.nii long/
exits 0 'the run after a SIGKILL writes the file' ct-convert -q long.nii long.dcm
[ "$(ls -d long* .ctsr-* 2>/dev/null | tr '\n' ' ')" = 'long long.dcm long.nii ' ]
ok $? 'the run after a SIGKILL removes the temporary files'
[ "$(ls long | wc -l) $(ls long | tail -n 1)" = '1500 ctsr1500.dcm' ]
ok $? 'the run after a SIGKILL writes every slice'

# patient and study: those of the template, or none with --deid
[ "$oracle" ] || { skip 'the files belong to the patient of the template' 'no pydicom or no nibabel'; done_testing; }
py make; ok $? 'pydicom makes a series as template'
ct-convert -q template t.nii; ct-convert -q --iso 1.25 t.nii iso.nii
for t in '' --deid; do
	exits 0 "DICOM becomes DICOM with its own patient: options '$t'" ct-convert -q $t template "own$t/"
	exits 0 "NIfTI becomes DICOM with a folder as template: options '$t'" ct-convert -q $t --template template t.nii "folder$t/"
	exits 0 "NIfTI becomes DICOM with a file as template: options '$t'" ct-convert -q $t --template template/03.dcm iso.nii "iso$t/"
	exits 0 "NIfTI becomes one DICOM file with a template: options '$t'" ct-convert -q $t --template template iso.nii "iso$t.dcm"
	clean "files with a template, options '$t'" own$t/* iso$t/ctsr0002.dcm iso$t.dcm
done
for d in own folder iso iso.dcm; do
	py kept $d
	ok $? "$d: patient, study, space and scan are those of the template, and stale attributes are gone"
done
for d in own--deid folder--deid iso--deid iso--deid.dcm; do
	py removed $d
	ok $? "$d: no attribute of the template that identifies the patient is left"
done
py nearest iso; ok $? 'each slice of a finer series names the template slices beside it'
py alone own; ok $? 'each slice of the same series names the template slice that it was'
py dated iso.dcm 20010206 141516.5; ok $? 'the content date of one file is that of the oldest template slice'
py dated iso--deid.dcm 19000101 000000; ok $? 'the content date of a de-identified file is 1900-01-01'
SOURCE_DATE_EPOCH=86399 ct-convert -qf --template template iso.nii dated.dcm
py dated dated.dcm 19700101 235959
ok $? 'the content date is that of SOURCE_DATE_EPOCH'
mkdir undated; cp template/* undated; "$PY" -c 'import glob, pydicom
for f in glob.glob("undated/*"): d = pydicom.dcmread(f); d.ContentDate = "20010206"; d.ContentTime = "1415"; d.save_as(f)'
ct-convert -q --template undated iso.nii undated.dcm
py dated undated.dcm 19000101 000000
ok $? 'a template with a time without seconds gives the content date 1900-01-01'
grep -aq 'Spatially-related' folder/ctsr0001.dcm && grep -aq 'Spatial resampling' iso/ctsr0001.dcm
ok $? 'the files record that they are resampled from the template'
tar cf template.tar template
if ct-convert -q --template template.tar iso.nii tar/ 2>err || ! grep -q ': not DICOM$' err; then
	[ "$(sum tar)" = "$(sum iso)" ]; ok $? 'a template in an archive gives the same bytes as its folder'
else
	skip 'a template in an archive gives the same bytes as its folder' 'built without libarchive'
fi
ct-convert -q --sidecar side.json template side.nii
exits 3 'a sidecar as template is refused with status 3' ct-convert --template side.json side.nii x/
has err 'side.json: is not DICOM' 'the error of a sidecar as template names it'
mkdir Secret_Patricia; cp template/* Secret_Patricia; cp iso.nii SECRET.nii
ct-convert -q --deid Secret_Patricia names/ && ct-convert -q --deid --template Secret_Patricia SECRET.nii names.dcm
py removed names && py removed names.dcm; ok $? '--deid writes no file name of the inputs'
ct-sr -q -Q draft -x 2 --deid --report names.html Secret_Patricia/ Patricia/
! grep -q Patricia names.html && grep -q 'times as many as IN:' names.html
ok $? 'the report of ct-sr --deid does not name the folder of the input'
ct-convert -q Secret_Patricia past.nii
ct-sr -qf -Q draft -x 2 --deid --report names.html past.nii Patricia/
! grep -q Patricia names.html && grep -q 'times as many as IN:' names.html
ok $? 'the report of ct-sr --deid does not name what the input was made from'
mkdir gap; "$PY" -c 'import glob, pydicom
for k, f in enumerate(sorted(glob.glob("template/*"))): d = pydicom.dcmread(f); d.InstanceNumber = k + 1 + 2 * (k > 2); d.SliceThickness = 2; d.save_as("gap/Patricia%d.dcm" % k)'
uid=$("$PY" -c 'import pydicom; print(pydicom.dcmread("gap/Patricia0.dcm").SeriesInstanceUID)')
exits 0 'ct-sr --deid refines a series whose instance numbers have a gap' ct-sr -f -Q draft -x 2 --deid --series "$uid" --report names.html --confidence names.nii gap Patricia.dcm
has err 'InstanceNumber .*: slices may be missing' 'a gap in the instance numbers gives a warning'
has names.html 'slices may be missing' 'the report lists the warning of a gap in the instance numbers'
! grep -q "Patricia\|$uid" names.html names.nii
ok $? 'with --deid report and map name neither a slice nor the UID of the series'
# slices that overlap
mkdir overlap; "$PY" -c 'import glob, pydicom
for k, f in enumerate(sorted(glob.glob("template/*"))): d = pydicom.dcmread(f); d.ImageType = ["ORIGINAL", "PRIMARY"]; d.SliceThickness = 7; d.save_as("overlap/%d.dcm" % k)'
thick() { "$PY" -c 'import glob, pydicom, sys
d = [pydicom.dcmread(f) for f in glob.glob(sys.argv[1] + "/*")]
print(*sorted({float(x.SliceThickness) if x.SliceThickness != x.SpacingBetweenSlices else "apart" for x in d}))' "$1"; }
ct-convert -q overlap overlap.nii && ct-convert -q --template overlap overlap.nii overlap-by/ && ct-convert -q overlap.nii overlap-of/
ct-sr -q -Q draft -x 1,1,2 overlap overlap-sr/
[ "$(thick overlap-by)$(thick overlap-of)" = 7.07.0 ]; ok $? 'slices that only pass through NIfTI are as thick as they were'
[ "$(thick overlap-sr)" = apart ]; ok $? 'refined slices are as thick as they are far apart'
ct-phantom -q --size 12x12x12 sphere Patricia.nii; echo '{"SliceThickness": -3}' >Patricia.json
exits 0 'ct-sr --deid refines NIfTI into DICOM' ct-sr -f -Q draft -x 2 --deid --report names.html Patricia.nii Patricia.dcm
has names.html 'the JSON beside IN' 'the report with --deid calls a sidecar the JSON beside IN'
! grep -q Patricia names.html
ok $? 'the report with --deid does not name NIfTI, sidecar and output'
exits 2 '--deid with a report of --paper is refused with status 2' ct-sr -x 2 --paper --deid --report n.html Secret_Patricia no/
has err "^ct-sr: --deid: .*not with --report" 'the error of --deid with --report names both options'
ct-sr -q -Q draft -x 2 --report names.html -f Secret_Patricia/ Patricia/
grep -q 'times as many as Secret_Patricia:' names.html && grep -q '<title>Patricia: report' names.html
ok $? 'without --deid the report names input and output'
tag() { dcmdump +P "$1" "$2" | sed -n 's/.*\[\(.*\)\].*/\1/p' | sort -u; }
if command -v dcmdump >/dev/null; then
	for t in StudyInstanceUID FrameOfReferenceUID PatientID; do
		a=$(tag $t own--deid/ctsr0001.dcm); [ "$a" ] && [ "$a" = "$(tag $t iso--deid.dcm)" ] || echo $t
	done >wrong
	[ ! -s wrong ]; ok $? 'de-identified outputs of one template share study, space and patient'
	[ "$(tag SeriesInstanceUID own/ctsr0001.dcm)" != "$(tag SeriesInstanceUID iso/ctsr0001.dcm)" ]
	ok $? 'two series from one template have different series UIDs'
fi
exits 0 'a volume without a template becomes DICOM' ct-convert -v t.nii none/
has err 'none/: of no patient and no study.*--template' 'ct-convert -v reports that a series has no patient without --template'
mkdir two
cp template/* two
cp first/* two
exits 5 'a template of two series is refused with status 5' ct-convert --template two iso.nii x/
has err 'series' 'the error of a template of two series mentions the series'
exits 0 '--series selects a series of the template' ct-convert --template two --series 1.2.840.4711.3 iso.nii two.dcm
py kept two.dcm
ok $? 'a file with --series belongs to that series of the template'
"$PY" -c 'import nibabel
v = nibabel.load("t.nii"); v.affine[2, 3] += 500; nibabel.Nifti1Image(v.dataobj, v.affine).to_filename("far.nii")'
exits 5 'a volume that lies beside the template is refused with status 5' ct-convert --template template far.nii x/
has err 'template/.*not of one space.*--template-other-patient' 'the error of a volume beside the template mentions the space and the option'
exits 0 '--template-other-patient accepts a volume that lies beside the template' ct-convert -q --template-other-patient --template template far.nii far/
"$PY" -c 'import glob, pydicom
d = [pydicom.dcmread(f) for f in glob.glob("far/*")]; s = pydicom.dcmread(glob.glob("template/*")[0])
assert d and all(x.PatientID == s.PatientID and x.ImagePositionPatient[2] > 400 for x in d)'
ok $? 'it has the patient of the template and the places of the volume'
cp -r template patient-b; cp -r template space-b; "$PY" -c 'import glob, pydicom
def put(folder, key, value):
    for f in glob.glob(folder + "/*"): d = pydicom.dcmread(f); setattr(d, key, value); d.save_as(f)
put("patient-b", "PatientID", "4711-B"); put("space-b", "FrameOfReferenceUID", "1.2.840.99")'
for d in patient-b space-b; do
	for in in template t.nii iso.nii; do
		exits 5 "$in with the template $d of another patient or space is refused" ct-convert --template $d $in x/
		has err "$d/.* another patient or space ([0-9a-f]\{8\}) than IN ([0-9a-f]\{8\})" "the error of $in with the template $d gives both as hashes"
	done
	exits 5 "a result of ct-sr with the template $d is refused" sh -c "ct-sr -qf -x 2 -Q draft t.nii hr.nii && ct-convert --template $d hr.nii x/"
	exits 0 "--template-other-patient accepts the template $d" ct-convert -q --template-other-patient --template $d template "meant-$d/"
done
! grep -qa 4711-B meant-space-b/*1.dcm && grep -qa 4711-B meant-patient-b/*1.dcm
ok $? 'with --template-other-patient the files carry the patient of the template'
exits 2 '--template-other-patient without --template is refused with status 2' ct-convert --template-other-patient t.nii x/
cp -r template mr; "$PY" -c 'import glob, pydicom
for f in glob.glob("mr/*"): d = pydicom.dcmread(f); d.Modality = "MR"; d.save_as(f)'
exits 3 'a series of MR is refused with status 3' ct-convert --units other mr x/
has err "mr/.*modality is 'MR'" 'the error of a series of MR names the modality'
[ ! -e x ]; ok $? 'refused templates leave no DICOM folder'
exits 0 'one DICOM file becomes a folder of slices' ct-convert -q iso.dcm from-one/
clean 'slices of one DICOM file' from-one/ctsr0002.dcm
ct-convert -qf from-one back.nii
ct-convert -q iso.dcm b.nii
[ "$(voxels back.nii)" = "$(voxels b.nii)" ]
ok $? 'slices of one DICOM file hold the same voxels'

# ct-sr from DICOM to DICOM
ct-sr -q -x 2 -Q draft template sr/ 2>err; ok $? 'ct-sr refines a DICOM folder into a DICOM folder'
clean 'a result of ct-sr' sr/ctsr0001.dcm
py kept sr
ok $? 'a result of ct-sr belongs to the study of its input'
grep -aq 'SECRETSERIES SR x2' sr/ctsr0001.dcm && grep -aq 'ctsr [0-9.]*: ct-sr' sr/ctsr0001.dcm
ok $? 'a result of ct-sr records ct-sr and the factor'
ct-info sr >info
has info '^size  *24 20$' 'a result of ct-sr has twice the columns and rows'
has info '^fit  *yes$' 'ct-info finds a result of ct-sr fit'
ct-phantom -q --size 24x24x24 ellipsoids hard.nii
ct-phantom -q --size 24x24x24 marks ring.nii && ct-degrade -q -x 2 ring.nii ring2.nii && ct-sr -q -Q draft ring2.nii rings.nii && ct-sr -q -Q draft ring2.nii rings/ 2>/dev/null && ct-convert -q rings rung.nii
least() { ct-info "$1" | sed -n 's/^min *//p'; }
awk "BEGIN {exit !($(least rings.nii) < -1025 && $(least rung.nii) >= $(least ring2.nii) - .5)}"
ok $? "nothing below the scan is written as DICOM ($(least rings.nii), $(least rung.nii), $(least ring2.nii))"
ct-degrade -q -x 2 --clip -200:400 hard.nii hard2.nii && ct-sr -Q draft hard2.nii hards/ 2>said && ct-convert -q hards whole.nii
was=$(sed -n 's/.*; data residual \([0-9.e-]*\) HU RMS; .*/\1/p' said) is=$(ct-metrics --consistency hard2.nii whole.nii | sed -n 's/^residual-rms-hu //p')
awk "BEGIN {exit !($was > .01 && ($was / $is - 1) ^ 2 < .01)}"; ok $? "nothing is raised, and the data residual is that of whole HU ($was, $is)"
ct-degrade -q -x 2 --decimate mean --sigma .8 ring.nii soft.nii && ct-sr -Q draft --report soft.html soft.nii soft/ 2>said && ct-convert -q soft softly.nii
was=$(sed -n 's/.*; data residual \([0-9.]*\) HU RMS; .*/\1/p' said) is=$(ct-metrics --consistency soft.nii softly.nii | sed -n 's/^residual-rms-hu //p')
awk "BEGIN {exit !($was > 1 && $was > .9 * $is && $was < 1.1 * $is)}"; ok $? "the data residual that ct-sr tells is that of the DICOM it wrote ($was, $is)"
grep -q "^ct-sr: DICOM: .* below the least of the scan, -1024 HU, and are raised to it: the data residual becomes $was HU RMS\$" said; ok $? 'ct-sr says that it raised what was below the scan'
grep -q '<li>The result does not agree with the scan: .* At 95 % of the voxels it is below [0-9.]* HU[.]</li>' soft.html; ok $? 'the page says how many voxels disagree with the scan'
grep -q '<li>ct-sr: soft/: of no patient' soft.html; ok $? 'a warning on the page keeps the name of a folder that ends in a slash'
by() { ct-sr -x 4 --paper --expert views=3,iterations=3,gaussians=50 "$@"; } # by ARGS...: by way of projections
exits 0 'ct-sr --paper --keep writes a DICOM folder' by -q --keep work template kept/
by -q template sr4/ 2>err
[ "$(sum kept)" = "$(sum sr4)" ]
ok $? 'ct-sr --paper writes the same DICOM with and without --keep'
exits 0 'ct-sr --paper refines DICOM into MetaImage' by -q template sr4.mha
head -c 10 sr4.mha | grep -q '^ObjectType'
ok $? 'an output named .mha is a MetaImage'
sh work/commands.sh 2>err
ok $? 'the script in the --keep folder runs'
[ "$(sum kept)" = "$(sum sr4)" ]
ok $? 'the script in the --keep folder writes the same DICOM'
exits 0 'ct-sr --keep runs again when all is done' by -v --keep work template kept/
has err '8 of 8 steps were done' 'ct-sr --keep reports that all steps were done'
rm kept/ctsr0003.dcm
exits 4 'ct-sr --keep writes over no folder in which a slice is missing' by -q --keep work template kept/
exits 0 'ct-sr --keep --force runs again when a slice is missing' by -q -f --keep work template kept/
[ "$(sum kept)" = "$(sum sr4)" ]
ok $? 'ct-sr --keep writes a missing slice again'
exits 0 'ct-sr --series refines one of two series' ct-sr -q -x 2 -Q draft --series 1.2.840.4711.3 two two-sr.dcm
py kept two-sr.dcm
ok $? 'a result of ct-sr --series belongs to that series'
exits 0 'a NIfTI result of ct-sr becomes DICOM with a template' sh -c 'ct-sr -q -x 2 -Q draft t.nii - | ct-convert --template two --series 1.2.840.4711.3 - templated/'
py kept templated
ok $? 'a NIfTI result with a template belongs to the study of the template'
exits 0 'ct-sr --deid refines a DICOM folder' ct-sr -q -x 2 -Q draft --deid template sr-deid/
py removed sr-deid
ok $? 'a result of ct-sr --deid identifies no patient'
exits 0 'ct-sr refines NIfTI into a DICOM folder' ct-sr -q -x 2 -Q draft t.nii of-nii/
exits 4 'ct-sr does not overwrite a DICOM folder' ct-sr -q -x 2 -Q draft template sr
exits 4 'an output folder that is the --keep folder is refused' by -q --keep both template both/
# what DICOM cannot hold is refused before the work
head -c 3456 /dev/zero | tr '\000' '\377' >hot.raw; ct-convert -q --units hu --raw 12x12x12:u16:2 --orient RAS hot.raw hot.nii
for o in '-Q draft' --paper; do
	exits 6 "ct-sr $o to DICOM refuses values beyond 16 bits before it begins" ct-sr -x 2 $o hot.nii hot/
	has err 'hot/: 65535 at voxel 0,0,0 does not fit the 16 bits of DICOM; NIfTI holds it' "the error of ct-sr $o names voxel and value"
done
mkdir -p alone; cp "$(command -v ct-sr)" alone; alone/ct-sr --dry-run -x 2 -Q draft t.nii alone/ 2>err; code=$?
if grep -q ctsr-dicom.so err; then [ $code -eq 1 ] && grep -q 'alone/: DICOM needs .*ctsr-dicom.so, which is not installed' err; ok $? 'ct-sr says before the work that the DICOM module is missing'; else skip 'ct-sr without the DICOM module' 'one is installed'; fi

# Sidecars of series: what is known of a volume, and where each plane comes from.
part origin
py make_sidecars
exits 0 'ct-convert --sidecar writes a sidecar of a series' ct-convert --sidecar even.json even even.nii
exits 0 'the sidecar of an even series gives the slice of each plane' py trace even even.nii even.json
has out '^9 9$' 'each plane of an even series comes from one slice'
for i in '"Manufacturer": "ACME Med"' '"KVP": 120' '"SliceThickness": 9' '"SpacingBetweenSlices": 2.5' \
	'"GantryDetectorTilt": 0' '"ReconstructionDiameter": 350' '"PatientPosition": "HFS"' '"Units": "HU"' \
	'"ManufacturersModelName": "CT-9"' '"SeriesNumber": 7'; do
	has even.json "$i" "the sidecar of an even series says $i"
done
tr -d ' \n' <even.json | grep -qF '"PixelSpacing":[0.75,0.5]'
ok $? 'the pixel spacing is that of rows, then of columns'
exits 0 'ct-convert --sidecar writes a sidecar of uneven slices' ct-convert --sidecar uneven.json uneven uneven.nii
exits 0 'the sidecar of uneven slices gives the two slices of each plane' py trace uneven uneven.nii uneven.json
grep -q '0\.[0-9]' uneven.json; ok $? 'the sidecar of uneven slices has weights between 0 and 1'
exits 0 'ct-convert --sidecar writes a sidecar of files named after a patient' ct-convert --sidecar named.json named named.nii
[ "$(grep -c InstanceNumber named.json)" -eq 9 ]; ok $? 'the sidecar numbers the slices of files named after a patient'
! grep -q '"File"' named.json; ok $? 'the sidecar does not name files that are named after a patient'
exits 0 'ct-sr --sidecar writes a sidecar of a refined series' ct-sr -q -Q draft -x 1,1,2 --sidecar thin.json named thin.nii
for i in '"Manufacturer": "ACME Med"' '"KVP": 120' '"Factor": "1,1,2"'; do
	has thin.json "$i" "the sidecar of thin slices says $i"
done
! grep -E 'SliceThickness|Spacing|ConvolutionKernel|ORIGINAL' thin.json
ok $? 'the sidecar of a refined series does not say how its slices were sampled'
exits 0 'ct-info -e accepts a refined series with its sidecar' ct-info -e thin.nii
! grep -q 'says the scanner' err
ok $? 'the sidecar of a refined series says nothing of the scanner'
exits 0 'ct-sr --deid --sidecar writes a sidecar of NIfTI' ct-sr -q -Q draft -x 1,1,2 --deid --sidecar hidden.json even.nii hidden/
! grep -q SourceFile hidden.json; ok $? 'the sidecar of ct-sr --deid names no source file'
exits 0 'ct-sr --deid --sidecar writes a sidecar of a series' ct-sr -q -Q draft -x 1,1,2 --deid --sidecar bare.json even bare/
grep -q '"Position"' bare.json && ! grep -q '"File"' bare.json
ok $? 'the sidecar of ct-sr --deid gives places of slices without file names'
exits 0 'ct-convert --deid --sidecar writes a sidecar of a series' ct-convert -q --deid --sidecar own.json even own/
exits 0 'ct-convert --deid --sidecar accepts --template' ct-convert -q --deid --template even --sidecar file.json even.nii file/
! grep -E 'SourceFile|"File"' own.json file.json; ok $? 'the sidecars of ct-convert --deid name no file'
for f in even uneven named thin hidden bare; do
	! grep -iE 'doering|jane|secret77|1960|2020|acc1|hosp|"op"|"s1"|ref"|1\.2\.[0-9]|synthetic' "$f.json"
	ok $? "$f.json holds nothing that identifies the patient"
done
if command -v dcm2niix >/dev/null; then
	dcm2niix -z n -f peer -o . even >/dev/null 2>&1
	exits 0 'the sidecar of a series agrees with that of dcm2niix' py peer even.json peer.json
	sed 's/^/# /' out
else
	skip 'the sidecar of a series agrees with that of dcm2niix' 'no dcm2niix'
fi
done_testing
