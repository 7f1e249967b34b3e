#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-phantom and ct-project: pipes, options, statuses, what the files say.
. "$srcdir/tests/tap.sh"
small='--size 24x24x24 --spacing 4'
# shellcheck disable=SC2086
# phantoms, projections, pipes
exits 0 'ct-phantom makes a phantom of marks' ct-phantom $small marks m.nii
exits 0 'ct-project makes five projections of a phantom' ct-project -n 5 m.nii m.exr
# shellcheck disable=SC2086
ct-phantom $small marks - 2>e1 | ct-project -n 5 - - >pipe.exr 2>e2
[ -s pipe.exr ] && [ ! -s e1 ] && [ ! -s e2 ]; ok $? 'ct-phantom and ct-project work in a pipe'
ct-project -t 1 -n 5 m.nii - >one.exr; ct-project --threads=4 -n 5 m.nii - >four.exr
[ -s one.exr ] && cmp -s one.exr four.exr; ok $? 'ct-project writes the same bytes with one and four threads'
exits 0 '--like uses the geometry of another stack' ct-project --like m.exr m.nii like.exr
exits 2 '--like with -n is refused with status 2' ct-project --like m.exr -n 4 m.nii new.exr
# shellcheck disable=SC2086
exits 0 'ct-phantom --like makes closed-form projections' ct-phantom $small --like m.exr marks exact.exr
exits 3 'ct-phantom --like refuses a file that does not exist' ct-phantom --like none.exr marks new.exr
exits 2 'an unknown phantom is refused with status 2' ct-phantom $small cat new.nii
has err "'cat' is not one of ellipsoids|" 'the error of an unknown phantom lists the known ones'
exits 2 'an unknown beam is refused with status 2' ct-project --beam laser m.nii new.exr
exits 2 'a window that contradicts the file is refused with status 2' ct-project -w -512:3071 m.nii new.exr
has err '-512:3071' 'the error of a window that contradicts the file gives the window'
exits 0 'a window that is that of the file is accepted' ct-project -w -1024:3071 -n 2 m.nii same.exr
exits 2 'an unknown quantity is refused with status 2' ct-project --quantity mu m.nii new.exr
exits 4 'ct-project does not overwrite an output' ct-project -n 5 m.nii m.exr
exits 0 'ct-project -f overwrites an output' ct-project -f -n 5 m.nii m.exr
# volumes that the rays do not hit
ct-phantom -q --size 400x8x8 --spacing 4 ellipsoids - | ct-convert -q --crop 390:400,0:8,0:8 - far.nii
exits 0 'ct-project accepts a volume beside the scan' ct-project --like m.exr far.nii dark.exr
has err 'warning: far.nii: lies beside the scan: . of 5 views see it' 'ct-project warns of a volume beside the scan'
exits 5 'ct-nabgs refuses a base beside the scan with status 5' ct-nabgs -n 1 -g 9 --base far.nii m.exr new.ply
has err 'far.nii: lies beside the scan' 'the error of a base beside the scan names the base'
exits 5 'ct-fdk refuses a grid beside the scan with status 5' ct-fdk -m sirt --grid far.nii m.exr new.nii
has err 'far.nii: ' 'the error of a grid beside the scan names the grid'
[ ! -e new.exr ] && [ ! -e new.nii ] && [ ! -e new.ply ]; ok $? 'a grid or base beside the scan leaves no output'
ct-phantom -q --size 16x16x1 --spacing 1 constant slice.nii
exits 0 'ct-project accepts a slice that lies between the rows' ct-project -n 3 slice.nii missed.exr
has err 'warning: slice.nii: all projections are 0' 'ct-project warns of a slice that no ray meets'
exits 0 'ct-project of a fan projects a single slice' ct-project -n 3 --beam fan slice.nii seen.exr
[ ! -s err ]; ok $? 'ct-project does not warn of a slice that rays meet'
# geometry
exits 5 'a source inside the volume is refused with status 5' ct-project --expert dso=60 m.nii new.exr
has err '60 mm' 'the error of a source inside the volume gives its distance'
exits 5 'a fan beam with two detector rows is refused with status 5' ct-project --beam fan --det 8x2 m.nii new.exr
exits 0 'ct-project makes fan projections' ct-project --beam fan -n 3 m.nii fan.exr
exits 0 'ct-project makes parallel projections with every option of the detector' ct-project --beam parallel -n 3 --arc 90 --expert start=45 --det 20x10 \
	--expert pitch=5,6,offset=1,2 m.nii par.exr
