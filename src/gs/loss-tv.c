/* loss-tv.c: total variation of a block of the volume, of 32^3 voxels as published; see loss.h.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "gs/loss.h"

#include <string.h>

struct tv {
	float *df;
	double *part; /* of every slice */
	const float *f, *base;
	const size_t *n, *grid;
	size_t pitch;
	float weight;
};

/* The gradient in a slice, and the sum of the differences that begin in it: those to the slices on
 * both sides are taken from both. */
static void tv_slice(void *arg, size_t k, size_t worker)
{
	const struct tv *t = arg;
	const size_t *n = t->n, up = t->pitch * n[1], row = t->grid[0], bup = row * t->grid[1];
	double sum = 0;

	(void)worker;
	memset(t->df + k * up, 0, up * sizeof *t->df);
	for (size_t r = k * n[1]; r < (k + 1) * n[1]; r++) {
		float *d = t->df + r * t->pitch;
		const float *a = t->f + r * t->pitch;
		const float *b = t->base ? t->base + k * bup + r % n[1] * row : NULL;

		sum += CT_SIMD(ct_loss_row_tv)(
			d, d + 1, a, a + 1, b, b ? b + 1 : NULL, n[0] - 1, t->weight);
		if (r + 1 < (k + 1) * n[1])
			sum += CT_SIMD(ct_loss_row_tv)(d, d + t->pitch, a, a + t->pitch, b,
				b ? b + row : NULL, n[0], t->weight);
		if (k + 1 < n[2])
			sum += CT_SIMD(ct_loss_row_tv)(
				d, NULL, a, a + up, b, b ? b + bup : NULL, n[0], t->weight);
		if (k > 0)
			CT_SIMD(ct_loss_row_tv)
		(NULL, d, a - up, a, b ? b - bup : NULL, b, n[0], t->weight);
	}
	t->part[k] = sum;
}

double ct_loss_tv_gradient(float *df, double *part, const float *f, size_t pitch, const float *base,
	const size_t grid[static 3], const size_t n[static 3], double weight, struct ct_par *par)
{
	size_t count =
		(n[0] - 1) * n[1] * n[2] + n[0] * (n[1] - 1) * n[2] + n[0] * n[1] * (n[2] - 1);
	struct tv t = {.df = df,
		.part = part,
		.f = f,
		.base = base,
		.n = n,
		.grid = grid,
		.pitch = pitch,
		.weight = count ? (float)(weight / (double)count) : 0};
	double sum = 0;

	ct_par_for(par, n[2], tv_slice, &t);
	for (size_t k = 0; k < n[2]; k++)
		sum += part[k];
	return count ? sum / (double)count : 0;
}
