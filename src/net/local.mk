# The diffusion prior: network, schedules, samplers, training.
libct_a_SOURCES += src/net/dnn.c src/net/dnn.h
libct_a_SOURCES += src/net/layers.c src/net/layers.h src/net/simd.h
libct_a_SOURCES += src/net/attention.c src/net/attention.h
libct_a_SOURCES += src/net/arch.c src/net/arch.h
libct_a_SOURCES += src/net/graph.c src/net/graph.h
libct_a_SOURCES += src/net/arena.c src/net/arena.h
libct_a_SOURCES += src/net/unet.c src/net/unet.h src/net/plan.c
libct_a_SOURCES += src/net/schedule.c src/net/schedule.h
libct_a_SOURCES += src/net/ddnm.c src/net/ddnm.h
libct_a_SOURCES += src/net/adam.c src/net/adam.h
libct_a_SOURCES += src/net/patches.c src/net/patches.h
libct_a_SOURCES += src/net/train.c src/net/train.h
libct_a_SOURCES += src/net/superres.c src/net/superres.h
