#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# b-field.sh: processor seconds of a step of the fit of a neural field, one thread each, by ct-field and by
# PyTorch (field-twin.py, dense grids by grid_sample, hashed ones as naf_twin.py), in turn, A B A B: all points of a
# CT of 32^3 on dense grids of 8 to 32, and 1024 rays of 192 samples of NAF. A step is the difference of two runs.
set -e
for PY in python3 /usr/bin/python3; do "$PY" -c 'import torch, numpy' 2>/dev/null && break; PY=; done
[ -n "$PY" ] || { echo 'b-field.sh: skipped: no PyTorch'; exit 0; }
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
ct-phantom --size=64x64x64 --spacing=2 ellipsoids "$dir/hr.nii"
ct-degrade -x 2 "$dir/hr.nii" "$dir/lr.nii"
ct-project --views 20 --det 64x64 "$dir/hr.nii" "$dir/p.exr"
"$PY" - "$dir" "${srcdir:-.}" <<'EOP'
import os, resource, statistics, subprocess, sys

folder, src = sys.argv[1:]
def seconds(cmd):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(cmd, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
def ours(kind, n):
    what = ["--samples", "points", "lr.nii"] if kind == "points" else ["--like", "naf", "--grid", "4", "p.exr"]
    what[-1] = folder + "/" + what[-1]
    return seconds(["ct-field", "-q", "-f", "-t", "1", "-b", str(n)] + what + [folder + "/out.nii"])
for kind, n in ("points", 100), ("naf", 6):
    s, t = [], []
    for turn in range(int(os.environ.get("ROUNDS", "3"))):
        s.append((ours(kind, n + 1) - ours(kind, 1)) / n)
        t.append(float(subprocess.run([sys.executable, "-B", src + "/bench/field-twin.py", kind, str(n)], check=True,
                                      capture_output=True, text=True).stdout))
    r = sorted(b / a for a, b in zip(s, t))
    print("%s: %.3g CPU s a step, %.3g PyTorch, ratio %.3g [%.3g..%.3g]"
          % (kind, statistics.median(s), statistics.median(t), statistics.median(r), r[0], r[-1]), flush=True)
EOP
