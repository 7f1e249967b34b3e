/* rof-row.c: see rof-row.h. */
#include "config.h"
#include "recon/rof-row.h"
#include "core/vec.h"

#include <math.h>

/* x -= a, or nothing. */
CT_INLINE void take(size_t n, float *restrict x, const float *restrict a)
{
	for (size_t i = 0; i < n && a; i++)
		x[i] -= a[i];
}

void CT_SIMD_HERE(ct_rof_row_primal)(
	size_t n, const struct ct_rof_row *r, float mu, bool nonnegative)
{
	const float *restrict p = r->p[0], *restrict q = r->p[1], *restrict s = r->p[2];
	const float *restrict v = r->v;
	float *restrict x = r->x;

	for (size_t i = 0; i < n; i++)
		x[i] = p[i] + q[i] + s[i];
	take(n - 1, x + 1, p);
	take(n, x, r->before[1]);
	take(n, x, r->before[2]);
	for (size_t i = 0; i < n; i++)
		x[i] = v[i] + mu * x[i];
	for (size_t i = 0; i < n && nonnegative; i++)
		x[i] = x[i] > 0 ? x[i] : 0;
}

/* Voxels whose neighbours are at x1, xj, xk. */
CT_INLINE void ascend(size_t n, const struct ct_rof_row *r, size_t from, const float *x1,
	const float *xj, const float *xk, float step)
{
	float *restrict p = r->p[0] + from, *restrict q = r->p[1] + from,
			*restrict s = r->p[2] + from;
	const float *x = r->x + from;

#pragma GCC ivdep
	for (size_t i = 0; i < n; i++) {
		float a = p[i] + step * (x1[i] - x[i]), b = q[i] + step * (xj[i] - x[i]);
		float c = s[i] + step * (xk[i] - x[i]), norm = a * a + b * b + c * c;
		float scale = 1 / sqrtf(norm > 1 ? norm : 1);

		p[i] = scale * a;
		q[i] = scale * b;
		s[i] = scale * c;
	}
}

void CT_SIMD_HERE(ct_rof_row_dual)(size_t n, const struct ct_rof_row *r, float step)
{
	const float *x = r->x, *xj = r->after[1] ? r->after[1] : x;
	const float *xk = r->after[2] ? r->after[2] : x;

	ascend(n - 1, r, 0, x + 1, xj, xk, step);
	ascend(1, r, n - 1, x + n - 1, xj + n - 1, xk + n - 1, step);
}
