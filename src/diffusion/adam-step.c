/* adam-step.c: see adam-step.h. */
#include "config.h"
#include "diffusion/adam-step.h"
#include "core/vec.h"

#include <math.h>

void CT_SIMD_HERE(ct_adam_step)(size_t n, float *restrict p, float *restrict m, float *restrict v,
	const float *restrict g, const float k[static 7])
{
	const float b1 = k[0], b2 = k[1], c1 = k[2], c2 = k[3], rate = k[4], eps = k[5],
		    keep = k[6];

	for (size_t i = 0; i < n; i++) {
		m[i] = b1 * m[i] + c1 * g[i];
		v[i] = b2 * v[i] + c2 * g[i] * g[i];
		p[i] = keep * p[i] - rate * m[i] / (sqrtf(v[i]) + eps);
	}
}

void CT_SIMD_HERE(ct_adam_step_average)(
	size_t n, float *restrict mean, const float *restrict p, float c)
{
	for (size_t i = 0; i < n; i++)
		mean[i] += c * (p[i] - mean[i]);
}

void CT_SIMD_HERE(ct_adam_step_add)(size_t n, float *restrict g, const float *restrict more)
{
	for (size_t i = 0; i < n; i++)
		g[i] += more[i];
}
