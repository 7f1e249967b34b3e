#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What ct-metrics says of harm, against NumPy and SciPy, and how it says it.
. "$srcdir/tests/tap.sh"
ct-phantom -q --size 40x36x30 --spacing 1.5 ellipsoids hr.nii && ct-degrade -q -x 2 hr.nii lr.nii &&
	ct-upsample -q -m cubic lr.nii up.nii || exit 99
value() { awk -v n="$1" '$1 == n {print $2}' "${2:-out}"; } # value NAME [FILE]

# a line a name, and those of --harm are those of its parts
exits 0 'ct-metrics --harm compares a result with the truth' ct-metrics --harm hr.nii up.nii
mv out harm.txt
ct-metrics --edges --structures --tissues hr.nii up.nii >parts; s=$?
grep -vxFf parts harm.txt | awk '{print $1}' | tr '\n' ' ' >more
[ $s -eq 0 ] && [ "$(cat more)" = 'hfen fsc50 fsc50-mm flat-voxels flat-ref flat-test banding-pieces banding-rms-hu ' ]
ok $? '--harm adds eight figures to those of --edges, --structures and --tissues'
for t in 1 4; do ct-metrics -t $t --harm --json hr.nii up.nii >t$t; done
cmp -s t1 t4; ok $? '--harm prints the same bytes with 1 and 4 threads'

# sizes of structures
sizes() { ct-metrics --ssim none --structures "$@" | sed -n 's/^blob-sigma[-12345]* //p' | tr '\n' ' '; }
[ "$(sizes hr.nii up.nii)" = '1.5 3 ' ]; ok $? 'the sizes of structures follow the factor in the header of TEST'
[ "$(sizes up.nii hr.nii)" = '1.5 ' ]; ok $? 'a TEST that is not refined has one size of structures'
[ "$(sizes -x 4 hr.nii up.nii)" = '3 6 ' ]; ok $? 'the sizes of structures follow -x 4'
[ "$(sizes -x 1,1,4 hr.nii up.nii)" = '0.75,0.75,3 1.5,1.5,6 ' ]
ok $? 'the sizes of structures follow -x for each axis'
[ "$(sizes --expert blob-sigma=1,2.5,7 hr.nii up.nii)" = '1 2.5 7 ' ]
ok $? 'the sizes of structures are those of blob-sigma'
[ "$(sizes --expert blob-sigma=2 hr.nii up.nii)" = '2 ' ]; ok $? 'blob-sigma accepts a single size'
[ "$(sizes -x 100 hr.nii up.nii)" = '75 100 ' ]; ok $? 'no size of structures is larger than 100'
ct-convert -q --iso 1 hr.nii hr1.nii && ct-convert -q --iso 1 up.nii up1.nii
ct-info up1.nii | grep -q '^  upsample'; ok $? 'a refined volume keeps its factor on another grid'
[ "$(sizes hr1.nii up1.nii)" = '1.5 ' ]; ok $? 'a refined volume on another grid has one size of structures'
ct-degrade -q -x 1 --clip -1024:3071 lr.nii other.nii
[ "$(sizes lr.nii other.nii)" = '1.5 ' ]; ok $? 'a scan that is not refined has one size of structures'
for v in 0.2 101 1,2,3,4,5 a '1,' 1,nan ''; do
	exits 2 "a blob-sigma of '$v' is refused with status 2" ct-metrics --structures --expert "blob-sigma=$v" hr.nii up.nii
	has err 'blob-sigma' "the error of a blob-sigma of '$v' names blob-sigma"
done
for v in 0.5 1025 1,2 a; do
	exits 2 "a factor of '$v' is refused with status 2" ct-metrics --structures -x "$v" hr.nii up.nii
	has err 'factor' "the error of a factor of '$v' names the factor"
done

