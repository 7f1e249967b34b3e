#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A thick series made thin, and a picture of both: superres.py IN OUT.nii.gz PICTURE.png [PRIOR]

IN is NIfTI, NRRD, MetaImage or a folder of DICOM. (Debian: python3-numpy, python3-matplotlib)"""
import os
import sys

import ctsr
import matplotlib
matplotlib.use('Agg')
import matplotlib.pyplot as plt

if not 4 <= len(sys.argv) <= 5:
    sys.exit('usage: ' + __doc__.split('\n')[0].split(': ')[1])
for path in sys.argv[2:4]:
    if os.path.exists(path):
        sys.exit(path + ': exists')  # said now, not when all is done
before = ctsr.read(sys.argv[1])
after = ctsr.superres(before, error=True, prior=(sys.argv[4:] or [None])[0],
                      progress=lambda what, done, total: print('\r%s %d/%d ' % (what, done, total), end='', file=sys.stderr))
print('\n%s times, %s, noise %.1f HU' % (after.report['operator'].factor, after.report['method'], after.report['operator'].noise))
ctsr.write(after, sys.argv[2])

figure, panels = plt.subplots(1, 3, figsize=(15, 5))
for panel, image, title, (lo, hi) in zip(panels, (before, after, after.error), ('before', 'after', 'predicted error, HU'),
                                         ((-200, 400), (-200, 400), (0, 50))):
    middle = image.data[:, image.data.shape[1] // 2].T  # coronal
    drawn = panel.imshow(middle, cmap='gray', vmin=lo, vmax=hi, origin='lower', aspect=image.spacing[2] / image.spacing[0])
    panel.set_title('%s, %g x %g mm' % (title, image.spacing[0], image.spacing[2]) if image is not after.error else title)
    panel.set_axis_off()
    figure.colorbar(drawn, ax=panel, shrink=.7)
figure.savefig(sys.argv[3], dpi=100, bbox_inches='tight')
