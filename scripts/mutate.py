#!/usr/bin/env python3
"""Do the tests notice? Changes one line of src/ or formats/ at a time, builds, and runs the tests of
its room until one fails. Prints the score, and what survived.

    scripts/mutate.py [--seed N] [--count N] [--limit SECONDS] [--files GLOB] [--at FILE:LINE ... [--each N]]
                      [--minutes M] [--jobs N] [--build DIR] [--dry-run]

Works on a copy in DIR (build-mutate), which later runs find built. A mutant that does not compile is
drawn again; one that runs longer than the limit is noticed. --at takes the mutants of these lines
instead of random ones, or just one of them with FILE:LINE:WORD, one whose changed line holds WORD.
"""
import argparse, fnmatch, os, random, re, shutil, signal, subprocess, sys, time

TOP = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
# Tests that should notice a change, the quickest first; the first row that fits a file counts.
MAP = [
    ('src/core/rng*', 't-core t-training t-superres t-gsfit'),
    ('src/core/par*', 't-core t-solve'),
    ('src/core/vec*', 't-vec-v3 t-vec-v4 t-vec-v2 t-splat t-voxelise t-project'),
    ('src/core/gauss*', 't-ply t-splat t-gsfit'),
    ('src/core/tensors*', 't-safetensors t-unet'),
    ('src/core/stack*', 't-exr t-superres t-info.sh t-ct-project.sh'),
    ('src/core/meta*', 't-core t-nifti t-exr t-safetensors'),
    ('src/core/*', 't-core t-nifti t-resample t-consistency t-solve t-project t-superres'),
    ('src/solve/*', 't-solve t-tv t-joint t-fdk t-consistency'),
    ('src/xray/photons*', 't-photons t-ct-project.sh'),
    ('src/xray/phantom*', 't-project t-fdk t-ct-project.sh t-ct-fdk.sh'),
    ('src/xray/joseph*', 't-joseph t-columns'),
    ('src/xray/window*', 't-joseph'),
    ('src/xray/columns*', 't-columns t-project t-joint'),
    ('src/xray/*', 't-project t-columns t-fdk t-ct-project.sh'),
    ('src/recon/fdk*', 't-weights t-fdk t-ct-fdk.sh'),
    ('src/recon/backproject*', 't-weights t-fdk'),
    ('src/recon/joint*', 't-joint t-ct-fuse.sh'),
    ('src/recon/fuse*', 't-joint t-ct-fuse.sh'),
    ('src/recon/rof*', 't-rof t-ct-fdk.sh'),
    ('src/recon/*', 't-fdk t-ct-fdk.sh t-joint'),
    ('src/resolution/blur*', 't-blur t-ct-degrade.sh'),
    ('src/resolution/degrade*', 't-degrade t-consistency t-ct-degrade.sh'),
    ('src/resolution/consistency*', 't-consistency t-certificate t-ct-upsample.sh'),
    ('src/resolution/cosine*', 't-cosine t-consistency t-degrade t-blur t-ct-upsample.sh'),
    ('src/resolution/separable*', 't-degrade t-resample t-consistency'),
    ('src/resolution/svd*', 't-matched t-consistency t-degrade'),
    ('src/resolution/hessian*', 't-tv t-ct-upsample.sh'),
    ('src/resolution/tv*', 't-tv t-ct-upsample.sh'),
    ('src/resolution/re*', 't-resample t-convert.sh t-ct-metrics.sh'),
    ('src/resolution/crop*', 't-resample t-metrics t-ct-metrics.sh'),
    ('src/resolution/*', 't-resample t-consistency t-tv t-ct-upsample.sh'),
    ('src/quality/certificate*', 't-certificate t-ct-metrics.sh'),
    ('src/quality/edges*', 't-edges t-ct-metrics.sh'),
    ('src/quality/ssim-vol*', 't-ssim-volume t-ct-metrics.sh'),
    ('src/quality/ssim*', 't-ssim t-ssim-volume t-loss'),
    ('src/quality/*', 't-metrics t-ct-metrics.sh'),
    ('src/unet/*', 't-net-layers t-unet t-ddnm-gold t-train.sh'),
    ('src/diffusion/adam*', 't-training t-train.sh'),
    ('src/diffusion/train*', 't-training t-train.sh'),
    ('src/diffusion/patches*', 't-training t-train.sh'),
    ('src/diffusion/schedule*', 't-schedule t-ddnm t-training'),
    ('src/diffusion/matched*', 't-matched t-ddnm'),
    ('src/diffusion/prior*', 't-unet t-ddnm-gold t-ct-ddnm.sh'),
    ('src/diffusion/block*', 't-block-mean t-ddnm'),
    ('src/diffusion/measurement*', 't-block-mean t-matched t-ddnm'),
    ('src/diffusion/*', 't-ddnm t-superres t-ddnm-gold t-slices t-ct-ddnm.sh'),
    ('src/gs/loss-lowres*', 't-loss-lowres t-gsfit'),
    ('src/gs/loss*', 't-loss t-gsfit'),
    ('src/gs/voxelise*', 't-voxelise t-extreme'),
    ('src/gs/adam*', 't-density t-gsfit'),
    ('src/gs/densify*', 't-density t-gsfit'),
    ('src/gs/place*', 't-density t-gsfit'),
    ('src/gs/neighbours*', 't-gsfit'),
    ('src/gs/fit*', 't-density t-gsfit t-fit-extreme t-nabgs.sh'),
    ('src/gs/refit*', 't-gsfit t-fit-extreme'),
    ('src/gs/splat*', 't-splat t-density t-gsfit'),
    ('src/gs/*', 't-splat t-voxelise t-extreme t-gsfit'),
    ('src/cli/chain*', 't-chain.sh t-sr.sh'),
    ('src/cli/folder*', 't-chain.sh'),
    ('src/cli/content*', 't-chain.sh'),
    ('src/cli/modes*', 't-modes.sh t-contradictions.sh'),
    ('src/cli/help*', 't-modes.sh t-all-tools.sh'),
    ('src/cli/files*', 't-outputs.sh'),
    ('src/cli/resume*', 't-resume.sh t-rescue t-outputs.sh t-chain.sh'),
    ('src/cli/stop*', 't-stop.sh t-chain.sh'),
    ('src/cli/progress*', 't-stop.sh'),
    ('src/cli/*', 't-core t-all-tools.sh t-cost.sh t-resume.sh t-sr.sh'),
    ('src/shim/*', 't-dicom.sh t-convert.sh t-image t-view.sh'),
    ('src/tools/lib/scan-json*', 't-scan.sh t-npy.sh'),
    ('src/tools/lib/*', 't-ct-project.sh t-scan.sh t-convert.sh t-ct-fdk.sh'),
    ('src/tools/convert-stack*', 't-npy.sh'),
    ('src/tools/convert*', 't-scan.sh t-convert.sh t-dicom.sh'),
    ('src/tools/survey*', 't-survey t-ct-metrics.sh'),
    ('src/tools/montage*', 't-montage t-view.sh'),
    ('src/tools/sheet*', 't-view.sh'),
    ('src/tools/report*', 't-info.sh t-ply-tools.sh'),
    ('src/tools/ct-sr*', 't-sr.sh t-chain.sh t-paper.sh'),
    ('src/tools/ct-train*', 't-train.sh'),
    ('src/tools/train*', 't-train.sh'),
    ('src/tools/ct-phantom*', 't-ct-project.sh'),
    ('src/tools/fdk*', 't-ct-fdk.sh'),
    ('src/tools/fuse*', 't-ct-fuse.sh'),
    ('src/tools/metrics*', 't-ct-metrics.sh'),
    ('src/tools/project*', 't-ct-project.sh t-scan.sh'),
    ('src/tools/ct-project*', 't-ct-project.sh t-scan.sh'),
    ('src/tools/ddnm*', 't-ct-ddnm.sh t-resume.sh'),
    ('src/tools/nabgs*', 't-nabgs.sh t-resume.sh'),
    ('src/tools/ct-compose*', 't-nabgs.sh t-ply-tools.sh'),
    ('src/tools/ct-convert*', 't-convert.sh'),
    ('src/tools/ct-degrade*', 't-ct-degrade.sh'),
    ('src/tools/ct-upsample*', 't-ct-upsample.sh'),
    ('src/tools/ct-fdk*', 't-ct-fdk.sh'),
    ('src/tools/ct-fuse*', 't-ct-fuse.sh'),
    ('src/tools/ct-metrics*', 't-ct-metrics.sh'),
    ('src/tools/ct-info*', 't-info.sh'),
    ('src/tools/ct-view*', 't-view.sh'),
    ('src/tools/ct-nabgs*', 't-nabgs.sh t-nabgs-options.sh t-contradictions.sh'),
    ('src/tools/ct-ddnm*', 't-ct-ddnm.sh t-ddnm-options.sh t-contradictions.sh'),
    ('src/tools/*', 't-all-tools.sh'),
    ('formats/nifti*', 't-nifti t-convert.sh t-hostile'),
    ('formats/temp*', 't-rescue t-stop.sh t-outputs.sh t-resume.sh'),
    ('formats/exr*', 't-exr t-exr-tools.sh'),
    ('formats/ply*', 't-ply t-ply-tools.sh'),
    ('formats/safetensors*', 't-safetensors'),
    ('formats/npy*', 't-npy.sh'),
    ('formats/io*', 't-convert.sh t-all-tools.sh t-nifti t-outputs.sh'),
    ('formats/*', 't-nifti t-exr t-ply t-safetensors t-all-tools.sh t-convert.sh'),
]
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


