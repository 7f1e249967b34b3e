# SPDX-License-Identifier: Apache-2.0
"""network.py SHAPES OUT f32|f16: random weights of a network as torch.save writes them, SHAPES being lines of
a name and sizes. The numbers are normal, a tenth of what keeps the size of what they are multiplied with."""
import struct
import sys
import zipfile

import numpy as np


def word(s):
    return b'X' + struct.pack('<I', len(s)) + s.encode()


def number(n):
    return b'J' + struct.pack('<i', n)


def tensor(kind, key, sizes):
    count, strides = 1, []
    for n in reversed(sizes):
        strides.insert(0, count)
        count *= n
    return (b'ctorch._utils\n_rebuild_tensor_v2\n((' + word('storage') + b'ctorch\n' + kind + b'\n' + word(key) +
            word('cpu') + number(count) + b'tQ' + number(0) + b'(' + b''.join(map(number, sizes)) + b't(' +
            b''.join(map(number, strides)) + b't\x89ccollections\nOrderedDict\n)RtR')


shapes, out, form = sys.argv[1:]
kind = {'f32': b'FloatStorage', 'f16': b'HalfStorage'}[form]
random = np.random.default_rng(1)
pickle = b'\x80\x02ccollections\nOrderedDict\n)R('
with zipfile.ZipFile(out, 'w', zipfile.ZIP_STORED, allowZip64=True) as z:
    for k, line in enumerate(open(shapes)):
        name, *sizes = line.split()
        sizes = [int(n) for n in sizes]
        pickle += word(name) + tensor(kind, str(k), sizes)
        x = random.standard_normal(int(np.prod(sizes)), dtype=np.float32)
        x *= 0.1 / np.sqrt(np.prod(sizes[1:])) if len(sizes) > 1 else 0.1
        if len(sizes) == 1 and name.endswith('weight'):
            x += 1
        z.writestr('network/data/%d' % k, x.astype('<f4' if form == 'f32' else '<f2').tobytes())
    z.writestr('network/data.pkl', pickle + b'u.')
