# SPDX-License-Identifier: Apache-2.0
"""RDN and Omni-SR in PyTorch, for tests/t-train.sh: written from the papers.

    supervised-torch.py make        NET-SIZE.pt: random weights, a picture and a target
    supervised-torch.py compare     with what t-super-net answers, NET-SIZE.safetensors
    supervised-torch.py stack NET NUMBERS...    with what ct-ddnm made of lr.exr by NET.safetensors, NET.exr;
                                                NUMBERS are the arguments of the class but the last
"""
import json
import struct
import sys

import torch
from torch import nn
from torch.nn import functional as F

torch.set_num_threads(1)


class Residual(nn.Module):
    """x + fn(norm(x)); norm over the channels."""

    def __init__(self, c, fn, eps):
        super().__init__()
        self.norm, self.fn = nn.LayerNorm(c, eps=eps), fn

    def forward(self, x):
        return x + self.fn(self.norm(x.permute(0, 2, 3, 1)).permute(0, 3, 1, 2))


class Dense(nn.Module):
    def __init__(self, ci, co):
        super().__init__()
        self.conv = nn.Sequential(nn.Conv2d(ci, co, 3, padding=1), nn.ReLU())

    def forward(self, x):
        return torch.cat((x, self.conv(x)), 1)


class DenseBlock(nn.Module):
    def __init__(self, c, growth, layers):
        super().__init__()
        self.convs = nn.Sequential(*[Dense(c + i * growth, growth) for i in range(layers)])
        self.LFF = nn.Conv2d(c + layers * growth, c, 1)

    def forward(self, x):
        return x + self.LFF(self.convs(x))


class Rdn(nn.Module):
    def __init__(self, blocks, layers, growth, c, factor, colours):
        super().__init__()
        self.SFENet1 = nn.Conv2d(colours, c, 3, padding=1)
        self.SFENet2 = nn.Conv2d(c, c, 3, padding=1)
        self.RDBs = nn.ModuleList([DenseBlock(c, growth, layers) for _ in range(blocks)])
        self.GFF = nn.Sequential(nn.Conv2d(blocks * c, c, 1), nn.Conv2d(c, c, 3, padding=1))
        up, ci, rest, r = [], c, factor, 2
        while rest > 1:
            while rest % r == 0:
                up += [nn.Conv2d(ci, growth * r * r, 3, padding=1), nn.PixelShuffle(r)]
                ci, rest = growth, rest // r
            r += 1
        self.UPNet = nn.Sequential(*up, nn.Conv2d(growth, colours, 3, padding=1))

    def forward(self, x):
        first = self.SFENet1(x)
        x, outs = self.SFENet2(first), []
        for block in self.RDBs:
            x = block(x)
            outs.append(x)
        return self.UPNet(self.GFF(torch.cat(outs, 1)) + first)