def mutants(line):
    """All changed versions of a line of code."""
    code, found = masked(line), []
    if DECLARATION.match(code) and not re.match(r'\s*(return|goto|else)\b', code):
        return []
    code = re.sub(r'(= \{+)0|(\b(?:return|rc =) -)1\b', r'\1\2#', code)  # any other does as well
    code = re.sub(r'\[(static )?\d+\](?= = \{|,|\)|;)', lambda m: '#' * len(m.group(0)), code)  # room
    for pattern, to in SWAPS:
        for m in re.finditer(pattern, code):
            found.append(line[:m.start()] + to + line[m.end():])
    for m in NUMBER.finditer(code):
        found.append(line[:m.start()] + other_number(m.group(1)) + line[m.end():])
    m = CONDITION.search(code)
    if m:
        found.append('%s!(%s)%s' % (line[:m.start(2)], line[m.start(2):m.end(2)], line[m.end(2):]))
    if DELETE.match(code) and not re.match(r'\s*(return|goto|\w*(free|close|destroy|munmap))\b', code):
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


def run(command, limit, **kw):
    """Exit status; 'time' if it ran out of it."""
    p = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                         stdin=subprocess.DEVNULL, start_new_session=True, **kw)
    try:
        return p.wait(limit)
    except subprocess.TimeoutExpired:
        os.killpg(p.pid, signal.SIGKILL)
        p.wait()
        return 'time'