# CSV
ct-metrics --harm --csv -x 1,1,2 hr.nii up.nii >table
[ "$(wc -l <table)" -eq 2 ]; ok $? '--csv prints two lines for one comparison'
ct-metrics --harm -x 1,1,2 hr.nii up.nii | awk '{print $1}' | tr '\n' ',' >names
[ "test,$(cat names)" = "$(head -n 1 table)," ]; ok $? 'the columns of --csv are the names of the report'
exits 2 '--csv with --json is refused with status 2' ct-metrics --csv --json hr.nii up.nii
exits 2 '--csv with --per-slice to standard output is refused with status 2' ct-metrics --csv --per-slice - hr.nii up.nii
cp up.nii 'a "b", c.nii'
exits 0 '--csv accepts a file name with quotes and commas' ct-metrics --csv --ssim none hr.nii 'a "b", c.nii'
has out '^"a ""b"", c.nii",' 'a file name with quotes and commas is quoted in CSV'
exits 0 '--csv accepts --consistency without a truth' ct-metrics --csv --consistency lr.nii up.nii
has out '^test,factor,sigma,decimate,noise,residual-voxels' '--csv --consistency has columns for the operator'
has out '^"up.nii","2,2,2",' 'a list of factors is quoted in CSV'

# banding: a wave of 6 HU and four voxels in water
python3 -c '
import array, math
array.array("f", (40 + 6 * math.cos(math.pi * (i // 576) / 2 + 1) for i in range(576 * 48))).tofile(open("band.raw", "wb"))
array.array("f", [40] * 576 * 48).tofile(open("flat.raw", "wb"))' || exit 99
for v in band flat; do ct-convert -q --raw 24x24x48:f32:2 $v.raw $v.nii || exit 99; done
banding() { value banding-rms-hu; } # of the last report
exits 0 'ct-metrics accepts stripes across slices' ct-metrics --harm --ssim none -x 1,1,4 flat.nii band.nii
banding | awk '{exit !(($1 - 4.243)^2 < .01)}'; ok $? 'stripes have the RMS of their amplitude'
[ "$(value banding-pieces)" -eq 1728 ]; ok $? 'stripes are measured on every line of voxels'
exits 0 'ct-metrics accepts stripes across an axis that is not refined' ct-metrics --harm --ssim none -x 1,4,1 flat.nii band.nii
[ "$(banding)" = 0.000000 ]; ok $? 'stripes across an axis that is not refined give no banding'
exits 0 'ct-metrics --harm accepts a volume without a factor' ct-metrics --harm --ssim none flat.nii band.nii
[ "$(banding)" = nan ]; ok $? 'without a factor there is no figure of banding'
exits 0 'ct-metrics --harm accepts slices eight times as thick' ct-metrics --harm --ssim none -x 1,1,8 flat.nii band.nii
[ "$(banding) $(value banding-pieces)" = 'nan 0' ]; ok $? 'fewer than 1000 pieces give no figure of banding'
exits 3 'banding above --max ends with status 3' ct-metrics --harm --max banding-rms-hu=1 -x 1,1,4 flat.nii band.nii
has err 'banding-rms-hu 4.2' 'the error of banding above --max gives the value'

# limits
head -c 55296 /dev/zero >zero.raw
ct-convert -q --raw 24x24x24:f32:2 zero.raw water.nii && ct-degrade -q -x 1 --noise 60 water.nii noisy.nii || exit 99
ct-metrics --structures --expert blob-sigma=.7 water.nii noisy.nii >some
f=$(value structures-false some); [ "$f" -gt 3 ]; ok $? "noise gives false structures ($f)"
[ "$f" -eq $(($(value false-bright some) + $(value false-dark some))) ]
ok $? 'false structures are the sum of bright and dark ones'
exits 0 '--max accepts as many false structures as there are' ct-metrics --structures --expert blob-sigma=.7 --max structures-false=$f water.nii noisy.nii
exits 3 'one false structure more than --max ends with status 3' ct-metrics --structures --expert blob-sigma=.7 --max structures-false=$((f - 1)) water.nii noisy.nii
has err "noisy.nii: structures-false $f is above" 'the error of too many false structures gives their number'
exits 2 'a --max that is NaN is refused with status 2' ct-metrics --structures --max structures-false=nan water.nii noisy.nii
two=$(ct-metrics --structures --expert blob-sigma=.7,.9 water.nii noisy.nii >two; value structures-false two)
[ "$two" -eq $((f + $(value false-bright-2 two) + $(value false-dark-2 two))) ]
ok $? 'false structures of two sizes are the sum of each'
[ "$(value false-bright two)" -eq $(($(value false-bright-1 two) + $(value false-bright-2 two))) ]
ok $? 'bright false structures of two sizes are the sum of each'
awk '{v[$1] = $2} END {exit !(v["false-dark-2"] > 0 && (v["false-dark-2"] / v["soft-tissue-cm3-2"] - v["false-dark-per-cm3-2"])^2 < 1e-10)}' two
ok $? 'false structures of a size are also given for each cm3'

python_with nibabel,scipy.ndimage || { skip 'all figures are those of NumPy and SciPy' 'they are not here'; done_testing; }
"$PY" - <<'PY' || exit 99
import nibabel as nib, numpy as np
rng = np.random.default_rng(4)
n = (45, 38, 33)
i, j, k = np.indices(n)
a = np.choose((i // 9) % 5, [-1000., -700., -100., 40., 700.]) + 25*rng.standard_normal(n)
a[:, 8:32, 5:28] = 40 + 30*rng.standard_normal((n[0], 24, 23))
b = a + 60*rng.standard_normal(n) + 3*np.sin(i/3)
b[:, 12:22, 5:18] = np.round(b[:, 12:22, 5:18]/400)*400
for v, f in ((a, 'a.nii'), (b, 'b.nii'), ((i + j) % 7 > 0, 'm.nii')):
    nib.save(nib.Nifti1Image(v.astype(np.float32), np.diag([.7, .8, 2.5, 1])), f)
PY
what='--ssim none --harm --expert blob-sigma=1,2'
# shellcheck disable=SC2086
ct-metrics --json $what a.nii b.nii >all.json && ct-metrics --json $what --mask m.nii a.nii b.nii >mask.json
"$PY" - >log 2>&1 <<'PY'; ok $? 'all figures are those of NumPy and SciPy'
import json, nibabel as nib, numpy as np
from scipy import ndimage as nd
a, b, m = (nib.load(f).get_fdata() for f in ('a.nii', 'b.nii', 'm.nii'))
mm = np.array([.7, .8, 2.5])
def near(name, got, want, tol=1e-4):
    print(name, got, want)
    assert got == want or abs(got - want) <= tol*max(abs(want), 1), name
G = lambda v, s: nd.gaussian_filter(v, s, truncate=4, mode='reflect')
near3 = np.ones((3, 3, 3))
around = near3.copy(); around[1, 1, 1] = 0
inner = np.zeros(a.shape, bool); inner[1:-1, 1:-1, 1:-1] = True
def blobs(r, mask, s, end):
    da, db = (G(v, s) - G(v, s*10/3) for v in (a, b))
    soft = (abs(G(a, s)) < 150) & (abs(G(a, s*10/3)) < 150) & mask
    cm3 = soft.sum()*mm.prod()/1000
    near('cm3', r['soft-tissue-cm3' + end], cm3, 1e-3)
    for sign, name in ((1, 'bright'), (-1, 'dark')):
        def found(x, y):
            top = soft & inner & (sign*x > 15) & (sign*x > nd.maximum_filter(sign*x, footprint=around))
            return top.sum(), (top & (nd.maximum_filter(sign*y, footprint=near3) < 7.5)).sum()
        n, missed = found(da, db)
        false = found(db, da)[1]
        near('is ' + name, r['structures-%s%s' % (name, end)], n)
        near('missed ' + name, r['missed-%s%s' % (name, end)], missed)
        near('false ' + name, r['false-%s%s' % (name, end)], false)
        near('false a cm3', r['false-%s-per-cm3%s' % (name, end)], false/cm3, 1e-6)
        near('missed a cm3', r['missed-%s-per-cm3%s' % (name, end)], missed/cm3, 1e-6)
    return r['false-dark' + end] + r['false-bright' + end]
def check(r, mask):
    assert blobs(r, mask, 1, '-1') + blobs(r, mask, 2, '-2') == r['structures-false'] > 0
    L = lambda v: nd.gaussian_laplace(v, 1.5, mode='reflect', truncate=4)[mask]
    near('hfen', r['hfen'], np.linalg.norm(L(b) - L(a))/np.linalg.norm(L(a)), 1e-5)
    s, d = G(a, 1), b - a
    kinds = {'air': (-1e9, -950), 'lung': (-950, -500), 'fat': (-190, -30), 'soft': (-30, 150),
             'brain': (15, 60), 'bone': (300, 1e9)}
    is_ = {k: (s >= lo) & (s < hi) for k, (lo, hi) in kinds.items()}
    is_['deep'] = nd.binary_erosion(is_['soft'], np.ones((9, 9, 9)), border_value=1)
    for k, v in is_.items():
        v = v & mask
        near(k, r[k + '-voxels'], v.sum())
        assert v.sum() > 50
        near(k + ' rmse', r[k + '-rmse-hu'], np.sqrt((d[v]**2).mean()))
        near(k + ' bias', r[k + '-bias-hu'], d[v].mean())
    near('smooth', r['deep-smooth-rmse-hu'], np.sqrt((G(d, 1)[is_['deep'] & mask]**2).mean()))
    v = (is_['soft'] & mask)[:-1, :-1, :-1]
    near('flat voxels', r['flat-voxels'], v.sum())
    for name, x in (('ref', a), ('test', b)):
        steps = [abs(np.diff(x, axis=q))[tuple(slice(n - 1) for n in x.shape)] for q in range(3)]
        flat = (np.max(steps, 0) < 1)[v].mean()
        near('flat ' + name, r['flat-' + name], flat, 1e-6)
    assert r['flat-test'] > .05
check(json.load(open('all.json')), np.ones(a.shape, bool))
check(json.load(open('mask.json')), m != 0)
w = [np.sin(np.pi*(np.arange(q) + .5)/q)**2 for q in a.shape]
w = w[0][:, None, None]*w[1][:, None]*w[2]
F, H = (np.fft.fftn((v - v.mean())*w) for v in (a, b))
f = np.sqrt(sum(q**2 for q in np.meshgrid(*[np.fft.fftfreq(q, d) for q, d in zip(a.shape, mm)], indexing='ij')))
width = max(1/(q*d) for q, d in zip(a.shape, mm))
shell = np.floor(f/width + .5).astype(int)
value = []
for s in range(int(.5/.7/width + .5) + 1):
    v = shell == s
    value.append((F[v]*H[v].conj()).real.sum()/np.sqrt((abs(F[v])**2).sum()*(abs(H[v])**2).sum()))
assert min(value) < .5
s = next(i for i in range(1, len(value)) if value[i] < .5)
before = 1 if s == 1 else value[s - 1]
r = json.load(open('all.json'))
near('fsc50', r['fsc50'], width*(s - (.5 - value[s])/(before - value[s])), 1e-6)
near('fsc50-mm', r['fsc50-mm']*r['fsc50'], 1, 1e-9)
near('fsc50 of all, with a mask too', json.load(open('mask.json'))['fsc50'], r['fsc50'])
PY
sed 's/^/# /' log
"$PY" - >log 2>&1 <<'PY'; ok $? 'Python reads the CSV with its columns'
import csv
r = list(csv.DictReader(open('table')))
assert len(r) == 1 and r[0]['test'] == 'up.nii' and r[0]['blob-sigma-2'] == '1.5,1.5,3' and r[0]['window'] == '-512:3071'
PY
sed 's/^/# /' log
done_testing
