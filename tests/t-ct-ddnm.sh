#!/bin/sh
# ct-ddnm: statuses, threads, consistency with what was measured, interruption and resuming.
. "$srcdir/tests/tap.sh"
ct-phantom -q ellipsoids --size 32x32x32 --spacing 4 hr.nii && ct-degrade -q -x 4 hr.nii lr.nii &&
	ct-upsample -q -x 4 lr.nii up.nii && ct-project -q --views 4 up.nii up.exr &&
	ct-project -q --views 4 --coarsen 4 --pixel mean up.nii y.exr
ok $? 'a phantom, its upsampled self, and both projections'
exits 0 'super-resolves with the shipped prior' ct-ddnm -t 1 -x 4 --steps 3 y.exr a.exr
exits 0 'and on four threads' ct-ddnm -t 4 --force --steps 3 -x 4 y.exr b.exr
ct-info a.exr | grep -q '32x32\|32 x 32'; ok $? 'the detector is four times finer'
ct-ddnm -t 1 -x 4 --steps 3 y.exr - >c.exr && cmp -s a.exr c.exr
# the command line is in the history: compare what was computed
pixels() { ct-info --json "$1" | grep -v -e history -e '"file"' -e input; }
pixels a.exr >a.txt; pixels b.exr >b.txt; cmp -s a.txt b.txt; ok $? 'the same numbers for 1 and 4 threads'
exits 0 'from projections of a better volume' ct-ddnm -q -x 4 --operator matched --sampler ddnm \
	--init up.exr --t-start 20 --steps 2 --samples 2 --std s.exr y.exr d.exr
[ -s s.exr ]; ok $? 'the deviation of the samples is written'
exits 0 'a dry run tells the time' ct-ddnm --dry-run -x 4 y.exr none.exr
{ grep -q 'time' out && [ ! -e none.exr ]; }; ok $? 'and writes nothing'
exits 4 'an existing output is kept' ct-ddnm -x 4 y.exr a.exr
exits 5 'an init of another geometry is refused' ct-ddnm -x 4 --init y.exr y.exr n.exr
exits 2 '--t-start without --init' ct-ddnm -x 4 --t-start 9 y.exr n.exr
exits 3 'a volume is not a stack' ct-ddnm -x 4 hr.nii n.exr
exits 3 'projections are not a prior' ct-ddnm -x 4 --prior y.exr y.exr n.exr
exits 3 'a prior of another architecture' ct-ddnm -x 4 --prior "$srcdir/tests/gold/unet-b.safetensors" y.exr n.exr
has err 'unet-b' 'and it is named'
[ ! -e n.exr ] && [ ! -e n.exr.part ]; ok $? 'nothing is left after a failure'
if [ -w /dev/full ]; then
	exits 4 'a full disk' ct-ddnm -q -x 4 --steps 1 y.exr /dev/full
fi
# interrupted, resumed: the same bytes
ct-project -q --views 40 --coarsen 4 --pixel mean up.nii many.exr
ct-ddnm -q -x 4 --steps 6 many.exr whole.exr; ok $? 'many views'
ct-ddnm -q -x 4 --steps 6 many.exr cut.exr & pid=$!
sleep 0.4; kill -TERM $pid; wait $pid; s=$?
[ $s -eq 75 ] || [ $s -eq 0 ]; ok $? "SIGTERM stops it (status $s)"
if [ $s -eq 75 ]; then
	[ -s cut.exr.part ] && [ ! -e cut.exr ]; ok $? 'finished views are saved'
	exits 3 'other options cannot resume' ct-ddnm -q -x 4 --steps 7 --resume many.exr cut.exr
	exits 0 'resumes' ct-ddnm -q -x 4 --steps 6 --resume many.exr cut.exr
fi
pixels whole.exr >a.txt; pixels cut.exr >b.txt; cmp -s a.txt b.txt; ok $? 'the same numbers after resuming'
[ ! -e cut.exr.part ]; ok $? 'the state is gone when all is done'
done_testing
