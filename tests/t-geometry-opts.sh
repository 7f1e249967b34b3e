#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Signs and directions, against volumes that are moved by hand: --rotate of ct-project, offsets of a
# scanner file, --iso of ct-convert, --mu-water.
. "$srcdir/tests/tap.sh"
command -v python3 >/dev/null || { echo '1..0 # SKIP no python3'; exit 0; }
cat >move.py <<'EOP'
"""move.py IN OUT 12 numbers: the affine of a NIfTI-1 file, times the old one from the left."""
import struct, sys
b = bytearray(open(sys.argv[1], 'rb').read())
old = [list(struct.unpack_from('<4f', b, 280 + 16 * r)) for r in range(3)] + [[0, 0, 0, 1]]
m = [[float(x) for x in sys.argv[3 + 4 * r:7 + 4 * r]] for r in range(3)]
for r in range(3):
    row = [sum(m[r][k] * old[k][c] for k in range(4)) for c in range(4)]
    struct.pack_into('<4f', b, 280 + 16 * r, *row)
struct.pack_into('<h', b, 252, 0)  # no qform
open(sys.argv[2], 'wb').write(b)
EOP
cp "$srcdir/tests/exr.py" .
same() { python3 exr.py "$1" "$2"; ok $? "$3"; }     # same A B NAME
differ() { ! python3 exr.py "$1" "$2"; ok $? "$3"; } # differ A B NAME
ct-phantom -q --size 24x24x24 --spacing 4 marks m.nii
scan='-n 3 --arc 150 --expert start=10'

# about each axis, counter-clockwise seen from its tip; about x first, z last
c=0.8660254 s=0.5
python3 move.py m.nii x.nii 1 0 0 0  0 $c -$s 0  0 $s $c 0
python3 move.py m.nii y.nii $c 0 $s 0  0 1 0 0  -$s 0 $c 0
python3 move.py m.nii z.nii $c -$s 0 0  $s $c 0 0  0 0 1 0
python3 move.py x.nii xz.nii $c -$s 0 0  $s $c 0 0  0 0 1 0
# shellcheck disable=SC2086
ct-project -q $scan m.nii m.exr
for a in x y z xz; do
	case $a in x) by=30,0,0 ;; y) by=0,30,0 ;; z) by=0,0,30 ;; xz) by=30,0,30 ;; esac
	ct-project -q --like m.exr --expert rotate="$by" m.nii "r-$a.exr"
	ct-project -q --like m.exr "$a.nii" "h-$a.exr"
	same "r-$a.exr" "h-$a.exr" "--rotate $by turns the volume so"
done
differ r-x.exr m.exr 'and does turn it'
# an offset volume turns about its centre
python3 move.py m.nii off.nii 1 0 0 100  0 1 0 -50  0 0 1 20
# shellcheck disable=SC2086
ct-project -q $scan off.nii off.exr
# shellcheck disable=SC2086
ct-project -q $scan --expert rotate=0,0,30 off.nii roff.exr
same off.exr m.exr 'the scan is about the centre of the volume'
same roff.exr r-z.exr 'and so is the turn'
# turning the volume is turning the scan the other way
ct-project -q -n 3 --arc 150 --expert start=-20 m.nii back.exr
same back.exr r-z.exr 'a turn about z is a scan that starts as much earlier'

# a scan about a volume far from the world's origin is inverted like one that is not
for v in m off; do ct-project -q -f -n 30 --arc 360 $v.nii whole.exr; ct-fdk -q --grid $v.nii whole.exr $v-fdk.nii; done
tail -c 55296 m-fdk.nii >there; tail -c 55296 off-fdk.nii | cmp -s - there; ok $? 'FDK knows where the orbit is'

# offsets: the volume is away from the isocentre, the detector from the middle; v up, rows down. Lengths
# are in units of 48 mm here.
cat >off.json <<'JSON'
{"DSO": 5.0, "DSD": 7.0, "nDetector": [12, 16], "sDetector": [4.0, 4.0], "nVoxel": [24, 24, 24],
 "sVoxel": [2, 2, 2], "offOrigin": [0.125, -0.25, 0.3], "offDetector": [0.25, 0.5], "totalAngle": 360,
 "startAngle": 10}
JSON
ct-project -q --scanner off.json -n 3 m.nii json.exr
ct-project -q -n 3 --arc 360 --expert start=10,dso=240,dsd=336 --det 16x12 --expert pitch=12,16 \
	--expert offset=12,-24 m.nii like.exr
python3 move.py m.nii moved.nii 1 0 0 6  0 1 0 -12  0 0 1 14.4
ct-project -q --like like.exr moved.nii hand.exr
same json.exr hand.exr 'offOrigin and offDetector'
ct-project -q --like like.exr m.nii not.exr
differ json.exr not.exr 'neither is nothing'

# --mu-water: noise of attenuation is that of the photons, in density the less the more a mm attenuates
for mu in 0.01 0.03; do ct-project -q -n 2 --photons 1e4 --expert mu-water="$mu" m.nii "mu$mu.exr"; done
ct-project -q -n 2 m.nii clean.exr
python3 - <<'EOP'
import math, sys
from exr import read
clean = sum(read('clean.exr'), [])
def noise(name): # beside the object
    d = [x - c for x, c in zip(sum(read(name), []), clean) if c <= 0]
    return math.sqrt(sum(y * y for y in d) / len(d))
one, three = noise('mu0.01.exr'), noise('mu0.03.exr')
print('# %g %g' % (one, three))
sys.exit(not (three > 0 and abs(one / three - 3) < 0.2))
EOP
ok $? '--mu-water is the unit of the noise'

# --iso: a Gaussian of sqrt(step^2 - 1)/2 voxels, then cubic interpolation, here midway between voxels:
# gain exp(-2 pi^2 0.75 f^2) (9 cos(pi f) - cos(3 pi f))/8 of a wave of f cycles a voxel
for wave in 16 3; do
	python3 -c "
import math, struct
open('w.raw', 'wb').write(b''.join(struct.pack('<f', 100 * math.cos(2 * math.pi * (i + 0.25) / $wave))
                                   for k in range(2) for j in range(2) for i in range(128)))"
	ct-convert -q -f --raw 128x2x2:f32:1 w.raw w.nii
	ct-convert -q -f --iso 2 w.nii "iso$wave.nii"
done
python3 - <<'EOP'
import math, struct, sys
bad = 0
for wave in 16, 3:
    b = open('iso%d.nii' % wave, 'rb').read()
    x = struct.unpack_from('<64f', b, int(struct.unpack_from('<f', b, 108)[0]))[12:36]  # whole periods
    gain = math.sqrt(2 * sum(y * y for y in x) / len(x)) / 100
    f = math.pi / wave
    want = math.exp(-1.5 * f * f) * (9 * math.cos(f) - math.cos(3 * f)) / 8
    print('# a wave of %d: %g, want %g' % (wave, gain, want))
    bad += abs(gain - want) > 0.005
sys.exit(bad)
EOP
ok $? '--iso: what is kept and what is not'
done_testing
