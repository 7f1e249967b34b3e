#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-nabgs and ct-compose: the pair, statuses, streams, what a stop leaves and a resume makes of it.
. "$srcdir/tests/tap.sh"
psnr() { ct-metrics "$1" "$2" | sed -n 's/^psnr //p'; }
above() { awk "BEGIN {exit !($1 > $2)}"; } # above A B
nan_at_end() { # nan_at_end FROM TO: the last float of an uncompressed file becomes NaN
	cp "$1" "$2"
	printf '\000\000\300\177' | dd of="$2" bs=1 conv=notrunc 2>/dev/null \
		seek=$(($(wc -c <"$1") - 4))
}
ct-phantom --size=32x32x32 --spacing=4 ellipsoids hr.nii
ct-degrade -x 4 hr.nii lr.nii && ct-upsample lr.nii up.nii
ct-project --views 20 hr.nii p.exr && ct-project --views 20 up.nii up.exr
[ -s up.nii ] && [ -s up.exr ]; ok $? 'volumes and projections for this test are made'
fit() { ct-nabgs -b up.nii -n 200 -g 1500 --expert max-gaussians=1500 "$@"; }

# fitting and composing
exits 0 'ct-nabgs fits a residual to projections' fit --base-projections=up.exr p.exr res.ply
has out '^negative [1-9]' 'ct-nabgs prints the number of negative Gaussians'
has out '^positive [1-9]' 'ct-nabgs prints the number of positive Gaussians'
above "$(sed -n 's/^first-loss //p' out)" "$(awk '/^last-loss/ {print 2 * $2}' out)"
ok $? 'the loss of the fit falls to less than half'
[ ! -e res.ply.state ]; ok $? 'a fit that ended leaves no state'
ct-info --json res.ply | tr -d ' \n' | grep -q '"affine":\[\[4.0,0.0,0.0,-62.0\],\[0.0,4.0'
ok $? 'the set of Gaussians records the grid of its base'
exits 0 'ct-compose adds a set of Gaussians to its base' ct-compose --residual-out=r.nii up.nii res.ply out.nii
above "$(psnr hr.nii out.nii)" "$(psnr hr.nii up.nii) + 2"; ok $? 'the sum is 2 dB nearer to the truth than the base'
above "$(psnr hr.nii up.nii)" "$(ct-compose -g -1 up.nii res.ply - | psnr hr.nii -) + 2"
ok $? 'with -g -1 the sum is 2 dB farther from the truth than the base'
exits 0 'ct-compose adds a residual volume to the base' ct-compose up.nii r.nii two.nii
! grep -q 'whole CT' err; ok $? 'ct-compose does not take a residual for a whole CT'
ct-compose up.nii hr.nii - 2>err >/dev/null; has err '^ct-compose: warning: hr.nii: [0-9]* % of its voxels are below -500 HU, as in a whole CT' 'ct-compose warns of a whole CT for a residual'
above "$(psnr out.nii two.nii 2>&1 | sed s/inf/999/)" 100
ok $? 'a residual volume gives the sum of its set of Gaussians'
exits 0 'ct-nabgs --json fits without --base-projections' fit --json p.exr j.ply
grep -q '"negative": [1-9]' out; ok $? 'JSON of ct-nabgs has the number of negative Gaussians'

# when a fit ends
ct-nabgs --json --expert tolerance=0.8 -b up.nii -n 200 -g 1500 --expert max-gaussians=1500 p.exr tol.ply >tol 2>err
grep -q '"ended-by": "tolerance"' tol && grep -q '"iterations": [1-9]*[0-9]' tol &&
	awk '/"error"/ && !seen {seen = 1; gsub(/[,"]/, ""); exit !($2 <= 0.8 && $2 > 0)}' tol
