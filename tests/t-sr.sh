#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The published method on a small phantom: by ct-sr, by hand, interrupted; and ours.
. "$srcdir/tests/tap.sh"
ct-phantom -q -w -512:3071 ellipsoids --size 32x32x32 --spacing 4 hr.nii; ok $? 'a phantom'
ct-convert hr.nii - | ct-degrade -x 4 - - | ct-upsample -x 4 -m cubic - cubic.nii.gz
ok $? 'convert, degrade, upsample join by pipes'
ct-project --views 8 - - <hr.nii | ct-info - >info.txt; ok $? 'project and info join by pipes'
grep -q cone info.txt; ok $? 'and the scan is told'
ct-degrade -q --clip -512:3071 -x 4 hr.nii lr.nii
set -- -x 4 --paper --expert views=16,iterations=200,gaussians=4000
exits 0 'the published method is kept' ct-sr -q "$@" --keep k lr.nii sr.nii
for f in lr.nii up.nii up-proj.exr lr-proj.exr sr-proj.exr residual.ply commands.sh; do
	[ -s "k/$f" ]; ok $? "$f is kept"
done
db() { ct-metrics hr.nii "$1" | awk '/^psnr/ {print $2}'; }
# of few views the published method is below cubic; t-paper.sh has its figures
awk "BEGIN {exit !($(db sr.nii) > $(db cubic.nii.gz) - 1.5)}"; ok $? "near cubic: $(db sr.nii) against $(db cubic.nii.gz) dB"
ct-info k/residual.ply >info.txt; grep -qi 'negative' info.txt; ok $? 'the residual has a sign'
ct-sr -q "$@" - - <lr.nii >pipe.nii; ok $? 'from a pipe to a pipe'
ct-info pipe.nii >info.txt; ok $? 'and nothing but the volume comes out'
echo mine >mine.nii
exits 4 'a run that goes on writes over nothing' ct-sr -q "$@" --keep k lr.nii mine.nii
exits 0 'a finished run of the paper has nothing to do' ct-sr -q "$@" --keep k lr.nii sr.nii
voxels() { ct-convert -q --type f32 "$1" - | tail -c 131072; }
voxels sr.nii >a
# interrupted in the middle, resumed
(export CTSR_TEST_SIGNAL='ct-sr 40 15'; exec setsid ct-sr -q "$@" --keep i lr.nii cut.nii) >/dev/null; s=$?
[ $s -eq 75 ]; ok $? "SIGTERM stops the paper at the network (status $s)"
[ -s i/sr-proj.exr.state ]; ok $? 'the views that the network has made are kept'
[ ! -e cut.nii ]; ok $? 'no half-written output'
exits 0 'resumes' ct-sr -q "$@" --keep i lr.nii cut.nii
voxels cut.nii >b; cmp -s a b; ok $? 'the same voxels after an interruption'
for f in mha nrrd; do
	exits 0 "to .$f" ct-sr -Q draft lr.nii o.$f; ct-sr -q -f -Q draft lr.nii o.nii; exits 0 'the same' ct-metrics -q --min psnr=1000 o.nii o.$f
done
exits 0 'by projections too' ct-sr -q --paper --expert views=4,iterations=2,gaussians=20 lr.nii chain.mha; head -c 10 chain.mha | grep -q '^ObjectType'; ok $? 'is MetaImage'
exits 0 'a dry run prints the commands' ct-sr --dry-run -x 4 --paper lr.nii no.nii
[ "$(sed 's/ .*//' out | tr '\n' ' ')" = 'ct-convert ct-upsample ct-project ct-project ct-ddnm ct-nabgs ct-compose # ' ]
ok $? 'all of them'
[ ! -e no.nii ]; ok $? 'and does nothing'
for q in draft fast balanced; do
	exits 0 "$q" ct-sr -x 4 -Q $q lr.nii $q.nii
	awk "BEGIN {exit !($(db $q.nii) > $(db cubic.nii.gz))}"; ok $? "better than cubic: $(db $q.nii) dB"
done
ct-convert -q --type f32 lr.nii - | tail -c 2048 >lr.raw
ct-convert -q --raw 8x8x8:f32:16 lr.raw plain.nii; ok $? 'a scan that does not say how it was made'
exits 0 'measured' ct-sr -x 4 plain.nii blind.nii
exits 0 'by the published method' ct-sr -q "$@" plain.nii blind2.nii
exits 2 'no projections, no views' ct-sr --expert views=16 lr.nii no.nii
exits 2 'nor a seed' ct-sr -s 3 lr.nii no.nii; has err '^ct-sr: --seed: needs --paper or --release' 'is named'
exits 0 'projections have one' ct-sr --dry-run -s 3 --paper lr.nii no.nii
[ "$(grep -c -- '--seed=3' out)" -eq 2 ]; ok $? 'which two commands draw from'
exits 3 'a dry run of a file that is not there' ct-sr --dry-run none.nii no.nii
has err 'none.nii: No such file' 'names it'
# the factor that the header says
for x in 1,1,4 2; do
	ct-degrade -fq -x $x hr.nii by.nii; ct-sr -qf -Q draft -x $x by.nii want.nii; voxels want.nii >a
	exits 0 "-x $x of the header" ct-sr -f -Q draft by.nii sr.nii
	voxels sr.nii >b; cmp -s a b; ok $? 'is what -x makes'
	ct-sr -q -Q draft - - <by.nii >pipe.nii; voxels pipe.nii >b; cmp -s a b; ok $? 'of a pipe, too'
done
exits 2 'another is an error' ct-sr -x 4 by.nii no.nii
exits 0 'one that is used up says nothing' ct-sr --dry-run --paper sr.nii no.nii
has out '-x4 ' 'but four times'
exits 2 'projections of a pipe that says otherwise' ct-sr --paper - no.nii <by.nii
has err 'the factor 4,4,4 contradicts the file, which was reduced 2,2,2 times' 'the error of a factor that contradicts the file names both'
ct-degrade -fq -x 1,1,4 hr.nii by.nii
exits 2 'projections of a scan that says otherwise' ct-sr --paper by.nii no.nii
has err '^ct-sr: --factor 1,1,4: projections take one whole number' 'the error of a factor an axis for projections says one number'
ct-degrade -fq -x 1 hr.nii by.nii
exits 2 'a scan that was not reduced' ct-sr by.nii no.nii
has err '^ct-sr: by.nii: a factor of 1 refines nothing' 'the error of a factor of 1 says that nothing is refined'
printf junk >bad.nii
exits 3 'bad input' ct-sr -x 4 bad.nii no.nii
[ ! -e no.nii ]; ok $? 'nothing is left'
done_testing
