#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Files beside other programs, and headers that contradict themselves.
. "$srcdir/tests/tap.sh"

# A PLY of Gaussians read by a few lines of Python that know PLY and nothing of ours.
"$builddir/tests/t-ply" g.ply; ok $? 'a file to look at'
head -n 2 g.ply | tail -n 1 | grep -q '^format binary_little_endian 1.0$'; ok $? 'PLY is written binary and little-endian'
if command -v python3 >/dev/null; then
	cat >look.py <<'END'
import math, struct
head, body = open("g.ply", "rb").read().split(b"end_header\n", 1)
lines = head.decode().split("\n")
n = next(int(l.split()[2]) for l in lines if l.startswith("element vertex "))
names = [l.split()[2] for l in lines if l.startswith("property float ")]
want = ["x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity"] + \
	["scale_%d" % i for i in range(3)] + ["rot_%d" % i for i in range(4)] + ["density"]
assert names == want, names
assert len(body) == n * 4 * len(names), (len(body), n)
rows = [dict(zip(names, r)) for r in struct.iter_unpack("<%df" % len(names), body)]
gamma = next(float(l.split("=")[1]) for l in lines if l.startswith("comment ct:gamma="))
assert "comment ct:units=mm" in lines and "comment ct:activation=prelu" in lines
rho = [r["density"] if r["density"] > 0 else gamma * r["density"] for r in rows]
most = max(map(abs, rho))
for r, v in zip(rows, rho):
	p = min(max(abs(v) / most, 0.001), 0.999)
	assert abs(r["opacity"] - math.log(p / (1 - p))) < 1e-3, (r, v)
	shown = [0.5 + r["f_dc_%d" % k] / (2 * math.sqrt(math.pi)) for k in range(3)]
	colour = (0.98, 0.62, 0.25) if v >= 0 else (0.25, 0.55, 0.98)
	assert max(abs(a - b) for a, b in zip(shown, colour)) < 1e-5, (shown, v)
	red, blue = (0.5 + 0.28209479 * r[k] for k in ("f_dc_0", "f_dc_2"))
	assert 0 <= min(red, blue) and max(red, blue) <= 1 and (red > blue) == (v >= 0), r
	assert r["nx"] == r["ny"] == r["nz"] == 0
END
	python3 look.py 2>err; ok $? 'a 3DGS viewer finds its properties, colours and opacities'
	sed 's/^/# /' err
else
	skip 'a 3DGS viewer finds its properties' 'no python3'
fi

# EXR stacks seen by other programs: OpenEXR's exrheader, OpenImageIO's oiiotool.
part exr-tools
make_stack() { # a stack of 4 views of 48x40 through the library: t-exr leaves its own on request
	"$builddir/tests/t-exr" keep s.exr >/dev/null
}
make_stack; [ -s s.exr ]; ok $? 'the library writes a stack for this test'
# exrheader of OpenEXR
if command -v exrheader >/dev/null; then
	exrheader s.exr >header
	[ "$(grep -c '^ *part ' header)" -eq 4 ]; ok $? 'exrheader shows one part for each view'
	has header 'name (type string): "view.0003"' 'exrheader shows the name of a view'
	has header 'ct:beam (type string): "cone"' 'exrheader shows the beam as ct:beam'
	has header 'compression (type compression): zip, multi-scanline' 'exrheader shows that a part is compressed with ZIP'
	has header 'Y, 32-bit floating-point' 'exrheader shows the channel Y as float'
	has header 'ct:quantity (type string): "lineIntegral"' 'exrheader shows the quantity as ct:quantity'
else
	skip 'exrheader shows the attributes of a stack' 'no exrheader'
