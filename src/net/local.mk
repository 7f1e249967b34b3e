# The diffusion prior: network, schedules, samplers, training.
libct_a_SOURCES += src/net/schedule.c src/net/schedule.h
libct_a_SOURCES += src/net/ddnm.c src/net/ddnm.h
libct_a_SOURCES += src/net/adam.c src/net/adam.h
libct_a_SOURCES += src/net/patches.c src/net/patches.h
libct_a_SOURCES += src/net/train.c src/net/train.h
libct_a_SOURCES += src/net/superres.c src/net/superres.h
libct_a_SOURCES += src/net/prior.c src/net/prior.h
