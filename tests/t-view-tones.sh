#!/bin/sh
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
if command -v ct-view >/dev/null; then
	ct-phantom -q --size 20x20x20 --spacing 4 ellipsoids v0.nii && ct-convert -q --type f32 v0.nii v.nii &&
		ct-phantom -q --size 20x20x20 --spacing 4 marks m0.nii && ct-convert -q --type f32 m0.nii m.nii &&
		ct-project -q -n 7 --det 20 v.nii p.exr && ct-project -q -n 7 --det 20 m.nii q.exr &&
		ct-fdk -q --quantity density -m cgls -n 3 p.exr d.nii &&
		tail -c 32000 v.nii >raw && ct-convert -q --raw 20x20x20:f32:4 --orient RAS raw bare.nii &&
		ct-compose -q --residual-out r.nii bare.nii bare.nii sum.nii
	ok $? 'volumes and projections'
	for f in v m d r; do ct-view $f.nii $f.png; done
	is 'all(shows(f + ".png", t, 0, p(f + ".nii", 10), (-200, 300)) for f in "vm" for t, p in ((0, axial), (24, coronal), (48, sagittal)))' \
		'HU: -200 to 300, the middle slices'
	is 'shows("d.png", 0, 0, axial("d.nii", 10), (0, 1)) and len(png.read("d.png")) == 68' 'densities: 0 to 1'
	is 'shows("r.png", 24, 0, coronal("r.nii", 10), span(*(p("r.nii", 10) for p in (axial, coronal, sagittal))))' \
		'a residual: what is shown, from its least to its largest'
	for f in 0 0.26 1; do ct-view -p axial --slice $f v.nii s$f.png; done
	is 'all(shows("s%s.png" % f, 0, 0, axial("v.nii", z), (-200, 300)) for f, z in (("0", 0), ("0.26", 5), ("1", 19)))' '--slice'
	is 'len(png.read("s0.png")) == 20' 'one plane is one slice'
	# several: 20 voxels of 4 mm, the middle one from 0 to 4 mm; a square of one plane, rows of three, files in columns
	ct-view -p axial --slice 0.26,-37.9mm,0.1e1,-0.1mm,0.1mm v.nii l.png
	is 'all(shows("l.png", k // 3 * 24, k % 3 * 24, axial("v.nii", z), (-200, 300)) for k, z in enumerate((5, 0, 19, 9, 10)))' \
		'a list of fractions and millimetres'
	ct-view --slices 4 v.nii n.png; ct-view --slices 4 -p sagittal v.nii m.nii nm.png; ct-view --slices 1 v.nii one.png
	is 'all(shows("n.png", t, k * 24, p("v.nii", z), (-200, 300)) for k, z in enumerate((2, 7, 12, 17)) for t, p in ((0, axial), (24, coronal), (48, sagittal)))' \
		'--slices: a row a plane'
	is 'all(shows("nm.png", k * 24, c * 24, sagittal(f, z), (-200, 300)) for k, z in enumerate((2, 7, 12, 17)) for c, f in enumerate(("v.nii", "m.nii")))' \
		'of two files a row a slice'
	cmp v.png one.png; ok $? 'one is the middle'
	exits 5 'a place where nothing is' ct-view --slice 40.1mm v.nii no.png
	has err '^ct-view: 40.1 mm lies outside of the first file' 'is named'
	for f in 1.1 -0.1 '' 0.5, 0.5m 0.5mmm , nan 0.5:0.6; do exits 2 "--slice '$f'" ct-view --slice "$f" v.nii no.png; done
	ct-view -p sagittal -w -1000:3000 v.nii w.png
	is 'shows("w.png", 0, 0, sagittal("v.nii", 10), (-1000, 3000))' '--window'
	# by name, against the numbers of the man page
	echo 'brain 0:80 stroke 20:60 temporal -800:2000 lung -1350:150 mediastinum -125:225 soft -150:250 liver -45:105
		spine -75:175 bone -500:1300' | xargs -n 2 | while read -r name range; do
		ct-view -q -f -w "$name" v.nii named.png; ct-view -q -f -w "$range" v.nii range.png
		cmp named.png range.png || echo "$name"
	done >wrong 2>&1
	[ ! -s wrong ]; ok $? 'windows by name'; sed 's/^/# /' wrong
	exits 2 'of another name' ct-view -w heart v.nii no.png
	has err "^ct-view: --window: 'heart' is neither LO:HI nor one of brain stroke" 'is refused, and the names told'
	exits 2 'of HU, for a density' ct-view -w bone d.nii no.png
	has err '^ct-view: --window=bone needs values in HU, but d.nii is not in HU' 'the error of --window=bone of no HU names the file'
	exits 2 'and for projections' ct-view -w bone p.exr no.png
	if ct-convert -q v.nii series/ 2>err; then
		ct-convert -q series/ s.nii && ct-convert -q --reorient RAS --type f32 s.nii h.nii && ct-view h.nii h.png
		is 'shows("h.png", 0, 0, axial("h.nii", 10), (-200, 300))' 'of a series, which says that it is of HU'
	else
		skip 'HU of a series' 'no DICOM'
	fi
	ct-view -e -p coronal v.nii m.nii e.png; ct-view -e -p coronal --error-window 10:400 v.nii m.nii ew.png
	is 'shows("e.png", 0, 24, coronal("m.nii", 10), (-200, 300)) and shows("e.png", 24, 24, minus(coronal("v.nii", 10), coronal("m.nii", 10)), (0, 125), True)' \
		'differences: to a quarter of the window'
	is 'shows("ew.png", 24, 24, minus(coronal("v.nii", 10), coronal("m.nii", 10)), (10, 400), True)' '--error-window'
	ct-view p.exr all.png; ct-view --views 3 p.exr three.png; ct-view --views 3 p.exr q.exr two.png
	is 'all(shows("all.png", k // 3 * 24, k % 3 * 24, view("p.exr", k, 20), span(*(view("p.exr", i, 20) for i in range(7)))) for k in range(7))' \
		'all views of a stack, in three columns'
	is 'all(shows("three.png", i // 2 * 24, i % 2 * 24, view("p.exr", k, 20), span(*(view("p.exr", j, 20) for j in (0, 2, 4)))) for i, k in enumerate((0, 2, 4)))' \
		'three of seven, evenly'
	is 'all(shows("two.png", i * 24, c * 24, view(f, k, 20), span(*(view(g, j, 20) for g in ("p.exr", "q.exr") for j in (0, 2, 4)))) for i, k in enumerate((0, 2, 4)) for c, f in enumerate(("p.exr", "q.exr")))' \
		'of two stacks side by side'
	exact sphere dark.exr '--size 20x20x20' -n 1 --det 8 --expert offset=9999,0; ct-view dark.exr dark.png
	is 'set(sum(png.read("dark.png"), [])) == {(0, 0, 0)}' 'a constant is black'
	ct-phantom -q --size 20x20x20 --spacing 4 -s 3 marks far0.nii && ct-convert -q --iso 8 far0.nii far.nii
	ct-view -z 2 -p axial far.nii v.nii zoom.png
	is 'shows("zoom.png", 0, 44, [[x for x in row for _ in "ab"] for row in axial("v.nii", 10) for _ in "ab"], (-200, 300)) and len(png.read("zoom.png")) == 40' \
		'--zoom: of the finest voxel'
	exits 2 '--plane of projections' ct-view -p axial p.exr no.png; has err '--plane: does not apply to a stack' 'the error of --plane of projections says stack'
	# what is dark is not made white: a picture is of [0, 1]
	ct-view -w 0:100 --views 1 p.exr pic.png
	ct-ddnm -v -x 2 -n 1 pic.png pic.exr 2>err; has err '1 views of 40x40, norm 1,' 'ct-ddnm: 1 is white'
