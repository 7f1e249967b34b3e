#!/usr/bin/env python3
"""PSNR (dB) and SSIM of a stack of projections against the true one, nothing but Python needed.

    scripts/stack-metrics.py TRUTH.exr TEST.exr [LOW.exr]

The data range is the largest value of TRUTH; SSIM is the mean over views and over all places of a
Gaussian window of 11 pixels, sigma 1.5, that lie inside (Wang et al., 2004). With LOW, a third number:
the root mean square of what the means of TEST's pixels differ from LOW by, in percent of its largest.
"""
import math
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', 'tests'))
from exr import read, size  # noqa: E402

TAPS = [math.exp(-.5 * (k / 1.5) ** 2) for k in range(-5, 6)]
TAPS = [t / sum(TAPS) for t in TAPS]


def blurred(v, w, h):
    """A Gaussian along rows, then columns, where it lies inside."""
    rows = [[sum(t * v[y * w + x + k] for k, t in enumerate(TAPS)) for x in range(w - 10)] for y in range(h)]
    return [sum(t * rows[y + k][x] for k, t in enumerate(TAPS)) for y in range(h - 10) for x in range(w - 10)]


def ssim(a, b, w, h, top):
    c1, c2 = (.01 * top) ** 2, (.03 * top) ** 2
    ma, mb = blurred(a, w, h), blurred(b, w, h)
    aa, bb, ab = (blurred([p * q for p, q in zip(*v)], w, h) for v in ((a, a), (b, b), (a, b)))
    s = [(2 * x * y + c1) * (2 * (xy - x * y) + c2) / ((x * x + y * y + c1) * (xx - x * x + yy - y * y + c2))
         for x, y, xx, yy, xy in zip(ma, mb, aa, bb, ab)]
    return sum(s) / len(s)


def main(names):
    (w, h), truth, test = size(names[0]), read(names[0]), read(names[1])
    top = max(map(max, truth))
    square = sum((x - y) ** 2 for a, b in zip(truth, test) for x, y in zip(a, b))
    psnr = 10 * math.log10(top ** 2 * len(truth) * w * h / square) if square else math.inf
    print('%.2f %.4f' % (psnr, sum(ssim(a, b, w, h, top) for a, b in zip(truth, test)) / len(truth)), end='')
    if len(names) > 2:
        (lw, lh), low = size(names[2]), read(names[2])
        s, off = w // lw, 0
        for a, b in zip(low, test):
            for i in range(lw * lh):
                block = [b[(i // lw * s + j) * w + i % lw * s + k] for j in range(s) for k in range(s)]
                off += (sum(block) / s ** 2 - a[i]) ** 2
        print(' %.2f' % (100 * math.sqrt(off / len(low) / lw / lh) / max(map(max, low))), end='')
    print()


if __name__ == '__main__':
    main(sys.argv[1:])
