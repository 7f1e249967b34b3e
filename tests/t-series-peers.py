# SPDX-License-Identifier: Apache-2.0
"""Clean series, as pydicom and dcm2niix read them. make; check FILE FOLDER ...: voxels and affine are those of the
slices as pydicom reads them; same FILE FILE ...: two volumes are one, whatever the order of their axes. Prints a
line for each pair."""
import glob
import os
import sys

import nibabel as nib
import numpy as np
import pydicom
from dicom import AXES, SLICES, write
from pydicom.uid import generate_uid

HEAD = {"PatientName": "P", "StudyDate": "20200101", "StudyTime": "120000", "StudyID": "1",
        "ImageType": ["ORIGINAL", "PRIMARY", "AXIAL"]}


def recode(of, name, change):
    """The series `of` as its slices are after change(dataset, stored numbers)."""
    os.makedirs(name)
    for path in sorted(glob.glob(of + "/*")):
        d = pydicom.dcmread(path)
        stored = d.pixel_array.astype(np.int64)
        d.SeriesInstanceUID = generate_uid(entropy_srcs=[name])
        d.SOPInstanceUID = d.file_meta.MediaStorageSOPInstanceUID = generate_uid()
        d.PixelData = change(d, stored)
        d.save_as("%s/%s" % (name, os.path.basename(path)), write_like_original=False)


def unsigned(d, x):
    d.PixelRepresentation, d.RescaleIntercept = 0, d.RescaleIntercept - 2000
    return (x + 2000).astype("<u2").tobytes()


def twelve(above):
    """12 bits with a sign, and what is to stand in the 4 above them."""
    def change(d, x):
        d.BitsStored, d.HighBit = 12, 11
        return ((x & 0xfff) | above(x)).astype("<u2").tobytes()
    return change


def twelve_unsigned(d, x):
    d.PixelRepresentation, d.BitsStored, d.HighBit, d.RescaleIntercept = 0, 12, 11, d.RescaleIntercept - 2000
    return (x + 2000).astype("<u2").tobytes()


def eight(d, x):
    d.PixelRepresentation, d.BitsAllocated, d.BitsStored, d.HighBit = 0, 8, 8, 7
    d.RescaleSlope, d.RescaleIntercept = 2, d.RescaleIntercept - 256
    d["PixelData"].VR = "OB"
    return ((x + 256) // 2).astype("u1").tobytes()


def thirty_two(d, x):
    d.BitsAllocated, d.BitsStored, d.HighBit, d.RescaleSlope = 32, 32, 31, 0.5
    d.RescaleIntercept -= 1 << 20
    return (2 * x + (1 << 21)).astype("<i4").tobytes()


def make():
    for name in AXES:
        for k in range(SLICES):
            write("%s/%02d.dcm" % (name, k), name, k, "1.9.1", scale=(1, -300), **HEAD)
    for k in range(SLICES):
        write("each/%02d.dcm" % k, "axial", k, "1.9.2", **HEAD)
    recode("axial", "u16", unsigned)
    recode("axial", "u12", twelve_unsigned)
    recode("axial", "s12", twelve(lambda x: x & 0xf000))
    recode("axial", "s12-bare", twelve(lambda x: 0))
    recode("axial", "s12-overlay", twelve(lambda x: 0x5000))
    recode("axial", "u8", eight)
    recode("axial", "i32", thirty_two)


def check(path, folder):
    """Every pixel of every slice, at the place that its header gives it."""
    image = nib.load(path)
    data, back = image.get_fdata(), np.linalg.inv(image.affine)
    files = glob.glob(folder + "/*")
    for f in files:
        d = pydicom.dcmread(f)
        x = d.pixel_array.astype(np.int64)
        if d.PixelRepresentation and d.BitsStored < d.BitsAllocated:  # the bits that count
            x &= (1 << d.BitsStored) - 1
            x -= (x >> d.BitsStored - 1) << d.BitsStored
        want = x * float(d.RescaleSlope) + float(d.RescaleIntercept)
        along = np.array(d.ImageOrientationPatient, float).reshape(2, 3)
        j, i = np.meshgrid(np.arange(d.Rows), np.arange(d.Columns), indexing="ij")
        lps = (np.array(d.ImagePositionPatient, float) + np.multiply.outer(i, along[0]) * float(d.PixelSpacing[1])
               + np.multiply.outer(j, along[1]) * float(d.PixelSpacing[0]))
        at = (lps * [-1, -1, 1]) @ back[:3, :3].T + back[:3, 3]
        n = np.rint(at).astype(int)
        assert np.abs(at - n).max() < 1e-4, np.abs(at - n).max()
        off = np.abs(data[n[..., 0], n[..., 1], n[..., 2]] - want).max()
        assert off < 1e-3 * abs(float(d.RescaleSlope)) + 1e-9, (f, off)
    assert data.size == len(files) * x.size


def same(path, other):
    a, b = nib.load(path), nib.load(other)
    turn = np.linalg.inv(a.affine) @ b.affine  # voxels of b to those of a
    whole = np.rint(turn)
    assert np.abs(turn - whole).max() < 2e-4, turn
    assert (np.abs(whole[:3, :3]).sum(0) == 1).all() and (np.abs(whole[:3, :3]).sum(1) == 1).all()
    n = np.stack(np.meshgrid(*map(np.arange, b.shape), indexing="ij"), -1) @ whole[:3, :3].T + whole[:3, 3]
    n = n.astype(int)
    assert (n >= 0).all() and (n < a.shape).all() and a.get_fdata().size == b.get_fdata().size
    off = np.abs(a.get_fdata()[n[..., 0], n[..., 1], n[..., 2]] - b.get_fdata()).max()
    assert off < 1e-3, off


def pairs(test, names):
    bad = 0
    for a, b in zip(names[::2], names[1::2]):
        try:
            test(a, b)
            print("%s and %s agree" % (a, b))
        except (AssertionError, OSError) as x:
            print("%s and %s do not agree: %s" % (a, b, x))
            bad = 1
    sys.exit(bad)


if sys.argv[1] == "make":
    make()
else:
    pairs({"check": check, "same": same}[sys.argv[1]], sys.argv[2:])
