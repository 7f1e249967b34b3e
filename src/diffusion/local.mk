# The diffusion prior: schedules, measurement operators, samplers, training.
libct_a_SOURCES += src/diffusion/block-mean.c src/diffusion/block-mean.h
libct_a_SOURCES += src/diffusion/matched.c src/diffusion/matched.h
libct_a_SOURCES += src/diffusion/measurement.c src/diffusion/measurement.h
libct_a_SOURCES += src/diffusion/schedule.c src/diffusion/schedule.h
libct_a_SOURCES += src/diffusion/sampler.c src/diffusion/sampler.h
libct_a_SOURCES += src/diffusion/draw.c src/diffusion/draw.h
libct_a_SOURCES += src/diffusion/ddnm.c src/diffusion/ddnm.h
libct_a_SOURCES += src/diffusion/ddim.c src/diffusion/ddim.h
libct_a_SOURCES += src/diffusion/bird.c src/diffusion/bird.h
libct_a_SOURCES += src/diffusion/bilinear.c src/diffusion/bilinear.h
libct_a_SOURCES += src/diffusion/adam.c src/diffusion/adam.h
SIMD_SOURCES += src/diffusion/adam-step.c src/diffusion/adam-step.h
libct_a_SOURCES += src/diffusion/patches.c src/diffusion/patches.h
libct_a_SOURCES += src/diffusion/train.c src/diffusion/train.h
libct_a_SOURCES += src/diffusion/waves.c src/diffusion/waves.h
libct_a_SOURCES += src/diffusion/superres.c src/diffusion/superres.h
libct_a_SOURCES += src/diffusion/prior.c src/diffusion/prior.h
