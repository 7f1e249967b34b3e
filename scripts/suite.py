"""suite.py: the tests of a build folder, run one at a time outside of make check. Used by
coverage.py and mutate.py."""
import os, re, shutil, signal, subprocess

TOP = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


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


class Suite:
    """The tests of the sources at src in the build folder b, which is made if it is not there."""

    def __init__(self, src, b, flags, jobs):
        self.src, self.b, self.jobs = src, b, jobs
        os.makedirs(b, exist_ok=True)
        if not os.path.exists(src + '/configure'):
            subprocess.check_call(['./bootstrap'], cwd=src, stdout=subprocess.DEVNULL,
                                  stderr=subprocess.DEVNULL)
        if not os.path.exists(b + '/Makefile'):
            cc = 'CC=ccache gcc' if shutil.which('ccache') else 'CC=gcc'
            subprocess.check_call([src + '/configure', cc, 'CFLAGS=' + flags, 'CXXFLAGS=' + flags], cwd=b,
                                  stdout=subprocess.DEVNULL)
        subprocess.check_call(['make', '-s', '-j%d' % jobs], cwd=b, stdout=subprocess.DEVNULL)
        self.env = dict(os.environ, LC_ALL='C', srcdir=src, builddir=b, PATH=b + ':' + os.environ['PATH'],
                        CT_TOOLS=' '.join(t for t in self.words('bin_PROGRAMS')))
        for name in ('CT_THREADS', 'OMP_NUM_THREADS', 'MAKELEVEL', 'MAKEFLAGS'):
            self.env.pop(name, None)

    def words(self, variable):
        """What make says that a variable holds."""
        ask = 'include Makefile\n.PHONY: say\nsay:\n\t@echo $(%s)\n' % variable
        return subprocess.run(['make', '-s', '-f', '-', 'say'], cwd=self.b, input=ask, text=True,
                              check=True, stdout=subprocess.PIPE).stdout.split()

    def names(self):
        """All tests: t-core, t-sr.sh."""
        return sorted(re.sub('^tests/', '', t) for t in self.words('TESTS'))

    def make(self, names):
        """Builds what the tests of these names take. Did it work?"""
        targets = {'all' if t.endswith('.sh') else 'tests/' + t for t in names}
        for t in names:  # a shell test may call another as a tool
            if t.endswith('.sh'):
                text = open('%s/tests/%s' % (self.src, t)).read()
                targets.update(re.findall(r'builddir"?/(tests/t-[\w-]+)', text))
        return self.build(sorted(targets))

    def build(self, targets):
        """Did make make them?"""
        return run(['make', '-s', '-j%d' % self.jobs] + targets, 900, cwd=self.b) == 0

    def test(self, name, limit, **env):
        """Exit status of a test that is built; 'time'."""
        command = ['sh', self.src + '/tests/' + name] if name.endswith('.sh') else ['tests/' + name]
        return run(command, limit, cwd=self.b, env=dict(self.env, **env))
