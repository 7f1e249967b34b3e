# SPDX-License-Identifier: Apache-2.0
"""The volume network: what a refined CT still lacks, seen in the whole volume.

A residual network of convolutions of 3^3 cells, zero outside. A cell, a cube of CELL voxels a side, is one place with
a channel a voxel. CELL is the same for each of SCANS, and the coarse axis of thick slices is the first, z; the reader,
src/restore/volume-network.c, holds to both. In: the volume that ct-sr refined, and what its slice networks added. Out: the
rest, and the logarithm of its mean square. Told: blur, sampling, noise, the axes that are coarse, the factor.

What decides whether it learns: the last layer begins at 0, activations leak, the voxels of a cell are whitened (DCT)
in float32 before bfloat16, a rate of 2.5e-4 to 3e-4, and exp(-u) of the expected error is bounded."""
import glob
import itertools
import json
import math
import os
import random
import struct
import subprocess
import threading
import time

import numpy as np
import torch
import torch.nn.functional as F
from torch import nn

from pack import SCANS

CELL, VOXELS = 4, 64
UNIT_X, UNIT_REST = 256., 64.  # HU
TOLD = 8
SHARE_X, SHARE_REST = 8, 16  # as pairs.c writes them
HEAD = 40
HELD = ('lidc0003', 'fullhead', 'tciasts047')
LEAST_RMS = 5.  # HU: a cube that lacks less counts as if it lacked this
SIDE, AT_ONCE, ROUNDS = 96, 4, 48
SLOPE = .1


class Conv(nn.Module):
    def __init__(self, inputs, outputs, gain=1.):
        super().__init__()
        self.w = nn.Parameter(torch.randn(outputs, inputs, 3, 3, 3) * gain * math.sqrt(2 / (27 * inputs)))

    def forward(self, x):
        return F.conv3d(x, self.w.to(x.dtype), padding=1)


def leak(x):
    return F.leaky_relu(x, SLOPE)


class Network(nn.Module):
    def __init__(self, width, blocks, half):
        super().__init__()
        self.width, self.half = width, half
        self.first = Conv(2 * VOXELS, width)
        self.one = nn.ModuleList([Conv(width, width) for _ in range(blocks)])
        self.second = nn.ModuleList([Conv(width, width, .2) for _ in range(blocks)])
        self.second_bias = nn.Parameter(torch.zeros(blocks, width))
        self.last, self.last_bias = Conv(width, VOXELS, 0.), nn.Parameter(torch.zeros(VOXELS))
        self.error, self.error_bias = Conv(width, 1, 0.), nn.Parameter(torch.full((1,), -1.))
        self.regime = nn.Linear(TOLD, width * (1 + blocks))
        nn.init.normal_(self.regime.weight, 0, .05)
        nn.init.zeros_(self.regime.bias)
        for name in ('white_x', 'white_added', 'colour'):
            self.register_buffer(name, torch.eye(VOXELS))

    def forward(self, x, told):
        """x (batch, 128, z, y, x) float32, told (batch, TOLD): the rest in UNIT_REST, and u."""
        with torch.autocast(x.device.type, enabled=False):
            x = torch.cat([torch.einsum('oc,bcdhw->bodhw', self.white_x, x[:, :VOXELS]),
                           torch.einsum('oc,bcdhw->bodhw', self.white_added, x[:, VOXELS:])], 1)
            x = x.to(torch.bfloat16 if self.half else torch.float32)
            x = x.contiguous(memory_format=torch.channels_last_3d)
            bias = self.regime(told).to(x.dtype).reshape(x.shape[0], -1, self.width)[..., None, None, None]
            x = leak(self.first(x) + bias[:, 0])
            for i, (one, second) in enumerate(zip(self.one, self.second)):
                y = leak(one(x) + bias[:, 1 + i])
                x = x + second(y) + self.second_bias[i].to(x.dtype)[None, :, None, None, None]
            h = self.last(x).float() + self.last_bias[None, :, None, None, None]
            h = torch.einsum('oc,bcdhw->bodhw', self.colour, h)
            return h, self.error(x.detach()).float()[:, 0] + self.error_bias


