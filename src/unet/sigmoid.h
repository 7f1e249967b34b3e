/* sigmoid.h: for kernels (core/simd.h). */
#ifndef CT_UNET_SIGMOID_H
#define CT_UNET_SIGMOID_H
#include "core/vec.h"

/* 1/(1 + e^-x). */
CT_INLINE float ct_sigmoid(float x)
{
	return 1.0f / (1.0f + ct_expf(-x));
}

#endif
