#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# States: one form for all commands; which runs may go on from one, and which may not.
. "$srcdir/tests/tap.sh"
ulimit -t 30
ct-phantom --size 24x24x24 --spacing 4 marks hr.nii
ct-phantom --size 24x24x24 --spacing 4 -s 1 marks seed.nii # the same, but says another seed
ct-phantom --size 24x24x24 --spacing 4 cube other.nii
ct-degrade -x 2 hr.nii lr.nii && ct-upsample -x 2 -m linear lr.nii up.nii
ct-degrade -x 2 other.nii lr-other.nii
for v in hr seed other; do
	ct-project -n 20 $v.nii $v.exr
	ct-project -n 60 --coarsen 4 $v.nii $v-low.exr
done
ct-project -n 60 hr.nii init.exr
cp hr.exr same.exr; cp hr-low.exr same-low.exr; cp up.nii up-same.nii; cp lr.nii lr-same.nii

# stopped FOLDER TOOL ARGS...: a run into FOLDER/o that was stopped and left its state
stopped() {
	out=$1/o; mkdir "$1"; shift
	signalled 40 15 "$@" "$out"; got=$?
	[ $got -eq 75 ] && [ -s "$out.state" ]; ok $? "$1 is stopped, and has a state"
	[ "$(stat -c %a "$out.state")" = 600 ]; ok $? 'that is for its owner'
	cp "$out.state" before
}
brief() { (ulimit -t 8; exec "$@"); } # what goes on where it should refuse ends, and the test fails
refused() { # refused WHERE TOOL ARGS...
	where=$1; shift
	exits 3 "$1 refuses another: $where" brief "$@" --resume "$out"
	has err "^$1: $out.state: is of a run where $where\$" 'the error of another run names its difference'
	cmp -s before "$out.state"; ok $? 'and keeps the state'
}

ct-ddnm -q -x 4 -n 12 hr-low.exr whole.exr
stopped d ct-ddnm -q -x 4 -n 12 hr-low.exr
exits 4 'a state is not written over' ct-ddnm -x 4 -n 12 hr-low.exr d/o
has err 'd/o.state: exists; --resume goes on' 'and what can be done is said'
refused "--steps was '12', not '13'" ct-ddnm -x 4 -n 13 hr-low.exr
refused "--seed was '0', not '1'" ct-ddnm -x 4 -n 12 -s 1 hr-low.exr
refused "--sigma-y was 'nan', not '0.5'" ct-ddnm -x 4 -n 12 --sigma-y 0.5 hr-low.exr
refused "--expert travel was '', not '2,2'" ct-ddnm -x 4 -n 12 --expert travel=2,2 hr-low.exr
refused "--expert operator was 'file', not 'matched'" ct-ddnm -x 4 -n 12 --expert operator=matched hr-low.exr
refused 'IN held something else' ct-ddnm -x 4 -n 12 other-low.exr
refused "IN seed was '0', not '1'" ct-ddnm -x 4 -n 12 seed-low.exr
refused '--init held something else' ct-ddnm -x 4 -n 12 --init init.exr hr-low.exr
exits 0 'the same input of another name' ct-ddnm -x 4 -n 12 -t 1 --resume same-low.exr d/o
[ ! -e d/o.state ]; ok $? 'no state is left'
for f in whole.exr d/o; do ct-info $f | grep -E '^(min|max|mean|sd) ' >"$f.info"; done
[ -s whole.exr.info ] && cmp -s whole.exr.info d/o.info; ok $? 'and the result is that of a whole run'

stopped g ct-nabgs -q -b up.nii -n 100000 -g 300 --expert max-gaussians=300 --checkpoint-every 20 hr.exr
set -- ct-nabgs -n 100000 -g 300 --expert max-gaussians=300
refused "--expert lambda-tv was '0.050000000000000003', not '0.0625'" "$@" --expert lambda-tv=0.0625 -b up.nii hr.exr
refused "--mode was 'residual', not 'full'" "$@" -m full -b up.nii hr.exr
refused '--base held something else' "$@" -b other.nii hr.exr
refused '--lr held something else' "$@" --lr lr.nii -b up.nii hr.exr
refused 'IN held something else' "$@" -b up.nii other.exr
signalled 40 15 "$@" -v --checkpoint-every 30 -b up-same.nii --resume same.exr g/o 2>err; [ $? -eq 75 ] && grep -q continuing err; ok $? 'other names, another time to save: goes on'

stopped f ct-fuse -q -n 100000 --checkpoint-every 1 up.nii lr.nii hr.exr
set -- ct-fuse -n 100000
refused "--iterations was '100000', not '99999'" ct-fuse -n 99999 up.nii lr.nii hr.exr
refused 'LR held something else' "$@" up.nii lr-other.nii hr.exr
refused '--base-projections held something else' "$@" --base-projections other.exr up.nii lr.nii hr.exr
signalled 40 15 "$@" -v --residual-out r.nii --resume up-same.nii lr-same.nii same.exr f/o 2>err; [ $? -eq 75 ] && grep -q continuing err; ok $? 'other names, another output: goes on'

sed 's/run\.version/run.versi0n/' f/o.state >cut && mv cut f/o.state
exits 3 'what is no state' "$@" --resume up.nii lr.nii hr.exr f/o
has err 'is not the state of a run' 'is said to be none'
exits 2 'a stream has none' ct-ddnm --resume hr-low.exr -
has err 'resume wants OUT to be a file' '--resume to a stream says that OUT must be a file'

# one run an output, while it lives
exits 4 'two runs into one output' flock two.exr.state.ct-locked ct-ddnm -n 2 -x 4 hr-low.exr two.exr
has err 'two.exr.state: another run is making it' 'a state that another run is making is named'
[ ! -e two.exr ] && ct-ddnm -q -n 2 -x 4 hr-low.exr two.exr && [ "$(echo two.exr*)" = 'two.exr two.exr.state.ct-locked' ]
ok $? 'one that is gone holds nothing, and a lock file that another program made stays'
rm two.exr*; ct-ddnm -q -n 2 -x 4 hr-low.exr two.exr && [ "$(echo two.exr*)" = two.exr ]; ok $? 'a lock of our own is removed'
done_testing
