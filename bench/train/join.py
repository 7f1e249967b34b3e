# SPDX-License-Identifier: Apache-2.0
"""join.py OUT.safetensors VOLUME.safetensors...: the slice networks that are shipped and trained volume networks, in one
prior for ct-sr --prior and ct-upsample -m prior -p. First and last layers become F16."""
import json
import os
import struct
import sys

import numpy as np

from pack import SCANS

UNUSED = ('error', 'error_bias')
KINDS = {'F16': '<f2', 'F32': '<f4'}
SHIPPED = os.path.join(os.path.dirname(os.path.abspath(__file__)), '../../src/prior/slices.safetensors')


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


def scans_of(head, path):
    """The scans that the volume network of a file is for."""
    names = [s for s in SCANS if f'volume-{s}.shape' in head]
    if len(names) != 1:
        raise SystemExit(f'{path}: {len(names)} tensors volume-{"|".join(SCANS)}.shape: expected one, as volume.py exports')
    return names[0]


class Tensors:
    """What a safetensors file will hold."""

    def __init__(self):
        self.head, self.data = {}, b''

    def put(self, name, entry, raw):
        self.head[name] = {**entry, 'data_offsets': [len(self.data), len(self.data) + len(raw)]}
        self.data += raw

    def write(self, path):
        text = json.dumps(self.head, separators=(',', ':')).encode()
        text += b' ' * (-len(text) % 8)
        with open(path + '.part', 'wb') as f:
            f.write(struct.pack('<Q', len(text)) + text + self.data)
        os.replace(path + '.part', path)


def put_volume(to, path):
    head, data = read(path)
    network = 'volume-' + scans_of(head, path)
    for name, entry in head.items():
        part = name.split('.', 1)[-1]
        if name.split('.')[0] != network or part in UNUSED:
            continue
        t = values(entry, data, path, name)
        if part == 'first' and t.ndim == 2 and t.shape[1] == 2 * 64 * 27:
            t = halved_first(t)
        elif part == 'last':
            t = t.astype(np.float16)
        to.put(name, {'dtype': 'F16' if t.dtype == np.float16 else 'F32', 'shape': list(t.shape)}, t.tobytes())


def join(path, volumes):
    """Returns the bytes of the volume networks."""
    head, data = read(SHIPPED)
    to = Tensors()
    if '__metadata__' in head:
        to.head['__metadata__'] = head.pop('__metadata__')
    for name, entry in head.items():
        if not name.startswith('volume-'):
            to.put(name, entry, data[slice(*entry['data_offsets'])])
    before = len(to.data)
    for v in volumes:
        put_volume(to, v)
    to.write(path)
    return len(to.data) - before


if __name__ == '__main__':
    if len(sys.argv) < 3:
        raise SystemExit(__doc__)
    join(sys.argv[1], sys.argv[2:])
