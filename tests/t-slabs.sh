#!/bin/sh
# Memory is bounded by slabs inside the call: ct-upsample and ct-sr with --memory.
. "$srcdir/tests/tap.sh"
. "$srcdir/tests/peak.sh"
near() { ct-metrics --json "$1" "$2" | awk -F'[:,]' '/"rmse-hu"/ {rms = $2} /"max-hu"/ {most = $2} END {print "#", rms, most; exit !(rms < .1 && most < 1)}'; }
TMPDIR=$dir_/tmp; export TMPDIR; mkdir tmp
ct-phantom -q --size 64x64x512 ellipsoids hr.nii && ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean hr.nii thick.nii || exit 99
known=$builddir/slices.safetensors

# ct-upsample
for m in tv htv; do
	ct-upsample -q -m $m thick.nii whole-$m.nii
	exits 0 "$m in slabs" ct-upsample -q -m $m --memory 52M thick.nii made/$m.nii
	near whole-$m.nii made/$m.nii; ok $? 'within .1 HU RMS of the whole, and 1 HU anywhere'
done
history() { ct-info "$1" | sed -n '/^history/,/^hash/{/^hash/d;s/ [a-z-]*\.nii #/ OUT #/;p;}'; }
history whole-tv.nii >a; history made/tv.nii | cmp - a && grep -q 'thick.nii xxh3:' a; ok $? 'the history does not know how memory was bounded'
ct-phantom -q --size 96x96x1400 ellipsoids h2.nii && ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean h2.nii t2.nii
if sanitized ct-upsample; then
	skip 'memory of a larger one' 'sanitizers take their own'
else
	look peak ct-upsample -q -f -t 1 -m tv t2.nii w.nii; all=$(cat used)
	exits 0 'a larger one' look peak ct-upsample -q -f -t 1 -m tv --memory 130M t2.nii w.nii
	[ $((4 * $(cat used))) -lt $((3 * all)) ]; ok $? "takes less memory ($(cat used), $all KiB)"
	within 130 'it is held'
fi
rm -f h2.nii t2.nii w.nii
exits 0 'again' ct-upsample -q -t 3 -m tv --memory 52M thick.nii three.nii
look same three.nii made/tv.nii; ok $? 'the same voxels for any number of threads'
exits 0 'from a volume to begin with' ct-upsample -q -m dc --start hr.nii --memory 56M thick.nii made/near.nii
ct-upsample -q -m dc --start hr.nii thick.nii near.nii; near near.nii made/near.nii; ok $? 'dc in slabs is near dc of the whole volume'
exits 0 'a dry run' ct-upsample --dry-run -m tv --memory 52M thick.nii no.nii
has out '^work *tv of 2097152 voxels in [2-9] slabs$' 'tells the slabs'
awk '$1 == "memory" {m = $2} END {exit !(m > 16 && m < 28)}' out; ok $? 'and the memory'
[ ! -e no.nii ]; ok $? 'and writes nothing'
exits 0 'the prior' ct-upsample -q -t 1 -m prior -p "$known" --memory 134M --std made/std.nii thick.nii made/p.nii
ct-upsample -q -m prior -p "$known" --std std.nii thick.nii p.nii
near p.nii made/p.nii; ok $? 'the prior in slabs is near the prior of the whole'
ct-metrics --ssim none --range 1 --json std.nii made/std.nii | sed -n 's/.*"rmse-hu": \([0-9.e+-]*\).*/\1/p' | awk '{near = $1 < .1} END {exit !near}'
ok $? 'and the same predicted error'
alone "$(printf '%s\n' htv.nii near.nii p.nii std.nii tv.nii)"

# ct-sr
exits 0 'ct-sr' ct-sr -t 1 -Q draft --memory 52M thick.nii o.nii
tail -n 1 err | grep -qE '^ct-sr: 64x64x128 to 64x64x512, 1,1,4 times; blur 0 voxels, mean \(from the file\); .*; h?tv, [0-9]+ iterations \([a-z, -]+\), in [2-9] slabs; data residual [0-9.e-]+ HU RMS; [0-9.]+ s, [0-9]+ MiB$'
ok $? 'says in how many slabs'
near whole-tv.nii o.nii; ok $? 'ct-sr in slabs is near TV of the whole volume'
[ -z "$(ls -A tmp)" ]; ok $? 'and leaves nothing elsewhere'
ct-sr -q -Q draft --memory 52M - - <thick.nii >stream.nii; ok $? 'to a stream'
look same stream.nii o.nii; ok $? 'a stream refined in slabs gives the same voxels'
exits 0 'with a page' ct-sr -q -t 1 --memory 134M --prior "$known" --confidence c.nii --report r.html thick.nii r.nii
near p.nii r.nii; ok $? 'the same, with the prior'
grep -q 'id="error"' r.html; ok $? 'and the predicted error'
if script -qec true /dev/null </dev/null >/dev/null 2>&1; then
	ct-phantom -q --size 160x160x900 ellipsoids big.nii && ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean big.nii big4.nii && rm big.nii
	script -qec "ct-sr -f -Q draft big4.nii w.nii" /dev/null </dev/null 2>&1 | tr '\r' '\n' >terminal
	has terminal 'ct-sr: tv of 23040000 voxels: about [0-9]* s on [0-9]* threads, [0-9]* MiB of memory, 88 of disk' 'a terminal reads what it will take'
	rm big4.nii w.nii
