#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# DICOM read by ct-convert: what pixels may look like, series made with pydicom, and planes that go to NIfTI one by one.
. "$srcdir/tests/tap.sh"
mkdir empty
ct-convert empty e.nii 2>err
if grep -q 'with-vtk' err; then skip 'DICOM series' 'built without vtk-dicom'; done_testing; fi
exits 3 'an empty folder is refused with status 3' ct-convert empty e.nii
if ! python_with pydicom && ! python_with numpy || ! "$PY" -c 'import nibabel'; then skip 'DICOM series' 'no numpy or no nibabel'; done_testing; fi
calls numpy nibabel pydicom dicom
py() { file=$1; shift; called "$srcdir/tests/$file.py" "$@"; }

# PixelData that are laid out in unusual ways are read as they are meant, or refused; none in silence as something else.
part pixels
py t-pixels make; ok $? 'series of unusual pixels are made'
exits 0 'a plain series is converted' ct-convert plain plain.nii
py t-pixels truth plain.nii
ok $? 'a plain series has the values and places that were written'
exits 0 'a series of 16 bits with metal is converted' ct-convert metal-16 metal-16.nii
exits 0 'a series of 8 bits is converted' ct-convert eight eight.nii
exits 0 'a series with an odd number of bytes is converted' ct-convert odd odd.nii
exits 0 'a series with padding values is converted' ct-convert padding padding.nii
same() { # same FOLDER NAME [OF]: it is the volume OF, plain.nii if there is none
	exits 0 "$2: the series is converted" ct-convert -f "$1" o.nii
	py t-pixels check "${3:-plain}.nii" o.nii
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
MALLOC_PERTURB_=200; export MALLOC_PERTURB_
same odd-nul 'an odd number of bytes that ends in NUL'
unset MALLOC_PERTURB_
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
		py t-pixels recode $way; ok $? "gdcmconv compresses the series by $way"
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
	mkdir -p lone; cp "$1/0.dcm" lone/alone
	timeout 20 ct-info lone/alone >out 2>err
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
[ ! -e d.nii ]; ok $? 'refused series of unusual pixels leave no volume'

"$PY" -c 'import pydicom' 2>/dev/null || { skip 'series made with pydicom' 'no pydicom'; done_testing; }
# Series in all orientations, compressed, several in a folder, and those that are refused.
part series
py t-dicom make_series
ok $? 'pydicom makes the series of this test'
# orientations, compressions, frames of reference
for s in axial reversed las sagittal coronal oblique padded; do
	exits 0 "a series $s is converted" ct-convert $s $s.nii
	py t-dicom check_series $s $s.nii
	ok $? "$s: every voxel is where it was, in HU"
done
if command -v gdcmconv >/dev/null; then
	for way in rle jpeg jpegls j2k; do
		mkdir axial-$way
		for f in axial/*; do gdcmconv --$way "$f" "axial-$way/${f#axial/}" 2>/dev/null; done
		exits 0 "a series compressed by $way is converted" ct-convert axial-$way $way.nii
		py t-dicom check_series axial $way.nii
		ok $? "a series compressed by $way gives the voxels of the plain one"
	done
else
	skip 'compressed series are converted' 'no gdcmconv'
fi
exits 0 'a series with two frames of reference is converted' ct-convert frames frames.nii
has err 'several frames of reference' 'two frames of reference in a series are reported'
py t-dicom check_series axial frames.nii
ok $? 'slices of two frames of reference are put in one volume'
exits 0 'a series with one frame of reference is converted' ct-convert -f axial axial.nii
! grep -q frames err; ok $? 'one frame of reference gives no message'
ct-info axial.nii >out
has out '^  ct-convert .* # axial xxh3:[0-9a-f]*$' 'the history of the volume names the folder with a checksum'
# several series in a folder
exits 0 'one file of a series stands for the series' ct-convert two/a3.dcm three.nii
py t-dicom check_series axial three.nii
ok $? 'one file of a series gives that series alone'
exits 5 'a folder of two series is refused with status 5' ct-convert two d.nii
has err "series 2: 9 CT 12x10 'synthetic'" 'the error of a folder of two series lists them'
exits 0 '--series 1 converts one series of two' ct-convert --series 1 two first.nii
exits 2 '--series with a number that does not exist is refused with status 2' ct-convert --series 7 two d.nii
# series that are refused
refused() { # refused CODE FOLDER WORD [OPTION]
	exits "$1" "a series $2 is refused with status $1" ct-convert ${4-} "$2" d.nii
	has err "$3" "the error of a series $2 gives the reason ($3)"
}
refused 5 missing '2 slices are missing'
refused 5 uneven 'uneven' --gaps=error
refused 5 tilted '20.0 degrees' --tilt=error
refused 5 patients 'patients'
refused 5 matrices '2 series'
refused 3 mr "modality is 'MR'"
refused 3 cutoff 'cannot be decoded\|damaged\|truncated'
refused 3 shortrun 'shortrun/4.dcm: damaged: its run-length code does not make 120 pixels of 2 bytes'
refused 3 syntax 'syntax/4.dcm: TransferSyntaxUID 1.2.840.10008.1.2.4.58 is not one that is read'
refused 3 norescale 'RescaleSlope'
refused 3 bomb '1152000000 or more.*--expand'
[ ! -e d.nii ]; ok $? 'refused series leave no output'
exits 0 'a series with a slice that is there twice is converted' ct-convert twice twice.nii
has err '9 of 10 files used: 1 repeated' 'a slice that is there twice is dropped with a message'
py t-dicom check_series axial twice.nii
ok $? 'a slice that is there twice does not change the others'
exits 3 'a DICOM file without a picture is refused with status 3' ct-convert nopicture/x.dcm d.nii

# DICOM goes to NIfTI plane by plane: the file is what it is by way of a volume, of which there is none in memory.
part planes
peak() { # peak COMMAND...: the MiB that it held
	"$PY" -c 'import resource, subprocess, sys
subprocess.check_call(sys.argv[1:])
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss // 1024)' "$@"
}
py t-dicom make_planes; ok $? 'series to go plane by plane are made'
way() { # way SERIES ARGUMENTS: OUT one.nii, and two.nii as a volume, which -v shows
	exits 0 "$*" ct-convert -q -f "${@}" one.nii
	ct-convert -v -f "${@}" two.nii 2>/dev/null && py t-dicom same one.nii two.nii; ok $? "$* plane by plane is the same as a volume"
}
way whole; py t-dicom type_of one.nii 4; ok $? 'planes that fit int16 are int16'
ct-convert -q whole - | tail -c 2160 >tail; tail -c 2160 one.nii | cmp -s - tail; ok $? 'and to a pipe'
way half; way whole --type f32; py t-dicom type_of one.nii 16; ok $? '--type f32 makes planes of float'
way half --type i16; py t-dicom type_of one.nii 4; ok $? '--type i16 rounds planes to int16'
way whole --units other --tilt shear
way far; py t-dicom type_of one.nii 16; ok $? 'what does not fit int16 is float'
exits 6 '--type i16 refuses what does not fit' ct-convert --type i16 far no.nii
has err 'no.nii: a voxel does not fit int16' 'the error of a voxel beyond int16 names the file'
exits 3 'a slice that cannot be read is refused' ct-convert broken no.nii
has err 'broken/4.dcm: TransferSyntaxUID 1.2.840.10008.1.2.9' 'the error of an unknown transfer syntax names file and UID'
ls | grep -q '^no.nii'; [ $? -eq 1 ]; ok $? 'planes that were refused leave no file'
way broken --skip-damaged --gaps fill
exits 0 'a series is converted over a file with -f' ct-convert -f whole one.nii; py t-dicom same one.nii two.nii; [ $? -eq 1 ]; ok $? 'a forced conversion replaces the file'
ct-convert -q whole a.nii --sidecar a.json && ct-convert -q whole b.nii.gz --sidecar b.json && cmp -s a.json b.json
ok $? 'compressed or not the sidecar is the same'
if ! sanitized ct-convert; then
	all=$(peak ct-convert -q large large.nii.gz); one=$(peak ct-convert -q large large.nii)
	echo "# $all and $one MiB"
	[ $((one + 15)) -lt "$all" ]; ok $? 'the 20 MB of a volume are not in memory'
else
	skip 'memory' 'sanitizers take their own'
fi
done_testing
