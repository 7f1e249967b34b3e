# Signed 3-D Gaussians.
libct_a_SOURCES += src/gs/act.c src/gs/act.h
libct_a_SOURCES += src/gs/blob.c src/gs/blob.h
libct_a_SOURCES += src/gs/dab.c src/gs/dab.h
libct_a_SOURCES += src/gs/wide.h src/gs/foot-impl.h src/gs/foot-wide.h src/gs/foot.c
libct_a_SOURCES += src/gs/splat.c src/gs/splat_back.c src/gs/splat.h
libct_a_SOURCES += src/gs/voxel.c src/gs/voxel.h
libct_a_SOURCES += src/gs/stream.h
libct_a_SOURCES += src/gs/loss.c src/gs/loss.h
libct_a_SOURCES += src/gs/adam.c src/gs/adam.h
libct_a_SOURCES += src/gs/density.c src/gs/density.h
libct_a_SOURCES += src/gs/init.c src/gs/init.h
libct_a_SOURCES += src/gs/lowres.c src/gs/lowres.h
libct_a_SOURCES += src/gs/terms.c src/gs/terms.h
libct_a_SOURCES += src/gs/polish.c src/gs/polish.h
libct_a_SOURCES += src/gs/fit.c src/gs/state.c src/gs/fit.h
