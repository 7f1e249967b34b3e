#!/bin/sh
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
[ -s up.nii ] && [ -s up.exr ]; ok $? 'a scene to work on'
fit() { ct-nabgs -b up.nii -n 200 -g 1500 --expert max-gaussians=1500 "$@"; }

exits 0 'fits' fit --base-projections=up.exr p.exr res.ply
has out '^negative [1-9]' 'reports negative Gaussians'
has out '^positive [1-9]' 'and positive ones'
above "$(sed -n 's/^first-loss //p' out)" "$(awk '/^last-loss/ {print 2 * $2}' out)"
ok $? 'the loss falls to less than half'
[ ! -e res.ply.state ]; ok $? 'no state is left'
ct-info --json res.ply | tr -d ' \n' | grep -q '"affine":\[\[4.0,0.0,0.0,-62.0\],\[0.0,4.0'
ok $? 'the set says on which grid'
exits 0 'composes' ct-compose --residual-out=r.nii up.nii res.ply out.nii
above "$(psnr hr.nii out.nii)" "$(psnr hr.nii up.nii) + 2"; ok $? 'gains 2 dB over the base'
above "$(psnr hr.nii up.nii)" "$(ct-compose -g -1 up.nii res.ply - | psnr hr.nii -) + 2"
ok $? 'and loses them with the sign turned'
exits 0 'adds a residual volume' ct-compose up.nii r.nii two.nii
above "$(psnr out.nii two.nii 2>&1 | sed s/inf/999/)" 100; ok $? 'which is the same'
exits 0 'JSON' fit --json p.exr j.ply
grep -q '"negative": [1-9]' out; ok $? 'with the counts'

ct-nabgs --json --expert tolerance=0.8 -b up.nii -n 200 -g 1500 --expert max-gaussians=1500 p.exr tol.ply >tol 2>err
grep -q '"ended-by": "tolerance"' tol && grep -q '"iterations": [1-9]*[0-9]' tol &&
	awk '/"error"/ && !seen {seen = 1; gsub(/[,"]/, ""); exit !($2 <= 0.8 && $2 > 0)}' tol
ok $? 'ends when the error is small enough'
[ "$(sed -n 's/.*"iterations": \([0-9]*\).*/\1/p' tol)" -lt 200 ]; ok $? 'and before its time'
exits 0 'a scene without residual' ct-nabgs -b up.nii up.exr none.ply
has out '^gaussians 0' 'needs no Gaussian'
has out '^ended-by nothing to fit' 'and says so'
has out '^iterations 0' 'and ends at once'
exits 0 'composes with none' ct-compose up.nii none.ply none.nii
[ "$(psnr up.nii none.nii)" = inf ]; ok $? 'to the base as it was'

exits 0 'another grid' ct-compose --spacing=4 up.nii res.ply same.nii
[ "$(psnr out.nii same.nii)" = inf ]; ok $? 'of the same spacing is the same'
exits 0 'twice as fine' ct-compose --spacing=2 up.nii res.ply fine.nii
ct-info fine.nii >out; has out '^size *64 64 64' 'has eight times the voxels'
has out '^extent-mm *128 128 128' 'in the same box'
ct-degrade -x 2 --sigma=0 --decimate=mean fine.nii coarse.nii
above "$(psnr out.nii coarse.nii)" 25; ok $? 'and is the same object'
exits 0 'and coarser' ct-compose --spacing=9 up.nii res.ply thick.nii
ct-info thick.nii >out; has out '^size *15 15 15' 'covers the box'
exits 2 'a volume is not rendered anew' ct-compose --spacing=2 up.nii r.nii no.nii
exits 2 'too fine a grid' ct-compose --spacing=0.0001 up.nii res.ply no.nii

mkdir one four
(cd one && ct-nabgs -q -t 1 -b ../up.nii -n 120 -g 900 ../p.exr r.ply)
(cd four && ct-nabgs -q -t 4 -b ../up.nii -n 120 -g 900 ../p.exr r.ply)
cmp one/r.ply four/r.ply; ok $? '1 and 4 threads, same bytes'
ct-nabgs -b up.nii -n 10 -g 300 - - <p.exr >s.ply 2>err && [ ! -s err ]; ok $? 'streams'
ct-compose up.nii - - <s.ply >s.nii; [ -s s.nii ] && [ ! -e -.state ]
ok $? 'ct-compose streams'
ct-compose -q - s.ply s2.nii <up.nii; ok $? 'a base from standard input'

mkdir whole killed stopped
long() { cd "$1" && shift && exec setsid ct-nabgs -q -b ../up.nii -n 700 -g 1000 --expert max-gaussians=1100 \
	--checkpoint-every=50 "$@" ../p.exr r.ply; } # becomes the command: call it in a subshell
