/* sigmoid.h: for kernels (core/simd.h). */
#ifndef CT_UNET_SIGMOID_H
#define CT_UNET_SIGMOID_H
#include "core/vec-exp.h"

/* 1/(1 + e^-x). */
CT_INLINE ct_f32 ct_f32_sigmoid(ct_f32 x)
{
	return 1.0f / (1.0f + ct_f32_exp(-x));
}

#endif
