#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Options of ct-nabgs by what they do to the Gaussians and to the loss.
. "$srcdir/tests/tap.sh"
command -v python3 >/dev/null || { echo '1..0 # SKIP no python3'; exit 0; }
cat >look.py <<'EOP'
"""What is asked of sets and logs; True ends with 0."""
import math, re, struct, sys
def ply(name):
    """Properties of the Gaussians, a list each."""
    head, body = open(name, 'rb').read().split(b'end_header\n', 1)
    names = re.findall(r'^property float (\S+)$', head.decode(), re.M)
    rows = list(struct.iter_unpack('<%df' % len(names), body))
    return {n: [r[i] for r in rows] for i, n in enumerate(names)}
def terms(name):
    """Of each logged iteration: the loss, and weights and terms it is the sum of."""
    number = r'([-+0-9.e]+)'
    found = re.findall('loss %s = %s L1 %s . %s .1 - SSIM. %s . %s TV %s . %s LR %s;' % ((number,) * 9),
                       open(name).read())
    return [[float(x) for x in f] for f in found]
def adds_up(t):
    return abs(t[0] - sum(t[k] * t[k + 1] for k in (1, 3, 5, 7))) < 1e-3 * t[0]
def apart(a, b, name):
    return max(abs(x - y) for x, y in zip(ply(a)[name], ply(b)[name]))
ok = eval(sys.argv[1])
sys.exit(not ok)
EOP
is() { python3 look.py "$1" 2>err; ok $? "$2"; sed 's/^/# /' err; } # is EXPRESSION NAME
ct-phantom -q --size=24x24x24 --spacing=4 ellipsoids hr.nii && ct-degrade -q -x 4 hr.nii lr.nii &&
	ct-upsample -q lr.nii up.nii && ct-project -q --views 12 hr.nii p.exr
ok $? 'a scene to fit is made'
fit() { out=$1; shift; ct-nabgs -b up.nii -g 300 --expert max-gaussians=900 "$@" p.exr "$out.ply" >"$out.txt" 2>"$out.log"; }

fit w0 -v -n 1; fit w1 -v -n 1 --expert lambda-tv=0.5 --lr lr.nii --expert lambda-ssim=2,lambda-lr=3
fit w2 -v -n 1 --lr lr.nii --expert lambda-ssim=0
is 'len(terms("w0.log")) == 1 and all(adds_up(terms(w + ".log")[0]) for w in ("w0", "w1", "w2"))' \
	'the loss is the sum of its terms'
is 'terms("w0.log")[0][3::2] == [0.5, 0.05, 0]' 'weights of SSIM and TV, none of a low-resolution CT'
is 'terms("w1.log")[0][3::2] == [2, 0.5, 3] and terms("w2.log")[0][3::2] == [0, 0.05, 0.1]' '--lambda-ssim, --lambda-tv, --lambda-lr'
is 'terms("w0.log")[0][2:7:2] == terms("w1.log")[0][2:7:2] and terms("w1.log")[0][8] > 0' \
	'weigh the same terms'
for l in 0 30; do fit lr$l -v -n 150 --lr lr.nii --expert lambda-lr=$l; ct-compose -q up.nii lr$l.ply lr$l.nii; done
again() { ct-degrade -q -f -x 4 "$1" again.nii && ct-metrics lr.nii again.nii | sed -n 's/^psnr //p'; }
awk "BEGIN {exit !($(again lr30.nii) > $(again lr0.nii) + 1)}"; ok $? 'and the heavier one is heeded'

# of a base that does not say by how much it was refined
ct-phantom -q --size=24x24x24 --spacing=4 sphere ball.nii
for x in 4 8; do fit "x$x" -n 1 --paper -x $x -b ball.nii; done
fit x0 -n 1 --paper --expert rate=0.001 -b ball.nii
is 'abs(apart("x4.ply", "x0.ply", "scale_1") / apart("x8.ply", "x0.ply", "scale_1") - 10) < 0.2' \
	'-x 8: the rate of scale is a tenth'
