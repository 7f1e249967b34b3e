/* block-weights.c: see block-weights.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "restore/block-weights.h"

#include <math.h>

/* Of the m blocks of s voxels along an axis, that whose centre is the last one at voxel i or before
 * it; *part: how much of the way to the next it is. */
static size_t between(double *part, size_t i, size_t s, size_t m)
{
	const double at = ((double)i + 0.5) / (double)s - 0.5;
	const double within = fmin(fmax(at, 0), (double)(m - 1));

	*part = within - floor(within);
	return (size_t)within;
}

void ct_block_weights_row(const struct ct_block_weights *w, size_t j, size_t k)
{
	double part[3];
	const size_t c = between(&part[2], k, w->s, w->m[2]);
	const size_t b = between(&part[1], j, w->s, w->m[1]);
	const size_t up = part[2] > 0 ? w->m[0] * w->m[1] : 0, on = part[1] > 0 ? w->m[0] : 0;

	for (size_t a = 0; a < w->m[0]; a++) {
		const float *q = w->w + (c * w->m[1] + b) * w->m[0] + a;

		w->row[a] = (float)((1 - part[2]) * ((1 - part[1]) * (double)q[0] +
							    part[1] * (double)q[on]) +
				    part[2] * ((1 - part[1]) * (double)q[up] +
						      part[1] * (double)q[up + on]));
	}
}

void ct_block_weights_apply(
	double *sum, float *h, size_t n, double axes, const struct ct_block_weights *w)
{
	for (size_t i = 0; i < n; i++) {
		double part;
		const size_t a = between(&part, i, w->s, w->m[0]);
		const double next = part > 0 ? (double)w->row[a + 1] : 0;
		const double more =
			((1 - part) * (double)w->row[a] + part * next) * (double)h[i] / axes;

		h[i] = (float)more;
		*sum += more * more;
	}
}
