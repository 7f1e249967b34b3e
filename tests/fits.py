# SPDX-License-Identifier: Apache-2.0
"""fits.py PAGE WIDTH...: does no cell of a page of ct-report run out of its card, and no word break in a label?"""
import re
import subprocess
import sys
import tempfile

LOOK = '''<script>addEventListener('load', () => {
const bad = [], widths = %s;
for (const width of widths) {
	document.body.style.width = width + 'px';
	for (const cell of document.querySelectorAll('.card th, .card td')) {
		const range = document.createRange(), card = cell.closest('.card').getBoundingClientRect();
		range.selectNodeContents(cell);
		const r = [...range.getClientRects()], lines = new Set(r.map(x => Math.round(x.top))).size;
		if (r.some(x => x.right > card.right + 1 || x.left < card.left - 1))
			bad.push(`${width}: runs out: ${cell.textContent}`);
		if (cell.tagName === 'TH' && lines > cell.textContent.trim().split(/\\s+/).length)
			bad.push(`${width}: broken: ${cell.textContent}`);
	}
}
document.body.innerHTML = '';
document.body.textContent = 'LOOKED ' + widths.length + ' [' + bad.join(' | ') + '] END';
});</script></body>'''
page = open(sys.argv[1], encoding='utf-8').read()
with tempfile.TemporaryDirectory() as at:
    open(at + '/look.html', 'w', encoding='utf-8').write(page.replace('</body>', LOOK % list(map(int, sys.argv[2:]))))
    ran = subprocess.run(['chromium', '--headless', '--no-sandbox', '--disable-gpu', '--disable-dev-shm-usage',
                          '--user-data-dir=' + at + '/profile', '--window-size=2000,1400', '--dump-dom',
                          'file://' + at + '/look.html'], capture_output=True, text=True, timeout=120)
said = re.search(r'<body[^>]*>LOOKED \d+ \[(.*)\] END', ran.stdout, re.S)
if not said:
    sys.exit(print('chromium does not run here: ' + ran.stderr[-200:].replace('\n', ' '), file=sys.stderr) or 77)
print(said[1])
sys.exit(1 if said[1] else 0)
