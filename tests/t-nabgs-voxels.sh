#!/bin/sh
# ct-nabgs --voxels: what it gains, what it keeps, when it leaves the base alone, states.
. "$srcdir/tests/tap.sh"
psnr() { ct-metrics "$1" "$2" | sed -n 's/^psnr //p'; }
above() { awk "BEGIN {exit !($1 > $2)}"; } # above A B
ct-phantom --size=32x32x32 --spacing=4 ellipsoids hr.nii
ct-degrade -x 4 hr.nii lr.nii && ct-upsample lr.nii up.nii
ct-project --views 20 hr.nii p.exr && ct-project --views 20 up.nii up.exr
[ -s up.nii ] && [ -s up.exr ]; ok $? 'a scene to work on'
solve() { ct-nabgs --voxels --lr=lr.nii -b up.nii "$@"; }

exits 0 'solves' solve p.exr r.nii
has out '^projections trusted' 'trusts true projections'
has out '^iterations 15' 'in fifteen iterations'
exits 0 'composes' ct-compose up.nii r.nii out.nii
above "$(psnr hr.nii out.nii)" "$(psnr hr.nii up.nii) + 4"; ok $? 'gains 4 dB over the base'
ct-info r.nii >info; grep -q '^quantity *residual' info; ok $? 'is a residual'
[ ! -e r.nii.state ]; ok $? 'no state is left'
ct-compose --floor=-9999 up.nii r.nii raw.nii && ct-degrade -x 4 raw.nii back.nii
[ "$(ct-metrics --json lr.nii back.nii | awk -F'[:,]' '/"max-hu"/ {print ($2 < 0.001)}')" = 1 ]
ok $? 'and reduces to LR within 0.001 HU'
exits 0 'JSON' solve --json p.exr j.nii
grep -q '"projections": "trusted"' out; ok $? 'with the verdict'
exits 0 'a weight of our own' solve --lambda-projections=0.2 -n 10 p.exr own.nii
has out '^lambda-projections 0.2' 'is used'
has out '^projections weighted as told' 'without a verdict'
has out '^iterations 10' 'as is the number of iterations'
ct-compose up.nii own.nii own-out.nii
above "$(psnr hr.nii own-out.nii)" "$(psnr hr.nii up.nii) + 2"; ok $? 'and gains, too'

exits 0 'projections of the base' solve up.exr none.nii
has out '^projections nothing to solve' 'have nothing to add'
ct-nabgs -q --voxels --lr=lr.nii -b up.nii --base-projections=p.exr p.exr zero.nii
ct-info zero.nii | awk '/^(min|max) / {n += $2 < 0.001 && $2 > -0.001} END {exit n != 2}'
ok $? 'nor have those that are given as the base: the residual is what LR lacks'
ct-degrade -x 4 --sigma=1.5 up.nii own-lr.nii
ct-nabgs -q --voxels --lr=own-lr.nii -b up.nii up.exr exact.nii
ct-info exact.nii | awk '/^(min|max) / {n += $2 == 0} END {exit n != 2}'
ok $? 'an LR of the base itself: zero to the last bit'

# Errors that views do not share.
ct-project --views 20 --photons=1000 up.nii noise.exr && ct-project --views 20 --photons=20000 hr.nii noisy.exr
exits 0 'noise on the projections of the base' solve noise.exr noise.nii
has out '^projections not trusted' 'is not believed'
ct-compose up.nii noise.nii same.nii
above "$(psnr up.nii same.nii | sed s/inf/999/)" 100; ok $? 'and leaves the base as it is'
exits 0 'noise on those of the truth' solve noisy.exr noisy.nii
has out '^projections trusted' 'is worth it'
ct-compose up.nii noisy.nii noisy-out.nii
above "$(psnr hr.nii noisy-out.nii)" "$(psnr hr.nii up.nii) + 4"; ok $? 'gains 4 dB, too'
ct-project --views 20 --start=77 hr.nii turned.exr
exits 0 'another start of the arc' solve turned.exr turned.nii
ct-compose up.nii turned.nii t-out.nii
above "$(psnr hr.nii t-out.nii)" "$(psnr hr.nii up.nii) + 4"; ok $? 'gains as much'

