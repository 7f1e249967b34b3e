#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the DICOM seeds of tests/fuzz/corpus/dicom.tar into a folder: one small synthetic picture in every
transfer syntax that pydicom and gdcmconv (Debian: libgdcm-tools) can write, deflated, and in archives.

  make-dicom.py FOLDER
"""
import gzip
import os
import subprocess
import sys
import tarfile
import zipfile

import numpy as np
from pydicom.dataset import FileDataset, FileMetaDataset
from pydicom import dcmread
from pydicom.uid import CTImageStorage, DeflatedExplicitVRLittleEndian, ExplicitVRLittleEndian

WAYS = {"rle": "--rle", "jpeg": "--jpeg", "jpegls": "--jpegls", "j2k": "--j2k"}


def write(path, bits, side=12):
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID = CTImageStorage
    meta.MediaStorageSOPInstanceUID = "1.2.3.4.5"
    meta.TransferSyntaxUID = ExplicitVRLittleEndian
    d = FileDataset(path, {}, file_meta=meta, preamble=b"\0" * 128)
    d.is_little_endian, d.is_implicit_VR = True, False
    d.SOPClassUID, d.SOPInstanceUID = CTImageStorage, "1.2.3.4.5"
    d.Modality, d.PatientID, d.SeriesInstanceUID = "CT", "synthetic", "1.2.3"
    d.FrameOfReferenceUID, d.StudyInstanceUID = "1.2.4", "1.2.5"
    d.SeriesNumber = d.InstanceNumber = 1
    d.Rows = d.Columns = side
    d.SamplesPerPixel, d.PhotometricInterpretation = 1, "MONOCHROME2"
    d.BitsAllocated, d.BitsStored, d.HighBit = (8, 8, 7) if bits == 8 else (16, bits, bits - 1)
    d.PixelRepresentation = int(bits == 16)
    d.PixelSpacing, d.ImagePositionPatient = [0.5, 0.75], [1, 2, 3]
    d.ImageOrientationPatient = [1, 0, 0, 0, 1, 0]
    d.RescaleSlope, d.RescaleIntercept = 1, -1024
    y, x = np.mgrid[:side, :side]
    d.PixelData = ((x * 13 + y * y * 7) % 251).astype("u1" if bits == 8 else "<u2").tobytes()
    d.save_as(path, write_like_original=False)


def pack(folder, plain):
    """Deflated, in gzip, zip and tar."""
    d = dcmread(plain)
    d.file_meta.TransferSyntaxUID = DeflatedExplicitVRLittleEndian
    d.save_as(os.path.join(folder, "deflated"), write_like_original=False)
    with open(plain, "rb") as f, open(os.path.join(folder, "gzip"), "wb") as g:
        g.write(gzip.compress(f.read(), mtime=0))
    with zipfile.ZipFile(os.path.join(folder, "zip"), "w", zipfile.ZIP_DEFLATED) as z:
        z.write(plain, "a/1.dcm")
        z.writestr("notes.txt", "hello")
    with tarfile.open(os.path.join(folder, "tar"), "w") as z:
        z.add(plain, "a/1.dcm")


def main(folder):
    os.makedirs(folder, exist_ok=True)
    for bits in (8, 12, 16):
        plain = os.path.join(folder, "plain-%d" % bits)
        write(plain, bits)
        for name, way in WAYS.items():
            out = os.path.join(folder, "%s-%d" % (name, bits))
            subprocess.run(["gdcmconv", way, plain, out], check=False, capture_output=True)
    pack(folder, os.path.join(folder, "plain-12"))


main(sys.argv[1])
