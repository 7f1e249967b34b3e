#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Folders as clinics have them: what becomes of every file, and what is one series.
. "$srcdir/tests/tap.sh"
mkdir empty
ct-convert empty e.nii 2>err
if grep -q 'with-vtk' err; then skip 'series' 'built without vtk-dicom'; done_testing; fi
if ! python_with pydicom || ! "$PY" -c 'import nibabel'; then skip 'series' 'no pydicom or no nibabel'; done_testing; fi
py() { PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-series.py" "$@"; }
py make; ok $? 'the series of this test are made'
exits 0 'a complete series is converted' ct-convert ok ok.nii
[ ! -s err ]; ok $? 'a complete series gives no message'
py check ok.nii; ok $? 'a complete series has every voxel where it was'
ct-convert -qf ok ok.nii
ct-info ok.nii >info
has info '^quantity  *hu$' 'a converted series records the quantity hu'
exits 0 'a complete series is converted with -v' ct-convert -fv ok ok.nii
has err 'ct-convert: 16 of 16 files used$' 'ct-convert -v counts the files of a series'

# damaged NAME STATUS WORDS: folder NAME, of which slice 05 is no slice
damaged() {
	exits 3 "$1: a damaged slice is refused with status 3" ct-convert "$1" d.nii
	has err "$1/05.*$2" "$1: the error names the slice and the reason ($2)"
	has err 'skip-damaged' "$1: the error names --skip-damaged"
	[ ! -e d.nii ]; ok $? "$1: a damaged slice leaves no volume"
	exits 5 "$1: --skip-damaged alone is refused as a slice is missing" ct-convert --skip-damaged "$1" d.nii
	has err '1 slice is missing: .*; ct-convert --gaps fill interpolates' "$1: the error of a missing slice names --gaps fill"
	exits 0 "$1: --skip-damaged with --gaps fill converts the series" ct-convert -fv --skip-damaged --gaps fill "$1" d.nii
	has err 'skipped.*05.*\|05.*skipped' "$1: the slice that is skipped is named"
	has err '15 of 16 files used: 1 ' "$1: the files that are used are counted"
	py check d.nii 16 0 5; ok $? "$1: the other slices keep their places"
	rm -f d.nii
}
for c in empty cut100 cut300 pixels dangling text loop kills; do cp -r ok "bad-$c"; done
: >bad-empty/05.dcm; damaged bad-empty 'damaged: it is empty'
head -c 100 ok/05.dcm >bad-cut100/05.dcm; damaged bad-cut100 'damaged: it holds zeros'
head -c 300 ok/05.dcm >bad-cut300/05.dcm; damaged bad-cut300 'damaged: '
head -c -20 ok/05.dcm >bad-pixels/05.dcm; damaged bad-pixels 'damaged: truncated'
ln -sf nowhere bad-dangling/05.dcm; damaged bad-dangling 'unreadable: No such file'
ln -sf 05.dcm bad-loop/05.dcm; damaged bad-loop 'unreadable: Too many levels'
echo hello >bad-text/05.dcm; damaged bad-text 'not DICOM'
tar -xOf "$srcdir/tests/fuzz/corpus/dicom.tar" found-length >bad-kills/05.dcm; damaged bad-kills 'damaged: ' # an assertion of the parser
if [ "$(id -u)" -ne 0 ]; then
	cp -r ok bad-mode; chmod 000 bad-mode/05.dcm; damaged bad-mode 'unreadable: Permission denied'
	cp -r ok bad-folder; mkdir bad-folder/sub; chmod 000 bad-folder/sub
	exits 3 'a folder without permission to read is refused with status 3' ct-convert bad-folder d.nii
	has err 'bad-folder/sub/: unreadable: Permission denied' 'the error of a folder without permission names it'
	chmod 700 bad-folder/sub
else
	skip 'a file without permission to read is refused' 'root reads all'
fi
if command -v gdcmconv >/dev/null; then
	mkdir bad-j2k
	for f in ok/*; do gdcmconv --j2k "$f" "bad-j2k/${f#ok/}" 2>/dev/null; done
	n=$(($(stat -c %s bad-j2k/05.dcm) - 60)) # the middle of the stream
	printf '\377\377\377\377\377\377\377\377' | dd of=bad-j2k/05.dcm bs=1 seek="$((n - 40))" conv=notrunc 2>/dev/null
	ct-convert bad-j2k d.nii 2>err; code=$?
	# a decoder may get something out of it, but then not zeros; this one gives up
	if [ "$code" -ne 0 ]; then damaged bad-j2k '05'; else skip 'a damaged slice of JPEG 2000 is refused' 'it decodes'; fi
	rm -f d.nii
fi

# what is not of the series
cp -r ok more; cp -r report more/sr; mkdir -p more/deep/er; printf '%%PDF-1.4 hello' >more/deep/er/letter.pdf
: >more/notes.txt; echo x >more/README; head -c -20 other/01.dcm >more/broken-other.dcm; ln -s .. more/deep/up
exits 0 'reports, letters and damaged files of others do not stop a series' ct-convert more more.nii
has err 'warning: 16 of 21 files used: 2 not DICOM, 1 DICOM without a picture, 2 damaged$' 'files that are not used are counted by kind'
py check more.nii; ok $? 'files that are not used do not change the voxels'
exits 0 'ct-convert -v converts a series beside other files' ct-convert -fv more more.nii
has err 'deep/er/letter.pdf: not used: not DICOM' 'ct-convert -v lists each file that is not used'
has err 'broken-other.dcm: not used: damaged: truncated' 'ct-convert -v gives the reason for each file that is not used'
cp -r other more/other
exits 5 'two series in one folder are refused with status 5' ct-convert -f more d.nii
has err 'series 2: 3 CT 12x10' 'the error of two series in one folder lists them'
exits 0 '--series converts one of two series' ct-convert --series 1.2.1 more first.nii
has err '16 of 24 files used: .*3 of another series' '--series reports the files of the other series'
py check first.nii
ok $? '--series gives the voxels of that series'
cp -r ok double; mkdir double/again; cp ok/0[0-4].dcm double/again
exits 0 'a series with copies of its slices is converted' ct-convert double double.nii
has err '16 of 21 files used: 5 repeated$' 'copies of slices are counted as repeated'
py check double.nii; ok $? 'copies of slices do not change the voxels'

# what is one series
exits 0 'a series with a localizer and a dose page is converted' ct-convert mixed mixed.nii
has err '16 of 18 files used: 1 localizer, 1 screen capture or dose page$' 'a localizer and a dose page are counted by kind'
py check mixed.nii; ok $? 'a localizer and a dose page do not change the voxels'
exits 0 'a series whose exposure differs between slices is converted' ct-convert exposure exposure.nii
[ ! -s err ]
ok $? 'exposure that differs between slices gives no message'
py check exposure.nii; ok $? 'exposure that differs between slices does not divide a series'
exits 5 'two phases in one folder are refused with status 5' ct-convert phases d.nii
has err "series 2: 16 CT 12x10 'phase' 1.2.5, AcquisitionNumber 3" 'the error of two phases lists each with its acquisition'
for k in 1 2; do
	exits 0 "--series $k converts that phase" ct-convert --series $k phases p$k.nii
	has err '16 of 32 files used: 16 of another series' "--series $k reports the files of the other phase"
done
exits 2 'a UID that two phases share is refused with status 2' ct-convert --series 1.2.5 phases d.nii
has err '2 series have this UID' 'the error of a UID that two phases share says so'
exits 5 'three scans at one place are refused with status 5' ct-convert times d.nii
has err 'series 3: .*AcquisitionTime from 44400$' 'the error of three scans lists each with its time'
exits 5 'two scans in one second are refused with status 5' ct-convert zones d.nii
has err 'series 1: .*AcquisitionTime 43227.25$' 'the error of two scans in one second lists a part of a second'
has err 'series 2: .*AcquisitionTime 43227.75$' 'a time of day is listed without its zone'
for key in TemporalPositionIdentifier TemporalPositionIndex; do
	exits 5 "two moments by $key are refused with status 5" ct-convert $key d.nii
	has err 'series 2: 3 CT .*, TemporalPositionIdentifier 2$' "the error of two moments by $key lists each"
done
exits 0 '--series 3 converts the third of three scans' ct-convert --series 3 times t3.nii
exits 5 'two slices at one place are refused with status 5' ct-convert same d.nii
has err 'two slices at one place: same/0/00.dcm and same/1/00.dcm' 'the error of two slices at one place names both files'
exits 5 'slices of two sizes in one folder are refused with status 5' ct-convert matrices d.nii
has err 'mixed: 2 series' 'the error of slices of two sizes counts two series'
exits 0 'a series whose instance numbers have a gap is converted' ct-convert numbers numbers.nii
has err 'InstanceNumber 7 is followed by 10 (numbers/07.dcm)' 'a gap in the instance numbers is reported'
exits 0 'a series with fewer slices than its header states is converted' ct-convert announced announced.nii
has err 'ImagesInAcquisition is 20, but 16 slices are here' 'fewer slices than the header states are reported'

# an oracle
if command -v dcm2niix >/dev/null; then
	exits 0 'a series of constant slope is converted' ct-convert phases/0 c.nii
	dcm2niix -z n -f d2n -o . phases/0 >/dev/null 2>&1
	"$PY" -c 'import sys, nibabel as n, numpy as np
a, b = (n.as_closest_canonical(n.load(f)) for f in ("c.nii", "d2n.nii"))
sys.exit(not (np.array_equal(a.get_fdata(), b.get_fdata()) and np.abs(a.affine - b.affine).max() < 1e-4))'
	ok $? 'voxels and affine are those of dcm2niix'
else
	skip 'voxels and affine are those of dcm2niix' 'no dcm2niix'
fi

# files by name
exits 0 'files of a series are converted by their names' ct-convert ok/*.dcm files.nii
py check files.nii
ok $? 'files by their names give the voxels of the series'
exits 0 'five files of a series are converted by their names' ct-convert ok/0[0-4].dcm some.nii
py check some.nii 5
ok $? 'five files by their names give five slices'
exits 0 'one file of a series is converted by its name' ct-convert ok/03.dcm one.nii
py check one.nii
ok $? 'one file of a series stands for all of it'
cp -r ok beside; for f in other/*; do cp "$f" "beside/x-${f#other/}"; done
hash_of() { ct-info "$1" | grep '^hash'; }
ct-convert -q other other.nii
exits 0 'one file of another series beside it is converted' ct-convert beside//x-01.dcm slashes.nii
[ "$(hash_of slashes.nii)" = "$(hash_of other.nii)" ]; ok $? 'one file stands for its own series, whatever its slashes'
cp report/* beside; cp more/broken-other.dcm beside
for f in "$(basename report/*)" broken-other.dcm; do
	rm -f beside/x-*
	exits 3 "$f beside a series is refused with status 3" ct-convert "beside/$f" nothing.nii
	has err "beside/$f: " "the error of $f beside a series names that file"
	[ ! -e nothing.nii ]; ok $? "$f beside a series leaves no volume"
done
exits 3 'one damaged file of a series is refused with status 3' ct-convert bad-pixels/05.dcm d.nii
has err 'truncated.*skip-damaged' 'the error of one damaged file names --skip-damaged'
exits 3 'a file that does not exist among others is refused' ct-convert ok/01.dcm none.dcm d.nii
has err 'none.dcm: No such file' 'the error of a file that does not exist names it'
exits 2 'two NIfTI files as inputs are refused with status 2' ct-convert ok.nii more.nii d.nii
has err 'only of DICOM several files make a volume' 'the error of two NIfTI inputs says that only DICOM is joined'
exits 2 'a series without an output is refused with status 2' ct-convert ok
has err 'missing OUT' 'the error of a missing output says OUT'
done_testing
