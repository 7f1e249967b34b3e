# SPDX-License-Identifier: Apache-2.0
"""field-twin.py points|naf N: processor seconds of one of N steps of ct-field's fit, by PyTorch in float32."""
import sys
import time

import torch
import torch.nn.functional as F

from naf_twin import BOUND, Naf

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


if kind == 'points':
    at = (torch.arange(32) + 0.5) / 32
    fixed = torch.stack(torch.meshgrid(at, at, at, indexing='ij'), -1).reshape(-1, 3)
    net = torch.nn.Sequential(Dense(), torch.nn.Linear(6, 32), torch.nn.ReLU(), torch.nn.Linear(32, 32),
                              torch.nn.ReLU(), torch.nn.Linear(32, 1))
    want = torch.rand(32 ** 3, 1)
else:
    net, want = Naf(), torch.rand(1024)
adam = torch.optim.Adam(net.parameters(), 1e-3)


def step():
    adam.zero_grad()
    if kind == 'points':
        value = net(fixed)
    else:
        begin, end = torch.rand(1024, 1, 3), torch.rand(1024, 1, 3)
        along = (torch.arange(192) + torch.rand(1024, 192)) / 192
        at = begin + along[:, :, None] * (end - begin)
        value = net(BOUND * (2 * at - 1).reshape(-1, 3)).reshape(1024, 192).mean(1)
    ((value - want) ** 2).mean().backward()
    adam.step()


step()
begun = time.process_time()
for _ in range(steps):
    step()
print((time.process_time() - begun) / steps)
