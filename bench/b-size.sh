#!/bin/sh
# b-size.sh: CPU seconds and peak memory of ct-upsample -m tv and of ct-restore, 20 iterations of either, against the
# edge of the result, a cube, 4x, one thread, of a scan that is sampled by points (P3 of ct-degrade). From an edge of
# SLABBED on it is made in slabs of THICK fine voxels, each in MEMORY; SLABS are those that are made, or all of them.
#   make bench BENCH=bench/b-size.sh
#   SIZES='64 128 256 512' VOLUME=scan.nii.gz TABLE=$PWD/sizes.csv make bench BENCH=bench/b-size.sh
#   COMMANDS=restore SIZES=768 THICK=32 SLABS=12 VOLUME=scan.nii.gz TABLE=$PWD/sizes.csv make bench BENCH=bench/b-size.sh
# The scan is the middle of VOLUME; without one, ellipsoids, of which the prior passes over what is flat, as it does not
# of a patient. What is in TABLE is not measured again, so that the same command goes on. A voxel is one that was made,
# the 32 about a slab included; of ct-restore the share of its cells that are not flat, which alone take the prior's
# time, is counted too.
set -e
[ -x /usr/bin/time ] || { echo 'b-size.sh: skipped: no /usr/bin/time'; exit 0; }
SIZES=${SIZES:-64 128} SLABBED=${SLABBED:-512} THICK=${THICK:-128} MEMORY=${MEMORY:-2G}
COMMANDS=${COMMANDS:-upsample restore}
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
TABLE=${TABLE:-$dir/table.csv}
by='-x 4 --sigma .5 --decimate point'
[ -s "$TABLE" ] || echo 'command,edge,slab,of,cpu-s,peak-kib,not-flat' >"$TABLE"

scan() { # scan N: N^3 voxels to scan.nii
	if [ -n "${VOLUME:-}" ]; then
		# shellcheck disable=SC2046
		set -- "$1" $(ct-info "$VOLUME" | awk '$1 == "size" {print $2, $3, $4}')
		box=$(echo "$@" | awk '{for (a = 2; a < 5; a++) {
			o = int(($a - $1) / 2); if (o < 0) exit 1; printf "%s%d:%d", (a > 2 ? "," : ""), o, o + $1}}') ||
			{ echo "b-size.sh: $VOLUME has no $1 voxels along all axes" >&2; return 1; }
		ct-convert -q -f --crop="$box" "$VOLUME" "$dir/scan.nii"
	else
		ct-phantom -q -f --size "$1x$1x$1" ellipsoids "$dir/scan.nii"
	fi
}

measure() { # measure ROW COMMAND...: a line of TABLE, unless it is there
	row=$1; shift
	grep -q "^$row," "$TABLE" && return
	/usr/bin/time -o "$dir/time" -f '%U %S %M' "$@" -v -f -t 1 "$dir/scan.nii" "$dir/fine.nii" 2>"$dir/log" ||
		{ cat "$dir/log" >&2; return 1; }
	uneven=$(awk '/cells are not flat/ {printf "%.4f", $2 / $4}' "$dir/log")
	awk -v r="$row" -v u="$uneven" '{printf "%s,%.2f,%d,%s\n", r, $1 + $2, $3, u}' "$dir/time" >>"$TABLE"
}

for n in $SIZES; do
	scan $((n / 4))
	for c in $COMMANDS; do
		case $c in
		upsample) how='-m tv --iterations 20 --noise 0' ;;
		restore) how='--iterations 20 --noise 0' ;;
		*) echo "b-size.sh: COMMANDS: no $c" >&2; exit 1 ;;
		esac
		# shellcheck disable=SC2086
		if [ "$n" -lt "$SLABBED" ]; then
			measure "$c,$n,1,1" "ct-$c" $by $how --tolerance 0
		else
			of=$((n / THICK))
			for k in ${SLABS:-$(seq $of)}; do
				measure "$c,$n,$k,$of" "ct-$c" $by $how --brick "$k/$of" --memory "$MEMORY"
			done
		fi
	done
done
awk -F, 'NR > 1 {
	r = $1 SUBSEP $2
	if (!(r in cpu)) row[++rows] = r
	voxels = $2 ^ 2 * ($4 == 1 ? $2 : $2 / $4 + 32 * ($3 > 1) + 32 * ($3 < $4))
	cpu[r] += $5; of[r] = $4; made[r] += voxels; uneven[r] += $7 * voxels; slabs[r]++
	if ($6 > peak[r]) peak[r] = $6
}
END {
	print "| command | edge of the result | slabs | CPU s | us a voxel | not flat | us a voxel that is not | peak, MiB | bytes a voxel of the result |"
	print "|---|---:|---:|---:|---:|---:|---:|---:|---:|"
	for (i = 1; i <= rows; i++) {
		r = row[i]; split(r, s, SUBSEP)
		part = slabs[r] < of[r] ? slabs[r] " of " of[r] : of[r]
		flat = uneven[r] ? sprintf("%.2f | %.2f", uneven[r] / made[r], 1e6 * cpu[r] / uneven[r]) : "|"
		printf "| ct-%s | %d | %s | %.1f | %.3f | %s | %.0f | %.1f |\n", s[1], s[2], part, cpu[r],
			1e6 * cpu[r] / made[r], flat, peak[r] / 1024, 1024 * peak[r] / s[2] ^ 3
	}
}' "$TABLE"