fi
# oiiotool of OpenImageIO
if command -v oiiotool >/dev/null; then
	oiiotool -a --stats s.exr >stats 2>err; ok $? 'oiiotool decodes a stack of views'
	[ "$(grep -c 'Stats Avg' stats)" -eq 4 ]; ok $? 'oiiotool finds all four views'
	"$builddir/tests/t-exr" means s.exr >means
	sed -n 's/.*Stats Avg: \([-0-9.]*\).*/\1/p' stats | paste - means |
		awk '{d = $1 - $2; if (d < -2e-6 || d > 2e-6) bad = 1} END {exit bad || NR != 4}'
	ok $? 'oiiotool computes the means of the views that the library computes'
	oiiotool -a s.exr --compression zips -o t.exr; ok $? 'oiiotool rewrites a stack with ZIPS'
	"$builddir/tests/t-exr" same s.exr t.exr; ok $? 'geometry, metadata and pixels survive a rewrite by oiiotool'
	oiiotool -a s.exr -d half -o h.exr 2>/dev/null
	"$builddir/tests/t-exr" means h.exr >/dev/null; ok $? 'the library reads a stack of HALF pixels'
	oiiotool --pattern constant:color=1 8x8 1 -d float -o plain.exr 2>/dev/null
	"$builddir/tests/t-exr" means plain.exr 2>err
	[ $? -eq 3 ] && grep -q 'no attribute ct:' err; ok $? 'a picture without geometry is refused with status 3'
else
	skip 'oiiotool decodes a stack of views' 'no oiiotool'
fi

# A NIfTI header that contradicts itself: the sform is used and the rest is told; a mirrored one is refused.
part nifti-doubt
ct-phantom -q --size 8x9x10 --spacing 2,3,5 marks v.nii
edit() { # edit NAME OFFSET BYTES: v.nii with other bytes there
	cp v.nii "$1.nii"
	# shellcheck disable=SC2059
	printf "$3" | dd of="$1.nii" bs=1 seek="$2" conv=notrunc 2>/dev/null
}
zero='\000\000\000\000' two='\000\000\000\100' hundred='\000\000\310\102' nan='\000\000\300\177' inf='\000\000\200\177' minus='\000\000\200\277'
edit shifted 268 "$hundred"; edit long 84 "$hundred"; edit none 80 "$zero"; edit nan 80 "$nan"; edit turned 256 "$two"; edit minus 80 "$minus"
ct-upsample -q -m linear -x 2 v.nii want.nii
told() { # told NAME WORDS: the sform is used, and the words are a warning
	for tool in 'ct-convert' 'ct-upsample -m linear -x 2'; do
		exits 0 "$1: ${tool%% *} accepts a header that contradicts itself" $tool -f "$1.nii" o.nii
		has err "^${tool%% *}: warning: $1.nii: \\($2\\)" "$1: ${tool%% *} warns of what contradicts"
		case $tool in ct-convert) want=v.nii ;; *) want=want.nii ;; esac
		for k in o.nii $want; do ct-info $k | grep -v '^file\|hash\|history\|^  '; done | sort | uniq -u >differs
		[ ! -s differs ]; ok $? "$1: ${tool%% *} uses the sform"; sed 's/^/# /' differs
	done
	ct-info "$1.nii" >info; has info 'nifti.doubt' "$1: ct-info shows nifti.doubt"
	exits 0 "$1: the output of ct-convert is converted again" ct-convert o.nii again.nii
	[ ! -s err ]
	ok $? "$1: the output of ct-convert does not contradict itself"
	rm -f again.nii
}
told shifted 'qform and sform are up to 9[0-9.]* mm apart; the sform is used$\|qform and sform are up to 1[0-9.]* mm apart; the sform is used$'
told long 'pixdim\[2\] is 100, but voxels are 3 long in the sform, which is used$'
told none 'pixdim\[1\] is 0, but'; told nan 'pixdim\[1\] is -\{0,1\}nan, but'; told minus 'pixdim\[1\] is -1, but'
told turned 'qform and sform are up to'
cat v.nii v.nii >more.nii; told more '[0-9]* more bytes follow 8x9x10 voxels$'
gzip -c more.nii >packed.nii; told packed '[0-9]* more bytes follow 8x9x10 voxels$'
edit mirrored 76 "$minus"
for tool in 'ct-convert' 'ct-upsample -m linear -x 2' 'ct-sr -x 2 -Q draft'; do
	exits 5 "${tool%% *} refuses a qform that mirrors the sform" $tool mirrored.nii no.nii
	has err 'mirrored.nii: qform and sform are mirror images' 'the error of mirror images names qform and sform'
