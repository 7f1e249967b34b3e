#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# b-fdk.sh: CPU seconds of ct-fdk and of plastimatch fdk, in turn, A B A B, whole processes, on the same
# closed-form projections of the same phantom (--filter hann): 100 views over a full turn, 512x512 pixels of
# 1 mm, 256^3 voxels of 1.25 mm; and the error of both in HU, ours as it comes, theirs after the
# affine fit that it needs (its values are in units of its own).
#
# plastimatch reads a folder of PFM pictures with a text file each; its own drr of an empty volume
# makes the text files, and the pictures are replaced. Its view i is ours at 180 - 3.6 i degrees.
set -e
command -v plastimatch >/dev/null 2>&1 || { echo 'b-fdk.sh: skipped: no plastimatch'; exit 0; }
command -v oiiotool >/dev/null 2>&1 || { echo 'b-fdk.sh: skipped: no oiiotool'; exit 0; }
for PY in python3 /usr/bin/python3; do
	"$PY" -c 'import numpy, nibabel, skimage.io' 2>/dev/null && break; PY=
done
[ -n "$PY" ] || { echo 'b-fdk.sh: skipped: no numpy, nibabel and skimage'; exit 0; }
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
cd "$dir"
grid='--size 256x256x256 --spacing 1.25'
# shellcheck disable=SC2086
ct-phantom $grid --expert oversample=4 ellipsoids truth.nii
ct-project -q -n 100 --expert start=180,dso=1000,dsd=1500,pitch=1 --arc -360 --det 512 truth.nii like.exr
# shellcheck disable=SC2086
ct-phantom $grid --like like.exr ellipsoids p.exr
oiiotool -a p.exr -d float --compression none -o p.tif
"$PY" - <<'EOF'
import os, resource, subprocess
import numpy as np
import nibabel as nib
import skimage.io

with open("empty.mha", "wb") as f:
    f.write(b"ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
            b"TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = -1 -1 -1\nElementSpacing = 1 1 1\n"
            b"DimSize = 3 3 3\nElementType = MET_FLOAT\nElementDataFile = LOCAL\n")
    f.write(np.zeros(27, "<f4").tobytes())
os.mkdir("peer")
subprocess.run("plastimatch drr -i exact -t pfm -r 512\\ 512 -z 512\\ 512 --sad 1000 --sid 1500 "
               "-a 100 -N 3.6 -O peer/p_ -I empty.mha", shell=True, check=True,
               stdout=subprocess.DEVNULL)
stack = skimage.io.imread("p.tif").reshape(100, 512, 512)
for k in range(100):
    with open("peer/p_%04d.pfm" % k, "wb") as f:
        f.write(b"Pf\n512 512\n-1\n" + np.ascontiguousarray(stack[k], "<f4").tobytes())

def cpu(cmd):
    a = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(cmd, check=True, stdout=subprocess.DEVNULL)
    b = resource.getrusage(resource.RUSAGE_CHILDREN)
    return b.ru_utime - a.ru_utime + b.ru_stime - a.ru_stime

a, b = [], []
for turn in range(int(os.environ.get("ROUNDS", "3"))):
    a.append(cpu(["ct-fdk", "-f", "-q", "--filter", "hann", "--grid", "truth.nii", "p.exr", "ours.nii"]))
    b.append(cpu(["plastimatch", "fdk", "-I", "peer", "-O", "peer.mha", "-r", "256 256 256",
                  "-z", "320 320 320"]))
ratio = np.array(b) / np.array(a)
print("CPU seconds: %.2f ct-fdk (%s), %.2f plastimatch fdk, ratio %.1f [%.1f..%.1f]"
      % (np.median(a), os.environ.get("CTSR_CPU", "highest level"), np.median(b), np.median(ratio), ratio.min(), ratio.max()))

truth = np.asarray(nib.load("truth.nii").dataobj, float)
ours = np.asarray(nib.load("ours.nii").dataobj, float)
raw = open("peer.mha", "rb").read()
head, _, data = raw.partition(b"ElementDataFile = LOCAL\n")
kind = {b"MET_FLOAT": "<f4", b"MET_SHORT": "<i2"}[head.split(b"ElementType = ")[1].split()[0]]
peer = np.frombuffer(data, kind).reshape(256, 256, 256).transpose(2, 1, 0)[::-1, ::-1].astype(float)
i = (np.arange(256) - 127.5) * 1.25
seen = np.hypot(i[:, None, None], i[None, :, None]) < 150  # by every view
seen = np.broadcast_to(seen, truth.shape).copy()
seen[:, :, abs(i) > 90] = False
t, o, p = truth[seen], ours[seen], peer[seen]
fit = np.polyfit(p, t, 1)
rms = lambda d: float(np.sqrt(np.mean(d ** 2)))
print("error in HU: %.1f ct-fdk; %.1f plastimatch after the fit HU = %.4g x %+.4g (ours after its own "
      "fit %.1f)" % (rms(o - t), rms(np.polyval(fit, p) - t), fit[0], fit[1],
                     rms(np.polyval(np.polyfit(o, t, 1), o) - t)))
EOF