class Place:
    """The copy, its build, and the tests."""

    def __init__(self, build, jobs, limit):
        self.src, self.b = os.path.join(build, 'src'), os.path.join(build, 'b')
        self.jobs, self.limit, self.sane = jobs, limit, {}
        self.env = dict(os.environ, LC_ALL='C', srcdir=self.src, builddir=self.b,
                        PATH=self.b + ':' + os.environ['PATH'])
        for name in ('CT_THREADS', 'OMP_NUM_THREADS'):
            self.env.pop(name, None)

    def prepare(self):
        names = subprocess.check_output(['git', 'ls-files', '-z'], cwd=TOP).decode().split('\0')
        for name in filter(None, names):
            to = os.path.join(self.src, name)
            if not os.path.isfile(os.path.join(TOP, name)):
                continue
            data = open(os.path.join(TOP, name), 'rb').read()
            if os.path.exists(to) and open(to, 'rb').read() == data:
                continue
            os.makedirs(os.path.dirname(to), exist_ok=True)
            shutil.copy2(os.path.join(TOP, name), to)
            os.utime(to)
        os.makedirs(self.b, exist_ok=True)
        if not os.path.exists(self.b + '/Makefile'):
            cc = 'CC=ccache gcc' if shutil.which('ccache') else 'CC=gcc'
            subprocess.check_call(['./bootstrap'], cwd=self.src, stdout=subprocess.DEVNULL,
                                  stderr=subprocess.DEVNULL)
            subprocess.check_call(['../src/configure', cc, 'CFLAGS=-O2', 'CXXFLAGS=-O2'], cwd=self.b,
                                  stdout=subprocess.DEVNULL)
        subprocess.check_call(['make', '-s', '-j%d' % self.jobs], cwd=self.b,
                              stdout=subprocess.DEVNULL)
        make = open(self.b + '/Makefile').read()
        tools = re.search(r'^bin_PROGRAMS = ((?:.*\\\n)*.*)', make, re.M).group(1)
        self.env['CT_TOOLS'] = ' '.join(t for t in tools.replace('\\', ' ').split()
                                        if os.path.exists(os.path.join(self.b, t)))

    def make(self, target):
        return run(['make', '-s', '-j%d' % self.jobs, target], 600, cwd=self.b)

    def test(self, name):
        """Exit status of a test, built first; None if it cannot be built."""
        shell = name.endswith('.sh')
        if not os.path.exists('%s/tests/%s%s' % (self.src, name, '' if shell else '.c')) \
                and not name.startswith('t-vec'):
            return 0
        if self.make('all' if shell else 'tests/' + name) != 0:
            return None
        if shell:
            return run(['sh', self.src + '/tests/' + name], self.limit, cwd=self.b, env=self.env)
        return run(['tests/' + name], self.limit, cwd=self.b, env=self.env)

    def passes(self, name):
        """Does the test pass as things are? Asked once."""
        if name not in self.sane:
            self.sane[name] = self.test(name) in (0, 77)
            if not self.sane[name]:
                print('# %s fails without a change, or takes too long: not run' % name)
        return self.sane[name]

    def try_line(self, path, number, line, tests):
        """The test that notices, None, or False if it does not compile."""
        whole = os.path.join(self.src, path)
        was = open(whole).read()
        rows = was.split('\n')
        tests = [t for t in tests if self.passes(t)]
        rows[number - 1] = line
        try:
            open(whole, 'w').write('\n'.join(rows))
            for t in tests:
                status = self.test(t)
                if status is None:
                    return False
                if status not in (0, 77):
                    return t
            return None
        finally:
            open(whole, 'w').write(was)


