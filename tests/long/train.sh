#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# train.sh [MINUTES [NETWORK]]: the training kit of bench/train on a CPU, with toy networks, down to files that the commands
# read; of one network alone: 4, thick-4, 2, projections. Needs PyTorch, numpy and Pillow, and the sources. The row counts
# what was checked.
. "$(dirname "$0")/lib.sh"
minutes=${1:-1} # of each training
networks=${2:-4 thick-4 2 projections}
python3 -c 'import torch, numpy, PIL' 2>/dev/null || { echo "row|$part|skipped: no PyTorch|0|0"; exit 0; }
kit=$srcdir/bench/train build=$(dirname "$(command -v ct-sr)")
[ -x "$build/bench/train/pairs" ] && [ -x "$build/bench/train/projections" ] ||
	make -s -C "$build" bench/train/pairs bench/train/projections >make.log 2>&1 || { cat make.log; exit 99; }
mkdir ct xray
row 'pack of four phantoms'
k=0
for name in chest_a head_b body_c limb_tciasts047; do
	k=$((k + 1))
	ct-phantom -q -f --size 112x112x112 --spacing 1.5 -s $k ellipsoids v.nii &&
		ct-convert -q -f --type i16 v.nii ct/${name}_iso1p50.nii.gz
done
tally $? 'the phantoms were not made' 4
python3 - <<'PY'
import numpy
from PIL import Image
for i in range(4):
    Image.fromarray(numpy.add.outer(numpy.arange(256), numpy.arange(256) * i) .astype('u1')).save('xray/%d.png' % i)
PY
python3 "$kit/pack.py" ct xray "$build" pack 4 thick-4 2 >pack.log 2>err
tally $? 'pack.py failed'
# train NAME ARGUMENT...: of a toy network, and on from its state
train() {
	name=$1 && shift
	row "$name: a toy network, $minutes minute(s)"
	python3 "$kit/train.py" "$@" --data pack --out out --minutes "$minutes" --tiny >$name.out 2>err
	tally $? 'train.py failed'
	! grep -q 'not finite' out/$name.log && grep -q 'ends; best 0*[0-9.]' out/$name.log
	tally $? "the log has no finite loss: $(tail -n 1 out/$name.log)"
	[ "$(find out -size +16384k | wc -l)" -eq 0 ]
	tally $? 'a file is above 16 MiB'
	python3 "$kit/train.py" "$@" --data pack --out again --start out --minutes 0.4 --tiny >$name.again 2>err &&
		grep -q 'goes on from out' again/$name.log
	tally $? 'a training does not go on from its state'
}
# reads SCANS PRIOR: ct-sr and ct-upsample read PRIOR, and make another result of such a scan than with the installed one
reads() {
	case $1 in
	4) scan=hr-lr4.nii factor=4 ;;
	thick-4) scan=hr-thick.nii factor=1,1,4 ;;
	2) scan=hr-lr.nii factor=2 ;;
	esac
	for command in "ct-sr --prior" "ct-upsample -m prior -p"; do
		$command "$srcdir/src/prior/slices.safetensors" -q -f -x $factor $scan without.nii 2>err &&
			$command "$2" -q -f -x $factor $scan with.nii 2>err && [ "$(said with.nii)" != "$(said without.nii)" ]
		tally $? "$command $2 does not change the ${factor}x of $scan"
	done
}
inputs
ct-degrade -q -x 1,1,4 --decimate mean --sigma 0 hr.nii hr-thick.nii
for network in $networks; do
	if [ "$network" = projections ]; then
		train projections projections
		ct-ddnm -q -x 4 -n 4 -p out/projections.safetensors hr-low.exr sr.exr 2>err && ct-info sr.exr >/dev/null
		tally $? 'ct-ddnm does not read projections.safetensors'
		continue
	fi
	train volume-$network volume --scans $network
	python3 "$kit/join.py" $network.safetensors out/volume-$network.safetensors 2>err
	tally $? "join.py does not join volume-$network.safetensors"
	reads $network $network.safetensors
done
row 'one prior of all volume networks'
if [ "$networks" != projections ]; then
	python3 "$kit/join.py" all.safetensors out/volume-*.safetensors 2>err
	tally $? 'join.py does not join all networks'
	for network in $networks; do
		[ $network = projections ] || reads $network all.safetensors
	done
fi
finish
