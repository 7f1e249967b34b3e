#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-view pixel by pixel: which slice and which view, and the tones of HU, densities and the rest; the blur
# that ct-ddnm assumes, and what it takes for white.
. "$srcdir/tests/tap.sh"
command -v python3 >/dev/null || { echo '1..0 # SKIP no python3'; exit 0; }
cp "$srcdir/tests/exr.py" .
sed -n '/^cat >png.py/,/^END$/p' "$srcdir/tests/t-view.sh" | sed '1d;$d' >png.py
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
	ct-phantom -q --size 20x20x20 --spacing 4 -s 3 marks far0.nii && ct-convert -q --iso 8 far0.nii far.nii
	ct-view -z 2 -p axial far.nii v.nii zoom.png
	is 'shows("zoom.png", 0, 44, [[x for x in row for _ in "ab"] for row in axial("v.nii", 10) for _ in "ab"], (-200, 300)) and len(png.read("zoom.png")) == 40' \
		'--zoom enlarges the finest voxel of several volumes'
	exits 2 '--plane of projections is refused with status 2' ct-view -p axial p.exr no.png
	has err '--plane: does not apply to a stack' 'the error of --plane of projections says stack'
	# what is dark is not made white: a picture is of [0, 1]
	ct-view -w 0:100 --views 1 p.exr pic.png
	ct-ddnm -v -x 2 -n 1 pic.png pic.exr 2>err
	has err '1 views of 40x40, norm 1,' 'ct-ddnm does not brighten a dark picture'
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
done_testing
