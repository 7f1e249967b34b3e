#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-info says what is in a file, whatever it is.
. "$srcdir/tests/tap.sh"
line() { grep -q "^$1  *$2\$" out; ok $? "$3"; } # line NAME VALUE WHAT
ct-phantom --size 20x24x28 --spacing 2,2,3 sphere v.nii.gz || exit 99
exits 0 'ct-info reports a volume of compressed NIfTI' ct-info v.nii.gz
line kind volume 'the kind of a NIfTI file is volume'
line size '20 24 28' 'a volume has its size in the report'
line spacing-mm '2 2 3' 'a volume has its spacing in the report'
line extent-mm '40 48 84' 'a volume has its extent in the report'
line orientation RAS 'a volume has its orientation in the report'
line nan 0 'a volume has its number of NaNs in the report'
has out 'ct-phantom ' 'a volume has its history in the report'
! grep -q '^blur' out; ok $? 'a volume has no estimate unless -e asks for it'
hash=$(grep '^hash ' out)
gunzip -c v.nii.gz | ct-info - >out 2>err; ok $? 'ct-info reports a volume from a pipe'
line kind volume 'the kind of a volume from a pipe is volume'
[ "$(grep '^hash ' out)" = "$hash" ]; ok $? 'the hash is that of the content, not of the gzip'
mkfifo fifo
cat v.nii.gz >fifo &
exits 0 'ct-info reports a volume from a fifo' ct-info fifo
wait $!; ok $? 'a fifo is read to its end'
ct-phantom --size 96x96x96 --spacing 1 sphere hi.nii.gz || exit 99
for p in P1 P3; do
	ct-degrade -x 3 -p $p hi.nii.gz $p.nii.gz || exit 99
	exits 0 "$p: ct-info -e estimates the operator" ct-info -e -x 3 $p.nii.gz
	case $p in P1) w=band-limited ;; *) w=point-sampled ;; esac
	has out "^assumed .* $w (9. % sure)" "$p: the scan is estimated as $w"
	has out '^noise-hu ' "$p: the report gives the noise"
	[ $p = P3 ] || awk '/^assumed/ {split($3, mm, ",")} /^profile-spread/ {for (a = 1; a <= 3; a++) if ((mm[a] / (2.3548 * 3 * $(a + 1)) - 1) ^ 2 > 1e-5) bad = 1; n = NF} END {exit bad || n != 4}' out
	ok $? "$p: widths are those of Gaussians of that spread, in mm"
done
has out '^assumed  *profile .* mm wide (2.35 standard deviations) along x,y,z, uncertain by .*; measured on edges$' 'the report says what ct-sr would assume of the profile'
has out '^assumed  *profile [0-9.,]* mm wide .* uncertain by 100 %, so 3. % less blur is undone' 'lines of constant air are measured where there are no others'
exits 0 'ct-info --operator accepts factors for each axis' ct-info --operator -x 3,3,1 P1.nii.gz
[ "$(grep -c '^edge-[xyz] ' out)" -eq 2 ]; ok $? '--operator gives the edges along the refined axes'
awk '/^edge-/ {n++; if (NF != 13 || $7 != -.5 || $8 != .5 || $6 >= -.6 || $9 <= .6) bad = 1} END {exit bad || !n}' out
ok $? 'an edge has 12 voxels with the steepest in the middle'
ct-degrade -x 1,1,4 --sigma 0,0,2.96 --decimate point --noise 10 hi.nii.gz wide.nii.gz || exit 99
exits 0 'ct-info -e estimates slices that overlap' ct-info -e -x 1,1,4 wide.nii.gz
has out '^assumed .* averaged over a voxel (6. % sure)' 'slices that overlap are assumed averaged over a voxel'
ct-degrade -x 1,1,4 --sigma 0,0,.5 --decimate point --noise 10 hi.nii.gz thin.nii.gz || exit 99
exits 0 'ct-info -e estimates slices with gaps' ct-info -e -x 1,1,4 thin.nii.gz
has out '^assumed  *profile 2.[0-9]* mm .* point-sampled (9. % sure); edges show 1.[0-9]*, but slices are mostly as thick as far apart' 'thin slices with gaps are assumed to be points'
ct-info -e -x 1,1,4 wide.nii.gz | sed -n '/^assumed/,$p' >want
ct-convert --reorient=LPI wide.nii.gz turned.nii.gz || exit 99
ct-info -e -x 1,1,4 turned.nii.gz | sed -n '/^assumed/,$p' >got
[ -s want ] && cmp -s want got; ok $? 'the estimate is the same whichever end slices, rows and columns begin at'
ct-degrade -x 1,1,8 --sigma 0 --decimate mean hi.nii.gz few.nii.gz || exit 99
exits 0 'ct-info -e estimates a scan of twelve slices' ct-info -e -x 1,1,8 few.nii.gz
has out '^assumed .* averaged over a voxel; too few edges: slices are assumed as thick as far apart$' 'twelve slices are reported as too few edges'
exits 2 'a factor below 1 is refused with status 2' ct-info -e -x 0.5 P1.nii.gz
exact sphere p.exr '--size 64x64x64' --views 30 --arc 360 --expert dso=800,dsd=1200 --det 40x30 \
	--expert pitch=2,offset=4,0 || exit 99
