# Neural fields, for comparison: encodings, networks, samples, their fit.
libct_a_SOURCES += src/field/encoding.c src/field/encoding.h
SIMD_SOURCES += src/field/encoding-level.c
libct_a_SOURCES += src/field/ray-attention.c src/field/ray-attention.h
SIMD_SOURCES += src/field/ray-attention-kernels.c
libct_a_SOURCES += src/field/network.c src/field/network.h
libct_a_SOURCES += src/field/field.c src/field/field.h
# Their fit: which points a measurement has, how they become a value, and the steps.
libct_a_SOURCES += src/field/samples.c src/field/samples.h src/field/render.c src/field/render.h
libct_a_SOURCES += src/field/block.c src/field/block.h
libct_a_SOURCES += src/field/field-fit.c src/field/field-fit.h src/field/field-fit-rule.c src/field/field-fit-state.c src/field/field-fit-volume.c
libct_a_SOURCES += src/field/field-fit-step.c src/field/field-fit-step.h src/field/field-fit-items.c
