# SPDX-License-Identifier: Apache-2.0
"""measure_volume.py VOLUME.safetensors WORK BUILD DEV [OUT.safetensors]: is a trained volume network worth shipping?

Joins it with the shipped slice networks (join.py), and refines by both priors the cubes of CUBE voxels in the middle of the
CTs of DEV, reduced as CASES of its scans say. BUILD holds the commands. Prints PSNR, SSIM, false and missed structures of
each, then "better" or "not". Results stay in WORK: what was made of the same weights is not made again. OUT gets the joined
prior. A name of a CT that begins with "phantom" or "chestphantom" is a phantom's: not in the mean."""
import csv
import glob
import hashlib
import json
import os
import resource
import shutil
import struct
import subprocess
import sys

import numpy as np

import join

CUBE, WINDOW = 96, '-512:3071'
PROTOCOLS = {'P1': ['-p', 'P1'], 'P3': ['-p', 'P3'], 'P1 + 15 HU': ['-p', 'P1', '--noise', '15']}
MEANS, GAP = ['--decimate', 'mean', '--sigma', '0'], .6  # of the spacing: slices so thick, with gaps
# The scans of a network, and what reduces a CT to them.
CASES = {'4': {k: ['-x', '4', *v] for k, v in PROTOCOLS.items()},
         '2': {k: ['-x', '2', *v] for k, v in PROTOCOLS.items()},
         'thick-4': {'means': ['-x', '1,1,4', *MEANS], 'gaps': ['-x', '1,1,4', '--profile', 'box'],
                     'means + 15 HU': ['-x', '1,1,4', *MEANS, '--noise', '15']}}
GAIN, LOSS = .1, .02  # dB: the mean over patients in one of the first two cases, and what none may lose
PHANTOMS = ('phantom', 'chestphantom')
LARGEST = 8e6  # bytes, of a shipped network


def apart(path):
    """mm between slices of a NIfTI-1 file."""
    with open(path, 'rb') as f:
        return struct.unpack('<f', f.read(92)[88:])[0]


class Measure:
    def __init__(self, build, work):
        self.build, self.work = build, work

    def run(self, name, *args):
        command = [os.path.join(self.build, name), *args]
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        if done.returncode:
            raise SystemExit(f'{" ".join(command)}: {done.stderr.strip()}')
        return done.stdout

    def once(self, path, name, *args):
        """What the command makes of args, in path, unless it is there."""
        if not os.path.exists(path):
            self.run(name, '-q', '-f', *args, path[:-4] + '.part.nii')
            os.replace(path[:-4] + '.part.nii', path)
        return path

    def result(self, ct, scans, case, prior):
        """PSNR, SSIM, false, missed, CPU seconds."""
        stem = self.work + '/' + os.path.basename(ct).split('.')[0]
        cube = self.once(stem + '.cube.nii', 'ct-convert', '--cube', str(CUBE), ct)
        hr = self.once(stem + '.hr.nii', 'ct-degrade', '-x', '1', '--clip=' + WINDOW, cube)
        key = f'{stem}.{scans}.{case.replace(" ", "")}'
        gap = ['--slice-thickness', f'{GAP * 4 * apart(hr):.6g}'] if case == 'gaps' else []
        lr = self.once(key + '.lr.nii', 'ct-degrade', *CASES[scans][case], *gap, hr)
        kept = f'{key}.{hashlib.sha256(open(prior, "rb").read()).hexdigest()[:12]}.json'
        if not os.path.exists(kept):
            sr, begin = key + '.sr.nii', resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
            self.run('ct-upsample', '-q', '-f', '-m', 'prior', '-p', prior, lr, sr)
            seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - begin
            row = list(csv.DictReader(self.run('ct-metrics', '--harm', '--csv', '--expert', 'blob-sigma=1.5,3,6', '-w',
                                               WINDOW, hr, sr).splitlines()))[-1]
            os.remove(sr)
            with open(kept, 'w') as f:
                json.dump([float(row['psnr']), float(row['ssim-r2']), int(row['structures-false']),
                           int(row['structures-missed']), seconds], f)
        return json.load(open(kept))


def judge(rows, cases):
    """rows: (scan, case, before, after). The reasons why it is not better; none: it is."""
    why, patients = [], [r for r in rows if not r[0].startswith(PHANTOMS)]
    for scan, case, a, b in rows:
        if b[0] - a[0] < -LOSS:
            why.append(f'{scan}, {case}: {b[0] - a[0]:+.2f} dB')
        if b[2] > a[2]:
            why.append(f'{scan}, {case}: {b[2] - a[2]} more false structures')
    mean = {c: np.mean([b[0] - a[0] for _, k, a, b in patients if k == c]) for c in cases if patients}
    if not patients or max(mean[c] for c in list(cases)[:2]) < GAIN:
        why.append('the mean over patients gains less than %.2f dB: ' % GAIN
                   + ', '.join(f'{c} {v:+.3f}' for c, v in mean.items()))
    return why


def measure(volume, work, build, dev, out=None):
    """Is it better?"""
    scans = join.scans_of(join.read(volume)[0], volume)
    cases = CASES[scans]
    os.makedirs(work, exist_ok=True)
    joined = f'{work}/joined-{scans}.safetensors'
    size = join.join(joined, [volume])
    cts = sorted(p for p in glob.glob(dev + '/*.nii*') if 'real' not in os.path.basename(p))
    if not cts:
        raise SystemExit(f'{dev}: no CTs (*.nii, *.nii.gz)')
    print(f'volume-{scans}: {size / 1e6:.2f} MB' + (f', more than {LARGEST / 1e6:.0f}' if size > LARGEST else ''))
    print(f'{"scan":36} {"case":13}  PSNR    SSIM   false missed CPU s |  PSNR    SSIM   false missed CPU s |   gain',
          flush=True)
    rows, m = [], Measure(build, work)
    for case in cases:
        for ct in cts:
            scan = os.path.basename(ct).split('.')[0]
            a, b = (m.result(ct, scans, case, prior) for prior in (join.SHIPPED, joined))
            rows.append((scan, case, a, b))
            text = [f'{v[0]:6.3f} {v[1]:7.4f} {v[2]:6} {v[3]:6} {v[4]:6.1f}' for v in (a, b)]
            print(f'{scan:36} {case:13} {text[0]} | {text[1]} | {b[0] - a[0]:+.3f}', flush=True)
    why = judge(rows, cases) + ([f'{size} bytes'] if size > LARGEST else [])
    print('not: ' + '; '.join(why) if why else 'better')
    if out:
        shutil.copyfile(joined, out)
    return not why


if __name__ == '__main__':
    if len(sys.argv) not in (5, 6):
        raise SystemExit(__doc__)
    sys.exit(not measure(*sys.argv[1:]))