exits 0 'ct-info takes a volume and a stack' ct-info v.nii.gz p.exr
[ "$(grep -c '^file ' out)" -eq 2 ] && [ "$(grep -c '^$' out)" -eq 1 ] && [ "$(grep -B1 '^file  *p.exr' out | head -n 1)" = '' ]
ok $? 'reports of two files have a blank line between them'
exits 3 'an estimate of projections is refused with status 3' ct-info -e p.exr
exits 0 'ct-info reports a stack of projections' ct-info p.exr
line kind stack 'the kind of projections is stack'
line views 30 'a stack has its number of views in the report'
line size '40 30' 'a stack has columns and rows in the report'
line beam cone 'a stack has its beam in the report'
line dso-mm '800 800' 'the distance from source to isocentre comes from the vectors'
line dsd-mm '1200 1200' 'the distance from source to detector comes from the vectors'
line pitch-mm '2 2' 'a stack has its pitch in the report'
line offset-u-mm '4 4' 'a stack has the offset of its detector in the report'
line arc-deg 360 'a stack has its arc in the report'
line magnification 1.5 'a stack has its magnification in the report'
exits 0 'a volume and a stack are reported together' ct-info v.nii.gz p.exr
[ "$(grep -c '^file ' out)" -eq 2 ]; ok $? 'two files give two reports'
"$builddir/tests/t-ply" g.ply
exits 0 'ct-info reports a set of Gaussians' ct-info g.ply
line gaussians 500 'a set of Gaussians has their number in the report'
line activation prelu 'a set of Gaussians has their activation in the report'
line gamma 0.1 'a set of Gaussians has the slope of the activation in the report'
line grid '256 200 130' 'a set of Gaussians has its grid in the report'
# a header of 152 bytes, then 1 2 3 4 0.5 as F32
header='{"__metadata__":{"arch":"x\u001b[31m"},"a.w":{"dtype":"F32","shape":[2,2],"data_offsets":[0,16]},"b":{"dtype":"F32","shape":[],"data_offsets":[16,20]}}'
{ printf '\230\0\0\0\0\0\0\0%-152s' "$header"
	printf '\0\0\200\77\0\0\0\100\0\0\100\100\0\0\200\100\0\0\0\77'; } >w.safetensors
