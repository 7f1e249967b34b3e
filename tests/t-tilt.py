# SPDX-License-Identifier: Apache-2.0
"""Stacks that are no grid. make; check FILE COVERED: every voxel that a slice covers holds what
stands at its place in the patient, and so many do; the affine is orthonormal. itk FILE MHA: it is what ITK made of
it, which knows LPS."""
import sys

import nibabel as nib
import numpy as np
from dicom import COLUMNS, GAP, ORIGIN, ROWS, SLICES, axes, value, write

t = np.radians(20)


def stack(folder, uid, name, where, n=SLICES, **tags):
    """Slice k at where(k) mm: along across, down, normal."""
    across, down = axes(name)
    frame = np.stack([across, down, np.cross(across, down)])
    for k in range(n):
        write("%s/%02d.dcm" % (folder, (5 * k) % n), name, k, uid, ORIGIN + where(k) @ frame,
              at=lambda j, i, k=k: ORIGIN + where(k) @ frame + np.multiply.outer(i, across) * 0.5
              + np.multiply.outer(j, down) * 0.75, **tags)


def make():
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


def check(path, covered):
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
    assert abs(inside.mean() - covered) < 0.01, inside.mean()
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


if sys.argv[1] == "make":
    make()
elif sys.argv[1] == "sheared":
    sheared(sys.argv[2])
elif sys.argv[1] == "itk":
    itk(*sys.argv[2:])
else:
    check(sys.argv[2], float(sys.argv[3]))
