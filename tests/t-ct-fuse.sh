#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-fuse: what it gains, what it keeps, when it leaves the base alone, states.
. "$srcdir/tests/tap.sh"
psnr() { ct-metrics "$1" "$2" | sed -n 's/^psnr //p'; }
above() { awk "BEGIN {exit !($1 > $2)}"; } # above A B
ct-phantom --size=32x32x32 --spacing=4 ellipsoids hr.nii
ct-degrade -x 4 hr.nii lr.nii && ct-upsample lr.nii up.nii
ct-project --views 20 hr.nii p.exr && ct-project --views 20 up.nii up.exr
[ -s up.nii ] && [ -s up.exr ]; ok $? 'a scene to work on'

exits 0 'ct-fuse fuses a base, a scan and projections' ct-fuse --residual-out=r.nii up.nii lr.nii p.exr out.nii
has out '^projections trusted' 'ct-fuse trusts projections of the true volume'
has out '^iterations 15' 'ct-fuse reports 15 iterations where no number is given'
above "$(psnr hr.nii out.nii)" "$(psnr hr.nii up.nii) + 4"; ok $? 'gains 4 dB over the base'
ct-info r.nii >info; grep -q '^quantity *residual' info; ok $? 'the volume of --residual-out has the quantity residual'
ct-compose up.nii r.nii same.nii && [ "$(psnr out.nii same.nii)" = inf ]
ok $? 'which composes to the same'
[ ! -e out.nii.state ]; ok $? 'no state is left'
ct-compose --floor=-9999 up.nii r.nii raw.nii && ct-degrade -x 4 raw.nii back.nii
[ "$(ct-metrics --json lr.nii back.nii | awk -F'[:,]' '/"max-hu"/ {print ($2 < 0.001)}')" = 1 ]
ok $? 'and reduces to LR within 0.001 HU'
exits 2 'JSON behind a volume' ct-fuse --json --residual-out=- up.nii lr.nii p.exr j.nii
has err '^ct-fuse: --json: --residual-out is standard output: name a file' 'the error of JSON behind a volume asks for a file'
{ ct-fuse -q -n 1 --residual-out=piped.nii up.nii lr.nii p.exr -; echo $? >rc; } 2>err | true
[ "$(cat rc)" -gt 0 ] && [ ! -e piped.nii ] && ! ls -A | grep -q ctsr-tmp
ok $? "a reader that went away leaves no temporary files: $(cat rc)"
ct-fuse -n 1 --residual-out=one-r.nii up.nii lr.nii p.exr one.nii >out
exits 0 'the residual to standard output' ct-fuse -n 1 --residual-out=- up.nii lr.nii p.exr one-out.nii
[ "$(wc -c <out)" -eq "$(wc -c <one-r.nii)" ]; ok $? 'has no report behind it'
exits 0 'ct-fuse accepts --json with a file as output' ct-fuse --json up.nii lr.nii p.exr j.nii
grep -q '"projections": "trusted"' out; ok $? 'the JSON of ct-fuse says that projections are trusted'
exits 0 'a weight of our own' ct-fuse --expert lambda-projections=0.2 -n 10 up.nii lr.nii \
	p.exr own.nii
has out '^lambda-projections 0.2' 'ct-fuse reports the weight of projections that was given'
has out '^projections weighted as told' 'a weight that was given takes the place of the verdict'
has out '^iterations 10' 'as is the number of iterations'
above "$(psnr hr.nii own.nii)" "$(psnr hr.nii up.nii) + 2"; ok $? 'ct-fuse with a given weight gains 2 dB over the base'

ct-project -q -n 3 hr.nii few.exr; exits 0 'ct-fuse takes three views' ct-fuse -n 2 up.nii lr.nii few.exr few.nii
has out '^projections not tested' 'of three views the report says that they were not tested'
exits 0 'projections of the base' ct-fuse up.nii lr.nii up.exr none.nii
has out '^projections nothing to solve' 'have nothing to add'
ct-fuse -q --residual-out=zero.nii --base-projections=p.exr up.nii lr.nii p.exr zero-out.nii
ct-info zero.nii | awk '/^(min|max) / {n += $2 < 0.001 && $2 > -0.001} END {exit n != 2}'
ok $? 'nor have those that are given as the base: the residual is what LR lacks'
ct-degrade -x 4 --sigma=1.5 up.nii own-lr.nii
ct-fuse -q --residual-out=exact.nii up.nii own-lr.nii up.exr exact-out.nii
ct-info exact.nii | awk '/^(min|max) / {n += $2 == 0} END {exit n != 2}'
ok $? 'an LR of the base itself: zero to the last bit'

