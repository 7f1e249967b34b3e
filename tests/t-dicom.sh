#!/bin/sh
# DICOM series made with pydicom, read by ct-convert.
. "$srcdir/tests/tap.sh"
mkdir empty
ct-convert empty e.nii 2>err
if grep -q 'with-vtk' err; then
	skip 'DICOM series' 'built without vtk-dicom'
	done_testing
fi
exits 3 'an empty folder' ct-convert empty e.nii
if ! python_with pydicom || ! "$PY" -c 'import nibabel'; then
	skip 'DICOM series' 'no pydicom or no nibabel'
	done_testing
fi
PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-dicom.py" make; ok $? 'series are made'
for s in axial reversed las sagittal coronal oblique padded; do
	exits 0 "$s is read" ct-convert $s $s.nii
	PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-dicom.py" check $s $s.nii; ok $? "$s: every voxel is where it was, in HU"
done
if command -v gdcmconv >/dev/null; then
	for way in rle jpeg jpegls j2k; do
		mkdir axial-$way
		for f in axial/*; do gdcmconv --$way "$f" "axial-$way/${f#axial/}" 2>/dev/null; done
		exits 0 "compressed by $way it is read" ct-convert axial-$way $way.nii
		PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-dicom.py" check axial $way.nii; ok $? 'and every voxel is the same'
	done
else
	skip 'compressed series' 'no gdcmconv'
fi
exits 0 'a frame of its own for the last slice' ct-convert frames frames.nii
has err 'several frames of reference' 'is told'
PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-dicom.py" check axial frames.nii; ok $? 'and taken to be the same'
exits 0 'one frame' ct-convert -f axial axial.nii
! grep -q frames err; ok $? 'is not told'
ct-info axial.nii >out; has out '^  ct-convert .* # axial xxh3:[0-9a-f]*$' 'what it was made of is in its history'
exits 0 'a file stands for its series' ct-convert two/a3.dcm three.nii
PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-dicom.py" check axial three.nii; ok $? 'and nothing else'
exits 5 'two series are refused' ct-convert two d.nii
has err "series 2: 9 CT 12x10 'synthetic'" 'and listed'
exits 0 'one of them is taken' ct-convert --series 1 two first.nii
exits 2 'one that is not there' ct-convert --series 7 two d.nii
refused() { # refused CODE FOLDER WORD [OPTION]
	exits "$1" "$2 is refused" ct-convert ${4-} "$2" d.nii
	has err "$3" "$2: the reason ($3)"
}
refused 5 missing '2 slices are missing'
refused 5 uneven 'uneven' --gaps=error
refused 5 tilted '20.0 degrees' --tilt=error
refused 5 patients 'patients'
refused 5 matrices '2 series'
refused 3 mr "modality is 'MR'"
refused 3 cutoff 'cannot be decoded\|damaged\|truncated'
refused 3 shortrun 'shortrun/4.dcm: damaged: its run-length code does not make 120 pixels of 2 bytes'
refused 3 syntax 'syntax/4.dcm: TransferSyntaxUID 1.2.840.10008.1.2.4.58 is not one that is read'
refused 3 norescale 'RescaleSlope'
refused 3 bomb '1152000000 or more.*--expand'
[ ! -e d.nii ]; ok $? 'no file is left'
exits 0 'a slice that is there twice' ct-convert twice twice.nii; has err '9 of 10 files used: 1 repeated' 'is dropped, and said'
PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-dicom.py" check axial twice.nii; ok $? 'the rest is whole'
exits 3 'a DICOM file without a picture' ct-convert nopicture/x.dcm d.nii
done_testing
