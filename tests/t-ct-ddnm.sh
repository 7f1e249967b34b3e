#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-ddnm: statuses, threads, consistency with what was measured, interruption and resuming.
. "$srcdir/tests/tap.sh"
ct-phantom -q ellipsoids --size 32x32x32 --spacing 4 hr.nii && ct-degrade -q -x 4 hr.nii lr.nii &&
	ct-upsample -q -x 4 lr.nii up.nii && ct-project -q --views 4 up.nii up.exr &&
	ct-project -q --views 4 --coarsen 4 --pixel mean up.nii y.exr &&
	ct-project -q --views 4 --coarsen 4 --pixel sinc up.nii sinc.exr
ok $? 'a phantom, its upsampled self and both projections are made'
mkdir t1 t4 # the name of the output is in the history
# results: size, threads, pipes
(cd t1 && ct-ddnm -t 1 -x 4 --steps 3 ../y.exr a.exr); ok $? 'ct-ddnm refines projections with the shipped prior'
(cd t4 && ct-ddnm -t 4 -x 4 --steps 3 ../y.exr a.exr) && cmp -s t1/a.exr t4/a.exr
ok $? 'ct-ddnm writes the same bytes on 1 and 4 threads'
cp t1/a.exr .
fine() { grep -Eq '^size +32 32$'; }
ct-info a.exr | fine; ok $? 'the detector of the result is four times finer'
(cd t4 && ct-ddnm -t 1 -x 4 --steps 3 ../y.exr - | ct-info -) | fine
ok $? 'a result written to a pipe has the finer detector'
exits 0 'ct-ddnm accepts --init with --std and two samples' ct-ddnm -q -x 4 --expert operator=matched --sampler ddnm \
	--init up.exr --expert t-start=20 --steps 2 --samples 2 --std s.exr sinc.exr d.exr
[ -s s.exr ]; ok $? '--std writes the deviation of the samples'
# a picture, where pictures can be made and read
if ct-view -q y.exr pic.png && ! ct-ddnm -q -x 2 --steps 1 pic.png pic.exr 2>&1 | grep -q with-oiio; then
	exits 0 'ct-ddnm refines a PNG picture into a PNG picture' ct-ddnm -q -x 2 --steps 2 pic.png big.png
	head -c 4 big.png | grep -q PNG; ok $? 'the output picture is a PNG file'
	exits 0 'ct-ddnm refines a picture into an OpenEXR stack' ct-ddnm -q -x 2 --steps 2 pic.png big.exr
	{ printf 'P5\n8 8\n255\n'; printf '%064d' 0; } >zero.pgm
	{ printf 'P5\n8 8\n255\n'; printf '%064d' 1; } >one.pgm
	for p in zero one; do ct-ddnm -q -x 2 --steps 1 $p.pgm $p.exr; done
	hash() { ct-info $1.exr | sed -n "s/.* $1.pgm \(xxh3:[0-9a-f]*\).*/\1/p"; }
	[ -n "$(hash zero)" ] && [ "$(hash zero)" != "$(hash one)" ]
	ok $? 'the history of the result holds a checksum of the picture to its last pixel'
	exits 2 'projections cannot be written as a picture' ct-ddnm -q -x 4 --steps 2 y.exr y.png
else
	ok 0 'ct-ddnm refines a picture # skip no ct-view'
