#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""ArSSR in PyTorch, written from the paper: compares what tests/t-arssr wrote. arssr-torch.py FILE RTOL [GRADIENT-RTOL]"""
import json
import struct
import sys

import numpy as np
import torch
from torch import nn
from torch.nn import functional as F


def read(path):
    data = open(path, 'rb').read()
    n = struct.unpack('<Q', data[:8])[0]
    head = json.loads(data[8:8 + n])
    meta = head.pop('__metadata__')
    return meta, {k: torch.from_numpy(np.frombuffer(
        data[8 + n + v['data_offsets'][0]:8 + n + v['data_offsets'][1]],
        np.float32).reshape(v['shape']).copy()) for k, v in head.items()}


class Dense(nn.Module):
    def __init__(self, ci, co):
        super().__init__()
        self.conv = nn.Conv3d(ci, co, 3, padding=1)

    def forward(self, x):
        return torch.cat([x, F.relu(self.conv(x))], 1)


class Block(nn.Module):
    def __init__(self, features, growth, layers):
        super().__init__()
        self.layers = nn.Sequential(*[Dense(features + i * growth, growth) for i in range(layers)])
        self.lff = nn.Conv3d(features + layers * growth, features, 1)

    def forward(self, x):
        return x + self.lff(self.layers(x))


class Encoder(nn.Module):
    def __init__(self, features, blocks, layers, growth, out):
        super().__init__()
        self.sfe1 = nn.Conv3d(1, features, 3, padding=1)
        self.sfe2 = nn.Conv3d(features, features, 3, padding=1)
        self.rdbs = nn.ModuleList([Block(features, growth, layers) for _ in range(blocks)])
        self.gff = nn.Sequential(nn.Conv3d(blocks * features, features, 1),
                                 nn.Conv3d(features, features, 3, padding=1))
        self.output = nn.Conv3d(features, out, 3, padding=1)

    def forward(self, x):
        first = self.sfe1(x)
        x, local = self.sfe2(first), []
        for block in self.rdbs:
            x = block(x)
            local.append(x)
        return self.output(self.gff(torch.cat(local, 1)) + first)


class Decoder(nn.Module):
    def __init__(self, n, width):
        super().__init__()
        self.stage_one = self.stage(n, width, n)
        self.stage_two = self.stage(n, width, 1)

    @staticmethod
    def stage(n, width, out):
        sizes = [n, width, width, width, out]
        return nn.Sequential(*[m for a, b in zip(sizes, sizes[1:]) for m in (nn.Linear(a, b), nn.ReLU())])

    def forward(self, x):
        return self.stage_two(x + self.stage_one(x))


class ArSSR(nn.Module):
    def __init__(self, features, blocks, layers, growth, out, width):
        super().__init__()
        self.encoder = Encoder(features, blocks, layers, growth, out)
        self.decoder = Decoder(out + 3, width)

    def forward(self, lo, xyz):
        features = self.encoder(lo[None, None])
        at = F.grid_sample(features, xyz[None, None, None], mode='bilinear', align_corners=False)
        return self.decoder(torch.cat([at[0, :, 0, 0].T, xyz.flip(-1)], 1))[:, 0]


def main():
    torch.set_num_threads(2)
    meta, t = read(sys.argv[1])
    rtol = [float(x) for x in sys.argv[2:]]
    net = ArSSR(*[int(meta[k]) for k in ('features', 'blocks', 'layers', 'growth', 'out', 'width')]).double()
    net.load_state_dict({k: v.double() for k, v in t.items()
                         if k.startswith(('encoder.', 'decoder.'))})
    lo, want = t['lo'].double(), t['want'].double()
    n = torch.tensor(lo.shape[::-1], dtype=torch.float64)
    values = net(lo, 2 * (t['at'].double() + 0.5) / n - 1)
    miss = (values - t['values'].double()).abs().max() / values.abs().max()
    print('values differ by %.2g of the largest' % miss)
    bad = not miss < rtol[0]
    if len(rtol) > 1:
        (values - want).abs().sum().backward()
        most = max(p.grad.abs().max() for p in net.parameters())
        for name, p in net.named_parameters():
            off = (p.grad - t['grad.' + name].double()).abs().max() / max(p.grad.abs().max(), 1e-3 * most)
            if not off < rtol[1]:
                print('%s: the gradient differs by %.2g of its largest' % (name, off))
                bad = True
    sys.exit(bad)


main()
