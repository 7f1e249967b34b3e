/* vector.c: see vector.h. */
#include "config.h"
#include "solve/vector.h"
#include "core/vec.h"

#define KERNEL(name)                                                                               \
	double CT_SIMD_HERE(name)(size_t n, float *restrict y, const float *restrict x,            \
		const float *restrict w, double c)

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

KERNEL(ct_vector_dot)
{
	struct ct_sum8 sum = {0};

	(void)y;
	(void)c;
	add_products(&sum, x, w, n);
	return ct_sum8_total(&sum);
}

KERNEL(ct_vector_scale)
{
	const float f = (float)c;

	(void)x;
	(void)w;
	for (size_t i = 0; i < n; i++)
		y[i] *= f;
	return 0;
}

KERNEL(ct_vector_add)
{
	const float f = (float)c;

	(void)w;
	for (size_t i = 0; i < n; i++)
		y[i] += f * x[i];
	return 0;
}

KERNEL(ct_vector_advance)
{
	const float f = (float)c;

	(void)w;
	for (size_t i = 0; i < n; i++)
		y[i] = x[i] + f * y[i];
	return 0;
}

KERNEL(ct_vector_lead)
{
	enum { BLOCK = 256 };
	struct ct_sum8 sum = {0};
	const float f = (float)c;
	float moved[BLOCK];

	(void)w;
	for (size_t from = 0; from < n; from += BLOCK) {
		size_t count = n - from < BLOCK ? n - from : BLOCK;

		for (size_t i = 0; i < count; i++) {
			moved[i] = x[from + i] - y[from + i];
			y[from + i] = x[from + i] + f * moved[i];
		}
		add_products(&sum, moved, moved, count);
	}
	return ct_sum8_total(&sum);
}

KERNEL(ct_vector_less)
{
	(void)w;
	(void)c;
	for (size_t i = 0; i < n; i++)
		y[i] = x[i] - y[i];
	return 0;
}

KERNEL(ct_vector_times)
{
	(void)x;
	(void)c;
	for (size_t i = 0; i < n; i++)
		y[i] *= w[i];
	return 0;
}

KERNEL(ct_vector_correct)
{
	for (size_t i = 0; i < n; i++)
		y[i] += w[i] * x[i];
	for (size_t i = 0; i < n && c > 0; i++)
		y[i] = y[i] > 0 ? y[i] : 0;
	return 0;
}

KERNEL(ct_vector_invert)
{
	(void)x;
	(void)w;
	for (size_t i = 0; i < n; i++)
		y[i] = (double)y[i] > c ? 1 / y[i] : 0;
	return 0;
}