def tests_of(path):
    for pattern, tests in MAP:
        if fnmatch.fnmatch(path, pattern):
            return tests.split()
    return []


def candidates(o):
    names = subprocess.check_output(['git', 'ls-files', 'src', 'formats'], cwd=TOP).decode().split()
    for path in names:
        if re.search(r'\.(c|h|cc)$', path) and fnmatch.fnmatch(path, o.files) and tests_of(path):
            for number, line in code_lines(os.path.join(TOP, path)):
                if mutants(line):
                    yield path, number, line


def chosen(o):
    """What to try, in order: (path, number, line, changed line)."""
    for at in o.at:
        path, number, word = (at.split(':', 2) + [''])[:3]
        line = open(os.path.join(TOP, path)).read().split('\n')[int(number) - 1]
        fit = [m for m in mutants(line) if word in m]
        random.Random(o.seed).shuffle(fit)
        for m in fit[:o.each or None]:
            yield path, int(number), line, m
    if o.at:
        return
    places = list(candidates(o))
    rng = random.Random(o.seed)
    while places:
        path, number, line = places.pop(rng.randrange(len(places)))
        yield path, number, line, rng.choice(mutants(line))


def main():
    p = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    p.add_argument('--seed', type=int, default=1)
    p.add_argument('--count', type=int, default=300)
    p.add_argument('--limit', type=int, default=120, help='seconds a test may take')
    p.add_argument('--minutes', type=float, default=0, help='begin no mutant after these')
    p.add_argument('--files', default='*', help='only files that match')
    p.add_argument('--at', nargs='*', default=[], metavar='FILE:LINE[:WORD]')
    p.add_argument('--each', type=int, default=0, help='at most so many of each --at')
    p.add_argument('--jobs', type=int, default=os.cpu_count())
    p.add_argument('--build', default=os.path.join(TOP, 'build-mutate'))
    p.add_argument('--dry-run', action='store_true', help='print the mutants')
    o = p.parse_args()
    place, died, alive, began = Place(os.path.abspath(o.build), o.jobs, o.limit), 0, [], time.time()
    if not o.dry_run:
        place.prepare()
    for path, number, line, changed in chosen(o):
        if not o.at and died + len(alive) >= o.count or \
                o.minutes and time.time() - began > 60 * o.minutes:
            break
        if o.dry_run:
            died += 1
            print('%s:%d: %s\n    -> %s' % (path, number, line.strip(), changed.strip()))
            continue
        by = place.try_line(path, number, changed, tests_of(path))
        if by is False:
            continue
        died += by is not None
        if by is None:
            alive.append('%s:%d: %s\n    -> %s' % (path, number, line.strip(), changed.strip()))
        print('%s %s:%d: %s   %s' % ('died' if by else 'LIVES', path, number, changed.strip(),
                                     'by ' + by if by else ''), flush=True)
    total = died + len(alive)
    if total and not o.dry_run:
        print('%d of %d mutants died: %.0f%% (seed %d)' % (died, total, 100 * died / total, o.seed))
        print('survivors:\n' + '\n'.join(alive) if alive else 'no survivor')
    return 0


if __name__ == '__main__':
    sys.exit(main())
