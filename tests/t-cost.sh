#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What a command costs, as --dry-run tells, and holds; memory that is bounded by slabs.
. "$srcdir/tests/tap.sh"

# --dry-run tells the cost of every command in the same words, and makes nothing.
ct-phantom --size 16x16x16 --spacing 4 ellipsoids hr.nii
ct-degrade -x 2 hr.nii lr.nii
ct-upsample -x 2 -m linear lr.nii up.nii
ct-project -n 4 hr.nii p.exr
ct-project -n 4 --coarsen 4 hr.nii low.exr
cost() { # cost STATE TOOL ARGS...: STATE is a regular expression of what follows the disk
	state=$1; shift
	exits 0 "$1 --dry-run" "$@" --dry-run
	[ "$(tail -n 4 out | cut -c1-10 | tr -d '\n')" = 'work      time      memory    disk      ' ]
	ok $? 'a dry run ends with the four lines of the cost'
	grep -Eq '^time      ([1-9][0-9]* s|[0-9.]+ h) on [1-9][0-9]* threads$' out &&
		grep -Eq '^memory    [1-9][0-9]* MiB$' out &&
		grep -Eq "^disk      [1-9][0-9]* MiB$state\$" out; ok $? 'a dry run states disk in one form'
	[ ! -e new ]; ok $? 'a dry run makes no output'
}
kept=', and [1-9][0-9]* MiB of state beside it'
cost '' ct-upsample lr.nii new
cost '' ct-project -n 4 hr.nii new
cost '' ct-fdk p.exr new
cost '' ct-fdk -m sirt p.exr new
cost "$kept" ct-ddnm -x 4 -n 2 low.exr new
cost "$kept" ct-nabgs -b up.nii -g 50 --expert max-gaussians=100 p.exr new
cost "$kept" ct-fuse -n 2 up.nii lr.nii p.exr new
cost "$kept" ct-train -a model_channels=32,channel_mult=1:2 -p 8 --expert batch=1 new p.exr
exits 0 'a dry run is printed as JSON' ct-nabgs --dry-run --json -b up.nii -g 50 --expert max-gaussians=100 p.exr new
python3 -c '
import json
c = json.load(open("out"))
assert set(c) == {"work", "seconds", "threads", "memory-bytes", "disk-bytes", "state-bytes"}
assert c["disk-bytes"] == 4400 and c["memory-bytes"] > 0 and c["seconds"] > 0'
ok $? 'with the same numbers'
ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean hr.nii thick.nii
cost '' ct-upsample -m prior -p "$builddir/slices.safetensors" thick.nii new
has out '^work *tv and the prior of 4096 voxels$' 'a dry run of the prior names it'

# Memory is bounded by slabs inside the call: ct-upsample and ct-sr with --memory.
part slabs
command -v python3 >/dev/null || { skip 'memory is bounded by slabs' 'no python3'; done_testing; }
cat >look.py <<'END'
"""peak COMMAND...: runs it, KiB to the file used. same A B [MOST]: are the voxels the same?"""
import resource, struct, subprocess, sys
def voxels(name):
    b = open(name, 'rb').read()
    return b[int(struct.unpack('<f', b[108:112])[0]):]
if sys.argv[1] == 'peak':
    rc = subprocess.call(sys.argv[2:])
    open('used', 'w').write(str(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss))
    sys.exit(rc)
a, b = (voxels(n) for n in sys.argv[2:4])
if len(sys.argv) == 4:
    sys.exit(a != b)
