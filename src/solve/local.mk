# Solvers of any linear operator (core/linear.h), and their passes over vectors.
libct_a_SOURCES += src/solve/passes.c src/solve/passes.h
libct_a_SOURCES += src/solve/fista.c src/solve/fista.h
libct_a_SOURCES += src/solve/trend.c src/solve/trend.h
SIMD_SOURCES += src/solve/adam.c src/solve/adam.h
libct_a_SOURCES += src/solve/trainer.c src/solve/trainer.h
SIMD_SOURCES += src/solve/vector.c src/solve/vector.h
libct_a_SOURCES += src/solve/jacobi.c src/solve/jacobi.h