ok $? 'a fit ends when the error is below the tolerance'
[ "$(sed -n 's/.*"iterations": \([0-9]*\).*/\1/p' tol)" -lt 200 ]
ok $? 'a fit with a tolerance ends before its last iteration'
exits 0 'ct-nabgs accepts projections of the base itself' ct-nabgs -b up.nii up.exr none.ply
! grep -q 'is of a CT of' err; ok $? 'projections of the base are not warned of'
has out '^gaussians 0' 'projections of the base need no Gaussian'
has out '^ended-by nothing to fit' 'projections of the base end the fit with nothing to fit'
has out '^iterations 0' 'projections of the base take no iteration'
exits 0 'ct-compose accepts a set without Gaussians' ct-compose up.nii none.ply none.nii
[ "$(psnr up.nii none.nii)" = inf ]; ok $? 'a set without Gaussians leaves the base as it was'
ct-project -q -n 8 lr.nii coarse.exr
coarse() { ct-nabgs -f -b up.nii -n 1 -g 50 --expert max-gaussians=50 "$@" coarse.exr coarse.ply; }
exits 0 'ct-nabgs fits to projections of the coarse CT' coarse
has err '^ct-nabgs: warning: coarse.exr: is of a CT of .* voxels, and up.nii has .*: what that CT lacks is taken for residual; project up.nii instead' 'ct-nabgs warns of projections of a CT coarser than its base'
exits 0 'ct-nabgs --paper fits to projections of the coarse CT' coarse --paper
! grep -q 'is of a CT of' err; ok $? 'ct-nabgs --paper, whose way that is, does not warn of them'

# other grids
exits 0 'ct-compose --spacing accepts the spacing of the base' ct-compose --spacing=4 up.nii res.ply same.nii
[ "$(psnr out.nii same.nii)" = inf ]; ok $? 'ct-compose --spacing of the base gives the same volume'
exits 0 'ct-compose --spacing accepts half the spacing of the base' ct-compose --spacing=2 up.nii res.ply fine.nii
ct-info fine.nii >out; has out '^size *64 64 64' 'half the spacing gives eight times the voxels'
has out '^extent-mm *128 128 128' 'half the spacing keeps the box of the base'
ct-degrade -x 2 --sigma=0 --decimate=mean fine.nii coarse.nii
above "$(psnr out.nii coarse.nii)" 25; ok $? 'half the spacing, averaged again, gives the same object'
exits 0 'ct-compose --spacing accepts more than twice the spacing' ct-compose --spacing=9 up.nii res.ply thick.nii
ct-info thick.nii >out; has out '^size *15 15 15' 'a spacing of 9 mm covers the box of the base'
exits 2 '--spacing with a residual volume is refused with status 2' ct-compose --spacing=2 up.nii r.nii no.nii
exits 2 'a spacing of 0.0001 mm is refused with status 2' ct-compose --spacing=0.0001 up.nii res.ply no.nii

# threads and pipes
mkdir one four
(cd one && ct-nabgs -q -t 1 -b ../up.nii -n 120 -g 900 ../p.exr r.ply)
(cd four && ct-nabgs -q -t 4 -b ../up.nii -n 120 -g 900 ../p.exr r.ply)
cmp one/r.ply four/r.ply; ok $? 'ct-nabgs writes the same bytes with 1 and 4 threads'
ct-nabgs -b up.nii -n 10 -g 300 - - <p.exr >s.ply 2>err && [ ! -s err ]
ok $? 'ct-nabgs reads and writes pipes without a message'
ct-compose up.nii - - <s.ply >s.nii; [ -s s.nii ] && [ ! -e -.state ]
ok $? 'ct-compose reads and writes pipes without a state'
ct-compose -q - s.ply s2.nii <up.nii; ok $? 'ct-compose reads the base from standard input'

# signals and resuming
mkdir whole killed stopped
long() { cd "$1" && shift && exec setsid ct-nabgs -q -b ../up.nii -n 700 -g 1000 --expert max-gaussians=1100 \
	--checkpoint-every=50 "$@" ../p.exr r.ply; } # becomes the command: call it in a subshell
