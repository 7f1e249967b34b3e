#!/bin/sh
# ct-view --profile: values between voxels against numpy, the plot, the line on the slices.
. "$srcdir/tests/view.sh"
cat >look.py <<'END'
import csv, struct
import numpy as np
from PIL import Image
def vol(f):
    b = open(f, "rb").read()
    n = struct.unpack_from("<3h", b, 42)
    m = np.array(struct.unpack_from("<12f", b, 280), float).reshape(3, 4)
    return np.frombuffer(b, "<f4", np.prod(n), int(struct.unpack_from("<f", b, 108)[0])).reshape(n[::-1]).T.astype(float), m
def linear(f, at):
    """Of a volume at one place, in its own words."""
    v, m = vol(f)
    x = np.linalg.solve(m[:, :3], np.array(at) - m[:, 3])
    if (x < -0.5 - 1e-6).any() or (x > np.array(v.shape) - 0.5 + 1e-6).any(): return np.nan
    x = np.clip(x, 0, np.array(v.shape) - 1)
    k = np.minimum(np.floor(x).astype(int), np.array(v.shape) - 2)
    t = x - k
    for a in range(3):
        v = np.take(v, k[a], 0) * (1 - t[a]) + np.take(v, k[a] + 1, 0) * t[a]
    return v
def table(f):
    rows = list(csv.reader(open(f)))
    return rows[0], np.array([[float(x) if x else np.nan for x in r] for r in rows[1:]])
def pic(f): return np.asarray(Image.open(f).convert("RGB")).astype(int)
END
ct-phantom -q --size 20x24x28 --spacing 2,3,4 -s 5 ellipsoids v0.nii && ct-convert -q --type f32 v0.nii v.nii &&
	ct-convert -q --crop 4:16,4:20,3:25 v.nii c1.nii && ct-convert -q --type f32 --reorient LSA c1.nii c.nii || exit 99
from=-15,30.5,-20 to=30,-20,17
exits 0 'a profile' ct-view -p axial --profile $from:$to --profile-csv p.csv --names 'a,b' -l v.nii c.nii p.png
is '(lambda h, t: h == ["mm", "x", "y", "z", "a", "b"] and len(t) == int(np.ceil(np.linalg.norm([45, 50.5, 37]))) + 1)(*table("p.csv"))' \
	'columns, and places 1 mm apart'
is '(lambda h, t: np.allclose(t[0, :4], [0, -15, 30.5, -20]) and np.allclose(t[-1, :4], [np.linalg.norm([45, 50.5, 37]), 30, -20, 17]) and np.allclose(np.diff(t[:, :4], axis=0).std(0), 0, atol=1e-6))(*table("p.csv"))' \
	'evenly from end to end'
is '(lambda h, t: all(np.allclose(t[:, 4 + c], [linear(f, r[1:4]) for r in t], equal_nan=True, rtol=1e-6, atol=1e-3) for c, f in enumerate(("v.nii", "c.nii"))))(*table("p.csv"))' \
	'trilinear, of volumes in any order of axes'
is '(lambda h, t: np.isnan(t[:, 5]).any() and np.isnan(t[:, 4]).any() and (~np.isnan(t[:, 5])).sum() > 20 and np.nanstd(t[:, 4]) > 50)(*table("p.csv"))' \
	'empty outside of a volume'
# the line in a slice: y = 1.5 is a row of middles, from the patient's right (x = 10) to the left
exits 0 'in a slice' ct-view -p axial --slice 2mm --profile 10,1.5,2:-14,1.5,2 v.nii line.png
is '(lambda p: p.shape == (36 + 140, 240, 3) and (lambda q: {r for r in np.nonzero(q)[0]} == {17} and list(np.nonzero(q[17])[0]) == list(range(5, 18)))((p[:36, :20] == (255, 255, 0)).all(2)))(pic("line.png"))' \
	'the line is where it is, and its plot below'
is '(lambda p, q: (p[:36, :20] == q)[np.arange(36) != 17].all())(pic("line.png"), (__import__("subprocess").run("ct-view -q -f -p axial --slice 2mm v.nii bare.png", shell=True), pic("bare.png"))[1])' \
	'and nowhere else'
exits 0 'between two slices' ct-view -p axial --slice 2mm,6mm --profile 10,1.5,4:-14,1.5,4 v.nii between.png
is '(lambda q: q[17].sum() > 12 and q[:36, :20].sum() == 13 and q[:36, 24:].sum() == 13)((pic("between.png")[:36] == (255, 255, 0)).all(2))' \
	'it leaves the voxels of neither'