exits 2 'a pitch of words is refused with status 2' ct-project --expert pitch=a,b m.nii new.exr
exits 5 'a detector that --coarsen does not divide is refused with status 5' ct-project --coarsen 5 m.nii new.exr
for p in point mean sinc; do
	exits 0 "ct-project makes coarse pixels of kind $p" ct-project -n 3 --coarsen 4 --pixel $p m.nii "$p.exr"
done
! cmp -s point.exr mean.exr && ! cmp -s mean.exr sinc.exr; ok $? 'point, mean and sinc pixels differ'
exits 0 'ct-project makes coarse pixels of a fan' ct-project --beam fan -n 3 --coarsen 4 --pixel mean m.nii fan4.exr
has_size() { ct-info "$1" | grep -Eq "^size +$2\$"; ok $? "$3"; }
has_size fan4.exr '6 1' 'a fan four times coarser has six columns and one row'
# methods, noise, cost
exits 0 'ct-project -m joseph interpolates along the rays' ct-project -m joseph -n 5 m.nii joseph.exr
! cmp -s joseph.exr m.exr; ok $? '-m joseph gives other values than the default'
ct-project -m joseph -t 1 -n 5 m.nii - >one.exr; ct-project -m joseph -t 3 -n 5 m.nii - >three.exr
[ -s one.exr ] && cmp -s one.exr three.exr; ok $? '-m joseph writes the same bytes with one and three threads'
for s in 1 2; do ct-project -s $s -n 2 --photons 1e4 --expert electronic=5 m.nii - >n$s.exr; done
ct-project -t 3 -s 1 -n 2 --photons 1e4 --expert electronic=5 m.nii - >t1.exr
[ -s n1.exr ] && cmp -s n1.exr t1.exr; ok $? 'noise of one seed is the same with any number of threads'
ct-info n1.exr | grep -Eq 'photons +10000'; ok $? 'a noisy stack records its number of photons'
! cmp -s n1.exr n2.exr; ok $? 'another seed gives other noise'
exits 2 'electronic noise without --photons is refused with status 2' ct-project --expert electronic=5 m.nii new.exr
exits 2 'a seed without --photons is refused with status 2' ct-project -s 1 m.nii new.exr
has err '^ct-project: --seed: needs --photons' 'the error of a seed without --photons names the missing option'
exits 0 'ct-project --dry-run reports the cost' ct-project --dry-run -n 5 m.nii new.exr
has out '^time .* s on' 'the dry run of ct-project prints the time'
has out '^memory .* MiB' 'the dry run of ct-project prints the memory'
has out '^disk .* MiB' 'the dry run of ct-project prints the size on disk'
exits 0 'ct-project accepts a start beyond a whole turn' ct-project -n 2 --expert start=725 --arc 20 m.nii turn.exr
exits 0 'ct-project accepts a start within a whole turn' ct-project -n 2 --expert start=5 --arc 20 m.nii less.exr
for f in turn less; do ct-info $f.exr | grep -E '^(min|max|mean|sd) ' >i-$f; done
[ -s i-turn ] && cmp -s i-turn i-less; ok $? 'a start of 725 degrees gives the projections of 5 degrees'
exits 0 'ct-project makes one view of one pixel' ct-project -n 1 --det 1x1 m.nii pixel.exr
exits 0 'ct-project accepts a detector that lies beside the volume' ct-project -n 1 --expert offset=9999,0 m.nii off.exr
ct-info off.exr | grep -Eq '^max +0$'; ok $? 'a detector beside the volume is dark'
printf 'not a volume' >bad.nii
exits 3 'a file that is not a volume is refused with status 3' ct-project bad.nii new.exr

# scanner files: lengths scale with the volume
cat >scan.json <<'JSON'
{"scanner": {"mode": "cone", "DSO": 5.0, "DSD": 7.0, "nDetector": [12, 16], "sDetector": [4.0, 4.0],
 "nVoxel": [24, 24, 24], "sVoxel": [2, 2, 2], "offOrigin": [0, 0, 0], "offDetector": [0, 0],
 "totalAngle": 360, "startAngle": 10, "filter": null}}
