# The diffusion prior: network, schedules, samplers, training.
libct_a_SOURCES += src/net/schedule.c src/net/schedule.h
libct_a_SOURCES += src/net/ddnm.c src/net/ddnm.h
