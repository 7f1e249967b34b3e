#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-report: the page, to the number, and in a browser that moves, clicks and looks at pixels.
. "$srcdir/tests/tap.sh"
ct-phantom -q --size 64x48x40 --spacing 2 ellipsoids truth.nii && ct-degrade -q -x 2 -p P1 truth.nii lr.nii &&
	ct-upsample -q -x 2 lr.nii hr.nii || exit 99
# a page without a predicted error
exits 0 'ct-report writes a page of a scan and its result' ct-report -q lr.nii hr.nii plain.html
has plain.html '<li>No prior was used' 'a page without a prior says that no prior was used'
has plain.html '<li>No predicted error was given' 'a page without a predicted error says that none was given'
has plain.html '^<p class="sub">64 × 48 × 40 voxels of 2 × 2 × 2 mm, 2 × 2 × 2 times as many as lr.nii: 32 × 24 × 20 voxels' 'a page shows the grids of scan and result'
! grep -qE 'id="(error|truth|calibration|[a-z]*-std-[0-9]*)"' plain.html
ok $? 'a page without a truth or predicted error has no such tables'
! grep -qE '(src|href)=|url\(|@import|https?:|fetch\(|XMLHttp|WebSocket' plain.html
ok $? 'a page refers to no other file or site'
has plain.html "content=\"default-src 'none'; " 'a page forbids the browser to load anything'
mkdir far; cp hr.nii far/hr.nii
ct-report -q -t 3 lr.nii far/hr.nii - >again.html && cmp -s plain.html again.html
ok $? 'the page has the same bytes from another folder and with three threads'

# a predicted error that is known: 7 HU, and 200 where it is bright
printf '%s\n' 'ct-a: warning: /home/Jane Doe/x y.nii: odd' 'ct-a: warning: said twice' 'ct-a: warning: said twice' \
	'ct-b: took 3.0 s, 4.0 s of CPU time, 55 MiB' 'ct-b: kept in /home/jane/k.nii, 3 HU/mm' >log
python_with nibabel && "$PY" - <<'END'
import nibabel, numpy
hr = nibabel.load('hr.nii')
v = hr.get_fdata()
nibabel.save(nibabel.Nifti1Image(numpy.where(v > 200, 200, 7).astype('float32'), hr.affine), 'std.nii')
nibabel.save(nibabel.Nifti1Image(-v.astype('float32') - 2000, hr.affine), 'neg.nii')
edge = numpy.zeros(v.shape)
edge[:, :, :20] = 1000
END
if [ -s std.nii ]; then
	bad='<script>alert(1)<script>&"quote'"'"'.nii'
	cp hr.nii "$bad"
	exits 0 'ct-report accepts a file name that is HTML' ct-report -q --uncertainty std.nii --truth truth.nii --log log lr.nii "$bad" r.html
	has r.html '<h1>&#60;script&#62;alert(1)&#60;' 'a file name that is HTML is shown as text'
	[ "$(grep -c '<script>' r.html)" = 1 ]; ok $? 'a file name that is HTML adds no script to the page'
	has r.html '<li>ct-a: x y.nii: odd</li>' 'a warning of the log is listed with file names without their folders'
	[ "$(grep -c '<li>ct-a: said twice</li>' r.html)" = 1 ]; ok $? 'a warning that the log holds twice is listed once'
	has r.html '^ct-b: kept in k.nii, 3 HU/mm$' 'the other lines of the log are shown without folders'
	! grep -qi 'jane' r.html; ok $? 'the page shows no name of a folder of the log'
	ct-metrics --ssim none --window=-1024:3071 truth.nii hr.nii | sed -n 's/^psnr \(.*\)/\1/p' | { read -r n; printf '<td>%.2f dB</td></tr>' "$n"; } >want
	grep '"row">PSNR' r.html | grep -qF "$(cat want)"; ok $? 'the page gives the PSNR of ct-metrics'
	has r.html '"row">bone, above 200 HU</th><td>[0-9.]* %</td><td>200 HU</td><td>100.0 %</td>' 'the page gives the predicted error of bone'
	has r.html '"row">soft tissue, to 200 HU</th><td>[0-9.]* %</td><td>7 HU</td><td>0.0 %</td>' 'the page gives the predicted error of soft tissue'
	"$PY" - <<'END'
import nibabel, numpy
v = numpy.random.default_rng(1).normal(40, 5, (40, 40, 24))
x, y = numpy.indices(v.shape[:2]) - 19.5
v[numpy.hypot(x, y) > 17] = -2000
nibabel.save(nibabel.Nifti1Image(v.astype('float32'), numpy.diag([2, 2, 2, 1])), 'padded.nii')
END
	"$PY" -c 'import nibabel, numpy
