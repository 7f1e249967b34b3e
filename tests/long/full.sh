#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# full.sh [OFFSETS [COMMAND]]: every command that writes, with no file allowed to grow beyond each of OFFSETS (100)
# sizes from 0 to all but the last byte of its output (RLIMIT_FSIZE, SIGXFSZ ignored: a write beyond it
# fails as on a full disk). Status 4 and a message, no output, nothing beside it but a state; and then,
# with room, the same result.
. "$(dirname "$0")/lib.sh"
offsets=${1:-100} only=${2:-}
inputs
mkdir out
printf '\223NUMPY\001\0\106\0%-69s\n' "{'descr': '|u1', 'fortran_order': False, 'shape': (4, 8, 8), }" >views.npy
head -c 256 hr.nii >>views.npy
echo '{"DSO": 500, "DSD": 1000, "nDetector": [8, 8], "sDetector": [80, 80], "numTrain": 4}' >scan.json
writer() { # writer OUT COMMAND...: OUT among its words
	out=$1; shift
	[ -z "$only" ] || [ "$only" = "$1" ] || return
	case " $* " in *" --keep "*) label="$1 --keep" ;; *) label=$1 ;; esac
	row "no room: $label to ${out#out/}"
	rm -rf out && mkdir out
	"$@" >/dev/null 2>err || { tally 1 'does not run'; return; }
	size=$(stat -c %s "$out") want=$(content "$out") k=0
	while [ "$k" -lt "$offsets" ]; do
		rm -rf out && mkdir out
		limit=$((size * k / offsets))
		# the words go through a pipe, which has no limit
		{ (trap '' XFSZ; prlimit --fsize="$limit" "$@" >/dev/null; echo $? >&3); } 2>&1 3>status | cat >err
		got=$(cat status) broken=
		[ "$got" = 4 ] || broken="status $got"
		[ -s err ] || broken='no message'
		[ ! -e "$out" ] || broken="$out is there"
		left=$(find out -mindepth 1 ! -name '*.state' ! -path 'out/keep*' | tr '\n' ' ')
		[ -z "$left" ] || broken="$left is left"
		[ -z "$broken" ]; tally $? "$broken at $limit of $size: $*"
		k=$((k + 1))
	done
	[ -z "$(ls out)" ] || [ "$1" = ct-sr ] || set -- "$@" --resume
	"$@" >/dev/null 2>err && [ "$(content "$out")" = "$want" ]
	tally $? "another result with room afterwards: $*"
}
writer out/o.nii ct-phantom -q --size 24x24x24 cube out/o.nii
writer out/o.nii.gz ct-phantom -q --size 24x24x24 ellipsoids out/o.nii.gz
writer out/o.nii ct-convert -q --type f32 hr.nii out/o.nii
if ! ct-convert hr.nii out/o.dcm 2>&1 | grep -q with-vtk; then writer out/o.dcm ct-convert -q hr.nii out/o.dcm; fi
writer out/o.exr ct-convert -q --scanner scan.json views.npy out/o.exr
writer out/o.nii ct-degrade -q -x 2 hr.nii out/o.nii
writer out/o.nii ct-upsample -q -x 2 -m cubic hr-lr.nii out/o.nii
writer out/o.exr ct-project -q -n 6 hr.nii out/o.exr
writer out/o.nii ct-fdk -q hr.exr out/o.nii
writer out/o.nii ct-compose -q hr-up.nii residual.ply out/o.nii
writer out/r.nii ct-compose -q --residual-out out/r.nii hr-up.nii residual.ply out/o.nii
writer out/o.nii ct-metrics -q --consistency hr-lr.nii --map out/o.nii hr.nii
if command -v ct-view >/dev/null; then writer out/o.png ct-view -q hr.nii out/o.png; fi
writer out/o.html ct-report -q hr-lr.nii hr-up.nii out/o.html
writer out/o.nii ct-upsample -m prior -q -x 2 hr-lr.nii out/o.nii
writer out/s.nii ct-upsample -m prior -q -x 2 --std out/s.nii hr-lr.nii out/o.nii
writer out/o.exr ct-ddnm -q -x 4 -n 2 hr-low.exr out/o.exr
writer out/s.exr ct-ddnm -q -x 4 -n 2 -k 2 --std out/s.exr hr-low.exr out/o.exr
writer out/o.ply ct-nabgs -q -b hr-up.nii -n 40 -g 200 --expert max-gaussians=200 hr.exr out/o.ply
writer out/o.nii ct-fuse -q -n 4 hr-up.nii hr-lr.nii hr.exr out/o.nii
writer out/o.nii ct-field -q -x 2 -b 20 hr-lr.nii out/o.nii
writer out/o.txt ct-profile -q hr-thick.nii hr.nii out/o.txt
writer out/o.safetensors ct-train -q --arch model_channels=32,channel_mult=1 -p 8 --expert batch=2 -n 3 out/o.safetensors hr.exr
writer out/o.nii ct-sr -q -x 4 -Q draft hr-lr4.nii out/o.nii
writer out/o.nii ct-sr -q -x 4 --paper --expert views=2,iterations=2,gaussians=20 --keep out/keep hr-lr4.nii out/o.nii
finish
