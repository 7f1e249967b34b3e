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
done_testing
