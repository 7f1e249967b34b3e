#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Prints the SHA-256 of what the commands write on a phantom, a line a file, to compare two builds
# or two processors:
#   scripts/outputs.sh FOLDER-OF-COMMANDS >a;  CTSR_CPU=v3 scripts/outputs.sh FOLDER >b;  diff a b
# A name in brackets runs that part alone: SAME='volumes fits' scripts/outputs.sh FOLDER.
# The network is not compared between processors: oneDNN adds in another order on each.
set -eu
bin=$(cd "${1:?folder of the commands}" && pwd)
parts=${SAME:-volumes projections fits network}
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT INT TERM
cd "$dir"
PATH=$bin:$PATH
export LC_ALL=C
run() { "$@" >>stdout 2>>stderr || { echo "$* failed" >&2; tail -3 stderr >&2; exit 1; }; }
has() { case " $parts " in *" $1 "*) return 0 ;; esac; return 1; }

run ct-phantom --size 48x40x36 ellipsoids hr.nii
run ct-phantom --size 31x29x27 --spacing 1.5,2,2.5 marks odd.nii
run ct-degrade -x 4 hr.nii lr.nii
run ct-upsample -x 4 -m bspline lr.nii up.nii
if has volumes; then
	run ct-degrade -x 2,3,1 -p P3 --noise 5 odd.nii p3.nii
	run ct-degrade -x 1.5 --decimate mean odd.nii mean.nii
	for m in linear cubic lanczos sinc dc tv htv; do
		run ct-upsample -m $m lr.nii up-$m.nii
		run ct-upsample -m $m p3.nii p3-$m.nii
		run ct-upsample -m $m mean.nii mean-$m.nii
	done
	run ct-upsample -m tv --noise 5 p3.nii noisy-tv.nii
	run ct-upsample --estimate -x 2 hr.nii blind.nii
	run ct-metrics --ssim all --edges --json hr.nii up.nii
	cp stdout metrics.json
	run ct-metrics --consistency lr.nii --map map.nii hr.nii up-tv.nii
	cp stdout consistency.txt
fi
run ct-project -n 9 hr.nii cone.exr
run ct-project -n 9 up.nii base.exr
if has projections; then
	for m in siddon joseph; do
		run ct-project -n 7 -m $m odd.nii $m.exr
		run ct-project -n 7 -m $m --expert rotate=10,20,30 odd.nii $m-turned.exr
		run ct-fdk -m sirt -n 3 --expert projector=$m $m.exr $m-sirt.nii
		run ct-fdk -m cgls -n 3 --expert projector=$m $m-turned.exr $m-cgls.nii
	done
	run ct-project -n 8 --beam parallel --photons 20000 odd.nii parallel.exr
	run ct-project -n 8 --beam fan --det 40 odd.nii fan.exr
	run ct-project -n 12 --arc 220 --coarsen 2 --pixel sinc hr.nii coarse.exr
	run ct-fdk -n 3 -m tv cone.exr cone-tv.nii
	run ct-fdk cone.exr cone-fdk.nii
	run ct-fdk --filter hann --parker coarse.exr coarse-fdk.nii
	run ct-fdk parallel.exr parallel-fbp.nii
	run ct-fdk --grid 24 fan.exr fan-fdk.nii
fi
if has fits; then
	run ct-nabgs -b up.nii --lr lr.nii -n 40 -g 2000 --expert densify-until=40 cone.exr g.ply
	run ct-nabgs -b up.nii -n 40 -g 1000 --paper cone.exr paper.ply
	run ct-nabgs -b up.nii -n 30 -g 500 -m full -a softplus cone.exr full.ply
	run ct-compose up.nii g.ply composed.nii
	run ct-compose --consistent lr.nii up.nii g.ply spaced.nii
	if [ -x "$bin/ct-fuse" ]; then
		run ct-fuse -n 3 up.nii lr.nii cone.exr fused.nii
	fi
fi
if has network; then
	run ct-project -n 3 --coarsen 4 --pixel mean hr.nii low.exr
	run ct-ddnm -n 5 -x 4 low.exr ddnm.exr
	run ct-project -n 3 --coarsen 4 --pixel sinc hr.nii band.exr
	run ct-ddnm -n 5 -x 4 --std std.exr -k 2 band.exr matched.exr
fi
sha256sum -- *.nii *.exr *.ply *.json *.txt 2>/dev/null
