/* adam-row.c: see adam-row.h. */
#include "config.h"
#include "gs/adam-row.h"
#include "core/vec.h"
#include "gs/adam.h"

#include <math.h>

void CT_SIMD_HERE(ct_adam_row_step)(size_t n, float *restrict x, float *restrict m,
	float *restrict v, const float *restrict grad, const float *restrict c1,
	const float *restrict c2, float lr)
{
	const float b1 = (float)CT_GS_ADAM_BETA1, b2 = (float)CT_GS_ADAM_BETA2;
	const float eps = (float)CT_GS_ADAM_EPS;

	for (size_t i = 0; i < n; i++) {
		m[i] = b1 * m[i] + (1 - b1) * grad[i];
		v[i] = b2 * v[i] + (1 - b2) * grad[i] * grad[i];
		x[i] -= lr * c1[i] * m[i] / (sqrtf(v[i]) * c2[i] + eps);
	}
}
