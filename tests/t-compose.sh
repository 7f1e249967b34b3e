#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-compose to the number: gain, floor and window voxel by voxel; where the voxels of --spacing are, and
# what they say of the operator.
. "$srcdir/tests/tap.sh"
command -v python3 >/dev/null || { echo '1..0 # SKIP no python3'; exit 0; }
cat >look.py <<'END'
"""What is asked of volumes; True ends with 0."""
import json, math, struct, subprocess, sys
def vol(name): # of float voxels
    b = open(name, 'rb').read()
    assert struct.unpack_from('<h', b, 70)[0] == 16, name
    at, n = int(struct.unpack_from('<f', b, 108)[0]), struct.unpack_from('<3h', b, 42)
    return struct.unpack_from('<%df' % (n[0] * n[1] * n[2]), b, at)
def info(name):
    return json.loads(subprocess.check_output(('ct-info', '--json', name)))
def said(name):
    m = info(name).get('metadata', {})
    return {k: [float(x) for x in m[k].split(',')] for k in ('factor', 'sigma') if k in m}
def apart(a, b):
    return max(abs(x - y) for x, y in zip(a, b))
def compose(base, res, gain, floor, lo, hi):
    """The definition: the base within [min(lo, floor), hi], plus gain times the residual, not below floor."""
    return [max(min(max(x, min(lo, floor)), hi) + gain * r, floor) for x, r in zip(vol(base), vol(res))]
ok = eval(sys.argv[1])
sys.exit(not ok)
END
is() { python3 look.py "$1" 2>err; ok $? "$2"; sed 's/^/# /' err; } # is EXPRESSION NAME
ct-phantom -q --size 20x24x28 --spacing 4 ellipsoids hr.nii && ct-degrade -q -x 4 hr.nii lr.nii &&
	ct-upsample -q lr.nii up.nii && ct-convert -q --type f32 up.nii b.nii &&
	ct-project -q --views 8 hr.nii p.exr && ct-nabgs -q -b up.nii -n 20 -g 300 p.exr r.ply >/dev/null
exits 0 'the residual as a volume' ct-compose --residual-out r.nii b.nii r.ply o.nii
is 'max(map(abs, vol("r.nii"))) > 10 and apart(vol("o.nii"), compose("b.nii", "r.nii", 1, -1024, -1024, 3071)) < 1e-3' 'is added'
ct-phantom -q --size 400x8x8 --spacing 4 cube - | ct-convert -q --crop 390:400,0:8,0:8 - far.nii
exits 0 'Gaussians beside the base' ct-compose far.nii r.ply far-o.nii; has err 'warning: r.ply: 0 of .* Gaussians touch the grid of far.nii' 'add nothing, which is said'
exits 0 'other gain, other floor' ct-compose -g -2.5 --floor -700 --residual-out r2.nii b.nii r.ply g.nii
is 'apart(vol("g.nii"), compose("b.nii", "r.nii", -2.5, -700, -1024, 3071)) < 1e-3' 'are those'
is 'vol("r2.nii") == vol("r.nii") and info("r.nii")["quantity"] == "residual"' 'the residual is that before both'
ct-compose --floor -3000 -g 3 b.nii r.nii low.nii
is 'apart(vol("low.nii"), compose("b.nii", "r.nii", 3, -3000, -1024, 3071)) < 1e-3' 'a floor below the window'
tail -c $((20 * 24 * 28 * 4)) b.nii >b.raw && tail -c $((20 * 24 * 28 * 4)) r.nii >r.raw
for f in b r; do ct-convert -q --raw 20x24x28:f32:4 --orient RAS $f.raw bare-$f.nii; done
exits 0 'a window of its own' ct-compose -w -900:50 bare-b.nii bare-r.nii w.nii
has err 'bare-b.nii: [0-9]* voxels are above 50 HU' 'says what it cuts'
has err 'bare-b.nii: [0-9]* voxels are below -900 HU, down to -1[0-9.]*, and become -900 ' 'and what it lifts'
exits 0 'a floor below all' ct-compose -w -900:50 --floor -3000 bare-b.nii bare-r.nii w2.nii; ! grep -q 'are below' err; ok $? 'a floor below all values lifts nothing'
is 'apart(vol("w.nii"), compose("b.nii", "r.nii", 1, -900, -900, 50)) < 1e-3' 'the base, and is the floor'