exits 0 'ct-info reports a file of tensors' ct-info w.safetensors
line tensors 2 'a file of tensors has their number in the report'
line parameters 5 'a file of tensors has the number of values in the report'
line '  arch' 'x?\[31m' 'metadata of a file of tensors cannot steer the terminal'
exits 0 'ct-info -v reports each tensor of a file' ct-info -v w.safetensors
has out '^  a.w  shape 2 2  min 1  max 4  mean 2.5$' 'a tensor has its shape and range in the report'
if command -v python3 >/dev/null; then
	ct-info --json -e -x 3 P1.nii.gz | python3 -c 'import json, sys
o = json.load(sys.stdin)
assert len(o["edges"]) == 3 and all(n > 100 for n in o["edges"]) and o["noise-sure-hu"] <= o["noise-hu"], o
assert all(0.3 < s < 0.6 for s in o["profile-spread-voxels"]) and all(0 < d < 0.2 for d in o["profile-deviation-voxels"]), o
assert all(0 <= q < 0.5 for q in o["profile-alias-probability"]), o'
	ok $? 'JSON of -e has edges, noise, spread and deviations'
	ct-info --json v.nii.gz p.exr w.safetensors >out && python3 - <<'END'
import json
v, p, w = json.load(open("out"))
assert v["size"] == [20, 24, 28] and v["affine"][2][2] == 3 and v["nan"] == 0, v
assert p["views"] == 30 and abs(p["dso-mm"][0] - 800) < 1e-9, p
assert w["metadata"]["arch"] == "x\x1b[31m" and w["parameters"] == 5, w
END
	ok $? 'JSON of several files is one array'
else
	skip 'JSON of several files is one array' 'no python3'
fi
head -c 3000 p.exr >cut.exr
if command -v python3 >/dev/null; then
	exits 3 'a damaged file among others ends with status 3' ct-info --json v.nii.gz cut.exr p.exr
	python3 -c 'import json; a = json.load(open("out")); assert [o["file"] for o in a] == ["v.nii.gz"], a'
	ok $? 'JSON of the files before a damaged one is whole'
	ct-info --json v.nii.gz | python3 -c 'import json, sys; assert json.load(sys.stdin)["file"] == "v.nii.gz"'
	ok $? 'JSON of one file is no array'
else
	skip 'JSON of the files before a damaged one is whole' 'no python3'
fi
exits 3 'a stack that is cut off is refused with status 3' ct-info cut.exr
has err '^ct-info: cut.exr: ' 'a stack that is cut off is named in the error'
{ head -c 128 /dev/zero; printf 'DICM'; head -c 300 /dev/zero; } >d.dcm
with_dicom && status=3 || status=1
exits $status "a DICOM file without a picture is refused with status $status" ct-info d.dcm
has err 'd.dcm: ' 'a DICOM file that is refused is named in the error'
printf 'hello' >t.txt
exits 3 'a text file is refused with status 3' ct-info t.txt
has err 'not a NIfTI, MetaImage, NRRD, EXR, PLY, R2-Gaussian, safetensors or PyTorch' 'the error of a text file lists the formats that are read'
: >empty
exits 3 'ct-info refuses an empty file with status 3' ct-info empty
exits 3 'ct-info refuses an empty pipe with status 3' ct-info - </dev/null
mkdir none; exits $status "ct-info refuses an empty folder with status $status" ct-info none

# What is in a folder of DICOM files: ct-info FOLDER, as text and JSON.
part inspect
mkdir empty
ct-convert empty e.nii 2>err
if grep -q 'with-vtk' err; then skip 'ct-info reads folders of DICOM files' 'built without vtk-dicom'; done_testing; fi
if ! python_with pydicom; then skip 'ct-info reads folders of DICOM files' 'no pydicom'; done_testing; fi
PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" - <<'END'
from dicom import *
for k in range(9):
    write("good/%d.dcm" % k, "axial", k, "1.6.1", ConvolutionKernel="B30f", KVP=120, RescaleType="HU")
    write("lean/%d.dcm" % k, "axial", k, "1.6.2", ORIGIN + np.array([0, np.sin(t), np.cos(t)]) * 2.5 * k,
          SeriesDescription=None)
    if k not in (4, 5):
        write("holes/%d.dcm" % k, "padded", k, "1.6.3")
    write("all/a/%d.dcm" % k, "axial", k, "1.6.4")
    write("all/b/%d.dcm" % k, "axial", k, "1.6.5", Modality="MR")
