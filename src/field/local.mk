# Neural fields, for comparison: encodings, networks, samples, their fit.
libct_a_SOURCES += src/field/attention.h src/field/network.h src/field/field.h src/field/encoding.h
