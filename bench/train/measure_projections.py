#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a diffusion prior of projections is worth beside the shipped one.

    bench/train/measure_projections.py PRIOR WORK BUILD DEV

DEV holds CTs that were not trained on. From the middle of three a cube of SIDE^3 voxels is cut, clipped and made 4
times coarser (P1), as in examples/paper.mk. Projections of the coarse cube go through ct-ddnm as ct-sr --paper calls
it, once with each prior, and are compared with those of the cube itself: PSNR, dB of the largest value, of VIEWS
views instead of 100. `cubic` is of projections of the cubically refined cube. `held` is the same with the means of the true
projections for those of the coarse cube: there is nothing between the result and the truth but the prior.
"""
import math
import os
import subprocess
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'tests'))
from exr import read  # noqa: E402

SCANS = ('head_invesalius', 'chest_lidc0314', 'torso_totalseg')
SIDE, FACTOR, VIEWS, WINDOW = 96, 4, 6, '-512:3071'


def psnr(truth, test):
    truth, test = read(truth), read(test)
    top = max(map(max, truth))
    square = sum((x - y) ** 2 for a, b in zip(truth, test) for x, y in zip(a, b))
    return 10 * math.log10(top ** 2 * sum(map(len, truth)) / square) if square else math.inf


def table(priors, work, build, dev):
    """Rows of (scan, {column: PSNR}); priors: name -> file."""
    for scan in SCANS:
        volume = [f for f in sorted(os.listdir(dev)) if f.startswith(scan)]
        if not volume:
            raise SystemExit('%s: no CT %s*: expected the CTs to test on' % (dev, scan))
        folder = os.path.join(work, scan)
        os.makedirs(folder, exist_ok=True)

        def run(tool, *words):
            """The last word is the file that is made, unless it is there."""
            if not os.path.exists(os.path.join(folder, words[-1])):
                subprocess.run([os.path.abspath(os.path.join(build, tool)), '-q', *words], cwd=folder, check=True)

        def ddnm(prior, low, out):
            run('ct-ddnm', '--prior=' + os.path.abspath(prior), '-x%d' % FACTOR, '--steps=50', '--sigma-y=0.0015',
                low, out)
            return psnr(*(os.path.join(folder, f) for f in ('true.exr', out)))

        see = '--views=%d' % VIEWS, '--window=' + WINDOW, '--overshoot'
        run('ct-convert', '--cube=%d' % SIDE, os.path.abspath(os.path.join(dev, volume[0])), 'cube.nii')
        run('ct-degrade', '-x1', '--clip=' + WINDOW, 'cube.nii', 'hr.nii')
        run('ct-degrade', '-x%d' % FACTOR, '-pP1', 'hr.nii', 'lr.nii')
        run('ct-upsample', '-x%d' % FACTOR, '--method=cubic', 'lr.nii', 'up.nii')
        run('ct-project', *see, 'hr.nii', 'true.exr')
        run('ct-project', *see, 'lr.nii', 'lr.exr')
        run('ct-project', *see, 'up.nii', 'up.exr')
        run('ct-project', *see, '--coarsen=%d' % FACTOR, '--pixel=mean', 'hr.nii', 'mean.exr')
        row = {'cubic': psnr(*(os.path.join(folder, f) for f in ('true.exr', 'up.exr')))}
        for name, prior in priors.items():
            row[name] = ddnm(prior, 'lr.exr', 'sr-%s.exr' % name)
            row[name + ' held'] = ddnm(prior, 'mean.exr', 'held-%s.exr' % name)
        yield scan, row


def measure(prior, work, build, dev):
    """Prints the table and 'better' or 'not': is the mean over the scans above that of the shipped prior, both of
    the published chain and of what is held to true means? Returns it as a truth value."""
    for scan in SCANS:  # what earlier priors made is of others
        for f in ('sr-new.exr', 'held-new.exr', 'sr-shipped.exr', 'held-shipped.exr'):
            if os.path.exists(os.path.join(work, scan, f)):
                os.remove(os.path.join(work, scan, f))
    columns = 'cubic', 'shipped', 'new', 'shipped held', 'new held'
    shipped = os.path.join(build, 'prior.safetensors')
    rows = []
    print('PSNR (dB) of projections, %d^3, %dx P1, %d views' % (SIDE, FACTOR, VIEWS))
    print('%-20s' % 'scan' + ''.join('%14s' % c for c in columns))
    for scan, row in table({'shipped': shipped, 'new': prior}, work, build, dev):
        rows.append(row)
        print('%-20s' % scan + ''.join('%14.2f' % row[c] for c in columns), flush=True)
    mean = {c: sum(r[c] for r in rows) / len(rows) for c in columns}
    print('%-20s' % 'mean' + ''.join('%14.2f' % mean[c] for c in columns))
    better = mean['new'] > mean['shipped'] and mean['new held'] > mean['shipped held']
    print('better' if better else 'not')
    return better


if __name__ == '__main__':
    if len(sys.argv) != 5:
        raise SystemExit('usage: measure_projections.py PRIOR WORK BUILD DEV')
    sys.exit(not measure(*sys.argv[1:]))
