#!/bin/sh
# b-size.sh: CPU seconds and peak memory of ct-upsample -m tv --iterations 20 and of ct-restore against the size of
# the result, 4x, of a scan of points (P3's operator), one thread; a result with an edge of more than WHOLE
# voxels (512) with --memory MEMORY (2G).
#   SIZES='64 128 192 256' VOLUME=scan.nii.gz TABLE=sizes.csv make bench BENCH=bench/b-size.sh
# The scan is the middle of VOLUME, mirrored where it is too small; without one, noise that is smooth. Nothing of it
# is flat, so that the prior looks at all of it. What is in TABLE is not measured again.
set -e
SIZES=${SIZES:-64 128} WHOLE=${WHOLE:-512} MEMORY=${MEMORY:-2G}
table=${TABLE:-/dev/null}
