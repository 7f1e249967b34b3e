#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-sr --paper and --release, run on a small phantom and held against figures that were recorded when
# every step was compared with what the paper and its release say: window -512:3071; density of the scan,
# and of cubic, not clipped; projections of the scan itself on its own detector; 50 steps from noise, DDNM+ with
# sigma_y 0.0015, eta 0.99; rates that fall over 30000 iterations; and of the release what ct-release(7) lists.
# Rounding differs between processors, in the network most.
. "$srcdir/tests/tap.sh"
ct-phantom -q -w -512:3071 ellipsoids --size 32x32x32 --spacing 4 hr.nii
ct-degrade -q --clip -512:3071 -x 4 -p P2 hr.nii lr.nii; ok $? 'a scan that was clipped before it was reduced'
near() { # near NAME VALUE WANT BY
	awk "BEGIN {d = $2 - $3; exit !((d < 0 ? -d : d) <= $4)}"; ok $? "$1: $2 (recorded $3)"
}
figure() { ct-info "$2" | awk -v k="$1" '$1 == k {print $2}'; }
db() { ct-metrics hr.nii "$1" | awk '/^psnr/ {print $2}'; }
set -- --expert views=6,iterations=100,gaussians=500
exits 0 'the paper' ct-sr -q --paper "$@" --keep p lr.nii paper.nii
exits 0 'the release' ct-sr -q --release "$@" --keep r lr.nii release.nii
near 'scan, least value' "$(figure min lr.nii)" -544.2321 0.001
near 'scan, projections, least value' "$(figure min p/lr-proj.exr)" -0.5534868 0.0001
near 'scan, projections, mean' "$(figure mean p/lr-proj.exr)" 4.245801 0.0001
near 'cubic, projections, least value' "$(figure min p/up-proj.exr)" -0.8905023 0.0001
near 'cubic, projections, mean' "$(figure mean p/up-proj.exr)" 4.515145 0.0001
near 'paper, projections, mean' "$(figure mean p/sr-proj.exr)" 4.337480 0.002
near 'paper, projections, deviation' "$(figure sd p/sr-proj.exr)" 6.599332 0.002
near 'release, projections, mean' "$(figure mean r/sr-proj.exr)" 4.24966 0.002
near 'release, projections, deviation' "$(figure sd r/sr-proj.exr)" 6.594114 0.002
near 'paper, PSNR' "$(db paper.nii)" 25.0421 0.002
near 'release, PSNR' "$(db release.nii)" 24.8511 0.002
[ "$(figure min paper.nii | cut -d. -f1)" -ge -512 ]; ok $? 'nothing below density 0 is left'
near 'release, projections of the scan, mean' "$(figure mean r/lr-proj.exr)" 4.245801 0.0001
# the factor decides what the release takes
ct-degrade -q --clip -512:3071 -x 8 -p P2 hr.nii lr8.nii
ct-sr --release -x 8 --dry-run lr8.nii no.nii >out; has out 'ct-ddnm .*--sigma-y=0.0025 ' 'release, 8-fold'
has out '^ct-upsample .*--method=linear --expert=zoom=yes ' 'the release zooms'
has out '^ct-project .*--expert=cells=yes .*lr.nii' 'it projects samples as cells'
has out '^ct-ddnm .*--expert=range=bytes,channel-reduce=first ' 'its network sees 8 bits of one colour'
has out '^ct-nabgs .* --release ' 'its fit is its own'
ct-convert -q --type f32 hr.nii - | tail -c 131072 >whole.raw; ct-convert -q --raw 32x32x32:f32:4 whole.raw whole.nii; ct-degrade -q -x 4 -p release whole.nii own.nii; ct-sr --release --dry-run own.nii no.nii >out
has out "^ct-project --views=300 --window=-512:$(figure max whole.nii | cut -c1-5)" 'its window is the range of the CT'
exits 0 'a scan of the release is refined' ct-sr -q --release "$@" --keep own own.nii own-sr.nii
cp own-sr.nii own-1.nii; sh own/commands.sh >/dev/null 2>&1; cmp -s own-sr.nii own-1.nii; ok $? 'the commands make the same bytes of it'
ct-metrics -q whole.nii own-sr.nii >out; ok $? 'its voxels are taken for those of the CT'
ct-sr --paper -x 8 --dry-run lr8.nii no.nii >out; has out 'ct-ddnm .*--sigma-y=0.0015 ' 'paper, 8-fold'
has out '^# about [0-9.]* [sh] on [0-9]* threads, ' 'a dry run of the paper estimates its time'
has out '^ct-nabgs .*--factor=8 --paper ' 'with its rates'
# a scan that was not clipped before is clipped now, and that is said
ct-convert -q --type f32 lr.nii - | tail -c 2048 >raw
ct-convert -q --raw 8x8x8:f32:16 raw plain.nii
ct-project -n 2 -w -512:3071 --overshoot plain.nii plain.exr 2>err; has err 'does not say that it was clipped' 'told'
[ "$(figure min plain.exr)" = 0 ]; ok $? 'and clipped'
exits 2 'what is density has no overshoot' sh -c \
	'ct-fdk -q --quantity density p/lr-proj.exr d.nii 2>/dev/null; ct-project --overshoot d.nii no.exr'
# the scanner in a sidecar, as ct-sr reads it
cp lr.nii side.nii && printf '{"Modality": "CT", "Manufacturer": "ACME", "SliceThickness": 5, "ConvolutionKernel": "B30f"}' >side.json
exits 0 'a scan with a sidecar' ct-sr -q --paper --expert views=2,iterations=2,gaussians=20 --keep side side.nii side-sr.nii
ct-info side-sr.nii >out; has out 'ACME' 'the result of a scan with a sidecar names the scanner'
cp side-sr.nii side-1.nii; sh side/commands.sh >/dev/null 2>&1; cmp -s side-sr.nii side-1.nii; ok $? 'the commands read the sidecar likewise'
printf '{"Modality": "CT", "Manufacturer": "OTHER", "SliceThickness": 5}' >side.json
exits 0 'a sidecar that was changed is read again' ct-sr -q --paper --expert views=2,iterations=2,gaussians=20 --keep side side.nii side-sr.nii
ct-info side-sr.nii >out; has out 'OTHER' 'the result is that of the new sidecar'
done_testing