fi
# a dry run
exits 0 'ct-ddnm --dry-run succeeds without work' ct-ddnm --dry-run -x 4 y.exr none.exr
{ grep -q 'time' out && [ ! -e none.exr ]; }; ok $? 'a dry run prints the time and writes nothing'
# refusals
exits 4 'an existing output is not overwritten' ct-ddnm -x 4 y.exr a.exr
exits 5 'an --init of another geometry is refused' ct-ddnm -x 4 --init y.exr y.exr n.exr
ct-project -q --beam fan --views 4 --coarsen 4 --pixel mean up.nii fan.exr
exits 5 'a fan beam with one detector row is refused with status 5' ct-ddnm -x 4 --sampler none fan.exr n.exr
has err 'fan.exr: a fan has one detector row' 'the error of a fan beam says that it has one detector row'
exits 2 't-start without --init is refused with status 2' ct-ddnm -x 4 --expert t-start=9 y.exr n.exr
exits 3 'a volume instead of projections is refused with status 3' ct-ddnm -x 4 hr.nii n.exr
exits 3 'a map of deviations instead of projections is refused with status 3' ct-ddnm -x 4 s.exr n.exr
exits 3 'projections instead of a prior are refused with status 3' ct-ddnm -x 4 --prior y.exr y.exr n.exr
sed 's/"num_res_blocks":"1"/"num_res_blocks":"2"/' "$builddir/prior.safetensors" >other.safetensors
exits 3 'a prior of another architecture is refused with status 3' ct-ddnm -x 4 --prior other.safetensors y.exr n.exr
has err 'other.safetensors: .*tensor' 'the error of a prior of another architecture names file and tensor'
"$builddir/tests/t-unet" unet-b b.safetensors || exit 99
exits 0 'a prior that also learns variances is accepted' ct-ddnm -q -x 4 --steps 1 --prior b.safetensors y.exr v.exr
printf '6\0\0\0\0\0\0\0{"x":{"dtype":"F32","shape":[1],"data_offsets":[0,4]}}\0\0\0\0' >plain.safetensors
exits 3 'weights without metadata are refused as prior with status 3' ct-ddnm -x 4 --prior plain.safetensors y.exr n.exr
has err 'plain.safetensors: not a diffusion prior: no metadata' 'the error of weights without metadata names the file and what it lacks'
printf 'PK\003\004archive/data.pkl' >model.pt
exits 3 'a PyTorch checkpoint that is cut short is refused with status 3' ct-ddnm -x 4 --prior model.pt y.exr n.exr
has err 'model.pt: zip: no directory at the end' 'the error of a PyTorch checkpoint that is cut short says what its zip lacks'
[ ! -e n.exr ] && [ ! -e n.exr.state ]; ok $? 'a refused run leaves neither output nor state'
if [ -w /dev/full ]; then
	exits 4 'a full disk ends ct-ddnm with status 4' ct-ddnm -q -x 4 --steps 1 y.exr /dev/full
fi
# interrupted and resumed
ct-project -q --views 40 --coarsen 4 --pixel mean up.nii many.exr
mkdir whole cut
(cd whole && ct-ddnm -q -x 4 --steps 12 ../many.exr o.exr); ok $? 'ct-ddnm refines forty views without a stop'
cd cut || exit 99
for i in 1 2 3 4 5; do # a machine may be busy for as long as all of it takes
	rm -f o.exr
	ct-ddnm -q -x 4 --steps 12 ../many.exr o.exr & pid=$!
	listens $pid; kill -TERM $pid; wait $pid; s=$?
	[ -s o.exr.state ] && break
done
[ $s -eq 75 ]; ok $? "SIGTERM ends ct-ddnm with status 75 (got $s)"
[ -s o.exr.state ] && [ ! -e o.exr ]; ok $? 'after SIGTERM the finished views are saved as state, without an output'
exits 3 'a run with other options cannot resume the saved state' ct-ddnm -q -x 4 --steps 7 --resume ../many.exr o.exr
exits 0 'a run with the same options resumes the saved state' ct-ddnm -q -x 4 --steps 12 --resume ../many.exr o.exr
cmp -s ../whole/o.exr o.exr; ok $? 'a resumed run gives the bytes of a run without a stop'
[ ! -e o.exr.state ]; ok $? 'a resumed run removes the saved state at its end'

# ct-ddnm: every sampler alike: threads, travel, samples, a start, what it costs, interruption, resuming.
part samplers
ct-phantom -q ellipsoids --size 32x32x32 --spacing 4 hr.nii && ct-degrade -q -x 4 hr.nii lr.nii &&
	ct-upsample -q lr.nii up.nii && ct-project -q --views 2 up.nii up.exr &&
	ct-project -q --views 2 --coarsen 4 --pixel mean up.nii y.exr &&
	ct-project -q --views 8 --coarsen 4 --pixel mean up.nii many.exr
