/* adam.c: see adam.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "solve/adam.h"
#include "core/vec.h"

#include <math.h>

void CT_SIMD_HERE(ct_adamw_step)(const struct ct_adamw *a, uint64_t step, size_t n,
	float *restrict p, float *restrict m, float *restrict v, const float *restrict g)
{
	/* sqrt(v/(1 - b2^t)) + eps = (sqrt(v) + eps s)/s with s = sqrt(1 - b2^t) */
	const double s = sqrt(1.0 - pow(a->beta2, (double)step));
	const float b1 = (float)a->beta1, b2 = (float)a->beta2, c1 = (float)(1.0 - a->beta1),
		    c2 = (float)(1.0 - a->beta2), eps = (float)(a->eps * s),
		    rate = (float)(a->lr * s / (1.0 - pow(a->beta1, (double)step))),
		    keep = (float)(1.0 - a->lr * a->decay);

	for (size_t i = 0; i < n; i++) {
		m[i] = b1 * m[i] + c1 * g[i];
		v[i] = b2 * v[i] + c2 * g[i] * g[i];
		p[i] = keep * p[i] - rate * m[i] / (sqrtf(v[i]) + eps);
	}
}

void CT_SIMD_HERE(ct_adam_each)(const struct ct_adamw *a, size_t n, float *restrict p,
	float *restrict m, float *restrict v, const float *restrict g, const float *restrict c1,
	const float *restrict c2)
{
	const float b1 = (float)a->beta1, b2 = (float)a->beta2, eps = (float)a->eps,
		    lr = (float)a->lr;

	for (size_t i = 0; i < n; i++) {
		m[i] = b1 * m[i] + (1 - b1) * g[i];
		v[i] = b2 * v[i] + (1 - b2) * g[i] * g[i];
		p[i] -= lr * c1[i] * m[i] / (sqrtf(v[i]) * c2[i] + eps);
	}
}

void CT_SIMD_HERE(ct_adam_average)(
	double rate, size_t n, float *restrict mean, const float *restrict p)
{
	const float c = (float)(1.0 - rate);

	for (size_t i = 0; i < n; i++)
		mean[i] += c * (p[i] - mean[i]);
}

double CT_SIMD_HERE(ct_adam_gradient)(size_t n, float *g, size_t groups, size_t stride, float scale)
{
	double sum = 0;

	for (size_t k = 1; k < groups; k++)
		for (size_t i = 0; i < n; i++)
			g[i] += g[k * stride + i];
	for (size_t i = 0; i < n; i++) {
		g[i] *= scale;
		sum += (double)g[i] * (double)g[i];
	}
	return sum;
}
