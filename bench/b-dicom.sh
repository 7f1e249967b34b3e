#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# b-dicom.sh: CPU seconds, seconds and peak memory (of the largest process) of ct-convert, dcm2niix and dicomtonifti
# (Debian: vtk-dicom-tools), DICOM to NIfTI that is not compressed, in turn, A B C A B C: 95 slices of 512x512
# numbers of 16 bits, as they are and compressed by gdcmconv, and the ratio to the faster of the others.
# The volume is 50 MB as it is stored, which dcm2niix holds, and 100 MB as floats, which dicomtonifti holds.
set -e
for PY in python3 /usr/bin/python3; do "$PY" -c 'import numpy, pydicom' 2>/dev/null && break; PY=; done
[ -n "$PY" ] && [ -x /usr/bin/time ] || { echo 'b-dicom.sh: skipped: no pydicom or time'; exit 0; }
for c in dcm2niix dicomtonifti; do
	command -v $c >/dev/null || echo "b-dicom.sh: without $c, which is not here"
done
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
cd "$dir"
"$PY" - <<'EOP'
import os, shutil, subprocess, time
import numpy as np
from pydicom.dataset import FileDataset, FileMetaDataset
from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian, generate_uid

N, SIDE = 95, 512
rng = np.random.default_rng(1)
j, i = np.mgrid[:SIDE, :SIDE]
body, soft = np.hypot(i - 256, (j - 256) * 1.3) < 220, np.hypot(i - 256, (j - 256) * 1.3) < 150
os.mkdir("plain")
for k in range(N):
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID = CTImageStorage, generate_uid()
    meta.TransferSyntaxUID = ExplicitVRLittleEndian
    d = FileDataset("", {}, file_meta=meta, preamble=b"\0" * 128)
    d.is_little_endian, d.is_implicit_VR = True, False
    d.SOPClassUID, d.SOPInstanceUID = CTImageStorage, meta.MediaStorageSOPInstanceUID
    d.Modality, d.PatientID, d.PatientName, d.SeriesDescription = "CT", "P", "P", "bench"
    d.StudyInstanceUID, d.SeriesInstanceUID, d.FrameOfReferenceUID = "1.2.3", "1.2.3.4", "1.2.3.5"
    d.StudyDate, d.StudyTime, d.StudyID, d.SeriesNumber, d.InstanceNumber = "20200101", "120000", "1", 1, k + 1
    d.ImageType = ["ORIGINAL", "PRIMARY", "AXIAL"]
    d.Rows = d.Columns = SIDE
    d.SamplesPerPixel, d.PhotometricInterpretation = 1, "MONOCHROME2"
    d.BitsAllocated = d.BitsStored = 16
    d.HighBit, d.PixelRepresentation, d.RescaleSlope, d.RescaleIntercept = 15, 1, 1, 0
    d.PixelSpacing, d.SliceThickness = [0.7, 0.7], 1.5
    d.ImageOrientationPatient, d.ImagePositionPatient = [1, 0, 0, 0, 1, 0], [-179, -179, 1.5 * k]
    hu = np.where(body, 40 + 200 * np.sin(i / 17 + k / 9) * np.cos(j / 23) * soft, -1000)
    d.PixelData = np.rint(hu + rng.normal(0, 12, hu.shape)).astype("<i2").tobytes()
    d.save_as("plain/%03d.dcm" % k, write_like_original=False)

def run(cmd):
    for f in os.listdir("."):
        if f.endswith((".nii", ".json")):
            os.remove(f)
    t = time.monotonic()
    p = subprocess.Popen(["/usr/bin/time", "-o", "kib", "-f", "%M"] + cmd, stdout=subprocess.DEVNULL,
                         stderr=subprocess.DEVNULL)  # whose memory is not that of this process
    _, status, used = os.wait4(p.pid, 0)
    assert status == 0, cmd
    return used.ru_utime + used.ru_stime, time.monotonic() - t, int(open("kib").read()) / 1024

tools = {"ct-convert": lambda s: ["ct-convert", s, "o.nii"],
         "dcm2niix": lambda s: ["dcm2niix", "-z", "n", "-f", "o", "-o", ".", s],
         "dicomtonifti": lambda s: ["dicomtonifti", "-o", "o.nii", s]}
tools = {t: c for t, c in tools.items() if shutil.which(t)}
ways = {"plain": None, "JPEG lossless": "--jpeg", "RLE": "--rle", "JPEG 2000": "--j2k"}
for name, way in ways.items():
    if way and not shutil.which("gdcmconv"):
        continue
    folder = "plain"
    if way:
        folder = way.strip("-")
        os.mkdir(folder)
        for f in os.listdir("plain"):
            subprocess.run(["gdcmconv", way, "plain/" + f, folder + "/" + f], check=True, stderr=subprocess.DEVNULL)
    got = {t: [] for t in tools}
    for turn in range(int(os.environ.get("ROUNDS", "5"))):
        for t, c in tools.items():
            got[t].append(run(c(folder)))
    for t in tools:
        m = np.median(got[t], axis=0)
        print("%-14s %-13s %6.3f CPU s %6.3f s %5.0f MB" % (name, t, m[0], m[1], m[2]), end="")
        if t != "ct-convert" or len(tools) == 1:
            print()
            continue
        others = [np.array(v)[:, :2] for o, v in got.items() if o != t]
        ratio = np.array(got[t])[:, :2] / np.min([np.median(o, axis=0) for o in others], axis=0)
        print("; of the fastest: %.2f [%.2f..%.2f] of its CPU s, %.2f [%.2f..%.2f] of its s" % (
            *(f(ratio[:, 0]) for f in (np.median, np.min, np.max)), *(f(ratio[:, 1]) for f in (np.median, np.min, np.max))))
EOP
