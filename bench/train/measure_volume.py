"""measure_volume.py VOLUME.safetensors WORK BUILD DEV [OUT.safetensors]: is a trained volume network worth shipping?

Joins it with the shipped slice networks (first and last layer as F16), and refines by both priors the cubes of CUBE
voxels in the middle of the CTs of DEV, reduced 4 times. BUILD holds the commands. Prints PSNR, SSIM, false and missed
structures of each, then "better" or "not". Results stay in WORK: what was made of the same weights is not made again.
OUT gets the joined prior. A name of a CT that begins with "phantom" or "chestphantom" is a phantom's: not in the mean."""
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

CUBE, WINDOW = 96, '-512:3071'
CASES = {'P1': ['-p', 'P1'], 'P3': ['-p', 'P3'], 'P1 + 15 HU': ['-p', 'P1', '--noise', '15']}
GAIN, LOSS = .1, .02  # dB: the mean over patients, and what none may lose
PHANTOMS = ('phantom', 'chestphantom')
LARGEST = 8e6  # bytes, of a shipped network
UNUSED = ('error', 'error_bias')
HERE = os.path.dirname(os.path.abspath(__file__))
KINDS = {'F16': '<f2', 'F32': '<f4'}


def read(path):
    raw = open(path, 'rb').read()
    try:
        size = struct.unpack('<Q', raw[:8])[0]
        return json.loads(raw[8:8 + size]), raw[8 + size:]
    except (struct.error, ValueError):
        raise SystemExit(f'{path}: not a safetensors file')


def values(entry, data, path, name):
    if entry['dtype'] not in KINDS:
        raise SystemExit(f'{path}: {name} is {entry["dtype"]}; expected F16 or F32')
    t = np.frombuffer(data[slice(*entry['data_offsets'])], KINDS[entry['dtype']]).reshape(entry['shape'])
    if not np.isfinite(t).all():
        raise SystemExit(f'{path}: {name} has values that are not finite')
    return t


def halved_first(t):
    """F16, so that the sum over the voxels of a cell stays: voxels are of 1000 HU, their differences of 10."""
    w = t.astype(np.float64).reshape(t.shape[0], 2, 64, 27)
    out, order = np.zeros(w.shape, np.float16), np.argsort(-np.abs(w), axis=2)
    rest = np.zeros_like(w[:, :, :1])
    for k in range(w.shape[2]):
        i = order[:, :, k:k + 1]
        v = np.take_along_axis(w, i, 2) + rest
        np.put_along_axis(out, i, v.astype(np.float16), 2)
        rest = v - v.astype(np.float16)
    return out.reshape(t.shape)


def join(shipped, volume, path):
    """The tensors of both; returns the bytes of the network."""
    head, data = {}, b''
    base, base_data = read(shipped)
    more, more_data = read(volume)
    if 'volume-4.shape' not in more:
        raise SystemExit(f'{volume}: no tensor volume-4.shape: expected what volume.py exports')
    if '__metadata__' in base:
        head['__metadata__'] = base.pop('__metadata__')
    more.pop('__metadata__', None)

    def put(name, entry, raw):
        nonlocal data
        head[name] = {**entry, 'data_offsets': [len(data), len(data) + len(raw)]}
        data += raw

    for name, entry in base.items():
        if not name.startswith('volume-4.'):
            put(name, entry, base_data[slice(*entry['data_offsets'])])
    before = len(data)
    for name, entry in more.items():
        part = name.split('.', 1)[-1]
        if not name.startswith('volume-4.') or part in UNUSED:
            continue
        t = values(entry, more_data, volume, name)
        if part == 'first' and t.ndim == 2 and t.shape[1] == 2 * 64 * 27:
            t = halved_first(t)
        elif part == 'last':
            t = t.astype(np.float16)
        put(name, {'dtype': 'F16' if t.dtype == np.float16 else 'F32', 'shape': list(t.shape)}, t.tobytes())
    text = json.dumps(head, separators=(',', ':')).encode()
    text += b' ' * (-len(text) % 8)
    with open(path + '.part', 'wb') as f:
        f.write(struct.pack('<Q', len(text)) + text + data)
    os.replace(path + '.part', path)
    return len(data) - before


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

    def result(self, ct, case, prior):
        """PSNR, SSIM, false, missed, CPU seconds."""
        stem = self.work + '/' + os.path.basename(ct).split('.')[0]
        cube = self.once(stem + '.cube.nii', 'ct-convert', '--cube', str(CUBE), ct)
        hr = self.once(stem + '.hr.nii', 'ct-degrade', '-x', '1', '--clip=' + WINDOW, cube)
        key = stem + '.' + case.replace(' ', '')
        lr = self.once(key + '.lr.nii', 'ct-degrade', '-x', '4', *CASES[case], hr)
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


def judge(rows):
    """rows: (scan, case, before, after). The reasons why it is not better; none: it is."""
    why, patients = [], [r for r in rows if not r[0].startswith(PHANTOMS)]
    for scan, case, a, b in rows:
        if b[0] - a[0] < -LOSS:
            why.append(f'{scan}, {case}: {b[0] - a[0]:+.2f} dB')
        if b[2] > a[2]:
            why.append(f'{scan}, {case}: {b[2] - a[2]} more false structures')
    mean = {c: np.mean([b[0] - a[0] for _, k, a, b in patients if k == c]) for c in CASES if patients}
    if not patients or max(mean.get('P1', -1), mean.get('P3', -1)) < GAIN:
        why.append('the mean over patients gains less than %.2f dB: ' % GAIN
                   + ', '.join(f'{c} {v:+.3f}' for c, v in mean.items()))
    return why


def measure(volume, work, build, dev, out=None):
    """Is it better? Of other scans than 4x along all axes ct-sr uses no volume network."""
    if 'volume-4.shape' not in read(volume)[0]:
        print(f'not: {volume} holds no volume-4.shape, and ct-sr uses no other volume network')
        return False
    os.makedirs(work, exist_ok=True)
    shipped = os.path.join(HERE, '../../src/prior/slices.safetensors')
    joined = work + '/joined.safetensors'
    size = join(shipped, volume, joined)
    cts = sorted(p for p in glob.glob(dev + '/*.nii*') if 'real' not in os.path.basename(p))
    if not cts:
        raise SystemExit(f'{dev}: no CTs (*.nii, *.nii.gz)')
    print(f'network of {size / 1e6:.2f} MB' + (f', more than {LARGEST / 1e6:.0f}' if size > LARGEST else ''))
    print(f'{"scan":36} {"case":10}  PSNR    SSIM   false missed CPU s |  PSNR    SSIM   false missed CPU s |   gain',
          flush=True)
    rows, m = [], Measure(build, work)
    for case in CASES:
        for ct in cts:
            scan = os.path.basename(ct).split('.')[0]
            a, b = m.result(ct, case, shipped), m.result(ct, case, joined)
            rows.append((scan, case, a, b))
            text = [f'{v[0]:6.3f} {v[1]:7.4f} {v[2]:6} {v[3]:6} {v[4]:6.1f}' for v in (a, b)]
            print(f'{scan:36} {case:10} {text[0]} | {text[1]} | {b[0] - a[0]:+.3f}', flush=True)
    why = judge(rows) + ([f'{size} bytes'] if size > LARGEST else [])
    print('not: ' + '; '.join(why) if why else 'better')
    if out:
        shutil.copyfile(joined, out)
    return not why


if __name__ == '__main__':
    if len(sys.argv) not in (5, 6):
        raise SystemExit(__doc__)
    sys.exit(not measure(*sys.argv[1:]))
