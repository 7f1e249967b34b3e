#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What a command tells while it works, and how it stops.
. "$srcdir/tests/tap.sh"

# What a command tells while it works.
# What -v tells is so: sizes, ranges, blur, iterations and how far they came.
ct-phantom -q --size 20x24x28 --spacing 4,3,2 ellipsoids a.nii || exit 99
tells() { # tells LINE COMMAND...: it is among what is told
	line=$1; shift
	"$@" -f -v >out 2>err; status=$?
	sed -i 's/, [0-9.]* s$/, TIME/' err
	[ $status -eq 0 ] && grep -qxF -- "$1: $line" err; ok $? "$*: $line"
	grep -qxF -- "$1: $line" err || sed 's/^/# /' err
}
quiet() { "$@" -f 2>err && [ ! -s err ]; ok $? "without -v nothing: $*"; }
most=$(ct-info a.nii | sed -n 's/^max *//p' | awk '{printf "%g", $1}')
tells "20x24x28 voxels of 4x3x2 mm, -1024 to $most HU" ct-convert a.nii b.nii
quiet ct-convert a.nii b.nii
tells '20x24x28 to 10x8x28, sigma 0.849329,1.27399,0' ct-degrade -x 2,3,1 a.nii c.nii
tells '5 views of 16x12, cone beam' ct-project -n 5 --det 16x12 a.nii p.exr
tells '5 views of 4x3, parallel beam' ct-project -n 5 --det 16x12 --beam parallel --coarsen 4 a.nii q.exr
ct-project -q -f -n 30 --arc 360 --det 16x12 a.nii p.exr
tells 'filter to 1 of the Nyquist frequency' ct-fdk p.exr f.nii
! grep -q 'do not see' err; ok $? 'all views see it'
tells 'filter to 0.25 of the Nyquist frequency' ct-fdk --expert cutoff=0.25 p.exr f.nii
quiet ct-fdk p.exr f.nii
ct-project -q -f -n 30 --arc 360 --det 8 --expert pitch=4 a.nii near.exr
tells '30 of 30 views do not see the whole grid' ct-fdk near.exr f.nii
ct-project -q -f -n 30 --arc 220 --det 16x12 a.nii short.exr
tells 'warning: a short scan of 220 degrees: rays seen twice count twice (--parker weighs them)' ct-fdk short.exr f.nii
ct-fdk -f -v --parker short.exr f.nii 2>err; ! grep -q 'short scan' err; ok $? 'a short scan with --parker is not warned of'

# iterations: so many by default, and the residual is that of what is written
for m in cgls=30 sirt=100 tv=100; do
	ct-fdk -f -v -m ${m%=*} --grid 6 p.exr f.nii 2>err
	grep -q "^ct-fdk: ${m#*=} iterations, residual " err; ok $? "$m iterations of its own"
done
if command -v python3 >/dev/null; then
	cp "$srcdir/tests/exr.py" .
	for m in 'cgls -n 3' 'cgls -n 3 --expert projector=joseph' 'sirt --expert tolerance=0.2'; do
		# shellcheck disable=SC2086
		ct-fdk -f -v -m $m --quantity density p.exr d.nii 2>err
		by=siddon; case $m in *joseph) by=joseph ;; esac
		ct-project -q -f -m $by --like p.exr d.nii again.exr
		python3 - "$m" >log 2>&1 <<-'EOP'
			import math, re, sys
			from exr import read
			a, b = sum(read('again.exr'), []), sum(read('p.exr'), [])
			n, said = re.search(r': (\d+) iterations, residual ([0-9.]+)\n$', open('err').read()).groups()
			is_ = math.sqrt(sum((x - y) ** 2 for x, y in zip(a, b)) / sum(y * y for y in b))
			print(n, said, is_)
			assert abs(is_ - float(said)) < 2e-5
			words = sys.argv[1].split()
			assert n == words[2] if '-n' in words else is_ < 0.2 and 1 < int(n) < 100
		EOP
		ok $? "ct-fdk -m $m: the residual ($(cat log))"
	done
else
	skip 'residuals' 'no python3'
fi
ct-degrade -q -f -x 4,3,2 a.nii lr.nii
tells '5x8x14 to 20x24x28, linear, TIME' ct-upsample -m linear lr.nii up.nii

