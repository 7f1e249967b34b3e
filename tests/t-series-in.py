# SPDX-License-Identifier: Apache-2.0
"""Ways in which one series comes. make; check FILE FILE...: the first is what the others must be."""
import copy
import os
import sys

import nibabel as nib
import numpy as np
import pydicom
from dicom import PITCH, write
from pydicom.dataset import Dataset
from pydicom.sequence import Sequence

N = 9


def headless():
    os.makedirs("headless", exist_ok=True)
    for k in range(N):
        d = pydicom.dcmread("s/%02d.dcm" % k)
        d.is_little_endian = d.is_implicit_VR = True
        d.preamble = None
        del d.file_meta
        d.save_as("headless/IM%02d" % k, write_like_original=True)


def group(f, name, **tags):
    item = Dataset()
    for key, v in tags.items():
        setattr(item, key, v)
    setattr(f, name, Sequence([item]))


def enhanced(path, order):
    d = copy.deepcopy(pydicom.dcmread("s/00.dcm"))
    for t in ("ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing", "SliceThickness", "RescaleSlope",
              "RescaleIntercept"):
        delattr(d, t)
    d.SOPClassUID = d.file_meta.MediaStorageSOPClassUID = "1.2.840.10008.5.1.4.1.1.2.1"
    d.NumberOfFrames, d.ImageType = len(order), ["ORIGINAL", "PRIMARY", "VOLUME", "NONE"]
    shared, frames, pixels = Dataset(), [], b""
    group(shared, "PixelMeasuresSequence", PixelSpacing=list(PITCH), SliceThickness=9.0)
    group(shared, "PlaneOrientationSequence", ImageOrientationPatient=[1, 0, 0, 0, 1, 0])
    for k in order:
        s, f = pydicom.dcmread("s/%02d.dcm" % k), Dataset()
        group(f, "PlanePositionSequence", ImagePositionPatient=s.ImagePositionPatient)
        group(f, "PixelValueTransformationSequence", RescaleSlope=s.RescaleSlope,
              RescaleIntercept=s.RescaleIntercept, RescaleType="HU")
        group(f, "CTImageFrameTypeSequence", FrameType=d.ImageType)
        group(f, "FrameContentSequence", InStackPositionNumber=k + 1, StackID="1")
        frames.append(f)
        pixels += s.PixelData
    d.SharedFunctionalGroupsSequence = Sequence([shared])
    d.PerFrameFunctionalGroupsSequence = Sequence(frames)
    d.PixelData = pixels
    os.makedirs(os.path.dirname(path), exist_ok=True)
    d.save_as(path, write_like_original=False)


def make():
    for k in range(N):
        write("s/%02d.dcm" % k, "axial", k, "1.5.1", PatientName="P", StudyDate="20200101", StudyTime="120000",
              StudyID="1", ImageType=["ORIGINAL", "PRIMARY", "AXIAL"])
    headless()
    enhanced("enhanced/e.dcm", [(5 * k) % N for k in range(N)])


def check(first, *others):
    want = nib.load(first)
    for path in others:
        image = nib.load(path)
        assert image.shape == want.shape, (path, image.shape)
        assert np.array_equal(image.get_fdata(), want.get_fdata()), path
        assert np.array_equal(image.affine, want.affine), path


if sys.argv[1] == "make":
    make()
else:
    check(*sys.argv[2:])
