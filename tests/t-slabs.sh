#!/bin/sh
# ct-sr in slabs, where the whole does not fit into --memory: the jobs of a plan, run.
. "$srcdir/tests/tap.sh"
hash() { ct-info --json "$1" | sed -n 's/.*"hash": "\(.*\)".*/\1/p'; }
same() { [ -n "$(hash "$1")" ] && [ "$(hash "$1")" = "$(hash "$2")" ]; }
left() { [ "$(ls -A "$1" | tr '\n' ' ')" = "$2" ]; ok $? "${3:-and leaves nothing else}"; } # left FOLDER FILES NAME
TMPDIR=$dir_/tmp; export TMPDIR; mkdir tmp d
peak() { # peak COMMAND...: the most that a process of it held, KiB, in used
	python3 -c '
import resource, subprocess, sys
rc = subprocess.call(sys.argv[1:])
open("used", "w").write(str(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss))
sys.exit(rc)' "$@"
}
ct-phantom -q --size 64x64x512 ellipsoids hr.nii && ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean hr.nii thick.nii || exit 99
set -- -x 1,1,4 -Q draft --memory 89M
exits 0 'a scan that does not fit' ct-sr -t 1 "$@" thick.nii d/o.nii
has err '^ct-sr: warning: refines in 3 slabs along z: the whole takes 9[0-9] MiB of memory, and 89 are given$' 'says into how many slabs, and why'
tail -n 1 err | grep -qE '^ct-sr: 64x64x128 -> 64x64x512, 1,1,4x, blur 0 voxels, mean \(of the file\), .*, solver h?tv [0-9]+ iterations \([a-z ,]+\) in 3 slabs, consistent to [0-9.e-]+ HU RMS, [0-9.]+ s, [0-9]+ MiB$'
ok $? 'and at the end what they did'
left d 'o.nii ' 'leaves nothing beside it'
left tmp '' 'and nothing elsewhere'
exits 0 'kept' ct-sr -q -t 1 "$@" --keep k thick.nii kept.nii
ct-sr -q -x 1,1,4 -Q draft thick.nii whole.nii
near() { ct-metrics --json "$1" "$2" | awk -F'[:,]' '/"rmse-hu"/ {rms = $2} /"max-hu"/ {most = $2} END {print "#", rms, most; exit !(rms < .1 && most < 1)}'; }
near whole.nii d/o.nii; ok $? 'within .1 HU RMS of the whole, and 1 HU anywhere'
same d/o.nii kept.nii; ok $? 'the same voxels twice'
[ "$(sed -n 's/ .*//; s/^ct-/&/p' k/commands.sh | tr '\n' ' ')" = 'ct-convert ct-upsample ct-upsample ct-upsample ct-merge ' ]
ok $? 'commands.sh has the slabs'
cp kept.nii first.nii
exits 0 'runs' sh k/commands.sh
cmp -s kept.nii first.nii; ok $? 'to the same bytes'
ct-sr -q -t 3 "$@" thick.nii three.nii; same three.nii first.nii; ok $? 'any number of threads'
ct-sr -q -t 1 -x 1,1,4 -Q draft --memory 93M --keep k2 thick.nii two.nii
[ "$(grep -c brick k2/commands.sh)" = 2 ]; ok $? 'with more memory fewer slabs'
exits 0 'a plan' ct-sr -q -t 1 "$@" --plan p thick.nii planned.nii
[ "$(grep -c '"--brick=./3"' p/plan.json)" = 3 ] && make -s -f p/plan.mk && same planned.nii first.nii
ok $? 'is of the same jobs'
ct-sr -q "$@" - - <thick.nii >stream.nii && same stream.nii first.nii; ok $? 'to a stream'
ct-sr -q "$@" thick.nii d/o.nii.gz && same d/o.nii.gz first.nii; ok $? 'compressed'
left tmp '' 'nothing is left of these'
ct-sr "$@" --dry-run thick.nii no.nii >out; [ "$(grep -c . out)" = 2 ]; ok $? 'a dry run, which reads nothing, tells of no slabs'
if command -v python3 >/dev/null; then
	ct-phantom -q --size 64x64x2048 ellipsoids h2.nii && ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean h2.nii t2.nii
	peak ct-sr -q -f -t 1 -x 1,1,4 -Q draft t2.nii w.nii; all=$(cat used)
	peak ct-sr -q -f -t 1 -x 1,1,4 -Q draft --memory 110M t2.nii w.nii; most=$(cat used)
	rm h2.nii t2.nii w.nii
	[ $((3 * most)) -lt $((2 * all)) ]; ok $? "in $most KiB, where the whole takes $all"
