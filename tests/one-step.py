# SPDX-License-Identifier: Apache-2.0
"""The steps of the paper by the package for Python, as one-step.c: one-step.py STEP IN... OUT [KEY=VALUE...]. And
one-step.py same A B...: do all files hold the same numbers?"""
import sys
import numpy as np
import ctsr

METHODS = ('auto', 'linear', 'cubic', 'bspline', 'lanczos', 'sinc', 'dc', 'tv', 'htv', 'prior', 'arssr')
DECIMATE = ('sinc', 'point', 'mean')
BEAMS = ('cone', 'parallel', 'fan')
PIXELS = ('point', 'mean', 'sinc')


def numbers(path):
    if path.endswith('.exr'):
        return ctsr.read_projections(path).data
    if path.endswith('.nii'):
        return ctsr.read(path).data
    return open(path, 'rb').read().split(b'end_header\n', 1)[1]


def same(*paths):
    first = numbers(paths[0])
    for p in paths[1:]:
        x = numbers(p)
        if isinstance(x, bytes):
            assert x == first, '%s differs from %s' % (p, paths[0])
        else:
            assert x.shape == first.shape and x.tobytes() == first.tobytes(), '%s differs from %s by %g' % (
                p, paths[0], np.abs(x - first).max() if x.shape == first.shape else np.inf)


def window(o):
    return {'window': [float(x) for x in o['window'].split(':')]} if 'window' in o else {}


def three(text):
    """"2", for three axes, or "2,2,1"."""
    x = [float(t) for t in text.split(',')]
    return x if len(x) == 3 else x * 3


def whole(o, *keys):
    return {k: int(o[k]) for k in keys if k in o}


def real(o, *keys):
    return {k: float(o[k]) for k in keys if k in o}


def compare(ref, test, o):
    """Figures as ct-metrics writes them."""
    rays = ref.endswith('.exr')
    if rays:
        m = ctsr.metrics(ctsr.read_projections(ref), ctsr.read_projections(test), value_range=float(o.get('range', 0)))
    else:
        m = ctsr.metrics(ref, test, mask=o.get('mask'), **window(o))
    end = '' if rays else '-hu'
    lines = ['psnr %.6f' % m['psnr'], 'ssim-%s %.8f' % ('wang' if rays else 'r2', m['ssim'])]
    lines += ['%s%s %.6f' % (k, end, m[k]) for k in ('mae', 'rmse', 'bias', 'max')]
    if rays:
        return lines + ['%d %.9g %.9g' % x for x in zip(range(len(m['view_psnr'])), m['view_psnr'], m['view_ssim'])]
    return lines + ['gradient-%s-hu-mm %.6f' % x for x in zip('ijk', m['gradient'])]


def consistency(low, test):
    m = ctsr.consistency(test, low)
    return ['residual-%s-hu %.6f' % (k, m[k]) for k in ('max', 'p95', 'rms', 'mean')]


def main(step, *words):
    files = [w for w in words if '=' not in w]
    o = dict(w.split('=', 1) for w in words if '=' in w)
    if step == 'same':
        same(*files)
    elif step == 'project':
        ctsr.write_projections(ctsr.project(files[0], BEAMS[int(o.get('beam', 0))], pixel=PIXELS[int(o.get('pixel', 0))], **window(o),
                                            **whole(o, 'views', 'overshoot', 'coarsen', 'columns', 'rows')), files[1])
    elif step == 'fit':
        ctsr.write_gaussians(ctsr.fit(ctsr.read_projections(files[1]), files[0],
                                      **whole(o, 'gaussians', 'iterations', 'full')), files[2])
    elif step == 'compose':
        ctsr.write(ctsr.compose(files[0], ctsr.read_gaussians(files[1]), lr=o.get('lr'), **window(o),
                                **real(o, 'gain', 'floor', 'spacing')), files[2])
    elif step == 'ddnm':
        ctsr.write_projections(ctsr.ddnm(ctsr.read_projections(files[0]), o.get('prior'), o.get('sampler'),
                                         pixel=PIXELS[int(o['pixel'])] if 'pixel' in o else None,
                                         **whole(o, 'factor', 'steps', 'samples', 'start'), **real(o, 'sigma_y')), files[1])
    elif step == 'reconstruct':
        how = {k: o[k] for k in ('like', 'method', 'filter') if k in o}
        ctsr.write(ctsr.reconstruct(ctsr.read_projections(files[0]), **how, **window(o), **real(o, 'tv'),
                                    **whole(o, 'iterations', 'parker', 'density', 'nonnegative', 'voxels')), files[1])
    elif step == 'degrade':
        ctsr.write(ctsr.degrade(files[0], three(o['factor']), three(o['sigma']) if 'sigma' in o else None,
                                DECIMATE[int(o['decimate'])] if 'decimate' in o else None,
                                **real(o, 'noise', 'slice_thickness'), protocol=o.get('protocol'), profile=o.get('profile'),
                                clip=[float(x) for x in o['clip'].split(':')] if 'clip' in o else None), files[1])
    elif step == 'paper':
        ctsr.write(ctsr.paper(files[0], prior=o.get('prior'), **whole(o, 'factor', 'views', 'iterations', 'gaussians', 'release')),
                   files[1])
    elif step in ('compare', 'consistency'):
        lines = compare(*files[:2], o) if step == 'compare' else consistency(*files[:2])
        with open(files[2], 'w') as f:
            f.write('\n'.join(lines) + '\n')
    elif step == 'refine':
        f = ctsr.superres if 'prior' in o else ctsr.upsample
        how = {'method': METHODS[int(o['method'])]} if 'method' in o else {}
        how.update({'units': o['units']} if 'units' in o else {})
        ctsr.write(f(files[0], prior=o.get('prior'), **real(o, 'factor', 'noise', 'denoise', 'tolerance'), **how), files[1])


if __name__ == '__main__':
    try:
        main(*sys.argv[1:])
    except ctsr.Error as e:
        print(e, file=sys.stderr)
        sys.exit(e.status)
