# The fit of signed 3-D Gaussians.
libct_a_SOURCES += src/gs/fit.c src/gs/fit.h
libct_a_SOURCES += src/gs/fit-state.c src/gs/fit-cost.c
libct_a_SOURCES += src/gs/place.c src/gs/place.h
libct_a_SOURCES += src/gs/densify.c src/gs/densify.h
# A Gaussian, and its gradient.
libct_a_SOURCES += src/gs/gaussian.c src/gs/gaussian.h src/gs/gaussian-formulas.h
SIMD_SOURCES += src/gs/gaussian-kernels.c
# Projections and volumes of them.
libct_a_SOURCES += src/gs/gaussian-integral.h
libct_a_SOURCES += src/gs/splat.c src/gs/splat.h
SIMD_SOURCES += src/gs/rasterise.c src/gs/rasterise.h
libct_a_SOURCES += src/gs/mixture.c src/gs/mixture.h
# The loss.
libct_a_SOURCES += src/gs/loss.c src/gs/loss-tv.c src/gs/loss.h
libct_a_SOURCES += src/gs/loss-total.c src/gs/loss-total.h
libct_a_SOURCES += src/gs/loss-lowres.c src/gs/loss-lowres.h
SIMD_SOURCES += src/gs/loss-row.c
# The optimiser.
libct_a_SOURCES += src/gs/gaussian-adam.c src/gs/gaussian-adam.h
