#!/bin/sh
# Remakes slices.safetensors, the shipped prior of slices:
#   make-slices.sh CT_FOLDER HELD_FOLDER WORK OUT.safetensors
# CT_FOLDER holds NIfTI volumes in HU, and micro-CT in bytes, which become HU by --bytes; HELD_FOLDER those
# of other patients, on which the nets are judged and their expected error is calibrated. The examples stay
# in WORK. The same machine and version give the same bytes, but for names of files in the history.
set -e
ct=$1 held=$2 work=$3 out=$4
mkdir -p "$work"
net() { # net NAME KEYS ct-train options: trains one more network and adds it to the file
	name=$1 keys=$2
	shift 2
	ct-train -f --half --licence Apache-2.0 --kind slices -s 1 --bytes=-1000:2570 --cache "$work/examples" \
		--validate "$held" --expert "window=-512:3071,validate-every=1000,$keys" --checkpoint-every 1000000 ${with:+--with "$with"} \
		"$@" "$work/$name.safetensors" "$ct"
	with=$work/$name.safetensors
}
net 4 cubes=64,cube=80,slices=4,depth=8,components=448,width=1024,decay=.2 -x 4 -p 12 -n 40000
net 2 cubes=40,cube=64,slices=2,depth=6,components=320,width=768,decay=.3 -x 2 -p 12 -n 16000
net 3 cubes=32,cube=72,depth=5,components=240,width=768 -x 3 -p 13 -n 10000
net 8 cubes=24,cube=96,slices=2,depth=4,components=320,width=768,decay=.3 -x 8 -p 24 -n 8000
net thick-4 thick=yes,cubes=48,cube=80,depth=5,components=240,width=768,decay=.3 -x 4 -p 12 -n 20000
# the network of the second pass
net again-4 again=yes,cubes=32,cube=80,slices=4,depth=8,components=448,width=768,decay=.3 -x 4 -p 16 -n 12000
cp "$with" "$out"