(long whole); ok $? 'a longer run'
(export CTSR_TEST_SIGNAL='ct-nabgs 300 9'; long killed); [ $? -eq 137 ] && [ -e killed/r.ply.state ] && [ ! -e killed/r.ply ]; ok $? 'killed: the state stays, no result'
(long killed) 2>err; [ $? -eq 4 ]; ok $? 'a state is not overwritten'
(long killed --resume); ok $? 'resumes'
cmp whole/r.ply killed/r.ply; ok $? 'to the same bytes'
[ ! -e killed/r.ply.state ]; ok $? 'and removes the state'
(export CTSR_TEST_SIGNAL='ct-nabgs 300 15'; long stopped); [ $? -eq 75 ]; ok $? 'stops with 75'
exits 3 'a state of other options is refused' sh -c \
	'cd stopped && ct-nabgs -b ../up.nii -n 701 --resume ../p.exr r.ply'
has err 'r.ply.state' 'and named'
head -c 3000 stopped/r.ply.state >cut && mv cut stopped/r.ply.state
(long stopped --resume) 2>err; [ $? -eq 3 ]; ok $? 'a broken state is refused'

exits 0 'the paper' fit --paper p.exr paper.ply
ct-compose up.nii paper.ply paper.nii
above "$(psnr hr.nii paper.nii)" "$(psnr hr.nii up.nii) + 3"; ok $? 'gains 3 dB over the base'
exits 0 'as the program of R2-Gaussian' fit --expert r2-compat=yes p.exr compat.ply
! cmp -s paper.ply compat.ply; ok $? 'does something else'

agrees() { ct-compose up.nii "$1" - | ct-degrade -f -x 4 - again.nii && psnr lr.nii again.nii; }
ct-project --views 3 hr.nii few.exr
exits 0 'three views' ct-nabgs -b up.nii -n 200 -g 1000 --expert max-gaussians=1000 few.exr few.ply
exits 0 'and the low-resolution CT' ct-nabgs -b up.nii --lr=lr.nii -n 200 -g 1000 \
	--expert max-gaussians=1000 few.exr lr.ply
above "$(agrees lr.ply)" "$(agrees few.ply) + 1"; ok $? 'to which the sum then reduces'
exits 2 'a low-resolution CT and mode full' fit --lr=lr.nii -m full p.exr no.ply

mkdir fast
far() { cd fast && ct-nabgs -q -b ../up.nii -n 200 -g 1000 --checkpoint-every=1 --paper -m full \
	--expert rate=1000 "$@" ../p.exr r.ply; }
(far) 2>err; [ $? -eq 6 ]; ok $? 'learning a thousand times too fast ends with 6'
has err 'iteration [0-9]*: the [A-Z0-9a-z]* term' 'naming iteration and term'
[ -e fast/r.ply.state ] && [ ! -e fast/r.ply ]; ok $? 'the last good state stays, and no result'
cp fast/r.ply.state good
(far --resume) 2>again; [ $? -eq 6 ] && cmp -s err again && cmp -s good fast/r.ply.state
ok $? 'which is whole: from it on it ends the same'
exits 0 'but without --paper' ct-nabgs -v -b up.nii -n 60 -g 1000 --expert rate=1000 p.exr slow.ply
has err 'beginning anew with rates 0.25 times' 'begins anew, slower'
awk '/^error / {exit !($2 < 1)}' out; ok $? 'and the error falls'

# Easy scenes, at the default rates: one small thing without noise, of 2, 4 and 8 voxels.
for edge in 2 4 8; do
	ct-phantom -f --size=${edge}x${edge}x$edge --expert density=0.5 cube thing.nii &&
		ct-convert -f --cube 32 thing.nii easy.nii && ct-degrade -f -x 4 easy.nii easy-lr.nii &&
		ct-upsample -f easy-lr.nii easy-up.nii && ct-project -f --views=20 easy.nii easy.exr
	exits 0 "a cube of $edge voxels" ct-nabgs -f -b easy-up.nii -n 60 -g 3000 easy.exr easy.ply
	awk '/^error / {exit !($2 < 0.5)}' out; ok $? 'is fitted at the default rates'
done

# The last iteration that adds and removes: 600 is the first that may.
control() { ct-nabgs -f -b up.nii -n $1 -g 200 --expert densify-until=$2 p.exr until.ply |
	sed -n 's/^gaussians //p'; }
[ "$(control 601 599)" -eq 200 ]; ok $? 'until 599: nothing is cloned or pruned'
[ "$(control 601 600)" -ne 200 ]; ok $? 'until 600: something is'
[ "$(control 600 600)" -eq 200 ]; ok $? 'but at the last iteration nothing'

