#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Ways in which one series comes: without preamble, multi-frame, deflated, big-endian, in archives, by DICOMDIR.
. "$srcdir/tests/tap.sh"
mkdir empty
ct-convert empty e.nii 2>err
if grep -q 'with-vtk' err; then skip 'series' 'built without vtk-dicom'; done_testing; fi
if ! python_with pydicom || ! "$PY" -c 'import nibabel'; then skip 'series' 'no pydicom or no nibabel'; done_testing; fi
py() { PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-series-in.py" "$@"; }
py make; ok $? 'the series of this test are made'
exits 0 'a plain series is converted' ct-convert s s.nii
same() { # same NAME IN... : what IN is, is the same volume
	name=$1; shift
	exits 0 "a series is converted: $name" ct-convert -f "$@" o.nii
	[ ! -s err ]
	ok $? "no file of a series gives a message: $name"
	py check s.nii o.nii; ok $? "the voxels are those of the plain series: $name"
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
		py check s.nii o.nii; ok $? "the voxels of $a are those of the plain series"
	done
	exits 0 'a series in an archive is converted again with -v' ct-convert -fv a.tar o.nii
	has err 'a.tar/tree/notes.txt: not used: not DICOM' 'a file in an archive is named by its path in it'
	same 'slices compressed by gzip one by one' z
	same 'slices compressed by gzip, by their names' z/*.gz
	if "$PY" -c 'import zipfile' 2>/dev/null; then
		"$PY" -m zipfile -c a.zip tree/;
		exits 0 'a series in a zip archive is converted' ct-convert -fv a.zip o.nii
		has err '9 of 10 files used' 'nine of ten files of a zip archive are used'
		py check s.nii o.nii; ok $? 'the voxels of a zip archive are those of the plain series'
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
	TMPDIR=$PWD/none ct-convert -f a.tar d.nii 2>err
	[ $? -eq 3 ] && grep -q 'no TMPDIR to unpack in' err
	ok $? 'a TMPDIR that does not exist is refused with status 3'
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
py check s.nii mac.nii
ok $? 'files of macOS do not change the voxels'
ct-info mac >out; has out "not DICOM" 'files of macOS are counted as not DICOM'
rm mac/._*; f=$(ls mac | head -n 1); mkdir mac/below; head -c 900 "mac/$f" >"mac/below/x${f#${f%.*}}"
exits 3 'a folder with a damaged file in a folder below is refused' ct-convert -f mac mac.nii
exits 2 'an output without slash and suffix is refused for a series' ct-convert s hr
has err '^ct-convert: hr: hr/ is a series of DICOM, hr.nii.gz a volume: which?' 'the error of an output without slash names both choices'
exits 0 'a file of a series is converted as its series' ct-convert -f "mac/$f" mac.nii
py check s.nii mac.nii
ok $? 'a file of a series stands for all files beside it'
printf 'II*\000' | dd of="mac/$f" conv=notrunc 2>/dev/null; cp "mac/$f" tiff.dcm
exits 0 'a file whose preamble looks like TIFF is converted' ct-convert -f "mac/$f" mac.nii
py check s.nii mac.nii
ok $? 'a preamble that looks like TIFF does not change the voxels'

# DICOMDIR
if command -v dcmmkdir >/dev/null; then
	mkdir disc; n=0; for f in s/*.dcm; do n=$((n + 1)); cp "$f" disc/IM$n; done
	(cd disc && dcmmkdir +r -I -Nxc IM* >/dev/null 2>&1)
	if [ -f disc/DICOMDIR ]; then
		exits 0 'a DICOMDIR is converted as a series' ct-convert -fv disc/DICOMDIR o.nii
		py check s.nii o.nii
		ok $? 'the voxels of a DICOMDIR are those of the plain series'
		has err '9 of 10 files used: 1 DICOM without a picture' 'the DICOMDIR is counted as DICOM without a picture'
		mkdir -p exp/SER exp/TWO; mv disc/IM1 exp/TWO; cp disc/IM* exp/SER; cp exp/TWO/IM1 disc
		(cd exp && dcmmkdir +r -I -Nxc SER/IM* TWO/IM1 >/dev/null 2>&1 && mv DICOMDIR SER/DIRFILE && cp TWO/IM1 SER/IM0)
		exits 0 'a directory that names files from a folder above is converted' ct-convert -f exp/SER o.nii
		py check s.nii o.nii
		ok $? 'a directory that names files from a folder above gives the plain series'
		rm -r exp/TWO
		exits 3 'a directory that lists a file which exists nowhere is refused' ct-convert exp/SER d.nii
		has err 'IM1: unreadable: listed in exp/SER/DIRFILE, but not there' 'the error of a directory names the file that is missing'
		mv exp/SER/IM0 exp/SER/IM1
		mv exp/SER copied
		exits 0 'a directory copied without its root folder is converted' ct-convert -f copied o.nii
		py check s.nii o.nii
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
done_testing
