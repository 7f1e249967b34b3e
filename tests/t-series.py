# SPDX-License-Identifier: Apache-2.0
"""Series for t-series.sh, and what must be read of them: t-series.py FUNCTION ARGUMENT..."""
import copy
import glob
import os
import subprocess
import sys

import nibabel as nib
import numpy as np
import pydicom
from dicom import AXES, COLUMNS, GAP, ORIGIN, PITCH, ROWS, SLICES, axes, place, t, value, write
from pydicom.dataset import Dataset
from pydicom.sequence import Sequence
from pydicom.uid import generate_uid

N = 16
SECONDARY = "1.2.840.10008.5.1.4.1.1.7"
REPORT = "1.2.840.10008.5.1.4.1.1.88.11"


def series(folder, uid, n=N, **tags):
    for k in range(n):
        write("%s/%02d.dcm" % (folder, k), "axial", k, uid,
              **{"InstanceNumber": k + 1, **{t: v(k) if callable(v) else v for t, v in tags.items()}})


def make_folders():
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


def check_folder(path, n=N, base=0, *wrong):
    """Every voxel is where it was, in HU; slices `wrong` are not looked at."""
    n, base, wrong = int(n), int(base), [int(s) for s in wrong]
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


# Ways in which one series comes.
def headless():
    os.makedirs("headless", exist_ok=True)
    for k in range(SLICES):
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


def make_ways():
    for k in range(SLICES):
        write("s/%02d.dcm" % k, "axial", k, "1.5.1", PatientName="P", StudyDate="20200101", StudyTime="120000",
              StudyID="1", ImageType=["ORIGINAL", "PRIMARY", "AXIAL"])
    headless()
    enhanced("enhanced/e.dcm", [(5 * k) % SLICES for k in range(SLICES)])


def same_way(first, *others):
    want = nib.load(first)
    for path in others:
        image = nib.load(path)
        assert image.shape == want.shape, (path, image.shape)
        assert np.array_equal(image.get_fdata(), want.get_fdata()), path
        assert np.array_equal(image.affine, want.affine), path


# Clean series, as pydicom and dcm2niix read them.
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


def make_peers():
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


def check_peer(path, folder):
    """Every pixel of every slice as pydicom reads it, at the place that its header gives it."""
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


def same_peer(path, other):
    """Two volumes are one, whatever the order of their axes."""
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


def pairs(test, *names):
    """A line for each pair."""
    bad, test = 0, globals()[test]
    for a, b in zip(names[::2], names[1::2]):
        try:
            test(a, b)
            print("%s and %s agree" % (a, b))
        except (AssertionError, OSError) as x:
            print("%s and %s do not agree: %s" % (a, b, x))
            bad = 1
    sys.exit(bad)


# Stacks that are no grid.
def stack(folder, uid, name, where, n=SLICES, **tags):
    """Slice k at where(k) mm: along across, down, normal."""
    across, down = axes(name)
    frame = np.stack([across, down, np.cross(across, down)])
    for k in range(n):
        write("%s/%02d.dcm" % (folder, (5 * k) % n), name, k, uid, ORIGIN + where(k) @ frame,
              at=lambda j, i, k=k: ORIGIN + where(k) @ frame + np.multiply.outer(i, across) * 0.5
              + np.multiply.outer(j, down) * 0.75, **tags)


def make_stacks():
    lean = lambda k: np.array([0, np.sin(t), np.cos(t)]) * GAP * k
    back = lambda k: np.array([-np.sin(t) / 2, -np.sin(t), np.cos(t)]) * GAP * k
    for name in ("axial", "sagittal", "oblique"):
        stack("lean-" + name, "1.3.1", name, lean)
    stack("back", "1.3.2", "axial", back)
    stack("uneven", "1.3.3", "las", lambda k: np.array([0, 0, 1.0]) * (2 * k + (3 * (k - 5) if k > 5 else 0)))
    stack("both", "1.3.4", "coronal", lambda k: np.array([0.3, 1, 2.0]) * (k + (k - 4 if k > 4 else 0)))
    stack("bent", "1.3.5", "axial", lambda k: np.array([0, 0.1 * k * k, 2.0 * k]))
    for name, degrees in (("most", 44), ("steep", 46)):
        a = np.radians(degrees)
        stack(name, "1.3.9", "axial", lambda k, a=a: np.array([0, np.sin(a), np.cos(a)]) * GAP * k)
    stack("far", "1.3.6", "axial", lambda k: np.array([0, 40.0 * k, 2.0 * k]))
    stack("missing", "1.3.7", "axial", lambda k: np.array([0, 0, 2.5]) * (k + (k > 3) + 2 * (k > 6)))
    stack("leanmissing", "1.3.8", "axial", lambda k: lean(k + (k > 3)))


