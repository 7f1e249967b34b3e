# SPDX-License-Identifier: Apache-2.0
"""Tiny measured scans, as a laboratory stores them, and what ct-convert --projections makes of them."""
import sys

import numpy as np

import exr

VIEWS, COLS, ROWS = 12, 20, 3
SINO = np.random.default_rng(1).uniform(0, 2, (VIEWS, COLS))
LOST = SINO[:, None].repeat(ROWS, 1)
ANGLES = np.array([0, 20, 45, 70, 110, 140, 170, 200, 230, 260, 300, 340.5])
BASE = {"distanceSourceOrigin": 410.66, "distanceSourceDetector": 553.74, "distanceUnit": "mm",
        "angles": ANGLES, "pixelSize": 0.05, "pixelSizePost": 0.2,
        "effectivePixelSizePost": 0.2 * 410.66 / 553.74, "numDetectorsPost": COLS}


def matlab(name, sino=SINO, **changed):
    p = {k: v for k, v in {**BASE, **changed}.items() if v is not None}
    import scipy.io
    scipy.io.savemat(name, {"CtDataFull": {"type": "2d", "sinogram": sino, "parameters": p}}, do_compression=True)


def matlab73(name):
    """As MATLAB 7.3 writes: HDF5 behind 512 bytes, the first index fastest, text as numbers."""
    import h5py

    def of_class(at, word):  # all of its bytes are letters, although it says that zero ends it
        kind = h5py.h5t.C_S1.copy()
        kind.set_size(len(word))
        kind.set_strpad(h5py.h5t.STR_NULLTERM)
        a = h5py.h5a.create(at.id, b"MATLAB_class", kind, h5py.h5s.create(h5py.h5s.SCALAR))
        a.write(np.array(word.encode(), f"S{len(word)}"), kind)

    def group(parent, key, names):
        g = parent.create_group(key)
        fields = np.empty(len(names), object)
        fields[:] = [np.array([c.encode() for c in n], "S1") for n in names]
        of_class(g, "struct")
        g.attrs.create("MATLAB_fields", fields, dtype=h5py.vlen_dtype(np.dtype("S1")))
        return g

    with h5py.File(name, "w", userblock_size=512) as f:
        g = group(f, "CtDataFull", ["sinogram", "parameters"])
        p = group(g, "parameters", list(BASE))
        for at, key, x in [(g, "sinogram", SINO)] + [(p, k, v) for k, v in BASE.items()]:
            text = isinstance(x, str)
            x = np.array([[ord(c)] for c in x], np.uint16) if text else np.atleast_2d(np.asarray(x, float)).T
            d = at.create_dataset(key, data=x)
            of_class(d, "char" if text else "double")
            if text:
                d.attrs["MATLAB_int_decode"] = np.int32(2)
    with open(name, "r+b") as f:
        f.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM")


def counted():
    """Counts of a ball, exact but for a dead and a hot pixel."""
    rng = np.random.default_rng(2)
    flat = rng.uniform(20000, 30000, (ROWS, COLS))
    dark = rng.uniform(90, 110, (ROWS, COLS))
    c = np.arange(COLS) - (COLS - 1) / 2 + 2 * np.sin(np.arange(VIEWS))[:, None]
    want = np.repeat(np.sqrt(np.maximum(36 - c * c, 0))[:, None] / 4, ROWS, 1)
    data = dark + (flat - dark) * np.exp(-want)
    white = np.stack([flat - 50, flat + 50])
    data[:, 1, 7] = dark[1, 7]
    white[:, 1, 7] = dark[1, 7]  # dead
    data[:, 2, 11] = 65535  # hot in the views alone: it never changes
    return data, white, np.stack([dark] * 3), want


def exchange(name, units="degrees", data=None, white=True, theta=True):
    import h5py
    d, w, k, _ = counted()
    with h5py.File(name, "w") as f:
        f["exchange/data"] = d if data is None else data
        if white:
            f["exchange/data_white"] = w.mean(0) if white == "mean" else w
        f["exchange/data_dark"] = k[0] if white == "mean" else k
        if theta:
            f["exchange/theta"] = np.linspace(0, np.pi if units == "Radians" else 180, VIEWS, endpoint=False)
            if units:
                f["exchange/theta"].attrs["units"] = units