ok $? 'projections, fine and coarse'

calls() { ct-ddnm --dry-run "$@" y.exr no.exr | sed -n 's/^work *//p' | sed 's/of [0-9.]* s //g'; }
on='of the network of 32x32'
# What a sampler is asked for, of 2 views of y.exr, and what that costs.
: >results
while IFS='|' read -r options cost; do
	set -f; set -- --sampler $options; set +f
	mkdir t1 t4 whole cut # the name of the output is in the history
	(cd t1 && ct-ddnm -q -t 1 "$@" --expert travel=2,2 --samples 2 ../y.exr a.exr); ok $? "$options"
	(cd t4 && ct-ddnm -q -t 4 "$@" --expert travel=2,2 --samples 2 ../y.exr a.exr)
	cmp -s t1/a.exr t4/a.exr; ok $? 'the same bytes on 4 threads, back in time, of two samples'
	ct-info t1/a.exr | sed '/history/d' | cksum >>results
	exits 0 'a sampler begins from a picture' ct-ddnm -q -f "$@" --init up.exr --expert t-start=20 y.exr near.exr
	got=$(calls "$@"); [ "$got" = "$cost" ]; ok $? "$got"
	(cd whole && ct-ddnm -q "$@" ../many.exr o.exr)
	cd cut || exit 99
	signalled 9 15 ct-ddnm -q -t 1 "$@" ../many.exr o.exr; s=$?
	[ $s -eq 75 ] && [ -s o.exr.state ] && [ ! -e o.exr ]; ok $? "SIGTERM stops it (status $s)"
	exits 3 'another sampler cannot resume' ct-ddnm -q --resume ../many.exr o.exr
	exits 0 'a stopped sampler resumes with --resume' ct-ddnm -q "$@" --resume ../many.exr o.exr
	cd .. && cmp -s whole/o.exr cut/o.exr; ok $? 'to the same bytes'
	rm -r t1 t4 whole cut
done <<EOF2
ddim -n 8 --expert eta=0.5|16 calls $on
ddpm -n 8|16 calls $on
dpm-solver++ -n 8|16 calls $on
gdp -n 8 --expert guidance=200|16 calls $on
bird -n 2 --expert iterations=4|16 calls $on, 12 of its derivative
bird -n 2 --expert iterations=4,gradient=chain|16 calls $on
EOF2
[ "$(sort -u results | wc -l)" -eq 6 ]; ok $? 'no two give the same'

# as published, where nothing is said
costs() { got=$(calls --sampler "$1"); [ "$got" = "$2" ]; ok $? "$1: $got"; }
for s in ddnm ddnm+ simple ddim ddpm dpm-solver++; do costs $s "100 calls $on"; done
costs gdp "2000 calls $on"
costs bird "2000 calls $on, 1980 of its derivative"
costs none '0 calls of a network'

# none: what it begins with, which is no matter of a prior or of a seed
exits 0 'the sampler none is taken' ct-ddnm -q --sampler none --init up.exr y.exr a.exr
exits 0 'none, on 4 threads' ct-ddnm -q -t 4 --sampler none y.exr b.exr
exits 5 'an init of another geometry is refused' ct-ddnm -q --sampler none --init y.exr y.exr n.exr
if command -v python3 >/dev/null; then
	cp "$srcdir/tests/exr.py" .
	cat >look.py <<-'EOP'
		from exr import read
		y, up, a, b = map(read, ('y.exr', 'up.exr', 'a.exr', 'b.exr'))
		assert a == up
		at = lambda i, j: .125 * y[0][8 * i + j] + .875 * y[0][8 * i + j + 1]
		assert abs(b[0][10 * 32 + 13] - (.875 * at(2, 2) + .125 * at(3, 2))) < 1e-5 * max(y[0])
	EOP
	python3 look.py; ok $? 'is --init, or between the pixels of IN'