# a whole object needs of the base its grid alone
ct-nabgs -q -m full -b up.nii -n 20 -g 300 p.exr full.ply >/dev/null
ct-compose -q up.nii full.ply f1.nii && ct-compose -q hr.nii full.ply f2.nii
is 'vol("f1.nii") == vol("f2.nii") and max(vol("f1.nii")) > -900 and min(vol("f1.nii")) == -1024' 'full: LO stands for the base'

# voxels of another size begin where the old ones do, and the operator is in voxels
for mm in 2 3 5 16; do ct-compose -q -g 0 -s $mm up.nii r.ply s$mm.nii; done
exits 0 'so large that no operator is left' ct-compose -g 0 -s 17 up.nii r.ply s17.nii
is 'all(info("s%d.nii" % mm)["size"] == [math.ceil(n * 4 / mm) for n in (20, 24, 28)] for mm in (2, 3, 5, 16, 17))' '--spacing covers the box'
is 'all(info("s%d.nii" % mm)["spacing-mm"] == [mm] * 3 for mm in (2, 3, 5, 16, 17))' 'in voxels of that'
is 'all(abs(info("s%d.nii" % mm)["affine"][a][3] - mm / 2 + 2 * n) < 1e-4 for mm in (2, 3, 5, 16, 17) for a, n in enumerate((20, 24, 28)))' \
	'from its corner'
is 'said("up.nii")["factor"] == [4] * 3 and abs(said("up.nii")["sigma"][0] - 4 / 2.3548) < 1e-4' 'the base says an operator'
is 'all(abs(said("s%d.nii" % mm)[k][a] * mm - said("up.nii")[k][a] * 4) < 1e-5 for mm in (2, 3, 5, 16) for k in ("factor", "sigma") for a in range(3))' \
	'that of the new voxels is as large'
is 'said("s17.nii") == {} and "decimate" not in info("s17.nii")["metadata"]' 'none where they are coarser than the low resolution'
ct-convert -q --iso 2 --type f32 up.nii iso.nii # cubic, on the same voxels
is 'apart(vol("s2.nii"), [max(x, -1024) for x in vol("iso.nii")]) < 0.01' 'interpolated as ct-convert --iso does'
ct-compose -q -s 4 up.nii r.ply same.nii
is 'vol("same.nii") == vol("o.nii")' 'in the same voxels the same'
ct-convert -q --type f32 hr.nii h.nii; ct-compose -q -g 0 -s 2 h.nii r.ply none.nii
is 'said("none.nii") == {}' 'a base that says none gets none'

# --consistent: what the low resolution lacked is no more; LR says the operator, or else the base
for lr in lr.nii bare-lr.nii; do
	[ $lr = lr.nii ] || { ct-convert -q --type f32 lr.nii - | tail -c $((5 * 6 * 7 * 4)) >lr.raw
		ct-convert -q --raw 5x6x7:f32:16 --orient RAS lr.raw bare-lr.nii; }
	exits 0 "--consistent $lr" ct-compose -v -f --consistent $lr up.nii r.ply c.nii
	sed -n "s/.* differs from $lr by \(.*\) HU RMS, \(.*\) before\$/\1 \2/p" err >by
	awk '{exit !(NF == 2 && $1 < 0.01 && $2 > 0.5)}' by; ok $? "differs no more: $(cat by)"
