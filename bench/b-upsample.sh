#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# b-upsample.sh: CPU seconds of ct-upsample -x 4 (32^3 to 128^3, its default method) and of
# scipy.ndimage.zoom, cubic, in turn, A B A B, whole processes; scipy's without starting Python.
# The one solves an inverse problem in a hundred passes or more where the other interpolates once:
# the ratio tells what that costs, not who is better.
set -e
for PY in python3 /usr/bin/python3; do
	"$PY" -c 'import numpy, scipy.ndimage' 2>/dev/null && break; PY=
done
[ -n "$PY" ] || { echo 'b-upsample.sh: skipped: no numpy and scipy'; exit 0; }
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
cd "$dir"
ct-phantom --size 128x128x128 ellipsoids hr.nii
ct-degrade -x 4 hr.nii lr.nii
"$PY" - <<'EOP'
import os, resource, subprocess, time
import numpy as np
import scipy.ndimage

def cpu(cmd):
    a = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(cmd, check=True, stdout=subprocess.DEVNULL)
    b = resource.getrusage(resource.RUSAGE_CHILDREN)
    return b.ru_utime - a.ru_utime + b.ru_stime - a.ru_stime

def zoom(lr):
    t = time.process_time()
    scipy.ndimage.zoom(lr, 4, order=3, mode="reflect", grid_mode=True)
    return time.process_time() - t

lr = np.random.default_rng(0).normal(0, 300, (32, 32, 32)).astype("f4")
a, b = [], []
for turn in range(int(os.environ.get("ROUNDS", "5"))):
    a.append(cpu(["ct-upsample", "-f", "-q", "-x", "4", "lr.nii", "up.nii"]))
    b.append(zoom(lr))
ratio = np.array(b) / np.array(a)
print("CPU seconds, 32^3 to 128^3: %.2f ct-upsample [%.2f..%.2f], %.2f scipy.ndimage.zoom, "
      "ratio %.2g [%.2g..%.2g]"
      % (np.median(a), min(a), max(a), np.median(b), np.median(ratio), ratio.min(), ratio.max()))
EOP
