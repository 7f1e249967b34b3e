#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Clean series in many orientations and encodings: voxel for voxel and place for place what pydicom and dcm2niix read.
. "$srcdir/tests/tap.sh"
mkdir empty
ct-convert empty e.nii 2>err
if grep -q 'with-vtk' err; then skip 'series' 'built without vtk-dicom'; done_testing; fi
if ! python_with pydicom || ! "$PY" -c 'import nibabel'; then skip 'series' 'no pydicom or no nibabel'; done_testing; fi
py() { PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-series-peers.py" "$@"; }
# agree WORD NAME PAIR...: a line for each pair
agree() {
	how=$1 name=$2; shift 2
	py "$how" "$@" >log 2>&1; ok $? "$name"; sed 's/^/# /' log
}
mkdir s && cd s && py make; ok $? 'the series of this test are made'
all=$(ls); cd ..
pairs=
for s in $all; do
	exits 0 "the series $s is converted" ct-convert s/$s $s.nii
	[ ! -s err ]
	ok $? "the series $s gives no message"
	pairs="$pairs $s.nii s/$s"
done
agree check 'every voxel is what pydicom reads, where the header puts it' $pairs
if command -v dcm2niix >/dev/null; then
	pairs=
	for s in $all; do
		case $s in s12*) continue ;; esac # it takes 12 bits with a sign for positive ones
		dcm2niix -z n -f d-$s -o . s/$s >/dev/null 2>&1
		pairs="$pairs $s.nii d-$s.nii"
	done
	agree same 'voxels and places are those of dcm2niix' $pairs
else
	skip 'voxels and places are those of dcm2niix' 'no dcm2niix'
fi
# what comes with pydicom: a series, one that lacks slices, localizers
data=$("$PY" -c 'import os, pydicom.data; print(os.path.join(os.path.dirname(pydicom.data.__file__), "test_files", "dicomdirtests"))' 2>/dev/null)
if [ -d "$data/98892001" ] && command -v dcm2niix >/dev/null; then
	exits 0 'a series of the package pydicom is converted' ct-convert "$data/98892001/CT5N" ct5n.nii
	dcm2niix -z n -f d-ct5n -o . "$data/98892001/CT5N" >/dev/null 2>&1
	agree same 'a series of the package pydicom has the voxels of dcm2niix' ct5n.nii d-ct5n.nii
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
	agree same "series recoded by $by keep their voxels" $pairs
}
for way in rle jpeg jpegls j2k; do recoded "gdcmconv --$way" axial u12 s12 s12-bare u8 each; done
recoded 'dcmcjpeg +e1' axial u12 s12 u8
recoded 'dcmcjpls' axial u16
for way in +td +tb +ti; do recoded "dcmconv $way" axial u12 s12-overlay each; done
done_testing