is 'abs(apart("x4.ply", "x0.ply", "y") / apart("x8.ply", "x0.ply", "y") - 1) < 0.01' 'that of position is not'
is 'abs(apart("x4.ply", "x0.ply", "scale_1") / 5e-3 - 1) < 0.02' 'and at 4-fold its first is the published one'

# of one that does, by its largest factor: the rate of scale at 8 is a tenth of that at 4
for x in 4 8; do
	ct-phantom -q --size=24x24x24 --spacing=4 ellipsoids fine.nii -f && ct-degrade -qf -x 1,1,$x fine.nii thick.nii && ct-upsample -qf -m linear thick.nii b$x.nii
	fit "b$x" -n 1 --paper -b b$x.nii; fit "c$x" -n 1 --paper --expert rate=0.001 -b b$x.nii
done
is 'abs(apart("b4.ply", "c4.ply", "scale_1") / apart("b8.ply", "c8.ply", "scale_1") - 10) < 1' 'a base of slices counts by their factor'
exits 2 'another factor contradicts it' ct-nabgs -x 2 -b b4.nii -n 1 p.exr no.ply
has err 'which was reduced 4 times' 'and that is named'

# numbers change every 100 iterations after 500: here at 600 alone
fit d0 -n 650; fit d1 -n 650 --expert densify-until=601; fit d2 -n 650 --expert densify-until=599
is 'len(ply("d2.ply")["x"]) == 300 and len(ply("d1.ply")["x"]) > 300' '--densify-until ends it'
is 'ply("d1.ply") == ply("d0.ply")' 'and not before'

# text and JSON tell the same
fit j0 -n 650 --json
python3 - >err 2>&1 <<'EOP'
import json
o, rows = json.load(open('j0.txt')), [l.split(' ', 1) for l in open("d0.txt").read().splitlines()]
want = dict(rows)
for k, v in o.items():
    assert v == want[k] if isinstance(v, str) else abs(v - float(want[k])) <= 1e-5 * abs(v), (k, v, want[k])
assert o['positive'] + o['negative'] == o['gaussians'] > 0 and o['iterations'] == 650, o
EOP
ok $? 'the report of ct-nabgs has its figures'; sed 's/^/# /' err

for a in prelu softplus relu sine; do
	fit "a-$a" -n 150 -a $a; ct-compose -q up.nii "a-$a.ply" "a-$a.nii"
	grep -aq "^comment ct:activation=$a\$" "a-$a.ply"; ok $? "-a $a is what the set says"
done
db() { ct-metrics hr.nii "$1" | sed -n 's/^psnr //p'; }
echo "# $(db up.nii): prelu $(db a-prelu.nii) softplus $(db a-softplus.nii) relu $(db a-relu.nii) sine $(db a-sine.nii)"
grep -q '^negative 0$' a-relu.txt && grep -q '^negative [1-9]' a-sine.txt; ok $? 'relu has no sign, sine has'
for a in prelu sine; do
	awk "BEGIN {exit !($(db a-$a.nii) > $(db up.nii) + 1)}"; ok $? "$a gains more than 1 dB"
done
awk "BEGIN {exit !($(db a-relu.nii) < $(db a-prelu.nii))}"; ok $? 'relu gains less than prelu'
is 'abs(min(ply("a-relu.ply")["density"])) < 1 and min(ply("a-sine.ply")["density"]) < -1e-3' 'raw densities'

# --uncertainty: pixels that are not certain count less
ct-project -q --views 12 --coarsen 4 --pixel mean hr.nii y.exr
ct-ddnm -q -n 2 --samples 2 --std s.exr y.exr noisy.exr
for w in none std; do
	[ $w = none ] && set -- || set -- --uncertainty s.exr
	ct-nabgs -q -b up.nii -g 300 --expert max-gaussians=300 -n 20 "$@" noisy.exr $w.ply >$w.txt
done
is 'apart("std.ply", "none.ply", "density") > 1e-3' '--uncertainty weighs'
exits 0 'a fit that makes the projections worse ends' ct-nabgs -b up.nii -g 100 --expert max-gaussians=200,rate=30 -n 24 p.exr worse.ply
has err 'warning: the error of the fit is .* times that without Gaussians' 'a fit that explains nothing gives a warning'
done_testing
