# Signed 3-D Gaussians.
libct_a_SOURCES += src/gs/act.c src/gs/act.h
libct_a_SOURCES += src/gs/blob.c src/gs/blob.h
libct_a_SOURCES += src/gs/dab.c src/gs/dab.h
libct_a_SOURCES += src/gs/splat.c src/gs/splat_back.c src/gs/splat.h
libct_a_SOURCES += src/gs/voxel.c src/gs/voxel.h
