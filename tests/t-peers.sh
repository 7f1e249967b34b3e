#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Projections beside those of other programs: plastimatch drr (the same boxes, exactly) and
# scikit-image radon (an interpolation of its own).
. "$srcdir/tests/tap.sh"
if ! python_with nibabel || ! "$PY" -c 'import skimage' 2>/dev/null ||
	! command -v oiiotool >/dev/null 2>&1; then
	skip 'projections of other programs' 'no nibabel, skimage or oiiotool'
	done_testing
fi
# pixels STACK: numbers in STACK.tif, pictures below one another
pixels() { oiiotool -a "$1.exr" -d float --compression none -o "$1.tif"; }

if command -v plastimatch >/dev/null 2>&1; then
	# Its box ends in the middle of the outermost voxels, so both get a layer of air. It knows LPS and
	# no direction cosines: the object is the same where its x and y run the other way. Its view at
	# angle -a, numbered clockwise from +x of LPS, is ours at 180 + a, mu is 0.0022 (1 + HU/1000).
	"$PY" - <<-'PY'
		import nibabel as nib, numpy as np
		rng = np.random.default_rng(7)
		n, mm = (40, 36, 28), (2.0, 2.0, 2.5)
		hu = np.full(n, -1000, 'f4'); hu[4:-4, 5:-5, 3:-3] = rng.uniform(-700, 1500, (32, 26, 22))
		affine = np.diag(mm + (1.0,)); affine[:3, 3] = [-m * (k - 1) / 2 for m, k in zip(mm, n)]
		nib.save(nib.Nifti1Image((1 + hu / 1000).astype('f4'), affine), 'box.nii')
		with open('box.mha', 'wb') as f:
		    f.write(('ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n'
		             'TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = %r %r %r\nElementSpacing = %r %r %r\n'
		             'DimSize = %d %d %d\nElementType = MET_FLOAT\nElementDataFile = LOCAL\n'
		             % (tuple(affine[:3, 3].tolist()) + mm + n)).encode())
		    f.write(np.ascontiguousarray(hu[::-1, ::-1].transpose(2, 1, 0), '<f4').tobytes())
	PY
	ct-project --quantity density -n 5 --arc -180 --expert start=180,dso=400,dsd=600,pitch=2.5 --det 64 \
		box.nii box.exr && pixels box
	plastimatch drr -i exact -t pfm -r '64 64' -z '160 160' --sad 400 --sid 600 -a 5 -N 36 \
		-O drr_ -I box.mha >plastimatch.log 2>&1
	"$PY" - <<-'PY' >out 2>&1
		import numpy as np, skimage.io
		ours = skimage.io.imread('box.tif').reshape(5, 64, 64).astype(float)
		for k in range(5):
		    with open('drr_%04d.pfm' % k, 'rb') as f:
		        f.readline(); w, h = map(int, f.readline().split())
		        theirs = np.frombuffer(f.read()[-4 * w * h:], '<f4').reshape(h, w) / 0.0022
		    d = np.sqrt(np.mean((theirs - ours[k]) ** 2)) / ours.max()
		    print('view %d: rms %.2g of the largest' % (k, d)); assert d < 1e-6
	PY
	ok $? 'plastimatch drr: the same pictures'; sed 's/^/# /' out
else
	skip 'plastimatch drr: the same pictures' 'no plastimatch'
fi

# A ray of radon passes the middle of a pixel for every column; its image turns about pixel n//2.
ct-phantom --size 97x97x97 --spacing 1 shepp-logan whole.nii
"$PY" -c "import nibabel as n; v = n.load('whole.nii'); n.save(v.slicer[:, :, 47:50], 's.nii')"
ct-project --beam parallel -n 12 --det 97x3 --expert pitch=1 s.nii s.exr && pixels s
"$PY" - <<-'PY' >out 2>&1
	import nibabel as nib, numpy as np, skimage.io, warnings
	warnings.simplefilter('ignore')
	from skimage.transform import radon
	x = np.clip((nib.load('s.nii').get_fdata()[:, :, 1] + 1024) / 4095, 0, 1)
	ours = skimage.io.imread('s.tif').reshape(12, 3, 97)[:, 1].astype(float)
	fits = {}
	for flip in (False, True):
	    for start in range(0, 360, 90):
	        for way in (1, -1):
	            a = radon(x, start + way * np.arange(12) * 15.0, circle=False)
	            cut = a.shape[0] // 2 - 48
	            a = a[cut:cut + 97].T
	            a = a[:, ::-1] if flip else a
	            fits[flip, start, way] = np.sqrt(np.mean((a - ours) ** 2) / np.mean(ours ** 2))
	best = min(fits, key=fits.get)
	print('apart %.3g (flipped, first angle, direction: %s)' % (fits[best], best))
	assert fits[best] < 0.02
PY
ok $? 'scikit-image radon: within its interpolation'; sed 's/^/# /' out
done_testing
