#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Remakes slices.safetensors, the shipped prior of slices:
#   make-slices.sh CT_FOLDER HELD_FOLDER WORK OUT.safetensors
# CT_FOLDER holds NIfTI volumes in HU; the names of limbs begin with "limb". HELD_FOLDER holds those of other
# patients, on which the nets are judged and their expected error is calibrated. The examples stay in WORK.
# The same machine and version give the same bytes, but for names of files in the history, and for again-4, which
# learnt from what a net 4 left that was stopped after 7450 of 30000 steps: what the last one leaves of CTs that it
# learnt is less than what it leaves of others (doc/trials.md).
set -e
mkdir -p "$3"
ct=$1 held=$2 work=$(realpath "$3") out=$4
# Limbs are many: all else counts twice.
mkdir -p "$work/plain" "$work/shells"
for f in "$ct"/*; do
	name=$(basename "$f")
	case $name in
	limb*) ;;
	*) ln -sf "$(realpath "$f")" "$work/plain/2$name" ;;
	esac
	ln -sf "$(realpath "$f")" "$work/plain/$name"
done
# Plain shells are learnt, too: two volumes by most nets, four by that of thick slices, none by net 2.
for i in 1 2 3 4; do
	ct-phantom -q -s $i --size=224x224x224 --spacing=1.5 --expert oversample=2 shells - |
		ct-degrade -q -f -x 1 --sigma=0.6,0.6,0.6 --noise=12 --seed $i - "$work/shells/shells$i.nii.gz"
done
mkdir -p "$work/some" "$work/all"
cp -P "$work/plain"/* "$work/some"
cp -P "$work/plain"/* "$work/all"
ln -sf "$work/shells"/shells[12].nii.gz "$work/some"
ln -sf "$work/shells"/shells*.nii.gz "$work/all"
net() { # net NAME DATA KEYS ct-train options: trains one more network and adds it to the file
	name=$1 data=$work/$2 keys=$3
	shift 3
	ct-train -f --half --licence Apache-2.0 --kind slices -s 1 --cache "$work/examples" \
		--validate "$held" --expert "window=-512:3071,validate-every=1000,$keys" --checkpoint-every 1000000 ${with:+--with "$with"} \
		"$@" "$work/$name.safetensors" "$data"
	with=$work/$name.safetensors
}
net 4 some cubes=64,cube=80,slices=4,depth=8,components=320,width=640,hidden=6,decay=.2 -x 4 -p 12 -n 24000
net 2 plain cubes=40,cube=64,slices=2,depth=6,components=320,width=768,decay=.3 -x 2 -p 12 -n 16000
net 3 some cubes=40,cube=72,slices=3,depth=7,components=320,width=640,hidden=6,decay=.2 -x 3 -p 13 -n 16000
net 8 some cubes=24,cube=96,slices=2,depth=4,components=320,width=640,hidden=6,decay=.3 -x 8 -p 24 -n 9000
net thick-4 all thick=yes,cubes=48,cube=80,depth=5,components=240,width=512,hidden=6,decay=.3 -x 4 -p 12 -n 20000
# the network of the second pass
net again-4 some again=yes,cubes=32,cube=80,slices=4,depth=8,components=448,width=768,decay=.2 -x 4 -p 16 -n 10000
cp "$with" "$out"
