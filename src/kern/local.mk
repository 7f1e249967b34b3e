# Pure numerics.
libct_a_SOURCES += src/kern/scan.c src/kern/scan.h
libct_a_SOURCES += src/kern/window.c src/kern/window.h
libct_a_SOURCES += src/kern/project.c src/kern/project.h
libct_a_SOURCES += src/kern/phantom.c src/kern/phantom-sets.c src/kern/phantom.h
libct_a_SOURCES += src/kern/ssim.c src/kern/ssim.h
libct_a_SOURCES += src/kern/taps.c src/kern/taps.h
libct_a_SOURCES += src/kern/resample.c src/kern/resample.h
libct_a_SOURCES += src/kern/degrade.c src/kern/degrade.h
libct_a_SOURCES += src/kern/metrics.c src/kern/metrics.h
libct_a_SOURCES += src/kern/box.c src/kern/box.h
libct_a_SOURCES += src/kern/matched.c src/kern/matched.h
libct_a_SOURCES += src/kern/operator.c src/kern/operator.h
libct_a_SOURCES += src/kern/reframe.c src/kern/reframe.h
