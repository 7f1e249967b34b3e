#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Which lines of src/ and formats/ the tests run: builds with gcov in a folder of its own, runs each
test, prints the files of least coverage and the total, and keeps which test runs which line for
mutate.py. A line that is compiled several times (kernels, once for each level of the processor)
counts once.

    scripts/coverage.py [--build DIR] [--tests "t-x t-y.sh"] [--lines] [--no-run]
"""
import argparse, concurrent.futures, hashlib, json, os, re, shutil, subprocess, sys
from suite import Suite, TOP

FLAGS = '-O1 --coverage -fprofile-update=single'  # that a counter is not 0 is sure with threads, too


def lines_of(b, found):
    """file -> line -> was it run, of counters or, where nothing was run, notes."""
    lines = {}
    for i in range(0, len(found), 50):
        text = subprocess.run(['gcov', '--json-format', '--stdout'] + found[i:i + 50], cwd=b, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout
        for part in text.split('\n'):
            for f in json.loads(part)['files'] if part else []:
                name = os.path.relpath(os.path.join(b, f['file']), TOP)
                if name.startswith(('src/', 'formats/')):
                    of = lines.setdefault(name, {})
                    for line in f['lines']:
                        n = line['line_number']
                        of[n] = of.get(n, False) or line['count'] > 0
    return lines


def notes(b):
    return [os.path.join(where, name) for where, _, names in os.walk(b) for name in names
            if name.endswith('.gcno') and 'conftest' not in name and
            not re.search(r'/(tests|bench|by)(/|$)', where[len(b):])]


def beside(b, folder, all_of_them):
    """Notes of b linked into a folder, beside the counters there or all of them; what gcov reads."""
    found = []
    for path in notes(b):
        link = os.path.join(folder, os.path.relpath(path, '/'))
        counters = link[:-5] + '.gcda'
        if all_of_them or os.path.exists(counters):
            os.makedirs(os.path.dirname(link), exist_ok=True)
            os.symlink(path, link)
            found.append(link if all_of_them else counters)
    return found


def measure(suite, name, known):
    """Runs a test; what it ran goes into known."""
    folder = os.path.join(suite.b, 'by', name)
    shutil.rmtree(folder, ignore_errors=True)
    status, seconds = suite.test(name, 900, GCOV_PREFIX=folder)
    ran = lines_of(suite.b, beside(suite.b, folder, False))
    shutil.rmtree(folder, ignore_errors=True)
    known[name] = {'seconds': round(seconds, 2),
                   'lines': {f: [k for k, yes in of.items() if yes] for f, of in ran.items()}}
    if status not in (0, 77):
        print('%s: %s' % (name, status if isinstance(status, str) else 'fails'), flush=True)


def every(b):
    """file -> its lines with code."""
    folder = os.path.join(b, 'by', 'none')
    shutil.rmtree(folder, ignore_errors=True)
    lines = lines_of(b, beside(b, folder, True))
    shutil.rmtree(folder, ignore_errors=True)
    return {f: set(of) for f, of in lines.items()}


def digest(name):
    return hashlib.sha256(open(os.path.join(TOP, name), 'rb').read()).hexdigest()


def main():
    p = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    p.add_argument('--build', default=os.path.join(TOP, 'build-coverage'))
    p.add_argument('--tests', default='', help='run only these, and keep what is known of the others')
    p.add_argument('--lines', action='store_true', help='print the lines that were not run')
    p.add_argument('--no-run', action='store_true', help='of the last run')
    o = p.parse_args()
    b, jobs = os.path.abspath(o.build), os.cpu_count()
    kept = os.path.join(b, 'lines.json')
    known = json.load(open(kept))['tests'] if (o.tests or o.no_run) and os.path.exists(kept) else {}
    if not o.no_run:
        suite = Suite(TOP, b, FLAGS, jobs)
        names = o.tests.split() or suite.names()
        suite.make(names)
        with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
            list(pool.map(lambda name: measure(suite, name, known), names))
    lines = every(b)
    if not o.no_run:
        files = {f: {'digest': digest(f), 'code': sorted(code)} for f, code in lines.items()}
        open(kept, 'w').write(json.dumps({'files': files, 'tests': known}))
    rows, run, count = [], 0, 0
    for name, code in lines.items():
        done = set().union(*(t['lines'].get(name, ()) for t in known.values())) & code
        rows.append((100 * len(done) / max(1, len(code)), name, sorted(code - done)))
        run, count = run + len(done), count + len(code)
    for part, name, missed in sorted(rows):
        if part < 90 or o.lines and missed:
            print('%5.1f%% %s%s' % (part, name, ': %s' % missed if o.lines else ''))
    print('%.1f%% of %d lines of src and formats' % (100 * run / max(1, count), count))


if __name__ == '__main__':
    sys.exit(main())
