#!/bin/sh
# ct-view --surface: shapes whose shading has a closed form.
. "$srcdir/tests/view.sh"
cat >look.py <<'END'
import struct
import numpy as np
from PIL import Image
def pic(f):
    p = np.asarray(Image.open(f).convert("RGB")).astype(float)
    assert (p[..., 0] == p[..., 2]).all()
    return p[..., 0] / 255
def tile(n, m, k): # middles of pixels, in mm of a picture of n x m pixels of k mm
    return np.meshgrid((np.arange(n) + 0.5) * k - n * k / 2, (np.arange(m) + 0.5) * k - m * k / 2, indexing="ij")
def ball(f, top, y0, x0, r, n, m, k, tol):
    y, x = tile(n, m, k)
    d2 = ((y - y0) ** 2 + (x - x0) ** 2) / r ** 2
    want = np.where(d2 < 1, 0.15 + 0.85 * np.sqrt(np.maximum(1 - d2, 0)), 0)
    p = pic(f)[top:top + n, :m]
    sure = (abs(np.sqrt(d2) - 1) * r > 0.4) # but for the rim
    return abs(p - want)[sure].max() < tol and sure.mean() > 0.8
# a field of x, y, z in mm; voxels of 1, 1.5, 2 mm, 40 x 30 x 24 of them
z, y, x = np.meshgrid((np.arange(24) - 11.5) * 2, (np.arange(30) - 14.5) * 1.5, np.arange(40) - 19.5, indexing="ij")
def vol(field, name):
    b = bytearray(open("f.nii", "rb").read())
    at = int(struct.unpack_from("<f", b, 108)[0])
    b[at:at + 4 * x.size] = field.astype("<f4").tobytes()
    open(name, "wb").write(b)
END
ct-phantom -q --size 40x30x24 --spacing 1,1.5,2 marks f0.nii && ct-convert -q --type f32 f0.nii f.nii || exit 99
# the distance to a ball: trilinear values are nearly it, whatever the spacing
py 'vol(10 * (12 - np.sqrt((x - 3) ** 2 + (y + 2) ** 2 + (z - 4) ** 2)), "ball.nii")' || exit 99
exits 0 'a ball' ct-view --surface 0 -z 2 ball.nii ball.png
# from below: x runs to the left, y up; rows of 1.5 mm fill pixels of 0.5
is 'ball("ball.png", 0, 2, -3, 12, 90, 80, 0.5, 0.04)' 'axial: Lambert and where it is'
is 'ball("ball.png", 94, -4, -3, 12, 96, 80, 0.5, 0.04)' 'coronal'
is 'ball("ball.png", 194, -4, 2, 12, 96, 90, 0.5, 0.04)' 'sagittal'
for o in LPS IRA SLA; do
	ct-convert -q -f --reorient $o ball.nii o.nii && ct-view -q -f --surface 0 -z 2 o.nii o.png
	"$PY" - <<'END' 2>err
import numpy as np
from PIL import Image
a, b = (np.asarray(Image.open(f)).astype(int) for f in ("ball.png", "o.png"))
assert a.shape == b.shape and abs(a - b).max() <= 1, abs(a - b).max()
END
	ok $? "in $o"; sed 's/^/# /' err
done
# a plane, z = 3 + x / 2: bright as 1 / sqrt(1 + 1/4), exact but at the edges
py 'vol((z - 3 - x / 2) * 7, "plane.nii")' && ct-view -p axial --surface 0 plane.nii plane.png
is 'abs(pic("plane.png")[3:-3, 3:-3] - (0.15 + 0.85 / np.sqrt(1.25))).max() < 0.003' 'a tilted plane from below'
py 'vol((-y - 3 - x / 2) * 7, "thick.nii")' && ct-convert -q --crop 0:40,0:30,11:12 thick.nii one.nii && ct-view -p coronal --surface 0 one.nii one.png
is 'abs(np.median(pic("one.png")) - (0.15 + 0.85 / np.sqrt(1.25))).max() < 0.01' 'one slice has no slope across'
# which side is nearer: of two plates the one in front hides the other, which is at an angle
hides() { # hides PLANE EYE FIELD
	py "vol($3, 'h.nii')" && ct-view -q -f -p "$1" --surface 1 h.nii h.png
	is 'abs(pic("h.png") - 1).max() < 0.003' "$1 from $2"
}
hides axial below 'np.maximum(5 - abs(z + 12), 5 - abs(z - 12 - x / 3))'
hides coronal 'the front' 'np.maximum(5 - abs(y - 12), 5 - abs(y + 12 - x / 3))'
hides sagittal 'the left' 'np.maximum(5 - abs(x + 12), 5 - abs(x - 12 - y / 3))'
py 'vol(np.where(x > 0, 100 - z - x / 2, -50), "cut.nii")' && ct-view -p axial --surface 0 cut.nii cut.png
is '(pic("cut.png")[:, :19] == 1).all() and (pic("cut.png")[:, 21:] == 0).all()' 'cut where the volume begins, black where nothing is'
py 'vol(np.where((z < 0) & (x < 0), np.nan, 10 * (z - 5)), "nan.nii")' && ct-view -p axial --surface 0 nan.nii nan.png
is 'abs(pic("nan.png")[:, :18] - 1).max() < 0.003 and abs(pic("nan.png")[:, 22:] - 1).max() < 0.003' 'what is not a number is no surface'
ct-view -q -t 3 --surface 0 -z 2 ball.nii three.png; cmp -s ball.png three.png; ok $? 'the same with three threads'
exits 0 'a small picture' ct-view -p axial --surface 0 -z 0.016 cut.nii tiny.png
is 'pic("tiny.png").shape == (1, 1)' 'has a pixel'
exits 0 'labels' ct-view -l -z 3 -p coronal --surface 250 ball.nii l.png
is 'pic("l.png").shape == (14 + 144, 120)' 'have no colour bar'
ct-phantom -q --size 600x8x8 marks long.nii; exits 3 'absurdly large' ct-view --surface 0 -z 64 -p axial long.nii no.png
ct-project -q -n 2 --det 8 f.nii p.exr; exits 2 'of projections' ct-view --surface 3 p.exr no.png
done_testing
