/* adam-step.h: what adam.c does to every parameter. Kernels (core/simd.h). */
#ifndef CT_DIFFUSION_ADAM_STEP_H
#define CT_DIFFUSION_ADAM_STEP_H
#include "core/simd.h"

#include <stddef.h>

/* k: beta1, beta2, 1 - beta1, 1 - beta2, the rate, eps, 1 - the decay of this step. */
CT_SIMD_DECLARE(void, ct_adam_step,
	(size_t n, float *p, float *m, float *v, const float *g, const float k[7]));
/* mean += c (p - mean). */
CT_SIMD_DECLARE(void, ct_adam_step_average, (size_t n, float *mean, const float *p, float c));
/* g += more. */
CT_SIMD_DECLARE(void, ct_adam_step_add, (size_t n, float *g, const float *more));

#endif
