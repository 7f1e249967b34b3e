# Neural fields, for comparison: encodings, networks, samples, their fit.
libct_a_SOURCES += src/field/encoding.c src/field/encoding.h
SIMD_SOURCES += src/field/encoding-level.c src/field/encoding-level.h
libct_a_SOURCES += src/field/dense.c src/field/dense.h
SIMD_SOURCES += src/field/dense-kernels.c src/field/dense-kernels.h
libct_a_SOURCES += src/field/attention.c src/field/attention.h
SIMD_SOURCES += src/field/attention-kernels.c src/field/attention-kernels.h
libct_a_SOURCES += src/field/network.c src/field/network.h
libct_a_SOURCES += src/field/field.c src/field/field-tensors.c src/field/field.h src/field/field-impl.h
