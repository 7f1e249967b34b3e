# Signed 3-D Gaussians.
libct_a_SOURCES += src/gs/activation.c src/gs/activation.h
libct_a_SOURCES += src/gs/gaussian.c src/gs/gaussian.h
libct_a_SOURCES += src/gs/rasterise.c src/gs/rasterise.h
libct_a_SOURCES += src/gs/wide.h src/gs/footprint-impl.h src/gs/footprint-vec.h src/gs/footprint-ref.c
libct_a_SOURCES += src/gs/splat.c src/gs/splat-gradient.c src/gs/splat.h
libct_a_SOURCES += src/gs/voxelise.c src/gs/voxelise.h
libct_a_SOURCES += src/gs/random-stream.h
libct_a_SOURCES += src/gs/loss-image.c src/gs/loss-image.h
libct_a_SOURCES += src/gs/adam.c src/gs/adam.h
libct_a_SOURCES += src/gs/densify.c src/gs/densify.h
libct_a_SOURCES += src/gs/place.c src/gs/place.h
libct_a_SOURCES += src/gs/loss-lowres.c src/gs/loss-lowres.h
libct_a_SOURCES += src/gs/loss-total.c src/gs/loss-total.h
libct_a_SOURCES += src/gs/refit.c src/gs/refit.h
libct_a_SOURCES += src/gs/fit.c src/gs/fit-state.c src/gs/fit.h
