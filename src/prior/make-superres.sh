#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Remakes the small networks of super-resolution, rdn-4, omni-4, rdn-8 and omni-8 of this folder.
#   make-superres.sh CT_FOLDER HELD_FOLDER WORK [MINUTES]
# The folders hold NIfTI volumes in HU; of those that are held out the loss is reported. WORK keeps the
# projections and gets the networks. A network trains for MINUTES (6 unless given).
set -e
ct=$1 held=$2 work=$3 minutes=${4:-6}
licence='Apache-2.0; trained on projections of CTs of CC BY 3.0 and 4.0'
k=0
project() { # project FOLDER VOLUME POSE...: a stack a pose
	to=$1 volume=$2
	shift 2
	mkdir -p "$to"
	for pose; do
		k=$((k + 1))
		stack=$to/$(basename "$volume" .nii.gz)-$k.exr
		[ -f "$stack" ] || ct-project --views 24 --arc 360 --expert "start=$((k * 7 % 15)),rotate=$pose" \
			--window -1024:3071 --det 128 "$volume" "$stack"
	done
}
for v in "$ct"/*.nii.gz; do
	project "$work/train" "$v" 0,0,0 15,-10,5 -25,20,80
done
for v in "$held"/*.nii.gz; do
	project "$work/held" "$v" 0,0,0
done
train() { # train NAME FACTOR ARCH OPTIONS...
	name=$1 factor=$2 arch=$3
	shift 3
	ct-train --kind superres --factor "$factor" --arch "$arch" --minutes "$minutes" --steps 1000000 --half \
		--licence "$licence" --validate "$work/held" "$@" "$work/$name.safetensors" "$work/train"
}
rdn=net=rdn,blocks=2,layers=3,features=16,growth=12
omni=net=omni,blocks=1,features=16,num_heads=2
train rdn-4 4 $rdn --patch 96 --expert lr=1e-3,ema=0.998
train omni-4 4 $omni --patch 96 --expert lr=1e-3,ema=0.998
train rdn-8 8 $rdn --patch 128 --expert lr=1e-3,ema=0.998
train omni-8 8 $omni --patch 128 --expert lr=1e-3,ema=0.998
