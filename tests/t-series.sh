#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Series of DICOM: folders as clinics have them, the ways in which one series comes, what others read of it, stacks
# that are no grid, and real ones (CTSR_DICOM).
. "$srcdir/tests/tap.sh"
mkdir empty
ct-convert empty e.nii 2>err
if grep -q 'with-vtk' err; then skip 'series' 'built without vtk-dicom'; done_testing; fi
if ! python_with pydicom || ! "$PY" -c 'import nibabel'; then skip 'series' 'no pydicom or no nibabel'; done_testing; fi
calls numpy nibabel pydicom dicom
py() { called "$srcdir/tests/t-series.py" "$@"; }

# Folders as clinics have them: what becomes of every file, and what is one series.
py make_folders; ok $? 'the series of this test are made'
exits 0 'a complete series is converted' ct-convert ok ok.nii
[ ! -s err ]; ok $? 'a complete series gives no message'
py check_folder ok.nii; ok $? 'a complete series has every voxel where it was'
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
	py check_folder d.nii 16 0 5; ok $? "$1: the other slices keep their places"
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
py check_folder more.nii; ok $? 'files that are not used do not change the voxels'
exits 0 'ct-convert -v converts a series beside other files' ct-convert -fv more more.nii
has err 'deep/er/letter.pdf: not used: not DICOM' 'ct-convert -v lists each file that is not used'
has err 'broken-other.dcm: not used: damaged: truncated' 'ct-convert -v gives the reason for each file that is not used'
cp -r other more/other
exits 5 'two series in one folder are refused with status 5' ct-convert -f more d.nii
has err 'series 2: 3 CT 12x10' 'the error of two series in one folder lists them'
exits 0 '--series converts one of two series' ct-convert --series 1.2.1 more first.nii
has err '16 of 24 files used: .*3 of another series' '--series reports the files of the other series'
py check_folder first.nii
ok $? '--series gives the voxels of that series'
cp -r ok double; mkdir double/again; cp ok/0[0-4].dcm double/again
exits 0 'a series with copies of its slices is converted' ct-convert double double.nii
has err '16 of 21 files used: 5 repeated$' 'copies of slices are counted as repeated'
py check_folder double.nii; ok $? 'copies of slices do not change the voxels'

# what is one series
exits 0 'a series with a localizer and a dose page is converted' ct-convert mixed mixed.nii
has err '16 of 18 files used: 1 localizer, 1 screen capture or dose page$' 'a localizer and a dose page are counted by kind'
py check_folder mixed.nii; ok $? 'a localizer and a dose page do not change the voxels'
exits 0 'a series whose exposure differs between slices is converted' ct-convert exposure exposure.nii
[ ! -s err ]
ok $? 'exposure that differs between slices gives no message'
py check_folder exposure.nii; ok $? 'exposure that differs between slices does not divide a series'
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
py check_folder files.nii
ok $? 'files by their names give the voxels of the series'
exits 0 'five files of a series are converted by their names' ct-convert ok/0[0-4].dcm some.nii
py check_folder some.nii 5
ok $? 'five files by their names give five slices'
exits 0 'one file of a series is converted by its name' ct-convert ok/03.dcm one.nii
py check_folder one.nii
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
exits 0 'a series is read beside a file that is no DICOM' ct-convert -f ok ok.nii d.nii; rm -f d.nii
has err 'warning: .* files used: 1 not DICOM$' 'a file that was named and has no picture is warned of'
exits 2 'a series without an output is refused with status 2' ct-convert ok
has err 'missing OUT' 'the error of a missing output says OUT'

# Ways in which one series comes: without preamble, multi-frame, deflated, big-endian, in archives, by DICOMDIR.
part ways
py make_ways; ok $? 'a series is made in many ways'
exits 0 'a plain series is converted' ct-convert s s.nii
same() { # same NAME IN... : what IN is, is the same volume
	name=$1; shift
	exits 0 "a series is converted: $name" ct-convert -f "$@" o.nii
	[ ! -s err ]
	ok $? "no file of a series gives a message: $name"
	py same_way s.nii o.nii; ok $? "the voxels are those of the plain series: $name"
}
same 'files without preamble' headless
same 'one file without preamble for its series' headless/IM03
same 'one file of many frames in no order' enhanced
same 'one file of many frames by its name' enhanced/e.dcm
if command -v gdcmconv >/dev/null; then
	for way in rle jpeg jpegls j2k; do
		mkdir e-$way; gdcmconv --$way enhanced/e.dcm e-$way/e.dcm 2>/dev/null
		same "many frames compressed by $way" e-$way
	done
