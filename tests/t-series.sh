#!/bin/sh
# Folders as clinics have them: what becomes of every file, and what is one series.
. "$srcdir/tests/tap.sh"
mkdir empty
ct-convert empty e.nii 2>err
if grep -q 'with-vtk' err; then skip 'series' 'built without vtk-dicom'; done_testing; fi
if ! python_with pydicom || ! "$PY" -c 'import nibabel'; then skip 'series' 'no pydicom or no nibabel'; done_testing; fi
py() { PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-series.py" "$@"; }
py make; ok $? 'series are made'
exits 0 'a series' ct-convert ok ok.nii
[ ! -s err ]; ok $? 'of which all files are used says nothing'
py check ok.nii; ok $? 'and every voxel is where it was'
ct-convert -qf ok ok.nii; ct-info ok.nii >info; has info '^quantity  *hu$' 'in HU'
exits 0 'with -v' ct-convert -fv ok ok.nii; has err 'ct-convert: 16 of 16 files used$' 'all are counted'

# damaged NAME STATUS WORDS: folder NAME, of which slice 05 is no slice
damaged() {
	exits 3 "$1: refused" ct-convert "$1" d.nii
	has err "$1/05.*$2" "which and why ($2)"; has err 'skip-damaged' 'and what to do'
	[ ! -e d.nii ]; ok $? 'no file is left'
	exits 5 'without it a slice is missing' ct-convert --skip-damaged "$1" d.nii
	has err '1 slice is missing: .*; ct-convert --gaps fill interpolates' 'which is an error'
	exits 0 'or filled' ct-convert -fv --skip-damaged --gaps fill "$1" d.nii
	has err 'skipped.*05.*\|05.*skipped' 'it is named'; has err '15 of 16 files used: 1 ' 'and counted'
	py check d.nii 16 0 5; ok $? 'the others are in place'
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
	exits 3 'a folder that is shut' ct-convert bad-folder d.nii; has err 'bad-folder/sub/: unreadable: Permission denied' 'says so'
	chmod 700 bad-folder/sub
else
	skip 'unreadable files' 'root reads all'
fi
if command -v gdcmconv >/dev/null; then
	mkdir bad-j2k
	for f in ok/*; do gdcmconv --j2k "$f" "bad-j2k/${f#ok/}" 2>/dev/null; done
	n=$(($(stat -c %s bad-j2k/05.dcm) - 60)) # the middle of the stream
	printf '\377\377\377\377\377\377\377\377' | dd of=bad-j2k/05.dcm bs=1 seek="$((n - 40))" conv=notrunc 2>/dev/null
	ct-convert bad-j2k d.nii 2>err; code=$?
	# a decoder may get something out of it, but then not zeros; this one gives up
	if [ "$code" -ne 0 ]; then damaged bad-j2k '05'; else skip 'a stream that is damaged' 'it decodes'; fi
	rm -f d.nii
fi

# what is not of the series
cp -r ok more; cp -r report more/sr; mkdir -p more/deep/er; printf '%%PDF-1.4 hello' >more/deep/er/letter.pdf
: >more/notes.txt; echo x >more/README; head -c -20 other/01.dcm >more/broken-other.dcm; ln -s .. more/deep/up
exits 0 'reports, letters and what is damaged of others' ct-convert more more.nii
has err 'warning: 16 of 21 files used: 2 not DICOM, 1 DICOM without a picture, 2 damaged$' 'are counted'
py check more.nii; ok $? 'and do no harm'
exits 0 'with -v' ct-convert -fv more more.nii
has err 'deep/er/letter.pdf: not used: not DICOM' 'they are listed'; has err 'broken-other.dcm: not used: damaged: truncated' 'with reasons'
cp -r other more/other
exits 5 'two series' ct-convert -f more d.nii; has err 'series 2: 3 CT 12x10' 'are listed'
exits 0 'one of them' ct-convert --series 1.2.1 more first.nii
has err '16 of 24 files used: .*3 of another series' 'leaves the other, and says so'; py check first.nii; ok $? 'it is that'
cp -r ok double; mkdir double/again; cp ok/0[0-4].dcm double/again
exits 0 'copies' ct-convert double double.nii; has err '16 of 21 files used: 5 repeated$' 'are dropped, and said'
py check double.nii; ok $? 'the rest is whole'

# what is one series
exits 0 'a localizer and a dose page under its UID' ct-convert mixed mixed.nii
has err '16 of 18 files used: 1 localizer, 1 screen capture or dose page$' 'are set aside by name'
py check mixed.nii; ok $? 'the series is whole'
exits 0 'exposure and acquisition of each slice' ct-convert exposure exposure.nii; [ ! -s err ]; ok $? 'do not divide it'
py check exposure.nii; ok $? 'it is whole'
exits 5 'two phases' ct-convert phases d.nii
has err "series 2: 16 CT 12x10 'phase' 1.2.5, AcquisitionNumber 3" 'are two series'
for k in 1 2; do
	exits 0 "phase $k" ct-convert --series $k phases p$k.nii; has err '16 of 32 files used: 16 of another series' 'is one of them'
done
exits 2 'their UID' ct-convert --series 1.2.5 phases d.nii; has err '2 series have this UID' 'is no name of one'
exits 5 'three turns' ct-convert times d.nii; has err 'series 3: .*AcquisitionTime from 44400$' 'are told apart by time'
for key in TemporalPositionIdentifier TemporalPositionIndex; do
	exits 5 "$key" ct-convert $key d.nii; has err 'series 2: 3 CT .*, TemporalPositionIdentifier 2$' 'tells two moments apart'
done
exits 0 'the third' ct-convert --series 3 times t3.nii
exits 5 'what nothing tells apart' ct-convert same d.nii; has err 'two slices at one place: same/0/00.dcm and same/1/00.dcm' 'is refused'
exits 5 'another matrix' ct-convert matrices d.nii; has err 'mixed: 2 series' 'is another series'
exits 0 'numbers that are left out' ct-convert numbers numbers.nii
has err 'InstanceNumber 7 is followed by 10 (numbers/07.dcm)' 'are told'
exits 0 'pictures that were announced' ct-convert announced announced.nii
has err 'ImagesInAcquisition is 20, but 16 slices are here' 'are told too'

# an oracle
if command -v dcm2niix >/dev/null; then
	exits 0 'constant slope' ct-convert phases/0 c.nii; dcm2niix -z n -f d2n -o . phases/0 >/dev/null 2>&1
	"$PY" -c 'import sys, nibabel as n, numpy as np
a, b = (n.as_closest_canonical(n.load(f)) for f in ("c.nii", "d2n.nii"))
sys.exit(not (np.array_equal(a.get_fdata(), b.get_fdata()) and np.abs(a.affine - b.affine).max() < 1e-4))'
	ok $? 'voxels and affine are those of dcm2niix'
else
	skip 'voxels and affine are those of dcm2niix' 'no dcm2niix'
fi

# files by name
exits 0 'files' ct-convert ok/*.dcm files.nii; py check files.nii; ok $? 'are taken as they are'
exits 0 'some of them' ct-convert ok/0[0-4].dcm some.nii; py check some.nii 5; ok $? 'and no others'
exits 0 'one of a series' ct-convert ok/03.dcm one.nii; py check one.nii; ok $? 'stands for it'
cp -r ok beside; for f in other/*; do cp "$f" "beside/x-${f#other/}"; done
hash_of() { ct-info "$1" | grep '^hash'; }
ct-convert -q other other.nii
exits 0 'one of another series' ct-convert beside//x-01.dcm slashes.nii
[ "$(hash_of slashes.nii)" = "$(hash_of other.nii)" ]; ok $? 'stands for that, whatever the slashes before it'
cp report/* beside; cp more/broken-other.dcm beside
for f in "$(basename report/*)" broken-other.dcm; do
	rm -f beside/x-*
	exits 3 "$f, beside a series" ct-convert "beside/$f" nothing.nii; has err "beside/$f: " 'does not stand for that'
	[ ! -e nothing.nii ]; ok $? 'nothing is written'
done
exits 3 'one that is damaged' ct-convert bad-pixels/05.dcm d.nii; has err 'truncated.*skip-damaged' 'stands for its own series'
exits 3 'one that is not there' ct-convert ok/01.dcm none.dcm d.nii; has err 'none.dcm: No such file' 'is named'
exits 2 'files of other formats' ct-convert ok.nii more.nii d.nii; has err 'only of DICOM several files make a volume' 'are not joined'
exits 2 'no OUT' ct-convert ok; has err 'missing OUT' 'says so'
done_testing
