# SPDX-License-Identifier: Apache-2.0
"""What a command shows on a terminal: term.py [--slow N] COMMAND..., one line for each that it draws. With --slow
the command runs 5 ms in every 5 N, so that what a fast machine does at once takes long enough to be told."""
import os
import pty
import select
import signal
import sys
import time

slow, command = 1, sys.argv[1:]
if command[0] == "--slow":
    slow, command = int(command[1]), command[2:]
pid, fd = pty.fork()
if pid == 0:
    os.execvp(command[0], command)
shown = b""
while True:
    try:
        if slow > 1 and not select.select([fd], [], [], 0.005)[0]:
            os.kill(pid, signal.SIGSTOP)
            time.sleep(0.005 * (slow - 1))
            os.kill(pid, signal.SIGCONT)
            continue
        some = os.read(fd, 65536)
    except OSError:  # it has ended
        break
    if not some:
        break
    shown += some
for line in shown.decode().replace("\x1b[K", "").replace("\r", "\n").split("\n"):
    if line.strip():
        print(line)
sys.exit(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))
