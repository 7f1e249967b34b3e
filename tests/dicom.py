# SPDX-License-Identifier: Apache-2.0
"""Small DICOM series with an asymmetric mark: what stands at a place in the patient is value(place)."""
import os

import numpy as np
from pydicom.dataset import FileDataset, FileMetaDataset
from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian, generate_uid

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
    "feet": ((-1, 0, 0), (0, 1, 0)),  # feet first, supine
    "prone": ((-1, 0, 0), (0, -1, 0)),
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


def write(path, name, k, series, position=None, at=None, scale=None, **tags):
    """Slice k; its values are those of place(name, k, ...), or of at(j, i); every slice has a scale of its own, or
    `scale`."""
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
    d.RescaleSlope, d.RescaleIntercept = scale or ((1, -1024) if k % 2 else (0.5, -k))
    hu = value(at(j, i) if at else place(name, k, j, i))
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