(long whole); ok $? 'a fit of 700 iterations ends without a stop'
(export CTSR_TEST_SIGNAL='ct-nabgs 300 9'; long killed)
[ $? -eq 137 ] && [ -e killed/r.ply.state ] && [ ! -e killed/r.ply ]
ok $? 'SIGKILL leaves the state and no output'
(long killed) 2>err; [ $? -eq 4 ]; ok $? 'a state is not overwritten without --resume'
(long killed --resume); ok $? '--resume continues a fit that was killed'
cmp whole/r.ply killed/r.ply; ok $? 'a resumed fit writes the bytes of a fit without a stop'
[ ! -e killed/r.ply.state ]; ok $? 'a resumed fit removes the state at its end'
(export CTSR_TEST_SIGNAL='ct-nabgs 300 15'; long stopped)
[ $? -eq 75 ]
ok $? 'SIGTERM ends ct-nabgs with status 75'
exits 3 'a state of other options is refused with status 3' sh -c \
	'cd stopped && ct-nabgs -b ../up.nii -n 701 --resume ../p.exr r.ply'
has err 'r.ply.state' 'the error of a state of other options names the state'
head -c 3000 stopped/r.ply.state >cut && mv cut stopped/r.ply.state
(long stopped --resume) 2>err; [ $? -eq 3 ]; ok $? 'a state that is cut short is refused with status 3'

# --paper, r2-compat, --lr
exits 0 'ct-nabgs --paper fits a residual' fit --paper p.exr paper.ply
ct-compose up.nii paper.ply paper.nii
above "$(psnr hr.nii paper.nii)" "$(psnr hr.nii up.nii) + 3"
ok $? '--paper comes 3 dB nearer to the truth than the base'
exits 0 'r2-compat fits a residual as R2-Gaussian does' fit --expert r2-compat=yes p.exr compat.ply
! cmp -s paper.ply compat.ply; ok $? 'r2-compat gives another set of Gaussians than --paper'

agrees() { ct-compose up.nii "$1" - | ct-degrade -f -x 4 - again.nii && psnr lr.nii again.nii; }
ct-project --views 3 hr.nii few.exr
exits 0 'ct-nabgs fits three views without --lr' ct-nabgs -b up.nii -n 200 -g 1000 --expert max-gaussians=1000 few.exr few.ply
exits 0 'ct-nabgs fits three views with --lr' ct-nabgs -b up.nii --lr=lr.nii -n 200 -g 1000 \
	--expert max-gaussians=1000 few.exr lr.ply
above "$(agrees lr.ply)" "$(agrees few.ply) + 1"; ok $? 'with --lr the sum agrees better with the low-resolution CT'
exits 2 '--lr with mode full is refused with status 2' fit --lr=lr.nii -m full p.exr no.ply

# fits that diverge
mkdir fast
far() { cd fast && ct-nabgs -q -b ../up.nii -n 200 -g 1000 --checkpoint-every=1 --paper -m full \
	--expert rate=1000 "$@" ../p.exr r.ply; }
(far) 2>err; [ $? -eq 6 ]; ok $? 'a rate a thousand times too high with --paper ends with status 6'
has err 'iteration [0-9]*: the [A-Z0-9a-z]* term' 'the error of a fit that diverges names iteration and term'
[ -e fast/r.ply.state ] && [ ! -e fast/r.ply ]; ok $? 'a fit that diverges leaves the last good state and no output'
cp fast/r.ply.state good
(far --resume) 2>again; [ $? -eq 6 ] && cmp -s err again && cmp -s good fast/r.ply.state
ok $? 'the state of a fit that diverges resumes to the same error'
exits 0 'a rate a thousand times too high without --paper is fitted' ct-nabgs -v -b up.nii -n 60 -g 1000 --expert rate=1000 p.exr slow.ply
has err 'beginning anew with rates 0.25 times' 'ct-nabgs -v reports that it begins again with lower rates'
awk '/^error / {exit !($2 < 1)}' out; ok $? 'after a start with lower rates the error is below 1'

# Easy scenes, at the default rates: one small thing without noise, of 2, 4 and 8 voxels.
for edge in 2 4 8; do
	ct-phantom -f --size=${edge}x${edge}x$edge --expert density=0.5 cube thing.nii &&
		ct-convert -f --cube 32 thing.nii easy.nii && ct-degrade -f -x 4 easy.nii easy-lr.nii &&
		ct-upsample -f easy-lr.nii easy-up.nii && ct-project -f --views=20 easy.nii easy.exr
	exits 0 "ct-nabgs fits a cube of $edge voxels" ct-nabgs -f -b easy-up.nii -n 60 -g 3000 easy.exr easy.ply
	awk '/^error / {exit !($2 < 0.5)}' out; ok $? "a cube of $edge voxels is fitted to half its error at the default rates"
