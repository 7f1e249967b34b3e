#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-info to the number: every figure of every kind of file, and the text, which says what the JSON does.
. "$srcdir/tests/tap.sh"
command -v python3 >/dev/null || { echo '1..0 # SKIP no python3'; exit 0; }
cat >look.py <<'END'
"""report(NAME, WANT): the JSON has these members in this order and no others but the hash, the text says
the same."""
import json, math, re, struct, subprocess

def near(a, b):
    if isinstance(b, (list, tuple)):
        return isinstance(a, list) and len(a) == len(b) and all(map(near, a, b))
    if isinstance(b, dict):
        return isinstance(a, dict) and list(a) == list(b) and all(near(a[k], b[k]) for k in b)
    if isinstance(b, float) and isinstance(a, float):
        return abs(a - b) <= 2e-6 * max(abs(a), abs(b)) + 1e-9
    return type(a) is type(b) and a == b

def word(v):
    v = 'none' if v is None else '%.7g' % v if isinstance(v, float) else str(v)
    return ''.join('?' if ord(c) < 32 or ord(c) == 127 else c for c in v)

def value(v):
    return ' '.join(map(word, v)) if isinstance(v, list) else word(v)

def item(v):
    if isinstance(v, dict):
        return '  '.join(('%s ' % k if n else '') + value(x) for n, (k, x) in enumerate(v.items()))
    return value(v)

def text(o, indent=0):
    for k, v in o.items():
        if isinstance(v, dict):
            yield ' ' * indent + k
            yield from text(v, indent + 2)
        elif isinstance(v, list) and not (v and isinstance(v[0], (int, float, type(None)))):
            yield ' ' * indent + k
            yield from (' ' * (indent + 2) + item(x) for x in v)
        else:
            yield ' ' * indent + (k.ljust(18) if len(k) < 18 else k + ' ') + value(v)

def run(*args):
    return subprocess.run(('ct-info',) + args, check=True, stdout=subprocess.PIPE).stdout.decode()

def report(name, want, *args):
    o = json.loads(run('--json', name, *args))
    h = o.pop('hash', None)
    assert h is None or re.fullmatch('xxh3:[0-9a-f]{32}', h), h
    want = dict(want, file=name)
    assert list(o) == ['file'] + [k for k in want if k != 'file'], (list(o), list(want))
    bad = [(k, o[k], want[k]) for k in want if not near(o[k], want[k])]
    assert not bad, bad
    if h:
        o['hash'] = h
    says = run(name, *args)
    assert says == '\n'.join(text(o)) + '\n', (says, '\n'.join(text(o)))

def spread(x):
    ok = [v for v in x if math.isfinite(v)]
    mean = sum(ok) / len(ok)
    return {'min': float(min(ok)), 'max': float(max(ok)), 'mean': mean,
            'sd': math.sqrt(sum((v - mean) ** 2 for v in ok) / len(ok)),
            'nan': sum(map(math.isnan, x)), 'infinite': sum(map(math.isinf, x))}
END
run() { # run NAME: Python from standard input
	{ echo 'from look import *'; cat; } >t.py; python3 t.py 2>err; ok $? "$1"; sed 's/^/# /' err
}

run 'a volume, of which some voxels are no numbers' <<'END'
x = [float(i * i % 37) for i in range(24)]
x[5], x[7], x[9], x[10] = math.nan, math.inf, math.inf, -math.inf
rows = [[0.0, -2.0, 0.0, 5.0], [3.0, 0.0, 0.0, -7.0], [0.0, 0.0, 4.0, 0.5]]
head = bytearray(352)
struct.pack_into('<i', head, 0, 348)
struct.pack_into('<8h', head, 40, 3, 2, 3, 4, 1, 1, 1, 1)
struct.pack_into('<2h', head, 70, 16, 32)
struct.pack_into('<8f', head, 76, 1, 3, 2, 4, 0, 0, 0, 0)
struct.pack_into('<3f', head, 108, 352, 1, 0)
head[123] = 2
struct.pack_into('<2h', head, 252, 0, 1)
for r in range(3):
    struct.pack_into('<4f', head, 280 + 16 * r, *rows[r])
head[344:348] = b'n+1\0'
open('v.nii', 'wb').write(head + struct.pack('<24f', *x))
report('v.nii', {'kind': 'volume', 'size': [2, 3, 4], 'spacing-mm': [3.0, 2.0, 4.0],
                 'extent-mm': [6.0, 6.0, 16.0], 'centre-mm': [3.0, -5.5, 6.5], 'orientation': 'ALS',
                 'affine': rows, 'quantity': 'HU', **spread(x)})
END
ct-phantom -q --size 9x10x11 --spacing 2,3,4 -s 5 -w -1000:2000 ellipsoids p.nii || exit 99
run 'a volume with a history' <<'END'
b = open('p.nii', 'rb').read()
at = int(struct.unpack_from('<f', b, 108)[0])
x = struct.unpack_from('<990f', b, at)
report('p.nii', {'kind': 'volume', 'size': [9, 10, 11], 'spacing-mm': [2.0, 3.0, 4.0],
                 'extent-mm': [18.0, 30.0, 44.0], 'centre-mm': [0.0, 0.0, 0.0], 'orientation': 'RAS',
                 'affine': [[2.0, 0.0, 0.0, -8.0], [0.0, 3.0, 0.0, -13.5], [0.0, 0.0, 4.0, -20.0]],
                 'quantity': 'HU', **spread(x),
                 'metadata': {'window': '-1000:2000', 'phantom': 'ellipsoids', 'seed': '5'},
                 'history': ['ct-phantom ' + run('--version').split()[-1] +
                             ' --size 9x10x11 --spacing 2,3,4 -s 5 -w -1000:2000 ellipsoids p.nii']})
