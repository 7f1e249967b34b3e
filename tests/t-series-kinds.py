# SPDX-License-Identifier: Apache-2.0
"""Series as scanners and archives leave them. make; planes FILE N [SPACING]; tag FOLDER KEY VALUE|-: of all files."""
import glob
import os
import sys

import nibabel as nib
import numpy as np
import pydicom
from dicom import GAP, PITCH, place, write
from pydicom.dataset import Dataset
from pydicom.sequence import Sequence

N = 6
ENHANCED = "1.2.840.10008.5.1.4.1.1.2.1"


def stack(folder, n=N, at=lambda k: k, first=0, name="%02d.dcm", hu=0, values=None, **tags):
    """Slices of the phantom, moved along the normal to at(k) gaps; `hu` is added to all values,
    which are those at values(k) gaps, else at(k)."""
    for k in range(n):
        own = {t: v(k) if callable(v) else v for t, v in tags.items()}
        write("%s/%s" % (folder, name % (first + k) if "%" in name else name), "axial", k, "1.9.1",
              position=place("axial", at(k), 0, 0), scale=(1, -1024),
              at=lambda j, i: place("axial", (values or at)(k), j, i) + [0, 0, hu / 2],
              **{"InstanceNumber": first + k + 1, "SliceThickness": 2.5, "ConvolutionKernel": "B30f", "KVP": 120,
                 **{t: v for t, v in own.items() if v is not None}})


def passes(folder, n=2, **tags):
    for p in range(n):
        stack(folder, at=lambda k, p=p: k + p / n, first=N * p, hu=100 * p,
              **{t: v[p] if isinstance(v, list) else v for t, v in tags.items()})


def item(to, sequence, **tags):
    d = Dataset()
    for key, v in tags.items():
        setattr(d, key, v)
    setattr(to, sequence, Sequence([d]))


def enhanced(path, frames, groups=None, **top):
    """Frames (place in gaps, FrameContentSequence); of `groups` the first so many have a functional group."""
    os.makedirs(os.path.dirname(path), exist_ok=True)
    write(path, "axial", 0, "1.9.1", scale=(1, -1024))
    d = pydicom.dcmread(path)
    for key in ("ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing", "SliceThickness", "RescaleSlope",
                "RescaleIntercept"):
        delattr(d, key)
    shared, each, pixels = Dataset(), [], b""
    item(shared, "PixelMeasuresSequence", PixelSpacing=list(PITCH), SliceThickness=2.5)
    item(shared, "PlaneOrientationSequence", ImageOrientationPatient=[1, 0, 0, 0, 1, 0])
    item(shared, "PixelValueTransformationSequence", RescaleSlope=1, RescaleIntercept=-1024, RescaleType="HU")
    for k, (at, content) in enumerate(frames):
        f = Dataset()
        item(f, "PlanePositionSequence", ImagePositionPatient=["%.10g" % v for v in place("axial", at, 0, 0)])
        item(f, "FrameContentSequence", **content)
        each.append(f)
        pixels += np.full((d.Rows, d.Columns), 1024 + 10 * k, "<i2").tobytes()
    d.SOPClassUID = d.file_meta.MediaStorageSOPClassUID = ENHANCED
    d.NumberOfFrames, d.ImageType = len(frames), ["ORIGINAL", "PRIMARY", "VOLUME", "NONE"]
    d.SharedFunctionalGroupsSequence, d.PerFrameFunctionalGroupsSequence = Sequence([shared]), Sequence(each[:groups])
    d.PixelData = pixels
    for key, v in top.items():
        setattr(d, key, v)
    d.save_as(path, write_like_original=False)


def dimensions(*tags):
    out = []
    for tag in tags:
        d = Dataset()
        d.DimensionOrganizationUID, d.DimensionIndexPointer = "1.2.9", tag
        out.append(d)
    return Sequence(out)