done

# The last iteration that adds and removes: 600 is the first that may.
control() { ct-nabgs -f -b up.nii -n $1 -g 200 --expert densify-until=$2 p.exr until.ply |
	sed -n 's/^gaussians //p'; }
[ "$(control 601 599)" -eq 200 ]; ok $? 'densify-until=599 adds and removes no Gaussian'
[ "$(control 601 600)" -ne 200 ]; ok $? 'densify-until=600 adds or removes Gaussians'
[ "$(control 600 600)" -eq 200 ]; ok $? 'the last iteration adds and removes no Gaussian'

# what a set records
ct-project -q -n 20 --coarsen 4 --pixel mean hr.nii y.exr && ct-ddnm -q -n 2 --samples 2 --std s.exr y.exr fine.exr
exits 0 'ct-nabgs accepts --uncertainty, --lr and --base-projections together' ct-nabgs -q -b up.nii -n 1 -g 100 --expert max-gaussians=100 -s 77 \
	--base-projections up.exr --uncertainty s.exr --lr lr.nii fine.exr all.ply
ct-info all.ply >out
has out '^  mode  *residual$' 'a set of Gaussians records mode residual'
has out '^  seed  *77$' 'a set of Gaussians records its seed'
has out '^  window  *-1024:3071$' 'a set of Gaussians records its window'
has out '^  quantity  *residual$' 'a set in mode residual records the quantity residual'
has out '^  ct-nabgs .* # fine.exr xxh3:[0-9a-f]* up.nii xxh3:[0-9a-f]* up.exr xxh3:[0-9a-f]* s.exr xxh3:[0-9a-f]* lr.nii xxh3:[0-9a-f]*$' \
	'a set of Gaussians records its inputs with checksums'
exits 0 'ct-nabgs --mode full fits with softplus' fit -m full -a softplus p.exr full.ply
has out '^negative 0' 'a set with softplus has no negative Gaussian'
ct-info full.ply >out; has out '^  mode  *full$' 'a set of Gaussians records mode full'
has out '^  quantity  *density$' 'a set in mode full records the quantity density'
exits 0 'ct-compose accepts a set in mode full' ct-compose up.nii full.ply f.nii
above "$(psnr hr.nii f.nii)" 20; ok $? 'mode full reaches 20 dB without the values of the base'
exits 0 'ct-nabgs --dry-run accepts all options of a fit' fit --dry-run p.exr dry.ply
grep -q '^time ' out && grep -q '^memory ' out && grep -q '^disk ' out
ok $? 'the dry run of ct-nabgs prints time, memory and disk'
[ ! -e dry.ply ]; ok $? 'the dry run of ct-nabgs writes no set'

# refusals of ct-nabgs
exits 2 'ct-nabgs without --base is refused with status 2' ct-nabgs p.exr no.ply
exits 2 'two inputs from standard input are refused by ct-nabgs' ct-nabgs -b - - no.ply
exits 2 'max-gaussians below the number at the start is refused' ct-nabgs -b up.nii -g 50 --expert max-gaussians=20 p.exr no.ply
exits 2 '--resume with standard output is refused with status 2' ct-nabgs -b up.nii --resume p.exr -
exits 2 'a window that is not that of the projections is refused' ct-nabgs -b up.nii -w -512:3071 p.exr no.ply
exits 3 'a volume instead of projections is refused with status 3' ct-nabgs -b up.nii up.nii no.ply
exits 3 'projections instead of a base are refused with status 3' ct-nabgs -b p.exr p.exr no.ply
exits 4 'ct-nabgs does not overwrite its output' ct-nabgs -b up.nii p.exr res.ply
ct-project --views 21 up.nii more.exr
exits 5 'base projections of another number of views are refused with status 5' ct-nabgs -b up.nii --base-projections=more.exr p.exr no.ply
has err 'more.exr' 'the error of base projections of another scan names the file'
ct-project --beam fan --views 20 hr.nii fan.exr
exits 5 'fan-beam projections are refused with status 5' ct-nabgs -b up.nii --mode full fan.exr no.ply
has err '^ct-nabgs: fan.exr: Gaussians are projected in cone or parallel beam' 'the error of fan-beam projections names the file and the beams'
nan_at_end up.nii nan.nii
exits 6 'a NaN in the base is refused by ct-nabgs with status 6' ct-nabgs -b nan.nii p.exr no.ply
has err 'nan.nii: voxel (31,31,31) is NaN' 'the error of a NaN in the base gives its voxel'
ct-phantom --size=8x8x8 --expert density=0.01 constant thin.nii
exits 3 'mode full from a base near zero is refused with status 3' ct-nabgs -b thin.nii -m full p.exr no.ply
has err '^ct-nabgs: thin.nii: no voxel has a density above 0.05, where Gaussians could begin$' 'the error of a base near zero names the file and the threshold'
[ ! -e no.ply ] && [ ! -e no.ply.state ]; ok $? 'refused runs of ct-nabgs leave neither set nor state'

