# What is measured: PSNR, SSIM, differences, edges, harm, the data residual.
libct_a_SOURCES += src/quality/ssim.c src/quality/ssim.h
SIMD_SOURCES += src/quality/ssim-tile.c src/quality/ssim-block.c src/quality/ssim-block-real.h src/quality/ssim-kernels.h
libct_a_SOURCES += src/quality/difference.c src/quality/difference.h
libct_a_SOURCES += src/quality/data-residual.c src/quality/data-residual.h
libct_a_SOURCES += src/quality/edges.c src/quality/edges.h
libct_a_SOURCES += src/quality/metrics.c src/quality/metrics.h
libct_a_SOURCES += src/quality/calibration.c src/quality/calibration.h
libct_a_SOURCES += src/quality/structures.c src/quality/structures.h
libct_a_SOURCES += src/quality/fsc.c src/quality/fsc.h
libct_a_SOURCES += src/quality/hfen.c src/quality/hfen.h
libct_a_SOURCES += src/quality/tissue.c src/quality/tissue.h
libct_a_SOURCES += src/quality/banding.c src/quality/banding.h
libct_a_SOURCES += src/quality/compare.c src/quality/compare.h
