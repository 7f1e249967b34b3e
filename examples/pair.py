#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The two steps of pair.mk that are not commands of ctsr.

pair.py fit THICK.nii THIN.nii   how far each is cropped, and how many times finer THIN is: lines for a shell
pair.py table FOLDER [yes]       the table of pair.mk, from its files of figures
"""
import json
import math
import os
import subprocess
import sys

LEAST = 4      # slices that both cover
NEAR = .05     # of a voxel in plane: as ct-profile


def info(path):
    return json.loads(subprocess.run(['ct-info', '--json', path], check=True, stdout=subprocess.PIPE).stdout)


def lengths(affine):
    return [math.sqrt(sum(row[a]**2 for row in affine)) for a in range(3)]


def fit(thick_path, thin_path):
    thick, thin = info(thick_path), info(thin_path)
    spaces = [v.get('metadata', {}).get('space') for v in (thick, thin)]
    if all(spaces) and spaces[0] != spaces[1]:
        sys.exit('pair.mk: THICK and THIN are of two patients or frames of reference: a pair is two reconstructions of one scan')
    a, b = thick['affine'], thin['affine']
    mm = lengths(b)
    # voxels of THIN: where voxel 0 of THICK is, and its steps
    unit = [[row[d] / mm[d] for row in b] for d in range(3)]
    along = lambda d, v: sum(u * x for u, x in zip(unit[d], v)) / mm[d]
    start = [along(d, [a[r][3] - b[r][3] for r in range(3)]) for d in range(3)]
    step = [[along(d, [a[r][c] for r in range(3)]) for c in range(3)] for d in range(3)]
    size, fine = thick['size'], thin['size']
    for d in range(3):
        turned = sum(abs(step[d][c]) * size[c] for c in range(3) if c != d)
        if turned > NEAR or step[d][d] <= 0:
            sys.exit(f'pair.mk: the axes of THICK and THIN are not parallel: {turned:.2f} voxels apart')
    for d in range(2):
        off = max(abs(abs(p) - round(abs(p))) for p in (start[d], start[d] + (size[d] - 1) * step[d][d]))
        if abs(step[d][d] - 1) * size[d] > NEAR or off > NEAR:
            sys.exit('pair.mk: voxels in plane differ: %g and %g mm, moved by %.2f voxels: reconstruct both with one field of view'
                     % (lengths(a)[d], mm[d], off))
    factor = step[2][2]
    if abs(factor - round(factor)) * size[2] < NEAR:
        factor = float(round(factor))
    if not 1.25 <= factor <= 16:
        sys.exit('pair.mk: slices of THICK are %g mm apart, of THIN %g mm: THICK must be 1.25 to 16 times that'
                 % (lengths(a)[2], mm[2]))
    box = []
    for d in range(2):
        move = round(start[d])
        lo, hi = max(0, move), min(fine[d], move + size[d])
        box.append(((lo - move, hi - move), (lo, hi)))
    # whole thick slices within the thin ones, and the thin ones whose middle is in these
    kept = [k for k in range(size[2]) if start[2] + (k - .5) * factor >= -.5 - NEAR and
            start[2] + (k + .5) * factor <= fine[2] - .5 + NEAR]
    if len(kept) < LEAST or any(p[0][1] - p[0][0] < LEAST for p in box):
        sys.exit(f'pair.mk: THIN covers {len(kept)} whole slices of THICK: at least {LEAST} are needed')
    ends = [start[2] + (k + h) * factor for k, h in ((kept[0], -.5), (kept[-1], .5))]
    box.append(((kept[0], kept[-1] + 1), (max(0, math.ceil(ends[0] - NEAR)), min(fine[2], math.floor(ends[1] + NEAR) + 1))))
    for i, name in enumerate(('thick', 'thin')):
        print(name + '=' + ','.join('%d:%d' % p[i] for p in box))
    # how far slices of THIN are from those that a refined THICK has
    first = ends[0] + .5
    print('factor=%.9g\nbetween=%.3f' % (factor, abs(first - round(first)) if factor == round(factor) else .5))


def table(folder, profile=''):
    path = lambda name: os.path.join(folder, name)
    load = lambda name: json.load(open(path(name + '.json')))
    measured = profile and os.path.getsize(path('profile.txt')) > 0
    names = {'cubic': 'cubic', 'sr': '`ct-sr`', 'profile': '`ct-sr --profile`'}
    runs = [r for r in names if r != 'profile' or measured]
    all_, one, two = ({r: load(f'{r}-{part}') for r in runs} for part in ('all', '1', '2'))
    noise = load('noise').get('noise-hu') or 0
    first = all_[runs[0]]
    show = lambda v, form: '-' if v is None or math.isnan(v) else form % v
    without = lambda v: math.sqrt(v * v - noise * noise) if v > noise else float('nan')

    def row(name, form, value):
        print('| ' + ' | '.join([name] + [show(value(r), form) for r in runs]) + ' |')

    print('| | ' + ' | '.join(names[r] for r in runs) + ' |')
    print('|---|' + '---:|' * len(runs))
    row('PSNR, dB', '%.2f', lambda r: all_[r]['psnr'])
    row('PSNR, averaged in plane, sigma 1 pixel, dB', '%.2f', lambda r: one[r]['psnr'])
    row('PSNR, averaged in plane, sigma 2 pixels, dB', '%.2f', lambda r: two[r]['psnr'])
    row('SSIM', '%.4f', lambda r: all_[r]['ssim-r2'])
    row('error (RMS), HU', '%.1f', lambda r: all_[r]['rmse-hu'])
    row(f'error less noise of the thin slices ({noise:.1f} HU), HU', '%.1f', lambda r: without(all_[r]['rmse-hu']))
    for name, key, form in (('rise of edges, mm', 'edge-rise-%s-mm', '%.2f'), ('MTF 50 %, 1/mm', 'mtf50-%s', '%.3f')):
        if key % 'ref' in first:
            row('%s (thin slices: %s)' % (name, show(first[key % 'ref'], form)), form, lambda r: all_[r][key % 'test'])
    row('false structures', '%d', lambda r: all_[r]['structures-false'])
    row('missed structures', '%d', lambda r: all_[r]['structures-missed'])
    for end in [''] if 'surface-hu' in first else [k[10:] for k in first if k.startswith('surface-hu-')]:
        hu = first['surface-hu' + end]
        row(f'surface at {hu:g} HU, mean, mm', '%.3f', lambda r: all_[r]['surface-mean-mm' + end])
        row(f'surface at {hu:g} HU, 95 %, mm', '%.3f', lambda r: all_[r]['surface-p95-mm' + end])
    print('\n| predicted error of `ct-sr`, HU | measured | less noise |\n|---|---:|---:|')
    for k in list(range(1, 11)) + ['all']:
        if f'std-{k}' in all_['sr']:
            _, expected, actual = all_['sr'][f'std-{k}'][:3]
            print('| %s%.1f | %.1f | %s |' % ('all: ' if k == 'all' else '', expected, actual, show(without(actual), '%.1f')))
    if profile:
        for line in open(path('profile.log')):
            print('\n' + line.strip())
    between = float(dict(line.split('=') for line in open(path('fit')))['between'])
    if between > NEAR:
        print('\nSlices of THIN lie between those of the results, %.2f of a slice away: all results were interpolated there.' % between)


if __name__ == '__main__':
    steps = {'fit': fit, 'table': table}
    if len(sys.argv) < 3 or sys.argv[1] not in steps:
        sys.exit(__doc__)
    steps[sys.argv[1]](*sys.argv[2:])
