# SPDX-License-Identifier: Apache-2.0
"""pack.py TRAIN_FOLDER XRAY_FOLDER BUILD OUT [4|thick-4|2]...: what a training takes along, in one folder of files.

CTs of TRAIN_FOLDER (HU, int16, gzipped NIfTI-1) whose licence allows weights under Apache-2.0, without loss but for
steps of 4 HU; radiographs; the slice networks of ct-sr for such scans; the static programs of BUILD. Prints the sizes and fails above LIMIT."""
import glob
import gzip
import json
import lzma
import os
import struct
import subprocess
import sys
from multiprocessing import Pool

import numpy as np

LIMIT = 60e6  # bytes, all that travels
# The mice are under GPL-3; the licence of COVID-CT-MD is to be checked.
LEFT_OUT = ('mouse', 'covidctmd')
MOST, MOST_HELD = 184, 150  # voxels along an axis: the middle of larger ones
HELD = ('lidc0003', 'fullhead', 'tciasts047')  # validated on: a part will do
STEP, BASE = 4, -1024  # HU
SCANS = {'4': (4, 0), 'thick-4': (4, 1), '2': (2, 0)}  # name of the slice networks: factor, along one axis alone


def voxels(path):
    """int16 HU [z][y][x] of a gzipped NIfTI-1."""
    raw = gzip.open(path).read()
    dim = np.frombuffer(raw[40:56], '<i2').astype(int)
    offset = int(np.frombuffer(raw[108:112], '<f4')[0])
    if np.frombuffer(raw[70:72], '<i2')[0] != 4:
        raise SystemExit(f'{path}: expected int16 voxels')
    return np.frombuffer(raw, '<i2', dim[1] * dim[2] * dim[3], offset).reshape(dim[3], dim[2], dim[1]), \
        np.frombuffer(raw[80:92], '<f4')


