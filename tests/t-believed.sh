#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What metadata, sidecars and headers say: what cannot be is refused, with the field; what other programs write is read.
. "$srcdir/tests/tap.sh"
ct-phantom -q --size 24x24x24 --spacing 2 ellipsoids hr.nii && ct-degrade -q -x 1,1,2 --sigma 0 --decimate mean hr.nii lr.nii
ct-convert -q lr.nii lr.mha
with() { # with KEY VALUE: x.mha, of lr.mha
	awk -v line="ct-$1 = $2" -v key="ct-$1 " 'BEGIN { RS = "\n" } done_ { exit } index($0, key) == 1 { next }
		/^ElementDataFile/ { print line; print; done_ = 1; next } { print }' lr.mha >x.mha
	tail -c $((24 * 24 * 12 * 4)) lr.mha >>x.mha
}
for q in density mu lineIntegral residual intensity 'expected error'; do
	with quantity "$q"
	for c in ct-sr 'ct-upsample -m cubic'; do
		# shellcheck disable=SC2086
		exits 3 "$c refuses $q" $c -x 2 x.mha d.nii
		has err "x.mha: metadata quantity: the values are '$q': expected HU" 'the error of wrong values names HU'
	done
done
with quantity HU; exits 0 'hu in any case' ct-upsample -q -m cubic x.mha hu.nii
with quantity density; exits 0 'the user has the last word' ct-upsample -q --units hu -m cubic x.mha said.nii
bad() { # bad KEY VALUE PATTERN
	with "$1" "$2"; exits 3 "$1 of $2" ct-sr x.mha d.nii; has err "x.mha: $3" 'is refused, and said'
}
bad noise 1e6 'metadata noise: 1e+06 HU: expected 0 to 10000'
bad noise -5 'metadata noise: -5 HU'
bad noise 1,5 "metadata noise: '1,5' is not 1 numbers"
bad sigma 1000 'metadata sigma: 1000 fine voxels: expected 0 to 16'
bad sigma -1 'metadata sigma: -1 fine'
bad factor 5000 'metadata factor: 5000: expected 1 to 1024'
bad factor 0.5 'metadata factor: 0.5: expected'
with noise 5; exits 0 'noise that can be' ct-info x.mha
# slices of 4 mm
sed -n 's/^ElementSpacing/&/p' lr.mha >mm; has mm ' 4$' 'slices are 4 mm apart'
ct-convert -q lr.nii s.nii
for mm in 30 3; do
	printf '{"Manufacturer": "GE", "SliceThickness": %s}\n' $mm >s.json
	exits 0 "a sidecar of $mm mm" ct-info -e s.nii; cp err err-$mm
done
has err-30 'field SliceThickness: 30 mm, and slices are 4 mm apart: expected at most 6 times' 'is refused where slices are 4 mm apart'
! grep -q SliceThickness err-3; ok $? 'a thickness that is known is not warned of'
# figures that are not numbers
exits 3 'a bound of a figure that is NaN' ct-metrics --max psnr=99 --min psnr=0 lr.nii lr.nii
printf 'NRRD0004\ntype: SHORT\ndimension: 3\nspace: Left-Posterior-Superior\nsizes: 2 3 4\nspace directions: (1,0,0) (0,1,0) (0,0,2.5)\nspace origin: (1,2,3)\nkinds: Domain domain Domain\nendian: Little\nencoding: Raw\ndata file: ./v.raw\n' >v.nhdr
head -c 48 lr.mha >v.raw
exits 0 'NRRD in other cases, beside it by ./' ct-info v.nhdr
printf 'ObjectType = Image\nNDims = 3\nDimSize = 2 3 4\nElementSpacing = 1 1 2.5\nElementType = met_short\nElementDataFile = .//v.raw\n' >v.mhd
exits 0 'a MetaImage beside its voxels is read' ct-info v.mhd
sed 's#\.//v#./../v#' v.mhd >w.mhd; exits 3 'voxels of a MetaImage elsewhere are refused' ct-info w.mhd
sed 's#\.//v.raw#./#' v.mhd >w.mhd; exits 3 'a folder for voxels of a MetaImage is refused' ct-info w.mhd
sed 's#1 1 2.5#1 1 2,5#; s#= 2 3 4#= 2 3 4#' v.mhd >w.mhd; exits 3 'a comma is no point' ct-info w.mhd
sed 's#1 1 2.5#1 1 2.5mm#' v.mhd >w.mhd; exits 3 'nor is a unit a number' ct-info w.mhd; has err 'ElementSpacing' 'which names the field'
if command -v python3 >/dev/null; then
	python3 -c "
b = bytearray(open('hr.nii', 'rb').read())
b[40:42], b[48:50] = (4).to_bytes(2, 'little'), bytes(2)
open('dim4.nii', 'wb').write(b)"
	exits 0 'dim[4] of 0 is 1' ct-info dim4.nii
fi

# Text of DICOM that should be a number and is none is refused, by file, tag and text; never read in part.
part numbers
mkdir empty
ct-convert empty e.nii 2>err
if grep -q 'with-vtk' err; then skip 'numbers of DICOM' 'built without vtk-dicom'; done_testing; fi
if ! python_with pydicom; then skip 'numbers of DICOM' 'no pydicom'; done_testing; fi
calls numpy pydicom dicom
py() { called "$srcdir/tests/t-numbers.py" "$@" 2>pyerr || sed 's/^/# /' pyerr; }
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
