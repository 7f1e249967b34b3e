# SPDX-License-Identifier: Apache-2.0
"""What ct-convert writes, seen by nibabel; run in an empty folder with a.nii in it."""
import subprocess
import sys

import nibabel as nib
import numpy as np


def convert(*args):
    subprocess.run(("ct-convert", "-f") + args, check=True)


def check(name, good):
    print("#", "ok " if good else "BAD", name)
    if not good:
        sys.exit(1)


def both_forms(image):
    q, qcode = image.get_qform(coded=True)
    s, scode = image.get_sform(coded=True)
    return qcode == scode and np.allclose(q, s, atol=1e-4)


rng = np.random.default_rng(1)
a = nib.load("a.nii")
want = np.array([[[100 * k + 10 * j + i for k in range(2)] for j in range(3)] for i in range(4)])
check("raw voxels in their order", np.array_equal(a.get_fdata(), want - 1024))
check("stored as int16 without a scale",
      a.get_data_dtype() == np.int16 and (a.dataobj.slope, a.dataobj.inter) == (1, 0))
check("rows of raw voxels run to the left and back", np.allclose(a.affine[:3, :3], np.diag([-1, -2, 3])))
check("centred on the origin", np.allclose(a.affine @ [1.5, 1, 0.5, 1], [0, 0, 0, 1]))
check("qform is sform", both_forms(a) and a.header.get_xyzt_units()[0] == "mm")
check("history is in the header", b"ct-convert" in a.header.extensions[0].get_content())

for kind, dtype in (("u8", "<u1"), ("i8", "<i1"), ("u16:be", ">u2"), ("i32", "<i4"), ("f32:be", ">f4"),
                    ("f64", "<f8"), ("u32:be", ">u4")):
    x = rng.integers(0, 100, (5, 6, 7)).astype(dtype)
    x.ravel(order="F").tofile("x.raw")
    convert("--raw", "5x6x7:" + kind + ":1", "--rescale", "0.5", "--orient", "RAS", "x.raw", "x.nii")
    check("raw " + kind, np.array_equal(nib.load("x.nii").get_fdata(), x.astype("f8") * 0.5))

# any affine and type that nibabel writes: axes swapped, turned and oblique
for trial in range(6):
    q, _ = np.linalg.qr(np.eye(3)[rng.permutation(3)] + rng.normal(scale=0.15, size=(3, 3)))
    q *= rng.choice([-1, 1], 3)
    affine = np.eye(4)
    affine[:3, :3] = q * [0.5, 0.8, 2.5]
    affine[:3, 3] = [-100, 30, 7]
    data = rng.integers(-1000, 3000, (6, 5, 4)).astype([np.int16, np.float32, np.float64][trial % 3])
    image = (nib.Nifti1Image if trial % 2 else nib.Nifti2Image)(data, affine)
    image.set_qform(affine, 2)
    if trial % 3 == 0:
        image.header.set_slope_inter(2, -24)
    name = "n%d.nii%s" % (trial, ".gz" if trial > 2 else "")
    nib.save(image, name)
    convert(name, "m.nii.gz")
    m = nib.load("m.nii.gz")
    check("nibabel's file %d" % trial, np.allclose(m.get_fdata(), nib.load(name).get_fdata()) and
          np.allclose(m.affine, affine, atol=1e-4) and both_forms(m) and m.get_sform(coded=True)[1] == 2)
    # the voxels may change places, but not their places in the world
    convert("--reorient", "RAS", name, "r.nii")
    r = nib.load("r.nii")
    c = nib.as_closest_canonical(nib.load(name))
    check("--reorient %d" % trial, nib.aff2axcodes(r.affine) == ("R", "A", "S") and
          np.allclose(r.affine, c.affine, atol=1e-4) and np.allclose(r.get_fdata(), c.get_fdata()))

# an ellipsoid off the centre, on long voxels
i, j, k = np.meshgrid(np.arange(40), np.arange(36), np.arange(20), indexing="ij")
affine = np.diag([-1.0, -1.0, 2.5, 1.0])
affine[:3, 3] = [20, 15, -30]
blob = 1000 / (1 + np.exp(((i - 22) / 8.0) ** 2 + ((j - 14) / 6.0) ** 2 + ((k - 11) / 3.2) ** 2 - 1) ** 4) - 1000
nib.save(nib.Nifti1Image(blob.astype(np.float32), affine), "e.nii")
inside = blob > -500


def centre(image):
    d = image.get_fdata() + 1000
    ijk = np.array([(d * g).sum() for g in np.meshgrid(*map(np.arange, d.shape), indexing="ij")]) / d.sum()
    return image.affine[:3, :3] @ ijk + image.affine[:3, 3]


