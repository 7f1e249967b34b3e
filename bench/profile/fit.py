#!/usr/bin/python3
"""The network of src/resolution/profile.c, from rows.py.

fit.py EPOCHS LEFT-OUT NETWORK.bin ROWS.npz...   (Debian: python3-torch, libopenblas0)

Of the CTs every LEFT-OUT-th is left out and tells what the network is worth; 0 leaves none out. The
shipped network: rows.py with seeds 11 to 17, 40 to 80 times, on the CTs of the slice prior;
fit.py 40 0. Seventeen minutes on one core.
"""
import sys
import numpy as np
import torch
from torch import nn

torch.manual_seed(0)
torch.set_num_threads(1)
EPOCHS, LEFT, OUT, BATCH = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3], 32
files = [np.load(f) for f in sys.argv[4:]]
X, Y, l, p = (np.concatenate([f[k] for f in files]) for k in ('X', 'Y', 'l', 'p'))
out = p % LEFT == LEFT - 1 if LEFT else np.zeros(len(p), bool)
train, test = np.where(~out)[0], np.where(out)[0]
spread, alias = torch.tensor(l[:, 5]).float(), torch.tensor(l[:, 3]).float()
flags = torch.tensor(np.stack([l[:, 8] * l[:, 0], l[:, 0]], 1)).float()
X, Y, rng = torch.from_numpy(X), torch.from_numpy(Y), np.random.default_rng(0)


class Net(nn.Module):
    def __init__(self, row, wide=64, last=32):
        super().__init__()
        self.phi = nn.Sequential(nn.Linear(row, wide), nn.ReLU(), nn.Linear(wide, wide), nn.ReLU(),
                                 nn.Linear(wide, last))
        self.head = nn.Sequential(nn.Linear(4 * last + 2, 48), nn.ReLU(), nn.Dropout(.1),
                                  nn.Linear(48, 24), nn.ReLU(), nn.Linear(24, 3))

    def pool(self, x):
        z = self.phi(x)
        m = z.mean(1)
        return torch.cat([m, torch.log(((z - m[:, None]) ** 2).mean(1) + 1e-3)], 1)

    def forward(self, i, n):
        q = torch.from_numpy(rng.choice(X.shape[1], n, replace=False))
        x, y = self.pool(X[i][:, q].float()), self.pool(Y[i][:, q].float())
        o = self.head(torch.cat([x, y * flags[i][:, :1], flags[i]], 1))
        return nn.functional.softplus(o[:, 0]), o[:, 1].clamp(-4, 1), o[:, 2]


net = Net(X.shape[2])
opt = torch.optim.AdamW(net.parameters(), 1e-3, weight_decay=3e-3)
rate = torch.optim.lr_scheduler.OneCycleLR(opt, 3e-3, total_steps=EPOCHS * (len(train) // BATCH))
for epoch in range(EPOCHS):
    net.train()
    order = rng.permutation(train)
    for b in range(len(train) // BATCH):
        i = order[b * BATCH:(b + 1) * BATCH]
        got, deviation, logit = net(i, int(rng.integers(96, 257)))
        off = (spread[i] - got) / (spread[i] + .1) / deviation.exp()
        loss = (.5 * off ** 2 + deviation).mean() + \
            .4 * nn.functional.binary_cross_entropy_with_logits(logit, alias[i])
        opt.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(net.parameters(), 1.)
        opt.step()
        rate.step()
    print(epoch, loss.item(), flush=True)
net.eval()
if len(test):
    with torch.no_grad():
        got = [net(test[k:k + 64], X.shape[1]) for k in range(0, len(test), 64)]
    got = [torch.cat(g).numpy() for g in zip(*got)]
    true = spread[test].numpy()
    wide = true > .2
    ratio = got[0][wide] / true[wide]
    held = abs(got[0] - true) / (true + .1) < np.exp(got[1])
    print('measured/true: 10 %% %.3f median %.3f 90 %% %.3f; within 7 %%: %.2f; held %.2f; sampling right %.3f' % (
        *np.quantile(ratio, [.1, .5, .9]), (abs(np.log(ratio)) < .072).mean(), held[wide].mean(),
        ((got[2] > 0) == (alias[test].numpy() > 0)).mean()))
parts = [q for m in list(net.phi) + list(net.head) if isinstance(m, nn.Linear) for q in (m.weight, m.bias)]
np.concatenate([q.detach().numpy().ravel() for q in parts]).astype('<f4').tofile(OUT)
