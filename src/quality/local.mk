# What is measured: PSNR, SSIM, differences, edges, the consistency certificate.
libct_a_SOURCES += src/quality/ssim.c src/quality/ssim-gradient.c src/quality/ssim.h
libct_a_SOURCES += src/quality/lanes.h
libct_a_SOURCES += src/quality/ssim-volume.c src/quality/ssim-volume-real.h src/quality/ssim-volume.h
libct_a_SOURCES += src/quality/difference.c src/quality/difference.h
libct_a_SOURCES += src/quality/certificate.c src/quality/certificate.h
libct_a_SOURCES += src/quality/edges.c src/quality/edges.h
libct_a_SOURCES += src/quality/metrics.c src/quality/metrics.h
