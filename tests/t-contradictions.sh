#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What a file says of itself holds: an option that says otherwise is an error that names both, in
# every command, and nothing is written.
. "$srcdir/tests/tap.sh"
ct-phantom -q ellipsoids --size 32x32x32 --spacing 4 hr.nii
ct-degrade -q -x 4 --noise 5 hr.nii lr.nii
ct-upsample -q -m cubic lr.nii up.nii
ct-project -q -n 12 hr.nii p.exr
for p in point mean sinc; do ct-project -q -n 4 --coarsen 4 --pixel $p up.nii $p.exr; done
ct-fdk -q --quantity density p.exr density.nii 2>/dev/null
ct-nabgs -q -b up.nii -n 10 -g 100 p.exr r.ply
[ -s r.ply ] && [ -s density.nii ] && [ -s sinc.exr ]; ok $? 'files that say what they are'

against() { # against STATUS FILE WORD TOOL ARGS...: the error names the file and the word
	want=$1 file=$2 word=$3; shift 3
	exits "$want" "$*" "$@"
	grep -q -- "$file" err && grep -q -- "$word" err; ok $? "names $file and $word"
	[ ! -e no.nii ] && [ ! -e no.exr ] && [ ! -e no.ply ]; ok $? 'a contradiction with the file writes nothing'
}
against 2 lr.nii 'factor 2,2,2' ct-upsample -x 2 lr.nii no.nii
against 2 lr.nii 'sigma 1' ct-upsample --sigma 1 lr.nii no.nii
against 2 lr.nii 'sampling mean' ct-upsample --decimate mean lr.nii no.nii
against 2 lr.nii 'noise 9' ct-upsample --noise 9 lr.nii no.nii
against 2 lr.nii 'factor 2,2,2' ct-sr -x 2 lr.nii no.nii
against 2 '--factor: 0.9' '\[1, 16\]' ct-sr -x 0.9 lr.nii no.nii
against 2 '--factor: 1025' '\[1, 16\]' ct-sr -x 1025 lr.nii no.nii
against 2 OUT 'name is empty' ct-sr hr.nii ''
against 2 hr.nii '--window' ct-project -w -512:3071 hr.nii no.exr
against 2 density.nii '--quantity' ct-project --quantity hu density.nii no.exr
against 2 p.exr '--window' ct-fdk -w -512:3071 p.exr no.nii
against 2 sinc.exr '--factor 2' ct-ddnm -x 2 sinc.exr no.exr
against 2 sinc.exr '--expert operator: mean' ct-ddnm --expert operator=mean sinc.exr no.exr
against 2 mean.exr '--expert operator: matched' ct-ddnm --expert operator=matched mean.exr no.exr
against 2 up.nii '--factor 8' ct-nabgs -x 8 -b up.nii p.exr no.ply
against 2 up.nii '--window' ct-nabgs -w -512:3071 -b up.nii p.exr no.ply
against 2 up.nii '--window' ct-fuse -w -512:3071 up.nii lr.nii p.exr no.nii
against 2 r.ply '--window' ct-compose -w -512:3071 up.nii r.ply no.nii
against 3 density.nii density ct-metrics hr.nii density.nii

# what the file says is what is done
operator() { ct-ddnm -q --steps 1 "$@" - | ct-info - | awk '$1 == "operator" {print $2}'; }
[ "$(operator sinc.exr)" = matched ]; ok $? 'pixels that are cut at the Nyquist frequency are taken for that'
[ "$(operator mean.exr)" = mean ]; ok $? 'an operator of means is noted as mean'
[ "$(operator point.exr)" = mean ]; ok $? 'rays for means, as published'
[ "$(operator --expert operator=matched point.exr)" = matched ]; ok $? 'or for what is asked'
exits 0 'the same again is no contradiction' ct-ddnm -q -x 4 --steps 1 --expert operator=matched sinc.exr a.exr
exits 0 'nor of the factor' ct-nabgs -q -x 4 -b up.nii -n 5 -g 50 p.exr a.ply
exits 0 'nor of the noise' ct-upsample -q -x 4 --noise 5 --iterations 3 lr.nii a.nii
done_testing