def make_passes():
    passes("pass-acquisition", AcquisitionNumber=[1, 2])
    passes("pass-three", 3, AcquisitionNumber=[1, 2, 3])
    passes("pass-phase", NominalPercentageOfCardiacPhase=[0, 50])
    passes("pass-kernel", ConvolutionKernel=["B30f", "B70f"])
    passes("pass-kvp", KVP=[80, 140])
    passes("pass-contrast", ContrastBolusAgent=[None, "Iodine"])
    passes("pass-space", FrameOfReferenceUID=["1.9.7", "1.9.8"])
    passes("pass-study", StudyInstanceUID=["1.9.7", "1.9.8"])
    for d, tags in ("number", {"SeriesNumber": [2, 3]}), ("study", {"StudyInstanceUID": ["1.9.7", "1.9.8"]}):
        for p in range(2):
            stack("nameless-" + d, at=lambda k: k + N * p, first=N * p, hu=100 * p, SeriesInstanceUID="",
                  **{t: v[p] for t, v in tags.items()})
    passes("pass-about", SeriesDescription=["native", "late"])
    stack("each-space", 12, FrameOfReferenceUID=lambda k: "1.9.7.%d" % k, SeriesDescription=lambda k: "slice %d" % k)
    stack("pass-reversed", AcquisitionNumber=1)
    stack("pass-reversed", at=lambda k: N - k - .5, first=N, hu=100, AcquisitionNumber=2)
    stack("turns", 12, KVP=lambda k: 80 + 60 * (k % 2))
    stack("pairs", 12, KVP=lambda k: 80 + 60 * (k // 2 % 2))
    # one stack
    stack("by-design", at=lambda k: 2 * k, AcquisitionTime="100000")
    stack("by-design", at=lambda k: 2 * k + 1, first=N, AcquisitionTime="100100")
    stack("shot", 12, AcquisitionNumber=lambda k: k // 4 + 1, TriggerTime=lambda k: 700 + k // 4 % 2)
    stack("anew", 12, AcquisitionNumber=lambda k: k % 6 + 1)
    stack("zones-kvp", 12, KVP=lambda k: 80 if k < 6 else 140)


def make_copies():
    own = {"SOPInstanceUID": lambda k: "1.9.2.%d" % k}
    stack("copied", **own)
    stack("copied", first=N, **own)
    stack("rounded", at=lambda k: k + .0014)
    stack("rounded", first=N, at=lambda k: round((k + .0014) * GAP, 2) / GAP, values=lambda k: k + .0014)
    for d in "same-acquisition", "same-phase", "same":
        for p in range(2):
            stack(d, first=N * p, hu=100 * p, **own,
                  **{"same-acquisition": {"AcquisitionNumber": p + 1},
                     "same-phase": {"NominalPercentageOfCardiacPhase": 50 * p}}.get(d, {}))
    stack("rescan")
    stack("rescan", 1, at=lambda k: 3.008, first=N, hu=100)
    for k in range(2):
        stack("seam-%d" % k)
        stack("seam-%d" % k, at=lambda j: N - 1 + .004 + j, first=N, hu=200 * k, values=lambda j: N - 1 + j)


def make_frames():
    row = [(k, {"StackID": "1"}) for k in range(N)]
    enhanced("enhanced/e.dcm", row)
    enhanced("groups/e.dcm", row, 4)
    enhanced("frame-lost/e.dcm", row[:2] + row[3:])
    enhanced("stacks/e.dcm", row + [(k + .5, {"StackID": "2"}) for k in range(N)])
    enhanced("index/e.dcm", [(k + p / 2, {"DimensionIndexValues": [k + 1, p + 1]}) for p in range(2) for k in range(N)],
             DimensionIndexSequence=dimensions(0x00209057, 0x00181060))
    enhanced("times/e.dcm", [(k + p / 2, {"TemporalPositionIndex": p + 1}) for p in range(2) for k in range(N)])
    enhanced("twice/e.dcm", row + [(3, {"StackID": "1"})])
    for d, names in ("whole", "abc"), ("backwards", "cba"), ("first", "bc"), ("last", "ab"), ("middle", "ac"):
        for k in range(3):
            if d == "backwards" or "abc"[k] in names:
                enhanced("parts-%s/%s.dcm" % (d, names[k] if d == "backwards" else "abc"[k]), row[2 * k:2 * k + 2],
                         ConcatenationUID="1.9.3", InConcatenationNumber=k + 1, InConcatenationTotalNumber=3,
                         ConcatenationFrameOffsetNumber=2 * k)
    for d, tags in (("frames", {"SpacingBetweenSlices": 2.5}), ("frames-nowhere", {}),
                    ("frames-times", {"SpacingBetweenSlices": 2.5, "FrameIncrementPointer": 0x00181063})):
        write(d + "/e.dcm", "axial", 0, "1.9.1", scale=(1, -1024), **tags)
        e = pydicom.dcmread(d + "/e.dcm")
        e.NumberOfFrames, e.PixelData = N, b"".join(
            np.full((e.Rows, e.Columns), 1024 + 10 * k, "<i2").tobytes() for k in range(N))
        e.save_as(d + "/e.dcm", write_like_original=False)


def make_others():
    """One picture that does not belong: the last."""
    for d, tags in (("modality-other", {"Modality": lambda k: "OT" if k == N - 1 else "CT"}),
                    ("modality-none", {"Modality": lambda k: "" if k == N - 1 else "CT"}),
                    ("name-other", {"PatientName": lambda k: "Doe^Jane" if k == N - 1 else "Roe^Richard"}),
                    ("name-cases", {"PatientName": lambda k: ["Roe^Richard", "ROE^RICHARD^^", ""][k % 3]})):
        stack(d, **tags)
    enhanced("frame-other/e.dcm", [(k, {"StackID": "1"}) for k in range(N)])
    e = pydicom.dcmread("frame-other/e.dcm")
    for k, f in enumerate(e.PerFrameFunctionalGroupsSequence):
        item(f, "CTImageFrameTypeSequence", FrameType=["ORIGINAL", "PRIMARY", "AXIAL" if k < N - 1 else "LOCALIZER", "NONE"])
    e.save_as("frame-other/e.dcm", write_like_original=False)
    enhanced("parts-unsaid/a.dcm", [(k, {"StackID": "1"}) for k in range(N)], ConcatenationUID="1.9.3", InConcatenationNumber=1)


def make_scales():
    """Scales that are wrong in some slices, or in all; and places that are too near."""
    for d, wrong in ("one", [3]), ("first", [0]), ("last", [N - 1]), ("two", [2, 3]), ("apart", [1, 4]):
        stack("jump-" + d, RescaleIntercept=lambda k: -924 if k in wrong else -1024)
    stack("jump-little", 12, RescaleIntercept=lambda k: -1000 if k == 7 else -1024)
    stack("jump-slope", 12, RescaleSlope=lambda k: 1.5 if k == 7 else 1)
    for k in range(12):
        write("scales-own/%02d.dcm" % k, "axial", k, "1.9.1", scale=(1 + k / 16, -1024 - 9 * k))
        write("scales-zones/%02d.dcm" % k, "axial", k, "1.9.1", scale=(1, -1024 if k < 7 else 0))
    for d, slope in ("thousandth", .001), ("twentieth", .05):
        stack("slope-" + d, RescaleSlope=slope, BitsStored=12 if d == "thousandth" else 16)
    for by in ".04", ".06", ".08", ".2":
        for d, at in ("between", 2 + float(by)), ("behind", N - 1 + float(by)):
            stack("ghost-%s-%s" % (d, by))
            stack("ghost-%s-%s" % (d, by), 1, at=lambda k: at, first=N, hu=9)
    for p in range(2):
        stack("second", at=lambda k: k + .08 * p, first=N * p, hu=9 * p)
    stack("with-scout")
    stack("with-scout", 2, at=lambda k: k + 30, first=N, SeriesInstanceUID="1.9.4", ImageType=["ORIGINAL", "PRIMARY", "LOCALIZER"])
    stack("no-air", RescaleIntercept=0)
    for d, lost in ("inner", 3), ("outer", 0):
        stack("flat-" + d)
        e = pydicom.dcmread("flat-%s/%02d.dcm" % (d, lost))
        e.PixelData = bytes(len(e.PixelData))
        e.save_as(e.filename, write_like_original=False)
    for d, limit in ("tissue", 300), ("air", -900):
        stack("padding-" + d, PixelPaddingRangeLimit=limit + 1024, PixelPaddingValue=-2000)
    for k in range(N):
        stack("turned", 1, at=lambda j: k, first=k)
        e = pydicom.dcmread("turned/%02d.dcm" % k)
        e.PixelData = np.frombuffer(e.PixelData, "<u2").byteswap().tobytes() if k == 2 else e.PixelData
        e.save_as(e.filename, write_like_original=False)
    stack("aside")
    e = pydicom.dcmread("aside/02.dcm")
    e.ImagePositionPatient = [float(v) + (3 if d == 0 else 0) for d, v in enumerate(e.ImagePositionPatient)]
    e.save_as(e.filename, write_like_original=False)
    thin = [0, 1, 2, 3, 3.2, 3.4, 3.6, 3.8, 4, 5, 6]
    stack("zone-thin", len(thin), at=lambda k: thin[k])


def make():
    make_scales()
    make_others()
    make_passes()
    make_copies()
    make_frames()
    wide = [0, 1, 2, 3, 4, 5, 7, 9, 11]
    for d, tags in (("zones", {"SliceThickness": lambda k: 2.5 if k < 5 else 5}),
                    ("zones-between", {"SpacingBetweenSlices": lambda k: 2.5 if k < 5 else 5}), ("lost", {})):
        stack(d, len(wide), at=lambda k: wide[k], **tags)
    most = [0, 1, 4, 6, 7]
    stack("most-lost", len(most), at=lambda k: most[k], InstanceNumber=lambda k: most[k] + 1)
    stack("most-apart", len(most), at=lambda k: most[k])
    stack("zones-lost", 8, at=lambda k: [0, 1, 2, 3, 4, 6, 10, 12][k], SliceThickness=lambda k: 2.5 if k < 4 else 5)
    stack("bare", name="IM%04d")
    for d, say in (("yes", lambda k: "YES" if k == 3 else "NO"), ("no", "NO"), ("silent", lambda k: None),
                   ("half", lambda k: "NO" if k else None), ("word", lambda k: "True" if k == 2 else "NO"),
                   ("second", lambda k: ["NO", "YES"] if k == 2 else "NO")):
        stack("burnt-" + d, BurnedInAnnotation=say)
        for f in sorted(glob.glob("burnt-%s/*" % d)):
            e = pydicom.dcmread(f)
            if d == "yes" and f.endswith("02.dcm"):
                e.LossyImageCompression, e.LossyImageCompressionRatio = "01", 12.5
                e.LossyImageCompressionMethod = "ISO_15444_1"
            elif d in ("yes", "no"):
                e.LossyImageCompression, e.LossyImageCompressionMethod = "00", "ISO_14495_1"
            e.save_as(f, write_like_original=False)


def planes(path, n, spacing=GAP):
    image = nib.load(path)
    assert image.shape[2] == int(n), image.shape
    assert abs(image.header.get_zooms()[2] - float(spacing)) < .01, image.header.get_zooms()


def tag(folder, key, want):
    for f in glob.glob(folder + "/*"):
        is_ = str(pydicom.dcmread(f).get(key, "-"))
        assert is_ == want, (f, key, is_)


if __name__ == "__main__":
    globals()[sys.argv[1]](*sys.argv[2:])