else
	skip 'many frames compressed by JPEG and RLE' 'no gdcmconv'
fi
if command -v dcmconv >/dev/null; then
	mkdir deflated big baseline
	for f in s/*; do dcmconv +td "$f" "deflated/${f#s/}"; dcmconv +tb "$f" "big/${f#s/}"; dcmcjpeg +e1 "$f" "baseline/${f#s/}"; done
	same 'deflated data sets' deflated
	same 'big-endian data sets' big
	same 'lossless JPEG of dcmtk' baseline
	head -c -9 deflated/03.dcm >short; mv short deflated/03.dcm
	exits 3 'a deflated file that is cut off is refused with status 3' ct-convert deflated d.nii
	has err 'deflated/03.dcm: damaged' 'the error of a deflated file that is cut off names it'
else
	skip 'deflated and big-endian data sets' 'no dcmtk'
fi
# archives
mkdir tree; cp -r s tree/scan; echo hello >tree/notes.txt
tar -cf a.tar tree; tar -czf a.tar.gz tree; gzip -kr s; mkdir z; mv s/*.gz z
ct-convert -f a.tar o.nii 2>err
if grep -q 'not DICOM' err && ! grep -q used err; then
	skip 'archives are unpacked' 'built without libarchive'
else
	for a in a.tar a.tar.gz; do
		exits 0 "a series in $a is converted" ct-convert -fv $a o.nii
		has err '9 of 10 files used: 1 not DICOM$' "of $a nine files are used and one is not DICOM"
		! grep -q warning err
		ok $? "a text file in $a gives no warning"
		py same_way s.nii o.nii; ok $? "the voxels of $a are those of the plain series"
	done
	exits 0 'a series in an archive is converted again with -v' ct-convert -fv a.tar o.nii
	has err 'a.tar/tree/notes.txt: not used: not DICOM' 'a file in an archive is named by its path in it'
	same 'slices compressed by gzip one by one' z
	same 'slices compressed by gzip, by their names' z/*.gz
	if "$PY" -c 'import zipfile' 2>/dev/null; then
		"$PY" -m zipfile -c a.zip tree/;
		exits 0 'a series in a zip archive is converted' ct-convert -fv a.zip o.nii
		has err '9 of 10 files used' 'nine of ten files of a zip archive are used'
		py same_way s.nii o.nii; ok $? 'the voxels of a zip archive are those of the plain series'
	fi
	: >tree/scan/04.dcm; tar -cf bad.tar tree
	exits 3 'an archive with an empty slice is refused with status 3' ct-convert bad.tar d.nii
	has err 'bad.tar/tree/scan/04.dcm: damaged: it is empty' 'the error of an empty slice names it in its archive'
	head -c 20000 a.tar >cut.tar
	exits 3 'an archive that is cut off is refused with status 3' ct-convert cut.tar d.nii
	has err 'cut.tar.*: damaged: ' 'the error of an archive that is cut off names it'
	head -c 300 z/04.dcm.gz >cut.gz; mv cut.gz z/04.dcm.gz
	exits 3 'a slice in gzip that is cut off is refused with status 3' ct-convert z d.nii
	has err 'z/04.dcm.gz: damaged' 'the error of a slice in gzip that is cut off names it'
	printf 'PK\3\4 no zip' >no.zip
	exits 3 'a file that only looks like zip is refused with status 3' ct-convert no.zip d.nii
	has err 'no.zip' 'the error of a file that only looks like zip names it'
	mkdir tmp; TMPDIR=$PWD/tmp exits 0 'an archive is unpacked in TMPDIR' ct-convert -f a.tar o.nii
	[ -z "$(ls -A tmp)" ]; ok $? 'no file is left in TMPDIR'
	TMPDIR='' exits 0 'an empty TMPDIR counts as none' ct-convert -f a.tar o.nii
	TMPDIR=$PWD/none ct-convert -f a.tar d.nii 2>err
	[ $? -eq 7 ] && grep -q '^ct-convert: a.tar: no TMPDIR to unpack in' err
	ok $? 'a TMPDIR that does not exist is status 7, and no damage of the archive'
	"$PY" -c 'import gzip, sys
with open("s/03.dcm", "rb") as f, gzip.open("bomb.gz", "wb", 1) as to:
    to.write(f.read(300))
    for _ in range(1030): to.write(bytes(1 << 20))'
	exits 3 'a gzip file of a gigabyte of zeros is refused with status 3' ct-convert bomb.gz d.nii
	has err 'compressed bytes become .*times as many (--expand)' 'the error of a gigabyte of zeros names --expand'
	exits 3 'a gigabyte of zeros is refused with --expand 0 too' ct-convert --expand 0 bomb.gz d.nii
	! grep -q expand err
	ok $? 'with --expand 0 the error of a gigabyte of zeros is another'
fi
exits 0 'NIfTI in gzip is converted as a volume' sh -c 'ct-convert s.nii s.nii.gz && ct-convert -f s.nii.gz o.nii'
# what lies beside a series
mkdir mac; cp s/* mac/; for f in s/*; do printf '\000\005\026\007\000\002\000\000Mac OS X        ' >"mac/._${f#s/}"; done
exits 0 'a series with files of macOS beside it is converted' ct-convert mac mac.nii
py same_way s.nii mac.nii
ok $? 'files of macOS do not change the voxels'
ct-info mac >out; has out "not DICOM" 'files of macOS are counted as not DICOM'
rm mac/._*; f=$(ls mac | head -n 1); mkdir mac/below; head -c 900 "mac/$f" >"mac/below/x${f#${f%.*}}"
exits 3 'a folder with a damaged file in a folder below is refused' ct-convert -f mac mac.nii
exits 2 'an output without slash and suffix is refused for a series' ct-convert s hr
has err '^ct-convert: hr: hr/ is a series of DICOM, hr.nii.gz a volume: which?' 'the error of an output without slash names both choices'
exits 0 'a file of a series is converted as its series' ct-convert -f "mac/$f" mac.nii
py same_way s.nii mac.nii
ok $? 'a file of a series stands for all files beside it'
printf 'II*\000' | dd of="mac/$f" conv=notrunc 2>/dev/null; cp "mac/$f" tiff.dcm
exits 0 'a file whose preamble looks like TIFF is converted' ct-convert -f "mac/$f" mac.nii
py same_way s.nii mac.nii
ok $? 'a preamble that looks like TIFF does not change the voxels'

# DICOMDIR
if command -v dcmmkdir >/dev/null; then
	mkdir disc; n=0; for f in s/*.dcm; do n=$((n + 1)); cp "$f" disc/IM$n; done
	(cd disc && dcmmkdir +r -I -Nxc IM* >/dev/null 2>&1)
	if [ -f disc/DICOMDIR ]; then
		exits 0 'a DICOMDIR is converted as a series' ct-convert -fv disc/DICOMDIR o.nii
		py same_way s.nii o.nii
		ok $? 'the voxels of a DICOMDIR are those of the plain series'
		has err '9 of 10 files used: 1 DICOM without a picture' 'the DICOMDIR is counted as DICOM without a picture'
		mkdir -p exp/SER exp/TWO; mv disc/IM1 exp/TWO; cp disc/IM* exp/SER; cp exp/TWO/IM1 disc
		(cd exp && dcmmkdir +r -I -Nxc SER/IM* TWO/IM1 >/dev/null 2>&1 && mv DICOMDIR SER/DIRFILE && cp TWO/IM1 SER/IM0)
		exits 0 'a directory that names files from a folder above is converted' ct-convert -f exp/SER o.nii
		py same_way s.nii o.nii
		ok $? 'a directory that names files from a folder above gives the plain series'
		rm -r exp/TWO
		exits 3 'a directory that lists a file which exists nowhere is refused' ct-convert exp/SER d.nii
		has err 'IM1: unreadable: listed in exp/SER/DIRFILE, but not there' 'the error of a directory names the file that is missing'
		mv exp/SER/IM0 exp/SER/IM1
		mv exp/SER copied
		exits 0 'a directory copied without its root folder is converted' ct-convert -f copied o.nii
		py same_way s.nii o.nii
		ok $? 'a directory copied without its root folder gives the plain series'
		rm disc/IM4
		exits 3 'a DICOMDIR that lists a missing file is refused with status 3' ct-convert disc d.nii
		has err 'disc/IM4: unreadable: listed in disc/DICOMDIR, but not there' 'the error of a DICOMDIR names the file that is missing'
	else
		skip 'a DICOMDIR is converted as a series' 'dcmmkdir made none'
	fi
else
	skip 'a DICOMDIR is converted as a series' 'no dcmtk'
fi
[ ! -e d.nii ]; ok $? 'refused series leave no volume'

# Clean series in many orientations and encodings: voxel for voxel and place for place what pydicom and dcm2niix read.
part peers
# agree WORD NAME PAIR...: a line for each pair
agree() {
	how=$1 name=$2; shift 2
	py pairs "$how" "$@" >log 2>&1; ok $? "$name"; sed 's/^/# /' log
}
mkdir s && cd s && py make_peers; ok $? 'series to compare with others are made'
all=$(ls); cd ..
pairs=
for s in $all; do
	exits 0 "the series $s is converted" ct-convert s/$s $s.nii
	[ ! -s err ]
	ok $? "the series $s gives no message"
	pairs="$pairs $s.nii s/$s"
done
agree check_peer 'every voxel is what pydicom reads, where the header puts it' $pairs
if command -v dcm2niix >/dev/null; then
	pairs=
	for s in $all; do
		case $s in s12*) continue ;; esac # it takes 12 bits with a sign for positive ones
		dcm2niix -z n -f d-$s -o . s/$s >/dev/null 2>&1
		pairs="$pairs $s.nii d-$s.nii"
	done
	agree same_peer 'voxels and places are those of dcm2niix' $pairs
else
	skip 'voxels and places are those of dcm2niix' 'no dcm2niix'
fi
# what comes with pydicom: a series, one that lacks slices, localizers
data=$("$PY" -c 'import os, pydicom.data; print(os.path.join(os.path.dirname(pydicom.data.__file__), "test_files", "dicomdirtests"))' 2>/dev/null)
if [ -d "$data/98892001" ] && command -v dcm2niix >/dev/null; then
	exits 0 'a series of the package pydicom is converted' ct-convert "$data/98892001/CT5N" ct5n.nii
	dcm2niix -z n -f d-ct5n -o . "$data/98892001/CT5N" >/dev/null 2>&1
	agree same_peer 'a series of the package pydicom has the voxels of dcm2niix' ct5n.nii d-ct5n.nii
	exits 5 'a series of the package pydicom that lacks slices is refused' ct-convert "$data/77654033/CT2" no.nii
	has err '161 slices are missing' 'the error of a series that lacks slices counts them'
	exits 3 'localizers of the package pydicom are refused with status 3' ct-convert "$data/98892001/CT2N" no.nii
	has err 'no series of CT slices among 2: localizer' 'the error of localizers says that they are no CT slices'
else
	skip 'a series of the package pydicom has the voxels of dcm2niix' 'they are not here, or no dcm2niix'
fi
# recoded BY SERIES...: by the command BY, from file to file, each is the same volume
recoded() {
	by=$1 pairs=; shift
	if ! command -v ${by%% *} >/dev/null; then skip "series recoded by $by keep their voxels" "no ${by%% *}"; return; fi
	for s in "$@"; do
		rm -rf c; mkdir c
		for f in s/$s/*; do $by "$f" "c/${f##*/}" 2>>log; done
		exits 0 "the series $s recoded by $by is converted" ct-convert -f c c-$s.nii
		pairs="$pairs $s.nii c-$s.nii"
	done
	agree same_peer "series recoded by $by keep their voxels" $pairs
}
for way in rle jpeg jpegls j2k; do recoded "gdcmconv --$way" axial u12 s12 s12-bare u8 each; done
recoded 'dcmcjpeg +e1' axial u12 s12 u8
recoded 'dcmcjpls' axial u16
for way in +td +tb +ti; do recoded "dcmconv $way" axial u12 s12-overlay each; done

