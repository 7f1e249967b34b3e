#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# b-kernels.sh: ticks of the processor's counter that a call of each kernel takes at each level, of
# size 256: the least of nine rounds of sixteen calls. The table is that of tests/t-kernels*.c.
set -e
for t in t-kernels t-kernels-scan t-kernels-model; do "$builddir/tests/$t" time; done
