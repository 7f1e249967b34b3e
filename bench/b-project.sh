#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# b-project.sh [VOLUME]: CPU seconds a view of ct-project and of plastimatch drr -i exact on one volume and
# one geometry, in turn, A B A B; and the difference between their pictures.
#
# plastimatch takes the volume as if its axes were + whatever its direction cosines say, so it is given a
# MetaImage with identity cosines, centred, x and y of LPS; at angle 0 its source is at +x of LPS.
# Its pixel is the sum of length times mu of the voxel, mu = 0.0022 (1 + HU/1000)/mm, 0 up to -800 HU; ours
# is given the same densities. Its box ends in the middle of the outermost voxels (a cube of 20
# voxels projects to 19), so a layer of air is put around the volume. Both are exact through
# the same voxels: what is left is float rounding.
#
# LEAP=folder (https://github.com/LLNL/LEAP, MIT: its src, with a libleapct.so of the files of cpu_CMakeLists.txt, built
# with -O3 -march=native) adds LEAP on the CPU: 256^3 voxels of 2/3 mm, which its projector asks for, separable footprints.
set -e
command -v plastimatch >/dev/null 2>&1 || { echo 'b-project.sh: skipped: no plastimatch'; exit 0; }
for PY in python3 /usr/bin/python3; do "$PY" -c 'import numpy, nibabel' 2>/dev/null && break; PY=; done
[ -n "$PY" ] || { echo 'b-project.sh: skipped: no numpy and nibabel'; exit 0; }
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
if [ $# -gt 0 ]; then cp "$1" "$dir/in.nii.gz"; else
	ct-phantom --size 256x256x256 --spacing 1.25 ellipsoids "$dir/in.nii.gz"
fi
"$PY" - "$dir" <<'EOF'
import os, resource, subprocess, sys
import numpy as np
import nibabel as nib

dir = sys.argv[1]
os.chdir(dir)
img = nib.as_closest_canonical(nib.load("in.nii.gz"))
hu = np.pad(np.asarray(img.dataobj, np.float32), 1, constant_values=-1024)
mm = img.header.get_zooms()[:3]
n = hu.shape
# ours: RAS+, centred. theirs: LPS, the same object, so x and y run the other way.
affine = np.diag(list(mm) + [1.0])
affine[:3, 3] = [-m * (k - 1) / 2 for m, k in zip(mm, n)]
density = np.where(hu <= -800, 0, 1 + hu / 1000).astype(np.float32)  # of water 1
nib.save(nib.Nifti1Image(density, affine), "ours.nii")
theirs = np.ascontiguousarray(hu[::-1, ::-1, :].transpose(2, 1, 0), "<f4")
with open("theirs.mha", "wb") as f:
    f.write(("ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
             "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = %r %r %r\nElementSpacing = %r %r %r\n"
             "DimSize = %d %d %d\nElementType = MET_FLOAT\nElementDataFile = LOCAL\n"
             % (tuple(affine[:3, 3].tolist()) + tuple(map(float, mm)) + n)).encode())
    f.write(theirs.tobytes())

def cpu(cmd):
    a = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(cmd, check=True, stdout=subprocess.DEVNULL)
    b = resource.getrusage(resource.RUSAGE_CHILDREN)
    return b.ru_utime - a.ru_utime + b.ru_stime - a.ru_stime

STEP = 360 / 22
def ours(views, volume="ours.nii"):
    return cpu(["ct-project", "-f", "-q", "--quantity", "density", "-n", str(views),
                "--arc", str(views * STEP), "--det", "512x512", "--expert",
                "dso=1000,dsd=1500,pitch=1", volume, "ours.exr"])
def peer(views):
    return cpu(["plastimatch", "drr", "-i", "exact", "-t", "pfm", "-r", "512 512", "-z", "512 512",
                "--sad", "1000", "--sid", "1500", "-a", str(views), "-N", str(STEP), "-O", "p_",
                "-I", "theirs.mha"])
a, b, ratio = [], [], []
for turn in range(int(os.environ.get("ROUNDS", "3"))):  # a view: what twenty more of them cost
    x = (ours(22) - ours(2)) / 20
    y = (peer(22) - peer(2)) / 20
    a.append(x); b.append(y); ratio.append(y / x)
print("CPU seconds a view: %.3f ct-project (%s), %.3f plastimatch exact, ratio %.1f [%.1f..%.1f]"
      % (np.median(a), os.environ.get("CTSR_CPU", "highest level"), np.median(b), np.median(ratio),
         min(ratio), max(ratio)))

def leap(folder, n=256, views=8):
    sys.path.insert(0, folder)
    from leapctype import tomographicModels
    m = tomographicModels()
    m.set_gpu(-1)
    m.set_conebeam(views, 512, 512, 1, 1, 255.5, 255.5, m.setAngleArray(views, views * STEP), 1000, 1500)
    m.set_volume(n, n, n, 2 / 3, 2 / 3)
    at = np.indices((n, n, n), np.float32) - (n - 1) / 2
    f = np.ascontiguousarray((at ** 2).sum(0) < (0.4 * n) ** 2, np.float32)  # a ball
    nib.save(nib.Nifti1Image(f, np.diag([2 / 3, 2 / 3, 2 / 3, 1])), "ball.nii")
    g, back = np.zeros((views, 512, 512), np.float32), np.zeros_like(f)
    def took(do):
        begin = os.times()
        do()
        end = os.times()
        return end.user - begin.user + end.system - begin.system
    ratio, gups = [], []
    for turn in range(int(os.environ.get("ROUNDS", "3"))):
        x = (ours(22, "ball.nii") - ours(2, "ball.nii")) / 20
        ratio.append(took(lambda: m.project_cpu(g, f)) / views / x)
        gups.append(n ** 3 * views / 1e9 / took(lambda: m.backproject_cpu(g, back)))
    ours(views, "ball.nii")
    told = subprocess.run(["ct-info", "ours.exr"], check=True, capture_output=True, text=True).stdout
    mean = float(next(l.split()[1] for l in told.splitlines() if l.startswith("mean ")))
    print("LEAP: forward, CPU seconds by those of ct-project %.1f [%.1f..%.1f], mean of the pictures by ours %.4f; "
          "back %.3g GUPS [%.3g..%.3g], a CPU second" % (np.median(ratio), min(ratio), max(ratio), g.mean() / mean,
          np.median(gups), min(gups), max(gups)))
if os.environ.get("LEAP"):
    leap(os.environ["LEAP"])

def pfm(path):
    with open(path, "rb") as f:
        assert f.readline().strip() == b"Pf"
        w, h = map(int, f.readline().split())
        scale = float(f.readline())
        return np.frombuffer(f.read(), "<f4" if scale < 0 else ">f4").reshape(h, w)
ours(22)
try:
    subprocess.run(["oiiotool", "ours.exr", "--subimage", "3", "--compression", "none",
                    "-d", "float", "-o", "ours.tif"], check=True)
    import skimage.io
    o = skimage.io.imread("ours.tif").astype(float)
except Exception:
    print("b-project.sh: pictures not compared: no oiiotool or skimage")
    sys.exit(0)
best = None
for k in range(22):  # theirs may turn the other way round, and rows and columns may run backwards
    p = pfm("p_%04d.pfm" % k) / 0.0022
    for name, f in (("", p), (" mirrored", p[:, ::-1]), (" upside down", p[::-1]),
                    (" half a turn", p[::-1, ::-1])):
        e = np.sqrt(np.mean((f - o) ** 2)) / o.max()
        if best is None or e < best[0]:
            best = (e, k, name, f)
e, k, name, f = best
print("difference: rms %.2g of the largest pixel, median %.2g, 99.9 %% %.2g, mean ratio %.5f "
      "(their view %d%s)" % (e, np.median(abs(f - o)) / o.max(),
      np.quantile(abs(f - o), 0.999) / o.max(), f.mean() / o.mean(), k, name))
EOF
