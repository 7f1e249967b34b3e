# The operator D that makes a low-resolution CT: along an axis, and of three; its SVD; grids, frames, padding.
libct_a_SOURCES += src/operator/separable.c src/operator/separable.h
SIMD_SOURCES += src/operator/separable-rows.c
libct_a_SOURCES += src/operator/resample.c src/operator/resample.h
libct_a_SOURCES += src/operator/degrade.c src/operator/degrade.h
libct_a_SOURCES += src/operator/slice-profile.c src/operator/slice-profile.h
libct_a_SOURCES += src/operator/regrid.c src/operator/regrid.h
libct_a_SOURCES += src/operator/crop.c src/operator/crop.h
libct_a_SOURCES += src/operator/svd.c src/operator/svd.h
SIMD_SOURCES += src/operator/cosine-strip.c src/operator/turn.h
libct_a_SOURCES += src/operator/cosine.c src/operator/cosine.h
SIMD_SOURCES += src/operator/banded-strip.c
libct_a_SOURCES += src/operator/banded.c src/operator/banded.h
libct_a_SOURCES += src/operator/mirror.c src/operator/mirror.h
libct_a_SOURCES += src/operator/padding.c src/operator/padding.h
