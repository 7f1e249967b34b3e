# SPDX-License-Identifier: Apache-2.0
"""Real series, against what pydicom and others read of them. places FILE FOLDER: a tilted, uneven stack; identical
FILE FILE; decoded FILE FOLDER: JPEG 2000 with wrong tile-part lengths, beside ffmpeg's own decoder."""
import glob
import subprocess
import sys

import nibabel as nib
import numpy as np
import pydicom

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
    """The last tile-part says 0, to the end; ffmpeg has a decoder of its own, which begins signed numbers at 0."""
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


{"places": places, "identical": identical, "decoded": decoded}[sys.argv[1]](*sys.argv[2:])
