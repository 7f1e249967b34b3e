#!/bin/sh
# ct-view --gaussians: ellipses of closed form, in the picture and nowhere else.
. "$srcdir/tests/view.sh"
cat >look.py <<'END'
import struct
import numpy as np
from PIL import Image
names = "x y z nx ny nz f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3 density".split()
def ply(path, *g): # (centre, deviations, quaternion, density)
    with open(path, "wb") as f:
        f.write(("ply\nformat binary_little_endian 1.0\ncomment ct:units=mm\ncomment ct:activation=prelu\ncomment ct:gamma=0.5\ncomment ct:step=1\nelement vertex %d\n" % len(g) +
            "".join("property float %s\n" % n for n in names) + "end_header\n").encode())
        for p, s, q, z in g:
            f.write(struct.pack("<18f", *p, *[0] * 7, *np.log(s), *q, z))
def pic(f): return np.asarray(Image.open(f).convert("RGB")).astype(int)
def places(f, rgb, top=0, left=0, h=160, w=160):
    """Middles of the pixels of a colour, mm down and to the right from the middle of a tile of 40 mm."""
    y, x = np.nonzero((pic(f)[top:top + h, left:left + w] == rgb).all(2))
    return (y + 0.5) / 4 - 20, (x + 0.5) / 4 - 20
BLUE, ORANGE = (86, 180, 233), (230, 159, 0)
def ring(f, rgb, centre, half, angle=0, **where):
    """Are all pixels of the colour on this ellipse, and all directions there?"""
    y, x = places(f, rgb, **where)
    y, x = y - centre[0], x - centre[1]
    c, s = np.cos(angle), np.sin(angle)
    a, b = (c * y + s * x) / half[0], (c * x - s * y) / half[1]
    off = abs(np.hypot(a, b) - 1) * min(half)
    turn = np.unique(np.round(np.arctan2(a, b) * 12 / np.pi))
    return len(y) > 40 and off.max() < 0.36 and len(turn) >= 24
END
ct-phantom -q --size 20x20x20 --spacing 2 marks v.nii || exit 99
# a sphere of 5 mm at (3, -4, 2); an ellipsoid of 8, 4, 2 mm along x, y, z at (-6, 5, 0), negative
py 'ply("g.ply", ((3, -4, 2), (5, 5, 5), (1, 0, 0, 0), 0.1), ((-6, 5, 0), (8, 4, 2), (1, 0, 0, 0), -0.1))' || exit 99
# the voxels of z = 1: 1 mm from both middles; x runs to the left, y up
exits 0 'two Gaussians' ct-view -p axial --slice 1mm -z 8 --gaussians g.ply v.nii g.png
is 'ring("g.png", ORANGE, (4, -3), (24 ** 0.5, 24 ** 0.5))' 'a sphere: a circle of sqrt(r^2 - d^2)'
is 'ring("g.png", BLUE, (-5, 6), (4 * 0.75 ** 0.5, 8 * 0.75 ** 0.5))' 'an ellipsoid: an ellipse; negative is blue'
ct-view -q -z 8 -p coronal --slice 4.5mm --gaussians g.ply v.nii far.png # voxels at 5: 9 mm from the sphere
is 'len(places("far.png", ORANGE)[0]) == 0 and ring("far.png", BLUE, (0, 6), (2, 8))' 'one that is not cut is not there'
ct-view -q -f -z 8 --slice -4mm -p coronal --gaussians g.ply v.nii cor.png # voxels from -4 to -2: middle at -3
is 'ring("cor.png", ORANGE, (-2, -3), (24 ** 0.5, 24 ** 0.5))' 'in a coronal slice'
# turned by 30 degrees about z; tilted by 40 about x, where the middle of the ellipse moves
py 'ply("t.ply", ((0, 0, 1), (10, 3, 5), (np.cos(np.pi / 12), 0, 0, np.sin(np.pi / 12)), 0.1), ((0, 0, 3), (3, 2, 6), (np.cos(np.pi / 9), np.sin(np.pi / 9), 0, 0), -0.1))' || exit 99
exits 0 'turned ones' ct-view -p axial --slice 1mm -z 8 -g t.ply v.nii t.png
is 'ring("t.png", ORANGE, (0, 0), (3, 10), -np.pi / 6)' 'about the axis across the slice'
is '(lambda a: (lambda S: ring("t.png", BLUE, (-S[0, 1] / S[1, 1] * -2, 0), (np.sqrt((S[0, 0] - S[0, 1] ** 2 / S[1, 1]) * (1 - 4 / S[1, 1])), 3 * np.sqrt(1 - 4 / S[1, 1]))))((lambda R: R @ np.diag([4, 36]) @ R.T)(np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]))))(np.radians(40))' \
	'about one in it: the conditional ellipse'
py 'ply("large.ply", ((1, 1, 1), (17, 17, 17), (1, 0, 0, 0), 0.1))' || exit 99
ct-view -q -p axial --slice 1mm -z 8 -g large.ply v.nii large.png # a voxel is 16 pixels
is 'ring("large.png", ORANGE, (-1, -1), (17, 17))' 'a large circle is round'
for o in LPS SAR; do
	ct-convert -q -f --reorient $o v.nii o.nii && ct-view -q -f -p axial --slice 1mm -z 8 -g t.ply o.nii o.png
	cmp -s t.png o.png; ok $? "a volume in $o: the same picture"
done
ct-view -q -e -p axial --slice 1mm -z 8 --gaussians g.ply v.nii v.nii e.png
is 'all(ring("e.png", ORANGE, (4, -3), (24 ** 0.5, 24 ** 0.5), top=t, left=l) for t, l in ((0, 0), (0, 324 - 160), (164, 164)))' 'on every slice and error map'
ct-view -q -p axial --slice 1mm -z 8 v.nii bare.png
is '(lambda p, q: ((p != q).any(2) == ((p == ORANGE) | (p == BLUE)).all(2)).all() and (p != q).any())(pic("g.png"), pic("bare.png"))' 'nothing else is drawn over'
exits 3 'what is no Gaussians' ct-view --gaussians v.nii v.nii no.png
has err 'v.nii: a volume, not Gaussians' 'is refused'
ct-project -q -n 2 --det 8 v.nii p.exr; exits 2 'on projections' ct-view --gaussians g.ply p.exr no.png
done_testing
