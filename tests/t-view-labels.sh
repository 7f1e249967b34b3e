#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What ct-view writes on a picture: it is true, and the voxels beside it are as without.
. "$srcdir/tests/view.sh"
cat >look.py <<'END'
import numpy as np
from PIL import Image
def pic(name): return np.asarray(Image.open(name).convert("RGB")).astype(int)
FONT = "".join(chr(c) for c in range(32, 127) if c != ord(","))
def letters(text, scale=1):
    """Strokes of a text, out of a picture that has all letters above its slice."""
    p = pic("font.png")
    s = 1 + 320 // 256
    assert (p[:s * 14, :s * 2] == 0).all()
    at = [s * (2 + 6 * FONT.index(c)) for c in text]
    return np.kron(np.hstack([p[s * 2:s * 10:s, x:x + 6 * s:s, 0] > 127 for x in at])[:, :-1], np.ones((scale, scale))).astype(bool)
def says(p, text, y, x, scale=1):
    """Does the text stand at (y, x), white, on a black rim?"""
    t = letters(text, scale)
    box = p[y:y + t.shape[0], x:x + t.shape[1]]
    rim = np.zeros((t.shape[0] + 2 * scale, t.shape[1] + 2 * scale), bool)
    for i in range(2 * scale + 1):
        for j in range(2 * scale + 1):
            rim[i:i + t.shape[0], j:j + t.shape[1]] |= t
    black = rim[scale:-scale, scale:-scale] & ~t
    return t.sum() > 8 and (box[t] == 255).all() and (box[black] == 0).all()
END
# 40 voxels of 2 mm; the tiles are 160 pixels large, 44
ct-phantom -q --size 40x40x40 --spacing 2 marks v.nii && ct-phantom -q --size 20x20x20 --spacing 4 marks lr.nii &&
	ct-view -q -l -p axial -z 8 --names "$(py 'print(FONT)')" v.nii font.png || exit 99
exits 0 'labels are drawn with -l' ct-view -l -z 4 -w -1024:1000 v.nii l.png
ct-view -z 4 -w -1024:1000 v.nii plain.png
# 14 rows above, 488 of the picture; to the right 3 * 4 + 12 + 7 letters ("1000 HU")
is 'pic("l.png").shape == (14 + 488, 160 + 24 + 42, 3)' 'the size'
is '(lambda p, q: (p[14 + 90:14 + 130, 20:70] == q[90:130, 20:70]).all())(pic("l.png"), pic("plain.png"))' 'where no letters are'
is 'says(pic("l.png"), "v.nii", 2, 2)' 'the name'
is 'all(says(pic("l.png"), t, 14 + 164 * k + 1, 2) for k, t in enumerate(("axial z 1 mm", "coronal y 1 mm", "sagittal x 1 mm")))' \
	'plane and position'
sides='all(says(pic(f), s[i], y, x) for k, s in enumerate(("APRL", "SIRL", "SIAP")) for i, (y, x) in enumerate(((14 + 164 * k + 12, 77), (14 + 164 * k + 150, 77), (14 + 164 * k + 75, 2), (14 + 164 * k + 75, 153))))'
is "(lambda f: $sides)('l.png')" 'the sides of the patient'
# the bar: 2 cm are 40 pixels, 80 mm are 160
is '(lambda p: (p[14 + 156:14 + 158, 2:42] == 255).all() and (p[14 + 156:14 + 158, 42] == 0).all() and says(p, "2 cm", 14 + 145, 2))(pic("l.png"))' \
	'a scale bar of 2 cm'