# DICOM stacks that are no grid: tilted gantries, uneven and missing slices.
part tilt
py make_stacks; ok $? 'series that are no grid are made'
size() { ct-info "$1" >info; grep -q "^size  *$2\$" info; ok $? "the size of $1 is $2"; sed -n 's/^size/# &/p' info; }
# 20 degrees over 8 x 2.5 mm: 6.84 mm, of 0.75: 9.12 rows
for s in axial sagittal oblique; do
	exits 0 "a tilted $s series is read" ct-convert lean-$s $s.nii
	has err 'tilted by 20.00 degrees: slices are moved in their planes, 6.84 mm over 18.79 mm' "the tilt of the $s series is reported in degrees"
	size $s.nii '12 20 9'; py check_stack $s.nii 0.5; ok $? "every voxel of the tilted $s series keeps its place"
done
exits 0 'a series tilted the other way, askew, is read' ct-convert back back.nii; size back.nii '19 20 9'
py check_stack back.nii 0.316; ok $? 'every voxel of a series tilted backwards keeps its place'
exits 0 'a series of uneven gaps is read' ct-convert uneven uneven.nii
has err 'gaps run from 2 to 5 mm: 9 slices are resampled to 14 planes, 1.92308 mm apart' 'the range of uneven gaps is reported in mm'
size uneven.nii '12 10 14'; py check_stack uneven.nii 1; ok $? 'every voxel of an uneven series keeps its place'
exits 0 'a tilted and uneven series is read' ct-convert both both.nii
py check_stack both.nii 0.206; ok $? 'every voxel of a tilted and uneven series keeps its place'
exits 0 'a series tilted along a bow is read' ct-convert bent bent.nii; py check_stack bent.nii 0.526; ok $? 'every voxel of a series along a bow keeps its place'
exits 5 'an absurdly tilted series is refused with status 5' ct-convert far d.nii; has err 'drift sideways by 320 mm' 'the error of an absurd tilt names the drift'
for how in rectify shear error; do
	exits 5 "a tilt of 46 degrees is refused with --tilt $how" ct-convert --tilt $how steep d.nii
	has err 'steep/00.dcm: slices drift .* (46.0 degrees), and no gantry tilts by more than 45' "the error of --tilt $how says that no gantry tilts by 46 degrees"