v = numpy.full((40, 40, 1), -1000, "float32"); v[12:28, 12:28] = 900
nibabel.save(nibabel.Nifti1Image(v, numpy.eye(4)), "slice.nii")'
	ct-upsample -q -x 2,2,1 -m cubic slice.nii slicehr.nii; ct-report -q slice.nii slicehr.nii slice.html
	has slice.html '<li>The result has too few voxels along an axis to measure how sharp it is' 'the page of one slice does not say that it is smooth'
	ct-upsample -q -x 2 -m cubic padded.nii padhr.nii; ct-report -q padded.nii padhr.nii padded.html
	has padded.html '"row">Noise</th><td>[45][0-9.]* HU' 'the page tells the noise of a scan of which nothing else is known'
	has padded.html '<li>The result is smooth: too few edges' 'the border of padding is no edge whose sharpness the page tells'
	exits 3 'what is no HU is refused' ct-report --units other lr.nii hr.nii no.html
	printf 'a\0b' >zero.log
	exits 3 'a log that holds a zero byte is refused with status 3' ct-report --log zero.log lr.nii hr.nii no.html
	exits 3 'a negative predicted error is refused with status 3' ct-report --uncertainty neg.nii lr.nii hr.nii no.html
	has err 'neg.nii: holds -[0-9.]* HU, which no predicted error is' 'the error of a negative predicted error names the file'
else
	skip 'the page gives the predicted error' 'no nibabel'
fi
# names, warnings, results that do not fit
name=$(printf 'b\377d\001.nii'); cp hr.nii "$name"
ct-report -q lr.nii "$name" bytes.html && python3 -c 'open("bytes.html", encoding="utf-8").read()' 2>/dev/null
ok $? 'a file name that is not UTF-8 gives a page in UTF-8'
ct-degrade -q -x 2 -p P1 --noise 40 --seed 1 truth.nii noisy.nii; ct-upsample -q -x 2 noisy.nii nhr.nii
ct-report -q noisy.nii nhr.nii noisy.html
has noisy.html '<li>The scan is noisy: 40 HU' 'the page warns of a noisy scan'
for n in 40 41; do
	awk -v n=$n 'BEGIN {for (i = 1; i <= n; i++) print "ct-a: warning: thing " i; print "ct-a: warning: thing 1"}' >many
	ct-report -q --log many lr.nii hr.nii many$n.html
	[ "$(grep -c '<li>ct-a: thing ' many$n.html)" = 40 ]; ok $? "of $n warnings in the log 40 are listed"
	has many$n.html '<li>No predicted error was given' "beside $n warnings in the log the page lists its own"
done
! grep -q '<li>Not all warnings' many40.html && grep -q '<li>Not all warnings' many41.html
ok $? 'the page says that warnings are left out only if they are more than 40'
ct-upsample -q -x 2 -m linear lr.nii linear.nii; ct-report -q lr.nii linear.nii linear.html
has linear.html '<li>The result does not agree with the scan: the residual is [0-9.]* HU RMS' 'the page warns of a result that does not agree with the scan'
n=$(ct-metrics --json --consistency lr.nii linear.nii | sed -n 's/.*"residual-rms-hu": \([^,]*\).*/\1/p')
has linear.html "<th scope=\"row\">Residual, RMS</th><td>$(printf %.3f "$n") HU</td>" "the page gives the residual of ct-metrics, $n HU"
has plain.html '"row">Residual, RMS</th><td>0.0[0-9]* HU</td>' 'the residual of a result that agrees with the scan is below 0.1 HU'
exits 5 'a scan instead of the result is refused with status 5' ct-report lr.nii lr.nii no.html
has err 'lr.nii' 'the error of a scan instead of the result names the file'
exits 5 'a truth on another grid is refused with status 5' ct-report --truth lr.nii lr.nii hr.nii no.html
ct-phantom -q --size 32x24x20 --spacing 4 ellipsoids coarse.nii
exits 5 'a result that is coarser than the scan is refused with status 5' ct-report truth.nii coarse.nii no.html
has err '^ct-report: coarse.nii: is not 1 to 64 times as fine as truth.nii$' 'the error of a result that is coarser names both files'
exits 2 'an output that is not named .html is refused with status 2' ct-report lr.nii hr.nii no.pdf
[ ! -e no.html ] && [ ! -e no.pdf ]; ok $? 'refused runs of ct-report leave no page'

