# SPDX-License-Identifier: Apache-2.0
"""What stands on a terminal. terminal.py offered SHELL SETUP LINE types LINE, asks for all completions to be put into
it, and prints the words that the command would then have, one a line. terminal.py shown [--slow N] COMMAND... prints
one line for each that the command draws. With --slow the command runs 5 ms in every 5 N, so that what a fast machine
does at once takes long enough to be told."""
import os
import pty
import select
import signal
import sys
import time


def offered(shell, setup, line):
    how = {
        "bash": (["bash", "--norc", "--noprofile", "-i"], "bind '\"\\C-xt\": insert-completions'"),
        "zsh": (["zsh", "-f", "-i"],
                "zle -C everything complete-word _generic; bindkey '^Xt' everything; "
                "zstyle ':completion:everything:*' completer _all_matches _complete; "
                "zstyle ':completion:everything:*' insert true"),
    }[shell]
    pid, fd = pty.fork()
    if pid == 0:
        os.environ.update(TERM="dumb", PS1="$ ", HOME=os.getcwd(), ZDOTDIR=os.getcwd(), HISTFILE="")
        os.execvp(how[0][0], how[0])
    end = time.time() + 60

    def until(mark):
        got = b""
        while mark not in got:
            if time.time() > end or not select.select([fd], [], [], 1)[0] and os.waitpid(pid, os.WNOHANG)[0]:
                sys.exit("no answer: %r" % got)
            if select.select([fd], [], [], 0)[0]:
                got += os.read(fd, 65536)
        return got

    def send(text):
        os.write(fd, text.encode())

    send("stty -echo columns 4000; %s; %s; printf 'rea%%s\\n' dy\n" % (setup, how[1]))
    until(b"ready")
    send("words() { printf 'word:%s\\n' \"$@\"; echo 'en''d'; }\n")
    send(line + "\x18t")
    # the beginning of the line, and the command becomes an argument
    send("\x01words \n")
    for w in until(b"end").decode().splitlines():
        if w.startswith("word:"):
            print(w[5:])
    os.close(fd)
    os.waitpid(pid, 0)


def shown(*command):
    slow = 1
    if command[0] == "--slow":
        slow, command = int(command[1]), command[2:]
    pid, fd = pty.fork()
    if pid == 0:
        os.execvp(command[0], command)
    drawn = b""
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
        drawn += some
    for line in drawn.decode().replace("\x1b[K", "").replace("\r", "\n").split("\n"):
        if line.strip():
            print(line)
    sys.exit(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))


if __name__ == "__main__":
    globals()[sys.argv[1]](*sys.argv[2:])
