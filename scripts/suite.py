# SPDX-License-Identifier: Apache-2.0
"""suite.py: the tests of a build folder, run one at a time outside of make check. Used by
coverage.py and mutate.py. A machine with other work makes a test wait, so that its limit is in seconds
of CPU, its own and its children's."""
import contextlib, os, re, shutil, signal, subprocess, time

TOP = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
TICKS = os.sysconf('SC_CLK_TCK')
IDLE = 60   # seconds in a row in which nothing of a session ran or wanted to: it hangs
WALL = 900  # seconds after which nobody knows


def session(leader):
    """pid -> (state, CPU seconds, its ended children's too) of what is in a session."""
    found = {}
    for pid in filter(str.isdigit, os.listdir('/proc')):
        try:
            of = open('/proc/%s/stat' % pid).read().rpartition(')')[2].split()
        except OSError:
            continue
        if int(of[3]) == leader:
            found[int(pid)] = of[0], sum(map(int, of[11:15])) / TICKS
    return found


def run(command, limit=float('inf'), **kw):
    """(exit status, CPU seconds); the status is 'time' if they are more than the limit, 'hangs', or
    'unknown' if neither was told in time."""
    p = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                         stdin=subprocess.DEVNULL, start_new_session=True, **kw)
    began = looked = woke = time.time()
    spent, status = 0, None
    while status is None:
        pid, code, usage = os.wait4(p.pid, os.WNOHANG)
        if pid:
            p.returncode = os.waitstatus_to_exitcode(code)
            return p.returncode, usage.ru_utime + usage.ru_stime
        now = time.time()
        time.sleep(min(.25, .01 + (now - began) / 20))
        if now - looked < 1:
            continue
        there, looked, before = session(p.pid), now, spent
        spent = sum(cpu for _, cpu in there.values())
        if spent != before or any(state in 'RD' for state, _ in there.values()):
            woke = now
        status = ('time' if spent > limit else 'hangs' if now - woke > IDLE else
                  'unknown' if limit < float('inf') and now - began > WALL else None)
    for pid in session(p.pid):
        with contextlib.suppress(ProcessLookupError):  # it may have ended by now
            os.kill(pid, signal.SIGKILL)
    p.wait()
    return status, spent


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
        return run(['make', '-s', '-j%d' % self.jobs] + targets, cwd=self.b)[0] == 0

    def test(self, name, limit, **env):
        """Exit status, or why there is none, and CPU seconds of a test that is built."""
        command = ['sh', self.src + '/tests/' + name] if name.endswith('.sh') else ['tests/' + name]
        return run(command, limit, cwd=self.b, env=dict(self.env, **env))
