#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-convert --crop: boxes of voxels and of millimetres, and the body.
. "$srcdir/tests/tap.sh"
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
done_testing
