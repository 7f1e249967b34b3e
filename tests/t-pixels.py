# SPDX-License-Identifier: Apache-2.0
"""Small series whose PixelData, or the layout around it, is unusual. make; check FILE FILE...: the first is what the
others must be."""
import os
import struct
import sys
import zlib

import numpy as np

ROWS, COLUMNS, SLICES = 6, 8, 3
LITTLE, IMPLICIT, BIG, GE = "1.2.840.10008.1.2.1", "1.2.840.10008.1.2", "1.2.840.10008.1.2.2", "1.2.840.113619.5.2"
JPEG, JPEG2000, RLE = "1.2.840.10008.1.2.4.70", "1.2.840.10008.1.2.4.90", "1.2.840.10008.1.2.5"
LONG = ("OB", "OW", "OF", "OD", "UN", "UT", "SQ", "OL")


def values(k):
    j, i = np.mgrid[:ROWS, :COLUMNS]
    return 40 + 97 * j + 211 * i + 300 * k  # stored, -1024 of it HU; 12 bits, the lowest too


class Form:
    """How elements are written."""

    def __init__(self, big=False, implicit=False):
        self.order, self.implicit = ">" if big else "<", implicit

    def element(self, tag, vr, value, length=None):
        n = len(value) if length is None else length
        head = struct.pack(self.order + "HH", tag >> 16, tag & 0xffff)
        if self.implicit:
            return head + struct.pack(self.order + "I", n) + value
        if vr in LONG:
            return head + struct.pack(self.order + "2sHI", vr.encode(), 0, n) + value
        return head + struct.pack(self.order + "2sH", vr.encode(), n) + value

    def text(self, tag, vr, value):
        value += ("\0" if vr == "UI" else " ") * (len(value) % 2)
        return self.element(tag, vr, value.encode())

    def short(self, tag, *value):
        return self.element(tag, "US", struct.pack(self.order + "%dH" % len(value), *value))

    def item(self, value, tag=0xe000):
        return struct.pack(self.order + "HHI", 0xfffe, tag, len(value)) + value


def meta(syntax):
    f = Form()
    body = f.text(0x00020002, "UI", "1.2.840.10008.5.1.4.1.1.2") + f.text(0x00020010, "UI", syntax)
    return b"\0" * 128 + b"DICM" + f.element(0x00020000, "UL", struct.pack("<I", len(body))) + body


