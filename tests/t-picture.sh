#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Pictures and DICOM radiographs as stacks.
. "$srcdir/tests/tap.sh"

# One plane as a stack of one view, of grey values or of line integrals.
awk 'BEGIN {for (i = 0; i < 192; i++) printf "%c", 1 + i % 100}' >g.raw
raw() { ct-convert -f --raw 16x12x1:u8:0.2,0.3,1 "$@"; }
exits 0 'ct-convert makes line integrals of a plane' raw --rescale 0.5,1 --radiograph integral g.raw i.exr
exits 0 'ct-info reads a radiograph of line integrals' ct-info i.exr
has out '16x12' 'a radiograph has the columns and rows of its plane'
has out 'lineIntegral' 'a radiograph of integrals records the quantity lineIntegral'
exits 0 'ct-convert makes grey values of a plane' raw --rescale 0.01 --radiograph intensity --orient RIP g.raw g.exr
ct-info g.exr >out; has out 'intensity' 'a radiograph of grey values records the quantity intensity'
exits 3 'grey values above 1 are refused with status 3' raw --rescale 0.02 --radiograph intensity g.raw o.exr
has err 'g.raw: --radiograph: pixel 2,3 is 1.02, no grey value from 0 to 1' 'the error of a grey value above 1 gives pixel and value'
exits 5 'a volume of two planes is refused with status 5' ct-convert --raw 16x6x2:u8:1 --radiograph integral g.raw o.exr
has err 'g.raw: --radiograph: has 2 planes, not one' 'the error of a volume of two planes gives their number'
exits 2 '--radiograph with a volume as output is refused with status 2' raw --radiograph integral g.raw o.nii
[ ! -e o.exr ]; ok $? 'refused radiographs leave no output'
raw --rescale 0.01 g.raw g.mha
exits 0 '--radiograph accepts a plane of MetaImage' ct-convert --radiograph intensity g.mha m.exr
exits 0 'ct-ddnm refines a radiograph of grey values' ct-ddnm -q -x 2 -n 1 g.exr d.exr
exits 0 'ct-ddnm refines a radiograph into a PNG picture' ct-ddnm -q -x 2 -n 1 g.exr d.png
if pictures; then
	exits 0 '--radiograph accepts a PNG picture' ct-convert --radiograph intensity d.png o.exr
	exits 0 'ct-ddnm refines its own PNG picture' ct-ddnm -q -x 2 -n 1 d.png dd.png
fi
if command -v python3 >/dev/null; then
	cat >check.py <<-'END'
		import sys
		sys.path.insert(0, sys.argv[1])
		import exr
		assert exr.read('i.exr') == [[1 + .5 * (1 + i % 100) for i in range(192)]]
		for name, u, v, source in (('i.exr', (-.2, 0, 0), (0, -.3, 0), (0, 0, -1000)),
		                           ('g.exr', (.2, 0, 0), (0, 0, -.3), (0, -1000, 0)),
		                           ('m.exr', (-.2, 0, 0), (0, -.3, 0), (0, 0, -1000))):
		    had = exr.header(open(name, 'rb').read(), 8)[0]
		    for key, want in (('U', u), ('V', v), ('Centre', (0, 0, 0))):
		        assert [float(x) for x in had['ct:det' + key].split(b',')] == list(want), (name, key)
		    assert [float(x) for x in had['ct:source'].split(b',')] == list(source), name
		    assert had['ct:beam'] == b'parallel'
	END
	exits 0 'pixels lie row after row where the plane lies' python3 check.py "$srcdir/tests"
else
	skip 'pixels lie row after row where the plane lies' 'no python3'
fi

# Pictures and DICOM radiographs as stacks: their numbers, where they lie, and what is refused.
part read
py() { called "$srcdir/tests/t-picture.py" "$@"; }
one() { ct-convert -f --radiograph "$@"; }
if ! python_with numpy,pydicom && ! python_with numpy; then skip 'pictures and DICOM radiographs become stacks' 'no numpy'; done_testing; fi
calls numpy exr PIL.Image tifffile pydicom

# DICOM
"$PY" -c 'import pydicom' 2>/dev/null && py radiographs && one intensity dx.dcm o.exr 2>err
if [ ! -e dx.dcm ]; then
	skip 'DICOM radiographs become stacks of views' 'no pydicom'
