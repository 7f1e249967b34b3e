# SPDX-License-Identifier: Apache-2.0
"""Pictures and DICOM radiographs, and what ct-convert --radiograph makes of them, read by a few lines that know
OpenEXR and nothing of ours."""
import sys

import numpy as np

import exr

H, W = 12, 16
rng = np.random.default_rng(1)
A8 = rng.integers(0, 256, (H, W)).astype(np.uint8)
A16 = rng.integers(0, 65536, (H, W)).astype(np.uint16)
F = (A16 / 100).astype(np.float32)  # line integrals
S = np.where(A16 % 7 == 0, -2000, A16 % 4096 - 2048).astype(np.int16)  # 12 bits with a sign; padding


def pictures():
    import tifffile
    from PIL import Image
    Image.fromarray(A8).save("a8.png")
    Image.fromarray(A16).save("a16.png")
    Image.fromarray(np.stack([A8] * 3, -1)).save("rgb.png")
    Image.fromarray(np.stack([A8, A8 // 2, A8 // 4], -1)).save("colour.png")
    Image.fromarray(A8).convert("P").save("palette.png")
    Image.fromarray(np.stack([A8, A8 // 2], -1), "LA").save("alpha.png")
    Image.fromarray(A8[:6]).save("small.png")
    tifffile.imwrite("a8.tif", A8, photometric="minisblack")
    tifffile.imwrite("a16.tif", A16, photometric="minisblack")
    tifffile.imwrite("big.tif", A16, photometric="minisblack", byteorder=">")
    tifffile.imwrite("white.tif", A8, photometric="miniswhite")
    tifffile.imwrite("white16.tif", A16, photometric="miniswhite")
    tifffile.imwrite("large.tif", A16, photometric="minisblack", bigtiff=True)
    tifffile.imwrite("double.tif", A16 / 65535)
    tifffile.imwrite("tiled.tif", A16, photometric="minisblack", tile=(16, 16))
    tifffile.imwrite("f.tif", F)
    tifffile.imwrite("nan.tif", np.full((H, W), np.nan, np.float32))
    tifffile.imwrite("multi.tif", np.stack([A8, A8]), photometric="minisblack")
    open("text.png", "w").write("hello")
    open("cut.png", "wb").write(open("a16.png", "rb").read()[:200])


def dicom(path, x, bits=12, photometric="MONOCHROME2", modality="DX", tags=()):
    import pydicom
    from pydicom.dataset import FileDataset, FileMetaDataset
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID = "1.2.840.10008.5.1.4.1.1.1.1"
    meta.MediaStorageSOPInstanceUID = "1.2.3.%d" % abs(hash(path))
    meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
    d = FileDataset(path, {}, file_meta=meta, preamble=b"\0" * 128)
    d.is_little_endian, d.is_implicit_VR = True, False
    d.SOPClassUID, d.SOPInstanceUID = meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID
    d.Modality, d.PatientID, d.StudyInstanceUID, d.SeriesInstanceUID = modality, "P", "1.2.3", "1.2.3.4"
    d.Rows, d.Columns, d.SamplesPerPixel = H, W, 1
    d.PhotometricInterpretation = photometric
    d.BitsAllocated, d.BitsStored, d.HighBit = 16, bits, bits - 1
    d.PixelRepresentation = int(x.dtype.kind == "i")
    d.ImagerPixelSpacing, d.PixelSpacing = [0.2, 0.15], [0.1, 0.075]
    d.PixelData = x.astype(x.dtype.newbyteorder("<")).tobytes()
    for key, v in tags:
        if v is None:
            delattr(d, key)
        else:
            setattr(d, key, v)
    return d


def radiographs():
    import os

    import pydicom
    x = A16 % 4096
    lut = pydicom.Dataset()
    lut.LUTDescriptor, lut.ModalityLUTType, lut.LUTData = [2, 0, 16], "US", b"\0\0\1\0"
    for name, d in dict(
            dx=dicom("dx", x), one=dicom("one", x, photometric="MONOCHROME1"), full=dicom("full", A16, 16),
            cr=dicom("cr", x, modality="CR", tags=[("ImagerPixelSpacing", None)]),
            rf=dicom("rf", x, modality="RF", tags=[("ImagerPixelSpacing", None), ("PixelSpacing", None)]),
            sign=dicom("sign", S, tags=[("PixelPaddingValue", -2000)]),
            pad1=dicom("pad1", S, photometric="MONOCHROME1", tags=[("PixelPaddingValue", -2000)]),
            slope=dicom("slope", x, tags=[("RescaleSlope", 2), ("RescaleIntercept", 5)]),
            down=dicom("down", x, tags=[("RescaleSlope", -1), ("RescaleIntercept", 4095)]),
            zero=dicom("zero", x, tags=[("RescaleSlope", 0), ("RescaleIntercept", 0)]),
            both=dicom("both", x, photometric="MONOCHROME1", tags=[("RescaleSlope", -1), ("RescaleIntercept", 0)]),
            table=dicom("table", x, tags=[("ModalityLUTSequence", [lut])]),
            colour=dicom("colour", x, photometric="PALETTE COLOR"), ct=dicom("ct", x, modality="CT"),
            mr=dicom("mr", x, modality="MR"), flat=dicom("flat", x, tags=[("ImagerPixelSpacing", [0, 0.1])]),
            two=dicom("two", np.stack([x, x]), tags=[("NumberOfFrames", 2)])).items():
        d.save_as(name + ".dcm", write_like_original=False)
    d = dicom("rle", x)
    d.compress(pydicom.uid.RLELossless)
    d.save_as("rle.dcm", write_like_original=False)
    d.Rows = d.Columns = 60000
    d.save_as("huge.dcm", write_like_original=False)
    rgb = np.stack([A8] * 3, -1).astype(np.uint8)
    d = dicom("rgb", rgb, 8, "RGB", tags=[("SamplesPerPixel", 3), ("PlanarConfiguration", 0), ("BitsAllocated", 8)])
    d.save_as("rgb.dcm", write_like_original=False)
    dicom("bits", x, tags=[("BitsStored", 0)]).save_as("bits.dcm", write_like_original=False)
    open("cut.dcm", "wb").write(open("dx.dcm", "rb").read()[:-20])
    os.mkdir("folder")
    dicom("dx", x).save_as("folder/x", write_like_original=False)


G = A16 % 4096 / 4095
P = np.where(S == -2000, 0, (S + 2048.0) / 4095)
WANT = dict(
    a8=A8 / 255, a16=A16 / 65535, rgb=A8 / 255, palette=A8 / 255, alpha=A8 / 255, big=A16 / 65535, white=1 - A8 / 255,
    white16=1 - A16 / 65535, large=A16 / 65535, tiled=A16 / 65535,
    colour=(A8 / 255 + A8 // 2 / 255 + A8 // 4 / 255) / 3, f=F, dx=G, one=1 - G, full=A16 / 65535, cr=G, rf=G, rle=G,
    sign=P, pad1=np.where(S == -2000, 0, 1 - P), slope=G, down=1 - G, both=G, folder=G)


def holds(path, *names):
    """The views in their order, 2e-7 of their largest value."""
    views = [np.array(v).reshape(H, W) for v in exr.read(path)]
    assert len(views) == len(names), len(views)
    for view, name in zip(views, names):
        scale, _, key = name.rpartition("*")
        a, _, b = scale.partition("+")
        want = WANT[key] * float(a or 1) + float(b or 0)
        assert np.abs(view - want).max() <= 2e-7 * np.abs(want).max(), (name, np.abs(view - want).max())


def lies(path, u, v, source):
    """All views on a detector about the origin."""
    data, at, more = open(path, "rb").read(), 8, True
    while more and data[at]:
        had, at = exr.header(data, at)
        more = data[5] & 0x10  # of many parts
        for key, want in (("ct:detU", u), ("ct:detV", v), ("ct:detCentre", "0,0,0"), ("ct:source", source)):
            got = [float(x) for x in had[key].split(b",")]
            assert np.allclose(got, [float(x) for x in want.split(",")]), (key, got)
        assert had["ct:beam"] == b"parallel"


def same(a, b):
    assert exr.read(a) == exr.read(b)


if __name__ == "__main__":
    globals()[sys.argv[1]](*sys.argv[2:])
