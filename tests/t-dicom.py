# SPDX-License-Identifier: Apache-2.0
"""Small DICOM series with an asymmetric mark, and a check of what was read from them: t-dicom.py FUNCTION ARGUMENT..."""
import os
import re
import sys

import dicom
import numpy as np
from dicom import AXES, COLUMNS, ORIGIN, ROWS, SLICES, t, value, write
from pydicom import dcmread
from pydicom.encaps import encapsulate
from pydicom.uid import RLELossless


def bomb(path, k):
    """A picture that says it is large, in RLE: 9 of them are a gigabyte."""
    write(path, "axial", k, "1.2.3.18", Rows=8000, Columns=8000)
    d = dcmread(path)
    d.file_meta.TransferSyntaxUID = RLELossless
    d.PixelData = encapsulate([b"\2" + b"\0" * 3 + b"\x40" + b"\0" * 3 + b"\x80" + b"\0" * 55 + b"\x81\0" * 64])
    d["PixelData"].VR, d["PixelData"].is_undefined_length = "OB", True
    d.save_as(path, write_like_original=False)


def short_run(path, to):
    """One slice in RLE whose second segment, the lower bytes, ends early: the end marks are right."""
    d = dcmread(path)
    high, low = (bytes(v) for v in np.frombuffer(d.PixelData, ">u2").view("u1").reshape(-1, 2)[:, ::-1].T)
    code = lambda b: b"".join(bytes([len(c) - 1]) + c for c in (b[i:i + 128] for i in range(0, len(b), 128)))
    first, second = code(high), code(low[:-30])
    head = np.array([2, 64, 64 + len(first)] + 13 * [0], "<u4").tobytes()
    d.file_meta.TransferSyntaxUID = RLELossless
    d.PixelData = encapsulate([head + first + second])
    d["PixelData"].VR, d["PixelData"].is_undefined_length = "OB", True
    d.save_as(to, write_like_original=False)


def make_series():
    for name in (*AXES, "reversed", "padded"):
        for k in range(SLICES):
            at = SLICES - k if name == "reversed" else (5 * k) % SLICES
            write("%s/%02d.dcm" % (name, at), name, k, "1.2.3.4")
    for k in range(SLICES):
        write("two/a%d.dcm" % k, "axial", k, "1.2.3.5")
        write("two/below/b%d.dcm" % k, "sagittal", k, "1.2.3.6")
        if k not in (4, 5):
            write("missing/%d.dcm" % k, "axial", k, "1.2.3.7")
        write("uneven/%d.dcm" % k, "axial", k, "1.2.3.8", ORIGIN + [0, 0, 0.3 * k * k + k])
        write("tilted/%d.dcm" % k, "axial", k, "1.2.3.9", ORIGIN + np.array([0, np.sin(t), np.cos(t)]) * 2.5 * k)
        write("twice/%d.dcm" % k, "axial", k, "1.2.3.10")
        write("patients/%d.dcm" % k, "axial", k, "1.2.3.11", PatientID="PQ"[k // 5])
        write("matrices/%d.dcm" % k, "axial", k, "1.2.3.12")
        write("frames/%d.dcm" % k, "axial", k, "1.2.3.17", FrameOfReferenceUID="1.2.3.9.%d" % (k // 8))
        write("mr/%d.dcm" % k, "axial", k, "1.2.3.13", Modality="MR")
        write("cutoff/%d.dcm" % k, "axial", k, "1.2.3.14")
        write("shortrun/%d.dcm" % k, "axial", k, "1.2.3.19")
        write("syntax/%d.dcm" % k, "axial", k, "1.2.3.20")
        write("norescale/%d.dcm" % k, "axial", k, "1.2.3.15", RescaleSlope=None)
        bomb("bomb/%d.dcm" % k, k)
    write("twice/again.dcm", "axial", 3, "1.2.3.10")
    write("matrices/8.dcm", "axial", 8, "1.2.3.12", Rows=5, PixelData=b"\0" * (2 * 5 * COLUMNS))
    with open("cutoff/4.dcm", "r+b") as f:
        f.truncate(os.path.getsize("cutoff/4.dcm") - 100)
    short_run("shortrun/4.dcm", "shortrun/4.dcm")
    d = dcmread("syntax/4.dcm")
    d.file_meta.TransferSyntaxUID = "1.2.840.10008.1.2.4.58"
    d.PixelData = encapsulate([d.PixelData])
    d["PixelData"].VR, d["PixelData"].is_undefined_length = "OB", True
    d.save_as("syntax/4.dcm", write_like_original=False)
    write("nopicture/x.dcm", "axial", 0, "1.2.3.16", PixelData=None)
    with open("axial/notes.txt", "w") as f:
        f.write("not DICOM\n")


def check_series(name, path):
    import nibabel as nib

    image = nib.load(path)
    data = image.get_fdata()
    assert data.shape == (COLUMNS, ROWS, SLICES), data.shape
    i, j, k = np.meshgrid(*map(np.arange, data.shape), indexing="ij")
    ras = np.stack([i, j, k], -1) @ image.affine[:3, :3].T + image.affine[:3, 3]
    want = value(ras * [-1, -1, 1])
    if name == "padded":
        assert np.all(data[:, 0, :] == -1024)
        data, want = data[:, 1:, :], want[:, 1:, :]
    # rint of value() may fall either way on the last digit of a float32 affine
    assert np.abs(data - want).max() <= 1 and np.mean(data != want) < 0.01, np.abs(data - want).max()


def make_planes():
    """Series of whole numbers, of numbers too large for int16, of halves, one with a slice that is not read, and one of
    160x160x200."""
    series = {"whole": (1, -1024), "far": (300, 0), "half": (0.5, 0), "broken": (1, 0)}
    for name, (slope, intercept) in series.items():
        for k in range(dicom.SLICES):
            dicom.write("%s/%d.dcm" % (name, k), "axial", k, "1.2.3.7", scale=(1, 0), RescaleSlope=slope,
                        RescaleIntercept=intercept)
    b = open("broken/4.dcm", "rb").read()
    open("broken/4.dcm", "wb").write(b.replace(b"1.2.840.10008.1.2.1\0", b"1.2.840.10008.1.2.9\0"))
    dicom.ROWS = dicom.COLUMNS = 160
    for k in range(200):
        dicom.write("large/%03d.dcm" % k, "axial", k, "1.2.3.8", scale=(1, 0))


def parts(path):
    import nibabel as nib

    image = nib.load(path)
    head = image.header
    known = b"".join(x.get_content() for x in head.extensions)
    known = re.sub(rb'"ct:history": ?"ct-convert [^"]* # ', b"", known)
    return image.dataobj.get_unscaled().tobytes(), head["datatype"], image.affine.tolist(), head["qform_code"], known


def same(path, other):
    """Two NIfTI files say the same but for their history."""
    sys.exit(parts(path) != parts(other))


def type_of(path, code):
    sys.exit(int(parts(path)[1]) != int(code))


if __name__ == "__main__":
    globals()[sys.argv[1]](*sys.argv[2:])
