#!/bin/sh
# memory.sh [LIMITS [COMMAND]]: every command with LIMITS (24) limits of its memory (ulimit -v) from 64 MB up to where
# all have room: the right result, or status 7 and a message, and nothing left; never a crash. The
# loader's own "error while loading shared libraries" counts as a message.
. "$(dirname "$0")/lib.sh"
limits=${1:-24} only=${2:-}
inputs
mkdir out
limited() { # limited OUT COMMAND...: with every limit
	out=$1; shift
	[ -z "$only" ] || [ "$only" = "$1" ] || return
	row "little memory: $1 to ${out#out/}"
	rm -rf out && mkdir out
	"$@" >stdout 2>err || { tally 1 'does not run'; return; }
	want=$(content "$out") k=0 enough=0
	while [ "$k" -lt "$limits" ]; do
		rm -rf out && mkdir out
		mb=$(awk "BEGIN {printf \"%d\", 64 * 64 ^ ($k / ($limits - 0.999))}")
		(ulimit -v $((mb * 1024)) && exec timeout 100 "$@") >stdout 2>err
		got=$? broken=
		case $got in
		0) enough=1; [ "$(content "$out")" = "$want" ] || broken='another result' ;;
		7) [ -s err ] || broken='no message' ;;
		127) grep -q 'shared librar' err || broken="status 127" ;;
		*) broken="status $got" ;;
		esac
		[ "$got" -eq 0 ] || [ -z "$(find out -mindepth 1 ! -name '*.state')" ] || broken="$(ls out) is left"
		[ -z "$broken" ]; tally $? "$broken with $mb MB: $*"
		k=$((k + 1))
	done
	[ $enough -eq 1 ]; tally $? 'never had enough'
}
limited out/o.nii ct-phantom -q -t 2 --size 24x24x24 cube out/o.nii
limited out/o.nii ct-convert -q -t 2 --type f32 hr.nii out/o.nii
limited out/o.nii ct-degrade -q -t 2 -x 2 hr.nii out/o.nii
limited out/o.nii ct-upsample -q -t 2 -x 2 hr-lr.nii out/o.nii
limited out/o.exr ct-project -q -t 2 -n 6 hr.nii out/o.exr
limited out/o.nii ct-fdk -q -t 2 hr.exr out/o.nii
limited out/o.nii ct-compose -q -t 2 hr-up.nii residual.ply out/o.nii
limited out/o.nii ct-metrics -q -t 2 --consistency hr-lr.nii --map out/o.nii hr.nii
limited out/o.exr ct-ddnm -q -t 2 -x 4 -n 2 hr-low.exr out/o.exr
limited out/o.ply ct-nabgs -q -t 2 -b hr-up.nii -n 40 -g 200 --expert max-gaussians=200 hr.exr out/o.ply
limited out/o.nii ct-fuse -q -t 2 -n 4 hr-up.nii hr-lr.nii hr.exr out/o.nii
limited out/o.safetensors ct-train -q -t 2 --arch model_channels=32,channel_mult=1 -p 8 --expert batch=2 -n 3 out/o.safetensors hr.exr
limited out/o.nii ct-upsample -m prior -q -t 2 -x 2 hr-lr.nii out/o.nii
limited out/s.nii ct-upsample -m prior -q -t 2 -x 2 --std out/s.nii hr-lr.nii out/o.nii
limited out/o.nii ct-sr -q -t 2 -x 2 hr-lr.nii out/o.nii
limited out/o.html ct-report -q -t 2 hr-lr.nii hr-up.nii out/o.html
limited stdout ct-info --json hr.nii
if command -v ct-view >/dev/null; then limited out/o.png ct-view -q -t 2 hr.nii out/o.png; fi
finish
