#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-convert: pipes, gzip, raw voxels, axes, resampling, cubes; nibabel and nifti_tool as judges.
. "$srcdir/tests/tap.sh"
# raw voxels 4x3x2: i16, value = 100 k + 10 j + i
for v in 0 1 2 3 10 11 12 13 20 21 22 23 100 101 102 103 110 111 112 113 120 121 122 123; do
	# shellcheck disable=SC2059
	printf "\\$(printf %03o "$v")\\000"
done >a.raw
raw='--raw 4x3x2:i16:1,2,3'
# shellcheck disable=SC2086
exits 0 'raw voxels are read' ct-convert $raw --rescale 1,-1024 a.raw a.nii
exits 0 'NIfTI is copied through a pipe' sh -c 'cat a.nii | ct-convert - - | cat >b.nii'
exits 0 'ct-convert writes a volume named .nii.gz' ct-convert a.nii a.nii.gz
gzip -t a.nii.gz; ok $? 'a volume named .nii.gz is gzip'
mv a.nii.gz misnamed.nii
exits 0 'gzip is read whatever its name' ct-convert misnamed.nii c.nii
tail -c 48 a.nii >va; tail -c 48 b.nii >vb; tail -c 48 c.nii >vc
cmp -s va vb && cmp -s va vc; ok $? 'the voxels are the same'
{ head -c 360 a.nii | gzip -c; tail -c +361 a.nii | gzip -c; } >two.nii.gz
exits 0 'gzip of two members is read' ct-convert two.nii.gz two.nii
tail -c 48 two.nii >vtwo; cmp -s va vtwo; ok $? 'the second like the first'
{ gzip -c a.nii; head -c 700 /dev/zero; } >padded.nii.gz
exits 0 'zeros after the last member are padding' ct-convert padded.nii.gz padded.nii
{ head -c 360 a.nii | gzip -c; head -c 50 /dev/zero; tail -c +361 a.nii | gzip -c; } >broken.nii.gz
exits 3 'zeros between two members of gzip are refused with status 3' ct-convert broken.nii.gz d.nii
for mask in 027 000; do (umask $mask; ct-convert -f a.nii "mode$mask.nii"); done
[ "$(stat -c %a mode027.nii)" = 640 ] && [ "$(stat -c %a mode000.nii)" = 666 ]
ok $? 'what is written may be read by those that umask allows'
exits 4 'an existing file is kept' ct-convert a.nii b.nii
exits 0 '--force writes over an existing file' ct-convert -f a.nii b.nii
exits 2 'a name of another format is refused' ct-convert a.nii a.mgz
# shellcheck disable=SC2086
exits 3 'too many raw bytes' sh -c 'cat a.raw a.raw >long.raw; ct-convert --raw 4x3x2:i16:1 long.raw d.nii'
exits 3 'too few raw bytes' ct-convert --raw 4x3x3:i16:1 a.raw d.nii
cp a.raw second.raw; exits 2 'a second file of raw voxels is refused with status 2' ct-convert $raw a.raw second.raw d.nii
has err 'several files' 'the error of two files of raw voxels says that they make no volume'
exits 2 'raw needs a spacing' ct-convert --raw 4x3x2:i16 a.raw d.nii
exits 2 'an unknown raw type' ct-convert --raw 4x3x2:i12:1 a.raw d.nii
exits 2 'axes that are none' ct-convert --raw 4x3x2:i16:1 --orient LLS a.raw d.nii
exits 2 '--rescale without --raw is refused with status 2' ct-convert --rescale 2 a.nii d.nii
exits 2 'a series without DICOM' ct-convert --series 1 a.nii d.nii
head -c 370 a.nii >short.nii
exits 3 'a truncated volume is refused with status 3' ct-convert short.nii d.nii
exits 3 'an empty file is refused with status 3' ct-convert /dev/null d.nii
printf 'hello, this is no volume' >text
exits 3 'a text is refused as a volume with status 3' ct-convert text d.nii
has err 'text: not a NIfTI file' 'says which and why'
[ ! -e d.nii ]; ok $? 'no file is left by failures'
if [ -w /dev/full ]; then
	exits 4 'a full disk ends ct-convert with status 4' ct-convert a.nii /dev/full
	exits 4 'a full disk behind standard output' sh -c 'ct-convert a.nii - >/dev/full'