fi

# Every option of ct-ddnm by what it does to the numbers.
part options
command -v python3 >/dev/null || { skip 'Every option of ct-ddnm by what it does to the numbers' 'no python3'; done_testing; }
cp "$srcdir/tests/exr.py" .
cat >look.py <<'EOP'
"""What is asked of the stacks; True ends with 0."""
import math, sys
from exr import read
def flat(name):
    return sum(read(name), [])
def rms(a, b=None):
    return math.sqrt(sum((x - (b[i] if b else 0)) ** 2 for i, x in enumerate(a)) / len(a))
def means(name, w=32, s=4):
    """Means of blocks of s x s pixels, and whether one was cut at 0 or at 1.05 of the norm."""
    out, cut = [], []
    for v in read(name):
        for y in range(0, w, s):
            for x in range(0, w, s):
                block = [v[(y + i // s) * w + x + i % s] for i in range(s * s)]
                out.append(sum(block) / s ** 2)
                cut.append(min(block) <= 0 or max(block) > 1.0499 * NORM)
    return out, cut
def left(name):
    """Largest difference between IN and what A makes of OUT, where nothing was cut."""
    out, cut = means(name)
    d = [abs(a - b) for a, b, c in zip(out, Y, cut) if not c]
    assert len(d) > 30, len(d)
    return max(d)
def apart(name, other):
    """How much their difference varies within a block that neither cuts."""
    worst, seen = 0, 0
    for v, w, view in zip(read(name), read(other), range(9)):
        for y in range(0, 32, 4):
            for x in range(0, 32, 4):
                at = [(y + i // 4) * 32 + x + i % 4 for i in range(16)]
                if all(0 < u[k] < 1.0499 * NORM for u in (v, w) for k in at):
                    d = [v[k] - w[k] for k in at]
                    worst, seen = max(worst, max(d) - min(d)), seen + 1
    assert seen > 30, seen
    return worst
def rough(name):
    return sum(abs(v[i] - v[i - 1]) for v in read(name) for i in range(1, len(v)) if i % 32)
Y = flat('y.exr')
NORM = max(Y)
ok = eval(sys.argv[1])
sys.exit(not ok)
EOP
is() { python3 look.py "$1" 2>err; ok $? "$2"; sed 's/^/# /' err; } # is EXPRESSION NAME
ct-phantom -q ellipsoids --size 32x32x32 --spacing 4 hr.nii && ct-degrade -q -x 4 hr.nii lr.nii &&
	ct-upsample -q lr.nii up.nii && ct-project -q --views 2 hr.nii truth.exr &&
	ct-project -q --views 2 up.nii up.exr &&
	ct-project -q --views 2 --coarsen 4 --pixel mean hr.nii y.exr
ok $? 'projections of other sizes, fine and coarse'
is 'max(abs(a - b) for a, b in zip(Y, means("truth.exr")[0])) < 1e-3 * NORM' 'coarse ones are means'
# the blur of the matched operator, of a volume whose blur is undone and of one where it is not
blur() { # blur METHOD
	ct-upsample -qf -m "$1" lr.nii of.nii && ct-project -qf --views 2 --coarsen 4 --pixel sinc of.nii of.exr &&
		ct-ddnm -vf -n 1 of.exr o.exr 2>&1 | sed -n 's/.*operator of blur \(.*\) px$/\1/p'
}
[ "$(blur tv)" = 0 ] && [ "$(blur linear)" = 1.01919 ]; ok $? 'the blur of IN is that of the scan, unless it is undone'
ct-project -q --views 2 lr.nii rays.exr
[ "$(ct-ddnm -v -n 1 --expert operator=matched rays.exr rays-o.exr 2>&1 | sed -n 's/.*operator of blur \(.*\) px$/\1/p')" = 1.01919 ]
ok $? 'the blur of rays of a low-resolution CT is that of the same CT when it is interpolated'
run() { out=$1; shift; ct-ddnm -q -n 4 "$@" y.exr "$out"; } # run OUT OPTION...

run plain.exr --sampler ddnm
is 'left("plain.exr") < 1e-5 * NORM' '--sampler ddnm agrees with IN to rounding'
run sy0.exr --sigma-y 0
is 'flat("sy0.exr") == flat("plain.exr")' 'no noise in IN: the same'
run sy1.exr --sigma-y 0.02; run sy2.exr --sigma-y 0.2
is 'left("sy1.exr") > 1e-3 * NORM and rms(flat("sy1.exr"), flat("sy2.exr")) > 1e-3 * NORM' \
	'--sigma-y: the noisier IN, the less it says'

run half.exr --expert norm=10
is 'NORM > 12 and abs(max(flat("half.exr")) - 10.5) < 1e-5' '--norm: 1.05 of it is the most there can be'
run whole.exr --expert norm=0; run same.exr
is 'flat("whole.exr") == flat("same.exr") and 10.5 < max(flat("same.exr")) <= 1.0501 * NORM' \
	'0 is the largest of IN'

run e0.exr --expert eta=0; run e99.exr --expert eta=0.99
is 'flat("e99.exr") == flat("same.exr") and rms(flat("e0.exr"), flat("same.exr")) > 1e-3 * NORM' 'eta: 0.99 by default'

ct-project -q --views 2 --coarsen 4 --pixel sinc hr.nii sinc.exr
ct-ddnm -v -n 1 --sampler ddnm sinc.exr told.exr 2>err
has err 'operator of blur 0.6 px' 'the blur: what a coarse voxel is at the detector, of itself'
ct-phantom -q ellipsoids --size 32x32x16 --spacing 2,2,4 slab.nii &&
	ct-project -q -n 1 --det 32 --coarsen 4 --pixel sinc slab.nii slab.exr
ct-ddnm -v -n 1 --sampler ddnm slab.exr told.exr -f 2>err
has err 'operator of blur 0.8 px' 'of voxels that are no cubes: the mean along their axes'

run t11.exr --expert travel=1,1; run t23.exr --expert travel=2,3; run again.exr -t 1 --expert travel=2,3
is 'flat("t11.exr") == flat("same.exr")' '--travel 1,1 goes nowhere'
is 'rms(flat("t23.exr"), flat("same.exr")) > 1e-3 * NORM and flat("t23.exr") == flat("again.exr")' \
	'--travel 2,3 does, the same way each time'
exits 2 'more than a thousand returns of a step are refused' ct-ddnm -n 1 --expert travel=1,1001 slab.exr no.exr
run k1.exr; run k2.exr --samples 2 --std s2.exr; run k3.exr --samples 3 --std s3.exr
is 'max(abs(s - math.sqrt(2) * abs(a - m)) for a, m, s in zip(*map(flat, ("k1.exr", "k2.exr", "s2.exr")))) < 1e-4 * NORM' \
	'--std of two samples is that of the two'
is '0.5 < rms(flat("s3.exr")) / rms(flat("s2.exr")) < 2 and rms(flat("s3.exr")) > 1e-4 * NORM' '--std of three'

"$builddir/tests/t-unet" unet-a a.safetensors || exit 99
for r in mean first; do
	run $r.exr -n 2 -p a.safetensors --expert channel-reduce=$r
done
is 'rms(flat("mean.exr"), flat("first.exr")) > 1e-3 * NORM' '--channel-reduce: the first is not the mean'

# recorded figures: from pure noise, and from projections of an upsampled volume
run noise.exr -n 20
is 'abs(rms(flat("noise.exr"), flat("truth.exr")) - 1.755) < 0.1' 'from noise: 1.76 density mm off the truth'
run sr.exr --init up.exr --expert t-start=20 --sampler ddnm -n 5 --samples 4
is 'abs(rms(flat("up.exr"), flat("truth.exr")) - 0.898) < 0.01' 'the upsampled volume: 0.90'
is 'abs(rms(flat("sr.exr"), flat("truth.exr")) - 0.730) < 0.02' 'from its projections: 0.73'

# projections of a refined CT: what the prior begins from, and is held to
exits 0 'ct-ddnm takes projections of a refined CT without an option' ct-ddnm -q up.exr own.exr
is 'len(flat("own.exr")) == len(flat("up.exr"))' 'of a refined CT the result is as fine as IN'
ct-ddnm -q --samples 1 up.exr one.exr
is '0 < rms(flat("own.exr"), flat("up.exr")) < .35 * rms(flat("one.exr"), flat("up.exr"))' 'of a refined CT only what four samples agree on is kept'
python3 - <<-'EOP'
	from exr import read
	low = lambda v: [sum(v[y * 32 + x] * __import__('math').cos(3.141592653589793 * k * (x + .5) / 32) for y in range(32) for x in range(32)) for k in range(6)]
	for a, b in zip(read('own.exr'), read('up.exr')):
	    assert all(abs(p - q) < 1e-4 * 32 * 32 * max(b) for p, q in zip(low(a), low(b)))
EOP
ok $? 'of a refined CT the result keeps the low frequencies of IN'
ct-info own.exr >out; has out '^deviation-mean  *0*\.[0-9]*[1-9]' 'the deviation of the samples travels in the result'
ct-ddnm -qf --samples 4 --std alone.exr up.exr own2.exr
is 'read("own.exr", "deviation") == read("own2.exr", "deviation") == read("alone.exr")' '--std writes the deviation that the result carries'
ct-convert -q --projections integral --views 1:2 own.exr part.exr
is 'read("part.exr", "deviation") == read("own.exr", "deviation")[1:2]' 'views that are kept keep their own deviation'
exits 0 'ct-nabgs weights pixels by what IN carries' ct-nabgs -q -n 20 -g 100 -b up.nii own.exr w1.ply
exits 0 'ct-nabgs weights pixels by --uncertainty' ct-nabgs -q -n 20 -g 100 -b up.nii --uncertainty alone.exr own.exr w2.ply
bare() { ct-info "$1" | sed '/history/,$d; /^file/d'; }
bare w1.ply >w1; bare w2.ply >w2; cmp -s w1 w2; ok $? 'what IN carries weights as --uncertainty does'
exits 2 'a deviation of one sample is refused' ct-ddnm --samples 1 --std no.exr up.exr no2.exr
exits 0 'with a factor projections of a refined CT are made finer' ct-ddnm -q -x 2 -n 1 up.exr finer.exr
ct-info finer.exr | grep -Eq '^size +64 64$'; ok $? 'the result has that many times the pixels'
exits 0 'the start of a refined CT may be another' ct-ddnm -qf --expert t-start=60 --steps 2 --samples 2 up.exr far.exr
is 'rms(flat("far.exr"), flat("up.exr")) > rms(flat("own.exr"), flat("up.exr"))' 'a later start changes more of a refined CT'
ct-upsample -q -x 1,1,3 --sigma 0 hr.nii odd.nii && ct-project -q --views 2 --det 30x22 odd.nii odd.exr
exits 0 'ct-ddnm takes unequal factors and a detector that they do not divide' ct-ddnm -q odd.exr odd-o.exr
ct-info odd-o.exr | grep -Eq '^size +30 22$'; ok $? 'the result of such a refined CT has the size of IN'

# a stack that says no coarsening, of a volume that was reduced
ct-phantom -q --size 16x16x16 --spacing 4 ellipsoids fine.nii; ct-degrade -q -x 4 fine.nii four.nii; ct-project -q -n 1 four.nii four.exr
exits 2 'a factor that contradicts that of the volume is refused with status 2' ct-ddnm -x 8 four.exr no.exr
has err 'factor 8 contradicts four.exr, whose factor is 4' 'the error of a factor that contradicts that of the volume gives both'
done_testing
