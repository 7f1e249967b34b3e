#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-report: every figure of the page against ct-metrics and numpy.
. "$srcdir/tests/tap.sh"
python_with nibabel || { skip 'the figures' 'no nibabel'; done_testing; }
ct-phantom -q --size 64x48x40 --spacing 2 ellipsoids truth.nii && ct-degrade -q -x 2,2,1 -p P1 truth.nii lr.nii &&
	ct-upsample -q lr.nii hr.nii && ct-upsample -q -m cubic lr.nii cubic.nii &&
	ct-degrade -q -x 2,2,1 -p P1 --noise 12 --seed 1 truth.nii noisy.nii && ct-upsample -q noisy.nii nhr.nii || exit 99
"$PY" - <<'END' || exit 99
import nibabel, numpy
hr = nibabel.load('hr.nii')
v = hr.get_fdata()
def save(name, x): nibabel.save(nibabel.Nifti1Image(x.astype('float32'), hr.affine), name)
s = 3 + abs(v) / 20 + numpy.random.default_rng(1).uniform(0, 20, v.shape)
save('std.nii', numpy.where(v > numpy.quantile(v[v >= -950], .7), 101, numpy.minimum(s, 99.5)))
save('bare.nii', v)
lr = nibabel.load('lr.nii')
nibabel.save(nibabel.Nifti1Image(lr.get_fdata().astype('float32'), lr.affine), 'barelr.nii')
END
exits 0 'ct-report writes a page with error and truth' ct-report -q --uncertainty std.nii --truth truth.nii lr.nii hr.nii r.html
ct-upsample -q -m linear lr.nii linear.nii && ct-report -q lr.nii linear.nii linear.html && ct-metrics --json --consistency lr.nii linear.nii >agrees && ct-metrics --json -w -1024:3071 truth.nii hr.nii >after &&
	ct-metrics --json -w -1024:3071 truth.nii cubic.nii >before && ct-metrics --json --edges hr.nii cubic.nii >edges &&
	ct-info --json lr.nii >info || exit 99
cat >look.py <<'END'
import json, re, sys
import nibabel, numpy as np
def vol(f): return nibabel.load(f).get_fdata()
def flat(x):
    """Every number of nested JSON by its key, also those inside."""
    return {k: v for key, y in x.items() for k, v in (flat(y) if isinstance(y, dict) else {key: y}).items()}
def said(f): return flat(json.load(open(f)))
page = open(sys.argv[2], encoding='utf-8').read()
def card(name):
    """The rows of a table: its first cell, and the others."""
    m = re.search('<section class="card" id="%s">(.*?)</section>' % name, page, re.S)
    rows = re.findall('<tr><th scope="row">(.*?)</th>(.*?)</tr>', m[1], re.S) if m else []
    return {k: re.findall('<td>(.*?)</td>', v) for k, v in rows}
def rms(x): return np.sqrt((x ** 2).mean())
def tissues():
    hr, std, truth = vol('hr.nii'), vol('std.nii'), vol('truth.nii')
    kinds = {'air, below \u2212950 HU': hr < -950, 'lung or partly air, to \u2212400 HU': (hr >= -950) & (hr < -400),
             'soft tissue, to 200 HU': (hr >= -400) & (hr <= 200), 'bone, above 200 HU': hr > 200}
    return {k: ['%.1f %%' % (100 * at.mean()), '%.3g HU' % rms(std[at]), '%.1f %%' % (100 * (std[at] > 100).mean()),
                '%.3g HU' % rms(hr[at] - truth[at])] for k, at in kinds.items() if at.any()}
def truths():
    b, a = said('before'), said('after')
    return {'PSNR': ['%.2f dB' % b['psnr'], '%.2f dB' % a['psnr']], 'SSIM': ['%.4f' % b['ssim-r2'], '%.4f' % a['ssim-r2']],
            'Mean absolute error': ['%.4g HU' % b['mae-hu'], '%.4g HU' % a['mae-hu']],
            'Root mean square error': ['%.4g HU' % b['rmse-hu'], '%.4g HU' % a['rmse-hu']]}