done
edit other 252 '\002'
exits 0 'a qform of another space is accepted' ct-convert -f other.nii o.nii
[ ! -s err ]
ok $? 'a qform of another space gives no warning'
cp other.nii v2.nii; printf "$hundred" | dd of=v2.nii bs=1 seek=268 conv=notrunc 2>/dev/null
exits 0 'a qform of another space that lies elsewhere is accepted' ct-convert -f v2.nii o.nii
[ ! -s err ]
ok $? 'a qform of another space that lies elsewhere gives no warning'
edit slope 112 "$inf"
exits 3 'a slope of infinity is refused with status 3' ct-convert slope.nii no.nii
has err 'slope.nii: scl_slope is inf' 'the error of a slope of infinity names scl_slope'
edit inter 116 "$inf"; exits 3 'an intercept of infinity is refused with status 3' ct-convert inter.nii no.nii
edit unset 112 "$nan"; exits 0 'a slope of NaN is read as no slope' ct-convert -f unset.nii o.nii
[ ! -e no.nii ]; ok $? 'refused NIfTI headers leave no output'

# MetaImage and NRRD: as ITK reads and writes them, and taken by every command that reads a volume.
part headers
ct-phantom -q --size 10x8x6 --spacing 1,1.5,2 --expert oversample=1 marks plain.nii
ct-convert --reorient PIL plain.nii a.nii
for f in mha mhd nrrd nhdr; do
	for how in '' --compress; do
		exits 0 "ct-convert writes .$f $how" ct-convert $how a.nii "x$how$f.$f"
		exits 0 "ct-convert reads .$f $how" ct-convert -f "x$how$f.$f" back.nii
		exits 0 ".$f $how keeps every voxel" ct-metrics -q --min psnr=1000 a.nii back.nii
		[ "$(ct-info a.nii | grep -E '^(affine|size|phantom)')" = "$(ct-info "x$how$f.$f" | grep -E '^(affine|size|phantom)')" ]
		ok $? ".$f $how keeps place and metadata"
	done
done
[ -f xmhd.raw ] && [ -f x--compressmhd.zraw ] && [ -f xnhdr.raw ] && [ -f x--compressnhdr.raw.gz ]
ok $? '.mhd and .nhdr put voxels beside their header'
exits 0 'a compressed MetaImage is read from a pipe' sh -c 'cat x--compressmha.mha | ct-convert -f - back.nii'
# one place, said once
says() { # says STATUS FILE SED WORDS NAME
	sed "$3" "$2" >bad."${2##*.}"; exits "$1" "$5" ct-convert -f bad."${2##*.}" no.nii
	[ "$1" -ne 0 ] || rm no.nii
	[ "$1" -eq 0 ] || { has err "^ct-convert: bad.${2##*.}: $4" "$5: the error names the field"; [ ! -e no.nii ]; ok $? "$5: nothing is made"; }
}
says 3 xmha.mha 's/^TransformMatrix = .*/&\nTransformMatrix = -1 0 0 0 1 0 0 0 1/' "TransformMatrix is said twice: '" 'a matrix and its mirror image are refused'
says 0 xmha.mha 's/^\(TransformMatrix\) = \(.*\)/&\nOrientation = \2/' '' 'a matrix that two names repeat is read'
says 5 xmha.mha 's/^TransformMatrix = .*/&\nOrientation = 1 0 0 0 1 0 0 0 1/' 'Orientation: is not what TransformMatrix says' 'two matrices by two names are refused'
says 5 xmha.mha 's/^Offset = .*/&\nOrigin = 9 9 9/' 'Origin: is not what Offset says' 'two places by two names are refused'
says 3 xnrrd.nrrd 's/^space directions: .*/&\nspace directions: (5,0,0) (0,5,0) (0,0,5)/' "spacedirections is said twice: '" 'directions that are said twice are refused'
says 5 xnrrd.nrrd 's/^space directions: .*/&\nspacings: 5 5 5/' 'spacings: 5 along axis 0, where space directions say ' 'spacings that contradict directions are refused'
says 3 x--compressmha.mha 's/^\(DimSize = [0-9]* [0-9]*\) [0-9]*/\1 2/' 'longer than its header says' 'a compressed MetaImage of more voxels than it says is refused'
says 3 x--compressnrrd.nrrd 's/^\(sizes: [0-9]* [0-9]*\) [0-9]*/\1 2/' 'longer than its header says' 'a compressed NRRD of more voxels than it says is refused'
rm -f no.nii
exits 3 'a header without its data file is refused' sh -c 'ct-convert -f - back.nii <xmhd.mhd'
has err 'nothing is beside standard input' 'the error of a header from a pipe says nothing is beside it'

