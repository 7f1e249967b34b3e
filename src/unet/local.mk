# The networks: layers over oneDNN, its graph and plan.
libct_a_SOURCES += src/unet/dnn.c src/unet/dnn.h src/unet/dnn-impl.h
libct_a_SOURCES += src/unet/conv.c src/unet/conv.h
libct_a_SOURCES += src/unet/product.c src/unet/product.h
libct_a_SOURCES += src/unet/dense.c src/unet/dense.h
SIMD_SOURCES += src/unet/dense-kernels.c src/unet/dense-kernels.h
SIMD_SOURCES += src/unet/layers.c src/unet/layers.h
SIMD_SOURCES += src/unet/norm.c src/unet/norm.h
SIMD_SOURCES += src/unet/pointwise.c src/unet/pointwise.h
SIMD_SOURCES += src/unet/spatial.c src/unet/spatial.h
libct_a_SOURCES += src/unet/window-attention.c src/unet/window-attention.h
libct_a_SOURCES += src/unet/attention.c src/unet/attention.h
libct_a_SOURCES += src/unet/arch.c src/unet/arch.h
libct_a_SOURCES += src/unet/graph.c src/unet/graph.h src/unet/build.c src/unet/build.h
libct_a_SOURCES += src/unet/rdn.c src/unet/rdn.h src/unet/omni.c src/unet/omni.h
libct_a_SOURCES += src/unet/arena.c src/unet/arena.h
libct_a_SOURCES += src/unet/unet.c src/unet/unet.h
libct_a_SOURCES += src/unet/plan.c src/unet/plan-run.c src/unet/plan-impl.h
