# SPDX-License-Identifier: Apache-2.0
"""What ct-convert writes as DICOM and in sidecars, read by pydicom; and a series with everything that identifies."""
import glob
import json
import os
import sys

import nibabel
import numpy as np
import pydicom

import dicom

LPS = np.diag([-1.0, -1.0, 1.0, 1.0])
# Whatever of these is found in a file tells who the patient is.
WHO = dict(
    PatientName="Secret^Patricia", PatientID="SECRET-ID-77", IssuerOfPatientID="SECRETISSUER",
    PatientBirthDate="19330303", PatientAge="087Y", PatientWeight="77.7", PatientSize="1.77",
    OtherPatientNames="Other^Name", PatientComments="SECRETCOMMENT", EthnicGroup="SECRETETHNIC",
    PatientAddress="SECRETSTREET", StudyDate="20010203", StudyTime="111213.5", SeriesDate="20010204",
    SeriesTime="121314.5", AcquisitionDate="20010205", AcquisitionTime="131415.5",
    ContentDate="20010206", ContentTime="141516.5", AccessionNumber="ACC4711",
    ReferringPhysicianName="R\u00e9f^Doctor", PerformingPhysicianName="Perf^Doctor",
    OperatorsName="Op^Erator", StudyID="STUDY4712", StudyDescription="SECRETSTUDY",
    SeriesDescription="SECRETSERIES", ProtocolName="SECRETPROTOCOL", InstitutionName="SECRETHOSPITAL",
    InstitutionAddress="SECRETTOWN", StationName="STATION77", DeviceSerialNumber="SERIAL77",
    ContrastBolusAgent="SECRETAGENT", PositionReferenceIndicator="SECRETPLACE",
    IrradiationEventUID="1.2.840.4711.4", StudyInstanceUID="1.2.840.4711.1",
    FrameOfReferenceUID="1.2.840.4711.2", SeriesInstanceUID="1.2.840.4711.3",
    RequestedProcedureDescription="SECRETREQUEST", ImageComments="SECRETIMAGE")
# Kept in any case.
NOBODY = dict(
    BodyPartExamined="CHEST", PatientPosition="HFS", KVP="120", ConvolutionKernel="SOFT7",
    FilterType="BODY", Manufacturer="Maker", ManufacturerModelName="Model 7", SoftwareVersions="v7",
    WindowCenter="35", WindowWidth="350", AcquisitionNumber="4")
# Out of date, or of one slice.
STALE = dict(SmallestImagePixelValue=-77, LargestImagePixelValue=77, GantryDetectorTilt="1", TableHeight="133")
KEPT = ["PatientName", "PatientID", "IssuerOfPatientID", "PatientBirthDate", "PatientAge", "PatientWeight",
        "PatientSize", "StudyDate", "StudyTime", "AccessionNumber", "ReferringPhysicianName", "StudyID",
        "StudyDescription", "ProtocolName", "PositionReferenceIndicator", "StudyInstanceUID",
        "FrameOfReferenceUID", "AcquisitionDate", "ContrastBolusAgent", "IrradiationEventUID", *NOBODY]
KEPT = [k for k in KEPT if k not in ("Manufacturer", "ManufacturerModelName", "SoftwareVersions")]


def make():
    """The folder `template`: nine slices, exposures that differ, private elements."""
    for k in range(dicom.SLICES):
        path = "template/%02d.dcm" % k
        tags = {**WHO, **NOBODY, **STALE, "SpecificCharacterSet": "ISO_IR 100"}
        tags.pop("ContentTime")
        dicom.write(path, "axial", k, tags.pop("SeriesInstanceUID"), **tags, Exposure=100 + k,
                    ContentTime="14151%d.5" % (6 + (k + 5) % 4), PatientSex="F", SeriesNumber=7, SOPInstanceUID="1.2.840.4711.9.%d" % k)
        d = pydicom.dcmread(path)
        d.file_meta.MediaStorageSOPInstanceUID = d.SOPInstanceUID
        block = d.private_block(0x0099, "SECRETMAKER", create=True)
        block.add_new(1, "LO", "SECRETPRIVATE")
        d.save_as(path, write_like_original=False)