# a name of two lines in a history, of which each line is a command
two=$(printf 'a\nb.nii'); cp a.nii "$two"; exits 0 'a name of two lines is converted' ct-convert "$two" lines.nii
ct-info --json lines.nii | grep -q "'a.*nb.nii' lines.nii # a.*nb.nii xxh3:"; ok $? 'a name of two lines is one line of the history'
cp a.nii "it's \$a&(b).nii" && ct-convert -q "it's \$a&(b).nii" quoted.nii
ct-info quoted.nii | sed -n "s/^  ct-convert [^ ]* \(.*\) quoted.nii # .*/printf '%s' \1/p" >told; [ "$(sh told)" = "it's \$a&(b).nii" ]; ok $? 'a shell reads a name of the history as it is'

# outputs that are two files
exits 4 'an existing file of voxels is not overwritten' ct-convert a.nii xmhd.nhdr
has err 'xmhd.raw: exists, and is not of xmhd.nhdr alone' 'the error of an existing file of voxels says why'
exits 4 'nor are the voxels of another header by --force' ct-convert -f a.nii xmhd.nhdr
ct-convert a.nii two.nhdr; exits 4 'nor those of a header that is there' ct-convert a.nii two.nhdr; has err 'two.nhdr: exists; --force overwrites it' 'the error of the header names --force'
ct-convert -q --reorient RAS a.nii half.nii; exits 0 '--force overwrites a header and its voxels' ct-convert -f half.nii two.nhdr
ct-convert -q -f two.nhdr back.nii && ct-metrics -q --min psnr=1000 half.nii back.nii; ok $? 'header and voxels are both new'
# a header that cannot be replaced: both stay
if chattr +i two.nhdr 2>/dev/null; then
	cp two.raw two.was; exits 4 'a header that cannot be replaced is an error' ct-convert -f a.nii two.nhdr
	cmp -s two.raw two.was; ok $? 'the voxels of that header stay'; chattr -i two.nhdr
else
	skip 'a header that cannot be replaced' 'no chattr here'
fi
printf '\001\002\003\004\005\006\007\010' >r.raw; cp r.raw was.raw
exits 4 'voxels are not written over the raw input' ct-convert -f --raw 2x2x2:u8:1 r.raw r.mhd
has err 'r.raw: would be written over r.raw, an input' 'the error of voxels over the raw input names both'
cmp -s r.raw was.raw; ok $? 'the raw input stays as it was'
ln -s /dev/full full.mha; ln -s /dev/full p.raw
exits 4 'no room for a MetaImage is status 4' ct-convert a.nii full.mha
exits 4 'no room for the voxels of .mhd is status 4' ct-convert a.nii p.mhd
[ ! -e p.mhd ]; ok $? 'without room for voxels there is no header'
ln -s /dev/full q.mhd
exits 4 'no room for the header of .mhd is status 4' ct-convert a.nii q.mhd
[ ! -e q.raw ]; ok $? 'without room for a header there are no voxels'
cp xmhd.raw was.raw
exits 4 'the voxels of an input header are not written over' ct-convert -f xmhd.mhd xmhd.nhdr
has err 'xmhd.raw: would be written over the voxels of xmhd.mhd, an input' 'the error of voxels over an input header names it'
cmp -s xmhd.raw was.raw; ok $? 'the voxels of an input header stay as they were'
cp xmhd.raw voxels; sed 's/xmhd.raw/voxels/' xmhd.mhd >own.mhd
for o in "ct-convert own.mhd" "ct-degrade -x 2 own.mhd" "ct-sr -q -x 2 -Q draft own.mhd no.nii --report" "ct-convert --grid own.mhd a.nii"; do
	exits 4 "the voxels of an input header are not written over by $o" $o voxels -f
	has err 'voxels: would be written over the voxels of own.mhd, an input' "the error of $o over voxels names their header"
done
cmp -s xmhd.raw voxels; ok $? 'voxels without an ending stay as they were'
for o in ' a.mhd' ' a.nhdr' 'LIST.mhd' 'LISTED.nhdr' 'a%d.mhd' 'a
b.mhd'; do
	exits 4 "a header that cannot name its voxels is refused: $(echo "$o" | tr '\n' '?')" ct-convert a.nii "$o"
	has err 'cannot name its file of voxels.* or .\(mha\|nrrd\)$' "the error of $(echo "$o" | tr '\n' '?') says what to do"
