#!/bin/sh
# Ways in which one series comes: without preamble, multi-frame, deflated, big-endian, in archives, by DICOMDIR.
. "$srcdir/tests/tap.sh"
mkdir empty
ct-convert empty e.nii 2>err
if grep -q 'with-vtk' err; then skip 'series' 'built without vtk-dicom'; done_testing; fi
if ! python_with pydicom || ! "$PY" -c 'import nibabel'; then skip 'series' 'no pydicom or no nibabel'; done_testing; fi
py() { PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-series-in.py" "$@"; }
py make; ok $? 'a series is made'
exits 0 'plain' ct-convert s s.nii
same() { # same NAME IN... : what IN is, is the same volume
	name=$1; shift
	exits 0 "$name" ct-convert -f "$@" o.nii; [ ! -s err ]; ok $? 'and all of it is used'
	py check s.nii o.nii; ok $? 'to the same volume'
}
same 'without preamble' headless
same 'one such file for its series' headless/IM03
same 'multi-frame, frames in no order' enhanced
same 'the file alone' enhanced/e.dcm
if command -v gdcmconv >/dev/null; then
	for way in rle jpeg jpegls j2k; do
		mkdir e-$way; gdcmconv --$way enhanced/e.dcm e-$way/e.dcm 2>/dev/null
		same "multi-frame, by $way" e-$way
	done
else
	skip 'multi-frame, compressed' 'no gdcmconv'
fi
if command -v dcmconv >/dev/null; then
	mkdir deflated big baseline
	for f in s/*; do dcmconv +td "$f" "deflated/${f#s/}"; dcmconv +tb "$f" "big/${f#s/}"; dcmcjpeg +e1 "$f" "baseline/${f#s/}"; done
	same 'deflated' deflated; same 'big-endian' big; same 'lossless JPEG' baseline
	head -c -9 deflated/03.dcm >short; mv short deflated/03.dcm
	exits 3 'deflated and cut off' ct-convert deflated d.nii; has err 'deflated/03.dcm: damaged' 'is told'
else
	skip 'deflated and big-endian' 'no dcmtk'
fi
# archives
mkdir tree; cp -r s tree/scan; echo hello >tree/notes.txt
tar -cf a.tar tree; tar -czf a.tar.gz tree; gzip -kr s; mkdir z; mv s/*.gz z
ct-convert -f a.tar o.nii 2>err
if grep -q 'not DICOM' err && ! grep -q used err; then
	skip 'archives' 'built without libarchive'
else
	for a in a.tar a.tar.gz; do
		exits 0 "$a" ct-convert -fv $a o.nii; has err '9 of 10 files used: 1 not DICOM$' 'is unpacked'; ! grep -q warning err; ok $? 'notes are no matter of trust'
		py check s.nii o.nii; ok $? 'to the same volume'
	done
	exits 0 'named by its path in it' ct-convert -fv a.tar o.nii; has err 'a.tar/tree/notes.txt: not used: not DICOM' 'each file'
	same 'slices compressed one by one' z
	same 'those by name' z/*.gz
	if "$PY" -c 'import zipfile' 2>/dev/null; then
		"$PY" -m zipfile -c a.zip tree/;
		exits 0 'a.zip' ct-convert -fv a.zip o.nii; has err '9 of 10 files used' 'is unpacked'
		py check s.nii o.nii; ok $? 'to the same volume'
	fi
	: >tree/scan/04.dcm; tar -cf bad.tar tree
	exits 3 'an empty member' ct-convert bad.tar d.nii; has err 'bad.tar/tree/scan/04.dcm: damaged: it is empty' 'is told'
	head -c 20000 a.tar >cut.tar; exits 3 'an archive that is cut off' ct-convert cut.tar d.nii; has err 'cut.tar.*: damaged: ' 'is told'
	head -c 300 z/04.dcm.gz >cut.gz; mv cut.gz z/04.dcm.gz
	exits 3 'a slice that is cut off' ct-convert z d.nii; has err 'z/04.dcm.gz: damaged' 'is told'
	printf 'PK\3\4 no zip' >no.zip; exits 3 'no archive' ct-convert no.zip d.nii; has err 'no.zip' 'is named'
	mkdir tmp; TMPDIR=$PWD/tmp exits 0 'in TMPDIR' ct-convert -f a.tar o.nii
	[ -z "$(ls -A tmp)" ]; ok $? 'nothing is left behind'
	TMPDIR=$PWD/none ct-convert -f a.tar d.nii 2>err; [ $? -eq 3 ] && grep -q 'no TMPDIR to unpack in' err; ok $? 'a TMPDIR that is not there is told'
	"$PY" -c 'import gzip, sys
with open("s/03.dcm", "rb") as f, gzip.open("bomb.gz", "wb", 1) as to:
    to.write(f.read(300))
    for _ in range(1030): to.write(bytes(1 << 20))'
	exits 3 'a gigabyte of zeros' ct-convert bomb.gz d.nii; has err 'compressed bytes become .*times as many (--expand)' 'is refused for that'
	exits 3 'with --expand 0' ct-convert --expand 0 bomb.gz d.nii; ! grep -q expand err; ok $? 'for what it is'
fi
exits 0 'NIfTI in gzip is no archive' sh -c 'ct-convert s.nii s.nii.gz && ct-convert -f s.nii.gz o.nii'
# what lies beside a series
mkdir mac; cp s/* mac/; for f in s/*; do printf '\000\005\026\007\000\002\000\000Mac OS X        ' >"mac/._${f#s/}"; done
exits 0 'files of macOS are passed over' ct-convert mac mac.nii; py check s.nii mac.nii; ok $? 'and it is the series'
ct-info mac >out; has out "not DICOM" 'and are counted'
rm mac/._*; f=$(ls mac | head -n 1); mkdir mac/below; head -c 900 "mac/$f" >"mac/below/x${f#${f%.*}}"
exits 3 'a folder with a damaged one below it' ct-convert -f mac mac.nii
exits 2 'a slash forgotten' ct-convert s hr; has err '^ct-convert: hr: hr/ is a series of DICOM, hr.nii.gz a volume: which?' 'is asked about'
exits 0 'a file of it is the series that lies beside it' ct-convert -f "mac/$f" mac.nii; py check s.nii mac.nii; ok $? 'all of it'
printf 'II*\000' | dd of="mac/$f" conv=notrunc 2>/dev/null; cp "mac/$f" tiff.dcm
exits 0 'a preamble that looks like TIFF' ct-convert -f "mac/$f" mac.nii; py check s.nii mac.nii; ok $? 'is one of DICOM'

# DICOMDIR
if command -v dcmmkdir >/dev/null; then
	mkdir disc; n=0; for f in s/*.dcm; do n=$((n + 1)); cp "$f" disc/IM$n; done
	(cd disc && dcmmkdir +r -I -Nxc IM* >/dev/null 2>&1)
	if [ -f disc/DICOMDIR ]; then
		exits 0 'DICOMDIR' ct-convert -fv disc/DICOMDIR o.nii; py check s.nii o.nii; ok $? 'is the files that it lists'
		has err '9 of 10 files used: 1 DICOM without a picture' 'it is one itself'
		mkdir -p exp/SER exp/TWO; mv disc/IM1 exp/TWO; cp disc/IM* exp/SER; cp exp/TWO/IM1 disc
		(cd exp && dcmmkdir +r -I -Nxc SER/IM* TWO/IM1 >/dev/null 2>&1 && mv DICOMDIR SER/DIRFILE && cp TWO/IM1 SER/IM0)
		exits 0 'a directory that names files from a root above' ct-convert -f exp/SER o.nii; py check s.nii o.nii; ok $? 'is understood'
		rm -r exp/TWO; exits 3 'which misses what is nowhere' ct-convert exp/SER d.nii; has err 'IM1: unreadable: listed in exp/SER/DIRFILE, but not there' 'and says so'
		mv exp/SER/IM0 exp/SER/IM1; mv exp/SER copied; exits 0 'and that was copied without it' ct-convert -f copied o.nii; py check s.nii o.nii; ok $? 'likewise'
		rm disc/IM4
		exits 3 'one that it lists is not there' ct-convert disc d.nii; has err 'disc/IM4: unreadable: listed in disc/DICOMDIR, but not there' 'is told'
	else
		skip 'DICOMDIR' 'dcmmkdir made none'
	fi
else
	skip 'DICOMDIR' 'no dcmtk'
fi
[ ! -e d.nii ]; ok $? 'no file is left by failures'
done_testing
