# Pure numerics.
libct_a_SOURCES += src/kern/ssim.c src/kern/ssim-back.c src/kern/ssim.h
libct_a_SOURCES += src/kern/lanes.h
libct_a_SOURCES += src/kern/ssim-volume.c src/kern/ssim-volume-real.h src/kern/ssim-volume.h
libct_a_SOURCES += src/kern/difference.c src/kern/difference.h
libct_a_SOURCES += src/kern/consistency.c src/kern/consistency.h
libct_a_SOURCES += src/kern/edges.c src/kern/edges.h
libct_a_SOURCES += src/kern/metrics.c src/kern/metrics.h
libct_a_SOURCES += src/kern/box.c src/kern/box.h
libct_a_SOURCES += src/kern/matched.c src/kern/matched.h
libct_a_SOURCES += src/kern/operator.c src/kern/operator.h
libct_a_SOURCES += src/kern/survey.c src/kern/survey.h
libct_a_SOURCES += src/kern/montage.c src/kern/montage.h
