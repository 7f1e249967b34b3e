# SPDX-License-Identifier: Apache-2.0
"""Programs of Python that a test calls often: calls.py FOLDER MODULE... loads the modules once, and each
call runs in a process of its own. Asked on standard input: the number of words, the folder to be in, the
program and its arguments, each ended by a zero; answered by a line with the exit status, when FOLDER/out
and FOLDER/err have what was printed (tap.sh)."""
import gc
import importlib
import os
import runpy
import sys
import traceback

folder, modules = sys.argv[1], sys.argv[2:]
for name in modules:
    try:
        importlib.import_module(name)
    except ImportError:  # the program says so, if it needs it
        pass
gc.freeze()
ask = os.fdopen(0, "rb")


def word():
    said = bytearray()
    while (c := ask.read(1)) not in (b"\0", b""):
        said += c
    return os.fsdecode(bytes(said))


def run(where, program, *args):
    for name, fd in (("out", 1), ("err", 2)):
        os.dup2(os.open(os.path.join(folder, name), os.O_WRONLY | os.O_CREAT | os.O_TRUNC), fd)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.chdir(where)
    sys.argv = [program, *args]
    runpy.run_path(program, run_name="__main__")


while count := word():
    words = [word() for _ in range(int(count) + 1)]
    pid = os.fork()
    if pid == 0:
        status = 0
        try:
            run(*words)
        except SystemExit as e:
            status = e.code if isinstance(e.code, int) else 0 if e.code is None else print(e.code, file=sys.stderr) or 1
        except BaseException:
            traceback.print_exc()
            status = 1
        sys.stdout.flush()
        os._exit(int(status))
    os.write(1, b"%d\n" % os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))