fi
exits 4 'a folder that is not there' ct-convert a.nii none/d.nii
printf '\000\000\300\177\000\000\200\077' >nan.raw
exits 6 'a NaN in raw voxels is refused with status 6' ct-convert --raw 2x1x1:f32:1 nan.raw d.nii
ls -A | grep -q '^d\.nii'; [ $? -eq 1 ]; ok $? 'nor a temporary one'
no() { exits 2 "$1" ct-convert $2 a.raw d.nii; has err "$3" "$3"; } # no NAME ARGS WORDS
no 'raw without a type' '--raw 4x3x2' "'4x3x2' is not WxHxD:TYPE:X,Y,Z"
no 'no size' '--raw 4x3x2:i16:1,0,1' 'raw: the voxel size 1,0,1 is not positive'
no 'nothing left' '--raw 4x3x2:i16:1 --rescale 0' 'rescale: a factor of 0'
exits 2 '.nii.gz is no name' ct-convert a.nii .nii.gz
exits 0 'what is no file needs no name' ct-convert -f a.nii /dev/null
# three numbers of the operator go with their axes, and go where voxels change
ct-phantom -q --size 24x24x24 --spacing 2,3,6 sphere p.nii && ct-degrade -q -x 4,2,1 p.nii q.nii
ct-convert -q --reorient SRA q.nii r.nii && ct-info r.nii >info; has info '^  factor  *1,4,2$' '--reorient permutes the factor with its axes'
has info '^  sigma  *0,1.69865806,0.84932903$' '--reorient permutes the sigma with its axes'; has info '^orientation  *SRA$' 'a volume of --reorient SRA has the orientation SRA'
ct-degrade -q -x 2 -p release p.nii first.nii; exits 0 'samples that are first voxels of cells keep that with other axes' ct-convert -f --reorient SRA first.nii r.nii
exits 5 'samples that would become the last voxels of cells are refused' ct-convert -f --reorient LAS first.nii no.nii; has err 'first.nii: metadata first: .*: turn what it was made of' 'the error says what to turn'
ct-degrade -qf -x 1,1,2 -p release p.nii first.nii; exits 0 'an axis that was not reduced may turn' ct-convert -f --reorient LAS first.nii r.nii
ct-convert -q --iso 5 q.nii i.nii && ct-info i.nii >info
! grep -q '^  \(factor\|sigma\|decimate\)' info; ok $? 'none of other voxels'; has info '^size  *10 14 29$' 'as many as fit'
has info '^centre-mm  *0 0 0$' 'about the same centre'; has info '^  noise  *0$' 'what had no noise has none on other voxels'
ct-degrade -q -x 4,2,1 --noise 30 p.nii loud.nii; ct-convert -qf --iso 5 loud.nii i.nii; ct-convert -q --grid q.nii loud.nii like.nii
for f in i.nii like.nii; do ! ct-info "$f" | grep -q '^  noise'; ok $? "$f of other voxels does not state the noise of those before"; done
ct-phantom -q --size 8x8x8 --spacing 4 ellipsoids p4.nii; ct-convert -q --iso 4 p4.nii same.nii
[ "$(tail -c 2048 p4.nii | cksum)" = "$(tail -c 2048 same.nii | cksum)" ]; ok $? '--iso of the same size changes nothing'
head -c 64 /dev/zero | tr '\0' '2' >grey.raw
exits 0 'a cube of grey values' ct-convert --units other --raw 4x4x4:u8:1,1,1 --cube 6 grey.raw grey.nii
ct-info grey.nii >info; has info '^min  *0$' 'is padded with 0, not with air'
exits 2 '--iso that makes too many voxels is refused with status 2' ct-convert --iso 0.0001 --cube 8 q.nii d.nii
has err 'iso 0.0001 makes .* voxels along an axis' 'the error of too many voxels gives the value of --iso'
if command -v nifti_tool >/dev/null 2>&1; then
	nifti_tool -check_hdr -infiles a.nii >check 2>&1; grep -q 'IS GOOD' check; ok $? 'nifti_tool finds the header good'
	nifti_tool -check_nim -infiles a.nii >check 2>&1; grep -q 'IS GOOD' check; ok $? 'nifti_tool finds the image good'