def tenths():
    off, std = abs(vol('hr.nii') - vol('truth.nii')).ravel(), vol('std.nii').ravel()
    order = np.argsort(std, kind='stable')
    first, every = order[:len(order) // 10], order
    return {k: ['%.3g HU' % rms(std[i]), '%.3g HU' % rms(off[i]), '%.1f %%' % (100 * (off[i] <= std[i]).mean()),
                '%.1f %%' % (100 * (off[i] <= 2 * std[i]).mean())] for k, i in (('1', first), ('all', every))}
def near(a, b):
    """The same but for who is in a tenth where bins are cut, and the last digit."""
    a, b = (list(map(float, re.findall('[-0-9.]+', ' '.join(x)))) for x in (a, b))
    return len(a) == len(b) and all(abs(x - y) <= 0.05 * max(x, y) for x, y in zip(a, b))
def lines(name):
    m = re.search('id="%s">(.*?)</section>' % name, page, re.S)[1]
    return [np.array([list(map(float, p.split(','))) for p in t.split()]) for t in re.findall('points="(.*?)"', m)]
def heights(f):
    """Of the histogram, 0 to 1."""
    h = np.histogram(np.clip(vol(f), -1024, -1024 + 32 * 128 - 1e-3), 128, (-1024, -1024 + 32 * 128))[0]
    return np.log10(1 + h)
what = eval(sys.argv[1])
if not what: print(sys.argv[1], file=sys.stderr)
sys.exit(not what)
END
is() { "$PY" look.py "$1" "${3:-r.html}" 2>err; ok $? "$2"; sed 's/^/# /' err; } # is EXPRESSION NAME [PAGE]
is '(lambda c, m: c == {"Residual, RMS": ["%.3f HU" % m["residual-rms-hu"]], "Residual, 95 % of voxels below": ["%.3f HU" % m["residual-p95-hu"]], "Residual, largest": ["%.3f HU" % m["residual-max-hu"]], "Voxels of the scan": ["%d" % (32 * 24 * 40)]})(card("agreement"), said("agrees"))' \
	'how far from the scan' linear.html
is 'card("error") == tissues() and len(tissues()) == 4' 'the predicted error and the error, by tissue'
is 'card("truth") == truths()' 'before and after, against the truth'
is 'all(near(card("calibration")[k], v) for k, v in tenths().items()) and 7 <= len(card("calibration")) <= 11' \
	'by tenths of the predicted error'
grep -q 'aria-label="median edge of the scan"' r.html; ok $? 'the median edge of the scan is drawn'
is 'card("scan") == {"Factor": ["2 \u00d7 2 \u00d7 1"], "Blur before sampling, standard deviation": ["%.3g \u00d7 %.3g \u00d7 %.3g voxels of the result" % tuple(map(float, said("info")["sigma"].split(",")))], "Sampling": ["sinc"], "Known from": ["the header of the scan"], "Noise": ["none known"]}' \
	'how the scan was made'
is '(lambda c, m: c["10 to 90 % of the step"] == ["%.2f mm" % m["edge-rise-test-mm"], "%.2f mm" % m["edge-rise-ref-mm"]])(card("edges"), said("edges"))' \
	'edges before and after'
is '(lambda l: len(l) == 2 and l[0][0, 1] > l[0][-1, 1] and l[1][0, 1] > l[1][-1, 1] and abs(np.diff(l[0][:, 1])).max() < abs(np.diff(l[1][:, 1])).max())(lines("edges"))' \
	'which rise, after more than before'
is '(lambda h, l: all(abs((128 + 8 - p[:, 1]) / 128 - q / max(map(np.max, h))).max() < 0.001 for p, q in zip(l, h)))([heights("cubic.nii"), heights("hr.nii")], lines("histogram"))' \
	'the histogram'
is '(lambda hr, std: "<li>At %.0f %% of the voxels of the body the predicted error is above 100 HU: " % (100 * (std[hr >= -950] > 100).mean()) in page and (std > 100).mean() < .5)(vol("hr.nii"), vol("std.nii"))' \
	'how much of the body is not to be trusted'
ct-report -q noisy.nii nhr.nii noisy.html
is 'card("scan")["Noise, standard deviation"] == ["12 HU"] and "noisy:" not in page and "Noise" not in card("scan")' 'noise, too little to warn of' noisy.html
ct-report -q barelr.nii bare.nii bare.html
is 'list(card("scan")) == ["Operator", "Noise"] and card("scan")["Operator"] == ["not known"] and "HU or texture" in card("scan")["Noise"][0] and card("agreement") == {} and "<li>The operator of the scan is not known" in page and "2 \u00d7 2 \u00d7 1 times as many as barelr.nii" in page' \
	'of a scan that says nothing' bare.html
is '"No prior was used" not in page and "No predicted error was given" in page' 'nor does the result' bare.html

# The page of a scan whose blur nobody says, and what ct-metrics makes of its result.
part estimated
ct-phantom -q --size 96x96x96 shepp-logan big.nii && ct-degrade -q -x 2 big.nii h.nii &&
	tail -c 442368 h.nii >h.raw && ct-convert -q --raw 48x48x48:f32:4 --orient RAS h.raw bare.nii &&
	ct-degrade -q -x 2 --noise 20 big.nii l.nii && tail -c 442368 l.nii >l.raw &&
	ct-convert -q --raw 48x48x48:f32:4 --orient RAS l.raw loud.nii || exit 99
exits 0 'a scan whose blur is estimated' ct-sr -Q draft -x 2 --report r.html bare.nii hr.nii
has r.html '"row">Estimated</th><td>profile [0-9.,]* mm wide (2.35 standard deviations) ' 'its page tells what was assumed'
! grep -q 'Known from' r.html; ok $? 'a blur that is estimated does not count as known'
has r.html '<pre>ct-sr: assumed: profile ' 'and so does the log on the page'
has r.html '<li>The blur of the scan is not known but estimated' 'an estimated blur is a warning'
has r.html 'id="error"' 'the page shows the predicted error, which is not asked for'
ct-sr -q -Q draft -x 2 bare.nii plain.nii && ct-metrics --ssim none plain.nii hr.nii >out; has out '^psnr inf$' 'and the result is the same as without a page'
: >log; CTSR_LOG=log ct-sr -q -f -Q draft -x 2 bare.nii hr.nii
has log '^ct-sr: assumed: profile ' 'a quiet run puts it into CTSR_LOG, too'
exits 0 'a scan that says its blur' ct-sr -Q draft --report said.html h.nii said.nii
! grep -q 'not known but estimated' said.html; ok $? 'has no such warning'
# a scan that is smooth: the header names its blur, nothing is noisy, the error is small; all the same
ct-degrade -q -x 1 --sigma 6,6,6 big.nii soft.nii && tail -c 3538944 soft.nii >soft.raw && ct-convert -q -f --raw 96x96x96:f32:2 --orient RAS soft.raw soft.nii &&
	ct-degrade -q -x 2 soft.nii smooth.nii || exit 99
exits 0 'a smooth scan is refined with a page' ct-sr -q -x 2 --confidence std.nii --report smooth.html smooth.nii smooth-hr.nii
has smooth.html '<li>The scan is smooth: its edges rise within ' 'the page of a smooth scan warns that it is smooth'
! grep -q 'No warning' smooth.html; ok $? 'the page of a smooth scan does not say that there is no warning'
exits 0 'a dry run of a scan without noise' ct-sr --dry-run -Q draft -x 2 bare.nii no.nii
has out '^noise     none that is certain (measured)$' 'says that no noise was found, not that there is none'
exits 0 'a noisy scan is refined with a page' ct-sr -Q draft -x 2 --report loud.html loud.nii loud-hr.nii
has err '^ct-sr: noise: [0-9.]* HU or texture; ' 'what was measured of the noise is said, and what is done'
has loud.html '^ct-sr: noise: [0-9.]* HU or texture; ' 'on the page, too'
ct-phantom -q --size 94x92x88 shepp-logan odd.nii && ct-degrade -q -x 2 odd.nii - | tail -c 380512 >odd.raw &&
	ct-convert -q --raw 47x46x44:f32:4 --orient LAI odd.raw turned.nii || exit 99
ct-sr -f -Q draft -x 2 --report turned.html turned.nii turned-hr.nii 2>err
has turned.html "Noise</th><td>$(sed -n 's/^ct-sr: noise: \([0-9.]* HU\) or texture.*/\1/p' err) or texture" 'the page has the noise that is said, whichever way the scan is stored'
ct-convert -q --raw 48x48x48:f32:4 --rescale .00048828125,.5 --orient RAS l.raw unit.nii || exit 99
exits 0 'a scan of another unit is refined with a page' ct-sr -Q draft -x 2 --units other --report unit.html unit.nii unit-hr.nii
has unit.html "Noise, standard deviation</th><td>$(sed -n 's/.*; \([0-9.]* HU\) is taken for noise$/\1/p' err)<" 'the page of another unit counts values as the log does'
has unit.html 'Residual, RMS</th><td>[1-9][0-9.]* HU' 'the residual on the page of another unit is counted, too'
exits 0 'the consistency of a result with a scan that names no operator' ct-metrics --consistency bare.nii hr.nii
has out '^residual-rms-hu ' 'the consistency of such a result has figures'
has out '^factor 2,2,2$' 'and the operator that counted'
has err '^ct-metrics: operator as assumed by ct-sr: profile ' 'it says that ct-sr assumed the operator'
ct-sr -q -f -Q draft -x 2 --sigma .5 bare.nii given.nii && ct-metrics --consistency bare.nii given.nii 2>err >out
[ "$(cat err)" = 'ct-metrics: operator by the header of TEST' ]; ok $? 'an operator that ct-sr was given does not count as assumed'
ct-metrics -q --consistency h.nii hr.nii >told 2>err && [ ! -s err ]; ok $? 'the operator of the scan counts, where it names one'
exits 3 'a scan that was refined itself' ct-metrics --consistency hr.nii hr.nii
has err '^ct-metrics: hr.nii: is upsampled' 'an upsampled scan is refused, and named'
command -v chromium >/dev/null && command -v python3 >/dev/null || {
	skip 'how the page fits' 'no chromium'
	done_testing
}
for page in r.html said.html loud.html; do
	python3 "$srcdir/tests/fits.py" $page 390 1280 1920 >seen 2>err; rc=$?
	if [ $rc -eq 77 ]; then skip "$page fits" "$(head -n 1 err)"; continue; fi
	[ $rc -eq 0 ]; ok $? "$page: no cell runs out of its card, no label is broken, at 390, 1280 and 1920 pixels"
	tr '|' '\n' <seen | head -n 5 | cut -c1-100 | sed 's/^/# /'
done
done_testing
