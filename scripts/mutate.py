#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Do the tests notice? Changes one line of src/ or formats/ at a time, builds, and runs the tests that
run this line, first those that run most of its file in the least time, until one fails. Prints the score,
and what survived.

    scripts/mutate.py [--seed N] [--count N] [--files GLOB] [--at FILE:LINE[:WORD] ... [--each N]]
                      [--also "t-x t-y.sh"] [--budget SECONDS] [--minutes M] [--jobs N]
                      [--build DIR] [--coverage DIR] [--dry-run]

Which test runs which line is known from make coverage (build-coverage/lines.json), which is to be of
these sources. Works on a copy in DIR (build-mutate), which later runs find built. Drawn again, and told
at the end, is a mutant that does not compile, or of which the compiler makes the same bytes in every
object of the library and the commands: no test can notice (it is not compiled on this machine, too).
Not drawn are the size of an array and a number that adds to the room of an allocation, the range in the
row of an option that is no number (cli/table.c asks numbers only), and which other number stands for an
error. A test has noticed that fails with the change and passes without it (one that waits is to fail
twice, and one that took two or three attempts to pass as often and once more), takes five times the CPU it
should, or hangs; one that came to no end for want of CPU leaves the mutant unknown, which is not counted. An
index beyond an array of known size counts as noticed (the copy is built with -fsanitize=bounds). A line that
no test runs is left to those that run the nearest one above it. --at takes the mutants of these lines
instead of random ones, or just that which is WORD, or those that hold it; --also runs these tests first.
A survivor that doc/mutation.md lists is known to change nothing that is computed, and told apart.
A broken program may do anything, such as to empty /tmp: run it where nothing of value lies.
"""
import argparse, fnmatch, hashlib, json, os, random, re, shutil, subprocess, sys, time
from suite import Suite, TOP

GROUP = 4  # tests built at a time
TOOLS, LINK = 4, .5  # seconds to link all tools, for a test in shell; or one
FLAGS = '-O2 -fsanitize=bounds -fsanitize-undefined-trap-on-error'  # a loop past an array is noticed
# What is changed into what, outside strings and comments.
SWAPS = [(r'(?<=\s)\+(?=\s)', '-'), (r'(?<=[\w)\]]\s)-(?=\s)', '+'), (r'(?<=\s)\*(?=\s)', '/'),
         (r'(?<=\s)/(?=\s)', '*'), (r'(?<=\s)<(?=\s)', '<='), (r'(?<=\s)<=(?=\s)', '<'),
         (r'(?<=\s)>(?=\s)', '>='), (r'(?<=\s)>=(?=\s)', '>'), (r'==', '!='), (r'!=', '=='),
         (r'&&', '||'), (r'\|\|', '&&'), (r'(?<=\s)\+=', '-='), (r'(?<=\s)-=', '+='),
         (r'(?<=\s)\*=', '/='), (r'(?<=[=(,?:]\s)-(?=[\w(])', ''), (r'(?<=[(\[])-(?=[\w(])', ''),
         (r'\bfmin\b', 'fmax'), (r'\bfmax\b', 'fmin'), (r'\btrue\b', 'false'),
         (r'\bfalse\b', 'true'), (r'\bsin\b', 'cos'), (r'\bcos\b', 'sin')]
NUMBER = re.compile(r'(?<![\w.\]])(\d+\.\d*(?:e-?\d+)?|\d+)(?=f?\b)(?![\w.]*x)')
DELETE = re.compile(r'^\s*[\w>\[\].()*-]+(\s*[-+*/|&]?=\s.*|\+\+|--|\(.*\));$')
DECLARATION = re.compile(r'^\s*(const |static |volatile |struct \w+ |enum \w+ |unsigned |\w+ )+[^=(]*;$')
ROOM = re.compile(r'\b(?:ct_alloc0?|malloc|calloc|realloc)\(')
WAITS = re.compile(r'\b(sleep|kill|usleep|nanosleep|alarm|seconds)\b')  # a test that a busy machine may fail
CONDITION = re.compile(r'\b(if|while) \((.*)\)(\s*\{)?$')


def other_number(text):
    if re.fullmatch(r'\d+', text):
        return str(int(text) + 1)
    return repr(float(text) * 1.5) if float(text) else '0.5'


def masked(line):
    """The line with its strings and comments blanked, of the same length."""
    blank = lambda m: m.group(0)[0] + ' ' * (len(m.group(0)) - 2) + m.group(0)[-1]
    line = re.sub(r'"(?:\\.|[^"\\])*"|\'(?:\\.|[^\'\\])+\'', blank, line)
    return re.sub(r'/\*.*?\*/', lambda m: ' ' * len(m.group(0)), line)


def roomy(code):
    """The code, with the numbers that add to an allocation blanked."""
    for at in ROOM.finditer(code):
        end, depth = at.end(), 1
        while end < len(code) and depth:
            depth += {'(': 1, ')': -1}.get(code[end], 0)
            end += 1
        inside = re.sub(r'(?:(?<=[+*,] )|^)\d+\b(?![.\w])', lambda m: '#' * len(m.group(0)), code[at.end():end])
        code = code[:at.end()] + inside + code[end:]
    return code


def mutants(line):
    """All changed versions of a line of code."""
    code, found = roomy(masked(line)), []
    if DECLARATION.match(code) and not re.match(r'\s*(return|goto|else)\b', code):
        return []
    code = re.sub(r'(= \{+)0|((?:\breturn|\brc =|[?:]) -)1\b', r'\1\2#', code)  # any other does as well
    code = re.sub(r'\[(static )?\d+\](?= = \{|,|\)|;)', lambda m: '#' * len(m.group(0)), code)  # room
    code = re.sub(r'(\bCT_EXPERT\(.*), 0, 0,', r'\1, #, #,', code)  # a word or a flag has no range
    for pattern, to in SWAPS:
        for m in re.finditer(pattern, code):
            found.append(line[:m.start()] + to + line[m.end():])
    for m in NUMBER.finditer(code):
        found.append(line[:m.start()] + other_number(m.group(1)) + line[m.end():])
    m = CONDITION.search(code)
    if m:
        found.append('%s!(%s)%s' % (line[:m.start(2)], line[m.start(2):m.end(2)], line[m.end(2):]))
    if DELETE.match(code) and not re.match(r'\s*(return|goto|\w*(free|close|destroy|munmap|decref))\b', code):
        found.append(re.match(r'\s*', line).group(0) + ';')
    return found


def code_lines(path):
    """Numbers and text of the lines within functions and tables: no comment, no directive."""
    comment = False
    for number, line in enumerate(open(path), 1):
        line = line.rstrip('\n')
        inside, text = comment, masked(line)
        comment = '*/' not in text if comment else '/*' in text
        if inside or '/*' in text or not line.startswith('\t') or text.rstrip().endswith('\\'):
            continue
        yield number, line


class Place:
    """A copy of the sources, its build, and what is known of the tests."""

    def __init__(self, build, coverage, jobs, budget):
        known = json.load(open(os.path.join(coverage, 'lines.json')))
        self.files, self.tests = known['files'], known['tests']
        self.src, self.budget = os.path.join(build, 'src'), budget
        self.copy()
        self.kept, self.attempts = os.path.join(build, 'attempts.json'), {}
        if os.path.exists(self.kept):
            self.attempts = {k: n for k, (of, n) in json.load(open(self.kept)).items() if of == self.digest(k)}
        self.suite = Suite(self.src, os.path.join(build, 'b'), FLAGS, jobs)
        self.there = set(self.suite.names())
        self.parts, self.plain = self.objects(), {}

    def copy(self):
        names = subprocess.check_output(['git', 'ls-files', '-z'], cwd=TOP).decode().split('\0')
        for name in filter(None, names):
            to = os.path.join(self.src, name)
            if not os.path.isfile(os.path.join(TOP, name)):
                continue
            data = open(os.path.join(TOP, name), 'rb').read()
            if name in self.files and hashlib.sha256(data).hexdigest() != self.files[name]['digest']:
                sys.exit('%s is not as make coverage found it' % name)
            if os.path.exists(to) and open(to, 'rb').read() == data:
                continue
            os.makedirs(os.path.dirname(to), exist_ok=True)
            shutil.copy2(os.path.join(TOP, name), to)
            os.utime(to)

    def objects(self):
        """file -> objects of the library and the commands that are made of it; and back, their sources."""
        found, b, self.sources = {}, self.suite.b, {}
        for where, _, names in os.walk(b):
            if not re.match(r'/(src|formats)/.*\.deps$', where[len(b):]):
                continue
            for name in names:
                rule = open(os.path.join(where, name)).read().split('\n\n')[0].replace('\\\n', ' ')
                target, _, needs = rule.partition(':')
                needs = [os.path.relpath(os.path.join(b, n), self.src) for n in needs.split()]
                self.sources[target] = (needs + [''])[0]
                for n in needs:
                    found.setdefault(n, set()).add(target)
        return found

    def compiled(self, path):
        """What the compiler makes of a file, as a digest; None if it does not compile."""
        objects = sorted(self.parts.get(path, ()))
        if objects and not self.suite.build(objects):
            return None
        every = [open(os.path.join(self.suite.b, o), 'rb').read() for o in objects]
        return hashlib.sha256(b''.join(hashlib.sha256(o).digest() for o in every)).hexdigest()

    def runners(self, path, number):
        """The tests that run this line; if none does, or it is no code, the nearest one above it in
        its function; of a table, whose lines are no code, those that run anything of the file; of a header
        without code, of the files that include it."""
        rows = open(os.path.join(self.src, path)).read().split('\n')
        while number > 0 and not rows[number - 1].startswith(('}', '{')):
            found = [n for n, t in self.tests.items() if number in t['lines'].get(path, ())]
            if found:
                return found
            number -= 1
        found = [n for n, t in self.tests.items() if t['lines'].get(path)]
        made = {self.sources[o] for o in self.parts.get(path, ())}
        return found or [n for n, t in self.tests.items() if made & t['lines'].keys()]

    def tests_of(self, path, number, also):
        """Those that run this line, first those that run most of its file in the least time."""
        cost = {n: self.tests[n]['seconds'] + (TOOLS if n.endswith('.sh') else LINK)
                for n in self.runners(path, number) if n in self.there and n not in also}
        tests = sorted(cost, key=lambda n: cost[n] / (1 + len(self.tests[n]['lines'].get(path, ()))))
        while self.budget and len(tests) > 1 and sum(cost[t] for t in tests) > self.budget:
            tests.pop()
        return also + tests

    def text(self, name):
        """That of a test."""
        whole = os.path.join(self.src, 'tests', name)
        found = [p for p in (whole, whole + '.c', whole + '.cc') if os.path.exists(p)]
        return open(found[0]).read() if found else ''

    def digest(self, name):
        """Of the sources and a test."""
        every = ''.join(f['digest'] for f in self.files.values()) + self.text(name)
        return hashlib.sha256(every.encode()).hexdigest()

    def fails(self, name):
        """Does it? It is 'unknown' if that was not told in time."""
        status, _ = self.suite.test(name, 5 + 5 * self.tests.get(name, {'seconds': 30})['seconds'])
        return status if status == 'unknown' else status not in (0, 77)

    def ask(self, name):
        """How many attempts does the test take to pass without a change? 0 if three are too few."""
        self.suite.make([name])
        self.attempts[name] = next((i for i in range(1, 4) if self.fails(name) is False), 0)
        if not self.attempts[name]:
            print('# %s fails without a change: not counted' % name, flush=True)
        json.dump({k: (self.digest(k), n) for k, n in self.attempts.items()}, open(self.kept, 'w'))

    def notices(self, name):
        """Does it fail as often as tells something? 'unknown' if that is not known."""
        for _ in range(1 + max(self.attempts.get(name, 1) - 1, WAITS.search(self.text(name)) is not None)):
            fails = self.fails(name)
            if fails is not True:
                return fails
        return True

    def first_to_notice(self, tests):
        """(does it compile, the first test to notice or, if one is, 'unknown') with what is changed."""
        unknown = None
        for i in range(0, len(tests), GROUP):
            group = [t for t in tests[i:i + GROUP] if self.attempts.get(t, 1)]
            if not self.suite.make(group):
                return False, None
            for t in group:
                notices = self.notices(t)
                if notices is True:
                    return True, t
                unknown = notices or unknown
        return True, unknown

    def try_line(self, path, number, line, also):
        """(does it compile into something else, the test that notices)."""
        whole, tests = os.path.join(self.src, path), self.tests_of(path, number, also)
        if path not in self.plain:
            self.plain[path] = self.compiled(path)
        was = open(whole).read()
        rows = was.split('\n')
        rows[number - 1] = line
        while True:
            try:
                open(whole, 'w').write('\n'.join(rows))
                changes = self.compiled(path) not in (None, self.plain[path])
                changes, by = self.first_to_notice(tests) if changes else (False, None)
            finally:
                open(whole, 'w').write(was)
            if by in (None, 'unknown') or by in self.attempts:
                return changes, by
            self.ask(by)
            if self.attempts[by] == 1:
                return changes, by
            tests = tests[tests.index(by):]


def equivalents():
    """(path, line, changed line) -> why it changes nothing, of the list in doc/mutation.md."""
    text = open(os.path.join(TOP, 'doc/mutation.md')).read()
    return {m[:3]: ' '.join(m[3].split()) for m in
            re.findall(r'^- `(.+?)`:\s+`(.+?)`\s+->\s+`(.+?)`:\s+((?:.+\n)+?)(?=- |\n|\Z)', text, re.M)}


def candidates(o):
    names = subprocess.check_output(['git', 'ls-files', 'src', 'formats'], cwd=TOP).decode().split()
    for path in names:
        if re.search(r'\.(c|h|cc)$', path) and fnmatch.fnmatch(path, o.files):
            for number, line in code_lines(os.path.join(TOP, path)):
                found = mutants(line)
                if found:
                    yield path, number, line, found


def chosen(o):
    """What to try, in order: (path, number, line, changed line)."""
    for at in o.at:
        path, number, word = (at.split(':', 2) + [''])[:3]
        line = open(os.path.join(TOP, path)).read().split('\n')[int(number) - 1]
        all_of_it = mutants(line)
        fit = [m for m in all_of_it if m.strip() == word] or [m for m in all_of_it if word in m]
        random.Random(o.seed).shuffle(fit)
        for m in fit[:o.each or None]:
            yield path, int(number), line, m
    if o.at:
        return
    places = list(candidates(o))
    rng = random.Random(o.seed)
    while places:
        path, number, line, found = places.pop(rng.randrange(len(places)))
        yield path, number, line, rng.choice(found)


def main():
    p = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    p.add_argument('--seed', type=int, default=1)
    p.add_argument('--count', type=int, default=300)
    p.add_argument('--minutes', type=float, default=0, help='begin no mutant after these')
    p.add_argument('--files', default='*', help='only files that match')
    p.add_argument('--at', nargs='*', default=[], metavar='FILE:LINE[:WORD]')
    p.add_argument('--each', type=int, default=0, help='at most so many of each --at')
    p.add_argument('--budget', type=float, default=0,
                   help='leave out the last tests of a line beyond so many seconds (of make coverage)')
    p.add_argument('--also', default='', help='tests to run first')
    p.add_argument('--jobs', type=int, default=os.cpu_count())
    p.add_argument('--build', default=os.path.join(TOP, 'build-mutate'))
    p.add_argument('--coverage', default=os.path.join(TOP, 'build-coverage'))
    p.add_argument('--dry-run', action='store_true', help='print the mutants')
    o = p.parse_args()
    died, alive, equal, unknown, again, began = 0, [], [], [], 0, time.time()
    place = None if o.dry_run else Place(os.path.abspath(o.build), os.path.abspath(o.coverage), o.jobs,
                                         o.budget)
    known = equivalents()
    for path, number, line, changed in chosen(o):
        if not o.at and died + len(alive) + len(equal) >= o.count or \
                o.minutes and time.time() - began > 60 * o.minutes:
            break
        text = '%s:%d: %s\n    -> %s' % (path, number, line.strip(), changed.strip())
        if o.dry_run:
            died += 1
            print(text)
            continue
        changes, by = place.try_line(path, number, changed, o.also.split())
        if not changes:
            again += 1
            continue
        why = known.get((path, line.strip(), changed.strip()))
        died += by not in (None, 'unknown')
        if by == 'unknown':
            unknown.append(text)
        elif by is None:
            (equal if why else alive).append('%s%s' % (text, why and '\n    ' + why or ''))
        print('%s %s:%d: %s   %s' % ('unknown' if by == 'unknown' else 'died' if by else 'same' if why else
                                     'LIVES', path, number, changed.strip(), 'by ' + by if by else ''),
              flush=True)
    total = died + len(alive) + len(equal)
    if total and not o.dry_run:
        print('%d of %d mutants died: %.0f%% (seed %d); %d changed nothing: %.0f%% of the others; %d unknown; '
              '%d drawn again' % (died, total, 100 * died / total, o.seed, len(equal),
                                  100 * died / max(1, total - len(equal)), len(unknown), again))
        for what, which in ('survivors', alive), ('survivors that change nothing', equal), ('unknown', unknown):
            print('\n'.join([what + ':'] + which) if which else 'no ' + what)
    return 0


if __name__ == '__main__':
    sys.exit(main())
