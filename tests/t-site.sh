#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What is installed to read: examples, and the pages of make html. These lead to each other, ask for nothing else, and fit the screen.
. "$srcdir/tests/tap.sh"
# beside them, the examples: all but what builds the source
${MAKE:-make} -s -C "$builddir" DESTDIR="$PWD/root" MAKEFLAGS= install-nobase_dist_exampleDATA install-nobase_dist_exampleSCRIPTS >made 2>&1
ok $? 'the examples are installed'
at=$(find root -type d -name examples)
(cd "$srcdir/examples" && find . -type f ! -name cranium.sh ! -name paper ! -name '*.o' ! -path './.*' | sort) >want
(cd "$at" && find . -type f | sort) >have
diff want have | sed 's/^/# /'; cmp -s want have; ok $? 'no example is left behind'
mkdir scans && ct-phantom -q --size 24x24x24 ellipsoids scans/a.nii
[ -x /usr/bin/time ] || { printf '#!/bin/sh\nout=$2; shift 4; "$@" && echo 1 1 >$out\n' >time; chmod +x time; export MAKEFLAGS=TIME=./time; }
exits 0 'an installed makefile refines a folder of scans' make -s -f "$at/cohort.mk" OUT=fine OPTIONS='-x 1,1,2 -Q draft'
has out '| a | 24x24x48' 'the installed makefile prints its table'
py=$(python3 -c "import sys; print(sys.executable)")
exits 1 'without cmark-gfm and mandoc make html names the packages' env PATH=/nowhere "$py" "$srcdir/scripts/site.py" "$srcdir" "$builddir" html
has err 'not found: cmark-gfm, mandoc; .*apt-get install cmark-gfm mandoc' 'the message of make html has the command that installs them'
command -v cmark-gfm >/dev/null && command -v mandoc >/dev/null || { skip 'the pages' 'no cmark-gfm or no mandoc'; done_testing; }
site() { python3 "$srcdir/scripts/site.py" "$1" "$builddir" html; }
mkdir source && ln -s "$srcdir"/* source && rm source/README.md && echo '[more](doc/guide.md) [lost](doc/lost.md)' >source/README.md
exits 1 'a link to a file that is not there is refused' site source
has err 'README.md: link to doc/lost.md, which is no file' 'the message names the page and the link'
exits 0 'the pages of the site are made' site "$srcdir"
for t in $CT_TOOLS; do [ -s "html/$t.1.html" ] || echo "$t"; done >lost
[ ! -s lost ]; ok $? 'every command has a page on the site'
cat >links.py <<'END'
import glob, html.parser, os, re
class Page(html.parser.HTMLParser):
    def __init__(self, name):
        super().__init__()
        self.name, self.ids, self.links, self.asked, self.inside, self.bare = name, [], [], [], [], []
        with open(name, encoding='utf-8') as f:
            self.feed(f.read())
    def handle_starttag(self, tag, given):
        a = dict(given)
        if tag not in ('meta', 'link', 'img', 'br', 'hr', 'col', 'input', 'wbr'):
            self.inside.append(tag)
        if 'id' in a:
            self.ids.append(a['id'])
        if tag == 'a' and 'href' in a:
            self.links.append(a['href'])
        self.asked += [v for v in (a.get('src'), a.get('href') if tag == 'link' else None, 'script' if tag == 'script' else None,
                                   a['style'] if 'url(' in a.get('style', '') else None) if v]
    def handle_endtag(self, tag):
        while self.inside and self.inside.pop() != tag:
            pass
    def handle_data(self, text):
        if not {'a', 'h1', 'title'} & set(self.inside):
            self.bare += re.findall(r'\bct-[a-z]+\(\d\)', text)
pages = {os.path.basename(f): Page(f) for f in glob.glob('html/*.html')}
def none(name, bad):
    print('%s %s' % ('bad' if bad else 'good', name))
    for b in bad:
        print('#', *b)
none('no link of a page leads nowhere', [(n, l) for n, p in pages.items() for l in p.links if not re.match('https?:', l)
     for f, _, a in [l.partition('#')] if f and not os.path.isfile('html/' + f) or a and (f or n) in pages and a not in pages[f or n].ids])
none('no page asks for a script or another host', [(n, s) for n, p in pages.items() for s in p.asked if s == 'script' or not os.path.isfile('html/' + s)])
none('no page has an anchor twice', [(n, i) for n, p in pages.items() for i in set(p.ids) if p.ids.count(i) > 1])
none('every page of the site is linked from its contents', [(n,) for n in pages if not any(n in p.links for m, p in pages.items() if m != n)])
none('every reference to another man page is a link', [(n, b) for n, p in pages.items() for b in p.bare if not n.startswith(b[:-3] + '.')])
none('each function of ctsr.h has an anchor', [(f,) for f in re.findall(r'\b(ctsr_\w+)\(', open(os.environ['srcdir'] + '/src/ctsr/ctsr.h').read())
     if f not in pages['api-c.html'].ids])
END
python3 links.py >said; ok $? 'the pages can be read'
judged() { # judged FILE: its lines "good NAME" and "bad NAME" as tests
	while read -r how name; do
		case $how in
		'#') echo "# $name" ;;
		*) [ "$how" = good ]; ok $? "$name" ;;
		esac
	done <"$1"
}
judged said
python_with selenium && command -v chromium >/dev/null && command -v chromedriver >/dev/null || { skip 'in a browser' 'no chromium, chromedriver or selenium'; done_testing; }
cat >look.py <<'END'
import glob, os, sys
from selenium import webdriver
from selenium.webdriver.chrome.service import Service
options = webdriver.ChromeOptions()
for a in ('--headless=new', '--no-sandbox', '--disable-gpu', '--disable-dev-shm-usage', '--user-data-dir=' + os.path.abspath('profile')):
    options.add_argument(a)
try:
    d = webdriver.Chrome(options=options, service=Service('/usr/bin/chromedriver'))
except Exception as e:
    sys.exit(print(e, file=sys.stderr) or 77)
try:
    wide = []
    for page in sorted(glob.glob('html/*.html')):
        d.get('file://' + os.path.abspath(page))
        for w in 390, 1280, 1920:
            d.execute_cdp_cmd('Emulation.setDeviceMetricsOverride', dict(width=w, height=900, deviceScaleFactor=1, mobile=False))
            if d.execute_script('return document.documentElement.scrollWidth') > w:
                wide.append((page, w))
    print('bad' if wide else 'good', 'no page is wider than screens of 390, 1280 and 1920 pixels')
    for w in wide:
        print('#', *w)
finally:
    d.quit()
END
"$PY" look.py >said 2>err; rc=$?
[ $rc -ne 77 ] || { skip 'in a browser' 'chromium does not start here'; done_testing; }
[ $rc -eq 0 ]; ok $? 'the pages open in a browser'
judged said
done_testing
