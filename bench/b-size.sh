#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# b-size.sh: CPU seconds and peak memory of ct-upsample, 20 iterations of METHODS (tv, prior), one thread, against the
# edge of the result: a cube, 4x, of a point-sampled scan (P3 of ct-degrade).
#   make bench BENCH=bench/b-size.sh
#   SIZES='64 128 256 512' VOLUME=scan.nii.gz TABLE=$PWD/sizes.csv make bench BENCH=bench/b-size.sh
#   METHODS=prior MEMORY=2G SIZES=768 VOLUME=scan.nii.gz make bench BENCH=bench/b-size.sh
# The scan is the middle of VOLUME; without one, ellipsoids, where the prior skips what is flat, as it does not in a
# patient. A row that TABLE has is not measured again. For the prior the share of textured cells is counted too.
#   STAGES='128 256 all' VOLUME=scan.nii.gz make bench BENCH=bench/b-size.sh
# instead: seconds of each stage of ct-sr -x 2 as it is, of a cube to 128^3 and 256^3 and of all of VOLUME, all cores.
set -e
[ -x /usr/bin/time ] || { echo 'b-size.sh: skipped: no /usr/bin/time'; exit 0; }
SIZES=${SIZES:-64 128} METHODS=${METHODS:-tv prior}
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
TABLE=${TABLE:-$dir/table.csv}
by='-x 4 --sigma .5 --decimate point'
[ -s "$TABLE" ] || echo 'method,edge,cpu-s,peak-kib,textured' >"$TABLE"

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
	uneven=$(sed -n "s/.*: \([0-9]*\) of \([0-9]*\) cells are textured.*/\1 \2/p" "$dir/log" | awk '{print $1 / $2}')
	awk -v r="$row" -v u="$uneven" '{printf "%s,%.2f,%d,%s\n", r, $1 + $2, $3, u}' "$dir/time" >>"$TABLE"
}

stages() { # stages EDGE: a row of the table
	if [ "$1" = all ]; then in=${VOLUME:?b-size.sh: all of which VOLUME}; else scan $(($1 / 2)); in=$dir/scan.nii; fi
	/usr/bin/time -o "$dir/time" -f '%e %M' ct-sr -vv -f -x 2 ${MEMORY:+--memory "$MEMORY"} "$in" "$dir/fine.nii" 2>"$dir/log" ||
		{ cat "$dir/log" >&2; return 1; }
	awk 'NR == FNR {took = $1; peak = $2 / 1024; next}
		/iterations, last moved/ {invert += $(NF - 1)}
		/cells are textured/ {prior += $(NF - 1); uneven += $2; cells += $4}
		/^ct-sr: [0-9x]+ to / {size = $4; sub(",", "", size); split(size, n, "x")}
		END {
			rest = took - invert - prior
			printf "| %s | %.1f | %.1f | %.1f | %.1f | %.0f | %.2f | %.0f |\n", size, rest, invert, prior, took,
				1e9 * took / n[1] / n[2] / n[3], uneven / cells, peak
		}' "$dir/time" "$dir/log"
}

if [ -n "${STAGES:-}" ]; then
	echo '| result | asking the scan, files, s | inversion, s | prior, s | all, s | ns a voxel | textured | peak, MiB |'
	echo '|---|---:|---:|---:|---:|---:|---:|---:|'
	for n in $STAGES; do stages "$n"; done
	exit
fi
for n in $SIZES; do
	scan $((n / 4))
	for m in $METHODS; do
		# shellcheck disable=SC2086
		measure "$m,$n" ct-upsample -m "$m" $by --iterations 20 --noise 0 --tolerance 0 ${MEMORY:+--memory "$MEMORY"}
	done
done
awk -F, 'NR == 1 {
	print "| method | edge of the result | CPU s | us a voxel | textured | us a textured voxel | peak, MiB | bytes a voxel of the result |"
	print "|---|---:|---:|---:|---:|---:|---:|---:|"
	next
}
{
	textured = $5 ? sprintf("%.2f | %.2f", $5, 1e6 * $3 / $5 / $2 ^ 3) : "|"
	printf "| %s | %d | %.1f | %.3f | %s | %.0f | %.1f |\n", $1, $2, $3, 1e6 * $3 / $2 ^ 3, textured, $4 / 1024, 1024 * $4 / $2 ^ 3
}' "$TABLE"
