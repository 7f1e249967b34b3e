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
has out '^gaussians 0' 'projections of the base need no Gaussian'
has out '^ended-by nothing to fit' 'projections of the base end the fit with nothing to fit'
has out '^iterations 0' 'projections of the base take no iteration'
exits 0 'ct-compose accepts a set without Gaussians' ct-compose up.nii none.ply none.nii
[ "$(psnr up.nii none.nii)" = inf ]; ok $? 'a set without Gaussians leaves the base as it was'

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
done_testing