else
	skip 'nifti_tool finds the header good' 'no nifti_tool'
fi
if python_with nibabel; then
	"$PY" "$srcdir/tests/t-convert.py"
	ok $? 'nibabel reads voxels and places from ct-convert as they should be'
else
	skip 'nibabel reads voxels and places from ct-convert as they should be' 'no nibabel'
fi

# ct-convert --crop: boxes of voxels and of millimetres, and the body.
part crop
ct-phantom -q --size 40x32x24 --spacing 2,3,4 ellipsoids v.nii
at() { ct-info --json "$1" | tr -d ' \n' | sed 's/.*"affine":\[\[\([^]]*\)\],\[\([^]]*\)\],\[\([^]]*\)\].*/\1,\2,\3/' | awk -F, '{print $4, $8, $12}'; }
size() { ct-info --json "$1" | tr -d ' \n' | sed 's/.*"size":\[\([^]]*\)\].*/\1/'; }
is() { [ "$1" = "$2" ]; ok $? "$3 ($1)"; }
exits 0 'a box of voxels' ct-convert -q --crop 3:13,4:10,5:24 v.nii a.nii
is "$(size a.nii)" 10,6,19 'is of its size'
set -- $(at v.nii); x=$1 y=$2 z=$3
set -- $(at a.nii)
awk "BEGIN{exit !($1 == $x + 6 && $2 == $y + 12 && $3 == $z + 20)}"; ok $? 'where those voxels were'
exits 0 'what is left out is all' ct-convert -q --crop :,4:,:7 v.nii b.nii
is "$(size b.nii)" 40,28,7 'of its axis'
box=$(awk "BEGIN{printf \"%g:%g,%g:%g,%g:mm\", $x + 5, $x + 25, $y + 10.5, $y + 28.5, $z + 18}")
exits 0 'the same box in millimetres' ct-convert -q \
	--crop "$box" v.nii c.nii
cmp -s a.nii c.nii; r=$?; ct-metrics --json a.nii c.nii 2>/dev/null | grep -q '"max-hu": 0[,.]'; ok $? 'a cropped CT has the same voxels'
is "$(size c.nii)" 10,6,19 'and no larger'
exits 0 'a part of a voxel is one' ct-convert -q --crop "$(awk "BEGIN{printf \"%g:%g,:,:mm\", $x + 5.5, $x + 25.5}")" v.nii d.nii
is "$(size d.nii)" 11,32,24 'on either side'
ct-convert -q --reorient LPS v.nii l.nii
exits 0 'of axes that run the other way' ct-convert -q \
	--crop "$box" l.nii cl.nii
ct-convert -q --reorient RAS cl.nii - | ct-metrics --json c.nii - | grep -q '"max-hu": 0[,.]'; ok $? 'it is the same place'
exits 0 'a box of the whole volume is it' ct-convert -q --crop=0:40,0:32,0:24 v.nii e.nii
is "$(size e.nii)" 40,32,24 'the box of the whole volume has its size'
for b in -5:40,:,: :,0:33,: :,:,24:25 1000:,:,:; do
	exits 2 "--crop $b beyond the volume is refused" ct-convert -q --crop="$b" v.nii x.nii
	has err 'is beyond the volume, which has 40x32x24 voxels' "the error of --crop $b gives the size of the volume"
done
ends=$(awk "BEGIN{printf \"%g:%g\", $x - 1, $x + 79}")
exits 0 'a box in millimetres up to the ends of the volume is it' ct-convert -q --crop="$ends,:,:mm" v.nii m.nii
is "$(size m.nii)" 40,32,24 'the box in millimetres of the whole volume has its size'
for b in "$(awk "BEGIN{print $x - 3}"):,:,:mm" ":,:,:9999mm"; do
	exits 2 "--crop $b beyond the place of the volume is refused" ct-convert -q --crop="$b" v.nii x.nii
	has err 'is beyond the volume, which lies at ' "the error of --crop $b gives the place of the volume"
