# SPDX-License-Identifier: Apache-2.0
"""naf_twin.py P.exr HR.nii OUT.nii STEPS: NAF of projections by PyTorch, as its authors configure it; prints
processor seconds. What ct-field --like naf is compared with, for the same number of steps:

    ct-convert --cube 64 HEAD.nii.gz - | ct-degrade -x 1 --clip=-512:3071 - hr.nii
    ct-project --views 100 --det 64 --window=-512:3071 hr.nii p.exr
    CTSR_LIBRARY=build/libctsr.so.0 PYTHONPATH=python python3 bench/naf_twin.py p.exr hr.nii twin.nii 400
    ct-field -t 1 --like naf --grid hr.nii -b 400 p.exr ours.nii
    for f in twin ours; do ct-metrics -w -512:3071 hr.nii $f.nii; done

Of the authors, and not of ct-field: metres, in which an object is .256 across, within a box of -.3 to .3; rays
from DSO - r to DSO + r, where r is half the diagonal of the object in plane and 5 mm; the steps along a ray are
those between its samples; the 1024 pixels of a step differ.
"""
import sys
import time

import numpy as np
import torch
import torch.nn.functional as F

BOUND, SIDE, MORE, SAMPLES, RAYS, TABLE = .3, .256, .005, 192, 1024, 2 ** 19
torch.set_num_threads(1)
torch.manual_seed(1)


class Level(torch.autograd.Function):
    """Sum of 8 nodes of a table [n, 2], to = [8, points], by their weights."""
    @staticmethod
    def forward(ctx, table, to, weight):
        ctx.save_for_backward(to, weight)
        ctx.n = len(table)
        pairs = table.detach().view(torch.float64).reshape(-1)  # a pair is moved as one number
        got = pairs.index_select(0, to.reshape(-1)).view(torch.float32).view(8, -1, 2)
        return (got * weight[:, :, None]).sum(0)

    @staticmethod
    def backward(ctx, grad):
        to, weight = ctx.saved_tensors
        return torch.stack([torch.zeros(ctx.n).scatter_add_(0, to.reshape(-1), (weight * grad[:, f]).reshape(-1))
                            for f in (0, 1)], 1), None, None


class Hash(torch.nn.Module):
    """16 levels of two features; x in [0, 1]."""
    def __init__(self):
        super().__init__()
        self.scale = [16 * 2 ** k - 1 for k in range(16)]
        self.table = torch.nn.ParameterList([torch.nn.Parameter(
            torch.empty(min(TABLE, (s + 2) ** 3), 2).uniform_(-1e-4, 1e-4)) for s in self.scale])

    def forward(self, x):
        out, x = [], x.T.contiguous()
        for scale, table in zip(self.scale, self.table):
            at, side = x * scale + .5, scale + 2
            node = at.long()
            part = at - node
            hashed = side ** 3 > TABLE
            i, j, k = [[(node[a] + c) * p for c in (0, 1)]
                       for a, p in enumerate((1, 19349663, 83492791) if hashed else (1, side, side * side))]
            u, v, w = [(1 - p, p) for p in part]
            corner = [(c & 1, c >> 1 & 1, c >> 2) for c in range(8)]
            to = torch.stack([(i[a] ^ j[b] ^ k[c]) & TABLE - 1 if hashed else i[a] + j[b] + k[c] for a, b, c in corner])
            out.append(Level.apply(table, to, torch.stack([u[a] * v[b] * w[c] for a, b, c in corner])))
        return torch.cat(out, 1)


class Naf(torch.nn.Module):
    """4 layers of 32, the code once more at the third."""
    def __init__(self):
        super().__init__()
        self.code = Hash()
        self.layer = torch.nn.ModuleList([torch.nn.Linear(32, 32), torch.nn.Linear(32, 32), torch.nn.Linear(64, 32)])
        self.last = torch.nn.Linear(32, 1)

    def forward(self, x):  # metres from the centre
        code = self.code((x.clamp(-BOUND + 1e-6, BOUND - 1e-6) + BOUND) / (2 * BOUND))
        h = F.leaky_relu(self.layer[1](F.leaky_relu(self.layer[0](code))))
        return torch.sigmoid(self.last(F.leaky_relu(self.layer[2](torch.cat([code, h], 1)))))[:, 0]


def metre(v):
    return torch.tensor(np.asarray(v), dtype=torch.float32)


class Scan:
    """Rays of the projections, in metres about the centre of the grid."""
    def __init__(self, projections, grid):
        size = np.array(grid.data.shape)
        self.centre = grid.affine[:3, :3] @ ((size - 1) / 2) + grid.affine[:3, 3]
        self.unit = SIDE / (size * grid.spacing).max()
        self.p, self.views = projections, projections.views
        self.reach = np.hypot(*(size * grid.spacing * self.unit / 2)[:2]) + MORE

    def draw(self, view):
        data, v = self.p.data[view], self.views[view]
        row, col = np.nonzero(data > 0)
        some = np.random.choice(len(row), min(RAYS, len(row)), replace=False)
        row, col = row[some, None], col[some, None]
        axis = v['centre'] - v['source']
        along = axis + (col - (data.shape[1] - 1) / 2) * v['u'] + (row - (data.shape[0] - 1) / 2) * v['v']
        begin = (v['source'] - self.centre) * self.unit
        return (metre(begin), metre(along / np.linalg.norm(axis)), float(np.linalg.norm(begin)),
                metre(data[row[:, 0], col[:, 0]] * self.unit))


def step(net, scan, view):
    begin, along, dso, want = scan.draw(view)
    z = torch.linspace(max(dso - scan.reach, 0), dso + scan.reach, SAMPLES)
    middle = (z[1:] + z[:-1]) / 2
    low, high = torch.cat([z[:1], middle]), torch.cat([middle, z[-1:]])
    z = low + (high - low) * torch.rand(len(want), SAMPLES)
    density = net((begin + z[:, :, None] * along[:, None]).reshape(-1, 3)).reshape(z.shape)
    value = (density[:, :-1] * (z[:, 1:] - z[:, :-1])).sum(1) * along.norm(dim=1)
    return F.mse_loss(value, want)


def volume(net, scan, grid):
    index = np.stack(np.meshgrid(*map(np.arange, grid.data.shape), indexing='ij'), -1).reshape(-1, 3)
    at = metre((index @ grid.affine[:3, :3].T + grid.affine[:3, 3] - scan.centre) * scan.unit)
    with torch.no_grad():
        return torch.cat([net(x) for x in at.split(1 << 16)]).reshape(grid.data.shape).numpy()


def main(projections, hr, out, steps):
    import ctsr
    grid = ctsr.read(hr)
    scan = Scan(ctsr.read_projections(projections), grid)
    net, steps = Naf(), int(steps)
    adam = torch.optim.Adam(net.parameters(), 1e-3)
    np.random.seed(1)
    begun, turn = time.process_time(), []
    for k in range(steps):
        turn = turn or list(np.random.permutation(len(scan.views)))
        adam.param_groups[0]['lr'] = 1e-3 if 2 * k < steps else 1e-4
        adam.zero_grad()
        loss = step(net, scan, turn.pop())
        loss.backward()
        adam.step()
        if k % 50 == 0 or k + 1 == steps:
            print('step', k, 'loss', loss.item(), file=sys.stderr, flush=True)
    print('seconds', time.process_time() - begun)
    low, high = -512, 3071  # the window of P.exr
    ctsr.write(ctsr.Image(low + (high - low) * volume(net, scan, grid), grid.affine), out, overwrite=True)


if __name__ == '__main__':
    main(*sys.argv[1:])
