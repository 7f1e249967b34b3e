#!/bin/sh
# Pictures and DICOM radiographs as stacks: their numbers, where they lie, and what is refused.
. "$srcdir/tests/tap.sh"
py() { PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-picture.py" "$@"; }
one() { ct-convert -f --radiograph "$@"; }
if ! python_with numpy,pydicom && ! python_with numpy; then skip 'radiographs' 'no numpy'; done_testing; fi

# DICOM
"$PY" -c 'import pydicom' 2>/dev/null && py radiographs && one intensity dx.dcm o.exr 2>err
if [ ! -e dx.dcm ]; then
	skip 'DICOM radiographs' 'no pydicom'
elif grep -q 'with-vtk' err; then
	skip 'DICOM radiographs' 'built without vtk-dicom'
else
	for f in dx one full cr rle sign pad1 slope down both; do
		exits 0 "$f" one intensity $f.dcm $f.exr; py holds $f.exr $f; ok $? 'has the grey values of pydicom'
	done
	exits 0 'a folder of one' one intensity folder o.exr; py holds o.exr folder; ok $? 'is read too'
	py lies dx.exr .15,0,0 0,0,-.2 0,-1000,0; ok $? 'ImagerPixelSpacing, rows first'
	py lies cr.exr .075,0,0 0,0,-.1 0,-1000,0; ok $? 'PixelSpacing where there is no other'
	exits 5 'neither' one intensity rf.dcm o.exr; has err 'rf.dcm: has no ImagerPixelSpacing or PixelSpacing; pass the size of a pixel by --pitch' 'is told'
	exits 0 '--pitch' one intensity --pitch .3,.4 rf.dcm rf.exr; py lies rf.exr .3,0,0 0,0,-.4 0,-1000,0; ok $? 'says it'
	py holds rf.exr rf; ok $? 'of the same pixels'
	exits 2 'a contradiction' one intensity --pitch .3 dx.dcm o.exr; has err '^ct-convert: --pitch: dx.dcm states its own pixel size, 0.15,0.2 mm' 'is one'
	exits 0 'several' one intensity dx.dcm one.dcm o.exr; py holds o.exr dx one; ok $? 'are views'
	exits 0 'line integrals' one integral --rescale 30,-2 dx.dcm o.exr; py holds o.exr 30+-2*dx; ok $? 'are made of grey values'
	no() { rm -f no.exr; exits "$1" "$2" one intensity "$2" no.exr; has err "^ct-convert: $2: $3" 'says why'; [ ! -e no.exr ]; ok $? 'and makes nothing'; }
	no 3 ct.dcm "modality is 'CT', and --radiograph takes CR, DX and RF"
	no 3 mr.dcm "modality is 'MR'"
	no 3 colour.dcm "PhotometricInterpretation is 'PALETTE COLOR', not grey"
	no 3 table.dcm 'ModalityLUTSequence: '
	no 3 zero.dcm 'RescaleSlope is 0'
	no 3 rgb.dcm 'SamplesPerPixel is 3'
	no 3 bits.dcm 'BitsStored is 0'
	no 3 huge.dcm '.*--expand'
	no 3 cut.dcm 'damaged: truncated'
	no 5 two.dcm 'holds 2 pictures, and --radiograph takes one of a file'
	no 5 flat.dcm 'ImagerPixelSpacing is '
	mkdir none; no 3 none 'no files in this folder'
	mkdir alone other; cp dx.dcm alone; cp mr.dcm other
	exits 3 'no volume' ct-convert alone/dx.dcm o.nii; has err "alone/dx.dcm: modality is 'DX', not CT; --radiograph of ct-convert makes a stack of it" 'is made of it'
	[ ! -e o.nii ]; ok $? 'and nothing else'
	exits 3 'of another' ct-convert other o.nii; has err "modality is 'MR', not CT (but see --units)" 'neither'
fi

# pictures
if ! "$PY" -c 'import PIL, tifffile' 2>/dev/null; then skip 'pictures' 'no PIL or no tifffile'; done_testing; fi
py pictures
one intensity a8.png o.exr 2>err
if grep -q 'with-oiio' err; then skip 'pictures' 'built without OpenImageIO'; done_testing; fi
for f in a8.png a16.png rgb.png colour.png palette.png alpha.png a16.tif big.tif a8.tif white.tif; do
	exits 0 "$f" one intensity $f o.exr; py holds o.exr ${f%.*}; ok $? 'has the grey values of numpy'
done
py lies o.exr 1,0,0 0,0,-1 0,-1000,0; ok $? 'on pixels of 1 mm, upright'
exits 0 'as is said' one intensity --pitch .2,.3 --orient LPS a8.png o.exr; py lies o.exr -.2,0,0 0,-.3,0 0,0,-1000; ok $? 'they lie'
exits 0 'several' one intensity a8.png a16.tif a8.png o.exr; py holds o.exr a8 a16 a8; ok $? 'are views, in their order'
exits 0 'line integrals' one integral f.tif o.exr; py holds o.exr f; ok $? 'floats are as stored'
exits 0 'of grey values' one integral --rescale 30,-2 a16.png o.exr; py holds o.exr 30+-2*a16; ok $? 'by a line'
ct-info o.exr >out; has out 'lineIntegral' 'and say so'
printf '\200\377' >two.raw; head -c 190 /dev/zero >>two.raw
exits 0 'raw ones too' one intensity --raw 16x12x1:u8:1 --rescale .003 two.raw two.raw o.exr
[ "$(ct-info o.exr | awk '$1 == "views" {print $2}')" = 2 ]; ok $? 'are two views'
for q in '' '-x 2'; do # what ct-ddnm reads of the picture itself
	exits 0 'ct-ddnm takes it' ct-ddnm -q -f ${q:--x 2} -n 1 a8.png d.exr
	one intensity a8.png s.exr; ct-ddnm -q -f ${q:--x 2} -n 1 s.exr e.exr; py same d.exr e.exr; ok $? 'as the picture'
	py lies d.exr .5,0,0 0,0,-.5 0,-1000,0; ok $? 'in the same place'
	break
done
exits 3 'a picture of two' ct-ddnm -q -x 2 -n 1 multi.tif no.exr; has err 'multi.tif: holds several pictures, not one' 'is not cut'
exits 3 'one beyond [0, 1]' ct-ddnm -q -x 2 -n 1 f.tif no.exr; has err 'f.tif: column 0, row 0: .* is not in \[0,1\]' 'is refused'
no() { rm -f no.exr; exits "$1" "$2" one intensity "$2" no.exr; has err "^ct-convert: $2: $3" 'says why'; [ ! -e no.exr ]; ok $? 'and makes nothing'; }
no 3 multi.tif 'holds several pictures, not one'
no 3 f.tif '--radiograph: pixel 0,0 is .*, no grey value from 0 to 1'
no 6 nan.tif 'voxel (0,0,0) is NaN'
no 3 text.png 'not a NIfTI file, nor MetaImage or NRRD'
no 3 cut.png '[A-Z]'
[ "$(wc -l <err)" -eq 1 ]; ok $? 'in one line'
no 3 none.png 'No such file'
exits 5 'sizes' one intensity a8.png small.png no.exr; has err 'small.png: has 16x6 pixels, but a8.png has 16x12' 'are one'
exits 3 'a volume' ct-convert a8.png no.nii; has err 'a8.png: a picture, not a volume; --radiograph' 'is none'
exits 2 'no slope' one intensity --rescale 0 a8.png no.exr
exits 2 'no size' one intensity --pitch 0 a8.png no.exr; has err 'pitch: 0 is not positive' 'in words'
ct-convert -q --raw 16x12x1:u8:1 --units other two.raw v.nii
for o in --pitch=1 --rescale=1 --orient=LPS; do exits 2 "$o of a volume" one integral $o v.nii no.exr; has err "${o%=*}: not with v.nii, a volume that states it itself" 'is refused'; done
exits 0 'a volume beside' one integral v.nii a8.png o.exr

# the reader of pictures is a program of its own, beside ct-convert or installed
if command -v ldd >/dev/null; then
	! ldd "$(command -v ct-convert)" | grep -q OpenImageIO; ok $? 'what reads no picture does not load its libraries'
fi
mkdir -p to/bin to/libexec/ctsr; cp "$(command -v ct-convert)" to/bin
exits 0 'beside it' one intensity a8.png o.exr
to/bin/ct-convert -f --radiograph intensity a8.png o.exr 2>err; code=$?
if grep -q ct-picture err; then [ $code -eq 1 ] && grep -q 'ct-picture: is not installed' err; ok $? 'none is told'; else skip 'none is told' 'one is installed'; fi
cp "$(command -v ct-picture)" to/libexec/ctsr; exits 0 'installed' to/bin/ct-convert -f --radiograph intensity a8.png o.exr; py holds o.exr a8; ok $? 'it is the same'
printf '#!/bin/sh\nkill -9 $$\n' >to/bin/ct-picture; chmod +x to/bin/ct-picture
exits 3 'a picture that kills it' to/bin/ct-convert --radiograph intensity a8.png no.exr; has err 'a8.png: the picture cannot be decoded: it kills its reader' 'is told'
printf '#!/bin/sh\nexit 7\n' >to/bin/ct-picture; exits 7 'no memory' to/bin/ct-convert --radiograph intensity a8.png no.exr
printf '#!/bin/sh\nhead -c 510 /dev/zero\n' >to/bin/ct-picture; exits 3 'a picture that breaks off' to/bin/ct-convert --radiograph intensity a8.png no.exr; has err 'cannot be decoded$' 'is told'
exits 2 'ct-picture alone' ct-picture; has err 'reads a picture for ct-convert' 'says what it is for'
[ ! -e no.exr ]; ok $? 'nothing was made'
mkdir hostile; tar -xf "$srcdir/tests/fuzz/corpus/image.tar" -C hostile
for f in hostile/*; do
	ct-convert -q -f --radiograph integral "$f" o.exr 2>err; code=$?
	case $code in 0|3|6|7) ;; *) echo "$f $code"; cat err ;; esac
	n=$((${n:-0} + 1)); [ $n -lt 20 ] || break
done >wrong
[ ! -s wrong ]; ok $? 'hostile ones are pictures or errors'; sed 's/^/# /' wrong
done_testing