def middle(x, most):
    at = [max(0, (n - most) // 2) for n in x.shape]
    return x[tuple(slice(a, a + most) for a in at)]


def squeeze(d):
    return lzma.compress((d & 255).astype('u1').tobytes() + (d >> 8 & 255).astype('u1').tobytes(), preset=6)


def pack(job):
    path, out = job
    x, size = voxels(path)
    q = (middle(x, MOST_HELD if any(h in path for h in HELD) else MOST).astype(np.int32) - BASE) // STEP
    data, kind = min(((squeeze(d), k) for k, d in enumerate((q, np.diff(q, axis=0, prepend=0)))), key=lambda v: len(v[0]))
    name = os.path.basename(path)[:-len('.nii.gz')]
    with open(f'{out}/{name}.ct', 'wb') as f:
        f.write(struct.pack('<4i3f', *q.shape, kind, *[float(v) for v in size]) + data)
    assert np.array_equal(unpacked(f'{out}/{name}.ct')[0], q * STEP + BASE), name
    return name, q.shape, kind, len(data)


def unpacked(path):
    """int16 HU [z][y][x], voxel sizes x, y, z in mm."""
    raw = open(path, 'rb').read()
    nz, ny, nx, kind, *size = struct.unpack('<4i3f', raw[:28])
    count = nz * ny * nx
    b = np.frombuffer(lzma.decompress(raw[28:]), 'u1')
    d = (b[:count].astype('<u2') | b[count:].astype('<u2') << 8).view('<i2').reshape(nz, ny, nx).astype(np.int32)
    return ((np.cumsum(d, axis=0) if kind else d) * STEP + BASE).astype('<i2'), size


def unpack(job):
    path, out = job
    x, size = unpacked(path)
    nz, ny, nx = x.shape
    head = bytearray(352)
    head[0:4] = struct.pack('<i', 348)
    head[40:56] = struct.pack('<8h', 3, nx, ny, nz, 1, 1, 1, 1)
    head[70:74] = struct.pack('<2h', 4, 16)
    head[76:108] = struct.pack('<8f', 1, *size, 1, 1, 1, 1)
    head[108:120] = struct.pack('<3f', 352, 1, 0)
    head[123] = 2  # mm
    head[252:256] = struct.pack('<2h', 1, 1)
    for a in range(3):
        head[280 + 20 * a:284 + 20 * a] = struct.pack('<f', size[a])
    head[344:348] = b'n+1\0'
    name = f'{out}/{os.path.basename(path)[:-3]}.nii'
    with open(name + '.part', 'wb') as f:
        f.write(bytes(head) + x.tobytes())
    os.rename(name + '.part', name)


def unpack_all(folder, out, workers):
    """The CTs of a pack as NIfTI in the folder out, and its radiographs beside them."""
    os.makedirs(out, exist_ok=True)
    if os.path.exists(folder + '/xray.npy.xz') and not os.path.exists(folder + '/xray.npy'):
        with open(folder + '/xray.npy.part', 'wb') as f:
            f.write(lzma.open(folder + '/xray.npy.xz').read())
        os.replace(folder + '/xray.npy.part', folder + '/xray.npy')
    files = sorted(glob.glob(folder + '/*.ct'), key=os.path.getsize)
    jobs = [(f, out) for f in files if not os.path.exists(f'{out}/{os.path.basename(f)[:-3]}.nii')]
    with Pool(workers) as p:
        p.map(unpack, jobs, chunksize=1)


def used(network, scans):
    """Does ct-sr use it for such scans? In the first pass by name; in the second those for no finer grid."""
    if not network.startswith('again-'):
        return network in scans
    *thick, factor = network.split('-')[1:]
    return any(bool(thick) == bool(t) and int(factor) <= f for f, t in (SCANS[s] for s in scans))


def pack_networks(path, scans, out):
    """Of a safetensors file the slice networks whose results are refined further."""
    raw = open(path, 'rb').read()
    size = struct.unpack('<Q', raw[:8])[0]
    data, head, kept = raw[8 + size:], {}, b''
    for name, t in json.loads(raw[8:8 + size]).items():
        if name == '__metadata__' or not used(name.split('.')[0], scans):
            continue
        a, b = t['data_offsets']
        head[name] = {**t, 'data_offsets': [len(kept), len(kept) + b - a]}
        kept += data[a:b]
    text = json.dumps(head, separators=(',', ':')).encode()
    text += b' ' * (-len(text) % 8)
    with open(out, 'wb') as f:
        f.write(struct.pack('<Q', len(text)) + text + kept)


def main():
    if len(sys.argv) < 5:
        raise SystemExit(__doc__)
    train, xray, build, out, *scans = sys.argv[1:]
    scans = scans or ['4']
    if not SCANS.keys() >= set(scans):
        raise SystemExit(f'{" ".join(scans)}: expected {", ".join(SCANS)}')
    here = os.path.dirname(os.path.abspath(__file__))
    os.makedirs(out, exist_ok=True)
    files = [f for f in sorted(glob.glob(train + '/*.nii.gz'), key=lambda f: -os.path.getsize(f))
             if not any(w in f for w in LEFT_OUT)]
    if not files:
        raise SystemExit(f'{train}: no CTs (*.nii.gz)')
    names = {os.path.basename(f)[:-len('.nii.gz')] for f in files}
    for path in glob.glob(out + '/*.ct'):
        if os.path.basename(path)[:-len('.ct')] not in names:
            raise SystemExit(f'{path}: is of no CT of {train}, and a training would take it: remove it')
    with Pool(2) as p:
        for name, shape, kind, size in p.imap_unordered(pack, [(f, out) for f in files]):
            print(f'{name:44} {shape[2]} x {shape[1]} x {shape[0]}, filter {kind}, {size} bytes')
    sys.path.insert(0, here)
    import projections
    projections.pack_radiographs(xray, out + '/xray.npy')
    with open(out + '/xray.npy', 'rb') as f, lzma.open(out + '/xray.npy.xz', 'wb') as to:
        to.write(f.read())
    os.remove(out + '/xray.npy')
    os.makedirs(out + '/bin', exist_ok=True)
    for program in ('pairs', 'projections'):
        subprocess.run(['strip', '-o', f'{out}/bin/{program}', f'{build}/bench/train/{program}'], check=True)
    pack_networks(os.path.join(here, '../../src/prior/slices.safetensors'), scans, out + '/slices.safetensors')
    total = sum(os.path.getsize(os.path.join(d, f)) for d, _, fs in os.walk(out) for f in fs)
    print(f'{out}: {total / 1e6:.1f} MB')
    if total > LIMIT:
        raise SystemExit(f'{out}: more than {LIMIT / 1e6:.0f} MB')


if __name__ == '__main__':
    main()
