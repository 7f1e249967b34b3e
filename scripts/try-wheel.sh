#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Is a wheel of scripts/wheel.py complete? scripts/try-wheel.sh FILE.whl: installs it by pip into a new venv, without
# a library of ctsr in reach, and refines a scan. Needs python3-venv, and numpy of the system or a network.
set -e
wheel=$(realpath "$1")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
unset CTSR_LIBRARY LD_LIBRARY_PATH PYTHONPATH
if /usr/bin/python3 -c 'import numpy' 2>/dev/null; then
	/usr/bin/python3 -m venv --system-site-packages venv && venv/bin/pip install -q --no-index "$wheel"
else
	/usr/bin/python3 -m venv venv && venv/bin/pip install -q "$wheel"
fi
cat >try.py <<'END'
import os, sys
import numpy as np
import ctsr

assert 'venv' in ctsr.__file__, ctsr.__file__
x = np.indices((32, 32, 8)).astype(np.float32)
fine = np.where(sum((a - n / 2) ** 2 / (n * f) ** 2 for a, n, f in zip(x, (32, 32, 8), (.35, .3, .4))) < 1, 40, -1000)
thick = ctsr.Image(np.round(ctsr.degrade(fine, (1, 1, 2), 0, 'mean').data), meta={'factor': '1,1,2', 'sigma': '0', 'decimate': 'mean'})
ctsr.write(thick, 'thick.nii')
lines = []
thin = ctsr.superres('thick.nii', log=lines.append)  # with the network that is in the wheel
assert thin.data.shape == (32, 32, 8) and np.isfinite(thin.data).all() and lines, (thin.data.shape, lines)
cubic = ctsr.superres('thick.nii', method='cubic')
error = [float(np.sqrt(np.mean((v.data - fine) ** 2))) for v in (cubic, thin)]
assert error[1] < error[0], error
ctsr.project(thin, views=2)
ctsr.write_projections(ctsr.project(thin, views=2, columns=16, rows=16), 'p.exr')
assert ctsr.read_projections('p.exr').data.shape == (2, 16, 16)
ctsr.ddnm(ctsr.read_projections('p.exr'), factor=2, steps=1)  # and its other network
own = os.path.dirname(ctsr.__file__)
loaded = {l.split()[-1] for l in open('/proc/self/maps') if '.so' in l}
wrong = [f for f in loaded for name in ('dnnl', 'OpenEXR', 'deflate', 'jansson', 'libctsr') if name in f and not f.startswith(own)]
assert not wrong, wrong
os.mkdir('dicom')
os.environ['PATH'] = ''
try:
    ctsr.read('dicom')
    assert False, 'a folder of DICOM is read'
except ctsr.Error as e:
    print(e)
print('%s: %s; error %.1f HU, cubic interpolation %.1f HU' % (ctsr.__version__, lines[-1], error[1], error[0]))
END
venv/bin/python try.py