# the log that a page shows: CTSR_LOG
: >j; CTSR_LOG=j ct-upsample -q -f -x 2 -m linear truth.nii big.nii
grep -qE '^ct-upsample: took [0-9]+\.[0-9] s, [0-9]+\.[0-9] s of CPU time, [1-9][0-9]* MiB$' j
ok $? 'a command appends its time and memory to the file in CTSR_LOG'
CTSR_LOG=j ct-upsample -q -f --estimate -x 2 lr.nii none/x.nii 2>/dev/null; CTSR_LOG=j ct-upsample -m prior -q -f -x 5 truth.nii r5.nii 2>/dev/null
grep -q '^ct-upsample: failed after ' j; ok $? 'a command that fails appends how long it ran to the log'
ct-convert -q --cube 8 truth.nii small.nii; CTSR_LOG=j ct-upsample -m prior -q --estimate -x 4 small.nii s4.nii 2>err
[ ! -s err ] && grep -q '^ct-upsample: warning: small.nii: ' j; ok $? 'a warning that -q hides is appended to the log'
two=$(printf 'sm\nall.nii'); cp small.nii "$two"; CTSR_LOG=j ct-upsample -m prior -q --estimate -x 4 "$two" s5.nii 2>/dev/null
grep -q '^ct-upsample: warning: sm?all.nii: ' j && ! grep -qv '^ct-' j
ok $? 'a file name with a line break stays on one line of the log'
wc -l <j >n
CTSR_LOG=j ct-upsample -m prior --dry-run --estimate -x 4 small.nii no.nii >/dev/null 2>&1
wc -l <j | cmp -s - n
ok $? 'a dry run appends nothing to the log'
CTSR_LOG=k ct-info lr.nii >/dev/null && [ ! -e k ]; ok $? 'a log that does not exist is not made'

# in a browser
python_with selenium && command -v chromium >/dev/null && command -v chromedriver >/dev/null && [ -s r.html ] || {
	skip 'in a browser' 'no chromium, chromedriver or selenium'
	done_testing
}
cat >look.py <<'END'
import sys, time
from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.keys import Keys
options = webdriver.ChromeOptions()
for a in ('--headless=new', '--no-sandbox', '--disable-gpu', '--disable-dev-shm-usage', '--window-size=1400,1400', '--user-data-dir=' + sys.argv[2]):
    options.add_argument(a)
options.set_capability('goog:loggingPrefs', {'browser': 'ALL'})
try:
    d = webdriver.Chrome(options=options, service=Service('/usr/bin/chromedriver'))
except Exception as e:
    sys.exit(print(e, file=sys.stderr) or 77) # it does not run here: no network of its own, no /dev/shm
js = d.execute_script
def wait(what):
    for _ in range(200):
        if js('return ' + what):
            return True
        time.sleep(.05)
    return False
def ok(is_so, name):
    print('%s %s' % ('good' if is_so else 'bad', name), flush=True)
def canvas(kind, n=0):
    return js('''const c = document.querySelectorAll('#panels .' + arguments[0])[arguments[1]], v = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
        return [c.width, c.height, Array.from(v)]''', kind, n)
def grey(kind, x, y, n=0):
    w, h, v = canvas(kind, n)
    return v[4 * (y * w + x)]
def drawn(text):
    return wait("[...document.querySelectorAll('.image')].every(i => (i.dataset.drawn || '').match(/%s/))" % text)
def click(css):
    d.find_element('css selector', css).click()