exits 0 'in the next one' ct-view -f -p axial --slice 6mm --profile 10,1.5,2:-14,1.5,2 v.nii other.png
is 'not (pic("other.png")[:36] == (255, 255, 0)).all(2).any()' 'it is not'
ct-view -f -p axial --slice 2mm --profile 10,1.5,2:-14,1.5,20 v.nii other.png
is 'not (pic("other.png")[:36] == (255, 255, 0)).all(2).any()' 'nor where it leaves its voxels'
# a ramp along x, -200 to 200 HU, is a straight line of the plot
"$PY" - <<'END'
import struct
b = bytearray(open("v.nii", "rb").read())
at = int(struct.unpack_from("<f", b, 108)[0])
x0, = struct.unpack_from("<f", b, 292)
dx, = struct.unpack_from("<f", b, 280)
for k in range(20 * 24 * 28):
    struct.pack_into("<f", b, at + 4 * k, 10 * (x0 + dx * (k % 20)))
open("ramp.nii", "wb").write(b)
END
ct-view -p axial --slice 2mm --profile=-19,1.5,2:19,1.5,2 ramp.nii ramp.png
is '(lambda p: (lambda y, x: len(set(x)) > 180 and abs(np.polyfit(x, y, 1)[0] + (140 - 28) / (240 - 52)) < 0.01 and abs(y - np.polyval(np.polyfit(x, y, 1), x)).max() < 1.5)(*np.nonzero((p[36 + 14:, 49:] == (230, 159, 0)).all(2))))(pic("ramp.png"))' \
	'a ramp is straight'
# a constant is in the middle; what is outside is not drawn; names, each in the colour of its curve
"$PY" - <<'END'
b = open("ramp.nii", "rb").read()
open("constant.nii", "wb").write(b[:-4 * 20 * 24 * 28] + bytes(4 * 20 * 24 * 28))
END
ct-view -p axial --slice 2mm --profile=-19,1.5,2:19,1.5,2 constant.nii constant.png
is '(lambda y, x: set(y) == {56} and len(x) > 180)(*np.nonzero((pic("constant.png")[36 + 14:, 49:] == (230, 159, 0)).all(2)))' 'a constant is a level line'
ct-view -p axial --slice 2mm --profile=-59,1.5,2:19,1.5,2 ramp.nii constant.nii outside.png
is '(lambda y, x: len(x) > 80 and abs(x.min() - 94) < 3)(*np.nonzero((pic("outside.png")[36 + 14:, 48:] == (230, 159, 0)).all(2)))' 'nothing is drawn outside'
is '(lambda p: all((lambda x: len(x) > 20 and x.min() >= a and x.max() < b)(np.nonzero((p[38:46] == c).all(2))[1]) for c, a, b in (((230, 159, 0), 48, 96), ((86, 180, 233), 108, 180))))(pic("outside.png"))' \
	'names in the colours of their files'
ct-convert -q --reorient AIL v.nii o.nii && ct-view -q -f --profile $from:$to --profile-csv o.csv v.nii o.png && cp o.csv o1.csv && ct-view -q -f --profile $from:$to --profile-csv o.csv o.nii o.png
is 'np.allclose(table("o.csv")[1], table("o1.csv")[1], equal_nan=True, atol=1e-3)' 'of the least spacing, whichever axis it is'
ct-view -q --profile 0,0,0:99999,0,0 --profile-csv most.csv v.nii most.png; [ "$(wc -l <most.csv)" = 100001 ]; ok $? '100000 places'
exits 2 'one more' ct-view --profile 0,0,0:100000,0,0 v.nii no.png
ct-view -q --profile 0,0,0:0,0,0 --profile-csv point.csv v.nii point.png
is '(lambda h, t: t.shape == (1, 5) and abs(t[0, 4] - linear("v.nii", (0, 0, 0))) < 1e-3)(*table("point.csv"))' 'a point'
ct-view -q --profile 0,0,0:9,0,0 --profile-csv quoted.csv -l --names 'a "b",c' v.nii v.nii quoted.png
is 'table("quoted.csv")[0][4:] == ["a \"b\"", "c"]' 'names in quotes'
ct-view -q --profile 0,0,0:9,0,0 --profile-csv - v.nii pipe.png >pipe.csv; cmp -s pipe.csv /dev/null; [ $? -eq 1 ]; ok $? 'to a pipe'
exits 5 'beside the volume' ct-view --profile 900,0,0:950,0,0 v.nii no.png
has err '^ct-view: the profile is outside of the volumes$' 'is told'
for bad in 1,2,3 1,2,3: 1,2:3,4,5 1,2,3:4,5,x :; do exits 2 "--profile $bad" ct-view --profile $bad v.nii no.png; done
exits 2 'one without end' ct-view --profile 0,0,0:1e9,0,0 v.nii no.png
ct-project -q -n 2 --det 8 v.nii p.exr; exits 2 'of projections' ct-view --profile 0,0,0:1,0,0 p.exr no.png
exits 2 'table and picture in one pipe' ct-view --profile 0,0,0:9,0,0 --profile-csv - v.nii -
done_testing
