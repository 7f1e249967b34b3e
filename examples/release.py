#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What release.mk asks of the interpolation that the paper's programs call, scipy.ndimage.zoom.

    release.py cut IN MOST STEP         where ct-convert --crop is to cut: the middle of IN, at most MOST voxels
                                        along an axis, a multiple of STEP
    release.py zoom LR HR ORDER OUT     LR, enlarged to the voxels of HR as released: the first and the last
                                        voxel of LR and HR are laid upon each other; written on the grid of HR
    release.py top HR                   the largest value

Needs nibabel and SciPy.
"""
import sys

import nibabel as nib
import numpy as np
from scipy.ndimage import zoom


def cut(path, most, step):
    ends = []
    for n in nib.load(path).shape:
        size = min(n, int(most)) // int(step) * int(step)
        ends.append('%d:%d' % ((n - size) // 2, (n - size) // 2 + size))
    print(','.join(ends))


def enlarge(lr, hr, order, out):
    lr, hr = nib.load(lr), nib.load(hr)
    factor = np.array(hr.shape) / np.array(lr.shape)
    made = zoom(lr.get_fdata(), factor, order=int(order), prefilter=False)
    image = nib.Nifti1Image(made.astype(np.float32), hr.affine)
    image.header.set_xyzt_units('mm')
    nib.save(image, out)


def top(path):
    print('%.9g' % nib.load(path).get_fdata().max())


if __name__ == '__main__':
    {'cut': cut, 'zoom': enlarge, 'top': top}[sys.argv[1]](*sys.argv[2:])