def number(name):
    return int("".join(c for c in os.path.basename(name) if c.isdigit()))


def planes(path):
    """(pixels, position, axes, spacing) of each picture."""
    for f in sorted(glob.glob(path + "/*"), key=number) if os.path.isdir(path) else [path]:
        d = pydicom.dcmread(f)
        px = d.pixel_array
        if "NumberOfFrames" not in d:
            assert (d.RescaleSlope, d.RescaleIntercept, d.RescaleType) == (1, 0, "HU")
            yield px, d.ImagePositionPatient, d.ImageOrientationPatient, d.PixelSpacing
            continue
        g = d.SharedFunctionalGroupsSequence[0]
        for k, own in enumerate(d.PerFrameFunctionalGroupsSequence):
            yield (px[k], own.PlanePositionSequence[0].ImagePositionPatient,
                   g.PlaneOrientationSequence[0].ImageOrientationPatient, g.PixelMeasuresSequence[0].PixelSpacing)


def same(nii, path):
    """Do the files hold the voxels of nii, in its own order, where they lie?"""
    v = nibabel.load(nii)
    want = np.asarray(v.dataobj)
    n = 0
    for k, (px, at, axes, spacing) in enumerate(planes(path)):
        assert np.array_equal(px.T, want[:, :, k]), (path, k)
        a = np.zeros((4, 2))
        a[:3, 0] = np.array(axes[:3], float) * float(spacing[1])
        a[:3, 1] = np.array(axes[3:], float) * float(spacing[0])
        assert np.abs((LPS @ a) - v.affine[:, :2]).max() < 1e-5, path
        first = LPS @ np.array([*map(float, at), 1])
        assert np.abs(first - v.affine @ [0, 0, k, 1]).max() < 1e-4, path
        n += 1
    assert n == want.shape[2]


def all(pairs):
    """Of each line: the NIfTI file and what was written of it."""
    for line in open(pairs):
        same(*line.split())


def back(nii, other):
    """Is the other file, whose slices may run the other way, the same volume?"""
    a, b = nibabel.load(nii), nibabel.load(other)
    m = np.linalg.inv(b.affine) @ a.affine
    r = np.rint(m)
    assert np.abs(m - r).max() < 1e-3, m
    x, y = np.asarray(a.dataobj), np.asarray(b.dataobj)
    i = np.indices(x.shape).reshape(3, -1)
    j = (r @ np.vstack([i, np.ones(i.shape[1])]))[:3].astype(int)
    assert np.array_equal(x[tuple(i)], np.rint(y[tuple(j)]))


def files(path):
    return sorted(glob.glob(path + "/*")) if os.path.isdir(path) else [path]


def kept(path):
    single = os.path.isdir(path)
    skip = [] if single else ["AcquisitionDate", "ContrastBolusAgent", "IrradiationEventUID", "KVP",
                              "ConvolutionKernel", "FilterType", "WindowCenter", "WindowWidth"]
    for f in files(path):
        d = pydicom.dcmread(f)
        for key in KEPT:
            if key not in skip:
                assert str(d[key].value) == {**WHO, **NOBODY}[key], (f, key, d.get(key))
        for key in [*STALE, "Exposure", "OperatorsName", "InstitutionName", "OtherPatientNames"]:
            assert key not in d, key
        assert not [e for e in d.iterall() if e.tag.is_private]
        assert d.SeriesDescription.startswith("SECRETSERIES "), d.SeriesDescription
        assert d.SeriesNumber == 1007 and d.SeriesInstanceUID != WHO["SeriesInstanceUID"]
        machine, own = d.ContributingEquipmentSequence
        assert (machine.Manufacturer, machine.InstitutionName) == ("Maker", "SECRETHOSPITAL")
        assert own.Manufacturer == d.Manufacturer == "ctsr" and d.ImageComments.startswith("research use")
        assert d.PatientSex == "F" and "BurnedInAnnotation" not in d  # which the template does not say
        uids = [s.ReferencedSOPInstanceUID for s in sources(d)]
        assert uids and not [u for u in uids if not u.startswith("1.2.840.4711.9.")], uids


