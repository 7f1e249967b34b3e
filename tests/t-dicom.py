"""Small DICOM series with an asymmetric mark, and a check of what was read from them."""
import os
import sys

import numpy as np
from pydicom import dcmread
from pydicom.dataset import FileDataset, FileMetaDataset
from pydicom.encaps import encapsulate
from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian, RLELossless, generate_uid

COLUMNS, ROWS, SLICES = 12, 10, 9
GAP, PITCH = 2.5, (0.75, 0.5)  # PixelSpacing: between rows, between columns
ORIGIN = np.array([-40.0, 25.0, 130.0])
t = np.radians(20)
AXES = {
    "axial": ((1, 0, 0), (0, 1, 0)),
    "las": ((-1, 0, 0), (0, 1, 0)),
    "sagittal": ((0, 1, 0), (0, 0, -1)),
    "coronal": ((1, 0, 0), (0, 0, -1)),
    "oblique": ((0.8, 0.6, 0), (-0.36, 0.48, 0.8)),
}


def axes(name):
    across, down = AXES.get(name, AXES["axial"])
    return np.array(across, float), np.array(down, float)


def value(lps):
    """HU at a place in the patient: no symmetry hides a flip."""
    x, y, z = np.moveaxis(np.asarray(lps), -1, 0)
    return np.rint(3 * x + 7 * y + 2 * z + 0.05 * (x + 40) * (z - 130)) - 100


def place(name, k, j, i):
    across, down = axes(name)
    normal = np.cross(across, down)
    return (ORIGIN + np.multiply.outer(i, across) * PITCH[1] + np.multiply.outer(j, down) * PITCH[0]
            + np.multiply.outer(k, normal) * GAP)


def write(path, name, k, series, position=None, **tags):
    across, down = axes(name)
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID = CTImageStorage
    meta.MediaStorageSOPInstanceUID = generate_uid()
    meta.TransferSyntaxUID = ExplicitVRLittleEndian
    d = FileDataset(path, {}, file_meta=meta, preamble=b"\0" * 128)
    d.is_little_endian, d.is_implicit_VR = True, False
    d.SOPClassUID, d.SOPInstanceUID = CTImageStorage, meta.MediaStorageSOPInstanceUID
    d.Modality, d.PatientID, d.SeriesDescription = "CT", "P", "synthetic"
    d.StudyInstanceUID, d.SeriesInstanceUID, d.FrameOfReferenceUID = "1.2.3", series, "1.2.3.9"
    d.SeriesNumber, d.InstanceNumber = int(series.split(".")[-1]), 50 - 3 * k
    d.Rows, d.Columns, d.SamplesPerPixel = ROWS, COLUMNS, 1
    d.PhotometricInterpretation = "MONOCHROME2"
    d.BitsAllocated, d.BitsStored, d.HighBit, d.PixelRepresentation = 16, 16, 15, 1
    d.PixelSpacing, d.SliceThickness = list(PITCH), 9.0  # a thickness that misleads
    d.ImageOrientationPatient = ["%.10g" % v for v in (*across, *down)]
    j, i = np.meshgrid(np.arange(ROWS), np.arange(COLUMNS), indexing="ij")
    first = place(name, k, 0, 0) if position is None else position
    d.ImagePositionPatient = ["%.10g" % v for v in first]
    # every slice has a scale of its own
    d.RescaleSlope, d.RescaleIntercept = (1, -1024) if k % 2 else (0.5, -k)
    hu = value(place(name, k, j, i))
    stored = np.rint((hu - float(d.RescaleIntercept)) / float(d.RescaleSlope)).astype("<i2")
    if name == "padded":
        d.add_new(0x00280120, "US", 65536 - 2000)  # the other sign's VR, as scanners do
        stored[0, :] = -2000
    d.PixelData = stored.tobytes()
    for key, v in tags.items():
        if v is None:
            delattr(d, key)
        else:
            setattr(d, key, v)
    os.makedirs(os.path.dirname(path), exist_ok=True)
    d.save_as(path, write_like_original=False)


def bomb(path, k):
    """A picture that says it is large, in RLE: 9 of them are a gigabyte."""
    write(path, "axial", k, "1.2.3.18", Rows=8000, Columns=8000)
    d = dcmread(path)
    d.file_meta.TransferSyntaxUID = RLELossless
    d.PixelData = encapsulate([b"\2" + b"\0" * 3 + b"\x40" + b"\0" * 3 + b"\x80" + b"\0" * 55 + b"\x81\0" * 64])
    d["PixelData"].VR, d["PixelData"].is_undefined_length = "OB", True
    d.save_as(path, write_like_original=False)


def make():
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
        write("norescale/%d.dcm" % k, "axial", k, "1.2.3.15", RescaleSlope=None)
        bomb("bomb/%d.dcm" % k, k)
    write("twice/again.dcm", "axial", 3, "1.2.3.10")
    write("matrices/8.dcm", "axial", 8, "1.2.3.12", Rows=5, PixelData=b"\0" * (2 * 5 * COLUMNS))
    with open("cutoff/4.dcm", "r+b") as f:
        f.truncate(os.path.getsize("cutoff/4.dcm") - 100)
    write("nopicture/x.dcm", "axial", 0, "1.2.3.16", PixelData=None)
    with open("axial/notes.txt", "w") as f:
        f.write("not DICOM\n")


def check(name, path):
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


if sys.argv[1] == "make":
    make()
else:
    check(*sys.argv[2:4])
