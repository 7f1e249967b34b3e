/* adam.h: one step of Adam (Kingma and Ba, ICLR 2015) and AdamW (Loshchilov and Hutter 2019), and
 * of an average of the weights. Kernels (core/simd.h).
 *
 * Element by element: any cut of the vectors gives the same bytes. Thread-safe on disjoint parts.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_SOLVE_ADAM_H
#define CT_SOLVE_ADAM_H
#include "core/simd.h"

#include <math.h>
#include <stddef.h>
#include <stdint.h>

struct ct_adamw {
	double lr, beta1, beta2, eps, decay;
};

/* Defaults of the priors' training: 1e-4, 0.9, 0.999, 1e-8, 0. */
static inline struct ct_adamw ct_adamw_default(void)
{
	return (struct ct_adamw){.lr = 1e-4, .beta1 = 0.9, .beta2 = 0.999, .eps = 1e-8};
}

/* Step number `step`, counted from 1, of n parameters p with gradient g and moments m, v:
 *   m = b1 m + (1 - b1) g,  v = b2 v + (1 - b2) g^2,
 *   p = (1 - lr decay) p - lr (m / (1 - b1^step)) / (sqrt(v / (1 - b2^step)) + eps). */
CT_SIMD_DECLARE(void, ct_adamw_step,
	(const struct ct_adamw *a, uint64_t step, size_t n, float *p, float *m, float *v,
		const float *g));
/* The same without decay for parameters each of which has its own number of steps t: c1[i] = 1 / (1
 * - b1^t), c2[i] = 1 / sqrt(1 - b2^t). */
CT_SIMD_DECLARE(void, ct_adam_each,
	(const struct ct_adamw *a, size_t n, float *p, float *m, float *v, const float *g,
		const float *c1, const float *c2));

/* The same for one number. */
struct ct_adam_scalar {
	double m, v;
	uint32_t steps;
};
static inline void ct_adam_scalar_step(
	struct ct_adam_scalar *s, const struct ct_adamw *a, double *x, double g)
{
	s->steps++;
	s->m = a->beta1 * s->m + (1 - a->beta1) * g;
	s->v = a->beta2 * s->v + (1 - a->beta2) * g * g;
	*x -= a->lr * s->m / (1 - pow(a->beta1, s->steps)) /
	      (sqrt(s->v / (1 - pow(a->beta2, s->steps))) + a->eps);
}

/* mean = rate mean + (1 - rate) p. */
CT_SIMD_DECLARE(void, ct_adam_average, (double rate, size_t n, float *mean, const float *p));
/* g[i] = scale (g[i] + g[stride + i] + ... + g[(groups - 1) stride + i]), i < n, added in that
 * order; the sum of their squares. */
CT_SIMD_DECLARE(
	double, ct_adam_gradient, (size_t n, float *g, size_t groups, size_t stride, float scale));

#endif