# What stands on a terminal while a command works: neither how far it is nor the time left runs backwards.
part terminal
on_terminal() {
	terminal || { skip 'progress on a terminal' 'no python3, or no terminal'; return; }
	# runs NAME SLOW COMMAND...: as on a terminal of a machine that is so many times slower, into shown
	runs() {
		name=$1; slow=$2; shift 2
		python3 "$srcdir/tests/terminal.py" shown --slow "$slow" "$@" >shown; ok $? "$name runs"
		sed 's/^/# /' shown
		# percentage and seconds of each line: the one never falls, the other never rises
		sed -nE 's/^ct-[a-z]*: ([0-9]+) %(, about ([0-9]+):([0-9]+) left)?$/\1 \3 \4/p' shown |
			awk 'BEGIN {left = 1e9} $1 < done || $1 > 99 {bad = 1} {done = $1}
				NF == 3 {s = 60 * $2 + $3; if (s > left) bad = 1; left = s}
				END {exit bad || NR < 2}'
		ok $? "$name: the percentage never falls and the time never rises"
		! grep '^ct-' shown | grep -qvE '^ct-[a-z]*: ([0-9]+ %|assumed: |noise: |[0-9]+x)'; ok $? "$name: no stage is named"
	}
	ct-phantom -q --size 96x96x96 shepp-logan t.nii
	ct-degrade -q -x 4 --sigma .5 --decimate point t.nii alias.nii
	ct-degrade -q -x 4 t.nii scan.nii
	runs 'a loop that ends where it may' 12 ct-upsample -t 1 -x 4 --tolerance .4 scan.nii one.nii
	runs 'one that takes them all' 12 ct-upsample -t 1 -x 4 --iterations 60 --tolerance 0 alias.nii two.nii
	runs 'several works' 2 ct-sr -t 1 -x 4 alias.nii three.nii
	has shown '^ct-sr: [0-9]* %, about 0:[0-9]* left$' 'several works say how much of the whole is left'
	runs 'a run with rehearsals and a page' 2 ct-sr -t 1 --confidence e.nii --report r.html scan.nii six.nii
	ct-upsample -x 4 scan.nii four.nii 2>err; [ ! -s err ]; ok $? 'nothing in a pipe'
	python3 "$srcdir/tests/terminal.py" shown ct-upsample -q -x 4 scan.nii five.nii >shown
	[ ! -s shown ]; ok $? 'no progress is shown with -q'
}
on_terminal

# SIGINT, SIGTERM, SIGUSR1: every command ends soon, with status 75, and leaves nothing but its state.
part signals
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
LC_ALL=C sed 's/"ct:seed":"0"/"ct:seed":"1"/' hr.nii >seed.nii # the same, but says another seed
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

cp f/o.state whole
for at in 3 300; do
	for byte in '\252' '\125'; do
		printf "$byte" | dd of=f/o.state bs=1 seek=$(($(wc -c <f/o.state) - at)) conv=notrunc 2>/dev/null
		! cmp -s f/o.state whole || continue
		exits 3 "a state with another byte, $at from its end, is refused" "$@" --resume up.nii lr.nii hr.exr f/o
		has err '^ct-fuse: f/o.state: is damaged' "a damaged state is named, $at from its end"
		break
	done
	cp whole f/o.state
done
sed 's/run\.version/run.versi0n/' f/o.state >cut && mv cut f/o.state
exits 3 'what is no state' "$@" --resume up.nii lr.nii hr.exr f/o
has err 'is not the state of a run' 'is said to be none'
exits 2 'a stream has none' ct-ddnm --resume hr-low.exr -
has err 'resume wants OUT to be a file' '--resume to a stream says that OUT must be a file'

mkfifo fifo; cat fifo >piped & ct-ddnm -q -n 1 -x 4 hr-low.exr fifo; ok $? 'a command that keeps a state writes a FIFO'; wait
[ -s piped ] && [ "$(echo fifo*)" = fifo ]; ok $? 'a FIFO gets the result and no state beside it'
ct-info piped | grep ^hash >1; ct-ddnm -q -n 1 -x 4 hr-low.exr /dev/stdout | ct-info - | grep ^hash | cmp -s - 1; ok $? '/dev/stdout in a pipe gets the same projections'
# nobody reads the words of a command that is stopped, as of one that ssh left behind
mkfifo silent; exec 7<>silent
{ { ct-info - <&7 & echo $! >pid; wait $!; echo $? >status; } 2>&1 | true; } &
until [ -s pid ]; do sleep 0.05; done
pid=$(cat pid); listens "$pid"; kill -TERM "$pid"
n=0; until [ -s status ] || [ $n -ge 300 ]; do sleep 0.2; n=$((n + 1)); done # it hung for ever: a minute is no limit of a busy machine
kill -KILL "$pid" 2>/dev/null; wait; exec 7<&-
[ "$(cat status)" = 75 ]; ok $? 'a command whose words nobody reads is stopped with status 75'
# one run an output, while it lives
exits 4 'two runs into one output' flock two.exr.state.ct-locked ct-ddnm -n 2 -x 4 hr-low.exr two.exr
has err 'two.exr.state: another run is making it' 'a state that another run is making is named'
[ ! -e two.exr ] && ct-ddnm -q -n 2 -x 4 hr-low.exr two.exr && [ "$(echo two.exr*)" = 'two.exr two.exr.state.ct-locked' ]
ok $? 'one that is gone holds nothing, and a lock file that another program made stays'
rm two.exr*; ct-ddnm -q -n 2 -x 4 hr-low.exr two.exr && [ "$(echo two.exr*)" = two.exr ]; ok $? 'a lock of our own is removed'
done_testing
