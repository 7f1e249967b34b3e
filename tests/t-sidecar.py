# SPDX-License-Identifier: Apache-2.0
"""Series for t-sidecar.sh, and what their sidecars must say: t-sidecar.py make | trace FOLDER OUT JSON | peer A B"""
import json
import os
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
TAGS = dict(PatientName="DOERING^JANE", PatientID="SECRET77", PatientBirthDate="19600203", StudyDate="20200102",
            Manufacturer="ACME Med", ManufacturerModelName="CT-9", ConvolutionKernel="B30f", KVP="120",
            SpacingBetweenSlices="2.5", GantryDetectorTilt="0", ReconstructionDiameter="350", PatientPosition="HFS",
            ImageType=["ORIGINAL", "PRIMARY", "AXIAL"], AccessionNumber="ACC1", InstitutionName="Hosp",
            ProtocolName="for Jane", OperatorsName="OP", StudyID="S1", ReferringPhysicianName="REF")


def make():
    import dicom
    for k in range(dicom.SLICES):
        dicom.write(f"even/IM{k}", "axial", k, "1.2.7", **TAGS)
        at = dicom.place("axial", k, 0, 0)
        at[2] += (0, .9, -.7, .3)[k % 4]
        dicom.write(f"uneven/IM{k}", "axial", k, "1.2.8", position=at, **TAGS)
        dicom.write(f"named/{'doering' if k % 2 else 'x-SECRET77'}-{k}.dcm", "axial", k, "1.2.9", **TAGS)


def trace(folder, out, name):
    """Each plane is what its slices say, by their weights."""
    import nibabel
    import pydicom
    image, side = nibabel.load(out), json.load(open(name))
    planes = np.zeros(image.shape)
    weights = np.zeros(image.shape[2])
    for s in side["SourceSlices"]:
        d = pydicom.dcmread(os.path.join(folder, s["File"]))
        hu = d.pixel_array * float(d.RescaleSlope) + float(d.RescaleIntercept)
        assert s["InstanceNumber"] == d.InstanceNumber
        first = np.array(d.ImagePositionPatient, float)
        middle = first + [(d.Columns - 1) / 2 * d.PixelSpacing[1], (d.Rows - 1) / 2 * d.PixelSpacing[0], 0]
        assert np.allclose(s["Position"], middle * [-1, -1, 1], atol=1e-6), (s, middle)
        for plane, weight in zip(s["Planes"], s["Weights"], strict=True):
            planes[:, :, plane] += weight * hu.T
            weights[plane] += weight
    assert np.allclose(weights, 1), weights
    far = np.abs(planes - image.get_fdata()).max()
    assert far < 2e-3, far
    assert side["SourceGrid"]["Size"] == list(image.shape)
    assert np.allclose(side["SourceGrid"]["Affine"], image.affine[:3], atol=1e-4)
    print(len(side["SourceSlices"]), image.shape[2])


def peer(ours, theirs):
    a, b = json.load(open(ours)), json.load(open(theirs))
    common = [k for k in a if k in b and not k.startswith("ConversionSoftware")]
    for k in common:
        assert a[k] == b[k], (k, a[k], b[k])
    assert len(common) >= 6, common
    print(*common)


if __name__ == "__main__":
    globals()[sys.argv[1]](*sys.argv[2:])
