#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Every option of ct-ddnm by what it does to the numbers.
. "$srcdir/tests/tap.sh"
command -v python3 >/dev/null || { echo '1..0 # SKIP no python3'; exit 0; }
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
ok $? 'projections, fine and coarse'
is 'max(abs(a - b) for a, b in zip(Y, means("truth.exr")[0])) < 1e-3 * NORM' 'coarse ones are means'
# the blur of the matched operator, of a volume whose blur is undone and of one where it is not
blur() { # blur METHOD
	ct-upsample -qf -m "$1" lr.nii of.nii && ct-project -qf --views 2 of.nii of.exr &&
		ct-ddnm -vf -n 1 --expert operator=matched of.exr o.exr 2>&1 | sed -n 's/.*operator of blur \(.*\) px$/\1/p'
}
[ "$(blur tv)" = 0 ] && [ "$(blur linear)" = 4.07678 ]; ok $? 'the blur of IN is that of the scan, unless it is undone'
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
# a stack that says no coarsening, of a volume that was reduced
ct-phantom -q --size 16x16x16 --spacing 4 ellipsoids fine.nii; ct-degrade -q -x 4 fine.nii four.nii; ct-project -q -n 1 four.nii four.exr
exits 2 'a factor that contradicts that of the volume is refused with status 2' ct-ddnm -x 8 four.exr no.exr
has err 'factor 8 contradicts four.exr, whose factor is 4' 'the error of a factor that contradicts that of the volume gives both'
done_testing