# Errors that views do not share.
ct-project --views 20 --photons=1000 up.nii noise.exr && ct-project --views 20 --photons=20000 hr.nii noisy.exr
exits 0 'noise on the projections of the base' ct-fuse up.nii lr.nii noise.exr noise.nii
has out '^projections not trusted' 'projections of the base with noise are not trusted'
above "$(psnr up.nii noise.nii | sed s/inf/999/)" 100; ok $? 'and leaves the base as it is'
exits 0 'noise on those of the truth' ct-fuse up.nii lr.nii noisy.exr noisy.nii
has out '^projections trusted' 'projections of the truth with noise are trusted'
above "$(psnr hr.nii noisy.nii)" "$(psnr hr.nii up.nii) + 4"; ok $? 'gains 4 dB, too'
ct-project --views 20 --expert start=77 hr.nii turned.exr
ct-convert -q --reorient LPI up.nii up-lpi.nii; ct-convert -q --reorient LPI lr.nii lr-lpi.nii
exits 0 'a base that is stored from other ends' ct-fuse --residual-out=r-lpi.nii up-lpi.nii lr-lpi.nii p.exr out-lpi.nii
ct-convert -q --reorient RAS out-lpi.nii out-ras.nii; ct-convert -q --reorient RAS r-lpi.nii r-ras.nii
for k in out r; do ct-metrics --ssim none -w -1000:1000 $k.nii $k-ras.nii | awk '$1 == "max-hu" {same = $2 < .1} END {exit !same}'; ok $? "$k is the same, whichever way the volumes are stored"; done
exits 0 'another start of the arc' ct-fuse up.nii lr.nii turned.exr turned.nii
above "$(psnr hr.nii turned.nii)" "$(psnr hr.nii up.nii) + 4"; ok $? 'with another start of the arc ct-fuse gains 4 dB over the base'

mkdir one four
(cd one && ct-fuse -q -t 1 ../up.nii ../lr.nii ../p.exr r.nii)
(cd four && ct-fuse -q -t 4 ../up.nii ../lr.nii ../p.exr r.nii)
cmp one/r.nii four/r.nii; ok $? '1 and 4 threads, same bytes'
ct-fuse up.nii lr.nii - - <p.exr >s.nii 2>err && [ ! -s err ] && [ ! -e -.state ]; ok $? 'ct-fuse between streams is quiet and leaves no state'
[ "$(psnr out.nii s.nii)" = inf ]; ok $? 'to the same volume'

mkdir whole stopped killed
long() { cd "$1" && shift && exec setsid ct-fuse -q -n 300 --checkpoint-every=5 "$@" \
	../up.nii ../lr.nii ../p.exr r.nii; } # becomes the command: call it in a subshell
(long whole); ok $? 'a run of 300 iterations ends with status 0'
for how in killed stopped; do
	sig=9 want=137
	[ $how = stopped ] && sig=15 want=75
	(export CTSR_TEST_SIGNAL="ct-fuse 100 $sig"; long $how); [ $? -eq $want ]; ok $? "$how: $want"
	[ -e $how/r.nii.state ] && [ ! -e $how/r.nii ]; ok $? 'the state stays, no result'
done
(long killed) 2>err; [ $? -eq 4 ]; ok $? 'a state is not overwritten'
exits 3 'a state of other options is refused' sh -c \
	'cd stopped && ct-fuse -n 299 --resume ../up.nii ../lr.nii ../p.exr r.nii'
(long killed --resume); ok $? '--resume finishes a run that was killed'
cmp whole/r.nii killed/r.nii; ok $? 'to the same bytes'
[ ! -e killed/r.nii.state ]; ok $? 'and removes the state'
head -c 3000 stopped/r.nii.state >cut && mv cut stopped/r.nii.state
(long stopped --resume) 2>err; [ $? -eq 3 ]; ok $? 'a broken state is refused'

exits 0 'a dry run of ct-fuse ends with status 0' ct-fuse --dry-run up.nii lr.nii p.exr dry.nii
grep -q '^time ' out && grep -q '^memory ' out && grep -q '^disk ' out; ok $? 'a dry run of ct-fuse prints time, memory and disk'
[ ! -e dry.nii ]; ok $? 'a dry run of ct-fuse makes no volume'

exits 2 'one input from a pipe' ct-fuse - lr.nii - no.nii
exits 2 'a state needs a file' ct-fuse --resume up.nii lr.nii p.exr -
ct-phantom --size=24x32x32 --spacing=4 ellipsoids other.nii && ct-degrade -x 4 other.nii other-lr.nii
exits 5 'an LR of another grid' ct-fuse up.nii other-lr.nii p.exr no.nii
has err 'other-lr.nii' 'the error of an LR of another grid names it'
ct-project --views 21 up.nii more.exr
exits 5 'base projections of another scan' ct-fuse --base-projections=more.exr up.nii lr.nii \
	p.exr no.nii
ct-phantom --like=p.exr --window=-512:3071 ellipsoids narrow.exr
exits 3 'ct-fuse refuses base projections of another window' ct-fuse --base-projections=narrow.exr up.nii lr.nii p.exr no.nii
has err '^ct-fuse: up.nii has the window -1024:3071, narrow.exr has -512:3071' 'the error of base projections of another window names both'
exits 4 'ct-fuse refuses to overwrite a volume with status 4' ct-fuse up.nii lr.nii p.exr out.nii
exits 4 'ct-fuse refuses to overwrite a residual with status 4' ct-fuse --residual-out=r.nii up.nii lr.nii p.exr no.nii
[ ! -e no.nii ] && [ ! -e no.nii.state ]; ok $? 'runs of ct-fuse that fail leave neither volume nor state'
done_testing