END
cp "$srcdir/tests/exr.py" .
exact sphere cone.exr '--size 64x64x64' -n 30 --arc 350 --expert start=7,dso=800,dsd=1000,pitch=2,3,offset=4,-5 --det 40x30 &&
	exact sphere flat.exr '--size 64x64x64' -n 4 --beam parallel --arc -180 --det 40x30 &&
	exact sphere one.exr '--size 64x64x64' -n 1 || exit 99
run 'stacks: a cone, parallel rays, one view' <<'END'
import exr
def stack(name, want, told=()):
    o = json.loads(run('--json', name))
    for k in told:
        want[k] = o[k]
    report(name, {'kind': 'stack', **want, **spread(sum(exr.read(name), [])), 'metadata': o['metadata'],
                  'history': o['history']})
    return o
o = stack('cone.exr', {'views': 30, 'size': [40, 30], 'pitch-mm': [2.0, 3.0], 'detector-mm': [80.0, 90.0],
                       'beam': 'cone', 'angles-deg': [7.0, 7 + 350 * 29 / 30], 'step-deg': 350 / 30,
                       'arc-deg': 350.0, 'dsd-mm': [1000.0, 1000.0], 'dso-mm': [800.0, 800.0],
                       'isocentre-mm': [0.0, 0.0, 0.0], 'isocentre-miss-mm': None, 'magnification': 1.25,
                       'offset-u-mm': [4.0, 4.0], 'offset-v-mm': [-5.0, -5.0]}, ['isocentre-miss-mm'])
assert 0 <= o['isocentre-miss-mm'] < 1e-3 and o['metadata']['scan.dso'] == '800' and len(o['history']) == 1
for name, views, last, step, beam in (('flat.exr', 4, -135.0, -45.0, 'parallel'), ('one.exr', 1, 0.0, 0.0, 'cone')):
    o = stack(name, {'views': views, 'size': None, 'pitch-mm': None, 'detector-mm': None, 'beam': beam,
                     'angles-deg': [0.0, last], 'step-deg': step, 'arc-deg': abs(step) * views, 'dsd-mm': None,
                     'offset-u-mm': [0.0, 0.0], 'offset-v-mm': [0.0, 0.0]},
              ['size', 'pitch-mm', 'detector-mm', 'dsd-mm'])
    assert near(o['detector-mm'], [n * p for n, p in zip(o['size'], o['pitch-mm'])]), o
END
"$builddir/tests/t-ply" g.ply >/dev/null
run 'Gaussians' <<'END'
head, body = open('g.ply', 'rb').read().split(b'end_header\n', 1)
names = re.findall(r'^property float (\S+)$', head.decode(), re.M)
rows = [dict(zip(names, r)) for r in struct.iter_unpack('<%df' % len(names), body)]
get = lambda k: [r[k] for r in rows]
scales = get('scale_0') + get('scale_1') + get('scale_2')
o = json.loads(run('--json', 'g.ply'))
third = 1 / 3
report('g.ply', {'kind': 'Gaussians', 'gaussians': 500, 'positive': sum(d > 0 for d in get('density')),
                 'negative': sum(d < 0 for d in get('density')), 'not-finite': 0, 'activation': 'prelu',
                 'gamma': 0.1, 'raw-density': [min(get('density')), max(get('density'))],
                 'sigma-mm': [math.exp(min(scales)), math.exp(max(scales))],
                 'sigma-mean-mm': math.exp(sum(scales) / len(scales)),
                 'box-low-mm': [min(get(a)) for a in 'xyz'], 'box-high-mm': [max(get(a)) for a in 'xyz'],
                 'step': 12345678901, 'grid': [256, 200, 130],
                 'affine': [[third, 0.0, 0.0, 0.0], [0.0, third, 0.0, -100.7], [0.0, 0.0, third, -201.4]],
                 'metadata': o['metadata'], 'history': o['history']})
assert len(o['history']) == 2 and o['metadata']['window'] == '-1024:3071', o
END
run 'tensors' <<'END'
meta = {'a': 'b', 'a key of more than eighteen letters': 'c\td', 'eighteen letters ..': '', 'seventeen letter:': 'e',
        'eighteen letters :': 'e', 'history': 'one\ntwo\n'}
x = [1.0, math.nan, 3.0, 4.0, 0.5, math.inf, -math.inf]
head = json.dumps({'__metadata__': meta, 'a.w': {'dtype': 'F32', 'shape': [2, 2], 'data_offsets': [0, 16]},
                   'b': {'dtype': 'F32', 'shape': [], 'data_offsets': [16, 20]},
                   'c': {'dtype': 'F32', 'shape': [2], 'data_offsets': [20, 28]}}).encode()
open('w.safetensors', 'wb').write(struct.pack('<Q', len(head)) + head + struct.pack('<7f', *x))
want = {'kind': 'tensors', 'tensors': 3, 'parameters': 7, 'not-finite': 3}
rest = {'metadata': {k: v for k, v in meta.items() if k != 'history'}, 'history': ['one', 'two']}
report('w.safetensors', {**want, **rest})
report('w.safetensors', {**want, 'list': [
    {'name': 'a.w', 'shape': [2, 2], 'min': 1.0, 'max': 4.0, 'mean': 8 / 3},
    {'name': 'b', 'shape': [], 'min': 0.5, 'max': 0.5, 'mean': 0.5},
    {'name': 'c', 'shape': [2], 'min': None, 'max': None, 'mean': None}], **rest}, '-v')
END
done_testing