a, b = (struct.unpack('<%df' % (len(v) // 4), v) for v in (a, b))
most = max(abs(x - y) for x, y in zip(a, b))
print('# %.2g apart' % most)
sys.exit(len(a) != len(b) or not most < float(sys.argv[4]))
END
slabs=$PWD; look() { python3 "$slabs/look.py" "$@"; }
within() { [ "$(cat used)" -lt $(($1 * 1024)) ]; ok $? "$2 within $1 MiB ($(($(cat used) / 1024)))"; } # within MIB NAME
beyond() { [ "$(cat used)" -gt $(($1 * 1024)) ]; ok $? "$2 beyond $1 MiB ($(($(cat used) / 1024)))"; }
mkdir made
alone() { [ "$(ls -A made)" = "$1" ]; ok $? "${2:-and leaves nothing else}"; } # alone FILES
near() { ct-metrics --json "$1" "$2" | awk -F'[:,]' '/"rmse-hu"/ {rms = $2} /"max-hu"/ {most = $2} END {print "#", rms, most; exit !(rms < .1 && most < 1)}'; }
TMPDIR=$PWD/tmp; export TMPDIR; mkdir tmp
ct-phantom -q --size 64x64x512 ellipsoids hr.nii && ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean hr.nii thick.nii || exit 99
known=$builddir/slices.safetensors

# ct-upsample
for m in tv htv; do
	ct-upsample -q -m $m thick.nii whole-$m.nii
	exits 0 "$m refines in slabs within --memory" ct-upsample -q -m $m --memory 52M thick.nii made/$m.nii
	near whole-$m.nii made/$m.nii; ok $? "$m in slabs is within .1 HU RMS of the whole, and 1 HU anywhere"
done
history() { ct-info "$1" | sed -n '/^history/,/^hash/{/^hash/d;s/ [a-z-]*\.nii #/ OUT #/;p;}'; }
history whole-tv.nii >a
history made/tv.nii | cmp - a && grep -q 'thick.nii xxh3:' a
ok $? 'the history does not record how memory was bounded'
ct-phantom -q --size 96x96x1400 ellipsoids h2.nii && ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean h2.nii t2.nii
if sanitized ct-upsample; then
	skip 'slabs take less memory than the whole' 'sanitizers take their own'
else
	look peak ct-upsample -q -f -t 1 -m tv t2.nii w.nii; all=$(cat used)
	exits 0 'a larger volume is refined in slabs' look peak ct-upsample -q -f -t 1 -m tv --memory 130M t2.nii w.nii
	[ $((4 * $(cat used))) -lt $((3 * all)) ]; ok $? "slabs take less memory than the whole ($(cat used), $all KiB)"
	within 130 'slabs of a larger volume stay'
fi
rm -f h2.nii t2.nii w.nii
exits 0 'three threads refine in slabs within --memory' ct-upsample -q -t 3 -m tv --memory 52M thick.nii three.nii
look same three.nii made/tv.nii; ok $? 'slabs give the same voxels for any number of threads'
exits 0 '-m dc with --start refines in slabs' ct-upsample -q -m dc --start hr.nii --memory 56M thick.nii made/near.nii
ct-upsample -q -m dc --start hr.nii thick.nii near.nii
near near.nii made/near.nii
ok $? 'dc in slabs is near dc of the whole volume'
exits 0 'ct-upsample --dry-run accepts --memory' ct-upsample --dry-run -m tv --memory 52M thick.nii no.nii
has out '^work *tv of 2097152 voxels in [2-9] slabs$' 'the dry run prints the number of slabs'
awk '$1 == "memory" {m = $2} END {exit !(m > 27 && m < 43)}' out; ok $? 'the dry run prints the memory of the slabs'
[ ! -e no.nii ]; ok $? 'the dry run writes no volume'
exits 0 'the prior refines in slabs with --std' ct-upsample -q -t 1 -m prior -p "$known" --memory 138M --std made/std.nii thick.nii made/p.nii
ct-upsample -q -m prior -p "$known" --std std.nii thick.nii p.nii
near p.nii made/p.nii; ok $? 'the prior in slabs is near the prior of the whole'
ct-metrics --ssim none --range 1 --json std.nii made/std.nii | sed -n 's/.*"rmse-hu": \([0-9.e+-]*\).*/\1/p' | awk '{near = $1 < .1} END {exit !near}'
ok $? 'the prior in slabs predicts the error of the whole'
alone "$(printf '%s\n' htv.nii near.nii p.nii std.nii tv.nii)" 'ct-upsample in slabs leaves nothing beside its results'

# ct-sr
exits 0 'ct-sr refines in slabs within --memory' ct-sr -t 1 -Q draft --memory 52M thick.nii o.nii
tail -n 1 err | grep -qE '^ct-sr: 64x64x128 to 64x64x512, 1,1,4 times; blur 0 voxels, mean \(from the file\); .*; h?tv, [0-9]+ iterations \([a-z, -]+\), in [2-9] slabs; data residual [0-9.e-]+ HU RMS; [0-9.]+ s, [0-9]+ MiB$'
ok $? 'ct-sr reports the number of slabs'
near whole-tv.nii o.nii; ok $? 'ct-sr in slabs is near TV of the whole volume'
[ -z "$(ls -A tmp)" ]; ok $? 'slabs leave nothing in TMPDIR'
ct-sr -q -Q draft --memory 52M - - <thick.nii >stream.nii; ok $? 'ct-sr refines a stream in slabs'
look same stream.nii o.nii; ok $? 'a stream refined in slabs gives the same voxels'
exits 0 'ct-sr refines in slabs with --confidence and --report' ct-sr -q -t 1 --memory 138M --prior "$known" --confidence c.nii --report r.html thick.nii r.nii
near p.nii r.nii; ok $? 'ct-sr with the prior in slabs is near ct-upsample with the prior'
grep -q 'id="error"' r.html; ok $? 'the report of a run in slabs shows the predicted error'
if script -qec true /dev/null </dev/null >/dev/null 2>&1; then
	ct-phantom -q --size 160x160x900 ellipsoids big.nii && ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean big.nii big4.nii && rm big.nii
	script -qec "ct-sr -f -Q draft big4.nii w.nii" /dev/null </dev/null 2>&1 | tr '\r' '\n' >terminal
	has terminal 'ct-sr: tv of 23040000 voxels: about [0-9]* s on [0-9]* threads, [0-9]* MiB of memory, 88 of disk' 'a terminal shows time, memory and disk before the work'
	rm big4.nii w.nii
else
	skip 'a terminal shows time, memory and disk before the work' 'no script'
fi

# what does not fit
exits 7 'a --memory that no slab fits into is refused with status 7' ct-upsample --memory 30M thick.nii made/no.nii
has err '^ct-upsample: thick.nii: takes [0-9]* MiB of memory in slabs, and 30 MiB are given: ' 'the error of a --memory that no slab fits into gives what slabs take'
ct-degrade -q -x 4 hr.nii sinc.nii
exits 7 'a scan that cannot be cut into slabs is refused with status 7' ct-sr -Q draft --memory 40M sinc.nii made/no.nii
has err '^ct-sr: sinc.nii: takes [0-9]* MiB of memory as a whole, which band-limited sampling (sinc) or a wide blur along all axes asks, ' 'the error of a scan that cannot be cut says why'
just=$(ct-sr --prior "$known" --memory 40M sinc.nii made/no.nii 2>&1 | sed -n 's/.* takes \([0-9]*\) MiB .*/\1/p')M
exits 0 'a page is no reason to refuse what fits without it' ct-sr --prior "$known" --memory "$just" --report page.html sinc.nii page.nii
has err '^ct-sr: the predicted error is left out, for which the memory is too small$' 'what does not fit beside the result is left out, and said'
has page.html '<li>No predicted error was given' 'the page says that nothing is predicted'
exits 7 'a predicted error that is asked for is refused where it does not fit' ct-sr --prior "$known" --memory "$just" --confidence made/e.nii sinc.nii made/no.nii
ct-phantom -q --size 192x48x256 ellipsoids wide.nii && ct-degrade -q -f -x 1,1,4 --sigma 0,0,4 --decimate point wide.nii wide4.nii && ct-upsample -q -m tv wide4.nii wide-tv.nii
exits 0 'a blur of whole slices is refined in slabs' ct-upsample -v -m tv --memory 60M wide4.nii made/wide.nii
has err 'refines in [0-9]* slabs' 'ct-upsample -v reports the number of slabs'
near wide-tv.nii made/wide.nii; ok $? 'a blur of whole slices in slabs is near the whole'
rm -f wide*.nii
for w in 100 M -1M 1e3M 600MB; do
	exits 2 "--memory=$w is refused with status 2" ct-upsample --memory=$w thick.nii made/no.nii
	has err "'$w' is no size such as 600M or 2G" "the error of --memory=$w gives examples of a size"
done
[ ! -e made/no.nii ]; ok $? 'a bound that no slab fits into leaves nothing'
ct-phantom -q --size 160x160x160 ellipsoids cube.nii && ct-degrade -q -x 4 -p P3 --noise 9 cube.nii cube4.nii && rm cube.nii
exits 0 'a scan whose iterations are set on a part of it is refined' ct-sr -f -Q draft cube4.nii cube.nii
n=$(sed -n 's/.*; htv, \([0-9]*\) iterations .*/\1/p' err)
exits 0 'a scan whose iterations are set on a part of it is refined in slabs' ct-sr -Q draft --memory 105M cube4.nii slabs.nii
[ "$n" -ge 50 ] && grep -q "; htv, $n iterations .* slabs" err; ok $? "slabs run as many iterations as the whole ($n)"
near cube.nii slabs.nii; ok $? 'slabs give the volume of the whole if iterations are set on a part'

# the disk, and signals
if unshare -rm true 2>/dev/null; then
	mkdir small
	full() { # full MIB OF OPTIONS...: in a folder of 3 MB
		needs=$1 of=$2; shift 2
		exits 4 "a folder without room for $of ends ct-sr with status 4" unshare -rm sh -c 'mount -t tmpfs -o size=3m x small && ct-sr -v -t 1 -f -Q draft "$@" 2>told; s=$?; ls -A small >left; exit $s' - "$@"
		has told "^ct-sr: small[^ ]*: the result takes $needs MiB of disk, [0-3] are free" "the error of a folder without room for $of gives the disk it takes"
		! grep -q 'iterations' told && [ ! -s left ]
		ok $? "a folder without room for $of is reported before the work and stays empty"
	}
	full 8 OUT thick.nii small/o.nii
	full 4 'a DICOM file of 16 bits' thick.nii small/o.dcm
	full 16 'a result and its predicted error' --confidence small/c.nii thick.nii small/o.nii
	exits 4 'a folder without room ends ct-upsample with status 4' unshare -rm sh -c 'mount -t tmpfs -o size=3m x small && exec ct-upsample -v thick.nii small/o.nii'
	! grep -q iterations err; ok $? 'ct-upsample reports a folder without room before the work'
else
	skip 'a folder without room ends ct-sr with status 4' 'no mounts'
fi
ct-upsample -q --iterations 100000 --tolerance 0 --memory 52M thick.nii made/stopped.nii 2>err & pid=$!
listens $pid; kill -TERM $pid; wait $pid
[ $? -eq 75 ]; ok $? 'SIGTERM ends a run in slabs with status 75'
[ ! -e made/stopped.nii ] && [ -z "$(ls -A tmp)" ]; ok $? 'a run in slabs that a signal stopped leaves nothing'

# What --dry-run tells of memory and disk is the size of what is held; the time is that of what was tried,
# as many times as it is to be done.
part figures
if sanitized ct-upsample; then
	skip 'memory' 'sanitizers take their own'
	done_testing
fi
cost() { "$@" --dry-run >out 2>err || cat err; } # cost TOOL ARGS...
mib() { sed -n "s/^$1  *\([0-9]*\) MiB.*/\1/p" out; }
state() { sed -n 's/^disk .* and \([0-9]*\) MiB of state.*/\1/p' out; }
seconds() { sed -n 's/^time  *\([0-9.]*\) s .*/\1/p; s/^time  *\([0-9.]*\) h .*/\1 * 3600/p' out; }
json() { sed -n "s/^  \"$1\": \"\{0,1\}\([^,\"]*\).*/\1/p" out; }
is() { # is NAME EXPRESSION: awk says so
	awk "BEGIN {exit !($2)}"; ok $? "$1 ($(echo "$2" | tr -s "\n\t " " "))"
}
ct-phantom -q --size 128x128x128 --expert oversample=1 sphere big.nii && # 8 MiB
	ct-degrade -q -x 2 big.nii lr.nii && ct-upsample -q -m linear lr.nii up.nii &&
	ct-phantom -q --size 64x64x64 --expert oversample=1 sphere mid.nii && # 1 MiB
	exact sphere low.exr '--size 64x64x64' -n 640 --det 16 &&
	exact sphere high.exr '--size 64x64x64' -n 640 --det 64 && # 10 MiB
	exact sphere many.exr '--size 64x64x64' -n 8192 --det 4 &&
	ct-project -q -n 16 --det 64 big.nii p.exr
ok $? 'figures of volumes and projections hold'

held() { # held NAME DISK TOOL ARGS...: the memory expected is that of the run within a tenth
	said=$1 disk=$2; shift 2
	cost "$@"
	/usr/bin/time -o used -f %M "$@" -q -f 2>err || cat err
	is "$said" "$(mib memory) < 1.1 * $(tail -n 1 used) / 1024 + 1 && $(mib memory) > .9 * $(tail -n 1 used) / 1024 && $(mib disk) == $disk"
}
for m in linear dc tv htv; do
	held "the memory of ct-upsample -m $m is foreseen" 8 ct-upsample -t 1 -m $m lr.nii o.nii
done
held 'the memory of ct-upsample --std is foreseen' 16 ct-upsample -t 1 --std s.nii lr.nii o.nii
# a small scan, of which the networks take most, also while they are read
ct-phantom -q --size 72x72x72 --spacing 2 ellipsoids h.nii && ct-degrade -q -x 2 h.nii l.nii || exit 99
for q in draft fast balanced; do
	held "the memory of ct-sr -Q $q is foreseen" 2 ct-sr -Q $q l.nii o.nii
done
held 'the memory of eight threads is foreseen' 2 ct-sr -t 8 l.nii o.nii
rm o.nii s.nii
cost ct-upsample -t 1 -m htv --tolerance 0 --iterations 100 --json lr.nii no.nii; few=$(json seconds)
cost ct-upsample -t 1 -m htv --tolerance 0 --iterations 1000 --json lr.nii no.nii
is 'it takes longer than the piece that was tried' "$(json seconds) > 3 * $few"
cost ct-upsample -t 1 -m htv lr.nii no.nii; all=$(seconds); cost ct-upsample -t 1 -m htv --iterations 100000 lr.nii no.nii
is 'more iterations than it usually takes do not' "$(seconds) < 20 * $all"

# what a prior takes of a scan that is not flat
ct-phantom -q --size 128x128x128 --expert oversample=1 ellipsoids uneven.nii && ct-degrade -q -x 2 uneven.nii half.nii || exit 99
cost ct-upsample -t 1 half.nii no.nii; alone=$(seconds)
cost ct-upsample -m prior -t 1 --prior "$builddir/slices.safetensors" half.nii no.nii
is 'the prior takes longer than the inversion before it' "$(seconds) > 2 * $alone"
# and of one that is flat but for little
ct-phantom -q --size 64x64x512 ellipsoids rod.nii && ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean rod.nii rods.nii || exit 99
cost ct-upsample -m prior -t 1 --prior "$builddir/slices.safetensors" rods.nii no.nii
is 'a scan that is flat but for little' "$(seconds) < 60"

# of a projector all that is not the volumes and projections is of its own
cost ct-project -t 1 -n 64 --json big.nii no.exr; once=$(json seconds)
cost ct-project -t 1 -n 64 big.nii no.exr; few=$(mib memory) own=$(($(mib memory) - 12))
is 'ct-project' "$(mib disk) == 4 && $own >= 0 && $own < 20"
cost ct-project -t 1 -n 6400 big.nii no.exr
is '100 times the views, and the bytes of their file' "$(mib disk) == 400 && $(mib memory) > $few + 760 && $(mib memory) < $few + 793"
cost ct-project -t 1 -n 6400 --json big.nii no.exr
is 'in as many times the time, or so' "$(json seconds) > 20 * $once"
cost ct-project -t 1 -n 64 --photons 1e4 big.nii no.exr
is '--photons: the attenuation too' "$(mib disk) == 4 && $(mib memory) == $few + 8"
cost ct-project -t 1 -n 512 --coarsen 8 --pixel mean big.nii no.exr; mean=$(mib memory)
is '--coarsen' "$(mib disk) == 1"
cost ct-project -t 1 -n 512 --coarsen 8 big.nii no.exr
is '--pixel mean: the fine ones too, 32 MiB' "$mean - $(mib memory) >= 31 && $mean - $(mib memory) <= 36"

cost ct-fdk -t 1 high.exr no.nii --grid 64; small=$(mib memory)
is 'ct-fdk' "$(mib disk) == 1 && $small >= 11 && $small < 40"
cost ct-fdk -t 1 high.exr no.nii --grid 256
is 'on 64 MiB' "$(mib disk) == 64 && $(mib memory) - $small == 63"
cost ct-fdk -t 1 --grid 160 --json low.exr no.nii; once=$(json seconds)
cost ct-fdk -t 1 --grid 160 --json many.exr no.nii
is 'of 13 times the views' "$(json seconds) > 4 * $once"
for m in sirt=2 cgls=2 tv=5; do
	cost ct-fdk -t 1 -m ${m%=*} --grid 128 p.exr no.nii # 8 MiB, and 0.25
	is "ct-fdk -m ${m%=*}" "$(mib disk) == 8 && $(mib memory) >= ${m#*=} * 8 + 8 + 0.75 &&
		$(mib memory) < ${m#*=} * 8 + 8 + 0.75 + 1 + $own"
done
cost ct-fdk -t 1 -m sirt -n 1 --grid 64 high.exr no.nii; one=$(seconds)
cost ct-fdk -t 1 -m sirt -n 1000000 --grid 64 high.exr no.nii
is 'a million iterations' "$(seconds) > 1000 * $one"

calls() { sed -n 's/^work  *\([0-9]*\) calls of \([0-9.]*\) s .*/\1 \2/p' out; }
told() { # told SAMPLES THREADS: the time of 3 * SAMPLES calls a view
	# shellcheck disable=SC2046
	set -- "$@" $(calls)
	is "the time of $3 calls" "$3 == 3 * 640 * $1 && $(seconds) * $2 - $3 * $4 < $3 * 0.00051 + 2 * $2 &&
		$3 * $4 - $(seconds) * $2 < $3 * 0.00051 + 2 * $2"
}
cost ct-ddnm -t 1 -x 4 -n 3 low.exr no.exr; one=$(mib memory)
is 'ct-ddnm' "$(mib disk) == 10 && $(state) == 10 && $one > 46 && $one < 86" # 16 of weights, 20 of OUT and of its file
told 1 1
cost ct-ddnm -t 4 -x 4 -n 3 -k 2 low.exr no.exr; told 2 4
is 'a plan a thread, and the deviation of two samples' "$(mib memory) > $one + 20 + 3 * 2 && $(mib memory) < $one + 30 + 3 * 9 && $(mib disk) == 20"
cost ct-ddnm -t 1 -x 4 -n 3 --init high.exr low.exr no.exr
is 'and what it begins from' "$(mib memory) > $one + 3 && $(mib memory) < $one + 14 && $(mib disk) == 10 && $(state) == 10"

net=model_channels=32,channel_mult=1:2
cost ct-train -a $net -p 32 --expert batch=1 no.safetensors p.exr; flop=$(sed -n 's/.* and \([0-9.]*\) GFLOP.*/\1/p' out)
n=$(sed -n 's/.* \([0-9]*\) parameters$/\1/p' out)
is 'ct-train' "$(mib disk) == int($n / 2 ^ 18) + 1 && $(state) == int($n / 2 ^ 16) + 1 && $n > 700000"
each=$(sed -n 's/^work .* steps of \([0-9.]*\) s .*/\1/p' out)
is '10000 steps' "$(seconds) <= 10000 * ($each + 0.0051) && $(seconds) >= 10000 * ($each - 0.0051)"
cost ct-train -a $net -p 32 --expert batch=5 --half no.safetensors p.exr
is 'half of it' "$(mib disk) == int($n / 2 ^ 19) + 1 && $(state) == int($n / 2 ^ 16) + 1"
more=$(sed -n 's/.* and \([0-9.]*\) GFLOP.*/\1/p' out)
is '5 times the work a step' "$more < 5 * $flop + 0.3 && $more > 5 * $flop - 0.3 && $flop > 1 && $flop < 3"

# to the byte
pixels=$((16 * 64 * 64)) voxels=$((128 * 128 * 128))
set -- -t 1 --json -b up.nii -g 50
cost ct-nabgs "$@" -n 1 --expert max-gaussians=100 p.exr no.ply; once=$(json seconds)
is 'ct-nabgs: none are new before a control of their number' "$(json disk-bytes) == 50 * 44"
cost ct-nabgs "$@" -n 700 --expert max-gaussians=1000000 p.exr no.ply
is 'which at most doubles it, at 600' "$(json disk-bytes) == 100 * 44"
cost ct-nabgs "$@" -n 100000 --expert max-gaussians=100 p.exr no.ply
is 'up to the most' "$(json disk-bytes) == 4400 && $(json state-bytes) == 14400"
few=$(json memory-bytes) each=408 # bytes of a Gaussian, of one in a view, and of 56 floats
is 'its memory' "$few > 4 * (2 * $voxels + 3 * $pixels) && $few < 6 * (2 * $voxels + 3 * $pixels)"
cost ct-nabgs "$@" -n 100000 --expert max-gaussians=1000000 p.exr no.ply
is 'of 1000000' "$(json disk-bytes) == 44000000 && $(json memory-bytes) - $few > 999900 * $each - 2 ^ 22 &&
	$(json memory-bytes) - $few < 999900 * $each + 2 ^ 22"
would=$(json work | sed -n 's/.* it would be \([0-9]*\) s$/\1/p')
is 'more Gaussians take longer' "$would > 15000 * $(json seconds) && $would < 21000 * $(json seconds)"
cost ct-nabgs "$@" -n 10000000 --expert max-gaussians=100 p.exr no.ply
is 'as do more iterations' "$(json seconds) > 10000 * $once"
cost ct-nabgs "$@" -n 5 --expert max-gaussians=100 p.exr no.ply
is 'some are tried' "$(json seconds) < 10 * $once"
for r in '' --residual-out=r.nii; do
	cost ct-fuse -t 1 --json $r up.nii lr.nii p.exr no.nii
	is "ct-fuse $r" "$(json disk-bytes) == 4 * $voxels * (1 + (\"$r\" != \"\")) && $(json state-bytes) == 20 * $voxels"
done
is 'its memory' "$(json memory-bytes) > 20 * $voxels && $(json memory-bytes) < 60 * $voxels"
[ "$(echo no.*)" = 'no.*' ] && [ ! -e r.nii ]; ok $? 'and nothing is made'

# What ct-upsample tells that it will hold is what it holds, for operators of few weights and others.
part bytes
if sanitized ct-upsample; then
	skip 'memory' 'sanitizers take their own'
	done_testing
fi
ct-phantom -q --size 144x144x144 ellipsoids hr.nii || exit 99
held() { # held METHOD OPTIONS...: of lr.nii, in held; what it tells, in told, MiB
	ct-upsample -m "$@" --dry-run lr.nii no.nii | sed -n 's/^memory *\([0-9]*\) MiB.*/\1/p' >told
	look peak ct-upsample -q -f -t 1 -m "$@" lr.nii o.nii
	awk '{printf "%.1f\n", $1 / 1024}' used >held
}
for d in '-x 1,1,4 --sigma 0 --decimate mean' '-x 1,1,4 --sigma 0 --decimate point' '-x 1,1,4' '-x 4 --sigma .5 --decimate point' \
	'-x 2' '-x 2,2,1 --sigma .5,.5,.5 --decimate point' '-x 2,1,1 --sigma .5,.5,.5 --decimate point' \
	'-x 2,1,1 --sigma .5,.5,.5 --decimate point --noise 15' \
	'-x 1,1,4 --sigma 0 --decimate mean --noise 15'; do
	# shellcheck disable=SC2086
	ct-degrade -q -f $d hr.nii lr.nii
	for m in dc tv htv; do
		few=; [ $m = dc ] || few='--iterations 2'
		# shellcheck disable=SC2086
		held $m $few
		awk '{x[NR] = $1} END {exit !(NR == 2 && x[1] < 1.05 * x[2] + 1 && x[1] > .95 * x[2] - 1)}' told held
		ok $? "$d, $m: $(cat told) MiB told, $(cat held) held"
	done
done
done_testing
