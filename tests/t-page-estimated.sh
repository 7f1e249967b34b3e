#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The page of a scan whose blur nobody says, and what ct-metrics makes of its result.
. "$srcdir/tests/tap.sh"
ct-phantom -q --size 96x96x96 shepp-logan big.nii && ct-degrade -q -x 2 big.nii h.nii &&
	tail -c 442368 h.nii >h.raw && ct-convert -q --raw 48x48x48:f32:4 --orient RAS h.raw bare.nii &&
	ct-degrade -q -x 2 --noise 20 big.nii l.nii && tail -c 442368 l.nii >l.raw &&
	ct-convert -q --raw 48x48x48:f32:4 --orient RAS l.raw loud.nii || exit 99
exits 0 'a scan whose blur is estimated' ct-sr -Q draft -x 2 --report r.html bare.nii hr.nii
has r.html '"row">Known from</th><td>profile ' 'its page tells what was assumed'
has r.html '<pre>ct-sr: assumed: profile ' 'and so does the log on the page'
has r.html '<li>The blur of the scan is not known but estimated' 'an estimated blur is a warning'
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
exits 0 'a noisy scan is refined with a page' ct-sr -Q draft -x 2 --report loud.html loud.nii loud-hr.nii
has err '^ct-sr: noise: [0-9.]* HU or texture; ' 'what was measured of the noise is said, and what is done'
has loud.html '^ct-sr: noise: [0-9.]* HU or texture; ' 'on the page, too'
exits 0 'the consistency of a result with a scan that names no operator' ct-metrics --consistency bare.nii hr.nii
has out '^residual-rms-hu ' 'the consistency of such a result has figures'
has out '^factor 2,2,2$' 'and the operator that counted'
has err '^ct-metrics: operator as assumed by ct-sr: profile ' 'it says that ct-sr assumed the operator'
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
