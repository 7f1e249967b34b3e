#!/bin/sh
# What projections lack: ct-train --kind residual learns it of pairs, ct-ddnm --base-projections adds it; the same
# bytes of any threads, interrupted or not; what the prior, the projections and the options say agrees.
. "$srcdir/tests/tap.sh"
mkdir base other truth held
for n in 1 2 3; do
	ct-phantom -q ellipsoids --size 32x32x$((20 + 4 * n)) --spacing 4 hr.nii
	ct-degrade -q -f -x 4 hr.nii lr.nii && ct-upsample -q -f -x 4 lr.nii up.nii && ct-upsample -q -f -m cubic -x 4 lr.nii cubic.nii
	d=truth; [ $n = 3 ] && d=held
	for s in "hr $d" "up base" "cubic other"; do
		ct-project -q --views 12 --det 32 --expert pitch=6,start=$n "${s% *}.nii" "${s#* }/$n.exr"
	done
	rm hr.nii
done
ct-project -q --views 12 --det 32 --expert pitch=6,start=3 --coarsen 4 --pixel sinc up.nii in.exr
[ -s base/3.exr ] && [ -s held/3.exr ] && [ -s in.exr ]; ok $? 'pairs of projections'
small='--kind residual --refined base --arch model_channels=32,channel_mult=1:1 -p 16 --expert batch=4 -s 5 --expert lr=2e-3,ema=.9'

# shellcheck disable=SC2086
{
exits 0 'trains' ct-train $small -n 24 --expert log-every=4 --validate held r.safetensors truth
awk '/step 4: loss/{a=$5} /step 24: loss/{b=$5} END{exit !(b+0 < a+0 && b+0 > 0)}' err
ok $? 'the loss falls'
has err '^ct-train: 3.exr: [0-9.]* octaves missing, best weight' 'what it is worth is told'
ct-train -q $small -n 6 a.safetensors truth
ct-train -q $small -n 3 -t 3 b.safetensors truth
ct-train -q $small -n 6 -t 1 --resume b.safetensors truth
cmp a.safetensors.state b.safetensors.state; ok $? 'interrupted, resumed, other threads: same bytes'
exits 3 'other projections beside them cannot resume' ct-train $small -n 9 --refined other --resume a.safetensors truth
has err "a.safetensors.state: is of a run where --refined held something else" 'and says which'
exits 3 'one without another beside it' ct-train $small z.safetensors in.exr
has err 'base/in.exr' 'is named'
cp in.exr base/
exits 3 'one that is as its truth' ct-train $small z.safetensors base/1.exr
cp base/1.exr other/in.exr
exits 5 'one of another geometry' ct-train $small --refined other z.safetensors in.exr
has err 'other/in.exr' 'is named'
exits 2 'twice coarser' ct-train $small -x 2 z.safetensors truth
exits 5 'sides that the factor does not divide' ct-train $small -x 5 z.safetensors truth
exits 3 'a network that tells more' ct-train $small --arch out_channels=3,channel_mult=1:1 z.safetensors truth
}

add='ct-ddnm -q --prior ../a.safetensors --base-projections ../base/3.exr --samples 2'
mkdir t1 t3 # the name of the output is in the history
(cd t1 && $add -t 1 --steps 4 --std s.exr ../in.exr o.exr); ok $? 'adds what is expected'
(cd t3 && $add -t 3 --steps 4 --std s.exr ../in.exr o.exr) && cmp -s t1/o.exr t3/o.exr && cmp -s t1/s.exr t3/s.exr
ok $? 'the same bytes of 1 and 3 threads'
ct-info t1/o.exr >says
grep -Eq '^  missing +[0-9.e-]+$' says && ! grep -q '^  \(norm\|operator\|coarsen\)' says
ok $? 'the result says how much was taken to be missing'
hash() { ct-info "$1" | awk '$1 == "hash" {print $2}'; }
(cd t3 && $add -f ../in.exr o.exr)
[ -n "$(hash t1/o.exr)" ] && [ "$(hash t1/o.exr)" = "$(hash t3/o.exr)" ]; ok $? 'the answer is that of the first step'
[ "$(hash t1/o.exr)" != "$(hash base/3.exr)" ]; ok $? 'and something is added'
ct-info t1/s.exr | awk '$1 == "min" {a = $2} $1 == "max" {b = $2} END {exit !(a >= 0 && b > a)}'
ok $? 'the deviation of the samples is written'
for s in ddim ddpm dpm-solver++; do exits 0 "with $s" ct-ddnm -q -f -p a.safetensors -b base/3.exr --sampler $s in.exr o.exr; done

# interrupted, resumed: the same bytes
mkdir whole cut
long='ct-ddnm -q -p ../a.safetensors -b ../base/3.exr --samples 4 --steps 60 --std s.exr'
(cd whole && $long ../in.exr o.exr)
cd cut || exit 99
for i in 1 2 3 4 5; do # a machine may be busy for as long as all of it takes
	rm -f o.exr s.exr
	$long ../in.exr o.exr & pid=$!
	listens $pid; kill -TERM $pid; wait $pid; s=$?
	[ -s o.exr.state ] && break
done
[ $s -eq 75 ] && [ -s o.exr.state ]; ok $? "SIGTERM stops it (status $s)"
exits 3 'other projections cannot resume' ct-ddnm -q -p ../a.safetensors -b ../other/3.exr --samples 4 --steps 60 --std s.exr --resume ../in.exr o.exr
has err "where --base-projections held something else" 'and says which'
exits 0 'resumes' $long --resume ../in.exr o.exr
cmp -s ../whole/o.exr o.exr && cmp -s ../whole/s.exr s.exr; ok $? 'the same bytes after resuming'
cd .. || exit 99

exits 2 'a conditional prior alone' ct-ddnm -p a.safetensors in.exr no.exr
has err 'a.safetensors: is conditional: --base-projections' 'is refused by name'
exits 2 'one that is not' ct-ddnm -p "$builddir/prior.safetensors" -b base/3.exr in.exr no.exr
has err 'prior.safetensors: is not conditional' 'is refused by name'
ct-project -q --views 12 --det 32 --expert pitch=6,start=3 --coarsen 2 --pixel sinc up.nii two.exr
exits 2 'another factor' ct-ddnm -p a.safetensors -b base/3.exr two.exr no.exr
has err 'a.safetensors: knows scans 4 times coarser, two.exr is 2 times' 'is refused by name'
exits 5 'projections of another size' ct-ddnm -p a.safetensors -b in.exr in.exr no.exr
has err '^ct-ddnm: in.exr' 'are named'
exits 2 'a sampler that does not hold' ct-ddnm -p a.safetensors -b base/3.exr --sampler ddnm+ in.exr no.exr
has err 'sampler ddnm+: not with --base-projections' 'is refused by name'
for o in --steps=3 '--expert eta=0' '--expert travel=2,2'; do
	# shellcheck disable=SC2086
	exits 2 "$o without a deviation" ct-ddnm -p a.safetensors -b base/3.exr $o in.exr no.exr
	has err "${o%%=*}: with --base-projections it needs --std" 'is refused by name'
done
exits 0 'a dry run tells the time' ct-ddnm --dry-run -p a.safetensors -b base/3.exr in.exr no.exr
[ ! -e no.exr ] && [ ! -e no.exr.state ] && [ ! -e z.safetensors ]; ok $? 'nothing is left after a failure'
done_testing
