#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# b-metrics.sh: CPU seconds of the figures of ct-metrics and of scikit-image's functions on a pair of
# volumes of 256^3, one thread each, in turn, A B A B; and how far the values are apart. First the calls
# alone, volumes in memory, slices contiguous, which is what suits scikit-image best; then
# whole commands, files read and modules imported.
set -e
for PY in python3 /usr/bin/python3; do "$PY" -c 'import nibabel, skimage.metrics' 2>/dev/null && break; PY=; done
[ -n "$PY" ] || { echo 'b-metrics.sh: skipped: no nibabel and scikit-image'; exit 0; }
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
calls=$(pwd)/bench/metrics-calls
cd "$dir"
cat >script.py <<'EOF'
import sys, nibabel as nib, numpy as np
from skimage.metrics import structural_similarity as ssim
a, b = (nib.load(f).get_fdata(dtype=np.float32) for f in ("a.nii", "b.nii"))
if sys.argv[1] == "wang":
    print(np.mean([ssim(a[..., k], b[..., k], data_range=1, gaussian_weights=True, sigma=1.5,
                        use_sample_covariance=False) for k in range(a.shape[2])]))
else:
    print(ssim(a, b, data_range=1))
EOF
"$PY" - "$calls" <<'EOF'
import os, resource, subprocess, sys, time
import numpy as np, nibabel as nib
from skimage.metrics import structural_similarity as ssim, peak_signal_noise_ratio as psnr

N, ROUNDS = 256, int(os.environ.get("ROUNDS", "5"))
rng = np.random.default_rng(1)
z, y, x = np.indices((N, N, N), np.float32, sparse=True)
a = .5 + .3*np.sin(x/9)*np.cos(y/7 + z/20)
b = a + .01*rng.standard_normal(a.shape, np.float32)
a.tofile("a.raw"); b.tofile("b.raw")
for v, name in ((a, "a.nii"), (b, "b.nii")):
    nib.save(nib.Nifti1Image(v.transpose(2, 1, 0), np.eye(4)), name)
ours = subprocess.Popen([sys.argv[1], str(N), "a.raw", "b.raw"], stdin=subprocess.PIPE,
                        stdout=subprocess.PIPE, text=True)
def call(name):
    ours.stdin.write(name + "\n"); ours.stdin.flush()
    return map(float, ours.stdout.readline().split())
gauss = dict(gaussian_weights=True, sigma=1.5, use_sample_covariance=False)
slices = lambda **k: np.mean([ssim(p, q, data_range=1, **k) for p, q in zip(a, b)])
theirs = {
    "psnr": lambda: psnr(a, b, data_range=1),
    "skimage": slices,
    "wang": lambda: slices(**gauss),
    "3d": lambda: ssim(a, b, data_range=1),
    "3d-gauss": lambda: ssim(a, b, data_range=1, **gauss),
}
def line(what, s, t, unit):
    r = sorted(v/u for u, v in zip(s, t))
    print("%s: %.4g %s, %.4g %s scikit-image, ratio %.3g [%.3g..%.3g]" % (what, np.median(s), unit,
          np.median(t), unit, np.median(r), r[0], r[-1]), end="")
for name, f in theirs.items():
    s, t = [], []
    for turn in range(ROUNDS):
        u, value = call(name)
        start = time.process_time()
        want = f()
        s.append(1e9*u/N**3); t.append(1e9*(time.process_time() - start)/N**3)
    line(name + (" (with MAE, RMSE, gradient errors)" if name == "psnr" else " SSIM"), s, t,
         "ns a voxel")
    print(", values differ by %.1e" % abs(value - want))
    sys.stdout.flush()
ours.stdin.close(); ours.wait()

def cpu(cmd):
    u = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(cmd, check=True, stdout=subprocess.DEVNULL)
    v = resource.getrusage(resource.RUSAGE_CHILDREN)
    return v.ru_utime - u.ru_utime + v.ru_stime - u.ru_stime
for name in ("wang", "3d"):
    s, t = [], []
    for turn in range(ROUNDS):
        s.append(cpu(["ct-metrics", "-t", "1", "--range", "1", "--ssim", name, "a.nii", "b.nii"]))
        t.append(cpu([sys.executable, "script.py", name]))
    line("ct-metrics --ssim " + name, s, t, "s"); print()
EOF
