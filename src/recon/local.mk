# Projections to volumes: FDK, iterative solvers, the joint voxel solver.
libct_a_SOURCES += src/recon/joint.c src/recon/joint.h
libct_a_SOURCES += src/recon/fuse.c src/recon/fuse-state.c src/recon/fuse.h
libct_a_SOURCES += src/recon/ramp.c src/recon/ramp.h
SIMD_SOURCES += src/recon/ramp-row.c
libct_a_SOURCES += src/recon/backproject.c src/recon/backproject.h
SIMD_SOURCES += src/recon/backproject-line.c
SIMD_SOURCES += src/recon/backproject-row.c
libct_a_SOURCES += src/recon/fdk-weights.c src/recon/fdk-weights.h
libct_a_SOURCES += src/recon/parker.c src/recon/parker.h
libct_a_SOURCES += src/recon/fdk.c src/recon/fdk.h
libct_a_SOURCES += src/recon/iterative.c src/recon/iterative.h
libct_a_SOURCES += src/recon/rof.c src/recon/rof.h
SIMD_SOURCES += src/recon/rof-row.c
libct_a_SOURCES += src/recon/scan-grid.c src/recon/scan-grid.h src/recon/reconstruct.c src/recon/reconstruct.h
