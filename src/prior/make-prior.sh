#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Remakes the shipped prior: projections of CT volumes in random poses, radiographs, ct-train.
#   make-prior.sh CT_FOLDER XRAY_FOLDER WORK OUT.safetensors [ct-train options...]
# CT_FOLDER holds NIfTI volumes in HU (and, under mouse/, micro-CT in arbitrary units);
# XRAY_FOLDER holds PNG radiographs. WORK keeps the projections.
set -e
ct=$1 xray=$2 work=$3 out=$4
shift 4
mkdir -p "$work"
k=0
project() { # project VOLUME WINDOW POSE...: a stack a pose, on detectors of two sizes in turn
	volume=$1 window=$2
	shift 2
	for pose; do
		k=$((k + 1))
		case $((k % 2)) in 0) det=192 ;; *) det=320 ;; esac
		stack=$work/$(basename "$volume" .nii.gz)-$k.exr
		[ -f "$stack" ] || ct-project --views 24 --arc 360 --expert "start=$((k * 7 % 15)),rotate=$pose" \
			--window "$window" --det "$det" "$volume" "$stack"
	done
}
for v in "$ct"/*.nii.gz; do
	project "$v" -1024:3071 0,0,0 5,-5,3 15,-10,5 -25,20,80 40,10,-60 -8,70,10
done
for v in "$ct"/mouse/*.nii.gz; do
	[ -f "$v" ] || continue
	project "$v" 0:255 0,0,0 70,30,10
done
exec ct-train "$@" "$out" "$work"/*.exr "$xray"