else
	skip 'pictures' 'no ct-view'
fi

# 0.8 of the mean blur of the axes, in mm, seen on the detector, in its fine pixels
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
told 5.2 'the blur that the file says' --coarsen 4 $geometry up.nii # 0.8 (1 5 + 2 2 + 3.5 3)/3 3/3
told 5.2 'of a volume that is turned' --coarsen 4 --expert rotate=20,30,40 $geometry up.nii
told 1.73333 'of parallel rays' --coarsen 4 --beam parallel --det 32 --expert pitch=3,4 up.nii
told 0 'none where it is undone' --coarsen 4 $geometry tv.nii
told 2.66667 'a quarter of a coarse voxel where nothing is said' --coarsen 4 $geometry hr.nii # 0.8 (5 + 2 + 3)/3 3/3
told 5.33333 'of twice as coarse a one' --coarsen 8 $geometry hr.nii
}
exact ellipsoids bare.exr '--size 24x24x24' -n 2 --det 8
ct-ddnm -f -v -n 1 -x 8 --expert operator=matched --sampler ddnm bare.exr t.exr 2>err; has err 'operator of blur 1.6 px' 'and of no volume'
ct-project -q -n 2 --coarsen 128 --det 128 hr.nii wide.exr
exits 3 'coarser than can be' ct-ddnm wide.exr no.exr; has err 'wide.exr: coarsen is 128, not a whole number from 2 to 64' 'the error of a coarsening beyond 64 says its range'
exits 2 '--travel of what is none' ct-ddnm -x 8 --expert travel=0,1 bare.exr no.exr; has err 'travel: 0 is outside \[1, 1000\]' 'the error of a travel of 0 says its range'
done_testing