elif grep -q 'with-vtk' err; then
	skip 'DICOM radiographs become stacks of views' 'built without vtk-dicom'
else
	for f in dx one full cr rle sign pad1 slope down both; do
		exits 0 "radiograph $f is read by ct-convert" one intensity $f.dcm $f.exr; py holds $f.exr $f; ok $? "radiograph $f has the grey values of pydicom"
	done
	exits 0 'a folder of one radiograph is read' one intensity folder o.exr; py holds o.exr folder; ok $? 'a folder of one radiograph has its grey values'
	py lies dx.exr .15,0,0 0,0,-.2 0,-1000,0; ok $? 'a radiograph lies by its ImagerPixelSpacing, rows first'
	py lies cr.exr .075,0,0 0,0,-.1 0,-1000,0; ok $? 'a radiograph without ImagerPixelSpacing lies by its PixelSpacing'
	exits 5 'a radiograph without a pixel size is refused with status 5' one intensity rf.dcm o.exr; has err 'rf.dcm: has no ImagerPixelSpacing or PixelSpacing; pass the size of a pixel by --pitch' 'the error of a radiograph without pixel size names --pitch'
	exits 0 '--pitch is taken for a radiograph without pixel size' one intensity --pitch .3,.4 rf.dcm rf.exr; py lies rf.exr .3,0,0 0,0,-.4 0,-1000,0; ok $? '--pitch gives a radiograph its pixel size'
	py holds rf.exr rf; ok $? '--pitch changes no pixel of a radiograph'
	exits 2 '--pitch that contradicts a radiograph is refused' one intensity --pitch .3 dx.dcm o.exr; has err '^ct-convert: --pitch: dx.dcm states its own pixel size, 0.15,0.2 mm' 'the error of a contradicting --pitch says both'
	exits 0 'several radiographs become one stack' one intensity dx.dcm one.dcm o.exr; py holds o.exr dx one; ok $? 'several radiographs become views in their order'
	exits 0 'a radiograph becomes line integrals with --rescale' one integral --rescale 30,-2 dx.dcm o.exr; py holds o.exr 30+-2*dx; ok $? '--rescale maps grey values of radiographs to line integrals'
	no() { rm -f no.exr; exits "$1" "radiograph $2 is refused with status $1" one intensity "$2" no.exr; has err "^ct-convert: $2: $3" "the error of radiograph $2 says why"; [ ! -e no.exr ]; ok $? "the refused radiograph $2 makes no output"; }
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
	exits 3 'a radiograph is refused as a volume' ct-convert alone/dx.dcm o.nii; has err "alone/dx.dcm: modality is 'DX', not CT; --radiograph of ct-convert makes a stack of it" 'the error of a radiograph as a volume names --radiograph'
	[ ! -e o.nii ]; ok $? 'a radiograph that is refused as a volume makes no output'
	exits 3 'an MR image is refused as a volume' ct-convert other o.nii; has err "modality is 'MR', not CT (but see --units)" 'the error of an MR image as a volume names --units'
fi

# pictures
if ! "$PY" -c 'import PIL, tifffile' 2>/dev/null; then skip 'pictures become stacks of views' 'no PIL or no tifffile'; done_testing; fi
py pictures
one intensity a8.png o.exr 2>err
if grep -q 'with-oiio' err; then skip 'pictures become stacks of views' 'built without OpenImageIO'; done_testing; fi
for f in a8.png a16.png rgb.png colour.png palette.png alpha.png a16.tif big.tif a8.tif white.tif white16.tif large.tif tiled.tif; do
	exits 0 "picture $f is read by ct-convert" one intensity $f o.exr; py holds o.exr ${f%.*}; ok $? "picture $f has the grey values of numpy"
