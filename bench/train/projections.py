# SPDX-License-Identifier: Apache-2.0
"""The diffusion prior of projections (src/prior/prior.safetensors), trained with PyTorch: its data, its
network, its loss and its file. bench/train/train.py has the loop.

Data are views that bench/train/projections.c makes of CTs in the background, and a share of radiographs. All
views lie end to end in one array on the device; a piece of one is cut, reduced, turned and mirrored there
by one index. See Projections.
"""
import glob
import json
import math
import os
import struct
import subprocess
import threading
import time
import zlib

import numpy as np
import torch
import torch.nn.functional as F
from torch import nn

STEPS = 1000
MAP = "2 x / max - 1; max: of the stack, or of the picture's type"
HELD = ('lidc0003', 'fullhead', 'tciasts047')
LEFT_OUT = ('covidctmd', 'mouse')  # licences unclear, or not ours
CEILING = 1.25  # of projections.c, what 65535 means


def share_left():
    """abar: part of the picture's energy that is left at every timestep."""
    return torch.cumprod(1 - torch.linspace(1e-4, .02, STEPS, dtype=torch.float64), 0)


GROUPS = 32


class NormSilu(torch.autograd.Function):
    """silu(k (x - m) r + b), x of group mean m and deviation 1 / r; k and b of [batch][channels] are float32, and so
    are all sums, x may be bfloat16. Fewer passes than group_norm, in the order of x: that of channels_last costs no
    transposition."""

    @staticmethod
    def forward(ctx, x, k, b):
        with torch.autocast(x.device.type, dtype=torch.bfloat16, enabled=False):
            n, c = x.shape[:2]
            count = x[0].numel() // GROUPS
            m = x.sum((2, 3), dtype=k.dtype).view(n, GROUPS, -1).sum(2) / count
            square = torch.linalg.vector_norm(x, dim=(2, 3), dtype=k.dtype).square().view(n, GROUPS, -1).sum(2) / count
            r = ((square - m * m).clamp_min(0) + 1e-5).rsqrt()
            m, r = (v[:, :, None].expand(-1, -1, c // GROUPS).reshape(n, c) for v in (m, r))
            ctx.save_for_backward(x, k, b, m, r)
            return F.silu(NormSilu.affine(x, k * r, b - m * k * r))

    @staticmethod
    def affine(x, k, b):
        return torch.addcmul(b.to(x.dtype)[:, :, None, None], x, k.to(x.dtype)[:, :, None, None])

    @staticmethod
    def backward(ctx, g):
        x, k, b, m, r = ctx.saved_tensors
        with torch.autocast(x.device.type, dtype=torch.bfloat16, enabled=False):
            n, c = x.shape[:2]
            count = x[0].numel() // GROUPS

            def grouped(v):
                return v.view(n, GROUPS, -1).sum(2, keepdim=True).expand(-1, -1, c // GROUPS).reshape(n, c)
            g = torch.ops.aten.silu_backward(g.to(x.dtype), NormSilu.affine(x, k * r, b - m * k * r))
            db = g.sum((2, 3), dtype=k.dtype)
            dk = r * ((g * x).sum((2, 3), dtype=k.dtype) - m * db)
            slope = -grouped(k * dk) * r * r / count  # of what depends on the deviation; k dk / r: of r itself
            level = -grouped(k * r * db) / count - slope * m
            dx = torch.addcmul(NormSilu.affine(x, slope, level), g, (k * r).to(x.dtype)[:, :, None, None])
        return dx, dk, db


class Norm(nn.GroupNorm):
    """The norm of 32 groups and what follows it: scale and shift of the timestep, if any, and SiLU."""

    def __init__(self, channels):
        super().__init__(GROUPS, channels, 1e-5)

    def forward(self, x, change=None):
        k, b = self.weight.expand(len(x), -1), self.bias.expand(len(x), -1)
        if change is not None:
            scale, shift = change.to(k.dtype).chunk(2, 1)
            k, b = k * (1 + scale), b * (1 + scale) + shift
        return NormSilu.apply(x, k, b)


def zero(layer):
    for p in layer.parameters():
        nn.init.zeros_(p)
    return layer


def change(x, how):
    return F.interpolate(x, scale_factor=2., mode='nearest') if how > 0 else F.avg_pool2d(x, 2) if how < 0 else x


class Block(nn.Module):
    """Residual block with scale and shift of the timestep; how: -1 halves the picture, 1 doubles it."""

    def __init__(self, n, out, embedding, how=0):
        super().__init__()
        self.how = how
        # Names as published: a norm does the SiLU behind it.
        self.in_layers = nn.Sequential(Norm(n), nn.Identity(), nn.Conv2d(n, out, 3, padding=1))
        self.emb_layers = nn.Sequential(nn.SiLU(), nn.Linear(embedding, 2 * out))
        self.out_layers = nn.ModuleList(
            [Norm(out), nn.Identity(), nn.Identity(), zero(nn.Conv2d(out, out, 3, padding=1))])
        self.skip_connection = nn.Identity() if n == out else nn.Conv2d(n, out, 1)

    def forward(self, x, e):
        h = self.in_layers[2](change(self.in_layers[0](x), self.how))
        h = self.out_layers[3](self.out_layers[0](h, self.emb_layers(e)))
        return self.skip_connection(change(x, self.how)) + h


class Attention(nn.Module):
    def __init__(self, n, width=32):
        super().__init__()
        self.width = width
        self.norm = nn.GroupNorm(GROUPS, n)
        self.qkv = nn.Conv1d(n, 3 * n, 1)
        self.proj_out = zero(nn.Conv1d(n, n, 1))

    def forward(self, x, e):
        b, c, h, w = x.shape
        v = x.reshape(b, c, h * w)
        q, k, v = self.qkv(self.norm(v.float())).reshape(b * c // self.width, 3 * self.width, h * w).split(self.width, 1)
        weight = torch.softmax((torch.einsum('bct,bcs->bts', q, k) / math.sqrt(self.width)).float(), -1)
        a = torch.einsum('bts,bcs->bct', weight.to(v.dtype), v).reshape(b, c, h * w)
        return x + self.proj_out(a).reshape(b, c, h, w)


class Net(nn.Module):
    """U-Net of guided diffusion (Dhariwal and Nichol 2021), with its names: one channel, attention in the
    middle, pictures halved and doubled by residual blocks. The first and last layer and the timestep are
    float32 whatever autocast says: of little noise bfloat16 holds too little beside the picture."""

    def __init__(self, width, mult, blocks):
        super().__init__()
        self.shape = dict(width=width, mult=mult, blocks=blocks)
        e, ch = 4 * width, width * mult[0]
        self.time_embed = nn.Sequential(nn.Linear(width, e), nn.SiLU(), nn.Linear(e, e))
        self.input_blocks = nn.ModuleList([nn.ModuleList([nn.Conv2d(1, ch, 3, padding=1)])])
        kept = [ch]
        for level, m in enumerate(mult):
            for _ in range(blocks):
                self.input_blocks.append(nn.ModuleList([Block(ch, width * m, e)]))
                ch = width * m
                kept.append(ch)
            if level + 1 < len(mult):
                self.input_blocks.append(nn.ModuleList([Block(ch, ch, e, -1)]))
                kept.append(ch)
        self.middle_block = nn.ModuleList([Block(ch, ch, e), Attention(ch), Block(ch, ch, e)])
        self.output_blocks = nn.ModuleList()
        for level, m in reversed(list(enumerate(mult))):
            for i in range(blocks + 1):
                parts = [Block(ch + kept.pop(), width * m, e)]
                ch = width * m
                if level and i == blocks:
                    parts.append(Block(ch, ch, e, 1))
                self.output_blocks.append(nn.ModuleList(parts))
        self.out = nn.Sequential(Norm(ch), nn.Identity(), zero(nn.Conv2d(ch, 1, 3, padding=1)))

    def embed(self, t):
        half = self.shape['width'] // 2
        rate = torch.exp(-math.log(10000) * torch.arange(half, device=t.device, dtype=torch.float32) / half)
        f = t.float()[:, None] * rate
        return self.time_embed(torch.cat([f.cos(), f.sin()], 1))

    def forward(self, x, t):
        kind = x.device.type
        with torch.autocast(kind, dtype=torch.bfloat16, enabled=False):
            e = self.embed(t)
            # One channel is in both orders, and would make all that follows be in the other.
            order = torch.channels_last if x.is_cuda else torch.contiguous_format
            h = self.input_blocks[0][0](x.float()).contiguous(memory_format=order)
        if torch.is_autocast_enabled() if kind == 'cuda' else torch.is_autocast_cpu_enabled():
            h = h.to(torch.bfloat16)
        kept = [h]
        for parts in self.input_blocks[1:]:
            for part in parts:
                h = part(h, e)
            kept.append(h)
        for part in self.middle_block:
            h = part(h, e)
        for parts in self.output_blocks:
            h = torch.cat([h, kept.pop().to(h.dtype)], 1)
            for part in parts:
                h = part(h, e)
        with torch.autocast(kind, dtype=torch.bfloat16, enabled=False):
            return self.out(h.float())


class Views:
    """Views end to end in one array on the device, int16 of value - 32768, and what is known of each."""

    def __init__(self, device, room):
        self.device, self.lock = device, threading.Lock()
        self.data = torch.empty(room, dtype=torch.int16, device=device)
        self.used = 0
        self.table = np.zeros((0, 5), np.int64)  # offset, rows, columns, patient, radiograph
        self.weight = np.zeros(0)
        self.choice = {}

    def add(self, pixels, sizes, patient, radiograph, weight):
        """pixels: uint16, of all views; sizes [n][2]. False if there is no room."""
        n = int(pixels.size)
        flat = torch.from_numpy((pixels.reshape(-1) ^ 0x8000).view(np.int16))
        with self.lock:
            if self.used + n > self.data.numel():
                return False
            self.data[self.used:self.used + n].copy_(flat)
            if self.data.is_cuda:
                torch.cuda.current_stream(self.data.device).synchronize()
            count = sizes[:, 0].astype(np.int64) * sizes[:, 1]
            at = self.used + np.cumsum(count) - count
            rows = np.stack([at, sizes[:, 0], sizes[:, 1], np.full(len(at), patient), np.full(len(at), radiograph)], 1)
            self.used += n
            self.table = np.concatenate([self.table, rows.astype(np.int64)])
            self.weight = np.concatenate([self.weight, np.full(len(at), weight)])
            self.choice = {}
        return True

    def draw(self, rng, n, least, radiographs):
        """n views of at least so many pixels a side, projections or radiographs: rows of the table; or None."""
        with self.lock:
            key = least, radiographs
            if key not in self.choice:
                fits = (self.table[:, 1:3].min(1) >= least) & (self.table[:, 4] == radiographs)
                which = np.flatnonzero(fits)
                self.choice[key] = self.table[which], np.cumsum(self.weight[which])
            table, sums = self.choice[key]
        if not len(table):
            return None
        return table[np.searchsorted(sums, rng.random(n) * sums[-1], side='right').clip(0, len(table) - 1)]

    def cut(self, size, by, base, down, right):
        """Pieces of size x size: pixel (i, j) of a piece is the mean of by x by values from base + by (i down
        + j right) on. float32 in [0, CEILING]."""
        put = [torch.as_tensor(v, device=self.device)[:, None, None] for v in (base, down, right)]
        i = torch.arange(size * by, device=self.device)
        x = self.data[put[0] + i[:, None] * put[1] + i * put[2]].float()[:, None]
        x = F.avg_pool2d(x, by) if by > 1 else x
        return (x + 32768) * (CEILING / 65535)


def placed(rng, views, size):
    """Where pieces of such sides begin in their views, and the steps down and right, turned and mirrored at random."""
    n = len(views)
    rows, columns = views[:, 1], views[:, 2]
    r = (rng.random(n) * (rows - size + 1)).astype(np.int64)
    c = (rng.random(n) * (columns - size + 1)).astype(np.int64)
    flip = rng.random((n, 2)) < .5
    down, right = np.where(flip[:, 0], -columns, columns), np.where(flip[:, 1], -1, 1)
    base = views[:, 0] + np.where(flip[:, 0], r + size - 1, r) * columns + np.where(flip[:, 1], c + size - 1, c)
    turn = rng.random(n) < .5
    return base, np.where(turn, right, down), np.where(turn, down, right)


def read_views(path):
    """What projections.c wrote: pixels of all views, sizes [n][2]; None if it is another file."""
    with open(path, 'rb') as f:
        b = f.read()
    if b[:4] != b'ctpv':
        return None
    n, ceiling = struct.unpack('<If', b[4:12])
    sizes = np.frombuffer(b, '<u4', 2 * n, 12).reshape(n, 2)
    pixels = np.frombuffer(b, '<u2', -1, 12 + 8 * n)
    return (pixels, sizes) if ceiling == CEILING and pixels.size == int((sizes[:, 0] * sizes[:, 1]).sum()) else None


class Projections:
    """Pieces of 96 to 192 pixels of projections, and of radiographs with random tone curves; noise prediction
    as in DDPM, plain mean square (see loss).

    Every patient is seen as often as another, limbs half as often (13 of 26 CTs are of limbs). `data` holds
    ct/*.nii, xray.npy and bin/projections; what is made stays in projections/.
    """
    name = 'projections'
    rate, decay, average = 8e-4, 1e-3, .999
    # The shipped network (32; 1, 2, 3, 4) has 8.3 MB: this one is 7.5 MB and .81 of its work at 128 x 128.
    shape = dict(width=32, mult=(1, 2, 2, 3, 3), blocks=1)
    sizes = (96, 128, 160, 192)
    count, rounds, first = 48, 20, 2     # views a call of project; calls a CT; of which before the training begins
    pixels = 128 * 128 * 128             # of a batch
    radiographs = .1

    def __init__(self, data, device, tiny=False):
        self.device, self.tiny, self.data = torch.device(device), tiny, data
        cuda = self.device.type == 'cuda'
        if tiny:
            self.shape = dict(width=32, mult=(1, 1, 1, 1), blocks=1)
            self.sizes, self.pixels, self.count, self.rounds = (96,), 2 * 96 * 96, 8, 2
        elif not cuda:
            self.pixels, self.rounds = 8 * 96 * 96, 8
        room = 1 << 31 if cuda else 1 << 28
        self.views, self.held_views = Views(self.device, room), Views(self.device, 1 << 26)
        self.abar = share_left().to(self.device, torch.float32)
        self.folder = os.path.join(data, 'projections')
        os.makedirs(self.folder, exist_ok=True)
        files = sorted(glob.glob(os.path.join(data, 'ct', '*.nii')))
        self.patients = [f for f in files if not any(w in os.path.basename(f) for w in LEFT_OUT)]
        self.names = [os.path.basename(f).split('_iso')[0].split('.')[0] for f in self.patients]
        self.held = [i for i, n in enumerate(self.names) if any(h in n for h in HELD)]
        if not self.patients or len(self.held) == len(self.patients):
            raise SystemExit('%s: no CT to train on: expected ct/*.nii, beside those held out' % data)
        if tiny:
            train = [i for i in range(len(self.names)) if i not in self.held][:2]
            self.jobs = [(i, 0) for i in self.held[:1] + train]
        else:
            self.jobs = [(i, r) for r in range(self.rounds) for i in sorted(
                range(len(self.names)), key=lambda i: i not in self.held) if r == 0 or i not in self.held]
        self.wanted = {j for j in self.jobs if j[1] < self.first}
        self.job_lock, self.failed, self.stopped, self.fixed = threading.Lock(), None, False, None
        self.next = 0
        self.have_radiographs = self.add_radiographs(os.path.join(data, 'xray.npy'))
        self.threads = [threading.Thread(target=self.make, daemon=True) for _ in range(max(1, os.cpu_count() or 1))]
        for t in self.threads:
            t.start()

    def add_radiographs(self, path):
        if not os.path.exists(path):
            return False
        x = np.load(path)
        n, h, w = x.shape
        # 255 is 1 of the picture
        pixels = np.rint(x.astype(np.float32) * (65535 / 255 / CEILING)).astype(np.uint16)
        return self.views.add(pixels, np.tile([[h, w]], (n, 1)), -1, 1, 1.)

    def make(self):
        """One of the threads that have bench/train/projections make views, one process each, and move them to the device."""
        while not self.stopped:
            with self.job_lock:
                if self.next >= len(self.jobs):
                    return
                job = self.jobs[self.next]
                self.next += 1
            try:
                self.make_one(*job)
            except Exception as e:  # the loop asks ready(), which raises it
                self.failed = e
                return

    def make_one(self, i, r):
        out = os.path.join(self.folder, '%s-%d.raw' % (self.names[i], r))
        if not os.path.exists(out) or read_views(out) is None:
            seed = zlib.crc32(self.names[i].encode()) * 1000 + r
            command = [os.path.join(self.data, 'bin', 'projections'), self.patients[i], out, str(seed), str(self.count)]
            done = subprocess.run(['nice', '-n', '0' if r < self.first else '10'] + command,
                                  stderr=subprocess.PIPE, text=True)
            if done.returncode:
                raise RuntimeError('%s: %s' % (' '.join(command), done.stderr.strip()))
        pixels, sizes = read_views(out)
        limb = 'limb' in self.names[i]
        to = self.held_views if i in self.held else self.views
        if not to.add(pixels, sizes, i, 0, .5 if limb else 1.):
            self.stopped = True  # there is no more room
        with self.job_lock:
            self.wanted.discard((i, r))

    def ready(self):
        if self.failed:
            raise self.failed
        return not self.wanted

    def network(self):
        torch.manual_seed(1)
        net = Net(**self.shape).to(self.device)
        return net.to(memory_format=torch.channels_last) if self.device.type == 'cuda' else net

    def batch(self, rng):
        """Pieces in [-1, 1], timesteps and noise: a function of rng and of the views that there are."""
        size = int(rng.choice(self.sizes))
        n = max(2, self.pixels // size ** 2)
        by = 2 if rng.random() < .2 else 1
        photos = rng.binomial(n, self.radiographs) if self.have_radiographs and size * by <= 256 else 0
        photos = min(photos, n - 1)
        views = self.views.draw(rng, n - photos, size * by, 0)
        if views is None:
            by = 1
            views = self.views.draw(rng, n - photos, size, 0)
        gamma, curve = np.ones(n), np.zeros(n)
        if photos:
            drawn = self.views.draw(rng, photos, size * by, 1)
            views = np.concatenate([drawn, views])
            gamma[:photos] = np.exp(rng.uniform(math.log(.5), math.log(2), photos))
            curve[:photos] = rng.uniform(-.5, 1, photos)
        x = self.views.cut(size, by, *placed(rng, views, size * by))

        def put(v):
            return torch.as_tensor(v, dtype=torch.float32, device=self.device)[:, None, None, None]
        if photos:
            y = x[:photos].clamp(0, 1) ** put(gamma[:photos])
            x[:photos] = y + put(curve[:photos]) * (y * y * (3 - 2 * y) - y)
        # Views of a stack have not all its largest value, which is that of coarser pixels besides.
        x = x * put(np.where(rng.random(n) < .5, rng.uniform(.75, 1.03, n), 1))
        # One timestep of each of n strata; half of them where a sampler of 50 steps makes detail.
        u = (rng.permutation(n) + rng.random(n)) / n
        t = torch.as_tensor(STEPS * np.where(u < .3, u, (u - .3) / .7)).long().clamp(0, STEPS - 1).to(self.device)
        source = torch.Generator(self.device).manual_seed(int(rng.integers(1 << 62)))
        z = torch.randn(x.shape, generator=source, device=self.device)
        return 2 * x - 1, t, z

    def noisy(self, x, t, z):
        a = self.abar[t][:, None, None, None]
        return a.sqrt() * x + (1 - a).sqrt() * z

    def loss(self, net, batch):
        """Mean square of what is left of the noise, not weighted: weights that even out the error of the picture
        (min-SNR) take it from the small timesteps, and there DDNM makes the detail that it adds."""
        x, t, z = batch
        e = net(self.noisy(x, t, z), t).float() - z
        return (e * e).mean(), (z * z).mean()

    def fixed_pieces(self):
        """Pieces of the held-out patients, their timesteps and noise: always the same."""
        rng, out = np.random.default_rng(7), {}
        size, n = (128, 48) if self.device.type == 'cuda' else (96, 8)
        for i in self.held:
            mine = self.held_views.table[self.held_views.table[:, 3] == i]
            mine = mine[mine[:, 1:3].min(1) >= size]
            if not len(mine):
                continue
            mine = mine[rng.integers(len(mine), size=n)]
            x = 2 * self.held_views.cut(size, 1, *placed(rng, mine, size)) - 1
            t = torch.as_tensor((2 * np.arange(n) + 1) * STEPS // (2 * n)).to(self.device)
            z = torch.as_tensor(rng.standard_normal(x.shape, dtype=np.float32)).to(self.device)
            out[self.names[i]] = x, t, z
        return out

    def validate(self, net):
        """Mean loss of the held-out patients, in float32, and of each of them."""
        if self.fixed is None:
            self.fixed = self.fixed_pieces()
        was, each = net.training, {}
        net.eval()
        with torch.no_grad(), torch.autocast(self.device.type, dtype=torch.bfloat16, enabled=False):
            for name, (x, t, z) in self.fixed.items():
                y = torch.cat([net(self.noisy(*p), p[1]).float() for p in zip(*(v.split(16) for v in (x, t, z)))])
                each[name] = float(((y - z) ** 2).mean())
        net.train(was)
        return sum(each.values()) / max(1, len(each)), each

    def export(self, weights, path):
        """Matrices as F16, vectors as F32; with what ct-ddnm --prior has to know."""
        s = self.shape
        trained = sorted(n for i, n in enumerate(self.names) if i not in self.held)
        meta = {'image_size': str(self.sizes[-1]), 'in_channels': '1', 'model_channels': str(s['width']),
                'out_channels': '1', 'num_res_blocks': str(s['blocks']), 'attention_resolutions': '[]',
                'channel_mult': str(list(s['mult'])), 'num_head_channels': '32', 'num_heads': '4',
                'use_scale_shift_norm': 'True', 'resblock_updown': 'True', 'use_new_attention_order': 'False',
                'conv_resample': 'True', 'beta_schedule': 'linear', 'ema': str(self.average), 'intensity_map': MAP,
                'dataset': 'projections of ' + '; '.join(trained) + ('; radiographs' if self.have_radiographs else ''),
                'licence': 'Apache-2.0'}
        write_tensors(path, weights, meta)

    def close(self):
        self.stopped = True


def write_tensors(path, weights, meta):
    """weights: name -> tensor; those of two dimensions and more as F16."""
    head, parts, at = {'__metadata__': meta}, [], 0
    for name, w in weights.items():
        kind, form = ('F16', torch.float16) if w.dim() > 1 else ('F32', torch.float32)
        b = w.detach().cpu().contiguous().to(form).numpy().tobytes()
        head[name] = {'dtype': kind, 'shape': list(w.shape), 'data_offsets': [at, at + len(b)]}
        parts.append(b)
        at += len(b)
    text = json.dumps(head, separators=(',', ':')).encode()
    text += b' ' * (-len(text) % 8)
    with open(path + '.part', 'wb') as f:
        f.write(struct.pack('<Q', len(text)) + text)
        f.writelines(parts)
    os.replace(path + '.part', path)


def pack_radiographs(folder, out, count=120, side=256):
    """PNG of a folder as uint8 [count][side][side], every (n / count)th of the names in order, averaged down:
    3.8 MB when compressed. Needs Pillow."""
    from PIL import Image
    files = sorted(glob.glob(os.path.join(folder, '*.png')))
    files = [files[i * len(files) // count] for i in range(min(count, len(files)))] if len(files) > count else files
    x = [np.asarray(Image.open(f).convert('L').resize((side, side), Image.BOX)) for f in files]
    np.save(out, np.stack(x))
