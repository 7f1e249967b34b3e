#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""How good the estimate of the profile is, of CTs of your own; the table of doc/blur-estimate.md.

table.py FOLDER CT.nii...   (ct-convert, ct-degrade and ct-info from PATH)

Of each CT a cube of 128 voxels is reduced by known operators and measured. In FOLDER it leaves axes.csv,
a line an axis. Spreads below .2 voxel are not in the table. If axes.csv is
there already, only the table is printed.
"""
import csv, json, math, os, subprocess, sys, tempfile

FIELDS = 'scan case refined factor noise axis truth aliases spread deviation probability'.split()


def cases():
    for f in (2, 3, 4, 5):
        for name, sigma, alias in (('P1', 1 / 2.3548, 0), ('P2', .25, 0), ('P3', .125, 1)):
            own = .25 / f ** 2 if alias and f % 2 == 0 else 0
            yield 'all', name, f, ['-p', name], math.sqrt(sigma ** 2 + own), alias
    for f in (2, 3, 4, 5, 8):
        for name, sigma, way in (('P1', 1 / 2.3548, 'sinc'), ('P2', .25, 'sinc'), ('mean', 0, 'mean'),
                                 ('g30', .3, 'point'), ('g37', .37, 'point'), ('g45', .45, 'point')):
            own = 1 / 12 if way == 'mean' else .25 / f ** 2 if way == 'point' and f % 2 == 0 else 0
            yield ('one', name, f, ['--sigma', f'0,0,{sigma * f:.9g}', '--decimate', way],
                   math.sqrt(sigma ** 2 + own), int(way != 'sinc'))


def measure(folder, names):
    for name in names:
        scan = os.path.basename(name).split('.')[0]
        hr, lo = f'{folder}/hr.nii', f'{folder}/lo.nii'
        subprocess.run(['ct-convert', '-q', '-f', '--cube', '128', name, hr], check=True)
        for refined, case, f, how, truth, alias in cases():
            x = f'{f}' if refined == 'all' else f'1,1,{f}'
            for noise in (0, 15):
                subprocess.run(['ct-degrade', '-q', '-f', '-x', x, '--noise', str(noise)] + how + [hr, lo], check=True)
                got = json.loads(subprocess.run(['ct-info', '--json', '-e', '-x', x, lo], check=True,
                                                stdout=subprocess.PIPE).stdout)
                for a in range(3):
                    s, d, p = (got['profile-' + k][a] for k in ('spread-voxels', 'deviation-voxels', 'alias-probability'))
                    if refined == 'all' or a == 2:
                        yield [scan, case, refined, f, noise, a, truth, alias, s, d, p]
        print(name, file=sys.stderr)


def line(name, rows):
    n, rows = len(rows), [r for r in rows if r['spread']]
    truth, spread, deviation, p = ([float(r[k]) for r in rows] for k in ('truth', 'spread', 'deviation', 'probability'))
    if not rows:
        return
    q = sorted(s / t for s, t in zip(spread, truth))
    share = lambda x: sum(x) / len(rows)
    print('| %s | %d | %.2f %.2f %.2f | %.0f %% | %.1f %% | %.0f %%, %.0f %% | %.0f %% |' % (
        name, n, *(q[int(k * (len(q) - 1))] for k in (.1, .5, .9)), 100 * share(.93 <= k <= 1.07 for k in q),
        100 * share(k > 1.1 for k in q), 100 * share(abs(s - t) < d for s, t, d in zip(spread, truth, deviation)),
        100 * share(abs(s - t) < 2 * d for s, t, d in zip(spread, truth, deviation)),
        100 * share((k > .5) == (r['aliases'] == '1') for k, r in zip(p, rows))))


def main():
    folder, path = sys.argv[1], sys.argv[1] + '/axes.csv'
    os.makedirs(folder, exist_ok=True)
    if not os.path.exists(path):
        with tempfile.TemporaryDirectory(dir=folder) as way:
            rows = list(measure(way, sys.argv[2:]))
        with open(path, 'w', newline='') as f:
            csv.writer(f).writerows([FIELDS] + rows)
    with open(path) as f:
        rows = [r for r in csv.DictReader(f) if float(r['truth']) >= .2]
    print('| | axes | measured/true: 10 %, median, 90 % | within 7 % | above 1.1 | held by 1, 2 deviations | sampling right |')
    print('|---|---|---|---|---|---|---|')
    for what, refined in (('all axes refined', 'all'), ('slices', 'one')):
        for kind, alias in (('band-limited', '0'), ('points' if refined == 'all' else 'points and means', '1')):
            line(f'{what}, {kind}', [r for r in rows if r['refined'] == refined and r['aliases'] == alias])
    for noise in '0', '15':
        line(f'all, {noise} HU of noise', [r for r in rows if r['noise'] == noise])
    for f in '23458':
        line(f'all, {f} times', [r for r in rows if r['factor'] == f])
    line('all', rows)


main()