write("all/a/scout.dcm", "sagittal", 0, "1.6.4", ImageType=["ORIGINAL", "PRIMARY", "LOCALIZER"])
open("all/a/x.txt", "w").write("x\n")
END
tar cf good.tar good; printf 'x' >good/notes.txt
for what in good good/3.dcm good.tar; do
	exits 0 "$what: what ct-convert would make" ct-info $what
	has out '^series  *1$' 'the folder holds one series'; has out '^grid  *12 10 9$' 'the grid of the series is 12 10 9'
done
rm good/notes.txt
exits 0 "a series that is fit" ct-info good
line() { grep -q "^$1  *$2\$" out; ok $? "$1 $2"; }
line files 9; line picture 9; line series 1; line slices 9; line size '12 10'; line kernel B30f
line kvp 120; line uid 1.6.1; line spacing-mm '0.5 0.75'; line gap-mm '2.5 2.5 2.5'; line tilt-deg 0
line grid '12 10 9'; line fit yes; line range '-\{0,1\}[0-9]* [0-9]*'; line unit HU
line padding none; has out '^missing-fields' 'fields that are missing are listed'
exits 0 "ct-info reads a tilted series" ct-info lean
line tilt-deg 20; has out '^  tilted gantry$' 'a tilted gantry is remarked on'; line grid '12 20 9'; line fit yes
has out '^  SeriesDescription$' 'a field that is missing'
exits 5 "a series with missing slices ends with status 5" ct-info holes
line fit no; has out '^why-not  *2 slices are missing' 'the reason why a series does not fit is told'
has out '^  2  after-mm .*  before-mm ' 'the gap lies between two positions in mm'; line padding '-2000 -2000'; has err '2 slices are missing' 'missing slices are said as by conversion'
exits 0 "several series, one of CT slices" ct-info all
[ "$(grep -c '^series ' out)" -eq 3 ] && [ "$(grep -c '^fit  *yes' out)" -eq 1 ]; ok $? 'one series of three is fit'
line 'not DICOM' 1; has out '^kind  *localizer$' 'the localizer is named by its kind'
has out "^why-not  *all/b/0.dcm: modality is 'MR', not CT$" 'a series of MR says why it does not fit'
exits 3 "a series of another modality is refused" ct-info --series 1.6.5 all
exits 3 "an empty folder is refused by ct-info" ct-info empty
: >good/bad.dcm
exits 3 'a damaged file of a folder is status 3' ct-info good; has err 'good/bad.dcm: damaged: it is empty' 'a damaged file of a folder is named in the error'
has out '^  good/bad.dcm  state damaged  why it is empty$' 'a damaged file is listed with its reason'
rm good/bad.dcm
printf 'x' >>good/3.dcm; head -c -30 good/3.dcm >cut; mv cut good/3.dcm
exits 3 'a picture that is cut off' ct-info good; has err 'truncated' 'a picture that is cut off is said to be truncated'
ct-info --json all | "$PY" -c 'import json, sys
o = json.load(sys.stdin)
assert o["files"] == 20 and o["picture"] == 19 and o["not DICOM"] == 1 and o["trouble"] == [], o
a = [s for s in o["series"] if s["uid"] == "1.6.4" and s["kind"] == "slices"][0]
assert a["fit"] is True and a["grid"] == [12, 10, 9] and a["gap-mm"] == [2.5] * 3 and a["gaps"] == [], a
assert a["range"][0] < a["range"][1] and "KVP" in a["missing-fields"], a
assert [s["fit"] for s in o["series"]].count(True) == 1'
ok $? 'several series are one JSON document'
ct-phantom -q --size 8x8x8 sphere v.nii
exits 5 'folders and a file, the last one not fit' ct-info --json all v.nii holes
"$PY" -c 'import json
a = json.load(open("out"))
assert [o["file"] for o in a] == ["all", "v.nii", "holes"] and a[0]["files"] == 20, a
assert [s["fit"] for s in a[2]["series"]] == [False], a'
ok $? 'are one JSON document'
exits 2 'ct-convert has no --json' ct-convert --json good o.nii
[ ! -e o.nii ]; ok $? 'folders that were refused leave nothing written'

