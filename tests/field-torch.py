# SPDX-License-Identifier: Apache-2.0
"""field-torch.py FOLDER: are the fields there, as t-field-network dump wrote them, what PyTorch makes of their
weights? Written from the papers: encodings, networks and attention in double, gradients by autograd. A line of TAP
for each comparison."""
import glob
import json
import math
import os
import struct
import sys

import numpy as np
import torch
import torch.nn.functional as F


def read(path):
    with open(path, 'rb') as f:
        data = f.read()
    size = struct.unpack('<Q', data[:8])[0]
    head = json.loads(data[8:8 + size])
    meta = head.pop('__metadata__', {})
    body = data[8 + size:]
    return {k: torch.tensor(np.frombuffer(body[v['data_offsets'][0]:v['data_offsets'][1]], '<f4')
                            .reshape(v['shape']).copy()) for k, v in head.items()}, meta


def numbers(meta, key):
    return [float(v) for v in meta['field.' + key].split(',')]


def sines(x, count):
    p = (2 * x.double() - 1) * math.pi
    return torch.cat([p] + [f(2.0 ** k * p) for k in range(count) for f in (torch.sin, torch.cos)], 1)


def grids(x, w, meta):
    levels, _, log2_table, base, growth = numbers(meta, 'code')
    hashed, out = meta['field.encoding'] == 'hash', []
    for level in range(int(levels)):
        scale = base * growth ** level - 1
        side, table = math.ceil(scale) + 2, 2 ** int(log2_table)
        # in float, as where a point lies between the finest nodes is its last bits
        at = x * torch.tensor(scale, dtype=torch.float32) + 0.5
        node, entries = at.long(), w['encoding.%d' % level]
        part, code = (at - node).double(), 0
        for corner in range(8):
            to = torch.tensor([corner & 1, corner >> 1 & 1, corner >> 2])
            k = node + to
            if hashed and side ** 3 > table:
                place = (k[:, 0] ^ k[:, 1] * 19349663 ^ k[:, 2] * 83492791) % table
            else:
                place = k[:, 0] + side * (k[:, 1] + side * k[:, 2])
            share = torch.where(to == 1, part, 1 - part).prod(1)
            code = code + share[:, None] * entries[place]
        out.append(code)
    return torch.cat(out, 1)


def attention(h, w, segment, heads, head):
    def p(name):
        return w['network.attention.' + name]
    width, x = h.shape[1], h.reshape(-1, segment, h.shape[1])
    n = F.layer_norm(x, [width], p('norm1.weight'), p('norm1.bias'), 1e-5)
    q, k, v = (n @ p('qkv.weight').T).reshape(-1, segment, 3, heads, head).permute(2, 0, 3, 1, 4)
    mixed = torch.softmax(q @ k.transpose(-1, -2) / math.sqrt(head) + p('position'), -1) @ v
    x = x + F.linear(mixed.transpose(1, 2).reshape(-1, segment, heads * head), p('out.weight'), p('out.bias'))
    n = F.layer_norm(x, [width], p('norm2.weight'), p('norm2.bias'), 1e-5)
    n = F.gelu(F.linear(n, p('ffn1.weight'), p('ffn1.bias')), approximate='tanh')
    return (x + F.linear(n, p('ffn2.weight'), p('ffn2.bias'))).reshape(-1, width)


def field(x, w, meta):
    _, depth, skip, _, slope = numbers(meta, 'network')
    segment, heads, head = [int(v) for v in numbers(meta, 'attention')]
    code = sines(x, int(numbers(meta, 'code')[0])) if meta['field.encoding'] == 'frequencies' else grids(x, w, meta)
    h = code
    for layer in range(int(depth)):
        if layer and layer == skip:
            h = torch.cat([code, h], 1)
        p = 'network.hidden.%d.' % layer
        h = F.leaky_relu(F.linear(h, w[p + 'weight'], w[p + 'bias']), slope)
        if layer == 0 and segment:
            h = attention(h, w, segment, heads, head)
    y = F.linear(h, w['network.output.weight'], w['network.output.bias'])
    if meta['field.last'] == 'sigmoid':
        y = torch.cat([y[:, :-1], torch.sigmoid(y[:, -1:])], 1)
    return y


def apart(a, b):
    return float((a.double() - b).abs().max() / b.abs().max())


def step(before, after):
    """How far from the step that PyTorch's gradient asks for, sixth of a fit to points."""
    (w, meta), (end, _) = read(before), read(after)
    x, value, m, v, rate = (w.pop(k).double() for k in ('x', 'value', 'm', 'v', 'rate'))
    w = {k: t.double().requires_grad_() for k, t in w.items()}
    ((field(x.float(), w, meta)[:, 0] - value) ** 2).mean().backward()
    g = torch.cat([t.grad.flatten() for t in w.values()])
    m, v = 0.9 * m + 0.1 * g, 0.999 * v + 0.001 * g * g
    want = -rate * (m / (1 - 0.9 ** 6)) / ((v / (1 - 0.999 ** 6)).sqrt() + 1e-8)
    got = torch.cat([(end[k].double() - w[k].detach()).flatten() for k in w])
    return float((got - want).norm() / want.norm())


def main(folder):
    def ok(good, name):
        print('%s %s' % ('good' if good else 'bad', name))
    for path in sorted(glob.glob(os.path.join(folder, '?.safetensors'))):
        (w, meta), (gradient, _) = read(path), read(path.replace('.safetensors', '-gradient.safetensors'))
        name = os.path.basename(path)[0] + ', ' + meta['field.encoding']
        x, y, dy = (w.pop(k) for k in ('x', 'y', 'dy'))
        w = {k: v.double().requires_grad_() for k, v in w.items()}
        want = field(x, w, meta)
        off = apart(y, want.detach())
        ok(off < 1e-5, '%s: values, off by %.1e' % (name, off))
        (want * dy).sum().backward()
        off = {k: apart(gradient[k], v.grad) for k, v in w.items()}
        worst = max(off, key=off.get)
        ok(off[worst] < 1e-5, '%s: %d gradients, off by %.1e at %s' % (name, len(off), off[worst], worst))
    off = step(os.path.join(folder, 'step-before.safetensors'), os.path.join(folder, 'step-after.safetensors'))
    ok(off < 1e-4, 'a step of Adam, off by %.1e of its length' % off)


main(sys.argv[1])
