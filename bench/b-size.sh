#!/bin/sh
# b-size.sh: CPU seconds and peak memory of ct-upsample -m tv and of ct-restore, 20 iterations of either, against the
# edge of the result, a cube, 4x, one thread, of a scan that is sampled by points (P3 of ct-degrade). From an edge of
# SLABBED on it is made in slabs of 128 fine voxels, each in MEMORY; their seconds are summed, the largest peak counts.
#   make bench BENCH=bench/b-size.sh
#   SIZES='64 128 256 512' VOLUME=scan.nii.gz TABLE=$PWD/sizes.csv make bench BENCH=bench/b-size.sh
# The scan is the middle of VOLUME; without one, ellipsoids, of which the prior passes over what is flat, as it does not
# of a patient. What is in TABLE is not measured again, so that the same command goes on.
set -e
[ -x /usr/bin/time ] || { echo 'b-size.sh: skipped: no /usr/bin/time'; exit 0; }
SIZES=${SIZES:-64 128} SLABBED=${SLABBED:-512} MEMORY=${MEMORY:-2G}
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
TABLE=${TABLE:-$dir/table.csv}
by='-x 4 --sigma .5 --decimate point'
[ -s "$TABLE" ] || echo 'command,edge,slab,of,cpu-s,peak-kib' >"$TABLE"

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
	/usr/bin/time -o "$dir/time" -f '%U %S %M' "$@" -q -f -t 1 "$dir/scan.nii" "$dir/fine.nii"
	awk -v r="$row" '{printf "%s,%.2f,%d\n", r, $1 + $2, $3}' "$dir/time" >>"$TABLE"
}

# shellcheck disable=SC2086
for n in $SIZES; do
	scan $((n / 4))
	if [ "$n" -lt "$SLABBED" ]; then
		measure "upsample,$n,1,1" ct-upsample $by -m tv --iterations 20 --tolerance 0
		measure "restore,$n,1,1" ct-restore $by --iterations 20 --tolerance 0
		continue
	fi
	k=1 of=$((n / 128))
	while [ "$k" -le "$of" ]; do
		measure "upsample,$n,$k,$of" ct-upsample $by -m tv --iterations 20 --brick "$k/$of" --memory "$MEMORY"
		measure "restore,$n,$k,$of" ct-restore $by --iterations 20 --brick "$k/$of" --memory "$MEMORY"
		k=$((k + 1))
	done
done
awk -F, 'NR > 1 {
	r = $1 SUBSEP $2
	if (!(r in cpu)) row[++rows] = r
	cpu[r] += $5; of[r] = $4
	if ($6 > peak[r]) peak[r] = $6
}
END {
	print "| command | edge of the result | slabs | CPU s | us a voxel | peak, MiB | bytes a voxel |"
	print "|---|---:|---:|---:|---:|---:|---:|"
	for (i = 1; i <= rows; i++) {
		r = row[i]; split(r, s, SUBSEP)
		printf "| ct-%s | %d | %d | %.1f | %.2f | %.0f | %.1f |\n", s[1], s[2], of[r], cpu[r],
			1e6 * cpu[r] / s[2] ^ 3, peak[r] / 1024, 1024 * peak[r] / s[2] ^ 3
	}
}' "$TABLE"
