#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Real series, which are not in this package: CTSR_DICOM is a folder of them. doc/dicom.md says which and where from.
. "$srcdir/tests/tap.sh"
if [ ! -d "${CTSR_DICOM-}" ]; then skip 'real series' 'CTSR_DICOM is no folder of them'; done_testing; fi
case $CTSR_DICOM in /*) ;; *) echo 'Bail out! CTSR_DICOM is no absolute path'; exit 99 ;; esac
if ! python_with pydicom || ! "$PY" -c 'import nibabel, scipy'; then skip 'real series' 'no pydicom, nibabel or scipy'; done_testing; fi
py() { "$PY" "$srcdir/tests/t-series-real.py" "$@" >log 2>&1; got_=$?; sed 's/^/# /' log; return $got_; }
# series NAME: is it there?
series() { [ -d "$CTSR_DICOM/$1" ] || { skip "$1" 'not there'; return 1; }; }

if series head_ge_tilt_varspacing; then
	exits 0 'a tilted series of uneven spacing is converted' ct-convert "$CTSR_DICOM/head_ge_tilt_varspacing" tilt.nii
	has err 'tilted by 18.50 degrees: slices are moved in their planes, 48.21 mm over 144.1 mm$' 'the tilt of a series is reported with its angle'
	has err 'gaps run from 1.081 to 6.999 mm: 28 slices are resampled to 37 planes' 'the uneven spacing of a series is reported'
	py places tilt.nii "$CTSR_DICOM/head_ge_tilt_varspacing"; ok $? 'a tilted series has the places and HU of its headers'
	exits 5 '--tilt error refuses a tilted series with status 5' ct-convert --tilt error "$CTSR_DICOM/head_ge_tilt_varspacing" no.nii
	if series head_ge_tilt_jpegll; then
		exits 0 'a tilted series in lossless JPEG is converted' ct-convert "$CTSR_DICOM/head_ge_tilt_jpegll" lossless.nii
		py identical tilt.nii lossless.nii; ok $? 'lossless JPEG gives the volume of the plain series'
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
		py decoded psot.nii "$CTSR_DICOM/phantom_fda_j2k_badpsot"
		ok $? 'JPEG 2000 with tile-parts of a wrong length has the pixels of ffmpeg'
	else
		skip 'JPEG 2000 with tile-parts of a wrong length has the pixels of ffmpeg' 'no ffmpeg'
	fi
fi
[ ! -e no.nii ]; ok $? 'refused real series leave no volume'
done_testing
