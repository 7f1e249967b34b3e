# The networks: layers over oneDNN, its graph and plan.
libct_a_SOURCES += src/nn/dnn.c src/nn/dnn.h src/nn/dnn-impl.h
libct_a_SOURCES += src/nn/conv.c src/nn/conv.h
libct_a_SOURCES += src/nn/product.c src/nn/product.h
libct_a_SOURCES += src/nn/dense.c src/nn/dense.h
SIMD_SOURCES += src/nn/dense-kernels.c src/nn/dense-kernels.h
SIMD_SOURCES += src/nn/layers.c src/nn/layers.h
SIMD_SOURCES += src/nn/norm.c src/nn/norm.h
SIMD_SOURCES += src/nn/pointwise.c src/nn/pointwise.h
SIMD_SOURCES += src/nn/spatial.c src/nn/spatial.h
libct_a_SOURCES += src/nn/window-attention.c src/nn/window-attention.h
libct_a_SOURCES += src/nn/attention.c src/nn/attention.h
libct_a_SOURCES += src/nn/arch.c src/nn/arch.h
libct_a_SOURCES += src/nn/graph.c src/nn/graph.h src/nn/build.c src/nn/build.h
libct_a_SOURCES += src/nn/rdn.c src/nn/rdn.h src/nn/omni.c src/nn/omni.h
libct_a_SOURCES += src/nn/arena.c src/nn/arena.h
libct_a_SOURCES += src/nn/unet.c src/nn/unet.h
libct_a_SOURCES += src/nn/plan.c src/nn/plan-run.c src/nn/plan-impl.h
