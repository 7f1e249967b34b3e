#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-info says what is in a file, whatever it is.
. "$srcdir/tests/tap.sh"
line() { grep -q "^$1  *$2\$" out; ok $? "$3"; } # line NAME VALUE WHAT
ct-phantom --size 20x24x28 --spacing 2,2,3 sphere v.nii.gz || exit 99
exits 0 'ct-info reports a volume of compressed NIfTI' ct-info v.nii.gz
line kind volume 'the kind of a NIfTI file is volume'
line size '20 24 28' 'a volume has its size in the report'
line spacing-mm '2 2 3' 'a volume has its spacing in the report'
line extent-mm '40 48 84' 'a volume has its extent in the report'
line orientation RAS 'a volume has its orientation in the report'
line nan 0 'a volume has its number of NaNs in the report'
has out 'ct-phantom ' 'a volume has its history in the report'
! grep -q '^blur' out; ok $? 'a volume has no estimate unless -e asks for it'
hash=$(grep '^hash ' out)
gunzip -c v.nii.gz | ct-info - >out 2>err; ok $? 'ct-info reports a volume from a pipe'
line kind volume 'the kind of a volume from a pipe is volume'
[ "$(grep '^hash ' out)" = "$hash" ]; ok $? 'the hash is that of the content, not of the gzip'
mkfifo fifo
cat v.nii.gz >fifo &
exits 0 'ct-info reports a volume from a fifo' ct-info fifo
wait $!; ok $? 'a fifo is read to its end'
ct-phantom --size 96x96x96 --spacing 1 sphere hi.nii.gz || exit 99
for p in P1 P3; do
	ct-degrade -x 3 -p $p hi.nii.gz $p.nii.gz || exit 99
	exits 0 "$p: ct-info -e estimates the operator" ct-info -e -x 3 $p.nii.gz
	case $p in P1) w=band-limited ;; *) w=point-sampled ;; esac
	has out "^assumed .* $w (9. % sure)" "$p: the scan is estimated as $w"
	has out '^noise-hu ' "$p: the report gives the noise"
	[ $p = P3 ] || awk '/^assumed/ {split($3, mm, ",")} /^profile-spread/ {for (a = 1; a <= 3; a++) if ((mm[a] / (2.3548 * 3 * $(a + 1)) - 1) ^ 2 > 1e-5) bad = 1; n = NF} END {exit bad || n != 4}' out
	ok $? "$p: widths are those of Gaussians of that spread, in mm"
done
has out '^assumed  *profile .* mm wide (FWHM) along x,y,z, uncertain by .*; measured on edges$' 'the report says what ct-sr would assume of the profile'
has out '^assumed  *profile [0-9.,]* mm wide .* uncertain by 100 %, so 3. % less blur is undone' 'lines of constant air are measured where there are no others'
exits 0 'ct-info --operator accepts factors for each axis' ct-info --operator -x 3,3,1 P1.nii.gz
[ "$(grep -c '^edge-[xyz] ' out)" -eq 2 ]; ok $? '--operator gives the edges along the refined axes'
awk '/^edge-/ {n++; if (NF != 13 || $7 != -.5 || $8 != .5 || $6 >= -.6 || $9 <= .6) bad = 1} END {exit bad || !n}' out
ok $? 'an edge has 12 voxels with the steepest in the middle'
ct-degrade -x 1,1,4 --sigma 0,0,2.96 --decimate point --noise 10 hi.nii.gz wide.nii.gz || exit 99
exits 0 'ct-info -e estimates slices that overlap' ct-info -e -x 1,1,4 wide.nii.gz
has out '^assumed .* averaged over a voxel (6. % sure)' 'slices that overlap are assumed averaged over a voxel'
ct-degrade -x 1,1,8 --sigma 0 --decimate mean hi.nii.gz few.nii.gz || exit 99
exits 0 'ct-info -e estimates a scan of twelve slices' ct-info -e -x 1,1,8 few.nii.gz
has out '^assumed .* averaged over a voxel (75 % sure); too few edges: slices are assumed as thick as far apart$' 'twelve slices are reported as too few edges'
exits 2 'a factor below 1 is refused with status 2' ct-info -e -x 0.5 P1.nii.gz
exact sphere p.exr '--size 64x64x64' --views 30 --arc 360 --expert dso=800,dsd=1200 --det 40x30 \
	--expert pitch=2,offset=4,0 || exit 99