# ct-info to the number: every figure of every kind of file, and the text, which says what the JSON does.
part figures
command -v python3 >/dev/null || { skip 'ct-info to the number' 'no python3'; done_testing; }
cat >look.py <<'END'
"""report(NAME, WANT): the JSON has these members in this order and no others but the hash, the text says
the same."""
import json, math, re, struct, subprocess

def near(a, b):
    if isinstance(b, (list, tuple)):
        return isinstance(a, list) and len(a) == len(b) and all(map(near, a, b))
    if isinstance(b, dict):
        return isinstance(a, dict) and list(a) == list(b) and all(near(a[k], b[k]) for k in b)
    if isinstance(b, float) and isinstance(a, float):
        return abs(a - b) <= 2e-6 * max(abs(a), abs(b)) + 1e-9
    return type(a) is type(b) and a == b

def word(v):
    v = 'none' if v is None else '%.7g' % v if isinstance(v, float) else str(v)
    return ''.join('?' if ord(c) < 32 or ord(c) == 127 else c for c in v)

def value(v):
    return ' '.join(map(word, v)) if isinstance(v, list) else word(v)

def item(v):
    if isinstance(v, dict):
        return '  '.join(('%s ' % k if n else '') + value(x) for n, (k, x) in enumerate(v.items()))
    return value(v)

def text(o, indent=0):
    for k, v in o.items():
        if isinstance(v, dict):
            yield ' ' * indent + k
            yield from text(v, indent + 2)
        elif isinstance(v, list) and not (v and isinstance(v[0], (int, float, type(None)))):
            yield ' ' * indent + k
            yield from (' ' * (indent + 2) + item(x) for x in v)
        else:
            yield ' ' * indent + (k.ljust(18) if len(k) < 18 else k + ' ') + value(v)

def run(*args):
    return subprocess.run(('ct-info',) + args, check=True, stdout=subprocess.PIPE).stdout.decode()

def report(name, want, *args):
    o = json.loads(run('--json', name, *args))
    h = o.pop('hash', None)
    assert h is None or re.fullmatch('xxh3:[0-9a-f]{32}', h), h
    want = dict(want, file=name)
    assert list(o) == ['file'] + [k for k in want if k != 'file'], (list(o), list(want))
    bad = [(k, o[k], want[k]) for k in want if not near(o[k], want[k])]
    assert not bad, bad
    if h:
        o['hash'] = h
    says = run(name, *args)
    assert says == '\n'.join(text(o)) + '\n', (says, '\n'.join(text(o)))

def spread(x):
    ok = [v for v in x if math.isfinite(v)]
    mean = sum(ok) / len(ok)
    return {'min': float(min(ok)), 'max': float(max(ok)), 'mean': mean,
            'sd': math.sqrt(sum((v - mean) ** 2 for v in ok) / len(ok)),
            'nan': sum(map(math.isnan, x)), 'infinite': sum(map(math.isinf, x))}
END
run() { # run NAME: Python from standard input
	{ echo 'from look import *'; cat; } >t.py; python3 t.py 2>err; ok $? "$1"; sed 's/^/# /' err
}