done
[ ! -e ' a.raw' ] && [ ! -e LIST.raw ]; ok $? 'headers that are refused leave no voxels'
exits 0 'compressed voxels are another file than the input' ct-convert -f --compress xmhd.mhd xmhd.nhdr
exits 4 'a compressed MetaImage to a device is refused' ct-convert --compress a.nii full.mha
exits 2 '--compress is refused for NIfTI' ct-convert --compress a.nii d.nii
has err 'compressed if its name ends in .gz' 'the error of --compress for NIfTI names .gz'
printf 'ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementSpacing = 1 1 1\nElementDataFile = r.raw\n' >r.mhd
exits 0 'a header of only the needed fields is read' ct-convert r.mhd r.nii
has err 'r.mhd: its header does not say where the voxels lie' 'a header without a place is warned of'
exits 3 'values of a header that are not HU are refused' ct-degrade -x 2 r.mhd no.nii
has err 'not HU' 'the error of values that are not HU says so'
exits 0 '--units hu takes values of a header as HU' ct-degrade -x 2 --units hu r.mhd yes.nii
printf 'a text\n' >text
exits 3 'a text is refused as a volume' ct-convert text no.nii
has err 'text: not a NIfTI file, nor MetaImage or NRRD' 'the error of a text names the formats'
ct-project -q -n 3 a.nii kind.exr; printf '\211PNG\r\n\032\nIHDR' >kind.png; printf '\020\0\0\0\0\0\0\0{}' >kind.safetensors; : >kind.nii; printf 'ply\nformat\n' >kind.ply; mkdir kind
while IFS=: read -r f what; do
	exits 3 "$f is refused as a volume" ct-degrade -x 2 "$f" no.nii; has err "^ct-degrade: $f: .*not a volume.*$what" "the error of $f as a volume says what it is"
done <<END
kind.exr:projections (EXR)
kind.png:a picture (PNG)
kind.safetensors:a network (safetensors)
kind.ply:Gaussians (PLY)
kind.nii:empty
kind:ct-convert makes one
END
# kinds of others, and how to go on
printf '\223NUMPY\1\0v\0{}' >o.npy; printf '\211HDF\r\n\032\n' >o.h5; printf 'MATLAB 5.0 MAT-file' >o.mat; printf 'II*\0\10\0\0\0' >o.tif
printf '# vtk DataFile Version 3.0\n' >o.vtk; printf '7z\274\257\047\034' >o.7z; printf 'SIMPLE  =  T' >o.fits
for f in npy h5 mat tif vtk 7z fits; do head -c 600 /dev/zero >>o.$f; done
while IFS=: read -r f what way; do
	for c in 'ct-info' 'ct-convert' 'ct-ddnm'; do
		if [ $f = o.tif ] && [ $c != ct-info ]; then continue; fi
		grep -q '^#define HAVE_OIIO 1' "$builddir/config.h" || [ $c != ct-ddnm ] || continue
		case $c in ct-info) o= ;; ct-convert) o=no.nii ;; *) o=no.exr ;; esac
		exits 3 "$f is refused by $c" $c $f $o
		has err "$f: .* but $what.*$way" "the error of $f by $c says what it is and how to go on"
	done
done <<END
o.npy:an array of numpy:ct-convert --scanner reads projections; of a volume make NIfTI
o.h5:HDF5:ct-convert --projections reads scans of Data Exchange; make NIfTI of a volume
o.mat:a file of MATLAB:ct-convert --projections reads a sinogram; make NIfTI of a volume
o.tif:a picture (TIFF):ct-convert --radiograph makes a stack of it
o.vtk:VTK:make MetaImage of it
o.7z:an archive (7z):unpack it
o.fits:FITS:make NIfTI of it
END
head -c 4000 /dev/zero >pair.img; gzip -c pair.img >pair.img.gz
for f in pair.img pair.img.gz; do
	exits 3 "voxels of a pair, $f, are refused" ct-convert $f no.nii; has err "^ct-convert: $f: the voxels of a .hdr/.img pair" "the error of $f says what it is"
