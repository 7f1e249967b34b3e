# ArSSR: volumes on any finer grid, by a network of the whole volume.
libct_a_SOURCES += src/arssr/arssr.c src/arssr/arssr.h
libct_a_SOURCES += src/arssr/encoder.c src/arssr/encoder.h
libct_a_SOURCES += src/arssr/decoder.c src/arssr/decoder.h
libct_a_SOURCES += src/arssr/arssr-train.c src/arssr/arssr-train.h
libct_a_SOURCES += src/arssr/arssr-volume.c src/arssr/arssr-volume.h
SIMD_SOURCES += src/arssr/arssr-kernels.c src/arssr/arssr-kernels.h
