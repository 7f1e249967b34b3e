#!/bin/sh
# Remakes residual.safetensors, the shipped prior of what projections of a refined CT lack:
#   make-residual.sh CT_FOLDER HELD_FOLDER WORK OUT.safetensors [ct-train options...]
# The folders hold NIfTI volumes in HU, HELD_FOLDER those of other patients, on which the prior is judged and
# its weights found. WORK keeps the pairs: projections of the truth, and of what ct-restore makes of it when it
# is reduced; they are made once.
set -e
ct=$1 held=$2 work=$3 out=$4
shift 4
pair() { # pair TO STACK CUBE.nii WINDOW ct-degrade options
	to=$1 stack=$2 cube=$3 window=$4
	shift 4
	[ ! -f "$to/base/$stack.exr" ] || return 0
	ct-degrade -q -f -x 4 "$@" "$cube" "$work/lr.nii"
	ct-restore -q -f --estimate --tolerance=0.1 "$work/lr.nii" "$work/up.nii"
	ct-project -q -f --views=16 --sampling=1.375 --window="$window" "$cube" "$to/truth/$stack.exr"
	ct-project -q -f --views=16 --sampling=1.375 --window="$window" "$work/up.nii" "$work/base.exr"
	mv "$work/base.exr" "$to/base/$stack.exr"
}
pairs() { # pairs FOLDER TO: three of every volume, of the cube about its body
	mkdir -p "$2/truth" "$2/base"
	for v in "$1"/*.nii*; do
		name=$(basename "${v%.nii*}")
		ct-convert -q -f --cube=96 "$v" "$work/cube.nii"
		pair "$2" "$name-p1" "$work/cube.nii" -1024:3071 -p P1
		pair "$2" "$name-p3" "$work/cube.nii" -512:3071 -p P3 --clip=-512:3071
		pair "$2" "$name-noise" "$work/cube.nii" -512:3071 -p P1 --clip=-512:3071 --noise=15
	done
}
mkdir -p "$work"
pairs "$held" "$work/held"
pairs "$ct" "$work/ct"
mkdir -p "$work/base"
cp "$work"/*/base/*.exr "$work/base"
exec ct-train -f --half --licence Apache-2.0 --kind residual --refined "$work/base" --validate "$work/held/truth" "$@" "$out" "$work/ct/truth"
