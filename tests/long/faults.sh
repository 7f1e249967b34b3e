#!/bin/sh
# faults.sh [COUNT [COMMAND]]: memory fails within every command (tests/long/fault.c), COUNT (2000) times in all: at
# each of the first calls, then at random ones, once or from there on. The right result, or status 7
# and a message, and nothing left; never a crash.
. "$(dirname "$0")/lib.sh"
count=${1:-2000} only=${2:-}
cc -O1 -shared -fPIC -o "$work/fault.so" "$srcdir/tests/long/fault.c" -ldl || exit 99
inputs
mkdir out
faulty() { # faulty ENVIRONMENT... COMMAND...
	timeout 20 env LD_PRELOAD="$work/fault.so" "$@" >stdout 2>err
}
fails() { # fails OUT COMMAND...
	out=$1; shift
	[ -z "$only" ] || [ "$only" = "$1" ] || return
	row "memory fails: $*"
	rm -rf out && mkdir out
	faulty FAULT_COUNT="$work/calls" "$@" || { tally 1 'does not run'; return; }
	want=$(content "$out") calls=$(cat "$work/calls") k=0
	while [ "$k" -lt $((count / 20)) ]; do
		k=$((k + 1))
		if [ "$k" -le $((count / 40)) ] || [ "$k" -ge "$calls" ]; then
			at=$k
		else
			random "$calls" && at=$((R + 1))
		fi
		rm -rf out && mkdir out
		if [ $((k % 2)) -eq 0 ]; then
			faulty FAULT_AT="$at" "$@"
		else
			faulty FAULT_AT="$at" FAULT_ON=1 "$@"
		fi
		got=$? broken=
		case $got in
		0) [ "$(content "$out")" = "$want" ] || broken='another result' ;;
		7) [ -s err ] || broken='no message' ;;
		*) broken="status $got" ;;
		esac
		[ "$got" -eq 0 ] || [ -z "$(find out -mindepth 1 ! -name '*.state')" ] || broken="$broken $(ls out) is left"
		[ -z "$broken" ]; tally $? "$broken, call $at of $calls, $((k % 2))"
	done
}
fails out/o.nii ct-phantom -q --size 24x24x24 cube out/o.nii
fails out/o.nii ct-convert -q --type f32 hr.nii out/o.nii
fails out/o.nii ct-degrade -q -x 2 hr.nii out/o.nii
fails out/o.nii ct-upsample -q -x 2 hr-lr.nii out/o.nii
fails out/o.exr ct-project -q -n 6 hr.nii out/o.exr
fails out/o.nii ct-fdk -q hr.exr out/o.nii
fails out/o.nii ct-compose -q hr-up.nii residual.ply out/o.nii
fails out/o.nii ct-metrics -q --consistency hr-lr.nii --map out/o.nii hr.nii
fails out/o.exr ct-ddnm -q -x 4 -n 2 hr-low.exr out/o.exr
fails out/o.ply ct-nabgs -q -b hr-up.nii -n 40 -g 200 --expert max-gaussians=200 hr.exr out/o.ply
fails out/o.nii ct-fuse -q -n 4 hr-up.nii hr-lr.nii hr.exr out/o.nii
fails out/o.safetensors ct-train -q --arch model_channels=32,channel_mult=1 -p 8 --expert batch=2 -n 3 out/o.safetensors hr.exr
fails out/o.nii ct-upsample -m prior -q -x 2 hr-lr.nii out/o.nii
fails out/s.nii ct-upsample -m prior -q -x 2 --std out/s.nii hr-lr.nii out/o.nii
fails out/o.nii ct-sr -q -x 2 hr-lr.nii out/o.nii
fails out/o.html ct-report -q hr-lr.nii hr-up.nii out/o.html
fails stdout ct-info --json hr.nii
if command -v ct-view >/dev/null; then fails out/o.png ct-view -q hr.nii out/o.png; fi
finish
