/* vector.c: see vector.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "solve/vector.h"
#include "core/vec.h"

/* s += the products of a and b from i on, at most eight; a and b are readable to n. */
CT_INLINE void add_products(struct ct_sum8 *s, const float *a, const float *b, size_t n)
{
	for (size_t i = 0; i < n; i += CT_SUM_LANES) {
		float last[2][CT_SUM_LANES] = {{0}};
		const float *p = a + i, *q = b + i;

		if (n - i < CT_SUM_LANES) {
			memcpy(last[0], p, (n - i) * sizeof *p);
			memcpy(last[1], q, (n - i) * sizeof *q);
			p = last[0];
			q = last[1];
		}
		for (int k = 0; k < CT_SUM_PARTS; k++)
			s->part[k] += ct_f64_widen(p + k * CT_F64_LANES) *
				      ct_f64_widen(q + k * CT_F64_LANES);
	}
}

double CT_SIMD_HERE(ct_vector_dot)(size_t n, const struct ct_vector *v)
{
	struct ct_sum8 sum = {0};

	add_products(&sum, v->x, v->w, n);
	return ct_sum8_total(&sum);
}

double CT_SIMD_HERE(ct_vector_scale)(size_t n, const struct ct_vector *v)
{
	float *restrict y = v->y;
	const float c = (float)v->c;

	for (size_t i = 0; i < n; i++)
		y[i] *= c;
	return 0;
}

double CT_SIMD_HERE(ct_vector_mix)(size_t n, const struct ct_vector *v)
{
	float *restrict y = v->y;
	const float *restrict x = v->x;
	const float b = (float)v->b, c = (float)v->c;

	for (size_t i = 0; i < n; i++)
		y[i] = b * x[i] + c * y[i];
	return 0;
}

double CT_SIMD_HERE(ct_vector_lead)(size_t n, const struct ct_vector *v)
{
	float *restrict y = v->y;
	const float *restrict x = v->x;
	enum { BLOCK = 256 };
	struct ct_sum8 sum = {0};
	const float c = (float)v->c;
	float moved[BLOCK];

	for (size_t from = 0; from < n; from += BLOCK) {
		size_t count = n - from < BLOCK ? n - from : BLOCK;

		for (size_t i = 0; i < count; i++) {
			moved[i] = x[from + i] - y[from + i];
			y[from + i] = x[from + i] + c * moved[i];
		}
		add_products(&sum, moved, moved, count);
	}
	return ct_sum8_total(&sum);
}

double CT_SIMD_HERE(ct_vector_times)(size_t n, const struct ct_vector *v)
{
	float *restrict y = v->y;
	const float *restrict w = v->w;
	for (size_t i = 0; i < n; i++)
		y[i] *= w[i];
	return 0;
}

double CT_SIMD_HERE(ct_vector_correct)(size_t n, const struct ct_vector *v)
{
	float *restrict y = v->y;
	const float *restrict x = v->x;
	const float *restrict w = v->w;
	for (size_t i = 0; i < n; i++)
		y[i] += w[i] * x[i];
	for (size_t i = 0; i < n && v->c > 0; i++)
		y[i] = y[i] > 0 ? y[i] : 0;
	return 0;
}
