/* rof-row.c: a plane of rof.h, row after row. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "recon/rof.h"
#include "core/vec.h"

#include <math.h>

/* x -= a, or nothing. */
CT_INLINE void take(size_t n, float *restrict x, const float *restrict a)
{
	for (size_t i = 0; i < n && a; i++)
		x[i] -= a[i];
}

/* x = v + mu div p; nonnegative: or 0 where that is below. q and s are p[1] a row and p[2] a plane
 * before, or NULL: 0. p[0] is 0 at the last voxel. */
CT_INLINE void primal(size_t n, const struct ct_rof *r, float *restrict x, const float *restrict v,
	float *const p[3], const float *q, const float *s)
{
	const float *restrict p0 = p[0], *restrict p1 = p[1], *restrict p2 = p[2];

	for (size_t i = 0; i < n; i++)
		x[i] = p0[i] + p1[i] + p2[i];
	take(n - 1, x + 1, p0);
	take(n, x, q);
	take(n, x, s);
	for (size_t i = 0; i < n; i++)
		x[i] = v[i] + r->mu * x[i];
	for (size_t i = 0; i < n && r->nonnegative; i++)
		x[i] = x[i] > 0 ? x[i] : 0;
}

/* p <- p + step grad x, shortened to length 1 where it is longer, from voxel `from` on; the
 * neighbours of x are at y[0], y[1], y[2]. */
CT_INLINE void ascend(size_t n, size_t from, float *const p[3], const float *x,
	const float *const y[3], float step)
{
	float *restrict p0 = p[0] + from, *restrict p1 = p[1] + from, *restrict p2 = p[2] + from;

	CT_SIMD_APART
	for (size_t i = 0; i < n; i++) {
		float a = p0[i] + step * (y[0][from + i] - x[from + i]);
		float b = p1[i] + step * (y[1][from + i] - x[from + i]);
		float c = p2[i] + step * (y[2][from + i] - x[from + i]);
		float norm = a * a + b * b + c * c, scale = 1 / sqrtf(norm > 1 ? norm : 1);

		p0[i] = scale * a;
		p1[i] = scale * b;
		p2[i] = scale * c;
	}
}

void CT_SIMD_HERE(ct_rof_plane)(
	const struct ct_rof *r, float *x, const float *v, bool dual, size_t k)
{
	const size_t *dim = r->dim, w = dim[0], plane = w * dim[1], n = plane * dim[2];

	for (size_t j = 0; j < dim[1]; j++) {
		const size_t at = k * plane + j * w;
		float *const p[3] = {r->p + at, r->p + at + n, r->p + at + 2 * n}, *to = x + at;
		const float *const y[3] = {
			to + 1, j + 1 < dim[1] ? to + w : to, k + 1 < dim[2] ? to + plane : to};

		if (dual) {
			ascend(w - 1, 0, p, to, y, 1 / (12 * r->mu));
			ascend(1, w - 1, p, to, (const float *const[3]){to, y[1], y[2]},
				1 / (12 * r->mu));
		} else {
			primal(w, r, to, v + at, p, j ? p[1] - w : NULL, k ? p[2] - plane : NULL);
		}
	}
}
