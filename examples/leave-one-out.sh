#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What a prior of slices gains on patients that it was not trained on:
#
#   examples/leave-one-out.sh CT_FOLDER WORK [FILE...]
#
# leaves each FILE (all HU volumes of the folder, by default) out, LEAVE of them at a time, trains a small
# prior on the others, and prints what part of the residual's energy is left on those that were left out
# (ct-train --validate), and of the middle of each the PSNR (dB) of the inversion and what ct-upsample -m prior adds to it,
# band-limited (P1) and aliased (P3). Examples are made once and stay in WORK, a folder that is new, empty or was made by it.
set -e
LC_ALL=C; export LC_ALL # numbers have a point
[ $# -ge 2 ] || { echo "usage: $0 CT_FOLDER WORK [FILE...]" >&2; exit 2; }
ct=$1 work=$2
shift 2
fail() { echo "leave-one-out.sh: $*" >&2; exit 1; }
mkdir -p "$work"
[ -n "$(ls -A "$work")" ] || echo leave-one-out.sh >"$work/made-by"
[ "$(cat "$work/made-by" 2>/dev/null)" = leave-one-out.sh ] ||
	fail "$work holds files of others: name a folder that is new or empty"
: "${LEAVE:=1}" "${SIDE:=64}" "${CLIP:=-512:3071}"
: "${TRAIN:=--bytes=-1000:2570 -n 1000 -s 1}" "${KEYS:=cubes=6,cube=72,depth=3,components=160,width=384}"
[ $# -gt 0 ] || for f in "$ct"/*; do
	if ct-info --json "$f" | grep -q '"min": -'; then set -- "$@" "$f"; fi
done
[ $# -gt 0 ] || fail "$ct: no volume in HU"
for f in "$@"; do
	[ "$f" -ef "$ct/$(basename "$f")" ] || fail "$f: is no file of $ct, of which the others are trained on"
done
psnr() {
	ct-metrics -w "$CLIP" "$it/hr.nii" "$1" >"$it/figures"
	awk '$1 == "psnr" {print $2}' "$it/figures"
}
gains() { # gains PROTOCOL: of $it/hr.nii
	ct-degrade -q -f -x 4 -p "$1" "$it/hr.nii" "$it/lr.nii"
	ct-upsample -q -f "$it/lr.nii" "$it/up.nii"
	ct-upsample -m prior -q -f -p "$d/prior.safetensors" "$it/lr.nii" "$it/sr.nii"
	psnr "$it/up.nii"
	psnr "$it/sr.nii"
}
printf '%-44s %6s %7s %6s %7s %6s\n' 'left out' loss P1 adds P3 adds
while [ $# -gt 0 ]; do
	d=$work/$(basename "$1" | sed 's/\.nii.*//')
	rm -rf "$d"
	mkdir -p "$d/others" "$d/held"
	for f in "$ct"/*; do ln -s "$(realpath "$f")" "$d/others"; done
	left=$LEAVE
	while [ "$left" -gt 0 ] && [ $# -gt 0 ]; do
		mv "$d/others/$(basename "$1")" "$d/held"
		left=$((left - 1))
		shift
	done
	# shellcheck disable=SC2086
	ct-train -f --kind slices $TRAIN --expert "$KEYS,window=$CLIP,log-every=1000000,validate-every=1000000" --cache "$work/examples" \
		--checkpoint-every 1000000 --validate "$d/held" "$d/prior.safetensors" "$d/others" 2>"$d/log" || {
		tail -n 3 "$d/log" >&2
		fail "$d/prior.safetensors: no prior was made"
	}
	loss=$(sed -n 's/.*held-out loss //p' "$d/log")
	for f in "$d/held"/*; do
		it=$d/$(basename "$f" | sed 's/\.nii.*//')
		mkdir "$it"
		ct-convert -q --cube "$SIDE" "$f" - | ct-degrade -q -x 1 --clip="$CLIP" - "$it/hr.nii"
		p1=$(gains P1)
		p3=$(gains P3)
		echo "$loss" "$p1" "$p3" | tr '\n' ' ' | scan=$(basename "$it") awk \
			'{printf "%-44s %6.3f %7.2f %+6.2f %7.2f %+6.2f\n", ENVIRON["scan"], $1, $2, $3 - $2, $4, $5 - $4}'
	done
done