JSON
exits 0 'ct-project reads a scanner file of type R2' ct-project --scanner scan.json -n 3 m.nii r2.exr
exits 0 'ct-project makes the scan of the scanner file with its own options' ct-project -n 3 --arc 360 --expert start=10,dso=240,dsd=336 \
	--det 16x12 --expert pitch=12,16 m.nii own.exr
for f in r2 own; do cp $f.exr g.exr; ct-project --like g.exr m.nii - >like-$f; done
[ -s like-r2 ] && cmp -s like-r2 like-own; ok $? 'a scanner file gives the values of the same geometry in options'
echo '{"DSO": "far"}' >bad.json
exits 3 'a scanner file with a word as distance is refused with status 3' ct-project --scanner bad.json m.nii new.exr
has err 'bad.json: DSO' 'the error of a bad scanner file names file and key'
sed 's/"sDetector": \[/&-/' scan.json >bad.json
exits 5 'a scanner file of pixels below zero is refused with status 5' ct-project --scanner bad.json m.nii new.exr
has err 'bad.json: pixel pitch' 'the error of a refused geometry names the scanner file'
sed 's/"startAngle": [0-9.]*/"startAngle": 1e300/' scan.json >bad.json
exits 5 'a scanner file whose first view is at 1e300 degrees is refused' ct-project --scanner bad.json m.nii new.exr
echo '[1' >bad.json
exits 3 'a scanner file that is not JSON is refused with status 3' ct-project --scanner bad.json m.nii new.exr
exits 2 'parallel rays have no distances' ct-project --beam parallel --paper m.nii new.exr
exits 2 'nor a source to isocentre' ct-project --beam parallel --expert dso=10 m.nii new.exr
exits 2 '--beam with a scanner file is refused with status 2' ct-project --beam parallel --scanner scan.json m.nii new.exr
[ ! -e new.exr ] && [ ! -e new.nii ]; ok $? 'runs of ct-project that failed leave no output'

# NaN: the last voxel of a float volume
# shellcheck disable=SC2086
ct-phantom $small --expert density=0.3 sphere f.nii
if [ "$(od -An -t d2 -j 70 -N 2 f.nii | tr -d ' ')" = 16 ]; then
	head -c -4 f.nii >nan.nii; printf '\0\0\300\177' >>nan.nii
	exits 6 'a volume with a NaN is refused with status 6' ct-project nan.nii new.exr
	has err 'voxel (23,23,23) is NaN' 'the error of a volume with a NaN gives its place'
else
	ok 1 'the sphere is stored as float'
fi

# the attributes of a stack
if command -v oiiotool >/dev/null 2>&1; then
	oiiotool --info -v m.exr >info
	has info 'ct:quantity: "lineIntegral"' 'a stack records its quantity as ct:quantity'
	has info 'ct:window: "-1024:3071"' 'a stack records its window as ct:window'
	has info 'ct:volume.size: "24,24,24"' 'a stack records the grid of its volume as ct:volume.size'
	has info 'ct:scan.dso: "375"' 'a stack records its source distance, scaled to the field of view'
	exact sphere s.exr "$small" -n 1 --det 25 && oiiotool --stats s.exr >stats
	has stats 'Stats Max: 12.00000' 'the middle of a sphere is density x diameter, 0.25 x 48 mm'
else
	skip 'quantity, window, grid, distance, middle of a sphere' 'no oiiotool'
fi

for beam in parallel fan; do
	ct-project -q -f --beam $beam -n 3 --det 24 --coarsen 4 m.nii coarse.exr && ct-info coarse.exr >out
	has out "^beam  *$beam\$" "--coarsen leaves the beam: $beam"
done

# Signs and directions, against volumes that are moved by hand: --rotate of ct-project, offsets of a
# scanner file, --iso of ct-convert, --mu-water.
part geometry
command -v python3 >/dev/null || { skip 'Signs and directions, against volumes that are moved by hand' 'no python3'; done_testing; }
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

# Projections beside those of other programs: plastimatch drr (the same boxes, exactly) and
# scikit-image radon (an interpolation of its own).
part peers
if ! python_with nibabel || ! "$PY" -c 'import skimage' 2>/dev/null ||
	! command -v oiiotool >/dev/null 2>&1; then
	skip 'projections of other programs' 'no nibabel, skimage or oiiotool'
	done_testing
