# SPDX-License-Identifier: Apache-2.0
"""What a shell offers: tab.py SHELL SETUP LINE types LINE at a terminal, asks for all completions to be put
into it, and prints the words that the command would then have, one a line."""
import os
import pty
import select
import sys
import time

shell, setup, line = sys.argv[1:]
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
