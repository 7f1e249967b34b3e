#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Remakes slices.safetensors, the shipped prior of slices:
#   make-slices.sh CT_FOLDER HELD_FOLDER WORK OUT.safetensors
# CT_FOLDER holds NIfTI volumes in HU, and micro-CT in bytes, which become HU by --bytes; the names of those
# begin with "mouse", those of limbs with "limb". HELD_FOLDER holds those of other patients, on which the nets
# are judged and their expected error is calibrated. The examples stay in WORK.
# The same machine and version give the same bytes, but for names of files in the history, for what net 2
# says of its error, which was calibrated on cubes 1.1 to 2.3 times as coarse, and for again-4, which learnt
# from what an earlier net 4 left (two hidden layers, components=448,width=1024).
set -e
ct=$1 held=$2 work=$3 out=$4
# Limbs and mice are many: all else counts twice, and half of the mice are left out.
mkdir -p "$work/balanced"
mice=0
for f in "$ct"/*; do
	name=$(basename "$f")
	case $name in
	mouse*)
		mice=$((mice + 1))
		[ $mice -le 6 ] || continue
		;;
	limb*) ;;
	*) ln -sf "$(realpath "$f")" "$work/balanced/2$name" ;;
	esac
	ln -sf "$(realpath "$f")" "$work/balanced/$name"
done
# Thick slices are learnt from plain shells too.
mkdir -p "$work/shells"
cp -P "$work"/balanced/* "$work/shells"
for i in 1 2 3 4; do
	ct-phantom -q -s $i --size=224x224x224 --spacing=1.5 --expert oversample=2 shells - |
		ct-degrade -q -f -x 1 --sigma=0.6,0.6,0.6 --noise=12 --seed $i - "$work/shells/shells$i.nii.gz"
done
net() { # net NAME DATA KEYS ct-train options: trains one more network and adds it to the file
	name=$1 data=$2 keys=$3
	shift 3
	ct-train -f --half --licence Apache-2.0 --kind slices -s 1 --bytes=-1000:2570 --cache "$work/examples" \
		--validate "$held" --expert "window=-512:3071,validate-every=1000,$keys" --checkpoint-every 1000000 ${with:+--with "$with"} \
		"$@" "$work/$name.safetensors" "$data"
	with=$work/$name.safetensors
}
all=$ct some=$work/balanced shells=$work/shells
net 4 "$some" cubes=64,cube=80,slices=4,depth=8,components=320,width=640,hidden=6,decay=.2 -x 4 -p 12 -n 32000
net 2 "$all" cubes=40,cube=64,slices=2,depth=6,components=320,width=768,decay=.3 -x 2 -p 12 -n 16000
net 3 "$some" cubes=40,cube=72,slices=3,depth=7,components=320,width=640,hidden=6,decay=.2 -x 3 -p 13 -n 16000
net 8 "$all" cubes=24,cube=96,slices=2,depth=4,components=320,width=640,hidden=6,decay=.3 -x 8 -p 24 -n 12000
net thick-4 "$shells" thick=yes,cubes=48,cube=80,depth=5,components=240,width=512,hidden=6,decay=.3 -x 4 -p 12 -n 20000
# the network of the second pass
net again-4 "$some" again=yes,cubes=32,cube=80,slices=4,depth=8,components=448,width=768,decay=.2 -x 4 -p 16 -n 12000
cp "$with" "$out"
