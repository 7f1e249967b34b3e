# Pure numerics.
libct_a_SOURCES += src/kern/ssim.c src/kern/ssim.h