else
	skip 'peak of memory' 'no python3'
fi
if script -qec true /dev/null </dev/null >/dev/null 2>&1; then
	script -qec "ct-sr -t 1 -f -x 1,1,4 -Q draft --memory 89M thick.nii w.nii" /dev/null </dev/null 2>&1 | tr '\r' '\n' >terminal
	has terminal '^ct-sr: tv of 2097152 voxels in 3 slabs: about [0-9]* s on 1 threads, [789][0-9] MiB of memory, 16 of disk' 'a terminal hears what it will take'
else
	skip 'a terminal' 'no script'
fi
exits 0 'a prior of slices' ct-sr -t 1 -x 1,1,4 -f --memory 180M --slices "$builddir/slices.safetensors" --keep r --confidence rc.nii --report r.html thick.nii r.nii
has err '^ct-sr: warning: refines in [2-4] slabs along z' 'too'
n=$(grep -c 'ct-restore .*--std=r/slab-std-[1-4].nii .*r/slab-[1-4].nii .*--brick' r/commands.sh)
[ "$n" -ge 2 ] && [ "$(grep -c "^ct-merge r/slab-std-1.nii .*r/slab-std-$n.nii rc.nii" r/commands.sh)" = 1 ]; ok $? 'each tells its error'
ct-sr -q -x 1,1,4 --slices "$builddir/slices.safetensors" --confidence ec.nii thick.nii e.nii
ct-metrics --psnr --range 1 --json ec.nii rc.nii | sed -n 's/.*"rmse-hu": \([0-9.e+-]*\).*/\1/p' | awk '{near = $1 < .1} END {exit !near}'
ok $? 'near that of the whole'
near e.nii r.nii; ok $? 'within .1 HU RMS of the whole, and 1 HU anywhere'
has r.html '^<li>ct-sr: refines in [2-4] slabs along z' 'the page says so'
grep -q 'ct-restore: took' r.html && grep -q 'id="error"' r.html; ok $? 'and what they took, and the error to expect'
exits 0 'nothing is left to do' ct-sr -v -t 1 -x 1,1,4 --memory 180M --slices "$builddir/slices.safetensors" --keep r --resume --confidence rc.nii --report r.html thick.nii r.nii
! grep -q 'ct-[a-z]* took' err; ok $? 'and nothing is done'
rm rc.nii
exits 0 'but the error' ct-sr -v -t 1 -x 1,1,4 --memory 180M --slices "$builddir/slices.safetensors" --keep r --resume --confidence rc.nii --report r.html thick.nii r.nii
[ -s rc.nii ] && [ "$(grep -c 'ct-[a-z]* took' err)" = 1 ]; ok $? 'where that is missing'
exits 0 'a bound that no slab fits into' ct-sr -t 1 -f -x 1,1,4 -Q draft --memory 72M thick.nii w.nii
has err '^ct-sr: warning: no slab fits into 72 MiB, from 7[0-9] on one would: the rest in files$' 'is kept by files'
ct-degrade -q -x 4 hr.nii sinc.nii
exits 0 'a scan that cannot be cut' ct-sr -t 1 -f -Q draft --memory 90M sinc.nii w.nii
[ ! -s err ] || ! grep -q slab err; ok $? 'goes as before'
exits 0 'a small one' ct-sr -v -t 1 -f -x 1,1,4 -Q draft thick.nii w.nii
[ "$(grep -c '^ct-sr: ct-upsample took' err)" = 1 ]; ok $? 'is not asked'
ct-phantom -q --size 160x160x160 ellipsoids cube.nii && ct-degrade -q -x 4 -p P3 --noise 9 cube.nii cube4.nii && rm cube.nii
exits 0 'one whose pilot is a part of it' ct-sr -f -Q draft cube4.nii cube.nii
n=$(sed -n 's/.* solver htv \([0-9]*\) iterations .*/\1/p' err)
exits 0 'and in slabs' ct-sr -q -Q draft --jobs 2 --plan pc cube4.nii slabs.nii
[ "$n" -ge 50 ] && [ "$(grep -c -- "--iterations=$n\"" pc/plan.json)" = 2 ]; ok $? "ends after as many iterations ($n)"
make -s -f pc/plan.mk && near cube.nii slabs.nii; ok $? 'and is the same volume'
rm -r pc cube.nii slabs.nii
mkdir dcm
exits 0 'DICOM out' ct-sr -q -t 1 "$@" thick.nii dcm/o.dcm
left dcm 'o.dcm '
left tmp ''