def check_stack(path, covered):
    """Every voxel that a slice covers holds what stands at its place in the patient, and so many do; the affine is
    orthonormal."""
    image = nib.load(path)
    a, data = image.affine, image.get_fdata()
    i, j, k = np.meshgrid(*map(np.arange, data.shape), indexing="ij")
    ras = np.stack([i, j, k], -1) @ a[:3, :3].T + a[:3, 3]
    want = value(ras * [-1, -1, 1])
    inside = data != -1024
    unit = a[:3, :3] / np.linalg.norm(a[:3, :3], axis=0)
    assert np.abs(unit.T @ unit - np.eye(3)).max() < 1e-6, unit
    assert np.abs(image.header.get_qform() - image.header.get_sform()).max() < 2e-3  # a quaternion of floats
    print("# voxels", data.shape, "covered", inside.mean(), "off by", np.abs(data - want)[inside].max())
    off = np.abs(data - want)[inside]
    # half a pixel at the border repeats the last one, of at most 7 HU/mm x 0.75 mm
    assert off.max() <= 2.7 + 0.6 and np.quantile(off, 0.8) <= 0.7, np.quantile(off, [0.5, 0.8, 1])
    assert abs(inside.mean() - float(covered)) < 0.01, inside.mean()
    assert np.linalg.det(a[:3, :3]) != 0 and image.header["xyzt_units"] == 2


def sheared(path):
    """As it came: the voxels untouched, the affine leads where they were."""
    image = nib.load(path)
    a, data = image.affine, image.get_fdata()
    assert data.shape == (COLUMNS, ROWS, SLICES) and image.header["qform_code"] == 0
    i, j, k = np.meshgrid(*map(np.arange, data.shape), indexing="ij")
    ras = np.stack([i, j, k], -1) @ a[:3, :3].T + a[:3, 3]
    want = value(ras * [-1, -1, 1])
    assert np.abs(data - want).max() <= 1 and np.mean(data != want) < 0.02
    corner = ORIGIN + np.array([0, np.sin(t), np.cos(t)]) * GAP * (SLICES - 1)
    assert np.abs(ras[0, 0, -1] - corner * [-1, -1, 1]).max() < 1e-4


def itk(path, mha):
    """It is what ITK made of it, which knows LPS."""
    with open(mha, "rb") as f:
        head = {}
        while "ElementDataFile" not in head:
            key, _, text = f.readline().decode().partition(" = ")
            head[key] = text.split()
        data = np.frombuffer(f.read(), "<f4").reshape([int(n) for n in head["DimSize"]], order="F")
    image, a = nib.load(path), np.eye(4)
    number = lambda key: np.array(head[key], float)
    a[:3, :3] = number("TransformMatrix").reshape(3, 3).T * number("ElementSpacing")
    a[:3, 3] = number("Offset")
    assert head["ElementType"] == ["MET_FLOAT"] and np.array_equal(data, image.get_fdata(dtype=np.float32))
    assert np.abs(np.diag([-1, -1, 1, 1]) @ a - image.affine).max() < 1e-4, a


# Real series, against what pydicom and others read of them.
AIR = -1024


def slices(folder):
    """In the order of their places: headers, HU, and the way from LPS mm to columns, rows and mm along the normal."""
    found = []
    for d in map(pydicom.dcmread, glob.glob(folder + "/*")):
        across, down = np.array(d.ImageOrientationPatient, float).reshape(2, 3)
        frame = np.stack([across / float(d.PixelSpacing[1]), down / float(d.PixelSpacing[0]), np.cross(across, down)])
        found.append((frame[2] @ np.array(d.ImagePositionPatient, float), d, frame))
    return [x[1:] for x in sorted(found, key=lambda x: x[0])]


def values(d):
    hu = d.pixel_array * float(d.RescaleSlope) + float(d.RescaleIntercept)
    return np.where(d.pixel_array == d.get("PixelPaddingValue", 1 << 20), AIR, hu)


