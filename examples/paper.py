#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The paper on a CT: paper.py IN OUT.nii [FACTOR [PRIOR [VIEWS STEPS GAUSSIANS ITERATIONS]]]

The low-resolution CT is projected, a diffusion prior makes its projections FACTOR times finer, Gaussians are fitted to
what these have beyond the projections of the upsampled CT, and are added to it."""
import os
import sys

import ctsr

if not 3 <= len(sys.argv) <= 9:
    sys.exit('usage: ' + __doc__.split('\n')[0].split(': ')[1])
path, out, factor, prior, views, steps, gaussians, iterations = (sys.argv[1:] + [None] * 8)[:8]
if os.path.exists(out):
    sys.exit(out + ': exists')  # said now, not when all is done
low = ctsr.read(path)
projections = ctsr.project(low, views=int(views or 100))
fine = ctsr.ddnm(projections, prior or None, factor=int(factor or 4), steps=int(steps or 0))
base = ctsr.upsample(low, factor=int(factor or 4), method='linear')
added = ctsr.fit(fine, base, gaussians=int(gaussians or 0), iterations=int(iterations or 0))
print('%d Gaussians' % len(added))
ctsr.write(ctsr.compose(base, added), out)
