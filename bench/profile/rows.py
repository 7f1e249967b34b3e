#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Rows of edges of CTs that were reduced by known operators, for fit.py.

rows.py EDGE-ROWS SEED TIMES OUT.npz CT.nii...   (Debian: python3-nibabel, python3-scipy)

EDGE-ROWS is bench/profile/edge-rows, which draws the rows as ct-sr does. Of each CT so many times a
part, at a scale of its own, is reduced by four operators along all axes or along one. A name with .xy.nii
in it is a CT whose third axis is itself blurred: it is reduced along the other two only, and
its third axis is no reference. OUT: X, sets of rows (axes, sets, rows, numbers); n, rows of each set;
l: what is true, see LABELS; p: which CT.
"""
import subprocess, sys
import nibabel as nib
import numpy as np
from scipy.ndimage import gaussian_filter

SETS, ROWS, LONG, ROW = 4, 256, 12, 30
LABELS = 'alone factor noise aliases sigma spread axis width correlated clip view'.split()


def taps(n, factor, sigma, kind, width=0.):
    """(cells, n) matrix of an axis: a Gaussian of sigma voxels, then the sampling, as degrade.c has it."""
    m = int(np.floor(n / factor + 1e-6))
    N = int(np.ceil(m * factor - 1e-6 * factor))
    off = (n - N) // 2
    x = np.arange(N)
    G = np.eye(N)
    if sigma > 0:
        d = np.arange(-int(4 * sigma + .5), int(4 * sigma + .5) + 1)
        k = np.exp(-.5 * (d / sigma) ** 2)
        G = np.zeros((N, N))
        for j, w in zip(d, k / k.sum()):
            i = (x + j) % (2 * N)
            G[x, np.where(i >= N, 2 * N - 1 - i, i)] += w
    c = (np.arange(m) + .5) * factor + (N - m * factor) / 2  # centres of the cells
    D = np.zeros((m, N))
    if kind == 'sinc':
        k = np.arange(m)
        C = np.cos(np.pi * (x + .5) * k[:, None] / N) * np.where(k[:, None] == 0, 1, 2) / N
        D = np.cos(np.pi * c[:, None] * k / N) @ C
    elif width == 0:
        i = np.floor(c - .5 + 1e-6).astype(int)
        f = np.maximum(c - .5 - i, 0)
        D[np.arange(m), i] += 1 - f
        D[np.arange(m), np.minimum(i + 1, N - 1)] += f
    else:  # the mean over `width` cells
        lo, hi = np.maximum(c - width * factor / 2, 0), np.minimum(c + width * factor / 2, N)
        D = np.clip(np.minimum(hi[:, None], x + 1) - np.maximum(lo[:, None], x), 0, 1)
        D /= D.sum(1, keepdims=True)
    M = np.zeros((m, n), np.float32)
    M[:, off:off + N] = D @ G
    return M


def apply(v, Ms):
    for a in sorted(range(3), key=lambda a: 1 if Ms[a] is None else Ms[a].shape[0] / Ms[a].shape[1]):
        if Ms[a] is not None:
            v = np.moveaxis(np.tensordot(Ms[a], v, (1, a)), 0, a)
    return v


class Draw:
    """edge-rows, one process."""

    def __init__(self, program):
        self.p = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def __call__(self, v, axis, alone, no, factor):
        w = self.p.stdin
        w.write(np.array(list(v.shape) + [axis, alone, no], '<i4').tobytes() + np.float32(factor).tobytes())
        w.write(np.asarray(v, '<f4').tobytes('F'))
        w.flush()
        n = np.frombuffer(self.p.stdout.read(4 * SETS), '<i4')
        x = np.frombuffer(self.p.stdout.read(4 * SETS * ROWS * ROW), '<f4')
        return n, x.reshape(SETS, ROWS, ROW).astype(np.float16)


def operator(rng):
    """kind, sigma and width of the mean, in LR voxels."""
    if rng.random() < .45:
        return 'sinc', rng.uniform(.1, .65) if rng.random() < .85 else rng.uniform(.6, .85), 0.
    width = [0., 1., rng.uniform(.3, 2)][rng.choice(3, p=[.45, .35, .2])]
    if width == 0:
        return 'alias', rng.uniform(.05, .6) if rng.random() < .9 else rng.uniform(.5, .8), 0.
    return 'alias', 0. if rng.random() < .5 else rng.uniform(0, .4), width


def spread(kind, sigma, width, factor):
    own = width ** 2 / 12
    if kind != 'sinc' and width == 0 and factor % 2 == 0:
        own = .25 / factor ** 2  # the mean of two
    return np.sqrt(sigma ** 2 + own)


def seen(v, rng, alone, axis, clip, view):
    """The reduced CT as a scanner or an archive leaves it, with noise; and noise, correlation."""
    noise = 0. if rng.random() < .4 else np.exp(rng.uniform(np.log(3), np.log(60)))
    alike = rng.uniform(.4, .8) if noise and rng.random() < .3 else 0.
    if noise:
        e = rng.standard_normal(v.shape, np.float32)
        if alike:
            e = gaussian_filter(e, [0 if alone and a == axis else alike for a in range(3)])
        v = v + np.float32(noise / e.std()) * e
    if rng.random() < .15:  # small differences from the neighbours shrink
        d = v - gaussian_filter(v, .8)
        v = v - np.clip(d, -1, 1) if noise < 3 else v - np.clip(d, -noise, noise) * np.float32(rng.uniform(.5, 1))
    if view:
        x, y = (((np.arange(n) + .5) / n - .5) ** 2 for n in v.shape[:2])
        v[x[:, None] + y > view ** 2] = -1024
    if rng.random() < .05:  # air is constant
        v[v < -900] = -1000
    v = np.rint(v)
    return (v if clip is None else np.maximum(v, clip)), noise, alike


def anatomy(V, rng):
    """A part of a CT, at a scale of its own."""
    coarser = rng.uniform(1.2, 2.5) if rng.random() < .5 else 1.
    side = int((rng.integers(64, 116) if rng.random() < .75 else rng.integers(120, 151)) * coarser)
    o = [rng.integers(0, max(1, n - side + 1)) for n in V.shape]
    v = V[tuple(slice(x, x + side) for x in o)].astype(np.float32)
    if coarser > 1:  # a sharper patient
        how = ('sinc', .3, 0.) if rng.random() < .5 else ('alias', 0., 1.)
        v = apply(v, [taps(n, coarser, how[1] * coarser, how[0], how[2]) for n in v.shape])
    if rng.random() < .2:  # a sharp kernel
        v = v + np.float32(rng.uniform(.2, .8)) * (v - gaussian_filter(v, 1))
    return v


def part(V, true, rng, draw):
    v = anatomy(V, rng)
    if (v > -500).mean() < .1:
        return
    for _ in range(4):
        alone = rng.random() < .55
        f = rng.choice([2, 2.5, 3, 4, 5, 6, 8]) if rng.random() < .75 else rng.uniform(1.5, 8)
        f = min(f, min(v.shape) / (LONG + 3))
        if f < 1.5:
            continue
        how = [operator(rng)] * 3
        if not alone and true == 3 and rng.random() < .3:
            how[2] = operator(rng)
        axes = [rng.integers(true)] if alone else list(range(true))
        clip = [None, -1024, -1024, -512][rng.integers(4)]
        view = rng.uniform(.3, .5) if rng.random() < .15 else 0.
        Ms = [None if alone and a not in axes else taps(v.shape[a], f, how[a][1] * f, how[a][0], how[a][2])
              for a in range(3)]
        lo, noise, alike = seen(apply(v if clip is None else np.clip(v, clip, 3071), Ms), rng, alone, axes[0], clip, view)
        for a in axes:
            n, x = draw(lo, a, alone, 0 if true == 3 else 4, f)
            if n[0]:
                k, s, w = how[a]
                yield x, n, [alone, f, noise, k != 'sinc', s, spread(k, s, w, f), a, w, alike,
                             -9999 if clip is None else clip, view]


def main():
    draw, seed, times, out = Draw(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
    rows = []
    for p, name in enumerate(sys.argv[5:]):
        rng = np.random.default_rng([seed, p])
        V = np.asanyarray(nib.load(name).dataobj)
        for _ in range(times):
            rows += [r + (p,) for r in part(V, 2 if '.xy.nii' in name else 3, rng, draw)]
        print(name, len(rows), flush=True)
    np.savez(out, **{k: np.array([r[i] for r in rows], t)
                     for i, (k, t) in enumerate((('X', np.float16), ('n', np.int32), ('l', np.float32), ('p', np.int32)))})


main()