run 'a volume, of which some voxels are no numbers' <<'END'
x = [float(i * i % 37) for i in range(24)]
x[5], x[7], x[9], x[10] = math.nan, math.inf, math.inf, -math.inf
rows = [[0.0, -2.0, 0.0, 5.0], [3.0, 0.0, 0.0, -7.0], [0.0, 0.0, 4.0, 0.5]]
head = bytearray(352)
struct.pack_into('<i', head, 0, 348)
struct.pack_into('<8h', head, 40, 3, 2, 3, 4, 1, 1, 1, 1)
struct.pack_into('<2h', head, 70, 16, 32)
struct.pack_into('<8f', head, 76, 1, 3, 2, 4, 0, 0, 0, 0)
struct.pack_into('<3f', head, 108, 352, 1, 0)
head[123] = 2
struct.pack_into('<2h', head, 252, 0, 1)
for r in range(3):
    struct.pack_into('<4f', head, 280 + 16 * r, *rows[r])
head[344:348] = b'n+1\0'
open('v.nii', 'wb').write(head + struct.pack('<24f', *x))
report('v.nii', {'kind': 'volume', 'size': [2, 3, 4], 'spacing-mm': [3.0, 2.0, 4.0],
                 'extent-mm': [6.0, 6.0, 16.0], 'centre-mm': [3.0, -5.5, 6.5], 'orientation': 'ALS',
                 'affine': rows, 'quantity': 'HU', **spread(x)})
END
ct-phantom -q --size 9x10x11 --spacing 2,3,4 -s 5 -w -1000:2000 ellipsoids p.nii || exit 99
run 'a volume with a history' <<'END'
b = open('p.nii', 'rb').read()
at = int(struct.unpack_from('<f', b, 108)[0])
x = struct.unpack_from('<990f', b, at)
report('p.nii', {'kind': 'volume', 'size': [9, 10, 11], 'spacing-mm': [2.0, 3.0, 4.0],
                 'extent-mm': [18.0, 30.0, 44.0], 'centre-mm': [0.0, 0.0, 0.0], 'orientation': 'RAS',
                 'affine': [[2.0, 0.0, 0.0, -8.0], [0.0, 3.0, 0.0, -13.5], [0.0, 0.0, 4.0, -20.0]],
                 'quantity': 'HU', **spread(x),
                 'metadata': {'window': '-1000:2000', 'phantom': 'ellipsoids', 'seed': '5'},
                 'history': ['ct-phantom ' + run('--version').split()[-1] +
                             ' --size 9x10x11 --spacing 2,3,4 -s 5 -w -1000:2000 ellipsoids p.nii']})
END
cp "$srcdir/tests/exr.py" .
exact sphere cone.exr '--size 64x64x64' -n 30 --arc 350 --expert start=7,dso=800,dsd=1000,pitch=2,3,offset=4,-5 --det 40x30 &&
	exact sphere flat.exr '--size 64x64x64' -n 4 --beam parallel --arc -180 --det 40x30 &&
	exact sphere one.exr '--size 64x64x64' -n 1 || exit 99
run 'stacks: a cone, parallel rays, one view' <<'END'
import exr
def stack(name, want, told=()):
    o = json.loads(run('--json', name))
    for k in told:
        want[k] = o[k]
    report(name, {'kind': 'stack', **want, **spread(sum(exr.read(name), [])), 'metadata': o['metadata'],
                  'history': o['history']})
    return o
o = stack('cone.exr', {'views': 30, 'size': [40, 30], 'pitch-mm': [2.0, 3.0], 'detector-mm': [80.0, 90.0],
                       'beam': 'cone', 'angles-deg': [7.0, 7 + 350 * 29 / 30], 'step-deg': 350 / 30,
                       'arc-deg': 350.0, 'dsd-mm': [1000.0, 1000.0], 'dso-mm': [800.0, 800.0],
                       'isocentre-mm': [0.0, 0.0, 0.0], 'isocentre-miss-mm': None, 'magnification': 1.25,
                       'offset-u-mm': [4.0, 4.0], 'offset-v-mm': [-5.0, -5.0]}, ['isocentre-miss-mm'])