fi
# pixels STACK: numbers in STACK.tif, pictures below one another
pixels() { oiiotool -a "$1.exr" -d float --compression none -o "$1.tif"; }

if command -v plastimatch >/dev/null 2>&1; then
	# Its box ends in the middle of the outermost voxels, so both get a layer of air. It knows LPS and
	# no direction cosines: the object is the same where its x and y run the other way. Its view at
	# angle -a, numbered clockwise from +x of LPS, is ours at 180 + a, mu is 0.0022 (1 + HU/1000).
	"$PY" - <<-'PY'
		import nibabel as nib, numpy as np
		rng = np.random.default_rng(7)
		n, mm = (40, 36, 28), (2.0, 2.0, 2.5)
		hu = np.full(n, -1000, 'f4'); hu[4:-4, 5:-5, 3:-3] = rng.uniform(-700, 1500, (32, 26, 22))
		affine = np.diag(mm + (1.0,)); affine[:3, 3] = [-m * (k - 1) / 2 for m, k in zip(mm, n)]
		nib.save(nib.Nifti1Image((1 + hu / 1000).astype('f4'), affine), 'box.nii')
		with open('box.mha', 'wb') as f:
		    f.write(('ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n'
		             'TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = %r %r %r\nElementSpacing = %r %r %r\n'
		             'DimSize = %d %d %d\nElementType = MET_FLOAT\nElementDataFile = LOCAL\n'
		             % (tuple(affine[:3, 3].tolist()) + mm + n)).encode())
		    f.write(np.ascontiguousarray(hu[::-1, ::-1].transpose(2, 1, 0), '<f4').tobytes())
	PY
	ct-project --quantity density -n 5 --arc -180 --expert start=180,dso=400,dsd=600,pitch=2.5 --det 64 \
		box.nii box.exr && pixels box
	plastimatch drr -i exact -t pfm -r '64 64' -z '160 160' --sad 400 --sid 600 -a 5 -N 36 \
		-O drr_ -I box.mha >plastimatch.log 2>&1
	"$PY" - <<-'PY' >out 2>&1
		import numpy as np, skimage.io
		ours = skimage.io.imread('box.tif').reshape(5, 64, 64).astype(float)
		for k in range(5):
		    with open('drr_%04d.pfm' % k, 'rb') as f:
		        f.readline(); w, h = map(int, f.readline().split())
		        theirs = np.frombuffer(f.read()[-4 * w * h:], '<f4').reshape(h, w) / 0.0022
		    d = np.sqrt(np.mean((theirs - ours[k]) ** 2)) / ours.max()
		    print('view %d: rms %.2g of the largest' % (k, d)); assert d < 1e-6
	PY
	ok $? 'plastimatch drr: the same pictures'; sed 's/^/# /' out
else
	skip 'plastimatch drr: the same pictures' 'no plastimatch'
fi

# A ray of radon passes the middle of a pixel for every column; its image turns about pixel n//2.
ct-phantom --size 97x97x97 --spacing 1 shepp-logan whole.nii
"$PY" -c "import nibabel as n; v = n.load('whole.nii'); n.save(v.slicer[:, :, 47:50], 's.nii')"
ct-project --beam parallel -n 12 --det 97x3 --expert pitch=1 s.nii s.exr && pixels s
"$PY" - <<-'PY' >out 2>&1
	import nibabel as nib, numpy as np, skimage.io, warnings
	warnings.simplefilter('ignore')
	from skimage.transform import radon
	x = np.clip((nib.load('s.nii').get_fdata()[:, :, 1] + 1024) / 4095, 0, 1)
	ours = skimage.io.imread('s.tif').reshape(12, 3, 97)[:, 1].astype(float)
	fits = {}
	for flip in (False, True):
	    for start in range(0, 360, 90):
	        for way in (1, -1):
	            a = radon(x, start + way * np.arange(12) * 15.0, circle=False)
	            cut = a.shape[0] // 2 - 48
	            a = a[cut:cut + 97].T
	            a = a[:, ::-1] if flip else a
	            fits[flip, start, way] = np.sqrt(np.mean((a - ours) ** 2) / np.mean(ours ** 2))
	best = min(fits, key=fits.get)
	print('apart %.3g (flipped, first angle, direction: %s)' % (fits[best], best))
	assert fits[best] < 0.02
PY
ok $? 'scikit-image radon: within its interpolation'; sed 's/^/# /' out
done_testing
