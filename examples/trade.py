#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What time buys: trade.py TRADE.csv TRADE.svg; the table goes to the standard output.

TRADE.csv is what trade.mk makes: a line a result. Of each case and run the mean over the scans (memory: the
most). A run is on the front, *, unless another one takes no more CPU seconds and is as good or better by PSNR,
SSIM, false structures and the error of texture deep in soft tissue, and better by one of these.
"""
import csv
import sys

SHOWN = [('cpu-s', 'CPU s', '%8.2f'), ('peak-mib', 'MiB', '%6.0f'), ('psnr', 'PSNR', '%7.3f'),
         ('ssim-r2', 'SSIM', '%7.4f'), ('structures-false', 'false', '%7.1f'), ('structures-missed', 'missed', '%7.1f'),
         ('deep-smooth-rmse-hu', 'deep', '%7.2f'), ('edge-rise-test-mm', 'rise', '%6.2f')]
BETTER = {'cpu-s': -1, 'psnr': 1, 'ssim-r2': 1, 'structures-false': -1, 'deep-smooth-rmse-hu': -1}


def number(row, key):
    return float(row[key]) if row.get(key) else float('nan')


def means(rows):
    """case -> run -> column -> value, in the order of the file. What is nan of a scan is left out of its mean."""
    table = {}
    for row in rows:
        table.setdefault(row['case'], {}).setdefault(row['run'], []).append(row)
    for runs in table.values():
        for run, group in runs.items():
            said = {key: [v for v in (number(r, key) for r in group) if v == v] for key, _, _ in SHOWN}
            runs[run] = {key: max(v) if key == 'peak-mib' else sum(v) / len(v) for key, v in said.items() if v}
    return table


def beats(a, b):
    """Is a nowhere worse than b, and better somewhere?"""
    both = [key for key in BETTER if key in a and key in b]
    gain = [BETTER[key] * (a[key] - b[key]) for key in both]
    return all(g >= 0 for g in gain) and any(g > 0 for g in gain)


def front(runs):
    return {name for name, run in runs.items() if not any(beats(other, run) for other in runs.values())}


def draw(table, path):
    import matplotlib
    matplotlib.use('svg')
    matplotlib.rcParams.update({'svg.hashsalt': 'trade', 'svg.fonttype': 'none'})
    import matplotlib.pyplot as plt
    kinds = [('psnr', 'PSNR, dB'), ('structures-false', 'false structures'), ('peak-mib', 'peak memory, MiB')]
    fig, axes = plt.subplots(len(table), len(kinds), figsize=(4.2 * len(kinds), 2.9 * len(table)), squeeze=False)
    for line, (case, runs) in zip(axes, table.items()):
        best = front(runs)
        for ax, (key, label) in zip(line, kinds):
            for name, run in runs.items():
                if key not in run:
                    continue
                ax.plot(max(run['cpu-s'], 0.005), run[key], 'o', color='C0' if name in best else '.7')
                ax.annotate(name, (max(run['cpu-s'], 0.005), run[key]), xytext=(4, 3), textcoords='offset points', fontsize=7)
            ends = sorted((max(runs[n]['cpu-s'], 0.005), runs[n][key]) for n in best if key in runs[n])
            ax.plot([x for x, _ in ends], [y for _, y in ends], '-', color='C0', lw=0.8)
            ax.set_xscale('log')
            ax.set_xlabel('CPU s')
            ax.set_title('%s: %s' % (case, label), fontsize=9)
    fig.tight_layout()
    fig.savefig(path, metadata={'Date': None})


def main(argv):
    if len(argv) != 3:
        sys.exit('usage: trade.py TRADE.csv TRADE.svg')
    with open(argv[1], newline='') as f:
        rows = list(csv.DictReader(f))
    if not rows:
        sys.exit('trade.py: %s: no results' % argv[1])
    table = means(rows)
    print('means of %d scans' % len({row['scan'] for row in rows}))
    print('%-8s %-36s' % ('case', 'run') + ''.join(' %*s' % (len(form % 0), head) for _, head, form in SHOWN) + '  front')
    for case, runs in table.items():
        best = front(runs)
        for name, run in runs.items():
            print('%-8s %-36s' % (case, name) + ''.join(' ' + (form % run[key] if key in run else '-'.rjust(len(form % 0)))
                  for key, _, form in SHOWN) + ('  *' if name in best else ''))
    draw(table, argv[2])


if __name__ == '__main__':
    main(sys.argv)
