/* adam.c: see adam.h. */
#pragma GCC optimize("O3")
#include "config.h"
#include "diffusion/adam.h"
#include "unet/simd.h"

#include <math.h>

void ct_adamw_default(struct ct_adamw *a)
{
	*a = (struct ct_adamw){.lr = 1e-4, .beta1 = 0.9, .beta2 = 0.999, .eps = 1e-8};
}

CT_CLONES
static void update(size_t n, float *restrict p, float *restrict m, float *restrict v,
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

void ct_adamw_step(const struct ct_adamw *a, uint64_t step, size_t n, float *p, float *m, float *v,
	const float *g)
{
	/* sqrt(v/(1 - b2^t)) + eps = (sqrt(v) + eps s)/s with s = sqrt(1 - b2^t) */
	double s = sqrt(1.0 - pow(a->beta2, (double)step));
	double rate = a->lr * s / (1.0 - pow(a->beta1, (double)step));
	const float k[7] = {(float)a->beta1, (float)a->beta2, (float)(1.0 - a->beta1),
		(float)(1.0 - a->beta2), (float)rate, (float)(a->eps * s),
		(float)(1.0 - a->lr * a->decay)};

	update(n, p, m, v, g, k);
}

CT_CLONES
void ct_ema_step(double rate, size_t n, float *restrict mean, const float *restrict p)
{
	const float c = (float)(1.0 - rate);

	for (size_t i = 0; i < n; i++)
		mean[i] += c * (p[i] - mean[i]);
}

CT_CLONES
static void add(size_t n, float *restrict g, const float *restrict more)
{
	for (size_t i = 0; i < n; i++)
		g[i] += more[i];
}

double ct_grad_mean(size_t n, float *g, size_t groups, size_t stride, float scale)
{
	double sum = 0;

	for (size_t k = 1; k < groups; k++)
		add(n, g, g + k * stride);
	for (size_t i = 0; i < n; i++) {
		g[i] *= scale;
		sum += (double)g[i] * (double)g[i];
	}
	return sum;
}
