#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Neural fields against PyTorch's: values and gradients of the same weights.
. "$srcdir/tests/tap.sh"
python_with torch || { echo '1..0 # SKIP no PyTorch'; exit 0; }
"$builddir/tests/t-field-network" dump . && "$builddir/tests/t-field-fit" dump . &&
	exec "$PY" "$srcdir/tests/field-torch.py" .
echo 'Bail out! nothing to compare'