done
exits 0 'a series tilted by 44 degrees is read' ct-convert most most.nii; has err 'tilted by 44.00 degrees' 'a tilt of 44 degrees is reported'
for g in resample error; do
	exits 5 "missing slices are refused with --gaps $g" ct-convert --gaps $g missing d.nii
	has err '3 slices are missing: spacing is 2.5 mm, but 5 mm between missing/06.dcm and missing/02.dcm' "the error of --gaps $g names the files beside the gap"
done
exits 0 'missing slices are interpolated with --gaps fill' ct-convert --gaps fill missing filled.nii
has err 'gap: 1 missing between 37.25,-28.375,137.5 and 37.25,-28.375,142.5 mm, interpolated' '--gaps fill reports the first gap'
has err 'gap: 2 missing between .*,147.5 and .*,155 mm' '--gaps fill reports the second gap'
size filled.nii '12 10 12'; py check_stack filled.nii 1; ok $? 'every voxel of a filled series keeps its place'
has info '^  filled  *37.25,-28.375,137.5:37.25,-28.375,142.5 37.25,' 'the file notes which slices were filled'
exits 0 'missing slices of a tilted series are interpolated' ct-convert --gaps fill leanmissing lean.nii; size lean.nii '12 21 10'
py check_stack lean.nii 0.462; ok $? 'every voxel of a tilted and filled series keeps its place'
# other readers: nifti_tool, and plastimatch, which is built on ITK
for s in axial sagittal oblique uneven both; do
	if command -v nifti_tool >/dev/null; then
		nifti_tool -check_hdr -check_nim -infiles $s.nii >check 2>&1
		[ "$(grep -c 'IS GOOD' check)" -eq 2 ]; ok $? "$s: nifti_tool finds no fault"
	else
		skip "$s: nifti_tool finds no fault" 'no nifti_tool'
	fi
	if command -v plastimatch >/dev/null; then
		plastimatch convert --input $s.nii --output-img $s.mha --output-type float >/dev/null 2>&1
		py itk $s.nii $s.mha; ok $? "$s: ITK reads the same voxels at the same places"
	else
		skip "$s: ITK reads the same voxels at the same places" 'no plastimatch'
	fi