ct-project -q -n 20 --coarsen 4 --pixel mean hr.nii y.exr && ct-ddnm -q -n 2 --samples 2 --std s.exr y.exr fine.exr
exits 0 'with all there is' ct-nabgs -q -b up.nii -n 1 -g 100 --expert max-gaussians=100 -s 77 \
	--base-projections up.exr --uncertainty s.exr --lr lr.nii fine.exr all.ply
ct-info all.ply >out
has out '^  mode  *residual$' 'the set says its mode'
has out '^  seed  *77$' 'the seed'
has out '^  window  *-1024:3071$' 'the window'
has out '^  quantity  *residual$' 'that it is no density'
has out '^  ct-nabgs .* # fine.exr xxh3:[0-9a-f]* up.nii xxh3:[0-9a-f]* up.exr xxh3:[0-9a-f]* s.exr xxh3:[0-9a-f]* lr.nii xxh3:[0-9a-f]*$' \
	'and what it is of'
exits 0 'full mode' fit -m full -a softplus p.exr full.ply
has out '^negative 0' 'softplus has no negative density'
ct-info full.ply >out; has out '^  mode  *full$' 'it says its mode'
has out '^  quantity  *density$' 'and that it is a density'
exits 0 'full mode composes' ct-compose up.nii full.ply f.nii
above "$(psnr hr.nii f.nii)" 20; ok $? 'without the base: from nothing to 20 dB'
exits 0 'dry run' fit --dry-run p.exr dry.ply
grep -q '^time ' out && grep -q '^memory ' out && grep -q '^disk ' out; ok $? 'says the cost'
[ ! -e dry.ply ]; ok $? 'and makes nothing'

exits 2 'needs a base' ct-nabgs p.exr no.ply
exits 2 'one standard input' ct-nabgs -b - - no.ply
exits 2 'caps above the start' ct-nabgs -b up.nii -g 50 --expert max-gaussians=20 p.exr no.ply
exits 2 'no resume of a stream' ct-nabgs -b up.nii --resume p.exr -
exits 2 'the window must agree' ct-nabgs -b up.nii -w -512:3071 p.exr no.ply
exits 3 'an input of another kind' ct-nabgs -b up.nii up.nii no.ply
exits 3 'a base of another kind' ct-nabgs -b p.exr p.exr no.ply
exits 4 'does not overwrite' ct-nabgs -b up.nii p.exr res.ply
ct-project --views 21 up.nii more.exr
exits 5 'base projections of another scan' ct-nabgs -b up.nii --base-projections=more.exr p.exr no.ply
has err 'more.exr' 'are named'
ct-project --beam fan --views 20 hr.nii fan.exr
exits 5 'fan beam' ct-nabgs -b up.nii --mode full fan.exr no.ply
has err '^ct-nabgs: fan.exr: Gaussians are projected in cone or parallel beam' 'is named'
nan_at_end up.nii nan.nii
exits 6 'NaN in the base' ct-nabgs -b nan.nii p.exr no.ply
has err 'nan.nii: voxel (31,31,31) is NaN' 'with its place'
ct-phantom --size=8x8x8 --expert density=0.01 constant thin.nii
exits 3 'nothing to begin from' ct-nabgs -b thin.nii -m full p.exr no.ply
has err '^ct-nabgs: thin.nii: the base has no voxel of density above 0.05$' 'and why'
[ ! -e no.ply ] && [ ! -e no.ply.state ]; ok $? 'failures leave nothing'

exits 6 'compose: NaN in the base' ct-compose nan.nii res.ply no.nii
exits 6 'compose: NaN in the residual' ct-compose up.nii nan.nii no.nii
exits 5 'compose: grids differ' ct-compose up.nii lr.nii no.nii
has err 'lr.nii: grids differ' 'and which'
exits 3 'compose: a residual of another kind' ct-compose up.nii p.exr no.nii
exits 3 'compose: cut short' sh -c 'head -c 2000 res.ply | ct-compose up.nii - no.nii'
exits 4 'compose: does not overwrite' ct-compose up.nii res.ply out.nii
exits 2 'compose: one standard input' ct-compose - - no.nii
[ ! -e no.nii ]; ok $? 'compose: failures leave nothing'
exits 0 'compose: floor' ct-compose --floor=-100 up.nii res.ply floor.nii
value() { ct-info "$1" | awk -v k="$2" '$1 == k {print $2}'; }
[ "$(value floor.nii min)" = -100 ] && [ "$(value out.nii min)" -lt -900 ]; ok $? 'compose: nothing is below'
[ "$(value floor.nii max)" = "$(value out.nii max)" ]; ok $? 'compose: and what is above stays'
done_testing
