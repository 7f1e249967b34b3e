# Neural fields, for comparison: encodings, networks, samples, their fit.
libct_a_SOURCES += src/field/attention.h src/field/network.h src/field/field.h src/field/encoding.h
# Their fit: which points a measurement has, how they become a value, and the steps.
libct_a_SOURCES += src/field/samples.c src/field/samples.h src/field/render.c src/field/render.h
libct_a_SOURCES += src/field/block.c src/field/block.h
libct_a_SOURCES += src/field/fit.c src/field/fit.h src/field/fit-rule.c src/field/fit-state.c src/field/fit-volume.c
libct_a_SOURCES += src/field/fit-step.c src/field/fit-step.h src/field/fit-items.c src/field/fit-items.h