# goes on
exits 0 'nothing to do' ct-sr -v -t 1 "$@" --keep k --resume thick.nii kept.nii
has err '^ct-sr: 5 of 5 steps were done$' 'which is said'
! grep -q '^ct-sr: ct-upsample took' err; ok $? 'and nobody is asked again'
rm k/slab-2.nii
exits 0 'a slab that is gone' ct-sr -v -t 1 "$@" --keep k --resume thick.nii kept.nii
has err '^ct-sr: 4 of 5 steps were done$' 'is made again alone'
rm -rf k k2 p r kept.nii
killed() { # killed SIGNAL ARGS...: when a slab is made
	sig=$1; shift
	ct-sr -q -t 1 "$@" 2>err & pid=$!
	for i in $(seq 1200); do
		[ -n "$(find . -name slab-2.nii)" ] && break
		kill -0 $pid 2>/dev/null || break
		sleep 0.02
	done
	kill -"$sig" $pid; wait $pid 2>/dev/null
}
killed KILL "$@" --keep k thick.nii kept.nii
[ ! -e kept.nii ]; ok $? 'killed'
exits 0 'goes on' ct-sr -v -t 1 "$@" --keep k --resume thick.nii kept.nii
cmp -s kept.nii first.nii; ok $? 'to the same bytes'
[ "$(grep -c '^ct-sr: ct-upsample took' err)" -lt 3 ]; ok $? 'without what was made'
rm -rf k kept.nii; rm d/*
killed KILL "$@" --keep k thick.nii kept.nii
: >kept.nii
exits 4 'OUT that is not its own' ct-sr -q -t 1 "$@" --keep k --resume thick.nii kept.nii
[ ! -s kept.nii ] && [ ! -e k/slab-3.nii ]; ok $? 'is left as it is, before the work'
rm -rf k
killed TERM "$@" thick.nii d/o.nii
left d '' 'stopped, nothing is left'
killed KILL "$@" thick.nii d/o.nii
[ -n "$(ls d)" ]; ok $? 'killed, slabs are'
flock -w 60 d/ct-sr.*/temporary true
ct-sr -q -t 1 "$@" thick.nii d/o2.nii; left d 'o2.nii ' 'until the next run'

# no room; slabs that cannot be joined
if unshare -rm true 2>/dev/null; then
	mkdir small
	exits 4 'no disk' unshare -rm sh -c 'mount -t tmpfs -o size=9m x small && exec ct-sr -t 1 -x 1,1,4 -Q draft --memory 89M --keep small/k thick.nii no.nii'
	has err '^ct-sr: small/k: slabs take 8 MiB of disk, and [67] are free: --keep names another folder for them$' 'is said before'
	! grep -q 'ct-upsample: .* to ' err; ok $? 'it begins'
	full() { # full MIB OF OPTIONS...: in a folder of 3 MB
		needs=$1 of=$2; shift 2
		exits 4 "no disk for $of" unshare -rm sh -c 'mount -t tmpfs -o size=3m x small && ct-sr -v -t 1 -f -x 1,1,4 -Q draft "$@" 2>told; s=$?; ls -A small >left; exit $s' - "$@"
		has told "^ct-sr: small[^ ]*: voxels take $needs MiB of disk, and [0-3] are free" 'is said before'
		! grep -q 'ct-upsample took' told && ! grep -qv '^k$' left; ok $? 'it begins, and leaves nothing'
	}
	full 8 OUT thick.nii small/o.nii
	full 4 'what is of 16 bits' thick.nii small/o.dcm
	full 16 'two of them' --confidence small/c.nii thick.nii small/o.nii
	full 8 'what is between' --keep small/k thick.nii d/o.dcm
else
	skip 'no disk' 'no mounts'
fi
mkdir bin
for t in ct-sr ct-convert ct-upsample; do cp "$(command -v $t)" bin; done
printf '#!/bin/sh\nexit 4\n' >bin/ct-merge; chmod +x bin/ct-merge
rm -f d/*
exits 4 'what cannot be joined' bin/ct-sr -q -t 1 "$@" thick.nii d/o.nii
at=$(sed -n 's/^ct-sr: ct-merge failed; what it reads was made of thick.nii; the slabs are kept in \(.*\)$/\1/p' err)
ct-sr -q -t 1 "$@" thick.nii d/o2.nii
[ -n "$at" ] && ct-merge -q "$at"/slab-3.nii "$at"/slab-1.nii "$at"/slab-2.nii by-hand.nii && same by-hand.nii first.nii
ok $? 'is kept, also from the next run'
done_testing