# refusals and --floor of ct-compose
exits 6 'a NaN in the base is refused by ct-compose with status 6' ct-compose nan.nii res.ply no.nii
exits 6 'a NaN in the residual is refused by ct-compose with status 6' ct-compose up.nii nan.nii no.nii
exits 5 'a residual on another grid is refused with status 5' ct-compose up.nii lr.nii no.nii
has err 'lr.nii: grids differ' 'the error of a residual on another grid names the file'
exits 3 'projections instead of a residual are refused with status 3' ct-compose up.nii p.exr no.nii
exits 3 'a set that is cut short is refused with status 3' sh -c 'head -c 2000 res.ply | ct-compose up.nii - no.nii'
exits 4 'ct-compose does not overwrite its output' ct-compose up.nii res.ply out.nii
exits 2 'two inputs from standard input are refused by ct-compose' ct-compose - - no.nii
[ ! -e no.nii ]; ok $? 'refused runs of ct-compose leave no volume'
exits 0 'ct-compose accepts a --floor of -100 HU' ct-compose --floor=-100 up.nii res.ply floor.nii
value() { ct-info "$1" | awk -v k="$2" '$1 == k {print $2}'; }
[ "$(value floor.nii min)" = -100 ] && [ "$(value out.nii min)" -lt -900 ]; ok $? 'no voxel is below --floor'
[ "$(value floor.nii max)" = "$(value out.nii max)" ]; ok $? '--floor leaves the highest voxel as it was'

# Options of ct-nabgs by what they do to the Gaussians and to the loss.
part options
command -v python3 >/dev/null || { skip 'options of ct-nabgs change what they should' 'no python3'; done_testing; }
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

# --uncertainty: pixels that are not certain count less; projections that carry how far their samples differ need none
ct-project -q --views 12 --coarsen 4 --pixel mean hr.nii y.exr
ct-ddnm -q -n 2 y.exr one.exr && ct-ddnm -q -n 2 --samples 2 --std s.exr y.exr two.exr
fit() { ct-nabgs -q -b up.nii -g 300 --expert max-gaussians=300 -n 20 "$@"; }
fit one.exr none.ply >none.txt; fit --uncertainty s.exr one.exr std.ply >std.txt
fit two.exr carried.ply >carried.txt; fit --uncertainty s.exr two.exr given.ply >given.txt
is 'apart("carried.ply", "given.ply", "density") == 0' 'the deviation that projections carry weighs as --uncertainty does'
is 'apart("std.ply", "none.ply", "density") > 1e-3' '--uncertainty weighs'
exits 0 'a fit that makes the projections worse ends' ct-nabgs -b up.nii -g 100 --expert max-gaussians=200,rate=30 -n 24 p.exr worse.ply
has err 'warning: the error of the fit is .* times that without Gaussians' 'a fit that explains nothing gives a warning'