done
for b in 1:2 1:2,3:4 a:2,:,: 5:5,:,: 6:5,:,: 1.5:3,:,: 40:50,:,: 1:2,3:4,5:6,7:8 1:2,3:4,5:6cm 900:950,:,:mm; do
	exits 2 "--crop $b" ct-convert -q --crop "$b" v.nii x.nii
	has err '^ct-convert: .*--crop: ' 'is refused in words'
done
[ ! -e x.nii ]; ok $? 'a crop that is refused writes nothing'

# a table beside a body: the body is what is larger, and 10 mm about it
python3 - <<'END' || skip 'the body' 'no python3'
import struct
n = (30, 20, 10)
v = [-1000] * (30 * 20 * 10)
for k in range(10):
    for j in range(20):
        for i in range(30):
            if 8 <= i < 20 and 6 <= j < 12 and 3 <= k < 8: v[(k * 20 + j) * 30 + i] = 40
            if j == 17: v[(k * 20 + j) * 30 + i] = 100
open('body.raw', 'wb').write(struct.pack('<6000h', *v))
END
if [ -e body.raw ]; then
	ct-convert -q --raw 30x20x10:i16:5,5,5 body.raw body.nii
	exits 0 '--crop auto finds the body in air' ct-convert -v --crop auto body.nii f.nii
	has err 'cropped to voxels 6:22,4:14,1:10 of 30x20x10' 'and 10 mm about it'
	is "$(size f.nii)" 16,10,9 'which is all that is left'
fi

# What cannot be HU is refused by what computes in HU; the user has the last word.
part units
for v in 0 1 2 3 10 11 12 13 20 21 22 23 100 101 102 103 110 111 112 113 120 121 122 123; do
	# shellcheck disable=SC2059
	printf "\\$(printf %03o "$v")\\000"
done >a.raw
make() { ct-convert -q --raw 4x3x2:i16:1,2,3 --rescale "$2,$3" a.raw "$1.nii"; } # NAME SLOPE INTERCEPT
make unit 0.008 0; make plus 10 0; make both 0.016 -0.98; make hu 10 -1000; make crop 8 0; make bone 30 0; make one 1 0; make tissue 1 -60
make far 1e7 -1e9; make negated -9 1012; make siemens 10 7168
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
no siemens 'most are above 4095, .* as if 8192 was added.*--units' $u siemens.nii o.nii
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

# ct-convert --scanner: numpy projections with a scanner file become a stack.
part npy
cat >scan.json <<'JSON'
{"mode": "cone", "DSO": 1000, "DSD": 1500, "nDetector": [3, 4], "dDetector": [2.0, 1.5],
 "totalAngle": 180, "startAngle": 10, "numTrain": 2}