def dated(path, date, time):
    d = pydicom.dcmread(path)
    assert (d.ContentDate, d.ContentTime) == (date, time), (d.ContentDate, d.ContentTime)
    assert "SeriesDate" not in d or d.SeriesDate == date


def sources(d):
    if "NumberOfFrames" not in d:
        return d.SourceImageSequence
    return [s for g in d.PerFrameFunctionalGroupsSequence for s in g.DerivationImageSequence[0].SourceImageSequence]


def removed(path):
    words = set(WHO.values()) | {"SECRET", "Secret", "Patricia", "Doctor", ".4711."}
    for f in files(path):
        data = open(f, "rb").read()
        for word in words:
            assert word.encode() not in data, (f, word)
        d = pydicom.dcmread(f)
        assert d.PatientIdentityRemoved == "YES" and d.DeidentificationMethodCodeSequence[0].CodeValue == "113100"
        assert d.PatientID.startswith("ANON-") and str(d.PatientName).startswith("ANON^")
        for key in ("PatientSex", "PatientBirthDate", "StudyDate", "AccessionNumber", "StudyID"):
            assert key in d and not d[key].value, key
        assert d.BodyPartExamined == "CHEST" and d.ContributingEquipmentSequence[0].Manufacturer == "Maker"


def nearest(path):
    """Of slices of half the distance: between two of the source both, outside the last one."""
    seen = [[s.ReferencedSOPInstanceUID[-1] for s in pydicom.dcmread(f).SourceImageSequence] for f in files(path)]
    between = [[str(k), str(k + 1)] for k in range(dicom.SLICES - 1) for _ in (0, 1)]
    assert [sorted(s) for s in seen] == [["0"], *between, [str(dicom.SLICES - 1)]], seen


def alone(path):
    """Of slices in the same places: each is of that one."""
    seen = [[s.ReferencedSOPInstanceUID[-1] for s in pydicom.dcmread(f).SourceImageSequence] for f in files(path)]
    assert seen == [[str(k)] for k in range(dicom.SLICES)], seen


def oblique():
    """A volume at an angle, left-handed, and one that is sheared."""
    rng = np.random.default_rng(1)
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    q[:, 0] *= -np.sign(np.linalg.det(q))  # det -1
    x = rng.integers(-1024, 3000, (7, 6, 5)).astype(np.int16)
    a = np.eye(4)
    a[:3, :3] = q * [0.7421875, 1.1, 2.3]
    a[:3, 3] = -12.3456, 78.9, -456.789
    nibabel.Nifti1Image(x, a).to_filename("oblique.nii")
    a[:3, 2] += 0.3 * a[:3, 0]
    v = nibabel.Nifti1Image(x, a)
    v.set_qform(None, code=0)
    v.to_filename("sheared.nii")


# Of sidecars.
NAMED = dict(PatientName="DOERING^JANE", PatientID="SECRET77", PatientBirthDate="19600203", StudyDate="20200102",
             Manufacturer="ACME Med", ManufacturerModelName="CT-9", ConvolutionKernel="B30f", KVP="120",
             SpacingBetweenSlices="2.5", GantryDetectorTilt="0", ReconstructionDiameter="350", PatientPosition="HFS",
             ImageType=["ORIGINAL", "PRIMARY", "AXIAL"], AccessionNumber="ACC1", InstitutionName="Hosp",
             ProtocolName="for Jane", OperatorsName="OP", StudyID="S1", ReferringPhysicianName="REF")


def make_sidecars():
    for k in range(dicom.SLICES):
        dicom.write(f"even/IM{k}", "axial", k, "1.2.7", **NAMED)
        at = dicom.place("axial", k, 0, 0)
        at[2] += (0, .9, -.7, .3)[k % 4]
        dicom.write(f"uneven/IM{k}", "axial", k, "1.2.8", position=at, **NAMED)
        dicom.write(f"named/{'doering' if k % 2 else 'x-SECRET77'}-{k}.dcm", "axial", k, "1.2.9", **NAMED)


def trace(folder, out, name):
    """Each plane is what its slices say, by their weights."""
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
