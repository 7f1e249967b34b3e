# Neural fields, for comparison: encodings, networks, samples, their fit.
libct_a_SOURCES += src/field/encoding.c src/field/encoding.h
SIMD_SOURCES += src/field/encoding-level.c
libct_a_SOURCES += src/field/attention.c src/field/attention.h
SIMD_SOURCES += src/field/attention-kernels.c
libct_a_SOURCES += src/field/network.c src/field/network.h
libct_a_SOURCES += src/field/field.c src/field/field.h
# Their fit: which points a measurement has, how they become a value, and the steps.
libct_a_SOURCES += src/field/samples.c src/field/samples.h src/field/render.c src/field/render.h
libct_a_SOURCES += src/field/block.c src/field/block.h
libct_a_SOURCES += src/field/fit.c src/field/fit.h src/field/fit-rule.c src/field/fit-state.c src/field/fit-volume.c
libct_a_SOURCES += src/field/fit-step.c src/field/fit-step.h src/field/fit-items.c
