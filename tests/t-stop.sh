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
done_testing
