#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The two steps of blind.mk that are not commands of ctsr.

blind.py bare IN.nii OUT.nii   the voxels of a NIfTI of float32 or int16, rounded to 16 bits, without metadata
blind.py table BLIND.csv       cubic, known and blind side by side; the table goes to the standard output
"""
import array
import csv
import struct
import sys

RUNS = ['cubic', 'known', 'blind']
CHANCE = .3  # of banding, HU: src/quality/banding.h


def bare(source, target):
    with open(source, 'rb') as f:
        head = bytearray(f.read(348))
        size = struct.unpack_from('<8h', head, 40)[1:4]
        start = int(struct.unpack_from('<f', head, 108)[0])
        kind = {(16, 32): 'f', (4, 16): 'h'}.get(struct.unpack_from('<hh', head, 70))
        if not kind or struct.unpack_from('<4s', head, 344)[0] != b'n+1\0':
            sys.exit(f'{source}: is not a NIfTI file of float32 or int16')
        f.seek(start)
        data = array.array(kind)
        data.fromfile(f, size[0] * size[1] * size[2])
    struct.pack_into('<hh', head, 70, 4, 16)  # int16
    struct.pack_into('<fff', head, 108, 352, 1, 0)  # where the data begin; slope and intercept
    with open(target, 'wb') as f:
        f.write(bytes(head) + bytes(4))
        array.array('h', (max(-32768, min(32767, round(v))) for v in data)).tofile(f)


def table(path):
    with open(path, newline='') as f:
        rows = list(csv.DictReader(f))
    cases = {}
    for row in rows:
        cases.setdefault((row['scan'], row['case']), {})[row['run']] = row
    if not cases:
        sys.exit(f'{path}: no results')
    three = lambda runs, key, form: ' '.join(form % float(runs[r][key] or 'nan') for r in RUNS)
    losses, gains, false, deep, bands = [], [], 0, 0, 0
    line = '%-24s %-7s %-20s %-20s %6s  %-14s %-20s %s'
    print(line % ('scan', 'case', 'PSNR, dB: cubic,', 'SSIM: cubic,', 'blind', 'false: cubic,',
                  'inside soft tissue,', 'banding, HU:'))
    print(line % ('', '', 'known, blind', 'known, blind', 'loses', 'known, blind', 'HU: the same', 'the same'))
    for (scan, case), runs in cases.items():
        psnr = [float(runs[r]['psnr']) for r in RUNS]
        losses.append(psnr[1] - psnr[2])
        gains.append(psnr[2] - psnr[0])
        false += float(runs['blind']['structures-false']) > float(runs['known']['structures-false'])
        inside = [float(runs[r]['deep-smooth-rmse-hu'] or 'nan') for r in RUNS]
        deep += inside[2] > inside[0]
        banding = [float(runs[r]['banding-rms-hu'] or 'nan') for r in RUNS]
        bands += banding[2] > banding[0] + CHANCE
        print(line % (
            scan[:24], case, three(runs, 'psnr', '%6.2f'), three(runs, 'ssim-r2', '%6.4f'), '%.2f' % losses[-1],
            three(runs, 'structures-false', '%4.0f'), three(runs, 'deep-smooth-rmse-hu', '%6.2f'),
            three(runs, 'banding-rms-hu', '%5.2f')))
    n = len(losses)
    print(f'\n{n} cases: blind loses {sum(losses) / n:.2f} dB in the mean, {max(losses):.2f} at worst; '
          f'gains {sum(gains) / n:.2f} dB over cubic in the mean, {min(gains):.2f} at least')
    print(f'more false structures than with the operator known: {false}; '
          f'a larger error inside soft tissue than cubic: {deep}; more banding than cubic: {bands}')


if __name__ == '__main__':
    if len(sys.argv) == 4 and sys.argv[1] == 'bare':
        bare(*sys.argv[2:])
    elif len(sys.argv) == 3 and sys.argv[1] == 'table':
        table(sys.argv[2])
    else:
        sys.exit(__doc__)
