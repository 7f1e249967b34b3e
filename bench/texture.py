#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Made-up bone texture, for what doc/prior.md says of texture: texture.py FOLDER
writes spongyS-B.nii, 128^3 voxels: walls of 1100 HU, about S voxels thick, in marrow, blurred by B voxels, noise of 20 HU."""
import sys
import nibabel as nb
import numpy as np
from scipy.ndimage import gaussian_filter

for size in 2.5, 4:
    for blur in 1.0, 1.6:
        draw = np.random.default_rng(5)
        field = [gaussian_filter(draw.standard_normal((128,) * 3), s, mode='wrap') for s in (size, 3 * size)]
        wall, dense = (f / f.std() for f in field)
        v = np.where(np.abs(wall) < .35 + .1 * dense, 1100 + 150 * dense, -50.)
        v = gaussian_filter(v, blur, mode='wrap') + 20 * draw.standard_normal(v.shape)
        nb.save(nb.Nifti1Image(v.astype(np.float32), np.eye(4)), f'{sys.argv[1]}/spongy{size:g}-{blur:g}.nii')