mkdir one four
(cd one && ct-nabgs -q -t 1 --voxels --lr=../lr.nii -b ../up.nii ../p.exr r.nii)
(cd four && ct-nabgs -q -t 4 --voxels --lr=../lr.nii -b ../up.nii ../p.exr r.nii)
cmp one/r.nii four/r.nii; ok $? '1 and 4 threads, same bytes'
solve - - <p.exr >s.nii 2>err && [ ! -s err ] && [ ! -e -.state ]; ok $? 'streams'
above "$(psnr out.nii s.nii 2>&1 | sed s/inf/999/)" -1 && ct-compose up.nii s.nii s-out.nii &&
	[ "$(psnr out.nii s-out.nii)" = inf ]
ok $? 'to the same volume'

mkdir whole stopped killed
long() { cd "$1" && shift && exec ct-nabgs -q --voxels --lr=../lr.nii -b ../up.nii -n 300 \
	--checkpoint-every=5 "$@" ../p.exr r.nii; } # becomes the command: call it in a subshell
(long whole); ok $? 'a longer run'
for how in killed stopped; do
	sig=9 want=137
	[ $how = stopped ] && sig=15 want=75
	(long $how) & pid=$!
	while [ ! -e $how/r.nii.state ] && kill -0 $pid 2>/dev/null; do sleep 0.02; done
	kill -$sig $pid; wait $pid 2>/dev/null; [ $? -eq $want ]; ok $? "$how: $want"
	[ -e $how/r.nii.state ] && [ ! -e $how/r.nii ]; ok $? 'the state stays, no result'
done
(long killed) 2>err; [ $? -eq 4 ]; ok $? 'a state is not overwritten'
exits 3 'a state of other options is refused' sh -c \
	'cd stopped && ct-nabgs --voxels --lr=../lr.nii -b ../up.nii -n 299 --resume ../p.exr r.nii'
(long killed --resume); ok $? 'resumes'
cmp whole/r.nii killed/r.nii; ok $? 'to the same bytes'
[ ! -e killed/r.nii.state ]; ok $? 'and removes the state'
head -c 3000 stopped/r.nii.state >cut && mv cut stopped/r.nii.state
(long stopped --resume) 2>err; [ $? -eq 3 ]; ok $? 'a broken state is refused'

exits 0 'dry run' solve --dry-run p.exr dry.nii
grep -q '^time ' out && grep -q '^memory ' out && grep -q '^disk ' out; ok $? 'says the cost'
[ ! -e dry.nii ]; ok $? 'and makes nothing'

exits 2 'wants the low resolution' ct-nabgs --voxels -b up.nii p.exr no.nii
has err 'wants --lr' 'and says so'
exits 2 'voxels are no PLY' ct-nabgs --voxels --lr l.nii --base b.nii p.exr no.ply
has err 'NIfTI' 'and says so'
exits 2 'no options of Gaussians' solve -g 100 p.exr no.nii
has err 'options of Gaussians' 'in words'
exits 2 'no weight without voxels' ct-nabgs --lambda-projections=1 -b up.nii p.exr no.ply
ct-phantom --size=24x32x32 --spacing=4 ellipsoids other.nii && ct-degrade -x 4 other.nii other-lr.nii
exits 5 'an LR of another grid' ct-nabgs --voxels --lr=other-lr.nii -b up.nii p.exr no.nii
has err 'other-lr.nii' 'is named'
ct-project --views 21 up.nii more.exr
exits 5 'base projections of another scan' solve --base-projections=more.exr p.exr no.nii
exits 4 'does not overwrite' solve p.exr r.nii
[ ! -e no.nii ] && [ ! -e no.nii.state ]; ok $? 'failures leave nothing'
done_testing
