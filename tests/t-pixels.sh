#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# PixelData that are laid out in unusual ways are read as they are meant, or refused; none in silence as something else.
. "$srcdir/tests/tap.sh"
mkdir empty
ct-convert empty e.nii 2>err
if grep -q 'with-vtk' err; then skip 'pixels' 'built without vtk-dicom'; done_testing; fi
if ! python_with numpy || ! "$PY" -c 'import nibabel'; then skip 'pixels' 'no numpy or no nibabel'; done_testing; fi
py() { PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-pixels.py" "$@"; }
py make; ok $? 'the series of this test are made'
exits 0 'a plain series is converted' ct-convert plain plain.nii
py truth plain.nii
ok $? 'a plain series has the values and places that were written'
exits 0 'a series of 16 bits with metal is converted' ct-convert metal-16 metal-16.nii
exits 0 'a series of 8 bits is converted' ct-convert eight eight.nii
exits 0 'a series with an odd number of bytes is converted' ct-convert odd odd.nii
exits 0 'a series with padding values is converted' ct-convert padding padding.nii
same() { # same FOLDER NAME [OF]: it is the volume OF, plain.nii if there is none
	exits 0 "$2: the series is converted" ct-convert -f "$1" o.nii
	py check "${3:-plain}.nii" o.nii
	ok $? "$2: the voxels are those of the plain series"
}
no() { # no FOLDER NAME WORDS
	exits 3 "$2: refused with status 3" ct-convert -f "$1" d.nii
	has err "$3" "$2: the error gives the reason"
}
# the transfer syntax
same no-meta 'explicit VR without file meta information'
same no-meta-big 'big-endian without file meta information'
same no-meta-big/1.dcm 'one big-endian file without meta information stands for its series'
same no-meta-preamble 'a preamble, but no file meta information'
same meta-no-preamble 'file meta information without preamble'
for s in big jpeg deflated; do same inside-says-$s "another TransferSyntaxUID in the data set ($s) is ignored"; done
same ge 'little-endian with big-endian pixels, as GE writes it'
same deflated 'a deflated data set'
no rle-native 'fragments in a file that says it is not compressed' 'TransferSyntaxUID 1.2.840.10008.1.2.1 is not compressed, but PixelData is in fragments'
no rle-no-meta 'fragments without file meta information' 'no TransferSyntaxUID says how'
for s in jpeg rle; do same native-$s "PixelData of a known length in a file that says $s"; done
no syntax-1.2.840.10008.1.2.4.110 'JPEG XL' '1.2.840.10008.1.2.4.110 is not one that is read: JPEG XL lossless'
no syntax-1.2.840.10008.1.2.4.100 'MPEG2' 'is not one that is read: MPEG2'
no syntax-1.2.3.4 'an unknown transfer syntax' '1.2.3.4 is not one that is read: not known'
# the bits of a pixel
same high-15 'HighBit 15 of 12 bits with other bits below'
for n in '' -once; do
	same high-15-but-low$n "HighBit 15 of 12 bits where the numbers lie below$n"
	has err 'warning: HighBit is 15, but the numbers lie in the lower 12 bits' "HighBit 15 where the numbers lie below is told$n"
done
no high-15-both 'HighBit 15 of numbers that lie above in some slices and below in others' 'some slices have their numbers in the upper bits'
same high-3 'a HighBit below the bits stored'
same high-none 'a file without HighBit'
same signed '12 bits with the sign in the bits above'
same signed-zeros-above '12 bits with a sign and zeros above'
same overlay 'an overlay in the bits above'
same above 'the same bits above all numbers'
no signed-says-not 'negative numbers in a file that says they have no sign' \
	'PixelRepresentation is 0, but its number 6.* is -.* with a sign'
exits 0 '--units other reads numbers whose sign is doubtful' ct-convert -f --units other signed-says-not o.nii
exits 0 'metal that fills 16 bits is taken for no negative number' ct-convert -f saturated o.nii
same metal 'numbers that need more than BitsStored' metal-16
same metal-signed 'signed numbers that need more than BitsStored' metal-16
same wide '32 bits beyond what floats hold'
same wide-signed 'signed 32 bits beyond what floats hold'
same float 'FloatPixelData'
same double 'DoubleFloatPixelData'
same big-bytes '16 bits as bytes, big-endian'
same big-bytes-unturned '16 bits as bytes, big-endian, low byte first'
no big-bytes-full '16 bits as bytes where no value shows their order' 'VR OB in a big-endian file of 16 bits: the order of its bytes is not known'
no big-words-32 '32 bits as words, big-endian' 'VR OW in a big-endian file of 32 bits'
same eight-big '8 bits in words, big-endian' eight
same padding-lossy 'padding that lossy compression moved' padding
# the number of bytes
same odd-padded 'a byte of padding where their number is odd' odd
same two-more 'a word of zeros behind the pixels'
for n in rows-half columns-less allocated-8 two-more-not-zero four-more odd-three-more frame-less; do
	no $n "PixelData longer than the header says ($n)" 'PixelData has .* bytes; by Rows, Columns'
done
same end-padding 'Data Set Trailing Padding'
same end-rubbish 'rubbish at the end of the file'
for n in rows columns; do no $n-none "a picture without $n" 'Rows or Columns is 0 or absent'; done
no said-twice 'an element that is said twice with other values' 'element (0028,1053) is said twice, and not the same'
no said-behind 'an element that is said again behind PixelData' 'element (0028,1053) is said twice, and not the same'
same said-twice-same 'an element that is said twice with one value'
no thickness-twice 'an element of another group that is said twice' 'element (0018,0050) is said twice, and not the same'
same thickness-twice-same 'an element of another group that is said twice with one value'
no item-twice 'an element that is said twice in an item' 'element (0028,1052) is said twice, and not the same'
same items-two 'an element that is said once inside of a sequence and once outside'
no groups-twice 'a sequence of functional groups that is there twice' 'element (5200,9229) is said twice'
for n in twice and-floats; do no pixels-$n "two elements of pixels ($n)" 'it has two elements of pixels'; done
same pixels-behind-cut 'what begins as a second PixelData behind the pixels and is cut off'
no float-far 'FloatPixelData beyond what a CT has' 'a pixel of 1e+30 HU: no CT reaches that far'
# colours and tables
no palette 'a picture with a palette' "PhotometricInterpretation is 'PALETTE COLOR': colours"
no ybr 'a picture of one sample in YBR' 'YBR_FULL'
no table 'ModalityLUTSequence beside a slope' 'ModalityLUTSequence: a table of values is not read'
# compressed pixels
same rle 'RLE in one fragment'
same rle-two-fragments 'RLE in two fragments'
no rle-rows-half 'RLE of more pixels than Rows say' 'does not make 24 pixels'
no rle-twice 'RLE of twice the pixels' 'does not make 48 pixels'
if command -v gdcmconv >/dev/null && "$PY" -c 'import pydicom' 2>/dev/null; then
	for way in jpeg jpegls j2k; do
		mkdir $way; for k in 0 1 2; do gdcmconv --$way plain/$k.dcm $way/$k.dcm 2>/dev/null; done
		py recode $way; ok $? "gdcmconv compresses the series by $way"
		same $way "compressed by $way"
		same $way-0 "compressed by $way with a byte behind the end mark that is not zero"
		same $way-1 "compressed by $way with several bytes behind the end mark"
		no $way-2 "compressed by $way with two pictures for one" 'followed by another'
		no $way-half "compressed by $way with more rows than the header says" 'the compressed picture has 8x6 pixels'
	done
else
	skip 'compressed by JPEG and JPEG 2000' 'no gdcmconv or no pydicom'
fi
exits 0 'a series compressed by HTJ2K is converted' ct-convert "$srcdir/tests/htj2k.zip" h.nii
"$PY" -c 'import nibabel, numpy, sys
v = nibabel.load("h.nii").get_fdata()
i, j, k = numpy.indices(v.shape)
sys.exit(not numpy.array_equal(v, 11 * i + 7 * j + 30 * k - 1024))'; ok $? 'a series compressed by HTJ2K has the values that were written'
# nested sequences and the order of elements
for way in undefined private defined unknown implicit after; do same deep-$way-60 "sequences 60 deep ($way)"; done
alone() { # the same data set in one file without a name that says DICOM
	cp "$1/0.dcm" alone
	timeout 20 ct-info alone >out 2>err
	has err 'nested more than 64 deep' "a file with nested sequences is refused by ct-info without a name that says DICOM: $1"
}
for way in undefined private bytes defined unknown implicit after; do
	for n in 5000 100000; do
		[ -d deep-$way-$n ] || continue
		exits 3 "sequences $n deep ($way) are refused within 20 s" timeout 20 ct-convert -f deep-$way-$n d.nii
		has err 'its sequences are nested more than 64 deep' "the error of sequences $n deep ($way) gives the limit of 64"
		[ ! -d nameless-$way-$n ] || alone nameless-$way-$n
	done
done
exits 3 '50000 elements in the wrong order are refused within 20 s' timeout 20 ct-convert -f unsorted d.nii
has err 'its elements are out of order' 'the error of elements in the wrong order says so'
[ ! -e d.nii ]; ok $? 'refused series leave no volume'
done_testing
