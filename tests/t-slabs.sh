#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Memory is bounded by slabs inside the call: ct-upsample and ct-sr with --memory.
. "$srcdir/tests/tap.sh"
command -v python3 >/dev/null || { echo '1..0 # SKIP no python3'; exit 0; }
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
look() { python3 "$dir_/look.py" "$@"; }
within() { [ "$(cat used)" -lt $(($1 * 1024)) ]; ok $? "$2 within $1 MiB ($(($(cat used) / 1024)))"; } # within MIB NAME
beyond() { [ "$(cat used)" -gt $(($1 * 1024)) ]; ok $? "$2 beyond $1 MiB ($(($(cat used) / 1024)))"; }
mkdir made
alone() { [ "$(ls -A made)" = "$1" ]; ok $? "${2:-and leaves nothing else}"; } # alone FILES
near() { ct-metrics --json "$1" "$2" | awk -F'[:,]' '/"rmse-hu"/ {rms = $2} /"max-hu"/ {most = $2} END {print "#", rms, most; exit !(rms < .1 && most < 1)}'; }
TMPDIR=$dir_/tmp; export TMPDIR; mkdir tmp
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
exits 0 'the prior refines in slabs with --std' ct-upsample -q -t 1 -m prior -p "$known" --memory 134M --std made/std.nii thick.nii made/p.nii
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
exits 0 'ct-sr refines in slabs with --confidence and --report' ct-sr -q -t 1 --memory 134M --prior "$known" --confidence c.nii --report r.html thick.nii r.nii
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
	'-x 2' '-x 2,2,1 --sigma .5,.5,.5 --decimate point' '-x 2,1,1 --sigma .5,.5,.5 --decimate point --noise 15' \
	'-x 1,1,4 --sigma 0 --decimate mean --noise 15'; do
	# shellcheck disable=SC2086
	ct-degrade -q -f $d hr.nii lr.nii
	for m in dc tv htv; do
		few=; [ $m = dc ] || few='--iterations 2'
		# shellcheck disable=SC2086
		held $m $few
		# the program with the library of its network is less than what is told of it; what the sample leaves behind
		# that multipliers of noise come from is not in it
		case $d in *noise*) more=6 ;; *) more=0 ;; esac
		awk -v more=$more '{x[NR] = $1} END {exit !(NR == 2 && x[2] > x[1] - 11 && x[2] < x[1] + more)}' told held
		ok $? "$d, $m: $(cat told) MiB told, $(cat held) held"
	done
done
done_testing
