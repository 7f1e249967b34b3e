#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-view draws patients the way radiologists look at them.
. "$srcdir/tests/tap.sh"
python=no; command -v python3 >/dev/null && python=yes
cat >png.py <<'END'
import struct, sys, zlib
def read(path): # 8-bit RGB, not interlaced
	b = open(path, "rb").read()
	assert b[:8] == b"\x89PNG\r\n\x1a\n"
	at, data = 8, b""
	while at < len(b):
		n, kind = struct.unpack(">I4s", b[at:at + 8])
		if kind == b"IHDR":
			w, h, depth, colour = struct.unpack(">IIBB", b[at + 8:at + 18])
			assert (depth, colour) == (8, 2), (depth, colour)
		if kind == b"IDAT":
			data += b[at + 8:at + 8 + n]
		at += 12 + n
	data, rows, old, n = zlib.decompress(data), [], bytes(3 * w), 3 * w
	for y in range(h):
		f, line = data[y * (n + 1)], bytearray(data[y * (n + 1) + 1:(y + 1) * (n + 1)])
		for i in range(n):
			a, up, c = (line[i - 3] if i > 2 else 0), old[i], (old[i - 3] if i > 2 else 0)
			p = a + up - c
			paeth = min((abs(p - a), 0, a), (abs(p - up), 1, up), (abs(p - c), 2, c))[2]
			line[i] = (line[i] + (0, a, up, (a + up) // 2, paeth)[f]) & 255
		rows.append([tuple(line[3 * x:3 * x + 3]) for x in range(w)])
		old = line
	return rows
END
run() { # run NAME: Python from standard input
	if [ "$python" = yes ]; then
		{ echo 'from png import *'; cat; } >t.py; python3 t.py 2>err; ok $? "$1"; sed 's/^/# /' err
	else
		cat >/dev/null; skip "$1" 'no python3'
	fi
}
# what is drawn: density 0.7 0.2 0.5 0.3 0.6 0.4 at R L A P S I, 0.6 of the half extent from the middle
ct-phantom --size 40x40x40 marks v.nii || exit 99
exits 0 'ct-view draws three planes of a volume' ct-view --window -1024:3071 v.nii v.png
run 'all six sides of a patient are where radiologists expect them' <<'END'
p = read("v.png")
assert (len(p), len(p[0])) == (128, 40), (len(p), len(p[0]))
R, L, A, P, S, I = (round(255 * d) for d in (0.7, 0.2, 0.5, 0.3, 0.6, 0.4))
for top, (up, down, left, right) in ((0, (A, P, R, L)), (44, (S, I, R, L)), (88, (S, I, A, P))):
	got = [p[top + y][x][0] for y, x in ((8, 20), (31, 20), (20, 8), (20, 31))]
	assert all(abs(g - w) <= 1 for g, w in zip(got, (up, down, left, right))), (top, got)
assert p[41][20] == (0, 0, 0)
END
exits 4 'ct-view does not overwrite a picture' ct-view v.nii v.png
exits 0 'ct-view -f overwrites a picture' ct-view -f v.nii v.png
exits 0 'ct-view draws one plane twice as large' ct-view -p coronal -z 2 v.nii c.png
ct-view -p coronal -z 2 - - <v.nii >d.png; ok $? 'ct-view reads and writes pipes'
cmp -s c.png d.png; ok $? 'a picture through pipes has the same bytes'
run 'a picture of --zoom 2 has twice the pixels' <<'END'
p = read("c.png")
assert (len(p), len(p[0])) == (80, 80)
assert all(p[y][x] == p[y ^ 1][x ^ 1] for y in range(80) for x in range(80))
END
ct-phantom --size 20x20x20 --spacing 4 marks lr.nii || exit 99
exits 0 'ct-view -e draws volumes of two spacings with error maps' ct-view -e -w -1024:3071 -o e.png v.nii lr.nii v.nii
run 'volumes of two spacings have one scale, and errors at edges only' <<'END'
p = read("e.png")
assert (len(p), len(p[0])) == (6 * 40 + 5 * 4, 3 * 40 + 2 * 4)
for y in list(range(132, 172)) + list(range(176, 216)):
	assert all(q == (0, 0, 0) for q in p[y][:40]), y
	assert all(q == (0, 0, 0) for q in p[y][88:]), y
errors = sum(q != (0, 0, 0) for y in range(132, 172) for q in p[y][44:84])
assert 20 < errors < 400, errors
assert all(p[y][44 + x] == p[y ^ 1][44 + (x ^ 1)] for y in range(40) for x in range(40))
END
if [ "$python" = yes ]; then # 10 m to the left
	python3 -c 'import struct
b = bytearray(open("lr.nii", "rb").read())
for at in 268, 292: b[at:at + 4] = struct.pack("<f", 1e4)
open("far.nii", "wb").write(b)'
	exits 5 'an error map of volumes that do not overlap is refused with status 5' ct-view -e -p axial v.nii lr.nii far.nii m.png
	has err '^ct-view: file 3 does not overlap with the first' 'the error of volumes that do not overlap gives the file'
	exits 0 'a volume that is shown in one plane may lie outside of the others' ct-view v.nii far.nii some.png
	exits 5 'a volume that is shown nowhere is refused with status 5' ct-view -p sagittal v.nii lr.nii far.nii m.png
	has err '^ct-view: file 3 has no voxels where the first is cut' 'the error of a volume that is shown nowhere gives the file'
else
	skip 'an error map of volumes that do not overlap is refused' 'no python3'
fi
# projections
ct-project --views 10 --det 24x20 v.nii p.exr || exit 99
exits 0 'ct-view draws five views of a stack' ct-view --views 5 p.exr p.png
run 'five views are drawn in three columns' <<'END'
p = read("p.png")
assert (len(p), len(p[0])) == (2 * 20 + 4, 3 * 24 + 2 * 4), (len(p), len(p[0]))
assert all(q == (0, 0, 0) for q in p[30][56:])
assert max(q[0] for row in p for q in row) == 255 and p[0][0] == (0, 0, 0)
END
exits 0 'ct-view -e draws two stacks' ct-view --views 3 -e p.exr p.exr q.png
# refusals, memory
exits 2 'a volume and a stack in one picture are refused with status 2' ct-view v.nii p.exr m.png
has err 'v.nii is a volume but p.exr is a stack' 'the error of a volume and a stack names both'
exits 2 'an output that is not PNG is refused with status 2' ct-view v.nii m.nii
exits 2 'a picture without an input is refused with status 2' ct-view m.png
exits 2 '-e with a single volume is refused with status 2' ct-view -e v.nii m.png
exits 2 'an empty window is refused with status 2' ct-view -w 5:5 v.nii m.png
printf 'hello' >t.txt
exits 3 'a text file is refused by ct-view with status 3' ct-view t.txt m.png
[ ! -e m.png ]; ok $? 'refused runs of ct-view leave no picture'
# too little memory, from what the loader needs up (127: it is below) to enough; a library may abort (134, 139)
if (ulimit -v 4000000 && exec ct-view --version) >/dev/null 2>&1; then
	codes=
	for k in 250 300 350 375 400 405 410 415 420 425 430 440 450 475 500 600; do
		codes=$codes\ $( (ulimit -v ${k}000; ct-view -f v.nii low.png; echo $?) 2>err )
	done
	echo "$codes" | grep -qxE '( (0|1|7|127|134|139))+'; ok $? "too little memory ends ct-view with a known status:$codes"
	[ "${codes##* }" = 0 ] && [ -s low.png ]; ok $? 'with enough memory ct-view draws the picture'
else
	skip 'too little memory ends ct-view with a known status' 'a sanitizer takes more than any limit'
fi

# ct-view pixel by pixel: which slice and which view, and the tones of HU, densities and the rest; the blur
# that ct-ddnm assumes, and what it takes for white.
part tones
command -v python3 >/dev/null || { skip 'ct-view pixel by pixel' 'no python3'; done_testing; }
cp "$srcdir/tests/exr.py" .
cp ../png.py .
cat >look.py <<'END'
"""What is asked of pictures and volumes; True ends with 0."""
import exr, png, math, struct, subprocess, sys
N = 20
def vol(name):
    b = open(name, 'rb').read()
    at = int(struct.unpack_from('<f', b, 108)[0])
    return struct.unpack_from('<%df' % N ** 3, b, at)
def axial(name, z):
    v = vol(name)
    return [[v[(z * N + N - 1 - r) * N + N - 1 - c] for c in range(N)] for r in range(N)]
def coronal(name, y):
    v = vol(name)
    return [[v[((N - 1 - r) * N + y) * N + N - 1 - c] for c in range(N)] for r in range(N)]
def sagittal(name, x):
    v = vol(name)
    return [[v[((N - 1 - r) * N + N - 1 - c) * N + x] for c in range(N)] for r in range(N)]
def view(name, k, w):
    v = exr.read(name)[k]
    return [list(v[i:i + w]) for i in range(0, len(v), w)]
def span(*pictures):
    x = [v for p in pictures for row in p for v in row]
    return min(x), max(x)
def tones(picture, window):
    lo, hi = window
    return [[255 * min(max((v - lo) / (hi - lo), 0), 1) for v in row] for row in picture]
def minus(a, b):
    return [[abs(x - y) for x, y in zip(p, q)] for p, q in zip(a, b)]
def shows(name, top, left, picture, window, heat=False):
    """Do the pixels at (top, left) have these tones? Of a map of differences the red does three times."""
    lo, hi = window
    want = tones(picture, (lo, lo + (hi - lo) / 3) if heat else window)
    p = png.read(name)
    off = max(abs(p[top + r][left + c][0] - x) for r, row in enumerate(want) for c, x in enumerate(row))
    if off > 0.51:
        print(name, top, left, 'off by', off, file=sys.stderr)
    return off <= 0.51
ok = eval(sys.argv[1])
sys.exit(not ok)
END
is() { python3 look.py "$1" 2>err; ok $? "$2"; sed 's/^/# /' err; } # is EXPRESSION NAME
# slices and tones of volumes
if command -v ct-view >/dev/null; then
	ct-phantom -q --size 20x20x20 --spacing 4 ellipsoids v0.nii && ct-convert -q --type f32 v0.nii v.nii &&
		ct-phantom -q --size 20x20x20 --spacing 4 marks m0.nii && ct-convert -q --type f32 m0.nii m.nii &&
		ct-project -q -n 7 --det 20 v.nii p.exr && ct-project -q -n 7 --det 20 m.nii q.exr &&
		ct-fdk -q --quantity density -m cgls -n 3 p.exr d.nii &&
		tail -c 32000 v.nii >raw && ct-convert -q --raw 20x20x20:f32:4 --orient RAS raw bare.nii &&
		ct-compose -q --residual-out r.nii bare.nii bare.nii sum.nii
	ok $? 'volumes and projections for this test are made'
	for f in v m d r; do ct-view $f.nii $f.png; done
	is 'all(shows(f + ".png", t, 0, p(f + ".nii", 10), (-200, 300)) for f in "vm" for t, p in ((0, axial), (24, coronal), (48, sagittal)))' \
		'HU are drawn from -200 to 300, in the middle slices'
	is 'shows("d.png", 0, 0, axial("d.nii", 10), (0, 1)) and len(png.read("d.png")) == 68' 'densities are drawn from 0 to 1'
	is 'shows("r.png", 24, 0, coronal("r.nii", 10), span(*(p("r.nii", 10) for p in (axial, coronal, sagittal))))' \
		'a residual is drawn from its least to its largest shown value'
	for f in 0 0.26 1; do ct-view -p axial --slice $f v.nii s$f.png; done
	is 'all(shows("s%s.png" % f, 0, 0, axial("v.nii", z), (-200, 300)) for f, z in (("0", 0), ("0.26", 5), ("1", 19)))' '--slice F draws the slice at that fraction'
	is 'len(png.read("s0.png")) == 20' '-p axial draws one slice alone'
	# several: 20 voxels of 4 mm, the middle one from 0 to 4 mm; a square of one plane, rows of three, files in columns
	ct-view -p axial --slice 0.26,-37.9mm,0.1e1,-0.1mm,0.1mm v.nii l.png
	is 'all(shows("l.png", k // 3 * 24, k % 3 * 24, axial("v.nii", z), (-200, 300)) for k, z in enumerate((5, 0, 19, 9, 10)))' \
		'--slice accepts a list of fractions and millimetres'
	ct-view --slices 4 v.nii n.png; ct-view --slices 4 -p sagittal v.nii m.nii nm.png; ct-view --slices 1 v.nii one.png
	is 'all(shows("n.png", t, k * 24, p("v.nii", z), (-200, 300)) for k, z in enumerate((2, 7, 12, 17)) for t, p in ((0, axial), (24, coronal), (48, sagittal)))' \
		'--slices draws each plane in a row of its own'
	is 'all(shows("nm.png", k * 24, c * 24, sagittal(f, z), (-200, 300)) for k, z in enumerate((2, 7, 12, 17)) for c, f in enumerate(("v.nii", "m.nii")))' \
		'--slices of two files draws each slice in a row of its own'
	cmp v.png one.png; ok $? '--slices 1 draws the middle slice'
	exits 5 'a slice outside of the volume is refused with status 5' ct-view --slice 40.1mm v.nii no.png
	has err '^ct-view: 40.1 mm lies outside of the first file' 'the error of a slice outside of the volume repeats its place'
	for f in 1.1 -0.1 '' 0.5, 0.5m 0.5mmm , nan 0.5:0.6; do
		exits 2 "--slice '$f' is refused with status 2" ct-view --slice "$f" v.nii no.png
	done
# windows
	ct-view -p sagittal -w -1000:3000 v.nii w.png
	is 'shows("w.png", 0, 0, sagittal("v.nii", 10), (-1000, 3000))' '--window sets the range that is drawn'
	# by name, against the numbers of the man page
	echo 'brain 0:80 stroke 20:60 temporal -800:2000 lung -1350:150 mediastinum -125:225 soft -150:250 liver -45:105
		spine -75:175 bone -500:1300' | xargs -n 2 | while read -r name range; do
		ct-view -q -f -w "$name" v.nii named.png; ct-view -q -f -w "$range" v.nii range.png
		cmp named.png range.png || echo "$name"
	done >wrong 2>&1
	[ ! -s wrong ]; ok $? 'a window by name is the range of the man page'; sed 's/^/# /' wrong
	exits 2 'an unknown name of a window is refused with status 2' ct-view -w heart v.nii no.png
	has err "^ct-view: --window: 'heart' is neither LO:HI nor one of brain stroke" 'the error of an unknown name of a window lists the known ones'
	exits 2 'a window by name is refused for a density' ct-view -w bone d.nii no.png
	has err '^ct-view: --window=bone needs values in HU, but d.nii is not in HU' 'the error of --window=bone of no HU names the file'
	exits 2 'a window by name is refused for projections' ct-view -w bone p.exr no.png
	if ct-convert -q v.nii series/ 2>err; then
		ct-convert -q series/ s.nii && ct-convert -q --reorient RAS --type f32 s.nii h.nii && ct-view h.nii h.png
		is 'shows("h.png", 0, 0, axial("h.nii", 10), (-200, 300))' 'a converted series is drawn as HU'
	else
		skip 'a converted series is drawn as HU' 'no DICOM'
	fi
# error maps, stacks, sizes
	exits 2 'the middle of a signed error map is 0' ct-view -e --error-map=signed --error-window=0:200 v.nii m.nii no.png
	exits 2 'an absolute difference is not below 0' ct-view -e --error-window=-100:100 v.nii m.nii no.png
	ct-view -e -p coronal v.nii m.nii e.png; ct-view -e -p coronal --error-window 10:400 v.nii m.nii ew.png
	is 'shows("e.png", 0, 24, coronal("m.nii", 10), (-200, 300)) and shows("e.png", 24, 24, minus(coronal("v.nii", 10), coronal("m.nii", 10)), (0, 125), True)' \
		'an error map is drawn up to a quarter of the window'
	is 'shows("ew.png", 24, 24, minus(coronal("v.nii", 10), coronal("m.nii", 10)), (10, 400), True)' '--error-window sets the range of an error map'
	ct-view p.exr all.png; ct-view --views 3 p.exr three.png; ct-view --views 3 p.exr q.exr two.png
	is 'all(shows("all.png", k // 3 * 24, k % 3 * 24, view("p.exr", k, 20), span(*(view("p.exr", i, 20) for i in range(7)))) for k in range(7))' \
		'all seven views of a stack are drawn in three columns'
	is 'all(shows("three.png", i // 2 * 24, i % 2 * 24, view("p.exr", k, 20), span(*(view("p.exr", j, 20) for j in (0, 2, 4)))) for i, k in enumerate((0, 2, 4)))' \
		'--views 3 draws three of seven views, evenly'
	is 'all(shows("two.png", i * 24, c * 24, view(f, k, 20), span(*(view(g, j, 20) for g in ("p.exr", "q.exr") for j in (0, 2, 4)))) for i, k in enumerate((0, 2, 4)) for c, f in enumerate(("p.exr", "q.exr")))' \
		'--views 3 draws two stacks side by side'
	exact sphere dark.exr '--size 20x20x20' -n 1 --det 8 --expert offset=9999,0; ct-view dark.exr dark.png
	is 'set(sum(png.read("dark.png"), [])) == {(0, 0, 0)}' 'a constant stack is drawn in black'
	ct-phantom -q --size 20x20x20 --spacing 4 marks far0.nii && ct-convert -q --iso 8 far0.nii far.nii
	ct-view -z 2 -p axial far.nii v.nii zoom.png
	is 'shows("zoom.png", 0, 44, [[x for x in row for _ in "ab"] for row in axial("v.nii", 10) for _ in "ab"], (-200, 300)) and len(png.read("zoom.png")) == 40' \
		'--zoom enlarges the finest voxel of several volumes'
	exits 2 '--plane of projections is refused with status 2' ct-view -p axial p.exr no.png
	has err '--plane: does not apply to a stack' 'the error of --plane of projections says stack'
	# what is dark is not made white: a picture is of [0, 1]
	ct-view -w 0:100 --views 1 p.exr pic.png
	if pictures; then
		ct-ddnm -v -x 2 -n 1 pic.png pic.exr 2>err
		has err '1 views of 40x40, norm 1,' 'ct-ddnm does not brighten a dark picture'
	else
		skip 'ct-ddnm does not brighten a dark picture' 'built without OpenImageIO'
	fi
else
	skip 'the pixels of ct-view are those of the volume' 'no ct-view'
fi

# the blur that ct-ddnm assumes: 0.8 of the mean blur of the axes, in mm, seen on the detector, in its fine pixels
ct-phantom -q --size 24x24x24 --spacing 5,2,3 ellipsoids hr.nii && ct-degrade -q -x 2 --sigma 1,2,3.5 hr.nii lr.nii &&
	ct-upsample -q -m cubic lr.nii up.nii && ct-upsample -q lr.nii tv.nii
told() { # told BLUR NAME ARGS...: of projections of these
	want=$1 name=$2; shift 2
	ct-project -q -f -n 2 --pixel sinc "$@" y.exr && ct-ddnm -f -v -n 1 --sampler ddnm y.exr t.exr 2>err
	has err "operator of blur $want px" "$name: $want"
}
geometry='--expert dso=300,dsd=900 --det 32 --expert pitch=3,4'
# shellcheck disable=SC2086
{
told 5.2 'the blur is that recorded by the file' --coarsen 4 $geometry up.nii # 0.8 (1 5 + 2 2 + 3.5 3)/3 3/3
told 5.2 'the blur of a turned volume is the same' --coarsen 4 --expert rotate=20,30,40 $geometry up.nii
told 1.73333 'the blur in parallel beam is not magnified' --coarsen 4 --beam parallel --det 32 --expert pitch=3,4 up.nii
told 0 'a volume that was inverted has no blur' --coarsen 4 $geometry tv.nii
told 2.66667 'without a recorded blur a part of a coarse voxel is assumed' --coarsen 4 $geometry hr.nii # 0.8 (5 + 2 + 3)/3 3/3
told 5.33333 'without a recorded blur twice the coarsening gives twice the blur' --coarsen 8 $geometry hr.nii
}
exact ellipsoids bare.exr '--size 24x24x24' -n 2 --det 8
ct-ddnm -f -v -n 1 -x 8 --expert operator=matched --sampler ddnm bare.exr t.exr 2>err
has err 'operator of blur 1.6 px' 'projections of no volume have a blur of a fifth of the factor'
ct-project -q -n 2 --coarsen 128 --det 128 hr.nii wide.exr
exits 3 'a coarsening of 128 is refused by ct-ddnm with status 3' ct-ddnm wide.exr no.exr
has err 'wide.exr: coarsen is 128, not a whole number from 2 to 64' 'the error of a coarsening beyond 64 says its range'
exits 2 'a travel length of 0 is refused by ct-ddnm with status 2' ct-ddnm -x 8 --expert travel=0,1 bare.exr no.exr
has err 'travel: 0 is outside \[1, 1000\]' 'the error of a travel of 0 says its range'

# ct-view --mip and --thickness, voxel by voxel against numpy.
part slabs
python_with numpy,PIL.Image || { skip 'ct-view --mip and --thickness, voxel by voxel against numpy' 'no numpy or Pillow'; done_testing; }
py() { # py STATEMENTS: of what look.py knows
	"$PY" -B -c "from look import *
$1"
}
is() { # is EXPRESSION NAME
	py "raise SystemExit(not ($1))" >err 2>&1 && rc=0 || rc=1
	ok $rc "$2"
	[ $rc -eq 0 ] || { echo "$1"; cat err; } | sed 's/^/# /'
}
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

# What ct-view writes on a picture: it is true, and the voxels beside it are as without.
part labels
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
# float affines of one grid from two ends differ by some millionths of a voxel: at the middle, and at borders within a slice
for raw in 400x8x6:i16:.7,.7,1.05 7x9x301:i16:.9,.9,1.35; do
	ct-phantom -q -f --size ${raw%%:*} --spacing 1 ellipsoids e.nii && tail -c $((2 * $(echo ${raw%%:*} | tr x "*"))) e.nii >e.bin
	ct-convert -q -f --raw $raw e.bin l.nii && ct-convert -q -f --reorient RAI l.nii r.nii
	ct-view -q -f -e l.nii l.nii -o same.png && ct-view -q -f -e l.nii r.nii -o r.png
	cmp -s same.png r.png; ok $? "no error of a volume from its other end: $raw"
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
ct-phantom -q --size 41x41x41 --spacing .7 marks odd.nii; ct-view -l -p axial -z 4 odd.nii odd.png # its affine is of float32
is 'says(pic("odd.png"), "axial z 0 mm", 15, 2)' 'the middle of a centred volume is at 0 mm'
ct-phantom -q --size 24x40x24 --spacing 2 marks flat.nii; ct-view -l -z 4 flat.nii flat.png; ct-view -l flat.nii few.png
is '(lambda p: all(says(p, t, 14 + y, x) for t, y, x in (("A", 12, 45), ("P", 150, 45), ("R", 75, 2), ("L", 75, 89), ("S", 176, 45), ("A", 307, 2), ("P", 307, 153))))(pic("flat.png"))' \
	'the sides stand on the edges of a slice narrower than its column'
is 'says(pic("few.png"), "z 1 mm", 15, 2)' 'a caption without room loses its first words, not its place'
exits 0 'a picture smaller than its labels' ct-view -l -p axial -z 0.1 v.nii small.png
is 'pic("small.png").shape[0] == 14 + 5 * 10' 'is as tall as its bar'
done_testing
