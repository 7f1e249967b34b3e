/* adam-row.h: a step of Adam on one parameter of many Gaussians. A pure kernel (core/simd.h). */
#ifndef CT_GS_ADAM_ROW_H
#define CT_GS_ADAM_ROW_H
#include "core/simd.h"

#include <stddef.h>

/* n parameters x with moments m, v; c1, c2 = 1/(1 - beta1^t), 1/sqrt(1 - beta2^t). */
CT_SIMD_DECLARE(void, ct_adam_row_step,
	(size_t n, float *restrict x, float *restrict m, float *restrict v,
		const float *restrict grad, const float *restrict c1, const float *restrict c2,
		float lr));

#endif