else
	skip 'a terminal' 'no script'
fi

# what does not fit
exits 7 'a bound that no slab fits into' ct-upsample --memory 30M thick.nii made/no.nii
has err '^ct-upsample: thick.nii: takes [0-9]* MiB of memory in slabs, and 30 MiB are given: ' 'is refused in words'
ct-degrade -q -x 4 hr.nii sinc.nii
exits 7 'a CT that cannot be cut' ct-sr -Q draft --memory 40M sinc.nii made/no.nii
has err '^ct-sr: sinc.nii: takes [0-9]* MiB of memory as a whole, which band-limited sampling (sinc) or a wide blur along all axes asks, ' 'is refused, too'
ct-phantom -q --size 192x48x256 ellipsoids wide.nii && ct-degrade -q -f -x 1,1,4 --sigma 0,0,4 --decimate point wide.nii wide4.nii && ct-upsample -q -m tv wide4.nii wide-tv.nii
exits 0 'a blur of whole slices, in slabs' ct-upsample -v -m tv --memory 60M wide4.nii made/wide.nii
has err 'refines in [0-9]* slabs' 'of which there are some'
near wide-tv.nii made/wide.nii; ok $? 'a blur of whole slices in slabs is near the whole'
rm -f wide*.nii
for w in 100 M -1M 1e3M 600MB; do
	exits 2 "--memory=$w" ct-upsample --memory=$w thick.nii made/no.nii
	has err "'$w' is no size such as 600M or 2G" 'is no size'
done
[ ! -e made/no.nii ]; ok $? 'a bound that no slab fits into leaves nothing'
ct-phantom -q --size 160x160x160 ellipsoids cube.nii && ct-degrade -q -x 4 -p P3 --noise 9 cube.nii cube4.nii && rm cube.nii
exits 0 'one whose pilot is a part of it' ct-sr -f -Q draft cube4.nii cube.nii
n=$(sed -n 's/.*; htv, \([0-9]*\) iterations .*/\1/p' err)
exits 0 'and in slabs' ct-sr -Q draft --memory 105M cube4.nii slabs.nii
[ "$n" -ge 50 ] && grep -q "; htv, $n iterations .* slabs" err; ok $? "makes as many iterations ($n)"
near cube.nii slabs.nii; ok $? 'and is the same volume'

# the disk, and signals
if unshare -rm true 2>/dev/null; then
	mkdir small
	full() { # full MIB OF OPTIONS...: in a folder of 3 MB
		needs=$1 of=$2; shift 2
		exits 4 "no disk for $of" unshare -rm sh -c 'mount -t tmpfs -o size=3m x small && ct-sr -v -t 1 -f -Q draft "$@" 2>told; s=$?; ls -A small >left; exit $s' - "$@"
		has told "^ct-sr: small[^ ]*: the result takes $needs MiB of disk, [0-3] are free" 'is said before'
		! grep -q 'iterations' told && [ ! -s left ]; ok $? 'the work begins, and nothing is left'
	}
	full 8 OUT thick.nii small/o.nii
	full 4 'what is of 16 bits' thick.nii small/o.dcm
	full 16 'two of them' --confidence small/c.nii thick.nii small/o.nii
	exits 4 'no disk for ct-upsample' unshare -rm sh -c 'mount -t tmpfs -o size=3m x small && exec ct-upsample -v thick.nii small/o.nii'
	! grep -q iterations err; ok $? 'is said before, too'
else
	skip 'no disk' 'no mounts'
fi
ct-upsample -q --iterations 100000 --tolerance 0 --memory 52M thick.nii made/stopped.nii 2>err & pid=$!
listens $pid; kill -TERM $pid; wait $pid
[ $? -eq 75 ]; ok $? 'a signal stops it'
[ ! -e made/stopped.nii ] && [ -z "$(ls -A tmp)" ]; ok $? 'a run in slabs that a signal stopped leaves nothing'
done_testing
