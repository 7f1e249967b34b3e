# SPDX-License-Identifier: Apache-2.0
"""t-pt.py save FOLDER SHAPES...: checkpoints as PyTorch writes them; what is in them, FOLDER/want.json.
t-pt.py compare FILE KEY < numbers: are they those of `key` in want.json? The network is written out here from
the papers (Dhariwal and Nichol 2021; Ho et al. 2020), with the names of guided diffusion's tensors."""
import json
import math
import os
import sys

import torch
import torch.nn.functional as F


class Net:
    """eps(x, t, label), t of each or of all, of a state dictionary; what its names do not tell is given."""

    def __init__(self, sd, width, legacy, scale_shift, updown):
        self.sd, self.width, self.legacy, self.ss, self.updown = sd, width, legacy, scale_shift, updown

    def conv(self, p, x, **how):
        w = self.sd[p + '.weight']
        return F.conv2d(x, w, self.sd[p + '.bias'], padding=w.shape[-1] // 2, **how)

    def linear(self, p, x):
        return F.linear(x, self.sd[p + '.weight'], self.sd[p + '.bias'])

    def norm(self, p, x):
        return F.group_norm(x, 32, self.sd[p + '.weight'], self.sd[p + '.bias'], 1e-5)

    def resblock(self, p, x, emb, how):
        def change(v):
            return F.interpolate(v, scale_factor=2, mode='nearest') if how > 0 else \
                F.avg_pool2d(v, 2) if how < 0 else v
        h = self.conv(p + '.in_layers.2', change(F.silu(self.norm(p + '.in_layers.0', x))))
        e = self.linear(p + '.emb_layers.1', F.silu(emb))[:, :, None, None]
        if self.ss:
            scale, shift = e.chunk(2, 1)
            h = self.norm(p + '.out_layers.0', h) * (1 + scale) + shift
        else:
            h = self.norm(p + '.out_layers.0', h + e)
        x = change(x)
        if p + '.skip_connection.weight' in self.sd:
            x = self.conv(p + '.skip_connection', x)
        return x + self.conv(p + '.out_layers.3', F.silu(h))

    def attention(self, p, x):
        b, c, hh, ww = x.shape
        v = x.reshape(b, c, -1)
        qkv = F.conv1d(self.norm(p + '.norm', v), self.sd[p + '.qkv.weight'], self.sd[p + '.qkv.bias'])
        n = c // self.width
        if self.legacy:
            q, k, v = qkv.reshape(b * n, 3 * self.width, -1).split(self.width, 1)
        else:
            q, k, v = (z.reshape(b * n, self.width, -1) for z in qkv.chunk(3, 1))
        w = torch.softmax(torch.einsum('bct,bcs->bts', q, k) / math.sqrt(self.width), -1)
        a = torch.einsum('bts,bcs->bct', w, v).reshape(b, c, -1)
        a = F.conv1d(a, self.sd[p + '.proj_out.weight'], self.sd[p + '.proj_out.bias'])
        return x + a.reshape(b, c, hh, ww)

    def block(self, p, x, emb, how):
        """What stands under p, piece by piece; how: the change of size if it is the last residual block that does it."""
        i = 0
        while True:
            q = '%s.%d' % (p, i)
            if q + '.in_layers.2.weight' in self.sd:
                x = self.resblock(q, x, emb, how if how < 0 or i > 0 else 0)
            elif q + '.qkv.weight' in self.sd:
                x = self.attention(q, x)
            elif q + '.op.weight' in self.sd:
                x = self.conv(q + '.op', x, stride=2)
            elif q + '.conv.weight' in self.sd:
                x = self.conv(q + '.conv', F.interpolate(x, scale_factor=2, mode='nearest'))
            elif q + '.weight' in self.sd:
                x = self.conv(q, x)
            else:
                return x
            i += 1

    def __call__(self, x, t, label, blocks):
        sd, d = self.sd, self.sd['time_embed.0.weight'].shape[1]
        f = torch.as_tensor(t).reshape(-1, 1) * torch.exp(-math.log(10000) * torch.arange(d // 2) / (d // 2))
        emb = torch.cat([torch.cos(f), torch.sin(f)], 1)
        emb = self.linear('time_embed.2', F.silu(self.linear('time_embed.0', emb)))
        if 'label_emb.weight' in sd:
            emb = emb + sd['label_emb.weight'][label][None]
        hs, n = [], 0
        while any(k.startswith('input_blocks.%d.' % n) for k in sd):
            x = self.block('input_blocks.%d' % n, x, emb, -1 if self.updown and n and n % (blocks + 1) == 0 else 0)
            hs.append(x)
            n += 1
        x = self.block('middle_block', x, emb, 0)
        n = 0
        while hs:
            x = torch.cat([x, hs.pop()], 1)
            x = self.block('output_blocks.%d' % n, x, emb, 1)
            n += 1
        return self.conv('out.2', F.silu(self.norm('out.0', x)))


class Evil:
    def __reduce__(self):
        return os.system, ('touch executed',)


def random_state(shapes):
    sd = {}
    for line in open(shapes):
        name, *sizes = line.split()
        sizes = [int(n) for n in sizes]
        x = torch.randn(sizes)
        x = x * (0.7 / math.sqrt(math.prod(sizes[1:]))) if len(sizes) > 1 else x * 0.1
        sd[name] = x + 1 if len(sizes) == 1 and name.endswith('weight') else x
    if 'label_emb.weight' in sd:
        sd['label_emb.weight'] *= 10
    return sd


def save(folder, shapes):
    torch.manual_seed(1)
    want = {}
    a, b = torch.arange(12.).reshape(3, 4), torch.randn(2, 3, 2)
    parts = torch.nn.Sequential(torch.nn.Linear(2, 3), torch.nn.BatchNorm1d(3))
    kinds = {'a': a, 't': a.t(), 'row': a[1], 'column': a[:, 2], 'scalar': torch.tensor(3.5), 'none': torch.zeros(0, 3),
             'half': b.half(), 'bf16': b.bfloat16(), 'double': b.double(), 'long': torch.tensor([1, -2, 3]),
             'int': torch.tensor([4, -5], dtype=torch.int32), 'bool': torch.tensor([True, False]),
             'byte': torch.tensor([200], dtype=torch.uint8), 'parameter': torch.nn.Parameter(b),
             'flipped': b.permute(2, 0, 1), 'every other': a[::2, 1::2]}
    files = {'plain': kinds, 'state': parts.state_dict(),
             'nested': {'epoch': 7, 'best': 0.5, 'names': ['x', 'y'], 'state_dict': parts.state_dict(),
                        'optimizer': torch.optim.Adam(parts.parameters()).state_dict()}}
    for name, x in files.items():
        for protocol in 2, 4:
            torch.save(x, '%s/%s-%d.pt' % (folder, name, protocol), pickle_protocol=protocol)
        d = x['state_dict'] if 'state_dict' in x else x
        want[name] = {k: [list(v.shape), v.detach().float().flatten().tolist()] for k, v in d.items()}
    torch.save(kinds, folder + '/old.pt', _use_new_zipfile_serialization=False)
    torch.save({'w': a, 'x': Evil()}, folder + '/evil.pt')
    nets = [dict(width=16, legacy=True, scale_shift=True, updown=True),
            dict(width=32, legacy=False, scale_shift=False, updown=False)]
    for i, (how, file) in enumerate(zip(nets, shapes)):
        sd = random_state(file)
        torch.save(sd, '%s/net%d.pt' % (folder, i))
        net = Net(sd, **how)
        n = sd['input_blocks.0.0.weight'].shape[1]
        x = torch.sin(0.37 * torch.arange(n * 256, dtype=torch.float32)).reshape(1, n, 16, 16)
        for label in 0, 3:
            want['net%d-%d' % (i, label)] = net(x, 300., label, 2).flatten().tolist()
    json.dump(want, open(folder + '/want.json', 'w'))


def compare(file, key):
    want = json.load(open(file))[key]
    if isinstance(want, list):
        got = [float(s) for s in sys.stdin]
        most = max(map(abs, want))
        off = max(abs(g - w) for g, w in zip(got, want)) / most
        print('# %d numbers, relative error %.2g of %.3g' % (len(got), off, most))
        sys.exit(len(got) != len(want) or not off < 2e-5)
    got = {}
    for line in sys.stdin:
        name, rest = line.split(' [')
        shape, numbers = rest.split(']')
        got[name] = [json.loads('[' + shape + ']'), [float(s) for s in numbers.split()]]
    wrong = [k for k in want if k not in got or got[k][0] != want[k][0] or
             torch.tensor(got[k][1]).ne(torch.tensor(want[k][1])).any()]
    print('# wrong: %s' % wrong)
    sys.exit(wrong != [] or len(got) != len(want))


if __name__ == '__main__':
    if sys.argv[1] == 'save':
        save(sys.argv[2], sys.argv[3:])
    else:
        compare(*sys.argv[2:])
