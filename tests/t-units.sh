#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What cannot be HU is refused by what computes in HU; the user has the last word.
. "$srcdir/tests/tap.sh"
for v in 0 1 2 3 10 11 12 13 20 21 22 23 100 101 102 103 110 111 112 113 120 121 122 123; do
	# shellcheck disable=SC2059
	printf "\\$(printf %03o "$v")\\000"
done >a.raw
make() { ct-convert -q --raw 4x3x2:i16:1,2,3 --rescale "$2,$3" a.raw "$1.nii"; } # NAME SLOPE INTERCEPT
make unit 0.008 0; make plus 10 0; make both 0.016 -0.98; make hu 10 -1000; make crop 8 0; make bone 30 0; make one 1 0; make tissue 1 -60
make far 1e7 -1e9; make negated -9 1012
for k in 1 2 3 4 5 6; do printf '\000\000\000\000\000\000\205\000'; done >g.raw; ct-convert -q --raw 4x3x2:i16:1,2,3 g.raw grey.nii
(printf '\000\377'; head -c 22 /dev/zero | tr '\000' '\144') >8.raw; ct-convert -q --raw 4x3x2:u8:1,2,3 8.raw bits.nii
ct-phantom -q --size 16x16x16 --spacing 2 sphere p.nii; ct-phantom -q --size 8x8x8 --spacing 4 sphere lr.nii
u='ct-upsample -q -x 2 --method linear'
train='ct-train -q --kind slices -x 2 --expert cubes=1,cube=24 -n 1 no.safetensors'
no() { # no FILE WORDS COMMAND...
	f=$1 w=$2; shift 2
	exits 3 "refused with status 3: $*" "$@"
	has err "$f.nii: values from .* are not HU.*$w" "the error names $f.nii and reads $w: $*"
}
# values that cannot be HU, for each command
no unit 'but see --units' $u unit.nii o.nii
no both 'but see --units' $u both.nii o.nii
no plus 'as if 1000 or 1024 was added.*--units' $u plus.nii o.nii
no unit '--units' ct-degrade -q -x 2 unit.nii o.nii
no unit '--units' ct-upsample -m prior -q -x 2 unit.nii o.nii
no plus '--units' ct-compose -q plus.nii plus.nii o.nii
no unit '--quantity' ct-project -q --views 2 unit.nii o.exr
no unit '--range or --window' ct-metrics unit.nii unit.nii
no plus '--range or --window' ct-metrics hu.nii plus.nii
no far 'no CT reaches that far.*--units' $u far.nii o.nii
no negated 'air is near 1000, as if their sign was changed.*--units' $u negated.nii o.nii
no grey 'a background of 0, as grey values do.*--units' $u grey.nii o.nii
no bits 'fill 8 or 16 bits, as grey values do.*--units' $u bits.nii o.nii
ct-project -q --views 2 --det 4x4 p.nii s.exr
no unit '--units' ct-nabgs -q --base unit.nii s.exr o.ply
exits 3 'ct-sr refuses a volume of values up to 1 with status 3' ct-sr -q -x 2 unit.nii o.nii
has err 'values from 0 to 0.984 are not HU' 'the error of ct-sr for values up to 1 gives their range'
[ ! -e o.nii ]; ok $? 'volumes that are not HU leave no output'
for f in hu crop bone one tissue; do exits 0 "$f.nii may be HU and is accepted" $u -f $f.nii o.nii; done
# --units: the word of the user
exits 0 '--units hu accepts values up to 1' $u -f --units hu unit.nii o.nii
ct-info o.nii >info; has info '^quantity  *hu$' 'a volume with --units hu records the quantity hu'
exits 0 'a volume that records hu is accepted without --units' $u -f o.nii oo.nii
exits 0 '--units other accepts values up to 1' $u -f --units other unit.nii o.nii
ct-info o.nii >info
has info '^quantity  *other$' 'a volume with --units other records the quantity other'
exits 3 'a volume that records other is refused without --units' $u -f o.nii oo.nii
has err 'o.nii: its values are not HU, says its metadata' 'the error of a volume that records other mentions its metadata'
exits 0 'ct-convert --units other accepts values in HU' ct-convert -q --units other hu.nii other.nii
exits 3 'a volume that records other is refused for training' $train other.nii
has err 'other.nii: its values are not HU, says .*ct-convert --units' 'the error of a training volume of other units names ct-convert --units'
exits 0 'ct-convert --units hu records the quantity hu' ct-convert --units hu unit.nii said.nii
exits 0 'a volume converted with --units hu is accepted later' $u -f said.nii o.nii
exits 0 'ct-convert copies a volume that is not HU' ct-convert unit.nii copy.nii
exits 0 'ct-metrics --range accepts values up to 1' ct-metrics --range 1 unit.nii unit.nii
exits 0 'ct-metrics --window accepts values up to 1' ct-metrics --window 0:1 unit.nii unit.nii
exits 0 'ct-project --quantity density accepts values up to 1' ct-project -q --quantity density --views 2 --det 4x4 unit.nii p.exr
exits 0 'ct-sr --paper accepts --units hu' ct-sr -q --dry-run --paper --units hu unit.nii new.nii
has out 'ct-convert .*--units=hu$' 'ct-sr --paper passes --units hu to ct-convert'
exits 3 'values up to 1 are refused for training with status 3' $train unit.nii
has err 'unit.nii: values from 0 to 0.984 are not HU$' 'the error of training values up to 1 gives file and range'
# a header with neither sform nor qform: its bytes 252 to 255 are 0
cp hu.nii lost.nii; printf '\0\0\0\0' | dd of=lost.nii bs=1 seek=252 conv=notrunc 2>/dev/null
exits 0 'a volume without sform and qform is converted' ct-convert lost.nii found.nii
has err 'lost.nii: its header does not say where the voxels lie' 'a volume without sform and qform gives a warning'
ct-info lost.nii >info
has info '^  nifti.code  *0$' 'ct-info shows nifti.code 0 for a volume without sform and qform'
ct-info found.nii >info; ! grep -q 'nifti.code' info; ok $? 'the output of ct-convert has a place'
# units of DICOM
if python_with pydicom && ! ct-convert "$dir_" d.nii 2>&1 | grep -q with-vtk; then
	PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" - <<'END'
