#!/bin/sh
# ct-ddnm: statuses, threads, consistency with what was measured, interruption and resuming.
. "$srcdir/tests/tap.sh"
ct-phantom -q ellipsoids --size 32x32x32 --spacing 4 hr.nii && ct-degrade -q -x 4 hr.nii lr.nii &&
	ct-upsample -q -x 4 lr.nii up.nii && ct-project -q --views 4 up.nii up.exr &&
	ct-project -q --views 4 --coarsen 4 --pixel mean up.nii y.exr &&
	ct-project -q --views 4 --coarsen 4 --pixel sinc up.nii sinc.exr
ok $? 'a phantom, its upsampled self, and both projections'
mkdir t1 t4 # the name of the output is in the history
(cd t1 && ct-ddnm -t 1 -x 4 --steps 3 ../y.exr a.exr); ok $? 'super-resolves with the shipped prior'
(cd t4 && ct-ddnm -t 4 -x 4 --steps 3 ../y.exr a.exr) && cmp -s t1/a.exr t4/a.exr
ok $? 'the same bytes on 1 and 4 threads'
cp t1/a.exr .
fine() { grep -Eq '^size +32 32$'; }
ct-info a.exr | fine; ok $? 'the detector is four times finer'
(cd t4 && ct-ddnm -t 1 -x 4 --steps 3 ../y.exr - | ct-info -) | fine; ok $? 'to a pipe'
exits 0 'from projections of a better volume' ct-ddnm -q -x 4 --expert operator=matched --sampler ddnm \
	--init up.exr --expert t-start=20 --steps 2 --samples 2 --std s.exr sinc.exr d.exr
[ -s s.exr ]; ok $? 'the deviation of the samples is written'
# a picture, where pictures can be made and read
if command -v ct-view >/dev/null && ct-view -q y.exr pic.png; then
	exits 0 'a picture' ct-ddnm -q -x 2 --steps 2 pic.png big.png
	head -c 4 big.png | grep -q PNG; ok $? 'becomes a picture'
	exits 0 'or a stack' ct-ddnm -q -x 2 --steps 2 pic.png big.exr
	{ printf 'P5\n8 8\n255\n'; printf '%064d' 0; } >zero.pgm
	{ printf 'P5\n8 8\n255\n'; printf '%064d' 1; } >one.pgm
	for p in zero one; do ct-ddnm -q -x 2 --steps 1 $p.pgm $p.exr; done
	hash() { ct-info $1.exr | sed -n "s/.* $1.pgm \(xxh3:[0-9a-f]*\).*/\1/p"; }
	[ -n "$(hash zero)" ] && [ "$(hash zero)" != "$(hash one)" ]; ok $? 'which says of what, to the last pixel'
	exits 2 'line integrals are no picture' ct-ddnm -q -x 4 --steps 2 y.exr y.png
else
	ok 0 'a picture # skip no ct-view'
fi
exits 0 'a dry run tells the time' ct-ddnm --dry-run -x 4 y.exr none.exr
{ grep -q 'time' out && [ ! -e none.exr ]; }; ok $? 'and writes nothing'
exits 4 'an existing output is kept' ct-ddnm -x 4 y.exr a.exr
exits 5 'an init of another geometry is refused' ct-ddnm -x 4 --init y.exr y.exr n.exr
ct-project -q --beam fan --views 4 --coarsen 4 --pixel mean up.nii fan.exr
exits 5 'the one row of a fan becomes no finer' ct-ddnm -x 4 --sampler none fan.exr n.exr
has err 'fan.exr: a fan has one detector row' 'and why'
exits 2 't-start without --init' ct-ddnm -x 4 --expert t-start=9 y.exr n.exr
exits 3 'a volume is not a stack' ct-ddnm -x 4 hr.nii n.exr
exits 3 'a deviation is not a projection' ct-ddnm -x 4 s.exr n.exr
exits 3 'projections are not a prior' ct-ddnm -x 4 --prior y.exr y.exr n.exr
sed 's/"num_res_blocks":"1"/"num_res_blocks":"2"/' "$builddir/prior.safetensors" >other.safetensors
exits 3 'a prior of another architecture' ct-ddnm -x 4 --prior other.safetensors y.exr n.exr
has err 'other.safetensors: .*tensor' 'and it is named'
exits 0 'one that also learns variances' ct-ddnm -q -x 4 --steps 1 --prior "$srcdir/tests/gold/unet-b.safetensors" y.exr v.exr
printf '6\0\0\0\0\0\0\0{"x":{"dtype":"F32","shape":[1],"data_offsets":[0,4]}}\0\0\0\0' >plain.safetensors
exits 3 'weights without metadata' ct-ddnm -x 4 --prior plain.safetensors y.exr n.exr
has err 'plain.safetensors: not a diffusion prior: no metadata' 'are refused, and why'
printf 'PK\003\004archive/data.pkl' >model.pt
exits 3 'a checkpoint of PyTorch that is cut short' ct-ddnm -x 4 --prior model.pt y.exr n.exr
has err 'model.pt: zip: no directory at the end' 'is refused'
[ ! -e n.exr ] && [ ! -e n.exr.state ]; ok $? 'nothing is left after a failure'
if [ -w /dev/full ]; then
	exits 4 'a full disk' ct-ddnm -q -x 4 --steps 1 y.exr /dev/full
fi
# interrupted, resumed: the same bytes
ct-project -q --views 40 --coarsen 4 --pixel mean up.nii many.exr
mkdir whole cut
(cd whole && ct-ddnm -q -x 4 --steps 12 ../many.exr o.exr); ok $? 'many views'
cd cut || exit 99
for i in 1 2 3 4 5; do # a machine may be busy for as long as all of it takes
	rm -f o.exr
	ct-ddnm -q -x 4 --steps 12 ../many.exr o.exr & pid=$!
	listens $pid; kill -TERM $pid; wait $pid; s=$?
	[ -s o.exr.state ] && break
done
[ $s -eq 75 ]; ok $? "SIGTERM stops it (status $s)"
[ -s o.exr.state ] && [ ! -e o.exr ]; ok $? 'finished views are saved'
exits 3 'other options cannot resume' ct-ddnm -q -x 4 --steps 7 --resume ../many.exr o.exr
exits 0 'resumes' ct-ddnm -q -x 4 --steps 12 --resume ../many.exr o.exr
cmp -s ../whole/o.exr o.exr; ok $? 'the same bytes after resuming'
[ ! -e o.exr.state ]; ok $? 'the state is gone when all is done'
done_testing
