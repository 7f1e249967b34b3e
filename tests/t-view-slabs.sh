#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-view --mip and --thickness, voxel by voxel against numpy.
. "$srcdir/tests/view.sh"
cat >look.py <<'END'
import struct, warnings
import numpy as np
from PIL import Image
warnings.simplefilter("ignore")
W, H, D = 14, 18, 22 # 4 mm each, from -28, -36, -44 mm on
def vol(f):
    b = open(f, "rb").read()
    return np.frombuffer(b, "<f4", W * H * D, int(struct.unpack_from("<f", b, 108)[0])).reshape(D, H, W)[:, :, :].astype(float)
v = vol("v.nii")
def tones(x): return np.clip((x + 200) / 500, 0, 1) * 255
def along(plane, how, lo, hi):
    x = {"axial": v[lo:hi], "coronal": v[::-1, lo:hi].swapaxes(0, 1), "sagittal": v[::-1, :, lo:hi].transpose(2, 0, 1)}[plane]
    x = getattr(x, how)(0)
    return x[::-1, ::-1] if plane == "axial" else x[:, ::-1]
def shows(name, top, left, want):
    p = np.asarray(Image.open(name).convert("RGB")).astype(float)[top:top + want.shape[0], left:left + want.shape[1]]
    nan = np.isnan(want)
    off = abs(p[..., 0] - tones(want))[~nan].max(initial=0)
    return off <= 0.51 and (p[nan] == (0, 0, 255)).all()
def size(name): return Image.open(name).size
END
ct-phantom -q --size 14x18x22 --spacing 4 -s 5 ellipsoids v0.nii && ct-convert -q --type f32 v0.nii v1.nii || exit 99
"$PY" - <<'END'
import struct
b = bytearray(open("v1.nii", "rb").read())
at = int(struct.unpack_from("<f", b, 108)[0])
import random
random.seed(1)
for k in range(14 * 18 * 22): # no voxel like another
    b[at + 4 * k:at + 4 * k + 4] = struct.pack("<f", random.uniform(-260, 360))
open("v.nii", "wb").write(b)
struct.pack_into("<f", b, at + 4 * ((5 * 18 + 4) * 14 + 3), float("nan"))
open("nan.nii", "wb").write(b)
END
for how in max min mean; do
	ct-view --mip $how v.nii $how.png
	is "shows('$how.png', 0, 0, along('axial', '$how', 0, 22)) and shows('$how.png', 22, 0, along('coronal', '$how', 0, 18)) and shows('$how.png', 48, 0, along('sagittal', '$how', 0, 14))" \
		"--mip=$how of all"
done
for o in LPS SAR IRP; do
	ct-convert -q -f --reorient $o v.nii o.nii && ct-view -f --mip mean o.nii o.png
	is "all(shows('o.png', t, 0, along(p, 'mean', 0, n)) for t, p, n in ((0, 'axial', 22), (22, 'coronal', 18), (48, 'sagittal', 14)))" "in $o"
	ct-view -q -f -p coronal --mip max --thickness 17 --slice 2.1mm o.nii o.png # middles from -6.4 to 10.6: -6, -2, 2, 6, 10
	is "shows('o.png', 0, 0, along('coronal', 'max', 7, 12))" 'a slab'
done
# middles are at 2 mm and every 4: half a slab of 8 mm reaches them, one of 7.9 does not
for t in 8 7.9 4 3.9 0.1 1000; do ct-view -p axial --mip min --thickness $t --slice 6mm v.nii t$t.png; done
is 'all(shows("t%s.png" % t, 0, 0, along("axial", "min", a, b)) for t, a, b in (("8", 11, 14), ("7.9", 12, 13), ("4", 12, 13), ("3.9", 12, 13), ("0.1", 12, 13), ("1000", 0, 22)))' \
	'thicker and thinner'
ct-view -p axial --mip min --thickness 0.1 --slice 7.9mm v.nii off.png
is 'shows("off.png", 0, 0, along("axial", "min", 12, 13))' 'one between middles is of the voxels there'
ct-view -p axial --mip max --thickness 8 --slice 43mm v.nii end.png
is 'shows("end.png", 0, 0, along("axial", "max", 21, 22))' 'one at the end is of what is there'
ct-view -p sagittal --mip max --thickness 9 --slices 3 v.nii three.png
is 'size("three.png") == (2 * 18 + 4, 2 * 22 + 4) and all(shows("three.png", k // 2 * 26, k % 2 * 22, along("sagittal", "max", a, b)) for k, (a, b) in enumerate(((1, 3), (6, 8), (11, 13))))' \
	'several slabs'
for how in max min mean; do
	ct-view -f -p axial --mip $how nan.nii nan.png
	is "(lambda w: shows('nan.png', 0, 0, w))(np.where(np.arange(18 * 14).reshape(18, 14) == (17 - 4) * 14 + 13 - 3, np.nan, along('axial', '$how', 0, 22)))" \
		"$how: not a number stays so"
done
ct-view -e --mip max v.nii v.nii e.png; ct-view -l --mip min --thickness 5 v.nii l.png
is 'np.asarray(Image.open("e.png"))[74:].max() == 0' 'errors are of what is shown'
exits 2 'a place of all' ct-view --mip max --slice 0.2 v.nii no.png
has err '^ct-view: --slice: with --mip it needs --thickness$' 'the error of --slice with --mip names --thickness'
exits 2 '--slices with --mip of all is refused' ct-view --mip max --slices 2 v.nii no.png
exits 2 'a slab thinner than a thousandth of a millimetre is refused' ct-view --mip max --thickness 0.0005 --slice 1 v.nii no.png
exits 5 'a slab beside the volume is refused' ct-view --mip max --thickness 5 --slice 90mm v.nii no.png
ct-project -q -n 2 --det 8 v.nii p.exr; exits 2 '--mip of projections is refused' ct-view --mip max p.exr no.png
done_testing