try:
    d.get('file://' + sys.argv[1])
    ok(drawn('.'), 'in the browser three planes are drawn')
    ok(js("return document.querySelectorAll('#panels figure').length") == 3 and js("return document.title").startswith('<script>alert(1)'), 'in the browser the title is the file name as text')
    ok(not js("return document.querySelector('h1').children.length"), 'in the browser the heading holds no element')
    high = js("return [...document.querySelectorAll('.image')].map(i => i.getBoundingClientRect()).map(r => [r.top, r.height])")
    ok(len(high) == 3 and max(abs(h[k] - high[0][k]) for h in high for k in (0, 1)) < 1.5, 'in the browser the three planes stand side by side, equally high')
    import nibabel
    import numpy as np
    hr, truth = (np.asarray(nibabel.load(f).dataobj, dtype=float) for f in ('hr.nii', 'truth.nii'))
    meta = js("return JSON.parse(document.getElementById('meta').textContent)")
    nib = nibabel.load('hr.nii')
    back = np.linalg.inv(nib.affine)
    at = int(js("return document.getElementById('slice-axial').value"))
    mm = meta['planes'][0]['at'][at]
    k = int(np.floor((back @ [0, 0, mm, 1])[2] + .5 + 1e-6))
    k = min(range(hr.shape[2]), key=lambda i: abs((nib.affine @ [0, 0, i, 1])[2] - mm))
    ras = nibabel.as_closest_canonical(nib)
    want = np.asarray(ras.dataobj, dtype=float)[::-1, ::-1, k].T # right of the patient on the left, anterior on top
    tones = lambda v, lo, hi: np.clip(np.round((np.rint(v) - lo) * 255 / (hi - lo)), 0, 255)
    def same(kind, want, n=0):
        w, h, v = canvas(kind, n)
        return (h, w) == want.shape and np.abs(np.array(v).reshape(h, w, 4)[:, :, 0] - want).max() <= 1
    ok(same('after', tones(want, -160, 240)), 'the pixels of the axial plane are the voxels in the window')
    click('[data-window="-450,1550"]')
    ok(drawn('-450 1550') and same('after', tones(want, -450, 1550)), 'a click on the window for bone draws the pixels in it')
    low = d.find_element('id', 'low')
    low.send_keys(Keys.CONTROL, 'a'); low.send_keys('-900', Keys.TAB)
    ok(drawn('-900 1550') and same('after', tones(want, -900, 1550)), 'a number typed into the window draws the pixels in it')
    slider = d.find_element('id', 'slice-axial')
    slider.send_keys(Keys.ARROW_RIGHT)
    ok(wait("document.querySelector('.image').dataset.drawn.startsWith('%d ')" % (at + 1)), 'an arrow key on the slider draws the next slice')
    mm = meta['planes'][0]['at'][at + 1]
    k = min(range(hr.shape[2]), key=lambda i: abs((nib.affine @ [0, 0, i, 1])[2] - mm))
    ok(same('after', tones(np.asarray(ras.dataobj, dtype=float)[::-1, ::-1, k].T, -900, 1550)), 'the pixels after an arrow key are those of the next slice')
    cut = lambda: js("return getComputedStyle(document.querySelector('.before')).clipPath")
    first = cut()
    split = d.find_element('id', 'split')
    split.send_keys(Keys.ARROW_LEFT * 20)
    ok(cut() != first and '60%' in cut(), 'the slider moves the border between scan and result (%s)' % cut())
    box = d.find_element('css selector', '.image')
    webdriver.ActionChains(d).move_to_element_with_offset(box, 40, 0).click_and_hold().move_by_offset(30, 0).release().perform()
    ok('60%' not in cut(), 'the mouse moves the border between scan and result')
    ok(js("return document.getElementById('probe').textContent").startswith('axial '), 'the page shows the values below the mouse')
    ok(js("return document.querySelector('.over').hidden"), 'at first no overlay is shown')
    click('[data-over="std"]')
    ok(drawn('std$') and not js("return document.querySelector('.over').hidden || document.getElementById('scale').hidden"), 'a click shows the predicted error as overlay with its scale')
    alpha = lambda: np.array(canvas('over')[2])[3::4]
    first = alpha()
    click('[data-over="error"]')
    ok(drawn('error$') and (alpha() != first).any(), 'a click shows the measured error as overlay')
    click('[data-kind="mip"]')
    ok(drawn('^mip'), 'a click draws the maximum along each axis')
    ok(js("return document.getElementById('overs').disabled"), 'the buttons of overlays are off beside the maximum')
    ok(same('after', tones(np.asarray(ras.dataobj, dtype=float).max(2)[::-1, ::-1].T, -900, 1550)), 'the pixels of the maximum are those of the volume')
    click('[data-plane="coronal"]')
    ok(js("return [...document.querySelectorAll('#panels figure')].map(f => f.hidden)") == [True, False, True], 'a click shows the coronal plane alone')
    high = "return document.querySelector('#panels figure:not([hidden])').getBoundingClientRect().bottom - document.querySelector('.split').getBoundingClientRect().top"
    d.set_window_size(1400, 500)
    ok(js(high + " <= innerHeight && document.querySelector('#panels figure:not([hidden])').clientWidth > 100"), 'a low window shows one plane with both sliders')
    d.set_window_size(1400, 1400)
    d.execute_cdp_cmd('Emulation.setEmulatedMedia', {'features': [{'name': 'prefers-color-scheme', 'value': 'dark'}]})
    ok(js("return getComputedStyle(document.body).backgroundColor") == 'rgb(16, 19, 23)', 'the page is dark where the browser asks for it')
    ok(js("return document.documentElement.scrollWidth <= innerWidth"), 'a wide window shows the whole width of the page')
    d.set_window_size(420, 900)
    ok(js("return document.documentElement.scrollWidth <= innerWidth"), 'a narrow window shows the whole width of the page')
    log = [x for x in d.get_log('browser') if 'getImageData' not in x['message']] # which is ours
    ok(not log, 'the console of the browser is empty %s' % log)
    ok(js("return performance.getEntriesByType('resource').length") == 0, 'the browser loaded no other file')
finally:
    d.quit()
END
timeout 300 "$PY" look.py "$dir_/r.html" "$dir_/profile" >seen 2>err; rc=$?
while read -r is name; do [ "$is" = good ]; ok $? "$name"; done <seen
if [ $rc -eq 77 ]; then skip 'the test in the browser runs to its end' "$(head -n 1 err)"; else [ $rc -eq 0 ]; ok $? 'the test in the browser runs to its end'; fi
[ $rc -eq 0 ] || sed 's/^/# /' err
done_testing