is '(lambda p: not (p[14 + 164 + 156, 2:42] == 255).all())(pic("l.png"))' 'on the first slice alone'
ct-view -l -z 4 -p axial --names 'a picture as wide as what is above it' v.nii wide.png
is '(lambda p: p.shape[1] == 37 * 6 + 4 and says(p, "a picture as wide as what is above it", 2, 2))(pic("wide.png"))' 'as wide as a single name'
ct-view -f -l -z 4 -p axial --names 'a_name_that_is_wider_than_its_column,b' v.nii v.nii wide.png
is '(lambda p: p.shape[0] == 4 + 20 + 160 and says(p, "a_name_that_is_wider_than_", 2, 2) and says(p, "its_column", 12, 2) and says(p, "b", 2, 166))(pic("wide.png"))' 'a name wider than its column goes on in the next line'
# SVG: the picture in it is that of the PNG without letters, the words are text
exits 0 'labels are written as text in SVG' ct-view -l -z 4 -p axial -w -1024:1000 --names 'a<b,ü' v.nii v.nii l.svg
ct-view -f -z 4 -p axial -w -1024:1000 v.nii v.nii plain2.png
cat >svg.py <<'END'
import base64, io, sys
import xml.etree.ElementTree as et
import numpy as np
from PIL import Image
r = et.parse("l.svg").getroot()
text = [x.text for x in r if x.tag.endswith("text")]
assert all(t in text for t in ("a<b", "ü", "2 cm", "axial z 1 mm", "1000 HU", "A")), text
image = [x for x in r if x.tag.endswith("image")][0].get("href").split(",")[1]
q = np.asarray(Image.open(io.BytesIO(base64.b64decode(image))).convert("RGB"))
assert q.shape[:2] == (int(r.get("height")), int(r.get("width")))
p = np.asarray(Image.open("plain2.png").convert("RGB"))
assert (q[14:14 + 140, :p.shape[1]] == p[:140]).all() and (q[:14] == 0).all(), "pixels"
END
"$PY" svg.py 2>err; ok $? 'SVG holds the pixels of the PNG and the labels as text'; sed 's/^/# /' err
is '(lambda p: all(says(p, t, y, 160 + 4 + 12 + 4) for t, y in (("1000 HU", 14 + 4), ("-12", 14 + 4 + 236), ("-1024", 14 + 4 + 472))))(pic("l.png"))' \
	'the range of the window'
is '(lambda b: b[0] > 254 and b[-1] < 1 and (np.diff(b) <= 0).all() and abs(b[240] - 127) < 2)(pic("l.png")[18:498, 170, 0])' 'beside a bar of its greys'
ct-phantom -q --size 24x24x24 --spacing 5 marks w.nii; ct-view -l -p axial -z 10 w.nii w.png # a third are 40 mm
is '(lambda p: (p[14 + 236:14 + 238, 2:42] == 255).all() and (p[14 + 236:14 + 238, 42] == 0).all())(pic("w.png"))' 'and not of 5'
ct-phantom -q -f --size 24x24x24 --spacing 7 marks w.nii; ct-view -f -l -p axial -z 10 w.nii w.png # 56 mm
is '(lambda p: (p[14 + 236:14 + 238, 2:73] == 255).all() and (p[14 + 236:14 + 238, 73] == 0).all())(pic("w.png"))' 'but of 5 where that is less'
ct-phantom -q -f --size 24x24x24 --spacing .5 marks w.nii; ct-view -f -l -p axial -z 10 w.nii w.png # 4 mm
is '(lambda p: (p[14 + 236:14 + 238, 2:42] == 255).all() and (p[14 + 236:14 + 238, 42] == 0).all() and says(p, "2 mm", 14 + 225, 2))(pic("w.png"))' 'in mm where it is short'
ct-phantom -q -f --size 24x24x24 --spacing .2 marks w.nii; ct-view -f -l -p axial -z 10 w.nii w.png # 1.6 mm
is '(lambda p: (p[14 + 236:14 + 238, 2:52] == 255).all() and (p[14 + 236:14 + 238, 52] == 0).all() and says(p, "1 mm", 14 + 225, 2))(pic("w.png"))' 'of 1'
# any order and direction of axes
ct-view -l -z 4 -w -1024:1000 --slice 0.61 v.nii at.png
for o in LAS PSR IRA ARI; do
	ct-convert -q -f --reorient $o v.nii o.nii && ct-view -q -f -l -z 4 -w -1024:1000 --slice 0.61 --names v.nii o.nii o.png
	cmp -s at.png o.png; ok $? "a volume in $o: the same picture"
