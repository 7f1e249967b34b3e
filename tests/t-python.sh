#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The package for Python, against the commands.
unset CTSR_CPU
. "$srcdir/tests/tap.sh"
lib=$(ls "$builddir"/libctsr.so.0 "$builddir"/.libs/libctsr.so.0 2>/dev/null | head -n 1)
if [ -z "$lib" ] || ! python_with numpy; then echo '1..0 # SKIP no shared library, or no numpy'; exit 0; fi
! sanitized ct-sr || { echo '1..0 # SKIP sanitizers are not of Python'; exit 0; }
for PY in /usr/bin/python3 python3; do "$PY" -c 'import numpy, nibabel' 2>/dev/null && break; done
CTSR_LIBRARY=$lib PYTHONDONTWRITEBYTECODE=1; export CTSR_LIBRARY PYTHONDONTWRITEBYTECODE
exits 0 'every test of the Python package passes' env PYTHONPATH="$srcdir/python" "$PY" "$srcdir/tests/t-python.py" "$srcdir/src/ctsr/ctsr.h" "$builddir/slices.safetensors"
sed 's/^\(not \)*ok [0-9]* -/# \1ok/; /^1\.\./d' out
if "$PY" -c 'import setuptools, wheel, pip' 2>/dev/null; then
	cp -r "$srcdir/python" package && chmod -R u+w package
	exits 0 'pip installs the package without a network' "$PY" -m pip install -q --no-index --no-build-isolation --no-deps --target installed ./package
	exits 0 'Python imports the installed package' sh -c "cd / && PYTHONPATH=$PWD/installed $PY -c 'import ctsr, sys; sys.exit(\"$PWD\" not in ctsr.__file__)'"
	[ -e installed/ctsr/py.typed ]; ok $? 'the installed package has its types'
else
	skip 'pip installs the package without a network' 'no pip, setuptools or wheel'
fi
ct-phantom -q --size 24x24x32 ellipsoids fine.nii && ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean fine.nii thick.nii
if "$PY" -c 'import matplotlib' 2>/dev/null; then
	exits 0 'examples/superres.py refines a scan' env PYTHONPATH="$srcdir/python" "$PY" "$srcdir/examples/superres.py" thick.nii thin.nii.gz look.png "$builddir/slices.safetensors"
	exits 0 'the output of examples/superres.py is a CT' ct-info thin.nii.gz
	[ -s look.png ]
	ok $? 'examples/superres.py writes a picture'
else
	skip 'examples/superres.py refines a scan' 'no matplotlib'
fi
done_testing