done
exits 5 'a tilted series is refused with --tilt error' ct-convert --tilt error lean-axial d.nii; has err 'tilted gantry.* (20.0 degrees)' 'the error of --tilt error names the angle'
exits 5 'an uneven series is refused with --gaps error' ct-convert --gaps error uneven d.nii; has err 'uneven slices: gaps run from 2 to 5 mm' 'the error of --gaps error names the gaps'
exits 0 'a tilted series becomes sheared with --tilt shear' ct-convert --tilt shear lean-axial shear.nii; has err 'tilted by 20.00 degrees: the affine is sheared' '--tilt shear reports that the affine is sheared'
py sheared shear.nii; ok $? 'voxels and places of --tilt shear are those of the slices'
exits 5 'ct-upsample refuses a sheared volume' ct-upsample -x 2 shear.nii d.nii
exits 5 'a tilted series with --tilt shear is not written as DICOM' ct-convert --tilt shear lean-axial sheared/
has err '^ct-convert: lean-axial: tilted: .*; --tilt rectify resamples them$' 'which says that --tilt rectify resamples it'
for s in both bent; do exits 5 "--tilt shear refuses the series $s" ct-convert --tilt shear $s d.nii; has err 'no sheared grid' "the error of $s with --tilt shear says no sheared grid"; done
[ ! -e d.nii ]; ok $? 'series that were refused leave no file'
for t in 1 3; do ct-convert -qf -t $t --gaps fill leanmissing t$t.nii; done
tail -c +3000 t1.nii >t1; tail -c +3000 t3.nii >t3; cmp -s t1 t3; ok $? 'the same bytes for any number of threads'

