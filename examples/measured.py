#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Scores of measured.mk: a slice against what the organisers of the Helsinki Tomography Challenge 2022 made.

    measured.py correlate FBP.mat SLICE...    correlation within 250 pixels of the middle, and the scale
    measured.py segment SEG.mat SLICE...      Matthews' coefficient of the slice above Otsu's threshold, or of another SEG.mat
    measured.py cupping SEG.mat SLICE...      density of the plastic within 80 pixels of its middle, and beyond 170; of holes
"""
import sys

import nibabel as nib
import numpy as np
import scipy.io as sio
from scipy import ndimage


def otsu(x):
    h, edge = np.histogram(x, 256)
    mid = (edge[1:] + edge[:-1]) / 2
    w, m = np.cumsum(h), np.cumsum(h * mid)
    with np.errstate(all="ignore"):
        return mid[np.nanargmax((m[-1] * w / w[-1] - m) ** 2 / (w * (w[-1] - w)))]


def segment(x, want):
    got, want = x if x.dtype == bool else x > otsu(x), want > 0
    tp, tn = float((got & want).sum()), float((~got & ~want).sum())
    fp, fn = float((got & ~want).sum()), float((~got & want).sum())
    return "%.4f" % ((tp * tn - fp * fn) / np.sqrt((tp + fp) * (tp + fn) * (tn + fp) * (tn + fn)))


def correlate(x, want):
    at = np.arange(512) - 255.5
    inside = np.hypot(*np.meshgrid(at, at)) < 250
    return "%.5f %.6f" % (np.corrcoef(x[inside], want[inside])[0, 1], np.polyfit(x[inside], want[inside], 1)[0])


def cupping(x, want):
    """All of it 4 pixels or more from an edge."""
    whole = ndimage.binary_fill_holes(want > 0)
    r = np.hypot(*(np.indices(x.shape) - np.argwhere(whole).mean(0)[:, None, None]))
    inside, holes = (ndimage.binary_erosion(m, iterations=4) for m in (want > 0, whole & (want == 0)))
    return "%.5f %.5f %.5f" % (x[inside & (r < 80)].mean(), x[inside & (r > 170)].mean(), x[holes].mean())


def load(name):
    return [v for k, v in sio.loadmat(name).items() if k[0] != "_"][0]


want = load(sys.argv[2])
for name in sys.argv[3:]:
    x = load(name) > 0 if name.endswith(".mat") else np.asarray(nib.load(name).dataobj)[:, :, 0]
    x = x.repeat(512 // x.shape[0], 0).repeat(512 // x.shape[1], 1)
    print(name, {"segment": segment, "correlate": correlate, "cupping": cupping}[sys.argv[1]](x, want))