JSON
npy() { # npy DESCR ORDER SHAPE: header of version 1, 128 bytes
	printf '\223NUMPY\001\000\166\000'
	printf "{'descr': '%s', 'fortran_order': %s, 'shape': %s, }%117s" "$1" "$2" "$3" '' |
		head -c 117; printf '\n'
}
bytes() { i=0; while [ $i -lt "$1" ]; do printf '\001'; i=$((i + 1)); done; }
{ npy '|u1' False '(2, 3, 4)'; bytes 24; } >a.npy
exits 0 'numpy projections of bytes are read' ct-convert --scanner scan.json a.npy a.exr
exits 0 'numpy projections become a stack' ct-info a.exr
has out '2 views\|views *2' 'numpy projections of two views are two views'
sed 's/"numTrain"/"nVoxel": [4, 5, 6], "sVoxel": [40, 50, 30], "numTrain"/' scan.json >grid.json
exits 0 'a scanner file of a volume is taken' ct-convert -f --scanner grid.json a.npy g.exr
ct-info g.exr >out; has out 'volume.size *4,5,6' 'the stack notes the voxels of the scanner file'
has out 'volume.affine *10,0,0,-15,0,10,0,-20,0,0,5,-12.5' 'the stack notes where the volume lies'
sed 's/\[4, 5, 6\]/[4, 5.5, 6]/' grid.json >half.json
exits 3 'half a voxel in the scanner file is refused' ct-convert --scanner half.json a.npy b.exr
has err 'nVoxel' 'the error of half a voxel names nVoxel'
sed 's/"dDetector": \[/&-/' scan.json >less.json
exits 5 'pixels below zero in the scanner file are refused' ct-convert --scanner less.json a.npy b.exr
has err 'less.json: pixel pitch' 'the error of a refused geometry names its scanner file'
sed 's/\[40, 50/[0, 50/' grid.json >flat.json
exits 3 'a grid without width is refused' ct-convert --scanner flat.json a.npy b.exr
has err 'a voxel of 0 mm' 'the error of a voxel of 0 mm says so'
ct-convert --scanner scan.json - - <a.npy >pipe.exr 2>e; [ -s pipe.exr ]; ok $? 'numpy projections are read from a pipe'
exits 2 'numpy projections to a volume are refused' ct-convert --scanner scan.json a.npy a.nii
exits 2 'numpy projections are not resampled' ct-convert --scanner scan.json --iso 1 a.npy b.exr
for bad in "|u1;True;(2, 3, 4)" "|c8;False;(2, 3, 4)" "|u1;False;(2, 3)" "|u1;False;(2, 3, 4, 1)" \
	"|u1;False;(0, 3, 4)" "|u1;False;(2, 3, 99999999999999999999)" "<f4;False;(2, 3, 4)" \
	"<f8;False;(2000000000, 2000000000, 2000000000)"; do
	IFS=';' read -r d o s <<-EOF
		$bad
	EOF
	{ npy "$d" "$o" "$s"; bytes 24; } >b.npy
	exits 3 "refused: $bad" ct-convert --scanner scan.json b.npy b.exr
done
{ npy '|u1' False '(4, 3, 2)'; bytes 24; } >b.npy
exits 5 'not the detector of the scanner file' ct-convert --scanner scan.json b.npy b.exr
has err '4 of 2x3' 'the error of another detector names both sizes'
printf 'NUMPY' >b.npy; exits 3 'a file that is not numpy is refused' ct-convert --scanner scan.json b.npy b.exr
head -c 60 a.npy >b.npy; exits 3 'numpy cut in its header is refused' ct-convert --scanner scan.json b.npy b.exr
[ ! -e b.exr ]; ok $? 'numpy that was refused leaves nothing'
if python_with numpy; then
	"$PY" - <<-'EOF'
		import numpy as np
		x = np.arange(24).reshape(2, 3, 4) * 0.25
		for name, t in (("f4", "<f4"), ("f8", ">f8"), ("i2", ">i2"), ("f2", "<f2")):
		    np.save(name, (x * 4 if name == "i2" else x).astype(t))
		np.save("nan", np.full((2, 3, 4), np.nan, "f4"))
	EOF
	exits 0 'numpy of float is read' ct-convert --scanner scan.json f4.npy f4.exr
	exits 0 'numpy of double, big-endian, is read' ct-convert --scanner scan.json f8.npy f8.exr
	exits 0 'numpy of half is read' ct-convert --scanner scan.json f2.npy f2.exr
	exits 0 'numpy of short is read with --rescale' ct-convert --rescale 0.25 --scanner scan.json i2.npy i2.exr
	if command -v oiiotool >/dev/null 2>&1; then
		for f in f4 f8 i2 f2; do oiiotool --dumpdata $f.exr | grep Pixel >d-$f; done
		[ -s d-f4 ] && cmp -s d-f4 d-f8 && cmp -s d-f4 d-i2 && cmp -s d-f4 d-f2; ok $? 'all four the same numbers'
		grep -q 'Pixel (3, 2).* 2.75' d-f4; ok $? 'rows of numpy are rows of the stack'
	else
		skip 'the same numbers' 'no oiiotool'
	fi
	exits 6 'a NaN in numpy is refused' ct-convert --scanner scan.json nan.npy b.exr
else
	skip 'numpy files' 'no numpy'
fi
done_testing
