# SPDX-License-Identifier: Apache-2.0
"""Folders as clinics have them. make; check FOLDER-OF-TRUTH FILE: every voxel is where it was, in HU."""
import os
import sys

import nibabel as nib
import numpy as np
from dicom import COLUMNS, ROWS, place, value, write

N = 16
SECONDARY = "1.2.840.10008.5.1.4.1.1.7"
REPORT = "1.2.840.10008.5.1.4.1.1.88.11"


def series(folder, uid, n=N, **tags):
    for k in range(n):
        write("%s/%02d.dcm" % (folder, k), "axial", k, uid,
              **{"InstanceNumber": k + 1, **{t: v(k) if callable(v) else v for t, v in tags.items()}})


def make():
    series("ok", "1.2.1")
    series("other", "1.2.2", 3)
    write("report/sr.dcm", "axial", 0, "1.2.3", PixelData=None, SOPClassUID=REPORT)
    # a localizer, a dose page and a screen in colour under the UID of the series
    series("mixed", "1.2.1")
    write("mixed/scout.dcm", "sagittal", 0, "1.2.1", ImageType=["ORIGINAL", "PRIMARY", "LOCALIZER"])
    write("mixed/dose.dcm", "axial", 0, "1.2.1", SOPClassUID=SECONDARY, ImagePositionPatient=None)
    # exposure, acquisition and time of each slice are its own
    series("exposure", "1.2.4", Exposure=lambda k: 100 + k, AcquisitionNumber=lambda k: k + 1,
           AcquisitionTime=lambda k: "1200%02d" % k)
    # two phases at the same places; three that time alone tells apart; what nothing tells apart
    for phase in range(2):
        series("phases/%d" % phase, "1.2.5", AcquisitionNumber=phase + 2, SeriesDescription="phase",
               RescaleIntercept=100 * phase, RescaleSlope=1)
    for turn in range(3):
        series("times/%d" % turn, "1.2.6", AcquisitionTime=lambda k, t=turn: "12%02d%02d" % (10 * t, k),
               RescaleIntercept=100 * turn, RescaleSlope=1)
    for turn, time in enumerate(("25+0100", "75-0100")):
        series("zones/%d" % turn, "1.2.6", 3, RescaleIntercept=100 * turn, RescaleSlope=1,
               AcquisitionDateTime="20200101120027." + time)
    for turn in range(2):
        for key in "TemporalPositionIdentifier", "TemporalPositionIndex":
            series("%s/%d" % (key, turn), "1.2.12", 3, **{key: turn + 1})
    for turn in range(2):
        series("same/%d" % turn, "1.2.7", RescaleIntercept=100 * turn, RescaleSlope=1)
    # InstanceNumber leaves two out where no place is; more pictures were announced
    series("numbers", "1.2.8", InstanceNumber=lambda k: k + 1 + 2 * (k > 6))
    series("announced", "1.2.9", ImagesInAcquisition=20)
    # of the same places, another matrix
    series("matrices", "1.2.10", 8)
    write("matrices/8.dcm", "axial", 8, "1.2.10", Rows=5, PixelData=b"\0" * (2 * 5 * COLUMNS))


def check(path, n=N, base=0.0, wrong=()):
    """Slices `wrong` are not looked at."""
    image = nib.load(path)
    data = image.get_fdata()
    assert data.shape == (COLUMNS, ROWS, n), data.shape
    i, j, k = np.meshgrid(*map(np.arange, data.shape), indexing="ij")
    ras = np.stack([i, j, k], -1) @ image.affine[:3, :3].T + image.affine[:3, 3]
    want = value(ras * [-1, -1, 1])
    corner = place("axial", n - 1, ROWS - 1, COLUMNS - 1) * [-1, -1, 1]
    assert np.abs(ras[-1, -1, -1] - corner).max() < 1e-4, (ras[-1, -1, -1], corner)
    keep = [s for s in range(n) if s not in wrong]
    off = np.abs(data - want - base)[:, :, keep]
    assert off.max() <= 1 and np.mean(off != 0) < 0.01, off.max()


if sys.argv[1] == "make":
    make()
else:
    check(sys.argv[2], *map(int, sys.argv[3:5]), wrong=[int(s) for s in sys.argv[5:]])
