/* texture.c: how much of a CT is textured; see refine.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "refine/refine.h"
#include "restore/patch.h"

#include <math.h>

#define LOOKS 1e5 /* cells at which texture is looked for */

/* The index `by` on along an axis of n, or the last before the border. */
static size_t on(size_t at, ptrdiff_t by, size_t n)
{
	const ptrdiff_t to = (ptrdiff_t)at + by;

	return to < 0 ? 0 : (size_t)to < n ? (size_t)to : n - 1;
}

/* Does v vary in the square of w x w cells, `step` voxels each, of the slice across the axis? */
static bool is_uneven(
	const struct ct_vol *v, const size_t at[3], const size_t step[3], int axis, ptrdiff_t w)
{
	const int a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;
	const double count = (double)(w * w);
	const double first = (double)v->data[(at[2] * v->n[1] + at[1]) * v->n[0] + at[0]];
	double sum = 0, square = 0;
	size_t p[3] = {at[0], at[1], at[2]};

	for (ptrdiff_t q = 0; q < w * w; q++) {
		double d;

		p[a] = on(at[a], (q % w - w / 2) * (ptrdiff_t)step[a], v->n[a]);
		p[b] = on(at[b], (q / w - w / 2) * (ptrdiff_t)step[b], v->n[b]);
		d = (double)v->data[(p[2] * v->n[1] + p[1]) * v->n[0] + p[0]] - first;
		sum += d;
		square += d * d;
	}
	return square / count - sum / count * (sum / count) >
	       (double)(CT_PATCH_FLAT * CT_PATCH_FLAT);
}

double ct_refine_cells(const struct ct_vol *v, const double factor[3], size_t w)
{
	const double most = fmax(factor[0], fmax(factor[1], factor[2]));
	size_t step[3], skip, count = 0, seen = 0;
	double cells = 1;

	for (int a = 0; a < 3; a++) {
		step[a] = factor[a] > 1 ? 1 : (size_t)fmax(nearbyint(most), 1);
		cells *= (double)v->n[a] / (double)step[a];
	}
	skip = (size_t)fmax(ceil(cbrt(cells / LOOKS)), 1);
	for (size_t k = 0; k < v->n[2]; k += skip * step[2])
		for (size_t j = 0; j < v->n[1]; j += skip * step[1])
			for (size_t i = 0; i < v->n[0]; i += skip * step[0])
				for (int axis = 0; axis < 3; axis++, seen++)
					count += is_uneven(v, (const size_t[3]){i, j, k}, step,
						axis, (ptrdiff_t)w);
	return 3 * cells * (double)count / (double)seen;
}