def places(path, folder):
    """A tilted, uneven stack."""
    from scipy.ndimage import map_coordinates
    image = nib.load(path)
    v, a, back = image.get_fdata(dtype=np.float32), image.affine, np.linalg.inv(image.affine)
    unit = a[:3, :3] / np.linalg.norm(a[:3, :3], axis=0)
    skew = np.abs(unit.T @ unit - np.eye(3)).max()
    assert skew < 1e-6, skew
    stack = slices(folder)
    # A slice's own pixels in the plane that is it: what is left over the gradient is how far it is off.
    far, off, met = 0, [], 0
    for d, frame in stack:
        j, i = np.meshgrid(np.arange(d.Rows), np.arange(d.Columns), indexing="ij")
        step = np.linalg.inv(frame)
        lps = np.array(d.ImagePositionPatient, float) + np.multiply.outer(i, step[:, 0]) + np.multiply.outer(j, step[:, 1])
        x, y, z = np.moveaxis((lps * [-1, -1, 1]) @ back[:3, :3].T + back[:3, 3], -1, 0)
        k = int(np.rint(z[0, 0]))
        if np.abs(z - k).max() > 0.02:
            continue
        met += 1
        hu, got = values(d), map_coordinates(v[..., k], [x, y], order=3, mode="nearest")
        inner = (hu > -1000) & (hu < 1500)
        inner[:9], inner[-9:], inner[:, :9], inner[:, -9:] = 0, 0, 0, 0
        slope = np.stack(np.gradient(got), -1)[inner]
        by = np.linalg.lstsq(slope, (got - hu)[inner], rcond=None)[0] * np.array(d.PixelSpacing, float)
        far = max(far, np.abs(by).max())
        off.append(np.abs(got - hu))
    off = np.array(off)
    print("planes that are slices: %d; off by at most %.4f mm; %.2f HU median, %.1f HU rms, %.1f HU at 99 %%; affine "
          "orthonormal to %.1g" % (met, far, np.median(off), np.sqrt(np.mean(off ** 2)), np.quantile(off, 0.99), skew))
    assert met >= 14 and far < 0.05 and np.sqrt(np.mean(off ** 2)) < 5 and np.median(off) < 0.5
    # Every plane is the mean, by distance, of the slices on either side of it.
    at = np.array([frame[2] @ np.array(d.ImagePositionPatient, float) for d, frame in stack])
    i, j = np.meshgrid(np.arange(v.shape[0]), np.arange(v.shape[1]), indexing="ij")
    every = []
    for k in range(v.shape[2]):
        lps = (np.stack([i, j, np.full_like(i, k)], -1) @ a[:3, :3].T + a[:3, 3]) * [-1, -1, 1]
        b = min(max(np.searchsorted(at, stack[0][1][2] @ lps[0, 0]), 1), len(at) - 1)
        part = (stack[0][1][2] @ lps[0, 0] - at[b - 1]) / (at[b] - at[b - 1])
        want, covered = 0, True
        for s, weight in ((b - 1, 1 - part), (b, part)):
            d, frame = stack[s]
            c, r, _ = np.moveaxis((lps - np.array(d.ImagePositionPatient, float)) @ frame.T, -1, 0)
            want = want + weight * map_coordinates(values(d), [r, c], order=3, mode="nearest")
            covered &= (c >= 0) & (c <= d.Columns - 1) & (r >= 0) & (r <= d.Rows - 1)
        every.append(np.abs(v[..., k] - want)[covered])
    every = np.concatenate(every)
    print("all planes: %d; %.2f HU median, %.1f HU rms, %.1f HU at 99 %%" % (
        v.shape[2], np.median(every), np.sqrt(np.mean(every ** 2)), np.quantile(every, 0.99)))
    assert np.sqrt(np.mean(every ** 2)) < 5 and np.median(every) < 0.5


def identical(path, other):
    a, b = nib.load(path), nib.load(other)
    assert np.array_equal(a.affine, b.affine) and np.array_equal(a.get_fdata(), b.get_fdata())


def decoded(path, folder):
    """JPEG 2000 with wrong tile-part lengths: the last says 0, to the end; ffmpeg has a decoder of its own, which begins signed numbers at 0."""
    image = nib.load(path)
    v, stack = image.get_fdata(dtype=np.float32), slices(folder)
    beyond = []
    for k, (d, frame) in enumerate(stack):
        stream = next(pydicom.encaps.generate_pixel_data_frame(d.PixelData))
        at = stream.index(b"\xff\x90")
        beyond.append(int.from_bytes(stream[at + 6:at + 10], "big") - (len(stream.rstrip(b"\0")) - 2 - at))
        whole = stream[:at + 6] + bytes(4) + stream[at + 10:]
        raw = subprocess.run("ffmpeg -v error -i - -f rawvideo -pix_fmt gray16le -".split(), input=whole,
                             stdout=subprocess.PIPE, check=True).stdout
        x = np.frombuffer(raw, "<u2").reshape(d.Rows, d.Columns).astype(float)
        x -= 32768 * (stream[42] >> 7)  # SIZ: a sign
        hu = x * float(d.RescaleSlope) + float(d.RescaleIntercept)
        place = image.affine @ [0, 0, k, 1]
        assert np.array_equal(v[..., k].T, hu), (k, np.abs(v[..., k].T - hu).max())
        assert np.abs(place[:3] * [-1, -1, 1] - np.array(d.ImagePositionPatient, float)).max() < 1e-3
    print("slices: %d, all alike; their lengths say %d to %d bytes too many" % (len(stack), min(beyond), max(beyond)))
    assert min(beyond) > 0


if __name__ == "__main__":
    globals()[sys.argv[1]](*sys.argv[2:])