done
ct-degrade -q -x 4 c.nii again.nii && ct-metrics --json --max rmse-hu=0.01 lr.nii again.nii >out; ok $? 'degraded it is the low resolution'
ct-fdk -q --quantity density p.exr d.nii 2>/dev/null
exits 3 'density is no base' ct-compose d.nii r.ply no.nii
has err 'd.nii: quantity is density, not hu' 'the error of a density as a base says hu'
exits 3 'a density is refused as a residual' ct-compose up.nii d.nii no.nii
has err 'd.nii: quantity is density, not residual' 'the error of a density as a residual says residual'
exits 3 'projections are no residual' ct-compose up.nii p.exr no.nii
has err 'p.exr: is stack, not Gaussians or a volume' 'the error of projections as a residual says stack'
exits 0 'HU are a residual if they do not say otherwise' ct-compose up.nii bare-r.nii hu.nii
is 'vol("hu.nii") == vol("o.nii")' 'the same one'
exits 3 'neither says an operator' ct-compose --consistent bare-lr.nii bare-b.nii bare-r.nii no.nii
has err 'bare-lr.nii: neither it nor bare-b.nii says what operator made it' 'the error of a scan of unknown operator names both files'
[ ! -e no.nii ]; ok $? 'compositions that were refused leave nothing'

# The window from HU to density and back: what is composed is what was fitted, beyond its ends too.
part window
inside() { ct-metrics -w -512:1000 t.nii "$1" | sed -n 's/^psnr //p'; }
above() { awk "BEGIN {exit !($1 > $2)}"; } # above A B
ball() { # ball FILE OUTSIDE:ONE DENSITY: no metadata, so that it is projected in any window
	ct-phantom -f --size=24x24x24 --spacing=2 --window=$2 --expert density=$3 sphere with.nii &&
		tail -c $((24 * 24 * 24 * 4)) with.nii >bare.raw &&
		ct-convert -f --units hu --raw 24x24x24:f32:2 --orient=RAS bare.raw "$1"
}
project() { ct-project -f -q -w -512:1000 --views 20 "$@"; }
beyond() { # beyond NAME: the truth t.nii, the base b.nii
	project t.nii t.exr && project b.nii b.exr
	exits 0 "$1: fits" ct-nabgs -f -b b.nii -n 300 -g 2000 t.exr r.ply
	exits 0 'ct-compose writes --residual-out of a window' ct-compose -f --residual-out=r.nii b.nii r.ply c.nii
	above "$(inside c.nii)" "$(inside b.nii) + 6"; ok $? 'to what was fitted'
	cp err warn; rm r.nii
}

# A nodule in a lung that the window cuts off.
ball t.nii -850:150 0.55 && ball b.nii -850:150 0.0001
beyond 'below'
has warn 'b.nii: [0-9]* voxels are below -512 HU, down to -850, and become -512' 'a cut below, as of air, is told'
ct-compose -f --floor=-2000 -g 0 b.nii r.ply low.nii
ct-info low.nii >info; grep -q '^min *-850' info; ok $? 'a floor below the window keeps what is there'
ct-compose -f -g 0 b.nii r.ply low.nii
ct-info low.nii >info; grep -q '^max *-512' info; ok $? 'else it ends at the window'

# Metal that is none.
ball t.nii 0:1000 0.7 && ball b.nii 0:2000 0.8
beyond 'above'
has warn 'b.nii: [0-9]* voxels are above 1000 HU, up to 1600' 'a warning says what was cut'
ct-project -f -w -512:1000 -n 2 b.nii p.exr 2>warn
has warn 'b.nii: [0-9]* voxels are above 1000 HU' 'as it does where they are projected'
ct-project -f -w -512:1600 -n 2 b.nii p.exr 2>warn && [ ! -s warn ]; ok $? 'in a wider window none'

# ct-fuse composes likewise.
ct-degrade -f -x 2 t.nii lr.nii
exits 0 'ct-fuse writes --residual-out of a window' ct-fuse -f --residual-out=r.nii b.nii lr.nii t.exr f.nii
has err 'above 1000 HU, up to 1600' 'ct-fuse warns of values above the window'
ct-compose -f -q b.nii r.nii same.nii && [ "$(ct-metrics f.nii same.nii | sed -n 's/^psnr //p')" = inf ]
ok $? 'to what ct-compose makes of its residual'
exits 3 'a residual is no base' ct-compose r.nii r.ply no.nii
has err 'r.nii: quantity is residual, not hu' 'and that is said'
done_testing
