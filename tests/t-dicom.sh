#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# DICOM series made with pydicom, read by ct-convert.
. "$srcdir/tests/tap.sh"
mkdir empty
ct-convert empty e.nii 2>err
if grep -q 'with-vtk' err; then
	skip 'DICOM series' 'built without vtk-dicom'
	done_testing
fi
exits 3 'an empty folder is refused with status 3' ct-convert empty e.nii
if ! python_with pydicom || ! "$PY" -c 'import nibabel'; then
	skip 'DICOM series' 'no pydicom or no nibabel'
	done_testing
fi
PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-dicom.py" make
ok $? 'pydicom makes the series of this test'
# orientations, compressions, frames of reference
for s in axial reversed las sagittal coronal oblique padded; do
	exits 0 "a series $s is converted" ct-convert $s $s.nii
	PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-dicom.py" check $s $s.nii
	ok $? "$s: every voxel is where it was, in HU"
done
if command -v gdcmconv >/dev/null; then
	for way in rle jpeg jpegls j2k; do
		mkdir axial-$way
		for f in axial/*; do gdcmconv --$way "$f" "axial-$way/${f#axial/}" 2>/dev/null; done
		exits 0 "a series compressed by $way is converted" ct-convert axial-$way $way.nii
		PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-dicom.py" check axial $way.nii
		ok $? "a series compressed by $way gives the voxels of the plain one"
	done
else
	skip 'compressed series are converted' 'no gdcmconv'
fi
exits 0 'a series with two frames of reference is converted' ct-convert frames frames.nii
has err 'several frames of reference' 'two frames of reference in a series are reported'
PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-dicom.py" check axial frames.nii
ok $? 'slices of two frames of reference are put in one volume'
exits 0 'a series with one frame of reference is converted' ct-convert -f axial axial.nii
! grep -q frames err; ok $? 'one frame of reference gives no message'
ct-info axial.nii >out
has out '^  ct-convert .* # axial xxh3:[0-9a-f]*$' 'the history of the volume names the folder with a checksum'
# several series in a folder
exits 0 'one file of a series stands for the series' ct-convert two/a3.dcm three.nii
PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-dicom.py" check axial three.nii
ok $? 'one file of a series gives that series alone'
exits 5 'a folder of two series is refused with status 5' ct-convert two d.nii
has err "series 2: 9 CT 12x10 'synthetic'" 'the error of a folder of two series lists them'
exits 0 '--series 1 converts one series of two' ct-convert --series 1 two first.nii
exits 2 '--series with a number that does not exist is refused with status 2' ct-convert --series 7 two d.nii
# series that are refused
refused() { # refused CODE FOLDER WORD [OPTION]
	exits "$1" "a series $2 is refused with status $1" ct-convert ${4-} "$2" d.nii
	has err "$3" "the error of a series $2 gives the reason ($3)"
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
[ ! -e d.nii ]; ok $? 'refused series leave no output'
exits 0 'a series with a slice that is there twice is converted' ct-convert twice twice.nii
has err '9 of 10 files used: 1 repeated' 'a slice that is there twice is dropped with a message'
PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-dicom.py" check axial twice.nii
ok $? 'a slice that is there twice does not change the others'
exits 3 'a DICOM file without a picture is refused with status 3' ct-convert nopicture/x.dcm d.nii
done_testing