# Real series, which are not in this package: CTSR_DICOM is a folder of them. doc/dicom.md says which and where from.
part real
if [ ! -d "${CTSR_DICOM-}" ]; then skip 'real series' 'CTSR_DICOM is no folder of them'; done_testing; fi
case $CTSR_DICOM in /*) ;; *) echo 'Bail out! CTSR_DICOM is no absolute path'; exit 99 ;; esac
"$PY" -c 'import scipy' || { skip 'real series' 'no scipy'; done_testing; }
logged() { py "$@" >log 2>&1; got_=$?; sed 's/^/# /' log; return $got_; }
# series NAME: is it there?
series() { [ -d "$CTSR_DICOM/$1" ] || { skip "$1" 'not there'; return 1; }; }

if series head_ge_tilt_varspacing; then
	exits 0 'a tilted series of uneven spacing is converted' ct-convert "$CTSR_DICOM/head_ge_tilt_varspacing" tilt.nii
	has err 'tilted by 18.50 degrees: slices are moved in their planes, 48.21 mm over 144.1 mm$' 'the tilt of a series is reported with its angle'
	has err 'gaps run from 1.081 to 6.999 mm: 28 slices are resampled to 37 planes' 'the uneven spacing of a series is reported'
	logged places tilt.nii "$CTSR_DICOM/head_ge_tilt_varspacing"; ok $? 'a tilted series has the places and HU of its headers'
	exits 5 '--tilt error refuses a tilted series with status 5' ct-convert --tilt error "$CTSR_DICOM/head_ge_tilt_varspacing" no.nii
	if series head_ge_tilt_jpegll; then
		exits 0 'a tilted series in lossless JPEG is converted' ct-convert "$CTSR_DICOM/head_ge_tilt_jpegll" lossless.nii
		logged identical tilt.nii lossless.nii; ok $? 'lossless JPEG gives the volume of the plain series'
	fi
fi
if series chest_mixed_tcga_singles; then
	exits 5 'single slices of several patients are refused with status 5' ct-convert "$CTSR_DICOM/chest_mixed_tcga_singles" no.nii
	has err 'mixed: 12 series of different patients; --series takes one of them$' 'the error of single slices counts series and patients'
	exits 5 '--series refuses a single slice with status 5' ct-convert --series 3 "$CTSR_DICOM/chest_mixed_tcga_singles" no.nii
	has err 'one slice is no volume$' 'the error of a single slice says that it is no volume'
fi
if series phantom_fda_j2k_badpsot; then
	exits 0 'JPEG 2000 with tile-parts of a wrong length is converted' ct-convert "$CTSR_DICOM/phantom_fda_j2k_badpsot" psot.nii
	if command -v ffmpeg >/dev/null; then
		logged decoded psot.nii "$CTSR_DICOM/phantom_fda_j2k_badpsot"
		ok $? 'JPEG 2000 with tile-parts of a wrong length has the pixels of ffmpeg'
	else
		skip 'JPEG 2000 with tile-parts of a wrong length has the pixels of ffmpeg' 'no ffmpeg'
	fi
fi
[ ! -e no.nii ]; ok $? 'refused real series leave no volume'
done_testing