# ct-compose to the number: gain, floor and window voxel by voxel; where the voxels of --spacing are, and
# what they say of the operator.
part compose
command -v python3 >/dev/null || { skip 'ct-compose to the number' 'no python3'; done_testing; }
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
	ct-info c.nii | grep -q " up.nii xxh3:.* r.ply xxh3:.* $lr xxh3:"; ok $? "the history names base, residual and $lr with checksums"
	sed -n "s/.* differs from $lr by \(.*\) HU RMS, \(.*\) before\$/\1 \2/p" err >by
	awk '{exit !(NF == 2 && $1 < 0.01 && $2 > 0.5)}' by; ok $? "differs no more: $(cat by)"
done
ct-degrade -q -x 4 c.nii again.nii && ct-metrics --json --max rmse-hu=0.01 lr.nii again.nii >out; ok $? 'degraded it is the low resolution'
ct-degrade -q -x 4 -p release c.nii first.nii; exits 0 'a scan of the first voxels of cells counts as that' ct-compose -q -f --consistent first.nii up.nii r.ply first-o.nii
ct-metrics --consistency first.nii --json --max residual-rms-hu=0.01 first-o.nii >out; ok $? 'then it differs no more from the scan of first voxels'
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

# Constants suppose at most 4095 HU: in a window 16 times as wide, numbers are others and the residual is the same.
ball t.nii 0:1000 0.7 && ball b.nii 0:1000 0.6
for o in -q --paper --mode=full; do
	for w in 3095 64520; do
		ct-project -f -q -w -1000:$w --views 8 t.nii p.exr && ct-nabgs -f -q $o -b b.nii -n 620 -g 300 p.exr r.ply &&
			ct-compose -f -q b.nii r.ply $w.nii
	done
	ct-metrics -w -1000:3095 --min psnr=100 3095.nii 64520.nii >out; ok $? "$o: a wide window has the residual in HU of 4095"
done

# Gaussians as a pickle of numpy arrays, as R2-Gaussian keeps them: theirs are read, ours are loaded by
# Python, and none is executed.
part pickle
python_with numpy || { skip 'Gaussians as a pickle' 'no numpy'; done_testing; }
ct-phantom -q --size=16x12x8 --spacing=2 sphere base.nii; ok $? 'a base is made'
cat >make.py <<'END'
import os, pickle, numpy as np
r = np.random.default_rng(3)
n = 5
d = {'xyz': r.uniform(-.4, .4, (n, 3)).astype('f4'), 'density': r.uniform(-4, -1, (n, 1)).astype('f4'),
     'scale': r.uniform(-3, 0, (n, 3)).astype('f4'), 'rotation': r.normal(size=(n, 4)).astype('f4'),
     'scale_bound': np.array([.01, .3])}
def save(name, d, p=4, old=False):
    b = pickle.dumps(d, p)
    assert b'numpy.core' in b or b'numpy._core' in b
    if old:  # the names of the other numpy
        b = b.replace(b'\x8c\x15numpy.core.multiarray', b'\x8c\x16numpy._core.multiarray') \
             .replace(b'numpy.core.multiarray\n', b'numpy._core.multiarray\n')
        at = 2 if b[2] != 0x95 else 11
        if b[2] == 0x95:
            b = b[:3] + (len(b) - 11).to_bytes(8, 'little') + b[11:]
    open(name, 'wb').write(b)