done
# turned by 30 degrees about z, as its affine says, and by 60, where the axes change places
cat >turn.py <<'END'
import math, struct, sys
b = bytearray(open("v.nii", "rb").read())
c, s = math.cos(math.radians(float(sys.argv[1]))), math.sin(math.radians(float(sys.argv[1])))
m = [struct.unpack_from("<4f", b, 280 + 16 * i) for i in range(3)]
r = [[c * x - s * y for x, y in zip(m[0], m[1])], [s * x + c * y for x, y in zip(m[0], m[1])], m[2]]
for i in range(3): struct.pack_into("<4f", b, 280 + 16 * i, *r[i])
struct.pack_into("<h", b, 252, 0)
open(sys.argv[2], "wb").write(b)
END
"$PY" turn.py 30 t30.nii && "$PY" turn.py 60 t60.nii && ct-view -l -z 4 t30.nii t30.png && ct-view -l -z 4 t60.nii t60.png
ok $? 'labels of oblique volumes say their sides'
is "all((lambda f: $sides)(f) for f in ('t30.png', 't60.png'))" 'have the nearest sides'
# the mark at L, density 0.2, is on the side that says L
is '(lambda p: abs(p[14 + 80, 126, 0] - p[14 + 80, 34, 0]) > 50)(pic("t30.png"))' 'which are not the same'
# errors: a bar of their own; names of ours; a slice elsewhere
exits 0 'error maps with labels' ct-view -l -e -z 4 -p axial --slice -20.5mm --names 'truth,half,a, b' v.nii lr.nii v.nii v.nii e.png
is '(lambda p: says(p, "truth", 2, 2) and says(p, "half", 2, 166) and says(p, "a", 2, 330) and says(p, " b", 2, 494))(pic("e.png"))' 'the texts'
is '(lambda p: says(p, "axial z -21 mm", 15, 2) and says(p, "axial z -22 mm", 15, 166) and says(p, "error axial z -22 mm", 14 + 165, 166))(pic("e.png"))' \
	'each the place of its own voxels'
is '(lambda p: says(p, "300 HU", 14 + 4, 652 + 20) and says(p, "125 HU", 14 + 162 + 4, 652 + 20) and says(p, "0", 14 + 162 + 4 + 146, 652 + 20))(pic("e.png"))' \
	'two bars'
is '(lambda grey, hot: grey.std() == 0 and hot[0] > 200 and hot[2] < 60)(*(pic("e.png")[y, 660] for y in (14 + 4 + 73, 14 + 162 + 4 + 73)))' 'of their colours'
for m in inferno signed; do ct-view -e -p axial --error-map $m lr.nii v.nii $m.png; done
"$PY" - <<'END' >err 2>&1
import numpy as np, struct
from PIL import Image
def vol(f, n):
    b = open(f, "rb").read()
    h = struct.unpack_from("<hh", b, 70)
    slope, inter = struct.unpack_from("<ff", b, 112)
    x = np.frombuffer(b, {4: "<i2", 16: "<f4", 512: "<u2"}[h[0]], n ** 3, int(struct.unpack_from("<f", b, 108)[0])).reshape(n, n, n).astype(float)
    return (x * slope + inter if slope else x)[n // 2, ::-1, ::-1]
d = vol("v.nii", 40) - np.kron(vol("lr.nii", 20), np.ones((2, 2)))
def table(t, points):
    p = np.array(points, float)
    return np.stack([np.interp(np.clip(t, 0, 1), np.linspace(0, 1, len(p)), p[:, c]) for c in range(3)], -1)
inferno = table(abs(d) / 125, [[int(h[i:i + 2], 16) for i in (0, 2, 4)] for h in "000004 280b54 65156e 9f2a63 d44842 f57d15 fac127 fcffa4".split()])
signed = table((d + 125) / 250, [[int(h[i:i + 2], 16) for i in (0, 2, 4)] for h in "3b4cc0 6282ea 8db0fe b8d0f9 dddddd f5c4ad f49a7b de604d b40426".split()])
assert (d > 20).any() and (d < -20).any()
for name, want in ("inferno", inferno), ("signed", signed):
    p = np.asarray(Image.open(name + ".png")).astype(float)[44:84, 44:84]
    assert abs(p - want).max() <= 0.51, (name, abs(p - want).max())
END
ok $? 'colours of errors, pixel by pixel'; sed 's/^/# /' err
# projections: no sides, their views
ct-project -q --views 6 --det 60x50 v.nii p.exr && ct-view -l -z 3 --views 2 p.exr p.png
ok $? 'labels of projections say their views'
is '(lambda p: says(p, "p.exr", 2, 2) and says(p, "view 0", 15, 2) and says(p, "view 3", 15, 186))(pic("p.png"))' 'with their views'
for bad in a a,b,c ''; do exits 2 "--names '$bad' of two files" ct-view -l --names "$bad" v.nii lr.nii no.png; done
has err "^ct-view: --names: expected 2 names, one for each file, not ''$" 'the error of an empty --names says how many'
ct-phantom -q --size 40x8x80 --spacing 2 marks tall.nii; ct-view -l -p coronal -z 4 tall.nii tall.png
is 'pic("tall.png").shape[0] == 14 + 320' 'letters as high as the shorter side wants'
exits 0 'a picture smaller than its labels' ct-view -l -p axial -z 0.1 v.nii small.png
is 'pic("small.png").shape[0] == 14 + 5 * 10' 'is as tall as its bar'
done_testing