done
py lies o.exr 1,0,0 0,0,-1 0,-1000,0; ok $? 'a picture lies upright on pixels of 1 mm'
exits 0 '--pitch and --orient are taken for a picture' one intensity --pitch .2,.3 --orient LPS a8.png o.exr; py lies o.exr -.2,0,0 0,-.3,0 0,0,-1000; ok $? 'a picture lies as --pitch and --orient say'
exits 0 'several pictures become one stack' one intensity a8.png a16.tif a8.png o.exr; py holds o.exr a8 a16 a8; ok $? 'several pictures are views in their order'
exits 0 'a floating picture becomes line integrals' one integral f.tif o.exr; py holds o.exr f; ok $? 'line integrals of a floating picture are as stored'
exits 0 'a picture of grey values becomes line integrals' one integral --rescale 30,-2 a16.png o.exr; py holds o.exr 30+-2*a16; ok $? '--rescale maps grey values of a picture by a line'
ct-info o.exr >out; has out 'lineIntegral' 'a stack of line integrals is noted as lineIntegral'
printf '\200\377' >two.raw; head -c 190 /dev/zero >>two.raw
exits 0 'raw planes are read as radiographs' one intensity --raw 16x12x1:u8:1 --rescale .003 two.raw two.raw o.exr
[ "$(ct-info o.exr | awk '$1 == "views" {print $2}')" = 2 ]; ok $? 'two raw planes become two views'
for q in '' '-x 2'; do # what ct-ddnm reads of the picture itself
	exits 0 'ct-ddnm reads a picture without ct-convert' ct-ddnm -q -f ${q:--x 2} -n 1 a8.png d.exr
	one intensity a8.png s.exr; ct-ddnm -q -f ${q:--x 2} -n 1 s.exr e.exr; py same d.exr e.exr; ok $? 'ct-ddnm reads a picture as ct-convert does'
	py lies d.exr .5,0,0 0,0,-.5 0,-1000,0; ok $? 'ct-ddnm puts a picture in its place'
	break
done
exits 3 'ct-ddnm refuses a TIFF of two pictures' ct-ddnm -q -x 2 -n 1 multi.tif no.exr; has err 'multi.tif: holds several pictures, not one' 'the error of a TIFF of two pictures says several'
exits 3 'ct-ddnm refuses a picture beyond [0, 1]' ct-ddnm -q -x 2 -n 1 f.tif no.exr; has err 'f.tif: column 0, row 0: .* is not in \[0,1\]' 'the error of a picture beyond [0, 1] names the pixel'
no() { rm -f no.exr; exits "$1" "picture $2 is refused with status $1" one intensity "$2" no.exr; has err "^ct-convert: $2: $3" "the error of picture $2 says why"; [ ! -e no.exr ]; ok $? "the refused picture $2 makes no output"; }
no 3 multi.tif 'holds several pictures, not one'
no 3 double.tif 'floats of 64 bits: save it in 32 bits'
no 3 f.tif '--radiograph: pixel 0,0 is .*, no grey value from 0 to 1'
no 6 nan.tif 'voxel (0,0,0) is NaN'
no 3 text.png 'not a NIfTI file, nor MetaImage or NRRD'
no 3 cut.png '[A-Z]'
[ "$(wc -l <err)" -eq 1 ]; ok $? 'the error of a cut picture is one line'
no 3 none.png 'No such file'
exits 5 'pictures of two sizes are refused with status 5' one intensity a8.png small.png no.exr; has err 'small.png: has 16x6 pixels, but a8.png has 16x12' 'the error of pictures of two sizes names both'
exits 3 'a picture is refused as a volume' ct-convert a8.png no.nii; has err 'a8.png: a picture, not a volume; --radiograph' 'the error of a picture as a volume names --radiograph'
exits 2 'a slope of 0 in --rescale is refused' one intensity --rescale 0 a8.png no.exr
exits 2 'a pitch of 0 is refused as usage' one intensity --pitch 0 a8.png no.exr; has err 'pitch: 0 is not positive' 'the error of a pitch of 0 says not positive'
ct-convert -q --raw 16x12x1:u8:1 --units other two.raw v.nii
for o in --pitch=1 --rescale=1 --orient=LPS; do exits 2 "$o is refused for a volume with status 2" one integral $o v.nii no.exr; has err "${o%=*}: not with v.nii, which is no picture that is read" "the error of ${o%=*} of a volume names the volume"; done
exits 0 'a volume beside a picture is read as views' one integral v.nii a8.png o.exr

# the reader of pictures is a program of its own, beside ct-convert or installed
if command -v ldd >/dev/null; then
	! ldd "$(command -v ct-convert)" | grep -q OpenImageIO; ok $? 'ct-convert is not linked to the libraries of pictures'
