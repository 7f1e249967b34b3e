#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# SIGINT, SIGTERM, SIGUSR1: every command ends soon, with status 75, and leaves nothing but its state.
. "$srcdir/tests/tap.sh"
ulimit -t 60
ct-phantom -q --size 32x32x32 --spacing 4 marks hr.nii
ct-degrade -q -x 4 hr.nii lr.nii
ct-upsample -q -x 4 -m linear lr.nii up.nii
ct-project -q -n 8 hr.nii p.exr

# Waiting for a pipe that says nothing.
mkfifo pipe
waits() { # waits SIGNAL TOOL ARGS...
	sig=$1; shift
	"$@" 2>err & pid=$!
	listens $pid
	exec 9>pipe # is opened when the other end is, which is what it waits for next
	kill -$sig $pid
	wait $pid; got=$?
	exec 9>&-
	[ $got -eq 75 ]; ok $? "$1 waits for a pipe: SIG$sig ends it (status $got)"
	[ "$(tail -n 1 err)" = "$1: stopped on request" ]; ok $? 'and it says so'
	[ -z "$(ls new* 2>/dev/null)" ]; ok $? 'a stopped command leaves no new file'
}
waits TERM ct-convert pipe new.nii
waits TERM ct-degrade -x 2 pipe new.nii
waits INT ct-upsample -x 2 pipe new.nii
waits USR1 ct-project pipe new.exr
waits TERM ct-fdk pipe new.nii
waits TERM ct-upsample -m prior -p pipe lr.nii new.nii
waits INT ct-ddnm -x 4 pipe new.exr
waits TERM ct-nabgs -b pipe p.exr new.ply
waits TERM ct-fuse up.nii pipe p.exr new.nii
waits TERM ct-compose pipe up.nii new.nii
waits INT ct-metrics pipe hr.nii
waits TERM ct-info pipe
waits TERM ct-train new.safetensors pipe
waits INT ct-sr -x 2 pipe new.nii

# At work: how much CPU time goes by between the signal and the end.
used() { awk '{print ($14 + $15) / '"$(getconf CLK_TCK)"'}' /proc/$1/stat 2>/dev/null; }
spent() { # of all that has ended, into $now
	times >times # not in a subshell
	now=$(tail -n 1 times | awk '{split($0, v, /[ms ]+/); print v[1]*60 + v[2] + v[3]*60 + v[4]}')
}
works() { # works SECONDS TOOL ARGS...: it is told to stop when it has worked so long
	after=$1; shift
	spent; start=$now
	"$@" 2>err & pid=$!
	while at=$(used $pid) && awk "BEGIN {exit !($at < $after)}"; do sleep 0.02; done
	kill -STOP $pid; at=$(used $pid); kill -TERM $pid; kill -CONT $pid; wait $pid; got=$?
	spent
	[ $got -eq 75 ] || sed 's/^/# /' err
	[ $got -eq 75 ]; ok $? "$1 at work: stopped (status $got)"
	awk "BEGIN {exit !($now - $start - $at < 2.5)}"; ok $? "after $(awk "BEGIN {print $now - $start - $at}") s of CPU time"
	ls -d .ctsr-* >/dev/null 2>&1; [ $? -ne 0 ]; ok $? 'a stopped command leaves nothing half-written'
}
ct-phantom -q --size 128x128x128 --spacing 2 ellipsoids big.nii
ct-degrade -q -x 4 big.nii big-lr.nii
ct-upsample -q -x 4 -m linear big-lr.nii big-up.nii
ct-project -q -n 20 --sampling 1.5 big.nii big.exr
works 0.4 ct-upsample -x 4 --estimate --tolerance 0 --iterations 100000 big-lr.nii new.nii
[ ! -e new.nii ]; ok $? 'a stopped ct-upsample leaves no output'
works 2 ct-nabgs -q -n 100000 -b big-up.nii -g 20000 big.exr new.ply
[ -s new.ply.state ]; ok $? 'a stopped ct-nabgs leaves its state'
works 1 ct-fuse -q -n 100000 --expert lambda-projections=1 big-up.nii big-lr.nii big.exr new.nii
[ -s new.nii.state ]; ok $? 'a stopped ct-fuse leaves its state'
works 2 ct-train -q --steps 100000 new.safetensors big.exr
[ -s new.safetensors.state ] && [ -s new.safetensors ]; ok $? 'and the state, and the prior of then'

# Progress: on a terminal, and nowhere else.
few() { echo "ct-nabgs -f -b up.nii -n 20 -g 300 --expert max-gaussians=300 $* p.exr bar.ply"; }
if script -qec true /dev/null </dev/null >/dev/null 2>&1; then
	script -qec "$(few)" /dev/null </dev/null >term
	tr '\r' '\n' <term | grep -q 'ct-nabgs: [0-9]* %'; ok $? 'a terminal is told how far the work is'
	script -qec "$(few -q)" /dev/null </dev/null >term
	grep -q 'ct-nabgs: [0-9]* %' term; [ $? -eq 1 ]; ok $? 'but not with -q'
else
	skip 'progress on a terminal' 'no script, or no terminals'
fi
$(few) >out 2>err; [ $? -eq 0 ] && ! grep -q '[0-9] %' out err; ok $? 'nor is a file'

# States: one form for all commands; which runs may go on from one, and which may not.
part resume
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
