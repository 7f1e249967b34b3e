#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# b-unet.sh: CPU seconds and peak memory of the network of the shipped prior, one thread each, by us and
# by PyTorch, in turn, A B A B: a forward pass on a picture of 128^2, and a step of training (gradient of
# eight pieces of 96^2, AdamW, running average). Memory is of the whole process, libraries and all, and
# what it took beyond what it had before the network. The BLAS that PyTorch found is told: with the
# reference's it loses time in the linear layers that OpenBLAS does not.
set -e
for PY in python3 /usr/bin/python3; do "$PY" -c 'import torch, numpy' 2>/dev/null && break; PY=; done
[ -n "$PY" ] || { echo 'b-unet.sh: skipped: no PyTorch'; exit 0; }
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
exec "$PY" - "$(pwd)/bench/unet-calls" "${srcdir:-.}" <<'EOP'
import os, subprocess, sys
import numpy as np

ours, src = sys.argv[1:]
prior = src + "/src/prior/prior.safetensors"
def start(cmd):
    p = subprocess.Popen(cmd, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    return p, int(p.stdout.readline())
def call(p):
    p.stdin.write("\n"); p.stdin.flush()
    return map(float, p.stdout.readline().split())
def blas(pid):
    names = {os.path.realpath(l.split()[-1]) for l in open("/proc/%d/maps" % pid) if "blas" in l.split()[-1]}
    return " ".join(sorted(n for n in names if ".so" in n))
for kind, size, batch, what in (("forward", 128, 1, "forward pass"), ("step", 96, 8, "step of training")):
    args = [kind, prior, str(size), str(batch)]
    a, a0 = start([ours] + args)
    b, b0 = start([sys.executable, src + "/bench/unet-torch.py", src + "/tests/t-pt.py"] + args)
    call(a), call(b)
    s, t = [], []
    for turn in range(int(os.environ.get("ROUNDS", "7"))):
        u, m, value = call(a)
        s.append(u)
        v, n, want = call(b)
        t.append(v)
    r = sorted(v/u for u, v in zip(s, t))
    print("%s, %d of %d^2: %.3g CPU s, %.3g PyTorch, ratio %.3g [%.3g..%.3g]; "
          "peak %.0f MiB, %.0f, share %.2g; beyond the libraries %.0f MiB, %.0f, share %.2g"
          % (what, batch, size, np.median(s), np.median(t), np.median(r), r[0], r[-1],
             m/1024, n/1024, m/n, (m - a0)/1024, (n - b0)/1024, (m - a0)/(n - b0)), end="")
    print(", values differ by %.1e" % abs(value/want - 1) if kind == "forward" else "")
    sys.stdout.flush()
    if kind == "step":
        print("PyTorch with " + (blas(b.pid) or "a BLAS of its own"))
    for p in a, b:
        p.stdin.close(); p.wait()
EOP
