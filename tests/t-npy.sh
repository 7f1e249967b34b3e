#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-convert --scanner: numpy projections with a scanner file become a stack.
. "$srcdir/tests/tap.sh"
cat >scan.json <<'JSON'
{"mode": "cone", "DSO": 1000, "DSD": 1500, "nDetector": [3, 4], "dDetector": [2.0, 1.5],
 "totalAngle": 180, "startAngle": 10, "numTrain": 2}
JSON
npy() { # npy DESCR ORDER SHAPE: header of version 1, 128 bytes
	printf '\223NUMPY\001\000\166\000'
	printf "{'descr': '%s', 'fortran_order': %s, 'shape': %s, }%117s" "$1" "$2" "$3" '' |
		head -c 117; printf '\n'
}
bytes() { i=0; while [ $i -lt "$1" ]; do printf '\001'; i=$((i + 1)); done; }
{ npy '|u1' False '(2, 3, 4)'; bytes 24; } >a.npy
exits 0 'numpy projections of bytes are read' ct-convert --scanner scan.json a.npy a.exr
exits 0 'numpy projections become a stack' ct-info a.exr
has out '2 views\|views *2' 'numpy projections of two views are two views'
sed 's/"numTrain"/"nVoxel": [4, 5, 6], "sVoxel": [40, 50, 30], "numTrain"/' scan.json >grid.json
exits 0 'a scanner file of a volume is taken' ct-convert -f --scanner grid.json a.npy g.exr
ct-info g.exr >out; has out 'volume.size *4,5,6' 'the stack notes the voxels of the scanner file'
has out 'volume.affine *10,0,0,-15,0,10,0,-20,0,0,5,-12.5' 'the stack notes where the volume lies'
sed 's/\[4, 5, 6\]/[4, 5.5, 6]/' grid.json >half.json
exits 3 'half a voxel in the scanner file is refused' ct-convert --scanner half.json a.npy b.exr
has err 'nVoxel' 'the error of half a voxel names nVoxel'
sed 's/\[40, 50/[0, 50/' grid.json >flat.json
exits 3 'a grid without width is refused' ct-convert --scanner flat.json a.npy b.exr
has err 'a voxel of 0 mm' 'the error of a voxel of 0 mm says so'
ct-convert --scanner scan.json - - <a.npy >pipe.exr 2>e; [ -s pipe.exr ]; ok $? 'numpy projections are read from a pipe'
exits 2 'numpy projections to a volume are refused' ct-convert --scanner scan.json a.npy a.nii
exits 2 'numpy projections are not resampled' ct-convert --scanner scan.json --iso 1 a.npy b.exr
for bad in "|u1;True;(2, 3, 4)" "|c8;False;(2, 3, 4)" "|u1;False;(2, 3)" "|u1;False;(2, 3, 4, 1)" \
	"|u1;False;(0, 3, 4)" "|u1;False;(2, 3, 99999999999999999999)" "<f4;False;(2, 3, 4)" \
	"<f8;False;(2000000000, 2000000000, 2000000000)"; do
	IFS=';' read -r d o s <<-EOF
		$bad
	EOF
	{ npy "$d" "$o" "$s"; bytes 24; } >b.npy
	exits 3 "refused: $bad" ct-convert --scanner scan.json b.npy b.exr
done
{ npy '|u1' False '(4, 3, 2)'; bytes 24; } >b.npy
exits 5 'not the detector of the scanner file' ct-convert --scanner scan.json b.npy b.exr
has err '4 of 2x3' 'the error of another detector names both sizes'
printf 'NUMPY' >b.npy; exits 3 'a file that is not numpy is refused' ct-convert --scanner scan.json b.npy b.exr
head -c 60 a.npy >b.npy; exits 3 'numpy cut in its header is refused' ct-convert --scanner scan.json b.npy b.exr
[ ! -e b.exr ]; ok $? 'numpy that was refused leaves nothing'
if python_with numpy; then
	"$PY" - <<-'EOF'
		import numpy as np
		x = np.arange(24).reshape(2, 3, 4) * 0.25
		for name, t in (("f4", "<f4"), ("f8", ">f8"), ("i2", ">i2"), ("f2", "<f2")):
		    np.save(name, (x * 4 if name == "i2" else x).astype(t))
		np.save("nan", np.full((2, 3, 4), np.nan, "f4"))
	EOF
	exits 0 'numpy of float is read' ct-convert --scanner scan.json f4.npy f4.exr
	exits 0 'numpy of double, big-endian, is read' ct-convert --scanner scan.json f8.npy f8.exr
	exits 0 'numpy of half is read' ct-convert --scanner scan.json f2.npy f2.exr
	exits 0 'numpy of short is read with --rescale' ct-convert --rescale 0.25 --scanner scan.json i2.npy i2.exr
	if command -v oiiotool >/dev/null 2>&1; then
		for f in f4 f8 i2 f2; do oiiotool --dumpdata $f.exr | grep Pixel >d-$f; done
		[ -s d-f4 ] && cmp -s d-f4 d-f8 && cmp -s d-f4 d-i2 && cmp -s d-f4 d-f2; ok $? 'all four the same numbers'
		grep -q 'Pixel (3, 2).* 2.75' d-f4; ok $? 'rows of numpy are rows of the stack'
	else
		skip 'the same numbers' 'no oiiotool'
	fi
	exits 6 'a NaN in numpy is refused' ct-convert --scanner scan.json nan.npy b.exr
else
	skip 'numpy files' 'no numpy'
fi
done_testing