e = nib.load("e.nii")
for mm in (1.25, 0.8, 2.0):
    convert("--iso", str(mm), "e.nii", "i.nii")
    o = nib.load("i.nii")
    size = np.array(o.shape) * mm
    check("--iso %g: voxel size" % mm, np.allclose(o.header.get_zooms(), mm) and both_forms(o))
    check("--iso %g: field of view" % mm, np.all(np.abs(size - np.array(e.shape) * [1, 1, 2.5]) <= mm / 2 + 1e-6))
    mid = o.affine[:3, :3] @ ((np.array(o.shape) - 1) / 2) + o.affine[:3, 3]
    check("--iso %g: its centre" % mm,
          np.allclose(mid, e.affine[:3, :3] @ ((np.array(e.shape) - 1) / 2) + e.affine[:3, 3], atol=1e-3))
    check("--iso %g: the body stays" % mm, np.abs(centre(o) - centre(e)).max() < 0.02)

# e on grids that others have
ramp = nib.Nifti1Image((3 * i - 2 * j + 5.0 * k).astype(np.float32), affine)
nib.save(ramp, "ramp.nii")
for name, start, step, n in (("itself", (0, 0, 0), (1, 1, 1), (40, 36, 20)), ("a part", (3, 2, 5), (1, 1, 1), (20, 9, 11)),
                             ("finer", (4.3, 5.6, 6.2), (.5, .4, .25), (11, 40, 20)), ("half way", (2.5, 3, 4), (1, 1, 1), (30, 30, 9)),
                             ("coarser", (9, 9, 9), (2, 2, 1), (9, 9, 4))):
    grid = affine.copy()
    grid[:3, :3] *= step
    grid[:3, 3] = (affine @ [*start, 1])[:3]
    nib.save(nib.Nifti1Image(np.zeros(n, np.int16), grid), "like.nii")
    convert("--grid", "like.nii", "ramp.nii", "o.nii")
    o = nib.load("o.nii")
    at = np.meshgrid(*(s + t * np.arange(m) for s, t, m in zip(start, step, n)), indexing="ij")
    check("--grid of %s: the place of each voxel" % name, o.shape == n and np.allclose(o.affine, grid, atol=1e-4)
          and np.abs(o.get_fdata() - (3 * at[0] - 2 * at[1] + 5 * at[2])).max() < 1e-3)
for name, turned, at in (("turned", [[0, 1, 0], [1, 0, 0], [0, 0, 1]], (0, 0, 0)), ("flipped", np.diag([-1, 1, 1]), (39, 0, 0)),
                         ("oblique", [[1, .02, 0], [-.02, 1, 0], [0, 0, 1]], (5, 5, 5)), ("outside", np.eye(3), (4.1, 0, 0))):
    grid = affine.copy()
    grid[:3, :3] = affine[:3, :3] @ turned
    grid[:3, 3] = (affine @ [*at, 1])[:3]
    nib.save(nib.Nifti1Image(np.zeros((40, 36, 20), np.int16), grid), "like.nii")
    r = subprocess.run(("ct-convert", "--grid", "like.nii", "e.nii", "no.nii"), capture_output=True, text=True)
    check("--grid that is %s is refused" % name, r.returncode == 5 and "like.nii: axis 0" in r.stderr)

for n in (16, 32, 64):
    convert("--cube", str(n), "e.nii", "c.nii")
    o = nib.load("c.nii")
    back = np.linalg.inv(o.affine) @ e.affine  # indices of e to indices of the cube
    step = np.rint(back[:3, 3]).astype(int)
    check("--cube %d: whole voxels" % n, o.shape == (n, n, n) and np.allclose(back[:3, :3], np.eye(3), atol=1e-5)
          and np.allclose(back[:3, 3], step, atol=1e-3))
    full = np.full((n, n, n), -1024.0)
    lo = np.maximum(step, 0)
    hi = np.minimum(step + e.shape, n)
    full[lo[0]:hi[0], lo[1]:hi[1], lo[2]:hi[2]] = e.get_fdata()[
        lo[0] - step[0]:hi[0] - step[0], lo[1] - step[1]:hi[1] - step[1], lo[2] - step[2]:hi[2] - step[2]]
    check("--cube %d: voxels and padding" % n, np.array_equal(o.get_fdata(), full))
    if n < 20:
        com = np.array(np.nonzero(inside)).mean(axis=1) + step
        check("--cube %d: about the body" % n, np.abs(com - (n - 1) / 2).max() <= 0.5 + 1e-9)
convert("--type", "i16", "e.nii", "t.nii")
check("--type i16 rounds", np.array_equal(nib.load("t.nii").get_fdata(), np.rint(e.get_fdata())))
convert("--type", "f32", "a.nii", "t.nii")
check("--type f32", nib.load("t.nii").get_data_dtype() == np.float32)

# another tool's extension stays
image = nib.load("a.nii")
image.header.extensions.clear()
image.header.extensions.append(nib.nifti1.Nifti1Extension(4, b"<xml/>"))
nib.save(image, "x.nii")
convert("x.nii", "y.nii.gz")
codes = {x.get_code(): x.get_content() for x in nib.load("y.nii.gz").header.extensions}
check("a foreign extension survives", codes.get(4, b"").rstrip(b"\0") == b"<xml/>" and 6 in codes)
