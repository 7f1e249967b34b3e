# The inverse of D: data consistency, total variation, how many iterations.
libct_a_SOURCES += src/inverse/consistency.c src/inverse/consistency-planes.c src/inverse/consistency.h
libct_a_SOURCES += src/inverse/tv.c src/inverse/tv.h
SIMD_SOURCES += src/inverse/tv-row.c src/inverse/tv-row.h
libct_a_SOURCES += src/inverse/hessian-tv.c
SIMD_SOURCES += src/inverse/hessian-row.c src/inverse/hessian-row.h
libct_a_SOURCES += src/inverse/upsample.c src/inverse/upsample.h
libct_a_SOURCES += src/inverse/pilot.c src/inverse/pilot.h
libct_a_SOURCES += src/inverse/trial.c src/inverse/trial.h
libct_a_SOURCES += src/inverse/flat.c src/inverse/flat.h
