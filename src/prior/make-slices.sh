#!/bin/sh
# Remakes slices.safetensors, the shipped prior of slices:
#   make-slices.sh CT_FOLDER HELD_FOLDER WORK OUT.safetensors
# CT_FOLDER holds NIfTI volumes in HU, and micro-CT in bytes, which become HU by --bytes; HELD_FOLDER those
# of other patients, on which the nets are judged and their expected error is calibrated. The examples stay
# in WORK. The same machine and version give the same bytes, but for names of files in the history.
set -e
ct=$1 held=$2 work=$3 out=$4
mkdir -p "$work"
net() { # net NAME ct-train options: one more net beside those that there are
	name=$1; shift
	ct-train -f --half --licence Apache-2.0 --slices -s 1 --bytes=-1000:2570 --window=-512:3071 --cache "$work/examples" \
		--validate "$held" --validate-every 1000 --checkpoint-every 1000000 ${with:+--with "$with"} \
		"$@" "$work/$name.safetensors" "$ct"
	with=$work/$name.safetensors
}
net 4 -x 4 --cubes 24 --cube 80 --depth 5 --components 240 --width 640 -n 8000
net 2 -x 2 -p 12 --cubes 8 --cube 64 --depth 5 --components 200 --width 512 -n 5000
net 3 -x 3 -p 13 --cubes 8 --cube 72 --depth 5 --components 200 --width 512 -n 5000
net 8 -x 8 --cubes 10 --cube 96 --depth 3 --components 240 --width 512 -n 5000
net thick-4 --thick -x 4 -p 12 --cubes 10 --cube 80 --depth 5 --components 200 --width 512 -n 5000
# the one that looks again at what that of 4 has added to (ct-restore --passes 2)
net again-4 --again -x 4 -p 20 --cubes 12 --cube 80 --depth 5 --components 320 --width 640 -n 6000
cp "$with" "$out"
