#!/bin/sh
# Real series, which are not in this package: CTSR_DICOM is a folder of them. doc/dicom.md says which and where from.
. "$srcdir/tests/tap.sh"
if [ ! -d "${CTSR_DICOM-}" ]; then skip 'real series' 'CTSR_DICOM is no folder of them'; done_testing; fi
case $CTSR_DICOM in /*) ;; *) echo 'Bail out! CTSR_DICOM is no absolute path'; exit 99 ;; esac
if ! python_with pydicom || ! "$PY" -c 'import nibabel, scipy'; then skip 'real series' 'no pydicom, nibabel or scipy'; done_testing; fi
py() { "$PY" "$srcdir/tests/t-series-real.py" "$@" >log 2>&1; got_=$?; sed 's/^/# /' log; return $got_; }
# series NAME: is it there?
series() { [ -d "$CTSR_DICOM/$1" ] || { skip "$1" 'not there'; return 1; }; }

if series head_ge_tilt_varspacing; then
	exits 0 'tilted, of uneven spacing' ct-convert "$CTSR_DICOM/head_ge_tilt_varspacing" tilt.nii
	has err 'tilted by 18.50 degrees: slices are moved in their planes, 48.21 mm over 144.1 mm$' 'is told'
	has err 'gaps run from 1.081 to 6.999 mm: 28 slices are resampled to 37 planes' 'both are'
	py places tilt.nii "$CTSR_DICOM/head_ge_tilt_varspacing"; ok $? 'places and HU are those of the headers'
	exits 5 'or refused' ct-convert --tilt error "$CTSR_DICOM/head_ge_tilt_varspacing" no.nii
	if series head_ge_tilt_jpegll; then
		exits 0 'compressed without loss' ct-convert "$CTSR_DICOM/head_ge_tilt_jpegll" lossless.nii
		py identical tilt.nii lossless.nii; ok $? 'it is the same volume'
	fi
fi
if series chest_mixed_tcga_singles; then
	exits 5 'one slice each of several patients' ct-convert "$CTSR_DICOM/chest_mixed_tcga_singles" no.nii
	has err 'mixed: 12 series of different patients; --series takes one of them$' 'is no volume'
	exits 5 'nor is one of them' ct-convert --series 3 "$CTSR_DICOM/chest_mixed_tcga_singles" no.nii
	has err 'one slice is no volume$' 'for its reason'
fi
if series phantom_fda_j2k_badpsot; then
	exits 0 'tile-parts of a wrong length' ct-convert "$CTSR_DICOM/phantom_fda_j2k_badpsot" psot.nii
	if command -v ffmpeg >/dev/null; then
		py decoded psot.nii "$CTSR_DICOM/phantom_fda_j2k_badpsot"; ok $? 'are decoded, number by number'
	else
		skip 'decoded, number by number' 'no ffmpeg'
	fi
fi
[ ! -e no.nii ]; ok $? 'no file is left by failures'
done_testing
