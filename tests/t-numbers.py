# SPDX-License-Identifier: Apache-2.0
"""Series in which one text that should be a number is none. s: a good one. bad TAG VR TEXT FOLDER [K]: with the text (in
Python's escapes) in all slices, or in slice K alone. group TAG TEXT FILE: one file of all, TAG in its functional groups."""
import os
import sys

import numpy as np
from dicom import COLUMNS, ROWS, write
from pydicom import dcmread
from pydicom.dataelem import RawDataElement
from pydicom.dataset import Dataset
from pydicom.sequence import Sequence
from pydicom.tag import Tag

N = 4


def put(d, keyword, vr, text):
    tag, value = Tag(keyword), text.encode("latin1").decode("unicode_escape").encode("latin1")
    value += b" " * (len(value) % 2)
    d[tag] = RawDataElement(tag, vr, len(value), value, 0, False, True)


def series(folder, keyword=None, vr=None, text=None, which=None):
    for k in range(N):
        path = "%s/%02d.dcm" % (folder, k)
        write(path, "axial", k, "1.7.1", scale=(1, -1024))
        if keyword and which in (None, k):
            d = dcmread(path)
            put(d, keyword, vr, text)
            d.save_as(path, write_like_original=False)


def group(keyword, text, path):
    series("g")
    slices = [dcmread("g/%02d.dcm" % k) for k in range(N)]
    d, shared, frames = slices[0], Dataset(), []
    first = [s.ImagePositionPatient for s in slices]
    for t in ("ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing", "SliceThickness", "RescaleSlope",
              "RescaleIntercept"):
        delattr(d, t)
    d.SOPClassUID = d.file_meta.MediaStorageSOPClassUID = "1.2.840.10008.5.1.4.1.1.2.1"
    d.NumberOfFrames, d.ImageType = N, ["ORIGINAL", "PRIMARY", "VOLUME", "NONE"]

    def item(of, name, **tags):
        one = Dataset()
        for key, v in tags.items():
            setattr(one, key, v)
            if key == keyword:
                put(one, key, "DS", text)
        setattr(of, name, Sequence([one]))

    item(shared, "PixelMeasuresSequence", PixelSpacing=[0.75, 0.5], SliceThickness=9.0)
    item(shared, "PlaneOrientationSequence", ImageOrientationPatient=[1, 0, 0, 0, 1, 0])
    item(shared, "PixelValueTransformationSequence", RescaleSlope=1, RescaleIntercept=-1024, RescaleType="HU")
    for k in range(N):
        f = Dataset()
        item(f, "PlanePositionSequence", ImagePositionPatient=first[k])
        frames.append(f)
    d.SharedFunctionalGroupsSequence, d.PerFrameFunctionalGroupsSequence = Sequence([shared]), Sequence(frames)
    d.PixelData = np.zeros((N, ROWS, COLUMNS), "<i2").tobytes()
    os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
    d.save_as(path, write_like_original=False)


def padding(folder):
    """Signed values, of which the lowest is padding, which the header says without a sign."""
    series(folder, "PixelPaddingValue", "US", "\\x00\\x80")
    for k in range(N):
        path = "%s/%02d.dcm" % (folder, k)
        d = dcmread(path)
        d.PixelData = b"\x00\x80" * 7 + d.PixelData[14:]
        d.save_as(path, write_like_original=False)


if sys.argv[1] == "s":
    series("s")
elif sys.argv[1] == "padding":
    padding(sys.argv[2])
elif sys.argv[1] == "bad":
    series(sys.argv[5], *sys.argv[2:5], int(sys.argv[6]) if len(sys.argv) > 6 else None)
else:
    group(*sys.argv[2:])
