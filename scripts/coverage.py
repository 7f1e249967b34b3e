#!/usr/bin/env python3
"""Which lines of src/ and formats/ the tests run: builds with gcov in a folder of its own, runs the
tests, prints the files of least coverage and the total. A line that is compiled several times
(kernels, once for each level of the processor) counts once.

    scripts/coverage.py [--build DIR] [--tests "t-x t-y.sh"] [--lines] [--no-run]
"""
import argparse, collections, json, os, re, shutil, subprocess, sys

TOP = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def build(b, tests):
    os.makedirs(b, exist_ok=True)
    if not os.path.exists(b + '/Makefile'):
        cc = 'CC=ccache gcc' if shutil.which('ccache') else 'CC=gcc'
        flags = '-O1 --coverage -fprofile-update=prefer-atomic'
        subprocess.check_call([TOP + '/configure', cc, 'CFLAGS=' + flags, 'CXXFLAGS=' + flags], cwd=b,
                              stdout=subprocess.DEVNULL)
    jobs = '-j%d' % os.cpu_count()
    subprocess.check_call(['make', '-s', jobs], cwd=b, stdout=subprocess.DEVNULL)
    for folder, _, names in os.walk(b):
        for name in names:
            if name.endswith('.gcda'):
                os.unlink(os.path.join(folder, name))
    check = ['make', '-k', jobs, 'check']
    if tests:
        check.append('TESTS=' + ' '.join('tests/' + t for t in tests.split()))
    out = subprocess.run(check, cwd=b, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    print('\n'.join(re.findall(r'^(?:FAIL|ERROR): .*|^# (?:TOTAL|PASS|FAIL):.*', out.stdout, re.M)))


def counts(b):
    """file -> line -> how often."""
    lines = collections.defaultdict(lambda: collections.defaultdict(int))
    found = [os.path.join(folder, name) for folder, _, names in os.walk(b) for name in names
             if name.endswith('.gcno') and not re.search(r'/(tests|bench)$', folder)]
    for i in range(0, len(found), 50):
        text = subprocess.run(['gcov', '--json-format', '--stdout'] + found[i:i + 50], cwd=b, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout
        for part in text.split('\n'):
            for f in json.loads(part)['files'] if part else []:
                name = os.path.relpath(os.path.join(b, f['file']), TOP)
                if not name.startswith(('src/', 'formats/')):
                    continue
                for line in f['lines']:
                    lines[name][line['line_number']] += line['count']
    return lines


def main():
    p = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    p.add_argument('--build', default=os.path.join(TOP, 'build-coverage'))
    p.add_argument('--tests', default='', help='only these')
    p.add_argument('--lines', action='store_true', help='print the lines that were not run')
    p.add_argument('--no-run', action='store_true', help='of the last run')
    o = p.parse_args()
    if not o.no_run:
        build(os.path.abspath(o.build), o.tests)
    rows, run, all_lines = [], 0, 0
    for name, lines in counts(os.path.abspath(o.build)).items():
        done = sum(n > 0 for n in lines.values())
        missed = sorted(k for k, n in lines.items() if not n)
        rows.append((100 * done / max(1, len(lines)), name, missed))
        run, all_lines = run + done, all_lines + len(lines)
    for part, name, missed in sorted(rows):
        if part < 90 or o.lines and missed:
            print('%5.1f%% %s%s' % (part, name, ': %s' % missed if o.lines else ''))
    print('%.1f%% of %d lines of src and formats' % (100 * run / max(1, all_lines), all_lines))


if __name__ == '__main__':
    sys.exit(main())