def cells(x):
    """(batch, z, y, x) voxels to (batch, 64, z / 4, y / 4, x / 4)."""
    b, d, h, w = x.shape
    x = x.reshape(b, d // CELL, CELL, h // CELL, CELL, w // CELL, CELL)
    return x.permute(0, 2, 4, 6, 1, 3, 5).reshape(b, VOXELS, d // CELL, h // CELL, w // CELL)


def cosines():
    i = torch.arange(CELL, dtype=torch.float32)
    m = torch.cos(math.pi * (i[None] + .5) * i[:, None] / CELL)
    m[0] *= math.sqrt(.5)
    m *= math.sqrt(2 / CELL)
    return torch.einsum('ax,by,cz->abcxyz', m, m, m).reshape(VOXELS, VOXELS)


def told_of(sigma, noise, decimate, coarse, factor):
    return [4 * sigma - 1, float(decimate == 1), float(decimate == 2), noise / 15, *[float(not c) for c in coarse],
            factor / 4 - 1]


class Pair:
    """One file of pairs.c on the device; of thick slices the first axis is the coarse one."""

    def __init__(self, path, device):
        raw = np.fromfile(path, np.uint8)
        n, told = raw[:24].view('<i4'), raw[24:HEAD].view('<f4')
        x = torch.from_numpy(raw[HEAD:].view('<i2').reshape(3, n[2], n[1], n[0]).copy()).to(device)
        coarse = [bool(n[4] >> a & 1) for a in (2, 1, 0)]
        if sum(coarse) == 1 and not coarse[0]:
            o = [0, 1, 2]
            c = coarse.index(True)
            o[0], o[c] = c, 0
            x, coarse = x.permute(0, *[1 + a for a in o]), [coarse[a] for a in o]
        shape = [k // CELL * CELL for k in x.shape[1:]]
        self.x = x[:, :shape[0], :shape[1], :shape[2]].contiguous()
        self.cells = [k // CELL for k in shape]
        self.sigma, self.noise, self.rms = (float(v) for v in told[:3])
        self.decimate, self.factor, self.coarse = int(n[3]), int(n[5]), coarse

    def whole(self):
        x = self.x.float()
        return (torch.cat([cells(x[:1] / (SHARE_X * UNIT_X)), cells(x[1:2] / (SHARE_REST * UNIT_REST))], 1),
                cells(x[2:] / (SHARE_REST * UNIT_REST)),
                torch.tensor([told_of(self.sigma, self.noise, self.decimate, self.coarse, self.factor)],
                             device=x.device))


class Volume:
    rate, decay, average, clip, warm = 3e-4, .01, .999, .5, 300

    def __init__(self, data, device, tiny=False, scans='4'):
        self.data, self.device, self.tiny, self.scans = data, device, tiny, scans
        self.name = 'volume-' + scans
        self.folder = f'{data}/pairs-{scans}'
        self.by, self.held, self.count, self.seen = {}, {}, 0, set()
        self.lock, self.left, self.running = threading.Lock(), False, set()
        self.half = False  # set by the loop
        os.makedirs(self.folder, exist_ok=True)
        self.jobs = self.list_jobs()
        for _ in range(max(1, (os.cpu_count() or 2) - 2)):
            threading.Thread(target=self.make, daemon=True).start()
        threading.Thread(target=self.collect, daemon=True).start()

    def list_jobs(self):
        """CT, first pair, count: CTs in turn, the held-out ones in the first round."""
        cts = sorted(glob.glob(self.data + '/ct/*.nii'), key=os.path.getsize)
        for k in range(ROUNDS):
            for ct in cts:
                held = any(h in ct for h in HELD)
                count = 1 if self.tiny else AT_ONCE
                if not held:
                    yield ct, k * count, count
                elif k == 0:
                    yield ct, 0, 2 * count

    def make(self):
        while not self.left:
            with self.lock:
                job = next(self.jobs, None)
            if job is None:
                return
            self.make_one(*job)

    def make_one(self, ct, first, count):
        folder = f'{self.folder}/{os.path.basename(ct)[:-4]}-{first}'
        if os.path.exists(folder + '/done'):
            return
        os.makedirs(folder, exist_ok=True)
        factor, thick = SCANS[self.scans]
        late, side = ([], 32) if self.tiny else (['nice', '-n', '10'], SIDE)
        run = subprocess.Popen([*late, self.data + '/bin/pairs', ct, self.data + '/slices.safetensors', str(first),
                                str(count), folder, str(side), str(factor), str(thick)],
                               stderr=subprocess.PIPE, text=True)
        self.running.add(run)
        said = run.communicate()[1]
        self.running.discard(run)
        if run.returncode == 0:
            open(folder + '/done', 'w').close()
        elif not self.left:
            print(said, flush=True)

    def close(self):
        """Nothing is left that makes pairs."""
        self.left = True
        for run in list(self.running):
            run.terminate()

    def collect(self):
        while not self.left:
            for path in glob.glob(self.folder + '/*/*.pair'):
                if path in self.seen:
                    continue
                self.seen.add(path)
                pair, key = Pair(path, self.device), os.path.basename(path)[:-len('.pair')].rsplit('-', 1)[0]
                with self.lock:
                    to = self.held if any(h in key for h in HELD) else self.by
                    to.setdefault(key, []).append(pair)
                    self.count += to is self.by
            time.sleep(.5)

    def ready(self):
        return len(self.by) >= (2 if self.tiny else 20) and len(self.held) >= (1 if self.tiny else 3)

    def network(self):
        width, blocks = (16, 1) if self.tiny else (96, 7)
        net = Network(width, blocks, self.half).to(self.device)
        self.whiten(net)
        return net

    def whiten(self, net):
        rng, dct = np.random.default_rng(7), cosines().to(self.device)
        sums = [0.] * 3
        for _ in range(8):
            x, rest, _, _, weight = self.batch(rng)
            for i, (t, w) in enumerate(((x[:, :VOXELS], 1.), (x[:, VOXELS:], weight[:, None, None, None, None]),
                                        (rest, weight[:, None, None, None, None]))):
                y = torch.einsum('oc,bcdhw->bodhw', dct, t)
                sums[i] = sums[i] + (y ** 2 * (w if i == 2 else 1.)).mean((0, 2, 3, 4)) / 8
        net.white_x.copy_(dct / torch.sqrt(sums[0] + (3 / UNIT_X) ** 2)[:, None])
        net.white_added.copy_(dct / torch.sqrt(sums[1] + (1 / UNIT_REST) ** 2)[:, None])
        gain = torch.sqrt(sums[2] / sums[2].mean() + 1e-3)
        net.colour.copy_((dct * gain[:, None]).t())

    def batch(self, source):
        rng = random.Random(int(source.integers(1 << 62)))
        side = rng.choices([20, 16, 12], [.45, .4, .15])[0]
        if self.tiny:
            side = 8
        count = max(1, (4 * 32 ** 3 if self.tiny else 16 * 80 ** 3 if self.device == 'cuda' else 4 * 48 ** 3)
                    // (CELL * side) ** 3)
        with self.lock:
            names = list(self.by)
        crops = []
        for tries in itertools.count():
            pairs = self.by[rng.choice(names)]
            pair = pairs[rng.randrange(len(pairs))]
            if min(pair.cells) < side:
                if tries > 400:
                    side, count, crops = 8, count, []
                continue
            crops.append((pair, [rng.randrange(c - side + 1) for c in pair.cells]))
            if len(crops) == count:
                break
        return self.cut(rng, crops, side)

    def cut(self, rng, crops, side):
        x, change, inside, told, weight = [], [], [], [], []
        for pair, at in crops:
            c = pair.x[(slice(None), *[slice(CELL * a, CELL * (a + side)) for a in at])]
            o = [0] + rng.sample([1, 2], 2) if sum(pair.coarse) == 1 else rng.sample([0, 1, 2], 3)
            c = c.permute(0, *[1 + a for a in o])
            flip = [1 + a for a in range(3) if rng.random() < .5]
            x.append(c.flip(flip) if flip else c)
            scale = math.exp(rng.uniform(-.7, .7)) if rng.random() < .3 else 1.
            change.append((scale, rng.uniform(-200, 200) if rng.random() < .3 else 0.))
            limits = []
            for a in range(3):  # two cells beside a cut know less than they will
                begin, end = 0 if at[o[a]] == 0 else 2, 0 if at[o[a]] + side == pair.cells[o[a]] else 2
                if 1 + a in flip:
                    begin, end = end, begin
                limits.append(slice(begin, side - end))
            inside.append(limits)
            told.append(told_of(pair.sigma, pair.noise * scale, pair.decimate, [pair.coarse[a] for a in o], pair.factor))
            weight.append(UNIT_REST ** 2 / max(pair.rms, LEAST_RMS) ** 2 / scale ** 2)
        mask = torch.zeros(len(crops), side, side, side)
        for m, limits in zip(mask, inside):
            m[tuple(limits)] = 1
        to = dict(device=self.device, non_blocking=True)
        q, ab = torch.stack(x).float(), torch.tensor(change).to(**to)[:, :, None, None, None]
        return (torch.cat([cells((q[:, 0] * (ab[:, 0] / SHARE_X) + ab[:, 1]) / UNIT_X),
                           cells(q[:, 1] * (ab[:, 0] / (SHARE_REST * UNIT_REST)))], 1),
                cells(q[:, 2] * (ab[:, 0] / (SHARE_REST * UNIT_REST))), mask.to(**to), torch.tensor(told).to(**to),
                torch.tensor(weight).to(**to))

    def loss(self, net, batch):
        x, rest, mask, told, weight = batch
        h, u = net(x, told)
        d, n = ((h - rest) ** 2).mean(1), mask.sum()
        each = weight[:, None, None, None] * mask
        loss = (each * d).sum() / n
        error = (mask * (u + (d.detach() * torch.exp(-u)).clamp(max=20))).sum() / n
        return loss + .005 * error, (each * (rest ** 2).mean(1)).sum() / n, loss

    def validate(self, net):
        left = {}
        with self.lock:
            held = {k: list(v)[:8] for k, v in self.held.items()}
        for key, pairs in sorted(held.items()):
            for pair in pairs:
                x, rest, told = pair.whole()
                h, _ = net(x, told)
                q = ((h - rest) ** 2).sum().item() / max((rest ** 2).sum().item(), 1e-9)
                left.setdefault(key.removesuffix('.nii'), []).append(q)
        left = {k: float(np.mean(v)) for k, v in left.items()}
        return float(np.mean(list(left.values()))) if left else 1., left

    def export(self, weights, path):
        g = {k: v.detach().cpu().double().numpy() for k, v in weights.items()}
        width, blocks = g['second_bias'].shape[1], g['second_bias'].shape[0]
        first = g['first.w'].reshape(width, 2, VOXELS, 3, 3, 3)
        first = np.stack([np.einsum('noabc,oi->niabc', first[:, 0], g['white_x']) / UNIT_X,
                          np.einsum('noabc,oi->niabc', first[:, 1], g['white_added']) / UNIT_REST], 1)
        regime = np.concatenate([g['regime.weight'], g['regime.bias'][:, None]], 1)
        rows = lambda kind: np.concatenate([g[f'{kind}.{i}.w'].reshape(width, -1) for i in range(blocks)])
        tensors = {
            'shape': np.array([CELL, width, blocks, 2], np.float32),
            'first': first.reshape(width, -1).astype(np.float32),
            'one': rows('one').astype(np.float16),
            'second': rows('second').astype(np.float16),
            'second_bias': g['second_bias'].astype(np.float32),
            'last': (UNIT_REST * np.einsum('po,ocxyz->pcxyz', g['colour'], g['last.w'])).reshape(VOXELS, -1)
            .astype(np.float32),
            'last_bias': (UNIT_REST * g['colour'] @ g['last_bias'])[None].astype(np.float32),
            'error': g['error.w'].reshape(1, -1).astype(np.float32),
            'error_bias': (g['error_bias'] + 2 * math.log(UNIT_REST))[None].astype(np.float32),
            'regime': regime.astype(np.float32)}
        write({f'{self.name}.{k}': v for k, v in tensors.items()}, path)


def write(tensors, path, meta=None):
    """A safetensors file, whole or not there."""
    head, data = ({'__metadata__': meta} if meta else {}), b''
    for name, t in tensors.items():
        t = np.ascontiguousarray(t)
        head[name] = {'dtype': 'F16' if t.dtype == np.float16 else 'F32', 'shape': list(t.shape),
                      'data_offsets': [len(data), len(data) + t.nbytes]}
        data += t.tobytes()
    text = json.dumps(head, separators=(',', ':')).encode()
    text += b' ' * (-len(text) % 8)
    with open(path + '.part', 'wb') as f:
        f.write(struct.pack('<Q', len(text)) + text + data)
    os.replace(path + '.part', path)
