#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The documents as static pages: site.py SOURCE BUILD OUT. `make html` runs it.

Markdown goes through cmark-gfm, man pages through mandoc; the API comes from the comments of src/ctsr/ctsr.h and
python/ctsr. OUT is replaced. A link to a file that is not there ends it with status 1.
"""
import ast
import html
import os
import re
import shutil
import subprocess
import sys
import textwrap

# A group of the navigation: its name, and its pages: file of the source, page, title.
DOCUMENTS = [
    ('Start', [('README.md', 'index', 'Overview'), ('doc/guide.md', 'guide', 'User guide')]),
    ('Tutorials', [('doc/tutorial-patient.md', 'tutorial-patient', 'Thick slices of a patient'),
                   ('doc/tutorial-evaluate.md', 'tutorial-evaluate', 'Many scans'),
                   ('doc/tutorial-paper.md', 'tutorial-paper', 'The paper, step by step')]),
    ('Results', [('doc/results.md', 'results', 'What ctsr gains'), ('doc/prior.md', 'prior', 'What the prior adds'),
                 ('doc/trials.md', 'trials', 'How the networks were chosen'), ('doc/blur-estimate.md', 'blur-estimate', 'Blur and noise, estimated'),
                 ('doc/scale.md', 'scale', 'Cost against size'), ('doc/blocks.md', 'blocks', 'Slabs against the whole'),
                 ('doc/samplers.md', 'samplers', 'Samplers of projections'), ('doc/release.md', 'release', 'The release of the paper'),
                 ('doc/extremes.md', 'extremes', 'Extreme scans'), ('doc/measured.md', 'measured', 'Measured scans'), ('doc/dicom.md', 'dicom', 'DICOM against other readers'),
                 ('src/prior/README.md', 'networks', 'What the networks learnt from')]),
    ('Manual', []),
    ('Library', [('src/ctsr/ctsr.h', 'api-c', 'C: ctsr.h'), ('python/ctsr', 'api-python', 'Python: ctsr'),
                 ('python/README.md', 'python', 'Python: how to install')]),
    ('Development', [('CONTRIBUTING.md', 'contributing', 'Contributing'), ('NEWS', 'news', 'What changed'),
                     ('examples/cluster/README.md', 'cluster', 'Clusters'), ('doc/mutation.md', 'mutation', 'What the tests notice'),
                     ('doc/check-long.md', 'check-long', 'Kills, full disks, little memory')]),
]
SECTIONS = {'1': 'Commands', '3': 'Library', '5': 'File formats', '7': 'Background'}
MODULES = ['__init__', 'commands', 'boutiques', 'nipype']


def run(*command, text=None):
    return subprocess.run(command, input=text, stdout=subprocess.PIPE, check=True, text=True).stdout


def plain(fragment):
    return html.unescape(re.sub('<[^>]*>', '', fragment)).strip()


def slug(text, taken):
    """The anchor that GitHub gives a heading."""
    name = re.sub(r'[^\w\- ]', '', text.lower()).replace(' ', '-')
    n = taken[name] = taken.get(name, -1) + 1
    return name if n == 0 else '%s-%d' % (name, n)


class Site:
    def __init__(self, source, build, out):
        self.source, self.build, self.out = source, build, out
        self.pages = {}    # page: (group, title, body)
        self.of = {}       # file of the source: page
        self.manual = {}   # ct-sr(1): page

    def path(self, name):
        return os.path.join(self.source, name)

    def text(self, name):
        with open(self.path(name), encoding='utf-8') as f:
            return f.read()

    def target(self, page, base, link):
        """Where a link of a file in folder `base` leads on the site. Files that are no page are copied."""
        if re.match(r'[a-z]+:|#', link):
            return link
        name, _, anchor = link.partition('#')
        name = os.path.normpath(os.path.join(base, name))
        if name in self.of:
            return self.of[name] + '.html' + ('#' + anchor if anchor else '')
        if not os.path.isfile(self.path(name)):
            sys.exit('site.py: %s: link to %s, which is no file' % (page, link))
        return os.path.basename(shutil.copyfile(self.path(name), os.path.join(self.out, os.path.basename(name))))

    def linked(self, fragment, own=None, words=None):
        """References to man pages, and words that are defined on a page, become links, but not in headings and links."""
        inside, parts = 0, re.split(r'(<[^>]*>)', fragment)
        for k, part in enumerate(parts):
            if part.startswith('<'):
                m = re.match(r'<(/?)(a|h1|h2)\b', part)
                inside += (-1 if m[1] else 1) if m else 0
            elif not inside:
                part = re.sub(r'\b(ct-[a-z]+|ctsr)\((\d)\)', lambda m: '<a class="Xr" href="%s.html">%s</a>' % (self.manual[m[0]], m[0])
                              if m[0] in self.manual and self.manual[m[0]] != own else m[0], part)
                part = re.sub(r'\bdoc/[a-z-]+\.md\b', lambda m: '<a href="%s.html">%s</a>' % (self.of[m[0]], m[0]) if m[0] in self.of else m[0], part)
                if words:
                    part = re.sub(r'\b[A-Za-z_]\w+\b', lambda m: '<a href="#%s">%s</a>' % (m[0], m[0]) if m[0] in words else m[0], part)
                parts[k] = part
        return ''.join(parts)

    def markdown(self, name, page):
        body, taken = run('cmark-gfm', '-e', 'table', '-e', 'autolink', text=self.text(name)), {}
        body = re.sub(r'<(h[1-6])>(.*?)</\1>', lambda m: '<%s id="%s">%s</%s>' % (m[1], slug(plain(m[2]), taken), m[2], m[1]), body)
        body = re.sub(r'(href|src)="([^"]*)"', lambda m: '%s="%s"' % (m[1], self.target(name, os.path.dirname(name), m[2])), body)
        body = re.sub(r'\.md</a>', '</a>', body)
        return self.linked(re.sub(r'<p>(<img[^>]*>)</p>', r'<p class="picture">\1</p>', body))

    def manuals(self):
        """(name, section, file) of all man pages."""
        for folder in os.path.join(self.build, 'man'), self.path('man'):
            for f in sorted(os.listdir(folder)):
                m = re.fullmatch(r'(ct[a-z-]*)\.([1357])', f)
                if m:
                    yield m[1], m[2], os.path.join(folder, f)

    def man(self, name, section, path):
        own = '%s.%s' % (name, section)
        body = run('mandoc', '-Thtml', '-Ofragment,man=%N.%S.html', path)
        body = re.sub(r'(?s)<table class="(head|foot)">.*?</table>', '', body)
        body = re.sub(r'<(/?)h2\b', r'<\1h3', body)
        body = re.sub(r'<(/?)h1\b', r'<\1h2', body)
        body = re.sub(r'(?s)<a class="permalink"[^>]*>(.*?)</a>', r'\1', body)
        body = re.sub(r'(?s)<a class="Xr" href="([^"]*)">(.*?)</a>', lambda m: m[2], body)  # linked() makes those that are here
        return '<h1>%s(%s)</h1>\n%s' % (name, section, self.linked(body, own))

    def prose(self, text, words=None, taken=None):
        """A comment: paragraphs, and as they stand columns and what is indented; with `taken` also headings, in capitals."""
        done, headings = '', taken is not None
        for block in re.split(r'\n\s*\n', text.strip('\n')):
            if headings and block.isupper():
                done += '<h2 id="%s">%s</h2>\n' % (slug(block, taken), block.capitalize())
            elif re.search(r'(?m)^    |^\S.*[^ .]  +\S', block):
                done += '<pre>%s</pre>\n' % html.escape(textwrap.dedent(block))
            elif block.strip():
                done += '<p>%s</p>\n' % html.escape(block.strip())
        return self.linked(done, words=words)

    def header(self, name):
        """A C header: its sections, and in them the declarations, each with the comment before it."""
        code = re.sub(r'(?m)^(#(?!define CTSR_VERSION).*|extern "C" \{|\})\n', '', self.text(name))
        parts = re.split(r'(?ms)^(/\*.*?\*/)\n', code)
        comments = [re.sub(r'(?m)^ \* ?', '', c[2:-2]).strip().replace('SPDX-License-Identifier: Apache-2.0\n', '') for c in parts[1::2]]
        names = [re.findall(r'\b(ctsr_\w+)\(|(?:struct|enum) (ctsr_\w+) \{|typedef struct \w+ (ctsr_\w+);', c) for c in parts[2::2]]
        names = [list(dict.fromkeys(''.join(n) for n in group)) for group in names]
        words, taken = {n for group in names for n in group}, {}
        body = '<h1>ctsr.h</h1>\n' + self.prose(comments[0], words, taken)
        for comment, code, own in list(zip(comments, parts[2::2], names))[1:]:
            m = re.match('-+ (.*)', comment)
            if m:
                body += '<h2 id="%s">%s</h2>\n' % (slug(m[1], taken), m[1].capitalize())
            body += ''.join('<span id="%s"></span>' % n for n in own)
            body += ''.join('<pre>%s</pre>\n' % self.linked(html.escape(c), words=words - set(own)) for c in [code.strip('\n')] if c)
            body += '' if m else self.prose(comment, words - set(own))
        return body

    def python(self, folder):
        body = '<h1>The Python package</h1>\n'
        for module in MODULES:
            tree = ast.parse(self.text('%s/%s.py' % (folder, module)))
            title = 'ctsr' if module == '__init__' else 'ctsr.' + module
            public = next((ast.literal_eval(n.value) for n in tree.body if isinstance(n, ast.Assign) and n.targets[0].id == '__all__'), None) \
                if module == '__init__' else None
            body += '<h2 id="%s">%s</h2>\n%s' % (title, title, self.prose(ast.get_docstring(tree) or ''))
            for n in tree.body:
                if isinstance(n, (ast.FunctionDef, ast.ClassDef)) and (n.name in public if public else not n.name.startswith('_')):
                    body += self.definition(n, title)
        return body

    def definition(self, n, within):
        name = '%s.%s' % (within, n.name)
        if isinstance(n, ast.FunctionDef):
            says = '%s(%s)%s' % (name, ast.unparse(n.args), ' -> ' + ast.unparse(n.returns) if n.returns else '')
            says = says if len(says) < 100 else textwrap.fill(says, 100, subsequent_indent='    ', break_long_words=False)
            return '<h3 id="%s">%s</h3>\n<pre>%s</pre>\n%s' % (name, n.name, html.escape(says), self.prose(ast.get_docstring(n) or ''))
        inner = [d for d in n.body if isinstance(d, ast.FunctionDef) and not d.name.startswith('_') and ast.get_docstring(d)]
        fields = ['%s: %s' % (d.target.id, ast.unparse(d.annotation)) for d in n.body if isinstance(d, ast.AnnAssign)]
        return '<h3 id="%s">%s</h3>\n<pre>%s</pre>\n%s%s' % (
            name, n.name, html.escape('\n    '.join(['class ' + name] + fields)), self.prose(ast.get_docstring(n) or ''),
            ''.join(self.definition(d, name) for d in inner))

    def news(self, name):
        body, taken = '', {}
        for block in re.split(r'\n\s*\n', self.text(name).strip()):
            m = re.match(r'(\*+) (.*)', block)
            if m:
                body += '<h%d id="%s">%s</h%d>\n' % (len(m[1]) + 1, slug(m[2], taken), html.escape(m[2]), len(m[1]) + 1)
            else:
                body += ('<p>%s</p>\n' if body else '<h1>%s</h1>\n') % html.escape(block)
        return self.linked(body)

    def write(self, page):
        group, title, body = self.pages[page]
        body = re.sub(r'(?s)<table(?! class="Nm")[^>]*>.*?</table>', lambda m: '<div class="wide" tabindex="0">%s</div>' % m[0], body)
        body = re.sub(r'<pre', '<pre tabindex="0"', body)
        parts = re.findall(r'(?s)<h2[^>]* id="([^"]*)"[^>]*>(.*?)</h2>', body)
        nav = ''
        for name, pages in self.groups:
            mine = name == group
            nav += '<li><a%s href="%s.html">%s</a>' % (' class="mine"' if mine else '', pages[0][1], name)
            if mine:
                nav += '<ul>'
                for _, p, t in pages:
                    nav += '<li><a%s href="%s.html">%s</a>' % (' aria-current="page"' if p == page else '', p, html.escape(t))
                    if p == page and len(parts) > 1:
                        nav += '<ul>' + ''.join('<li><a href="#%s">%s</a></li>' % (a, html.escape(plain(t))) for a, t in parts) + '</ul>'
                    nav += '</li>'
                nav += '</ul>'
            nav += '</li>\n'
        with open(os.path.join(self.out, page + '.html'), 'w', encoding='utf-8') as f:
            f.write('<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
                    '<meta name="viewport" content="width=device-width, initial-scale=1">\n<meta name="color-scheme" content="light dark">\n'
                    '<title>%s - ctsr</title>\n<link rel="stylesheet" href="site.css">\n</head>\n<body>\n'
                    '<p class="top"><a href="index.html">ctsr</a> <a href="#nav">Contents</a></p>\n<main>\n%s</main>\n'
                    '<nav id="nav" aria-label="Contents"><p><a href="index.html">ctsr</a></p>\n<ul>\n%s</ul></nav>\n</body>\n</html>\n' % (html.escape(title), body, nav))

    def make(self):
        shutil.rmtree(self.out, ignore_errors=True)
        os.makedirs(self.out)
        shutil.copyfile(self.path('doc/site.css'), os.path.join(self.out, 'site.css'))
        manuals = list(self.manuals())
        self.manual = {'%s(%s)' % (n, s): '%s.%s' % (n, s) for n, s, _ in manuals}
        self.of = {f: p for _, pages in DOCUMENTS for f, p, _ in pages}
        listed = [('', 'man', 'All pages')] + [('', '%s.%s' % (n, s), '%s(%s)' % (n, s)) for n, s, _ in manuals]
        self.groups = [(g, listed if g == 'Manual' else pages) for g, pages in DOCUMENTS]
        for group, pages in DOCUMENTS:
            for f, page, title in pages:
                body = self.header(f) if f.endswith('.h') else self.python(f) if f == 'python/ctsr' else \
                    self.news(f) if f == 'NEWS' else self.markdown(f, page)
                self.pages[page] = group, title, body
        index = '<h1>Manual</h1>\n'
        for section, title in SECTIONS.items():
            index += '<h2 id="section-%s">%s</h2>\n<dl class="names">\n' % (section, title)
            for n, s, path in manuals:
                if s == section:
                    body = self.man(n, s, path)
                    what = re.search(r'(?s)<span class="Nd">(.*?)</span>', body)
                    index += '<dt><a href="%s.%s.html">%s(%s)</a></dt><dd>%s</dd>\n' % (n, s, n, s, what[1])
                    self.pages['%s.%s' % (n, s)] = 'Manual', '%s(%s)' % (n, s), body
            index += '</dl>\n'
        self.pages['man'] = 'Manual', 'Manual', index
        for page in self.pages:
            self.write(page)
        return len(self.pages)


if __name__ == '__main__':
    missing = [c for c in ('cmark-gfm', 'mandoc') if not shutil.which(c)]
    if missing:
        sys.exit('site.py: not found: %s; install them first (Debian: apt-get install cmark-gfm mandoc)' % ', '.join(missing))
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    print('%s: %d pages' % (sys.argv[3], Site(*sys.argv[1:]).make()))
