#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-convert: pipes, gzip, raw voxels, axes, resampling, cubes; nibabel and nifti_tool as judges.
. "$srcdir/tests/tap.sh"
# raw voxels 4x3x2: i16, value = 100 k + 10 j + i
for v in 0 1 2 3 10 11 12 13 20 21 22 23 100 101 102 103 110 111 112 113 120 121 122 123; do
	# shellcheck disable=SC2059
	printf "\\$(printf %03o "$v")\\000"
done >a.raw
raw='--raw 4x3x2:i16:1,2,3'
# shellcheck disable=SC2086
exits 0 'raw voxels are read' ct-convert $raw --rescale 1,-1024 a.raw a.nii
exits 0 'NIfTI is copied through a pipe' sh -c 'cat a.nii | ct-convert - - | cat >b.nii'
exits 0 'gzip is written' ct-convert a.nii a.nii.gz
gzip -t a.nii.gz; ok $? 'and is gzip'
mv a.nii.gz misnamed.nii
exits 0 'gzip is read whatever its name' ct-convert misnamed.nii c.nii
tail -c 48 a.nii >va; tail -c 48 b.nii >vb; tail -c 48 c.nii >vc
cmp -s va vb && cmp -s va vc; ok $? 'the voxels are the same'
{ head -c 360 a.nii | gzip -c; tail -c +361 a.nii | gzip -c; } >two.nii.gz
exits 0 'gzip of two members is read' ct-convert two.nii.gz two.nii
tail -c 48 two.nii >vtwo; cmp -s va vtwo; ok $? 'the second like the first'
{ gzip -c a.nii; head -c 700 /dev/zero; } >padded.nii.gz
exits 0 'zeros after the last member are padding' ct-convert padded.nii.gz padded.nii
{ head -c 360 a.nii | gzip -c; head -c 50 /dev/zero; tail -c +361 a.nii | gzip -c; } >broken.nii.gz
exits 3 'not before it' ct-convert broken.nii.gz d.nii
for mask in 027 000; do (umask $mask; ct-convert -f a.nii "mode$mask.nii"); done
[ "$(stat -c %a mode027.nii)" = 640 ] && [ "$(stat -c %a mode000.nii)" = 666 ]
ok $? 'what is written may be read by those that umask allows'
exits 4 'an existing file is kept' ct-convert a.nii b.nii
exits 0 '--force writes it' ct-convert -f a.nii b.nii
exits 2 'a name of another format is refused' ct-convert a.nii a.mgz
# shellcheck disable=SC2086
exits 3 'too many raw bytes' sh -c 'cat a.raw a.raw >long.raw; ct-convert --raw 4x3x2:i16:1 long.raw d.nii'
exits 3 'too few raw bytes' ct-convert --raw 4x3x3:i16:1 a.raw d.nii
exits 2 'raw needs a spacing' ct-convert --raw 4x3x2:i16 a.raw d.nii
exits 2 'an unknown raw type' ct-convert --raw 4x3x2:i12:1 a.raw d.nii
exits 2 'axes that are none' ct-convert --raw 4x3x2:i16:1 --orient LLS a.raw d.nii
exits 2 'rescale without raw' ct-convert --rescale 2 a.nii d.nii
exits 2 'a series without DICOM' ct-convert --series 1 a.nii d.nii
head -c 370 a.nii >short.nii
exits 3 'a truncated file' ct-convert short.nii d.nii
exits 3 'an empty file' ct-convert /dev/null d.nii
printf 'hello, this is no volume' >text
exits 3 'a text' ct-convert text d.nii
has err 'text: not a NIfTI file' 'says which and why'
[ ! -e d.nii ]; ok $? 'no file is left by failures'
if [ -w /dev/full ]; then
	exits 4 'a full disk' ct-convert a.nii /dev/full
	exits 4 'a full disk behind standard output' sh -c 'ct-convert a.nii - >/dev/full'
fi
exits 4 'a folder that is not there' ct-convert a.nii none/d.nii
printf '\000\000\300\177\000\000\200\077' >nan.raw
exits 6 'NaN is refused' ct-convert --raw 2x1x1:f32:1 nan.raw d.nii
ls -A | grep -q '^d\.nii'; [ $? -eq 1 ]; ok $? 'nor a temporary one'
no() { exits 2 "$1" ct-convert $2 a.raw d.nii; has err "$3" "$3"; } # no NAME ARGS WORDS
no 'raw without a type' '--raw 4x3x2' "'4x3x2' is not WxHxD:TYPE:X,Y,Z"
no 'no size' '--raw 4x3x2:i16:1,0,1' 'raw: the voxel size 1,0,1 is not positive'
no 'nothing left' '--raw 4x3x2:i16:1 --rescale 0' 'rescale: a factor of 0'
exits 2 '.nii.gz is no name' ct-convert a.nii .nii.gz
exits 0 'what is no file needs no name' ct-convert -f a.nii /dev/null
# three numbers of the operator go with their axes, and go where voxels change
ct-phantom -q --size 24x24x24 --spacing 2,3,6 sphere p.nii && ct-degrade -q -x 4,2,1 p.nii q.nii
ct-convert -q --reorient SRA q.nii r.nii && ct-info r.nii >info; has info '^  factor  *1,4,2$' 'factors'
has info '^  sigma  *0,1.69865806,0.84932903$' 'and blurs'; has info '^orientation  *SRA$' 'with their axes'
ct-convert -q --iso 5 q.nii i.nii && ct-info i.nii >info
! grep -q '^  \(factor\|sigma\|decimate\)' info; ok $? 'none of other voxels'; has info '^size  *10 14 29$' 'as many as fit'
has info '^centre-mm  *0 0 0$' 'about the same centre'
ct-phantom -q --size 8x8x8 --spacing 4 ellipsoids p4.nii; ct-convert -q --iso 4 p4.nii same.nii
[ "$(tail -c 2048 p4.nii | cksum)" = "$(tail -c 2048 same.nii | cksum)" ]; ok $? '--iso of the same size changes nothing'
head -c 64 /dev/zero | tr '\0' '2' >grey.raw
exits 0 'a cube of grey values' ct-convert --units other --raw 4x4x4:u8:1,1,1 --cube 6 grey.raw grey.nii
ct-info grey.nii >info; has info '^min  *0$' 'is padded with 0, not with air'
exits 2 'too many voxels' ct-convert --iso 0.0001 --cube 8 q.nii d.nii; has err 'iso 0.0001 makes .* voxels along an axis' 'says so'
if command -v nifti_tool >/dev/null 2>&1; then
	nifti_tool -check_hdr -infiles a.nii >check 2>&1; grep -q 'IS GOOD' check; ok $? 'nifti_tool: header'
	nifti_tool -check_nim -infiles a.nii >check 2>&1; grep -q 'IS GOOD' check; ok $? 'nifti_tool: image'
else
	skip 'nifti_tool: header' 'no nifti_tool'
fi
if python_with nibabel; then
	"$PY" "$srcdir/tests/t-convert.py"
	ok $? 'nibabel agrees'
else
	skip 'nibabel agrees' 'no nibabel'
fi
done_testing