done
exits 3 'projections from a pipe are refused as a volume' sh -c 'cat kind.exr | ct-degrade -x 2 - no.nii'; has err 'not a NIfTI file, nor MetaImage or NRRD' 'the error of projections from a pipe names the formats'
exits 3 'a volume is refused as projections' ct-fdk a.nii no.nii; has err 'a.nii: not an EXR file, but a volume (NIfTI)' 'the error of a volume for projections says what it is'
exits 3 'a volume is refused as a picture' ct-ddnm a.nii no.exr; has err 'a.nii: neither projections (EXR) nor a picture, but a volume (NIfTI)' 'the error of a volume for a picture says what it is'

# every command that reads volumes takes them, with the same result
for f in mhd.mhd --compressnrrd.nrrd; do
	for c in 'ct-degrade -x 2' 'ct-upsample -x 2 -m cubic' 'ct-project -n 3' 'ct-convert --iso 2'; do
		# the last bytes are voxels, or pixels; history is before them
		for i in a.nii "x$f"; do $c -q -f "$i" o && tail -c 60 o >"end.$i"; done
		cmp -s end.a.nii "end.x$f" && [ -s end.a.nii ]
		ok $? "$c takes x$f"
	done
	exits 0 "ct-metrics takes x$f" ct-metrics -q --min psnr=1000 "x$f" a.nii
	ct-degrade -q -f -x 2 a.nii lr.nii; ct-convert -q -f lr.nii lr.mha
	for c in "ct-upsample -m prior -q -f" "ct-sr -q -f -x 2 -Q draft"; do
		exits 0 "$c takes lr.mha" $c lr.mha o.nii
	done
	exits 0 "ct-compose takes x$f as both inputs" ct-compose -f -q "x$f" "x$f" --gain 0 o.nii
	exits 0 "ct-metrics --consistency takes x$f and lr.mha" ct-metrics --consistency lr.mha "x$f"
	ct-project -q -f -n 3 "x$f" p.exr
	exits 0 "ct-fdk takes x$f as --grid" ct-fdk -q -f --grid "x$f" p.exr o.nii
	exits 0 "ct-fuse takes x$f as its base" ct-fuse -q -f -n 1 "x$f" lr.mha p.exr o.nii
	exits 0 "ct-nabgs takes x$f as its base" ct-nabgs -q -f -n 1 -g 9 --lr lr.mha -b "x$f" p.exr o.ply
	if command -v ct-view >/dev/null; then exits 0 "ct-view takes x$f as a volume" ct-view -q -f "x$f" o.png; fi
done

# against others
if command -v plastimatch >/dev/null && python_with nibabel; then
	cat >check.py <<-'END'
		import sys, nibabel as nib, numpy as np
		a, b = nib.load(sys.argv[1]), nib.load(sys.argv[2])
		assert np.array_equal(a.get_fdata(), b.get_fdata())
		assert np.abs(a.affine - b.affine).max() < 1e-4, (a.affine, b.affine)
	END
	"$PY" - <<-'END'
		import nibabel as nib, numpy as np
		a = np.random.default_rng(1).integers(-1000, 2000, (7, 6, 5)).astype(np.int16)
		c, s = np.cos(.3), np.sin(.3)
		r = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, s, -c], [0, c, s]])
		m = np.eye(4)
		m[:3, :3] = r @ np.diag([.7, -.8, 2.5])
		m[:3, 3] = 11.25, -22.5, 33
		i = nib.Nifti1Image(a, m)
		i.set_sform(m, 1)
		i.set_qform(m, 1)
		nib.save(i, 'o.nii')
	END
	for f in mha mhd nrrd nhdr; do
		plastimatch convert --input o.nii --output-img "itk-$f.$f" >/dev/null 2>&1
		exits 0 "a .$f that ITK writes is read" ct-convert -f "itk-$f.$f" o2.nii
		exits 0 "a .$f of ITK has the same voxels and place" "$PY" check.py o.nii o2.nii
		for how in '' --compress; do
			ct-convert $how o.nii "ours$how-$f.$f"
			plastimatch convert --input "ours$how-$f.$f" --output-img o3.nii >/dev/null 2>&1
			exits 0 "ITK reads our .$f $how" "$PY" check.py o.nii o3.nii
			rm -f o3.nii
		done
	done
else
	skip 'MetaImage and NRRD agree with ITK' 'no plastimatch or nibabel'
fi
done_testing