from dicom import write
for name, tags in {"mgml": {"RescaleType": "MGML"}, "zeff": {"RescaleType": "Z_EFF"}, "hu": {"RescaleType": "HU"},
                   "us": {"RescaleType": "US"}, "pt": {"Modality": "PT", "RescaleType": "BQML"},
                   "mr": {"Modality": "MR", "RescaleSlope": None},
                   "sc": {"SOPClassUID": "1.2.840.10008.5.1.4.1.1.7"}}.items():
    for k in range(4):
        write("d-%s/%d.dcm" % (name, k), "axial", k, "1.4.1", **tags)
END
	for s in hu us; do exits 0 "a series with RescaleType $s is converted" ct-convert d-$s d-$s.nii; done
	for s in mgml:MGML zeff:Z_EFF; do
		exits 3 "a series with RescaleType ${s#*:} is refused with status 3" ct-convert d-${s%:*} no.nii
		has err "RescaleType is '${s#*:}': the values are not HU (but see --units)" "the error of RescaleType ${s#*:} names --units"
	done
	for s in mr pt; do
		exits 3 "a series of modality $s is refused with status 3" ct-convert d-$s no.nii
		has err "modality is '.*', not CT (but see --units)" "the error of modality $s names --units"
	done
	exits 0 '--units other converts a series of MR' ct-convert --units other d-mr mr.nii
	ct-info mr.nii >info
	has info '^quantity  *other$' 'a converted series of MR records the quantity other'
	exits 3 'a converted series of MR is refused by ct-upsample' $u mr.nii no.nii
	exits 3 'a folder of screen captures alone is refused with status 3' ct-convert d-sc no.nii
	has err 'no series of CT slices among 1: screen capture or dose page; --series takes any' 'a folder without a CT series names --series'
	exits 0 '--series converts a screen capture' ct-convert --series 1 d-sc sc.nii
else
	skip 'series of other units are refused' 'no pydicom, or built without vtk-dicom'
fi
[ ! -e no.nii ]; ok $? 'refused series of other units leave no volume'
done_testing
