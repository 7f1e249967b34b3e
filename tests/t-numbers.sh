#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Text of DICOM that should be a number and is none is refused, by file, tag and text; never read in part.
. "$srcdir/tests/tap.sh"
mkdir empty
ct-convert empty e.nii 2>err
if grep -q 'with-vtk' err; then skip 'numbers of DICOM' 'built without vtk-dicom'; done_testing; fi
if ! python_with pydicom; then skip 'numbers of DICOM' 'no pydicom'; done_testing; fi
py() { PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-numbers.py" "$@" 2>pyerr || sed 's/^/# /' pyerr; }
py s; exits 0 'the plain series of this test is converted' ct-convert s s.nii
bad() { # bad KEYWORD VR TEXT PATTERN [SLICE]
	rm -rf d; py bad "$1" "$2" "$3" d ${5-}
	what="$1 '$(printf '%s' "$3" | tr '\\' /)'${5+ in one slice}"
	exits 3 "$what is refused with status 3" ct-convert d d.nii
	has err "$4" "the error of $what names the file, the field and the text"
}
for text in '1,5' '1.5.' '1.x0' '0x10' '1 0' 'nan' 'inf' '1e' '1\\2' '-' '1\x00.5' '1e999' 'Infinity' '1d2'; do
	bad RescaleSlope DS "$text" 'd/00.dcm: damaged: RescaleSlope (0028,1053) is .*, not a number'
done
bad RescaleIntercept DS '-1000,5' "d/02.dcm: damaged: RescaleIntercept (0028,1052) is '-1000,5', not a number; it may be of the series" 2
bad PixelSpacing DS '0,75\\0,5' "PixelSpacing (0028,0030) is '0,75.0,5', not 2 numbers"
bad PixelSpacing DS '0.75' "PixelSpacing (0028,0030) is '0.75', not 2 numbers"
bad PixelSpacing DS '0.75\\0.5\\1' 'PixelSpacing (0028,0030) .*, not 2 numbers'
bad ImagePositionPatient DS '-12,5\\3\\4' 'ImagePositionPatient (0020,0032) .*, not 3 numbers' 1
bad ImageOrientationPatient DS '1\\0\\0\\0\\1,0\\0' 'ImageOrientationPatient (0020,0037) .*, not 6 numbers' 1
for tag in SliceThickness KVP GantryDetectorTilt SpacingBetweenSlices ReconstructionDiameter TriggerTime; do
	bad $tag DS '2,5' "$tag (00.*) is '2,5', not a number"
done
bad SingleCollimationWidth FD '\x00\x00\x00\x00\x00\x00\xf8\x7f' 'SingleCollimationWidth (0018,9306) .*, not a number'
for tag in SeriesNumber InstanceNumber AcquisitionNumber ImagesInAcquisition TemporalPositionIdentifier; do
	bad $tag IS '1,5' "$tag (00.*) is '1,5', not a number"
done
for text in '1.5' '3x' '99999999999'; do bad InstanceNumber IS "$text" "InstanceNumber (0020,0013) is '$text', not a number" 3; done
bad NumberOfFrames IS '1x' "NumberOfFrames (0028,0008) is '1x', not a number"
bad PixelPaddingValue DS '-20,5' "PixelPaddingValue (0028,0120) is '-20,5', not a number"
bad Rows IS '1O' "Rows (0028,0010) is '1O', not a number"
bad RescaleSlope UN '1,5' "RescaleSlope (0028,1053) is '1,5', not a number"
for tag in RescaleSlope PixelSpacing ImageOrientationPatient SliceThickness ImagePositionPatient; do
	py group $tag '1,5' e/e.dcm
	exits 3 "$tag '1,5' of a functional group is refused with status 3" ct-convert e/e.dcm d.nii
	has err "e/e.dcm: damaged: $tag (00.*) is '1,5', not" "the error of $tag of a functional group names file and text"
done
[ ! -e d.nii ]; ok $? 'series with text for numbers leave no output'
bad RescaleSlope DS '1e-30' 'd/02.dcm: RescaleSlope is 1e-30: all numbers of 16 bits lie within 6.* HU' 2
bad RescaleSlope DS '1e5' 'RescaleSlope is 100000: two numbers are further apart than air and bone'
bad RescaleIntercept DS '40000' \
	'd/02.dcm: RescaleIntercept is 40000: numbers of 16 bits are from 7232 to 72767 HU, which no CT is' 2
bad RescaleIntercept DS '-1e30' 'RescaleIntercept is -1e+30: .*, which no CT is'
exits 0 '--units other reads a scale that no HU can have' ct-convert -f --units other d o.nii; rm -f o.nii
py group None '' e/e.dcm; exits 0 'functional groups with numbers are converted' ct-convert e/e.dcm e.nii
good() { # good KEYWORD VR TEXT
	rm -rf d; py bad "$1" "$2" "$3" d
	exits 0 "$1 '$(printf '%s' "$3" | tr '\\' /)' is read" ct-convert -f d g.nii
}
for text in ' 1 ' '+1' '1.' '1.0E0' '10e-1' '1\x00' '0.1e+1' '1 \x00'; do
	good RescaleSlope DS "$text"
	tail -c 480 s.nii >want
	tail -c 480 g.nii >got
	cmp -s want got
	ok $? "RescaleSlope '$(printf '%s' "$text" | tr '\\' /)' is the number 1"
done
good RescaleSlope UN '1.0'
tail -c 480 g.nii >got
cmp -s want got
ok $? 'a RescaleSlope without a known VR is the number it says'
good InstanceNumber IS ' 12'; good KVP DS ''; good SliceThickness DS '  '; good AcquisitionNumber IS '\x00\x00'; good PixelPaddingValue US ''
py padding p; exits 0 'a series with padding of 0x8000 in signed values is converted' ct-convert p p.nii
[ "$(tail -c 960 p.nii | head -c 2 | od -An -td2 | tr -d ' ')" = -1024 ]
ok $? 'padding of 0x8000 is matched as -32768 and becomes -1024 HU'
done_testing