class Squeeze(nn.Module):
    def __init__(self, c):
        super().__init__()
        self.gate = nn.Sequential(nn.Identity(), nn.Linear(c, c // 4, bias=False), nn.SiLU(),
                                  nn.Linear(c // 4, c, bias=False), nn.Sigmoid())

    def forward(self, x):
        return x * self.gate(x.mean((2, 3)))[:, :, None, None]


class Local(nn.Module):
    def __init__(self, c):
        super().__init__()
        self.fn = nn.Sequential(nn.Conv2d(c, c, 1), nn.GELU(), nn.Conv2d(c, c, 3, padding=1, groups=c),
                                nn.GELU(), Squeeze(c), nn.Conv2d(c, c, 1))

    def forward(self, x):
        return x + self.fn(x)


class Gated(nn.Module):
    def __init__(self, c):
        super().__init__()
        self.project_in = nn.Conv2d(c, 2 * c, 1, bias=False)
        self.dwconv = nn.Conv2d(2 * c, 2 * c, 3, padding=1, groups=2 * c, bias=False)
        self.project_out = nn.Conv2d(c, c, 1, bias=False)

    def forward(self, x):
        a, b = self.dwconv(self.project_in(x)).chunk(2, 1)
        return self.project_out(F.gelu(a) * b)


def groups(x, size, kind):
    """[B, C, H, W] to [groups, pixels of one, C], and what takes it back."""
    b, c, h, w = x.shape
    # an axis as (far, near): blocks are of near pixels, grids and combs of far ones
    m, n = (h // size, w // size) if kind != "grid" else (size, size)
    i, j = h // m, w // n
    x = x.reshape(b, c, m, i, n, j)
    order = (0, 2, 4, 3, 5, 1) if kind == "block" else (0, 3, 5, 2, 4, 1)
    back = [order.index(k) for k in range(6)]
    y = x.permute(order)
    shape = y.shape

    def undo(z):
        return z.reshape(shape[:5] + (-1,)).permute(back).reshape(b, -1, h, w)

    return y.reshape(shape[0] * shape[1] * shape[2], -1, c), undo


class Pixels(nn.Module):
    def __init__(self, c, heads, size, kind):
        super().__init__()
        self.heads, self.size, self.kind = heads, size, kind
        self.to_qkv = nn.Linear(c, 3 * c, bias=False)
        self.to_out = nn.Sequential(nn.Linear(c, c, bias=False))
        self.rel_pos_bias = nn.Embedding((2 * size - 1) ** 2, heads)
        at = torch.stack(torch.meshgrid(torch.arange(size), torch.arange(size), indexing="ij"), -1).reshape(-1, 2)
        d = at[:, None] - at[None] + size - 1
        self.place = d[..., 0] * (2 * size - 1) + d[..., 1]

    def forward(self, x):
        x, undo = groups(x, self.size, self.kind)
        q, k, v = [t.reshape(t.shape[0], t.shape[1], self.heads, -1).transpose(1, 2)
                   for t in self.to_qkv(x).chunk(3, -1)]
        s = q @ k.transpose(-1, -2) * q.shape[-1] ** -0.5 + self.rel_pos_bias(self.place).permute(2, 0, 1)
        y = (s.softmax(-1) @ v).transpose(1, 2).reshape(x.shape)
        return undo(self.to_out(y))


class Channels(nn.Module):
    def __init__(self, c, heads, size, kind):
        super().__init__()
        self.heads, self.size, self.kind = heads, size, kind
        self.temperature = nn.Parameter(torch.ones(heads, 1, 1))
        self.qkv = nn.Conv2d(c, 3 * c, 1, bias=False)
        self.qkv_dwconv = nn.Conv2d(3 * c, 3 * c, 3, padding=1, groups=3 * c, bias=False)
        self.project_out = nn.Conv2d(c, c, 1, bias=False)

    def forward(self, x):
        y, undo = groups(self.qkv_dwconv(self.qkv(x)), self.size, self.kind)
        q, k, v = [t.transpose(1, 2).reshape(t.shape[0], self.heads, -1, t.shape[1]) for t in y.chunk(3, -1)]
        s = F.normalize(q, dim=-1) @ F.normalize(k, dim=-1).transpose(-1, -2) * self.temperature
        z = (s.softmax(-1) @ v).reshape(y.shape[0], -1, y.shape[1]).transpose(1, 2)
        return self.project_out(undo(z))


class Block(nn.Module):
    def __init__(self, c, heads, size):
        super().__init__()
        self.layer = nn.ModuleDict({
            "0": Local(c),
            "2": Residual(c, Pixels(c, heads, size, "block"), 1e-5),
            "4": Residual(c, Gated(c), 1e-6),
            "5": Residual(c, Channels(c, heads, size, "block"), 1e-6),
            "6": Residual(c, Gated(c), 1e-6),
            "8": Residual(c, Pixels(c, heads, size, "grid"), 1e-5),
            "10": Residual(c, Gated(c), 1e-6),
            "11": Residual(c, Channels(c, heads, size, "comb"), 1e-6),
            "12": Residual(c, Gated(c), 1e-6),
        })

    def forward(self, x):
        for layer in self.layer.values():
            x = layer(x)
        return x


class Esa(nn.Module):
    def __init__(self, c):
        super().__init__()
        f = max(c // 4, 16)
        self.conv1, self.conv_f = nn.Conv2d(c, f, 1), nn.Conv2d(f, f, 1)
        self.conv2, self.conv3 = nn.Conv2d(f, f, 3, stride=2), nn.Conv2d(f, f, 3, padding=1)
        self.conv4 = nn.Conv2d(f, c, 1)

    def forward(self, x):
        a = self.conv1(x)
        b = self.conv3(F.max_pool2d(self.conv2(a), 7, 3))
        b = F.interpolate(b, x.shape[2:], mode="bilinear", align_corners=False)
        return x * torch.sigmoid(self.conv4(b + self.conv_f(a)))


class Group(nn.Module):
    def __init__(self, layers, c, heads, size):
        super().__init__()
        self.residual_layer = nn.Sequential(*[Block(c, heads, size) for _ in range(layers)], nn.Conv2d(c, c, 1))
        self.esa = Esa(c)

    def forward(self, x):
        return self.esa(x + self.residual_layer(x))


class Omni(nn.Module):
    def __init__(self, blocks, layers, c, heads, size, factor, colours):
        super().__init__()
        self.input, self.output = nn.Conv2d(colours, c, 3, padding=1), nn.Conv2d(c, c, 3, padding=1)
        self.residual_layer = nn.Sequential(*[Group(layers, c, heads, size) for _ in range(blocks)])
        self.up = nn.Sequential(nn.Conv2d(c, colours * factor ** 2, 3, padding=1), nn.PixelShuffle(factor))

    def forward(self, x):
        first = self.input(x)
        return self.up(first + self.output(self.residual_layer(first)))


NETS = {
    ("rdn", "small"): (lambda: Rdn(2, 3, 6, 8, 6, 1), 1, 6, (9, 7)),
    ("rdn", "published"): (lambda: Rdn(16, 8, 64, 64, 4, 3), 3, 4, (6, 8)),
    ("omni", "small"): (lambda: Omni(2, 2, 16, 4, 4, 3, 1), 1, 3, (16, 24)),
    ("omni", "published"): (lambda: Omni(5, 1, 64, 4, 8, 4, 3), 3, 4, (24, 32)),
}


def network(net, size):
    torch.manual_seed(1)
    make, colours, factor, (h, w) = NETS[net, size]
    n = make()
    with torch.no_grad():
        for p in n.parameters():  # gains and temperatures too
            p += 0.05 * torch.randn(p.shape)
    return n, torch.randn(1, colours, h, w), torch.randn(1, colours, h * factor, w * factor)


def safetensors(path):
    data = open(path, "rb").read()
    n, = struct.unpack("<Q", data[:8])
    for k, v in json.loads(data[8:8 + n]).items():
        if k != "__metadata__":
            a, b = v["data_offsets"]
            yield k, torch.frombuffer(bytearray(data[8 + n + a:8 + n + b]), dtype=torch.float32).reshape(v["shape"])


def compare(net, size):
    n, x, y = network(net, size)
    got = dict(safetensors(f"{net}-{size}.safetensors"))
    z = n(x)
    F.l1_loss(z, y).backward()
    forward = float((got.pop("y") - z).abs().max() / z.abs().max())
    grads = dict(n.named_parameters())
    assert grads.keys() == got.keys(), grads.keys() ^ got.keys()
    back = max(float((got[k] - p.grad).abs().max() / p.grad.abs().max().clamp_min(1e-12)) for k, p in grads.items())
    good = forward < 1e-5 and (size == "published" or back < 1e-4)
    print(f"{'good' if good else 'bad'} {net} {size}: {sum(p.numel() for p in n.parameters())} parameters, "
          f"forward {forward:.2g}, gradients {back:.2g}")


def stack(net, *numbers):
    """A view over the largest value, raised to 0, is mapped to [-1, 1]; its sides go on, reflected, to multiples."""
    import exr
    numbers = [int(v) for v in numbers]
    n = (Rdn if net == "rdn" else Omni)(*numbers, 1)
    n.load_state_dict(dict(safetensors(net + ".safetensors")))
    low, high, factor = exr.read("lr.exr"), exr.read(net + ".exr"), numbers[-1]
    most, worst = max(max(v) for v in low), 0
    for a, b in zip(low, high):
        side = round(len(a) ** 0.5)
        x = torch.tensor(a).reshape(1, 1, side, side) / most
        wide = side if net == "rdn" else -(-side // 16) * 16
        at = [min(i, 2 * side - 1 - i) for i in range(wide)]
        y = n(2 * x[:, :, at][:, :, :, at].clamp_min(0) - 1)[0, 0, :side * factor, :side * factor]
        y = (0.5 * (y + 1)).clamp(0, 1.05)
        worst = max(worst, float((y - torch.tensor(b).reshape(y.shape) / most).abs().max()))
    print(f"{'good' if worst < 1e-5 else 'bad'} {net}: off by {worst:.2g} of the largest value")


def main():
    if sys.argv[1] == "stack":
        stack(*sys.argv[2:])
        return
    for net, size in NETS:
        if sys.argv[1] == "compare":
            compare(net, size)
            continue
        n, x, y = network(net, size)
        torch.save({**n.state_dict(), "io.x": x, "io.y": y}, f"{net}-{size}.pt")


with torch.no_grad() if sys.argv[1] == "stack" else torch.enable_grad():
    main()
