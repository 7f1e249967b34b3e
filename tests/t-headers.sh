#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# MetaImage and NRRD: as ITK reads and writes them, and taken by every command that reads a volume.
. "$srcdir/tests/tap.sh"
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
rm -f no.nii
exits 3 'a header without its data file is refused' sh -c 'ct-convert -f - back.nii <xmhd.mhd'
has err 'nothing is beside standard input' 'the error of a header from a pipe says nothing is beside it'

# outputs that are two files
exits 4 'an existing file of voxels is not overwritten' ct-convert a.nii xmhd.nhdr
has err 'xmhd.raw: exists; --force overwrites it' 'the error of an existing file of voxels names --force'
exits 0 '--force overwrites an existing file of voxels' ct-convert -f a.nii xmhd.nhdr
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
