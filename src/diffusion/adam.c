/* adam.c: see adam.h. */
#include "config.h"
#include "diffusion/adam.h"
#include "diffusion/adam-step.h"

#include <math.h>

void ct_adamw_default(struct ct_adamw *a)
{
	*a = (struct ct_adamw){.lr = 1e-4, .beta1 = 0.9, .beta2 = 0.999, .eps = 1e-8};
}

void ct_adamw_step(const struct ct_adamw *a, uint64_t step, size_t n, float *p, float *m, float *v,
	const float *g)
{
	/* sqrt(v/(1 - b2^t)) + eps = (sqrt(v) + eps s)/s with s = sqrt(1 - b2^t) */
	double s = sqrt(1.0 - pow(a->beta2, (double)step));
	double rate = a->lr * s / (1.0 - pow(a->beta1, (double)step));
	const float k[7] = {(float)a->beta1, (float)a->beta2, (float)(1.0 - a->beta1),
		(float)(1.0 - a->beta2), (float)rate, (float)(a->eps * s),
		(float)(1.0 - a->lr * a->decay)};

	CT_SIMD(ct_adam_step)(n, p, m, v, g, k);
}

void ct_adam_average(double rate, size_t n, float *mean, const float *p)
{
	CT_SIMD(ct_adam_step_average)(n, mean, p, (float)(1.0 - rate));
}

double ct_adam_gradient(size_t n, float *g, size_t groups, size_t stride, float scale)
{
	double sum = 0;

	for (size_t k = 1; k < groups; k++)
		CT_SIMD(ct_adam_step_add)(n, g, g + k * stride);
	for (size_t i = 0; i < n; i++) {
		g[i] *= scale;
		sum += (double)g[i] * (double)g[i];
	}
	return sum;
}