fi
mkdir -p to/bin to/libexec/ctsr; cp "$(command -v ct-convert)" to/bin
exits 0 'ct-picture is found beside ct-convert' one intensity a8.png o.exr
to/bin/ct-convert -f --radiograph intensity a8.png o.exr 2>err; code=$?
if grep -q ct-picture err; then [ $code -eq 1 ] && grep -q 'install the package ctsr-pictures' err; ok $? 'a missing ct-picture is named in the error'; else skip 'a missing ct-picture is named in the error' 'one is installed'; fi
{ head -c 128 /dev/zero; printf DICM; } >some.dcm; to/bin/ct-convert some.dcm no.nii 2>err; code=$?
if grep -q ctsr-dicom.so err; then [ $code -eq 1 ] && grep -q 'some.dcm: DICOM needs .*ctsr-dicom.so, which is not installed: install the package ctsr-dicom' err; ok $? 'DICOM without its module names the package to install'; else skip 'DICOM without its module names the package to install' 'one is installed'; fi
cp "$(command -v ct-picture)" to/libexec/ctsr; exits 0 'ct-picture is found where it is installed' to/bin/ct-convert -f --radiograph intensity a8.png o.exr; py holds o.exr a8; ok $? 'an installed ct-picture gives the same grey values'
printf '#!/bin/sh\nkill -9 $$\n' >to/bin/ct-picture; chmod +x to/bin/ct-picture
exits 3 'a picture that kills its reader is refused with status 3' to/bin/ct-convert --radiograph intensity a8.png no.exr; has err 'a8.png: the picture cannot be decoded: it kills its reader' 'the error of a killed reader names the picture'
printf '#!/bin/sh\nexit 7\n' >to/bin/ct-picture; exits 7 'a reader of pictures without memory ends with status 7' to/bin/ct-convert --radiograph intensity a8.png no.exr
printf '#!/bin/sh\nhead -c 510 /dev/zero\n' >to/bin/ct-picture; exits 3 'a picture that breaks off is refused with status 3' to/bin/ct-convert --radiograph intensity a8.png no.exr; has err 'cannot be decoded$' 'the error of a picture that breaks off says undecodable'
real=$(command -v ct-picture)
printf '#!/bin/sh\necho >>starts\nexec "%s" "$@"\n' "$real" >to/bin/ct-picture
exits 0 'several pictures are read by one reader' to/bin/ct-convert -f --radiograph intensity a8.png a16.tif a8.png o.exr; py holds o.exr a8 a16 a8 && [ "$(wc -l <starts)" -eq 1 ]; ok $? 'three pictures start one reader'
cp "$(command -v ct-train)" to/bin; rm starts
to/bin/ct-train -q -a model_channels=32,channel_mult=1 -p 8 -n 0 --validate a16.tif none.safetensors a8.png a16.tif && rm none.safetensors* && [ "$(wc -l <starts)" -eq 1 ]
ok $? 'pictures named one by one and those held out start one reader'
printf '#!/bin/sh\nkill -INT 0\nexec "%s" "$@"\n' "$real" >to/bin/ct-picture # as a terminal does: both are told
exits 0 'a picture is read where standard input and output are closed' sh -c 'ct-convert -f --radiograph intensity a8.png o.exr <&- >&-'
mkdir pics; cp a8.png a16.tif pics
exits 75 'an interrupt while pictures are read stops the command' setsid -w to/bin/ct-train -q -a model_channels=32,channel_mult=1 -p 8 -n 1 none.safetensors pics
exits 2 'ct-picture alone is refused as usage' ct-picture; has err 'reads pictures for other commands' 'ct-picture alone says what it is for'
[ ! -e no.exr ]; ok $? 'pictures that were refused leave no output'
mkdir hostile; tar -xf "$srcdir/tests/fuzz/corpus/image.tar" -C hostile
for f in hostile/*; do
	ct-convert -q -f --radiograph integral "$f" o.exr 2>err; code=$?
	case $code in 0|3|6|7) ;; *) echo "$f $code"; cat err ;; esac
	n=$((${n:-0} + 1)); [ $n -lt 20 ] || break
done >wrong
[ ! -s wrong ]; ok $? 'every input of the fuzz corpus is a picture or an error'; sed 's/^/# /' wrong
done_testing
