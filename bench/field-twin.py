"""field-twin.py points|naf N: processor seconds of one of N steps of ct-field's fit, by PyTorch in float32."""
import sys
import time

import torch
import torch.nn.functional as F

kind, steps = sys.argv[1], int(sys.argv[2])
torch.set_num_threads(1)
torch.manual_seed(1)


class Dense(torch.nn.Module):
    """Grids of 8, 16 and 32 nodes with two features."""
    def __init__(self):
        super().__init__()
        self.scale = [8 * 2 ** k - 1 for k in range(3)]
        self.grid = torch.nn.ParameterList(
            [torch.nn.Parameter(1e-4 * torch.randn(1, 2, s + 2, s + 2, s + 2)) for s in self.scale])
        self.where = None

    def forward(self, x):
        if self.where is None:  # the same points in every step
            self.where = [(2 * (x * s + 0.5) / (s + 1) - 1)[None, None, None] for s in self.scale]
        return torch.cat([F.grid_sample(g, w, align_corners=True)[0, :, 0, 0].T
                          for g, w in zip(self.grid, self.where)], 1)


class Hash(torch.nn.Module):
    """16 levels of two features, tables of 2^19."""
    def __init__(self):
        super().__init__()
        self.level, self.size = [], 2 ** 19
        for k in range(16):
            scale = 16 * 2.0 ** k - 1
            self.level.append((scale, int(scale) + 2))
        self.table = torch.nn.ParameterList([torch.nn.Parameter(
            1e-4 * torch.randn(min(self.size, side ** 3), 2)) for _, side in self.level])

    def forward(self, x):
        out = []
        for (scale, side), table in zip(self.level, self.table):
            at = x * scale + 0.5
            node = at.long()
            part = at - node
            i, j, k = ([node[:, a] + c for c in (0, 1)] for a in range(3))
            if side ** 3 > self.size:
                j, k = [v * 19349663 for v in j], [v * 83492791 for v in k]
            else:
                j, k = [v * side for v in j], [v * side * side for v in k]
            u, v, w = ((1 - part[:, a], part[:, a]) for a in range(3))
            sum_ = 0
            for c in range(8):
                a, b, d = c & 1, c >> 1 & 1, c >> 2
                to = (i[a] ^ j[b] ^ k[d]) & (self.size - 1) if side ** 3 > self.size else i[a] + j[b] + k[d]
                sum_ = sum_ + (u[a] * v[b] * w[d])[:, None] * F.embedding(to, table)
            out.append(sum_)
        return torch.cat(out, 1)


class Naf(torch.nn.Module):
    def __init__(self):
        super().__init__()
        self.layer = torch.nn.ModuleList([torch.nn.Linear(32, 32), torch.nn.Linear(32, 32), torch.nn.Linear(64, 32)])
        self.last = torch.nn.Linear(32, 1)

    def forward(self, code):
        h = F.leaky_relu(self.layer[1](F.leaky_relu(self.layer[0](code))))
        return torch.sigmoid(self.last(F.leaky_relu(self.layer[2](torch.cat([code, h], 1)))))


if kind == 'points':
    at = (torch.arange(32) + 0.5) / 32
    fixed = torch.stack(torch.meshgrid(at, at, at, indexing='ij'), -1).reshape(-1, 3)
    code, net = Dense(), torch.nn.Sequential(torch.nn.Linear(6, 32), torch.nn.ReLU(), torch.nn.Linear(32, 32),
                                             torch.nn.ReLU(), torch.nn.Linear(32, 1))
    want = torch.rand(32 ** 3, 1)
else:
    fixed, code, net, want = None, Hash(), Naf(), torch.rand(1024)
adam = torch.optim.Adam(list(code.parameters()) + list(net.parameters()), 1e-3)


def step():
    adam.zero_grad()
    if kind == 'points':
        value = net(code(fixed))
    else:
        begin, end = torch.rand(1024, 1, 3), torch.rand(1024, 1, 3)
        along = (torch.arange(192) + torch.rand(1024, 192)) / 192
        value = net(code((begin + along[:, :, None] * (end - begin)).reshape(-1, 3))).reshape(1024, 192).mean(1)
    ((value - want) ** 2).mean().backward()
    adam.step()


step()
begun = time.process_time()
for _ in range(steps):
    step()
print((time.process_time() - begun) / steps)
