#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The main job on a real CT, from a fresh clone: installs what is missing with apt, builds, fetches
# a human head (Debian's invesalius-examples), cuts a 128^3 cube, degrades it four times,
# super-resolves it, and prints a table and the path of a picture. Takes about ten minutes on two cores.
#   examples/cranium.sh [WORKDIR] [ct-sr options...]
set -e
LC_ALL=C; export LC_ALL # numbers have a point
top=$(cd "$(dirname "$0")/.." && pwd)
work=${1:-$top/build/cranium}
[ $# -eq 0 ] || shift
mkdir -p "$work"
work=$(cd "$work" && pwd)
[ -n "$(ls -A "$work")" ] || echo cranium.sh >"$work/made-by"
[ "$(cat "$work/made-by" 2>/dev/null)" = cranium.sh ] || {
	echo "cranium.sh: $work holds files of others: name a folder that is new or empty" >&2
	exit 1
}
"$top/scripts/install-deps.sh" build
say() { echo "== $*"; }

say 'building'
mkdir -p "$top/build"
cd "$top"
[ -x configure ] || ./bootstrap >build/bootstrap.log 2>&1 || { tail -n 40 build/bootstrap.log; exit 1; }
cd build
[ -f Makefile ] || "$top/configure" -q
if [ -t 1 ]; then make -j"$(nproc)"; else make -j"$(nproc)" >make.log 2>&1 || { tail -n 40 make.log; exit 1; }; fi
PATH=$top/build:$PATH
cd "$work"

if [ ! -f matrix.dat ]; then
	say 'fetching Cranium.inv3 (a human head, 256x256x108, from the package invesalius-examples)'
	if [ "$(id -u)" -eq 0 ]; then as_root=; else as_root=sudo; fi
	inv=/usr/share/doc/invesalius-examples/examples/Cranium.inv3
	if [ ! -f "$inv" ]; then # minimal systems may leave out /usr/share/doc: unpack it here
		$as_root apt-get update -qq
		(apt-get download -qq invesalius-examples && dpkg-deb -x invesalius-examples_*.deb deb) >fetch.log 2>&1 || { cat fetch.log >&2; exit 1; }
		inv=deb$inv
	fi
	mkdir -p part
	tar -xzf "$inv" -C part --wildcards --strip-components=1 '*/main.plist' '*/matrix.dat'
	mv part/main.plist . && mv part/matrix.dat .
fi
# InVesalius keeps rows from back to front (LAS); the plist has shape (slices, rows, columns) and spacing (mm)
values() { sed -n "/<key>$1</,/<\/array>/s/.*<$2>\(.*\)<.*/\1/p" main.plist; }
dims=$(values shape integer | tac | paste -sd x)
spacing=$(values spacing real | paste -sd ,)

say "cutting a 128^3 cube of 1.5 mm from $dims voxels of $(echo "$spacing" | awk -F, '{printf "%.4g,%.4g,%.4g", $1, $2, $3}') mm, and degrading it 4x"
ct-convert -f --raw "$dims:i16:$spacing" --orient LAS --iso 1.5 --cube 128 matrix.dat hr.nii.gz
ct-degrade -f -x 4 --protocol P1 hr.nii.gz lr.nii.gz
timed() { # timed NAME COMMAND...: wall seconds and peak memory to NAME.time
	name=$1
	shift
	/usr/bin/time -o "$name.time" -f '%e %M' "$@"
}
timed trilinear ct-upsample -f -x 4 --method linear lr.nii.gz trilinear.nii.gz
timed cubic ct-upsample -f -x 4 --method cubic lr.nii.gz cubic.nii.gz
say 'super-resolving'
timed ours ct-sr -f -v -x 4 "$@" lr.nii.gz ours.nii.gz

printf '\n%-10s %9s %8s %8s %9s %9s\n' '' 'PSNR dB' 'SSIM' 'seconds' 'peak MiB' ''
for m in trilinear cubic ours; do
	ct-metrics --window -1024:3071 hr.nii.gz $m.nii.gz >$m.metrics
	read -r seconds kib <$m.time
	printf '%-10s %9.3f %8.4f %8.1f %9d\n' $m "$(awk '/^psnr/ {print $2}' $m.metrics)" \
		"$(awk '/^ssim-r2/ {print $2}' $m.metrics)" "$seconds" $((kib / 1024))
done
ct-view -f --labels --names truth,trilinear,cubic,ct-sr --zoom 2 --window -200:1400 -o montage.svg --error hr.nii.gz trilinear.nii.gz cubic.nii.gz ours.nii.gz
printf '\npicture (truth, trilinear, cubic, ours; below, the errors): %s\n' "$PWD/montage.svg"
