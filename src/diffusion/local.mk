# The diffusion prior: schedules, measurement operators, samplers, training.
libct_a_SOURCES += src/diffusion/measurement.c src/diffusion/measurement.h
libct_a_SOURCES += src/diffusion/schedule.c src/diffusion/schedule.h
libct_a_SOURCES += src/diffusion/sampler.h src/diffusion/draw.c src/diffusion/draw.h
libct_a_SOURCES += src/diffusion/ddnm.c src/diffusion/ddim.c src/diffusion/bird.c
libct_a_SOURCES += src/diffusion/patches.c src/diffusion/patches.h
libct_a_SOURCES += src/diffusion/train.c src/diffusion/train.h
libct_a_SOURCES += src/diffusion/sample-views.c src/diffusion/sample-views.h
libct_a_SOURCES += src/diffusion/prior.c src/diffusion/prior.h