exits 0 'ct-info takes a volume and a stack' ct-info v.nii.gz p.exr
[ "$(grep -c '^file ' out)" -eq 2 ] && [ "$(grep -c '^$' out)" -eq 1 ] && [ "$(grep -B1 '^file  *p.exr' out | head -n 1)" = '' ]
ok $? 'reports of two files have a blank line between them'
exits 3 'an estimate of projections is refused with status 3' ct-info -e p.exr
exits 0 'ct-info reports a stack of projections' ct-info p.exr
line kind stack 'the kind of projections is stack'
line views 30 'a stack has its number of views in the report'
line size '40 30' 'a stack has columns and rows in the report'
line beam cone 'a stack has its beam in the report'
line dso-mm '800 800' 'the distance from source to isocentre comes from the vectors'
line dsd-mm '1200 1200' 'the distance from source to detector comes from the vectors'
line pitch-mm '2 2' 'a stack has its pitch in the report'
line offset-u-mm '4 4' 'a stack has the offset of its detector in the report'
line arc-deg 360 'a stack has its arc in the report'
line magnification 1.5 'a stack has its magnification in the report'
exits 0 'a volume and a stack are reported together' ct-info v.nii.gz p.exr
[ "$(grep -c '^file ' out)" -eq 2 ]; ok $? 'two files give two reports'
"$builddir/tests/t-ply" g.ply
exits 0 'ct-info reports a set of Gaussians' ct-info g.ply
line gaussians 500 'a set of Gaussians has their number in the report'
line activation prelu 'a set of Gaussians has their activation in the report'
line gamma 0.1 'a set of Gaussians has the slope of the activation in the report'
line grid '256 200 130' 'a set of Gaussians has its grid in the report'
# a header of 152 bytes, then 1 2 3 4 0.5 as F32
header='{"__metadata__":{"arch":"x\u001b[31m"},"a.w":{"dtype":"F32","shape":[2,2],"data_offsets":[0,16]},"b":{"dtype":"F32","shape":[],"data_offsets":[16,20]}}'
{ printf '\230\0\0\0\0\0\0\0%-152s' "$header"
	printf '\0\0\200\77\0\0\0\100\0\0\100\100\0\0\200\100\0\0\0\77'; } >w.safetensors
exits 0 'ct-info reports a file of tensors' ct-info w.safetensors
line tensors 2 'a file of tensors has their number in the report'
line parameters 5 'a file of tensors has the number of values in the report'
line '  arch' 'x?\[31m' 'metadata of a file of tensors cannot steer the terminal'
exits 0 'ct-info -v reports each tensor of a file' ct-info -v w.safetensors
has out '^  a.w  shape 2 2  min 1  max 4  mean 2.5$' 'a tensor has its shape and range in the report'
if command -v python3 >/dev/null; then
	ct-info --json -e -x 3 P1.nii.gz | python3 -c 'import json, sys
o = json.load(sys.stdin)
assert len(o["edges"]) == 3 and all(n > 100 for n in o["edges"]) and o["noise-sure-hu"] <= o["noise-hu"], o
assert all(0.3 < s < 0.6 for s in o["profile-spread-voxels"]) and all(0 < d < 0.2 for d in o["profile-deviation-voxels"]), o
assert all(0 <= q < 0.5 for q in o["profile-alias-probability"]), o'
	ok $? 'JSON of -e has edges, noise, spread and deviations'
	ct-info --json v.nii.gz p.exr w.safetensors >out && python3 - <<'END'
import json
v, p, w = json.load(open("out"))
assert v["size"] == [20, 24, 28] and v["affine"][2][2] == 3 and v["nan"] == 0, v
assert p["views"] == 30 and abs(p["dso-mm"][0] - 800) < 1e-9, p
assert w["metadata"]["arch"] == "x\x1b[31m" and w["parameters"] == 5, w
END
	ok $? 'JSON of several files is one array'
else
	skip 'JSON of several files is one array' 'no python3'
fi
head -c 3000 p.exr >cut.exr
if command -v python3 >/dev/null; then
	exits 3 'a damaged file among others ends with status 3' ct-info --json v.nii.gz cut.exr p.exr
	python3 -c 'import json; a = json.load(open("out")); assert [o["file"] for o in a] == ["v.nii.gz"], a'
	ok $? 'JSON of the files before a damaged one is whole'
	ct-info --json v.nii.gz | python3 -c 'import json, sys; assert json.load(sys.stdin)["file"] == "v.nii.gz"'
	ok $? 'JSON of one file is no array'
else
	skip 'JSON of the files before a damaged one is whole' 'no python3'
fi
exits 3 'a stack that is cut off is refused with status 3' ct-info cut.exr
has err '^ct-info: cut.exr: ' 'a stack that is cut off is named in the error'
{ head -c 128 /dev/zero; printf 'DICM'; head -c 300 /dev/zero; } >d.dcm
exits 3 'a DICOM file without a picture is refused with status 3' ct-info d.dcm
has err 'd.dcm: ' 'a DICOM file that is refused is named in the error'
printf 'hello' >t.txt
exits 3 'a text file is refused with status 3' ct-info t.txt
has err 'not a NIfTI, MetaImage, NRRD, EXR, PLY, safetensors or PyTorch' 'the error of a text file lists the formats that are read'
: >empty
exits 3 'ct-info refuses an empty file with status 3' ct-info empty
exits 3 'ct-info refuses an empty pipe with status 3' ct-info - </dev/null
mkdir none; exits 3 'ct-info refuses an empty folder with status 3' ct-info none
done_testing