assert 0 <= o['isocentre-miss-mm'] < 1e-3 and o['metadata']['scan.dso'] == '800' and len(o['history']) == 1
for name, views, last, step, beam in (('flat.exr', 4, -135.0, -45.0, 'parallel'), ('one.exr', 1, 0.0, 0.0, 'cone')):
    o = stack(name, {'views': views, 'size': None, 'pitch-mm': None, 'detector-mm': None, 'beam': beam,
                     'angles-deg': [0.0, last], 'step-deg': step, 'arc-deg': abs(step) * views, 'dsd-mm': None,
                     'offset-u-mm': [0.0, 0.0], 'offset-v-mm': [0.0, 0.0]},
              ['size', 'pitch-mm', 'detector-mm', 'dsd-mm'])
    assert near(o['detector-mm'], [n * p for n, p in zip(o['size'], o['pitch-mm'])]), o
END
"$builddir/tests/t-ply" g.ply >/dev/null
run 'Gaussians' <<'END'
head, body = open('g.ply', 'rb').read().split(b'end_header\n', 1)
names = re.findall(r'^property float (\S+)$', head.decode(), re.M)
rows = [dict(zip(names, r)) for r in struct.iter_unpack('<%df' % len(names), body)]
get = lambda k: [r[k] for r in rows]
scales = get('scale_0') + get('scale_1') + get('scale_2')
o = json.loads(run('--json', 'g.ply'))
third = 1 / 3
report('g.ply', {'kind': 'Gaussians', 'gaussians': 500, 'positive': sum(d > 0 for d in get('density')),
                 'negative': sum(d < 0 for d in get('density')), 'not-finite': 0, 'activation': 'prelu',
                 'gamma': 0.1, 'raw-density': [min(get('density')), max(get('density'))],
                 'sigma-mm': [math.exp(min(scales)), math.exp(max(scales))],
                 'sigma-mean-mm': math.exp(sum(scales) / len(scales)),
                 'box-low-mm': [min(get(a)) for a in 'xyz'], 'box-high-mm': [max(get(a)) for a in 'xyz'],
                 'step': 12345678901, 'grid': [256, 200, 130],
                 'affine': [[third, 0.0, 0.0, 0.0], [0.0, third, 0.0, -100.7], [0.0, 0.0, third, -201.4]],
                 'metadata': o['metadata'], 'history': o['history']})
assert len(o['history']) == 2 and o['metadata']['window'] == '-1024:3071', o
END
run 'tensors' <<'END'
meta = {'a': 'b', 'a key of more than eighteen letters': 'c\td', 'eighteen letters ..': '', 'seventeen letter:': 'e',
        'eighteen letters :': 'e', 'history': 'one\ntwo\n'}
x = [1.0, math.nan, 3.0, 4.0, 0.5, math.inf, -math.inf]
head = json.dumps({'__metadata__': meta, 'a.w': {'dtype': 'F32', 'shape': [2, 2], 'data_offsets': [0, 16]},
                   'b': {'dtype': 'F32', 'shape': [], 'data_offsets': [16, 20]},
                   'c': {'dtype': 'F32', 'shape': [2], 'data_offsets': [20, 28]}}).encode()
open('w.safetensors', 'wb').write(struct.pack('<Q', len(head)) + head + struct.pack('<7f', *x))
want = {'kind': 'tensors', 'tensors': 3, 'parameters': 7, 'not-finite': 3}
rest = {'metadata': {k: v for k, v in meta.items() if k != 'history'}, 'history': ['one', 'two']}
report('w.safetensors', {**want, **rest})
report('w.safetensors', {**want, 'list': [
    {'name': 'a.w', 'shape': [2, 2], 'min': 1.0, 'max': 4.0, 'mean': 8 / 3},
    {'name': 'b', 'shape': [], 'min': 0.5, 'max': 0.5, 'mean': 0.5},
    {'name': 'c', 'shape': [2], 'min': None, 'max': None, 'mean': None}], **rest}, '-v')
END
done_testing
