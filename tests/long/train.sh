#!/bin/sh
# train.sh [MINUTES]: the training kit of bench/train on a CPU, with toy networks, down to files that the commands
# read. Needs PyTorch, numpy and Pillow, and the sources. The row counts what was checked.
. "$(dirname "$0")/lib.sh"
minutes=${1:-1} # of each training
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
python3 "$kit/pack.py" ct xray "$build" pack >pack.log 2>err
tally $? 'pack.py failed'
for network in volume projections; do
	row "$network: a toy network, $minutes minute(s)"
	python3 "$kit/train.py" $network --data pack --out out --minutes "$minutes" --tiny >$network.out 2>err
	tally $? 'train.py failed'
	! grep -q 'not finite' out/$network*.log && grep -q 'ends; best 0*[0-9.]' out/$network*.log
	tally $? "the log has no finite loss: $(tail -n 1 out/$network*.log)"
	[ "$(find out -size +16384k | wc -l)" -eq 0 ]
	tally $? 'a file is above 16 MiB'
	python3 "$kit/train.py" $network --data pack --out again --start out --minutes 0.4 --tiny >$network.again 2>err &&
		grep -q 'goes on from out' again/$network*.log
	tally $? 'a training does not go on from its state'
done
inputs
row 'the commands read what was trained'
ct-ddnm -q -x 4 -n 4 -p out/projections.safetensors hr-low.exr sr.exr 2>err && ct-info sr.exr >/dev/null
tally $? 'ct-ddnm does not read projections.safetensors'
ct-info out/volume-4.safetensors >info 2>err && grep -q volume-4 info
tally $? 'ct-info does not read volume-4.safetensors'
finish
