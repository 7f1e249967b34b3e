#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-ddnm: statuses, threads, consistency with what was measured, interruption and resuming.
. "$srcdir/tests/tap.sh"
ct-phantom -q ellipsoids --size 32x32x32 --spacing 4 hr.nii && ct-degrade -q -x 4 hr.nii lr.nii &&
	ct-upsample -q -x 4 lr.nii up.nii && ct-project -q --views 4 up.nii up.exr &&
	ct-project -q --views 4 --coarsen 4 --pixel mean up.nii y.exr &&
	ct-project -q --views 4 --coarsen 4 --pixel sinc up.nii sinc.exr
ok $? 'a phantom, its upsampled self and both projections are made'
mkdir t1 t4 # the name of the output is in the history
# results: size, threads, pipes
(cd t1 && ct-ddnm -t 1 -x 4 --steps 3 ../y.exr a.exr); ok $? 'ct-ddnm refines projections with the shipped prior'
(cd t4 && ct-ddnm -t 4 -x 4 --steps 3 ../y.exr a.exr) && cmp -s t1/a.exr t4/a.exr
ok $? 'ct-ddnm writes the same bytes on 1 and 4 threads'
cp t1/a.exr .
fine() { grep -Eq '^size +32 32$'; }
ct-info a.exr | fine; ok $? 'the detector of the result is four times finer'
(cd t4 && ct-ddnm -t 1 -x 4 --steps 3 ../y.exr - | ct-info -) | fine
ok $? 'a result written to a pipe has the finer detector'
exits 0 'ct-ddnm accepts --init with --std and two samples' ct-ddnm -q -x 4 --expert operator=matched --sampler ddnm \
	--init up.exr --expert t-start=20 --steps 2 --samples 2 --std s.exr sinc.exr d.exr
[ -s s.exr ]; ok $? '--std writes the deviation of the samples'
# a picture, where pictures can be made and read
if ct-view -q y.exr pic.png && ! ct-ddnm -q -x 2 --steps 1 pic.png pic.exr 2>&1 | grep -q with-oiio; then
	exits 0 'ct-ddnm refines a PNG picture into a PNG picture' ct-ddnm -q -x 2 --steps 2 pic.png big.png
	head -c 4 big.png | grep -q PNG; ok $? 'the output picture is a PNG file'
	exits 0 'ct-ddnm refines a picture into an OpenEXR stack' ct-ddnm -q -x 2 --steps 2 pic.png big.exr
	{ printf 'P5\n8 8\n255\n'; printf '%064d' 0; } >zero.pgm
	{ printf 'P5\n8 8\n255\n'; printf '%064d' 1; } >one.pgm
	for p in zero one; do ct-ddnm -q -x 2 --steps 1 $p.pgm $p.exr; done
	hash() { ct-info $1.exr | sed -n "s/.* $1.pgm \(xxh3:[0-9a-f]*\).*/\1/p"; }
	[ -n "$(hash zero)" ] && [ "$(hash zero)" != "$(hash one)" ]
	ok $? 'the history of the result holds a checksum of the picture to its last pixel'
	exits 2 'projections cannot be written as a picture' ct-ddnm -q -x 4 --steps 2 y.exr y.png
else
	ok 0 'ct-ddnm refines a picture # skip no ct-view'
fi
# a dry run
exits 0 'ct-ddnm --dry-run succeeds without work' ct-ddnm --dry-run -x 4 y.exr none.exr
{ grep -q 'time' out && [ ! -e none.exr ]; }; ok $? 'a dry run prints the time and writes nothing'
# refusals
exits 4 'an existing output is not overwritten' ct-ddnm -x 4 y.exr a.exr
exits 5 'an --init of another geometry is refused' ct-ddnm -x 4 --init y.exr y.exr n.exr
ct-project -q --beam fan --views 4 --coarsen 4 --pixel mean up.nii fan.exr
exits 5 'a fan beam with one detector row is refused with status 5' ct-ddnm -x 4 --sampler none fan.exr n.exr
has err 'fan.exr: a fan has one detector row' 'the error of a fan beam says that it has one detector row'
exits 2 't-start without --init is refused with status 2' ct-ddnm -x 4 --expert t-start=9 y.exr n.exr
exits 3 'a volume instead of projections is refused with status 3' ct-ddnm -x 4 hr.nii n.exr
exits 3 'a map of deviations instead of projections is refused with status 3' ct-ddnm -x 4 s.exr n.exr
exits 3 'projections instead of a prior are refused with status 3' ct-ddnm -x 4 --prior y.exr y.exr n.exr
sed 's/"num_res_blocks":"1"/"num_res_blocks":"2"/' "$builddir/prior.safetensors" >other.safetensors
exits 3 'a prior of another architecture is refused with status 3' ct-ddnm -x 4 --prior other.safetensors y.exr n.exr
has err 'other.safetensors: .*tensor' 'the error of a prior of another architecture names file and tensor'
"$builddir/tests/t-unet" unet-b b.safetensors || exit 99
exits 0 'a prior that also learns variances is accepted' ct-ddnm -q -x 4 --steps 1 --prior b.safetensors y.exr v.exr
printf '6\0\0\0\0\0\0\0{"x":{"dtype":"F32","shape":[1],"data_offsets":[0,4]}}\0\0\0\0' >plain.safetensors
exits 3 'weights without metadata are refused as prior with status 3' ct-ddnm -x 4 --prior plain.safetensors y.exr n.exr
has err 'plain.safetensors: not a diffusion prior: no metadata' 'the error of weights without metadata names the file and what it lacks'
printf 'PK\003\004archive/data.pkl' >model.pt
exits 3 'a PyTorch checkpoint that is cut short is refused with status 3' ct-ddnm -x 4 --prior model.pt y.exr n.exr
has err 'model.pt: zip: no directory at the end' 'the error of a PyTorch checkpoint that is cut short says what its zip lacks'
[ ! -e n.exr ] && [ ! -e n.exr.state ]; ok $? 'a refused run leaves neither output nor state'
if [ -w /dev/full ]; then
	exits 4 'a full disk ends ct-ddnm with status 4' ct-ddnm -q -x 4 --steps 1 y.exr /dev/full
fi
# interrupted and resumed
ct-project -q --views 40 --coarsen 4 --pixel mean up.nii many.exr
mkdir whole cut
(cd whole && ct-ddnm -q -x 4 --steps 12 ../many.exr o.exr); ok $? 'ct-ddnm refines forty views without a stop'
cd cut || exit 99
for i in 1 2 3 4 5; do # a machine may be busy for as long as all of it takes
	rm -f o.exr
	ct-ddnm -q -x 4 --steps 12 ../many.exr o.exr & pid=$!
	listens $pid; kill -TERM $pid; wait $pid; s=$?
	[ -s o.exr.state ] && break
done
[ $s -eq 75 ]; ok $? "SIGTERM ends ct-ddnm with status 75 (got $s)"
[ -s o.exr.state ] && [ ! -e o.exr ]; ok $? 'after SIGTERM the finished views are saved as state, without an output'
exits 3 'a run with other options cannot resume the saved state' ct-ddnm -q -x 4 --steps 7 --resume ../many.exr o.exr
exits 0 'a run with the same options resumes the saved state' ct-ddnm -q -x 4 --steps 12 --resume ../many.exr o.exr
cmp -s ../whole/o.exr o.exr; ok $? 'a resumed run gives the bytes of a run without a stop'
[ ! -e o.exr.state ]; ok $? 'a resumed run removes the saved state at its end'
done_testing
