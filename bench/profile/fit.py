#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""One of the two networks of src/estimate/profile.c, from rows.py.

fit.py EPOCHS SEED FOLD START.bin NETWORK.bin ROWS.npz...   (Debian: python3-torch, libopenblas0)

Every fifth CT is left out, from FOLD on, and tells what the network is worth; FOLD -1 leaves none out.
The weights begin as those of START.bin, one network, or at random where it is -. profile-network.bin is
two networks of other seeds, one after the other: doc/blur-estimate.md.
"""
import sys
import numpy as np
import torch
from torch import nn

EPOCHS, SEED, FOLD = (int(a) for a in sys.argv[1:4])
START, OUT, BATCH, RATE = sys.argv[4], sys.argv[5], 48, 1.5e-3
torch.manual_seed(SEED)
torch.set_num_threads(1)
files = [np.load(f) for f in sys.argv[6:]]
X, n, l, p = (np.concatenate([f[k] for f in files]) for k in 'Xnlp')
n = np.minimum(n, X.shape[2])
out = p % 5 == FOLD if FOLD >= 0 else np.zeros(len(p), bool)
train, test = np.where(~out)[0], np.where(out)[0]
alone, beside = l[:, 0] > 0, n[:, 1:].min(1) > 0
factor, spread, alias = (torch.tensor(x).float() for x in (np.log(l[:, 1]), l[:, 5], l[:, 3]))
X, rng = torch.from_numpy(X), np.random.default_rng(SEED)
SETS, ROW, WIDE, LAST, FOCI = X.shape[1], X.shape[3], 64, 32, 2
POOLED = (2 + FOCI) * LAST


def head(seen):
    return nn.Sequential(nn.Linear(seen, 48), nn.ReLU(), nn.Dropout(.1), nn.Linear(48, 24), nn.ReLU(), nn.Linear(24, 3))


class Net(nn.Module):
    def __init__(self):
        super().__init__()
        self.row = nn.Sequential(nn.Linear(ROW, WIDE), nn.ReLU(), nn.Linear(WIDE, WIDE), nn.ReLU(),
                                 nn.Linear(WIDE, LAST + FOCI))
        self.all, self.one = head(POOLED + 1), head(SETS * POOLED + 2)

    def pool(self, k, i, rows):
        m = n[i, k][:, None]
        r = (rng.random((len(i), rows)) * m).astype(int) if self.training else np.arange(rows) * m // rows
        y = self.row(X[torch.from_numpy(i)[:, None], k, torch.from_numpy(r)].float())
        z = y[..., :LAST]
        mean = z.mean(1)
        focus = [(torch.softmax(y[..., LAST + f], 1)[..., None] * z).sum(1) for f in range(FOCI)]
        return torch.cat([mean, torch.log(((z - mean[:, None]) ** 2).mean(1) + 1e-3)] + focus, 1)

    def forward(self, i, rows):
        own, o, f = self.pool(0, i, rows), torch.zeros(len(i), 3), factor[i][:, None]
        every, one = np.where(~alone[i])[0], np.where(alone[i])[0]
        both = np.where(beside[i[one]])[0]
        if len(every):
            o[every] = self.all(torch.cat([own[every], f[every]], 1))
        if len(one):
            others = torch.zeros(len(one), SETS - 1, POOLED)
            for k in range(1, SETS):
                if len(both):
                    others[both, k - 1] = self.pool(k, i[one[both]], rows)
            there = torch.tensor(beside[i[one]]).float()[:, None]
            o[one] = self.one(torch.cat([own[one], others.flatten(1), there, f[one]], 1))
        return nn.functional.softplus(o[:, 0]), o[:, 1].clamp(-4, 1), o[:, 2]


def parameters(net):
    for part in (net.row, net.one, net.all):
        for m in part:
            if isinstance(m, nn.Linear):
                yield from (m.weight, m.bias)


def report(net):
    net.eval()
    with torch.no_grad():
        got = [net(test[k:k + 64], X.shape[2]) for k in range(0, len(test), 64)]
    s, d, a = (torch.cat(g).numpy() for g in zip(*got))
    true, kind = spread[test].numpy(), alias[test].numpy() > 0
    held = abs(s - true) / (true + .1) / np.exp(d)
    for name, m in ('all axes', ~alone[test]), ('one axis', alone[test]):
        m = m & (true > .2)
        ratio = s[m] / true[m]
        print('%s: measured/true: 10 %% %.3f median %.3f 90 %% %.3f; within 7 %%: %.2f; above 1.1: %.3f; deviations of 68 %%: '
              '%.2f, of 95 %%: %.2f; sampling right %.3f' % (
                  name, *np.quantile(ratio, [.1, .5, .9]), (abs(ratio - 1) < .07).mean(), (ratio > 1.1).mean(),
                  *np.quantile(held[m], [.68, .95]), ((a > 0) == kind)[m].mean()), flush=True)


net = Net()
if START != '-':
    w = torch.from_numpy(np.fromfile(START, '<f4'))
    with torch.no_grad():
        for q in parameters(net):
            q.copy_(w[:q.numel()].reshape(q.shape))
            w = w[q.numel():]
opt = torch.optim.AdamW(net.parameters(), RATE, weight_decay=3e-3)
steps = len(train) // BATCH
for epoch in range(EPOCHS):
    net.train()
    order = rng.permutation(train)
    for b in range(steps):
        at = (epoch * steps + b) / (EPOCHS * steps)
        for g in opt.param_groups:
            g['lr'] = 1e-5 + RATE * (at / .05 if at < .05 else (1 + np.cos(np.pi * (at - .05) / .95)) / 2)
        i = order[b * BATCH:(b + 1) * BATCH]
        got, deviation, logit = net(i, int(rng.integers(32, 65)))
        off = (spread[i] - got) / (spread[i] + .1) / deviation.exp()
        loss = (.5 * off ** 2 + deviation).mean() + \
            .6 * nn.functional.binary_cross_entropy_with_logits(logit, alias[i])
        opt.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(net.parameters(), 1.)
        opt.step()
    print(epoch, loss.item(), flush=True)
if len(test):
    report(net)
np.concatenate([q.detach().numpy().ravel() for q in parameters(net)]).astype('<f4').tofile(OUT)