def make():
    import h5py
    import scipy.io
    matlab("a.mat")
    matlab73("b.mat")
    matlab("metres.mat", distanceUnit="m", distanceSourceOrigin=.41066, distanceSourceDetector=.55374,
           pixelSizePost=.0002, effectivePixelSizePost=.0002 * 410.66 / 553.74)
    matlab("inch.mat", distanceUnit="inch")
    matlab("units.mat", pixelSizePost=200)
    matlab("angles.mat", angles=ANGLES[:5])
    matlab("cols.mat", numDetectorsPost=560)
    matlab("none.mat", distanceSourceOrigin=None)
    matlab("behind.mat", distanceSourceDetector=300, effectivePixelSizePost=None)
    matlab("nan.mat", sino=np.where(np.arange(COLS) == 5, np.nan, SINO))
    scipy.io.savemat("other.mat", {"x": np.eye(3)})
    scipy.io.savemat("two.mat", {n: {"sinogram": SINO, "parameters": BASE} for n in ("CtDataFull", "CtDataLimited")})
    exchange("a.h5")
    exchange("rad.h5", "Radians")
    exchange("bare.h5", None)
    exchange("grad.h5", "gradians")
    exchange("noflat.h5", white=False)
    exchange("mean.h5", white="mean")
    exchange("noangle.h5", theta=False)
    exchange("zero.h5", data=np.zeros((VIEWS, ROWS, COLS)))
    with h5py.File("other.h5", "w") as f:
        f["x"] = np.eye(3)
    d, w, k, _ = counted()
    np.save("views.npy", d)
    np.save("whole.npy", np.round(d).astype(np.uint16))
    np.save("flat.npy", w)
    np.save("dark.npy", k[0])
    d.astype("<f4").tofile("views.raw")
    try:
        import tifffile
        for i, x in enumerate(d):
            tifffile.imwrite(f"v{i:02}.tif", x.astype(np.float32))
        tifffile.imwrite("flat.tif", w.mean(0).astype(np.float32))
        tifffile.imwrite("dark.tif", k[0].astype(np.float32))
        tifffile.imwrite("whole.tif", w.mean(0).astype(np.uint16))
    except ImportError:
        pass
    ringed = SINO[:, None].repeat(ROWS, 1) * .01 + np.sin(np.arange(COLS) / 5)
    ringed[:, :, 9] += .3
    np.save("ringed.npy", ringed)
    np.save("ringed5.npy", ringed[:, :, :5])
    # a small ball, which passes some pixels of air on the left in one view and on the right in another
    seen = np.round(10 + 8 * np.cos(np.arange(VIEWS) * np.pi / VIEWS))[:, None] - np.arange(COLS)
    np.save("small.npy", np.where(seen == 0, .1, 0)[:, None].repeat(ROWS, 1))
    np.save("lost.npy", np.where(np.arange(LOST.size).reshape(LOST.shape) == 310, np.inf, LOST))


def read(name):
    w, h = exr.size(name)
    return np.array(exr.read(name)).reshape(-1, h, w)


def vectors(name):
    """Source, centre of the detector and u of every view."""
    b, at, rows = open(name, "rb").read(), 8, []
    while b[at]:
        found, at = exr.header(b, at)
        rows.append([[float(x) for x in found[k].split(b",")] for k in ("ct:source", "ct:detCentre", "ct:detU")])
    return np.array(rows).transpose(1, 0, 2)


def integrals(name):
    return np.array_equal(read(name)[:, 0], SINO.astype(np.float32))


def placed(name):
    source, centre, u = vectors(name)
    a = np.radians(ANGLES)
    return (np.allclose(source, 410.66 * np.stack([np.cos(a), np.sin(a), 0 * a], 1), atol=1e-4) and
            np.allclose(np.linalg.norm(source - centre, axis=1), 553.74) and
            np.allclose(u, .2 * np.stack([-np.sin(a), np.cos(a), 0 * a], 1)))


def ball(name):
    off = np.abs(read(name) - counted()[3][:, :])
    flawed = np.zeros((ROWS, COLS), bool)
    flawed[1, 7] = flawed[2, 11] = True
    print(off[:, ~flawed].max(), off[:, flawed].max())
    return off[:, ~flawed].max() < 2e-4 and off[:, flawed].max() < .2


def degrees(name):
    source = vectors(name)[0]
    return np.allclose(np.degrees(np.arctan2(source[:, 1], source[:, 0])), np.linspace(0, 180, VIEWS, endpoint=False), atol=1e-4)


def unringed(name):
    m = read(name).mean(0)[0]
    return abs(m[9] - (m[8] + m[10]) / 2) < .03


def mended(name):
    want = SINO.copy()
    want[:, 5] = (SINO[:, 4] + SINO[:, 6]) / 2
    return np.allclose(read(name)[:, 0], want, atol=1e-6)


def watered(name):
    return np.allclose(read(name)[:, 0], SINO + .1 * SINO**2, atol=1e-6)


def lost_one(name):
    """All but the one value that is infinite."""
    return np.flatnonzero(read(name) != LOST.astype(np.float32)).tolist() == [310]


def every_other(name):
    return np.array_equal(read(name)[:, 0], SINO[2:9:3].astype(np.float32)) and len(vectors(name)[0]) == 3


if __name__ == "__main__":
    if sys.argv[1] == "make":
        make()
    else:
        sys.exit(not globals()[sys.argv[1]](sys.argv[2]))