for p in 2, 3, 4, 5: save('p%d.pickle' % p, d, p)
for p in 2, 4: save('new%d.pickle' % p, d, p, True)
save('swapped.pickle', {k: v.astype('>f8') for k, v in d.items()})
save('fortran.pickle', {k: np.asfortranarray(v) for k, v in d.items()})
free = dict(d, scale_bound=None, scale=np.log(.01 + .29 / (1 + np.exp(-d['scale']))).astype('f4'))
save('free.pickle', free)
bad = d['xyz'].copy(); bad[3, 1] = np.nan
save('nan.pickle', dict(d, xyz=bad))
save('shape.pickle', dict(d, rotation=d['rotation'][:, :3]))
save('few.pickle', dict(d, density=d['density'][:2]))
save('words.pickle', dict(d, xyz='far'))
save('bound.pickle', dict(d, scale_bound=np.array([.3, .01])))
save('less.pickle', {k: v for k, v in d.items() if k != 'density'})
save('empty.pickle', dict(d, xyz=d['xyz'][:0]))
b = open('p4.pickle', 'rb').read()
open('cut.pickle', 'wb').write(b[:len(b) // 2])
class Evil:
    def __reduce__(self): return os.system, ('touch executed',)
pickle.dump({'xyz': Evil()}, open('evil.pickle', 'wb'), 4)
pickle.dump({'xyz': Evil()}, open('evil2.pickle', 'wb'), 2)
pickle.dump({'xyz': (1).__add__}, open('getattr.pickle', 'wb'), 4)
# the density on the grid of the base: +-1 is half the longest axis, 16 mm
q = d['rotation'] / np.linalg.norm(d['rotation'], axis=1, keepdims=True)
w, x, y, z = q.T
R = np.array([[1-2*(y*y+z*z), 2*(x*y-w*z), 2*(x*z+w*y)], [2*(x*y+w*z), 1-2*(x*x+z*z), 2*(y*z-w*x)],
              [2*(x*z-w*y), 2*(y*z+w*x), 1-2*(x*x+y*y)]]).transpose(2, 0, 1)
s = 16 * (.01 + .29 / (1 + np.exp(-d['scale'].astype('f8'))))
i, j, k = np.indices((16, 12, 8))
at = np.stack([2 * i - 15, 2 * j - 11, 2 * k - 7], -1).reshape(-1, 3)
rho = np.log1p(np.exp(d['density'][:, 0].astype('f8')))
def field(rho):
    f = 0
    for m in range(n):
        u = ((at - 16 * d['xyz'][m]) @ R[m]) / s[m]
        f = f + rho[m] * np.exp(-.5 * (u * u).sum(1))
    return f
raw = d['density'][:, 0].astype('f8')
np.save('want.npy', np.stack([field(rho), field(np.where(raw < 0, .25 * raw, raw))]))
END
"$PY" make.py 2>log; ok $? 'Python makes the pickles of this test'
sed 's/^/# /' log
cat >look.py <<'END'
"""The residual of a volume, HU, against the density at each voxel by the formula."""
import struct, sys, numpy as np
b = open(sys.argv[1], 'rb').read()
got = np.frombuffer(b[-16 * 12 * 8 * 4:], '<f4').reshape(8, 12, 16).transpose(2, 1, 0).ravel() / 4095.
want = np.load('want.npy')[int(sys.argv[2])]
off = np.abs(got - want).max()
print(off, np.abs(want).max())
sys.exit(not off < 0.015 * np.abs(want).max())  # they are cut where they are a hundredth
END
drawn() { # drawn FILE WHICH NAME [OPTION...]
	file=$1 which=$2 name=$3; shift 3
	ct-compose -q -f "$@" --residual-out=res.nii base.nii "$file" out.nii 2>err && ct-convert -q -f --type f32 res.nii f.nii &&
		"$PY" look.py f.nii "$which" >log 2>&1; ok $? "$name"
	sed 's/^/# /' err log
}
for p in 2 3 4 5; do drawn p$p.pickle 0 "a pickle of protocol $p is read: each voxel has its density"; done
for p in 2 4; do drawn new$p.pickle 0 "the names of the other numpy are read, protocol $p"; done
drawn swapped.pickle 0 'doubles of the other order of bytes are read'
drawn fortran.pickle 0 'columns first are read'
drawn free.pickle 0 'without scale_bound the scales are logarithms'
drawn p4.pickle 1 'a slope makes them PReLU' --expert gamma=0.25
ct-compose -q -f base.nii p4.pickle by.nii && "$builddir/tests/one-step" compose base.nii p4.pickle lib.nii && ct-convert -q -f --type f32 by.nii a.nii &&
	ct-convert -q -f --type f32 lib.nii b.nii && tail -c 6144 a.nii >a && tail -c 6144 b.nii >b && cmp -s a b
ok $? 'the library composes a pickle to the voxels of ct-compose'
exits 0 'ct-info tells of Gaussians of R2-Gaussian' ct-info p4.pickle
has out '^gaussians  *5' 'ct-info counts the Gaussians of a pickle'
no() { # no FILE WORDS NAME
	exits 3 "$3 is refused with status 3" ct-info "$1"
	has err "$1: $2" "the error of $3 names file and key"
}
no nan.pickle "key 'xyz': number 1 of Gaussian 3 is not finite" 'a number that is not finite'
no shape.pickle "key 'rotation': is not of shape 5x4" 'another shape'
no few.pickle "key 'density': is not of shape 5x1" 'too few densities'
no words.pickle "key 'xyz': " 'a word for an array'
no bound.pickle "key 'scale_bound': 0.3 and 0.01" 'a bound that is none'
no less.pickle "key 'density' is missing" 'a key that is missing'
no empty.pickle "key 'scale': is not of shape 0x3" 'no point beside five scales'
no cut.pickle '.*ends ' 'a pickle that is cut'
no evil.pickle 'STACK_GLOBAL at byte .*: posix.system is nothing' 'a pickle that would run a command'
no evil2.pickle 'GLOBAL at byte .*: posix.system is nothing' 'an old pickle that would run a command'
no getattr.pickle 'STACK_GLOBAL at byte .*getattr is nothing' 'a pickle that looks for a function'
[ ! -e executed ]; ok $? 'no command of a pickle is run'

# ours
ct-project -q -n 4 base.nii p.exr && ct-degrade -q -x 2 base.nii lr.nii && ct-upsample -q lr.nii up.nii
exits 0 'ct-nabgs writes a pickle' ct-nabgs -q -b up.nii -g 40 -n 3 p.exr g.pickle
exits 0 'and PLY of the same' ct-nabgs -q -b up.nii -g 40 -n 3 p.exr g.ply
"$PY" - >log 2>&1 <<'END'; ok $? 'Python loads our pickle: arrays, shapes and no bound'
import pickle, numpy as np
d = pickle.load(open('g.pickle', 'rb'))
assert d['xyz'].dtype == np.float32 and d['xyz'].shape == (40, 3) and np.abs(d['xyz']).max() <= 1.1, d['xyz']
assert d['density'].shape == (40, 1) and d['scale'].shape == (40, 3) and d['rotation'].shape == (40, 4)
assert d['scale_bound'] is None and d['scale'].max() < 0
assert d['activation'] == 'prelu' and 0 < float(d['gamma']) <= 1
END
sed 's/^/# /' log
ct-compose -q -f --residual-out=ra.nii up.nii g.pickle a.nii && ct-compose -q -f --residual-out=rb.nii up.nii g.ply b.nii && ct-metrics --range 1000 ra.nii rb.nii >m
awk '$1 == "max-hu" && $2 < 0.05 {good = 1} END {exit !good}' m && [ "$(ct-info rb.nii | awk '$1 == "sd" {print ($2 > 0.1)}')" != 0 ]; ok $? 'ours is read again, and makes the same CT'
sed 's/^/# /' m
ct-project -q -n 4 up.nii own.exr && ct-nabgs -q -b up.nii own.exr none.pickle >log && ct-nabgs -q -b up.nii own.exr none.ply >log
exits 0 'a pickle of no Gaussian, as ct-nabgs writes it, is read' ct-compose -q -f up.nii none.pickle same.nii
ct-compose -q -f up.nii none.ply other.nii && ct-metrics --ssim none other.nii same.nii | awk '$1 == "max-hu" {same = $2 == 0} END {exit !same}'
ok $? 'and gives what an empty PLY gives'
# axes that are no world's, in another order and mirrored
for o in LPS ASR LAS; do
	ct-convert -q -f --reorient=$o up.nii o.nii
	ct-nabgs -q -f -b o.nii -g 40 -n 3 p.exr o.pickle; ct-nabgs -q -f -b o.nii -g 40 -n 3 p.exr o.ply
	ct-compose -q -f --residual-out=ra.nii o.nii o.pickle a.nii && ct-compose -q -f --residual-out=rb.nii o.nii o.ply b.nii &&
		ct-metrics --range 1000 ra.nii rb.nii >m; awk '$1 == "max-hu" && $2 < 0.01 {good = 1} END {exit !good}' m
	ok $? "a pickle keeps Gaussians on a grid of axes $o"
done
done_testing