def header(k, f, **o):
    """All elements before PixelData; o: what differs, or None for what is left out."""
    o = dict({"rows": ROWS, "columns": COLUMNS, "allocated": 16, "stored": 12, "high": 11, "signed": 0, "samples": 1,
              "colours": "MONOCHROME2", "intercept": "-1024", "first": b"", "more": b""}, **o)
    b = f.text(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.2") + f.text(0x00080018, "UI", "1.2.3.%d" % (k + 1))
    b += f.text(0x00080060, "CS", "CT") + o["first"] + f.text(0x00100020, "LO", "P")
    b += f.text(0x0020000d, "UI", "1.2.3") + f.text(0x0020000e, "UI", "1.2.4") + f.text(0x00200013, "IS", str(k + 1))
    b += f.text(0x00200032, "DS", "-3\\-4\\%g" % (2.5 * k)) + f.text(0x00200037, "DS", "1\\0\\0\\0\\1\\0")
    b += f.short(0x00280002, o["samples"])
    if o["colours"]:
        b += f.text(0x00280004, "CS", o["colours"])
    if "frames" in o:
        b += f.text(0x00280008, "IS", str(o["frames"]))
    b += f.short(0x00280010, o["rows"]) + f.short(0x00280011, o["columns"])
    b += f.text(0x00280030, "DS", "1.25\\0.75") + f.short(0x00280100, o["allocated"])
    if o["stored"]:
        b += f.short(0x00280101, o["stored"])
        if o["high"] is not None:
            b += f.short(0x00280102, o["high"])
        b += f.short(0x00280103, o["signed"])
    return b + f.text(0x00281052, "DS", o["intercept"]) + f.text(0x00281053, "DS", "1") + o["more"]


def fragments(items, table=b""):
    f = Form()
    return f.element(0x7fe00010, "OB", b"".join(f.item(b) for b in [table] + items) + f.item(b"", 0xe0dd), 0xffffffff)


def put(name, k, data):
    os.makedirs(name, exist_ok=True)
    with open("%s/%d.dcm" % (name, k), "wb") as f:
        f.write(data)


def series(name, pixels, syntax=LITTLE, big=False, implicit=False, vr="OW", start=None, end=b"", tag=0x7fe00010, **o):
    """pixels(values) are the bytes; or an element of its own, if it is one."""
    f = Form(big, implicit)
    for k in range(SLICES):
        p = pixels(values(k))
        data = p if p[:2] == b"\xe0\x7f" else f.element(tag, vr, p)
        own = {key: v(k) if callable(v) else v for key, v in o.items()}
        put(name, k, (meta(syntax) if start is None else start) + header(k, f, **own) + data + end)


def little(v):
    return v.astype("<u2").tobytes()


def layouts():
    series("plain", little)
    series("no-meta", little, start=b"")
    series("no-meta-big", lambda v: v.astype(">u2").tobytes(), start=b"", big=True)
    series("no-meta-preamble", little, start=b"\0" * 128 + b"DICM")
    series("meta-no-preamble", little, start=meta(LITTLE)[132:])
    f = Form()
    for name, syntax in ("big", BIG), ("jpeg", JPEG), ("deflated", "1.2.840.10008.1.2.1.99"):
        series("inside-says-" + name, little, start=meta(LITTLE) + f.text(0x00020010, "UI", syntax))
    series("ge", lambda v: v.astype(">u2").tobytes(), GE, implicit=True)
    series("end-padding", little, end=f.element(0xfffcfffc, "OB", bytes(64)))
    series("end-rubbish", little, end=bytes((i * 37 + 11) % 256 for i in range(333)))
    for k in range(SLICES):
        c = zlib.compressobj(9, zlib.DEFLATED, -15)
        body = header(k, f) + f.element(0x7fe00010, "OW", little(values(k)))
        put("deflated", k, meta("1.2.840.10008.1.2.1.99") + c.compress(body) + c.flush() + b"\0")


def numbers():
    series("high-15", lambda v: little(v << 4 | 5), high=15)
    series("high-15-but-low", little, high=15)
    series("high-15-but-low-once", little, high=lambda k: 15 if k == 1 else 11)
    turn = iter(range(9))
    series("high-15-both", lambda v: little(v << 4 | 5 if next(turn) % 2 else v), high=15)
    series("high-3", little, high=3)
    series("high-none", little, high=None)
    hu = lambda v: (v - 1024).astype("<i2")
    series("signed", lambda v: hu(v).tobytes(), signed=1, intercept="0")
    series("signed-zeros-above", lambda v: (hu(v).astype("<u2") & 0xfff).tobytes(), signed=1, intercept="0")
    overlay = Form().short(0x60000100, 16) + Form().short(0x60000102, 12)
    series("overlay", lambda v: little(v | 0x1000 * (v % 2)), more=overlay)
    series("above", lambda v: little(v | 0x5000))
    metal = lambda v: np.where(v == v.max(), 5000, v)
    series("metal-16", lambda v: little(metal(v)), stored=16, high=15)
    series("metal", lambda v: little(metal(v)))
    series("metal-signed", lambda v: hu(metal(v)).tobytes(), signed=1, intercept="0")
    far = 1 << 31
    series("wide", lambda v: (v + far).astype("<u4").tobytes(), allocated=32, stored=32, high=31, intercept=str(-1024 - far))
    series("wide-signed", lambda v: (v - far + 9).astype("<i4").tobytes(), allocated=32, stored=32, high=31, signed=1,
           intercept=str(far - 9 - 1024))
    full = dict(stored=16, high=15, intercept="0")
    series("signed-says-not", lambda v: hu(v).tobytes(), **full)
    series("saturated", lambda v: little(np.where(v == v.max(), 65535, v)), **{**full, "intercept": "-1024"})
    series("float", lambda v: v.astype("<f4").tobytes(), vr="OF", tag=0x7fe00008, allocated=32, stored=None)
    series("double", lambda v: v.astype("<f8").tobytes(), vr="OD", tag=0x7fe00009, allocated=64, stored=None)
    big = dict(syntax=BIG, big=True)
    series("big-bytes", lambda v: v.astype(">u2").tobytes(), vr="OB", **big)
    series("big-bytes-unturned", little, vr="OB", **big)
    series("big-bytes-full", lambda v: v.astype(">u2").tobytes(), vr="OB", stored=16, high=15, **big)
    series("big-words-32", lambda v: v.astype(">u4").tobytes(), allocated=32, stored=32, high=31, **big)
    eight = dict(allocated=8, stored=8, high=7)
    series("eight", lambda v: (v >> 4).astype("u1").tobytes(), vr="OB", **eight)
    series("eight-big", lambda v: np.frombuffer((v >> 4).astype("u1"), "<u2").astype(">u2").tobytes(), **eight, **big)
    odd = dict(eight, rows=5, columns=7)
    series("odd", lambda v: (v[:5, :7] >> 4).astype("u1").tobytes(), vr="OB", **odd)
    series("odd-padded", lambda v: (v[:5, :7] >> 4).astype("u1").tobytes() + b"\1", vr="OB", **odd)
    f = Form()
    padding = f.element(0x00280120, "SS", struct.pack("<h", -2000))
    edge = lambda by: lambda v: np.where(np.arange(COLUMNS) == 0, -2000 + by * (v % 5 - 2), hu(v)).astype("<i2").tobytes()
    s16 = dict(stored=16, high=15, signed=1, intercept="0")
    series("padding", edge(0), more=padding, **s16)
    series("padding-lossy", edge(3), more=padding + f.text(0x00282110, "CS", "01"), **s16)


def wrong():
    series("rows-half", little, rows=ROWS // 2)
    f = Form()
    slope = lambda v: f.text(0x00281053, "DS", v)
    series("odd-nul", little, first=f.element(0x00180050, "DS", b"2.5\0\0"))
    series("said-twice", little, more=slope("2"))
    series("said-twice-same", little, more=slope("1"))
    series("said-behind", little, end=slope("2"))
    thick = lambda v: f.text(0x00180050, "DS", v)
    series("thickness-twice", little, first=thick("2.5"), more=thick("5"))
    series("thickness-twice-same", little, first=thick("2.5"), more=thick("2.5"))
    intercept = lambda v: f.text(0x00281052, "DS", v)
    group = lambda *v: f.element(0x52009229, "SQ", f.item(f.element(0x00289145, "SQ", f.item(b"".join(map(intercept, v))))))
    series("item-twice", little, more=group("-1024", "0"))
    series("items-two", little, more=group("-1024") + f.element(0x52009230, "SQ", f.item(b"")))
    series("groups-twice", little, more=group("-1024") + group("0"))
    pixels = lambda tag, vr, n: f.element(tag, vr, bytes(n))
    series("pixels-twice", little, end=pixels(0x7fe00010, "OW", 2 * ROWS * COLUMNS))
    series("pixels-and-floats", little, more=pixels(0x7fe00008, "OF", 4 * ROWS * COLUMNS))
    series("pixels-behind-cut", little, end=pixels(0x7fe00010, "OW", 2 * ROWS * COLUMNS)[:-2])
    series("float-far", lambda v: np.where(v == v.max(), 1e30, v).astype("<f4").tobytes(), vr="OF", tag=0x7fe00008, allocated=32,
           stored=None)
    series("rows-none", little, rows=0)
    series("columns-none", little, columns=0)
    series("columns-less", little, columns=COLUMNS - 1)
    series("allocated-8", little, allocated=8, stored=8, high=7)
    series("two-more", lambda v: little(v) + b"\0\0")
    series("two-more-not-zero", lambda v: little(v) + b"\0\1")
    series("four-more", lambda v: little(v) + bytes(4))
    series("odd-three-more", lambda v: (v[:5, :7] >> 4).astype("u1").tobytes() + b"\0\0\0", vr="OB", allocated=8, stored=8,
           high=7, rows=5, columns=7)
    f = Form()
    put("frame-less", 0, meta(LITTLE) + header(0, f, frames=2)
        + f.element(0x7fe00010, "OW", b"".join(little(values(k)) for k in range(SLICES))))
    series("palette", little, colours="PALETTE COLOR")
    series("ybr", little, colours="YBR_FULL")
    table = f.element(0x00283000, "SQ", f.item(f.short(0x00283002, 2, 0, 16)))
    series("table", little, more=table)
    for syntax in "1.2.840.10008.1.2.4.110", "1.2.840.10008.1.2.4.100", "1.2.3.4":
        series("syntax-" + syntax, lambda v: fragments([b"\xff\x0a" + bytes(40)]), syntax)


def rle(v, copies=1):
    """Two segments of literal runs."""
    b = little(v)
    halves = [b"".join(bytes([len(p[n:n + 32]) - 1]) + p[n:n + 32] for n in range(0, len(p), 32))
              for p in (b[1::2] * copies, b[::2] * copies)]
    halves = [h + b"\0" * (len(h) % 2) for h in halves]
    return struct.pack("<16I", 2, 64, 64 + len(halves[0]), *[0] * 13) + b"".join(halves)


def compressed():
    series("rle", lambda v: fragments([rle(v)]), RLE)
    series("rle-two-fragments", lambda v: fragments([rle(v)[:80], rle(v)[80:]]), RLE)
    series("rle-native", lambda v: fragments([rle(v)]), LITTLE)
    series("rle-no-meta", lambda v: fragments([rle(v)]), start=b"")
    series("rle-rows-half", lambda v: fragments([rle(v)]), RLE, rows=ROWS // 2)
    series("rle-twice", lambda v: fragments([rle(v, 2)]), RLE)
    series("native-jpeg", little, JPEG)
    series("native-rle", little, RLE)


def sequence(n, defined, vr="SQ", tag=0x00081115, implicit=False):
    f = Form(implicit=implicit)
    if defined:
        b = b""
        for _ in range(n):
            b = f.element(tag, vr, f.item(b))
        return b
    return ((f.element(tag, vr, b"", 0xffffffff) + struct.pack("<HHI", 0xfffe, 0xe000, 0xffffffff)) * n
            + (f.item(b"", 0xe00d) + f.item(b"", 0xe0dd)) * n)


def deep():
    own = Form().text(0x00090010, "LO", "ACME")
    for n in 60, 5000, 100000:
        for name, b in (("undefined", sequence(n, False)), ("private", own + sequence(n, False, tag=0x00091001)),
                        ("bytes", own + sequence(n, False, "OB", 0x00091001)),
                        ("defined", sequence(n, True) if n < 9999 else b""),
                        ("unknown", own + sequence(n, True, "UN", 0x00091001) if n < 9999 else b"")):
            if b and not (n == 60 and name == "bytes"):
                series("deep-%s-%d" % (name, n), little, first=b)
                put("nameless-%s-%d" % (name, n), 0, header(0, Form(), first=b))
        series("deep-implicit-%d" % n, little, IMPLICIT, implicit=True, first=sequence(n, False, implicit=True))
        series("deep-after-%d" % n, little, end=sequence(n, False, tag=0xfff1fff1))
    f = Form()
    series("unsorted", little, first=b"".join(f.text(0x00090000 + k, "LO", "ab") for k in range(50000, 0x100, -1)))


def make():
    for part in (layouts, numbers, wrong, compressed, deep):
        part()


def recode(folder, *tails):
    """FOLDER-N: its one fragment with other bytes behind the end of the picture; FOLDER-half: half of its rows."""
    import pydicom
    from pydicom.encaps import decode_data_sequence
    for n, tail in enumerate(tails):
        for k in range(SLICES):
            d = pydicom.dcmread("%s/%d.dcm" % (folder, k))
            b = decode_data_sequence(d.PixelData)[0].rstrip(b"\0") + tail
            b = b[:-len(tail)] * 2 if tail == b"again" else b
            with open("%s/%d.dcm" % (folder, k), "rb") as f:
                whole = f.read()
            at = whole.rindex(b"\xe0\x7f\x10\0OB")
            put("%s-%d" % (folder, n), k, whole[:at] + fragments([b]))
            if n == 0:
                at2 = whole.index(struct.pack("<HH2sHH", 0x28, 0x10, b"US", 2, ROWS))
                half = whole[:at2 + 8] + struct.pack("<H", ROWS // 2) + whole[at2 + 10:]
                put(folder + "-half", k, half)


def check(first, *others):
    import nibabel as nib
    want = nib.load(first)
    for path in others:
        image = nib.load(path)
        assert image.shape == want.shape, (path, image.shape)
        assert np.array_equal(image.get_fdata(), want.get_fdata()), path
        assert np.array_equal(image.affine, want.affine), path


def truth(path):
    """Of `plain`."""
    import nibabel as nib
    v = nib.load(path).get_fdata()
    assert v.shape == (COLUMNS, ROWS, SLICES), v.shape
    for k in range(SLICES):
        assert np.array_equal(v[..., k].T, values(k) - 1024)


if __name__ == "__main__":
    {"make": make, "check": check, "truth": truth, "recode": lambda f: recode(f, b"\xff", b"\x37\xff\0\x12\x99", b"again")}[
        sys.argv[1]](*sys.argv[2:])
