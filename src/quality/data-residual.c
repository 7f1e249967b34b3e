/* data-residual.c: see data-residual.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "quality/data-residual.h"
#include "core/mem.h"
#include "operator/padding.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { HALF_WORDS = 1 << 16 };

/* Bits of |x|, which count up with it. */
static uint32_t bits_of(float x)
{
	uint32_t bits;

	memcpy(&bits, &x, sizeof bits);
	return bits & INT32_MAX;
}

/* The k-th of the sorted absolute values: first the upper half of its bits, then the lower. */
static double nth(const float *v, size_t n, size_t k, uint64_t count[HALF_WORDS])
{
	uint32_t found = 0;
	float value;

	for (int shift = 16; shift >= 0; shift -= 16) {
		size_t bin = 0;

		memset(count, 0, HALF_WORDS * sizeof *count);
		for (size_t i = 0; i < n; i++) {
			const uint32_t bits = bits_of(v[i]);

			count[bits >> shift & (HALF_WORDS - 1)] +=
				shift || bits >> 16 == found >> 16;
		}
		while (k >= count[bin])
			k -= count[bin++];
		found |= (uint32_t)bin << shift;
	}
	memcpy(&value, &found, sizeof value);
	return (double)value;
}

int ct_data_residual_quantile(double *to, const float *v, size_t n, double q, struct ct_err *e)
{
	const double at = q * (double)(n - 1);
	const size_t k = (size_t)at;
	uint64_t *count;

	if (ct_alloc(&count, HALF_WORDS, sizeof *count, e))
		return -1;
	*to = nth(v, n, k, count);
	if (k + 1 < n)
		*to += (at - (double)k) * (nth(v, n, k + 1, count) - *to);
	free(count);
	return 0;
}

/* Slice by slice, so that sums stay exact enough for any size; of n voxels that are not out. */
static int summarise(struct ct_data_residual *c, const struct ct_vol *map, const unsigned char *out,
	size_t n, struct ct_err *e)
{
	const size_t slice = map->n[0] * map->n[1];
	double square = 0, sum = 0;
	float *in;
	int rc;

	*c = (struct ct_data_residual){.voxels = n};
	if (ct_alloc(&in, n, sizeof *in, e))
		return -1;
	n = 0;
	for (size_t k = 0; k < map->n[2]; k++) {
		double s2 = 0, s = 0;

		for (size_t i = k * slice; i < (k + 1) * slice; i++) {
			const double r = (double)map->data[i];

			if (out && out[i])
				continue;
			in[n++] = map->data[i];
			s2 += r * r;
			s += r;
			c->max = fmax(c->max, fabs(r));
		}
		square += s2;
		sum += s;
	}
	c->rms = sqrt(square / (double)n);
	c->mean = sum / (double)n;
	rc = ct_data_residual_quantile(&c->p95, in, n, 0.95, e);
	free(in);
	return rc;
}

/* Padding, and what is beside it, is left out, but if nothing else is left. */
static int summarise_measured(struct ct_data_residual *c, const struct ct_vol *map,
	const struct ct_vol *lr, struct ct_err *e)
{
	const size_t all = ct_vol_count(lr);
	struct ct_padding p;
	int rc;

	if (ct_padding_find(&p, lr->data, lr->n, e) ||
		ct_padding_widen(&p, lr->n, CT_DATA_RESIDUAL_RIM, e))
		return -1;
	rc = p.count < all ? summarise(c, map, p.is, all - p.count, e)
			   : summarise(c, map, NULL, all, e);
	ct_padding_free(&p);
	return rc;
}

int ct_data_residual_operator(struct ct_degrade *d, const struct ct_meta **from,
	const struct ct_meta *lr, const struct ct_meta *hr, struct ct_err *e)
{
	int known;

	*from = ct_meta_get(lr, CT_META_FACTOR) || !ct_meta_get(hr, CT_META_UPSAMPLE) ? lr : hr;
	known = ct_degrade_get(*from, d, e);
	if (known > 0) {
		*from = lr;
		return ct_fail(e, CT_EINPUT,
			"the header names no operator: it needs factor, sigma and decimate, which "
			"ct-degrade writes");
	}
	if (known == 0 && ct_meta_get(lr, CT_META_UPSAMPLE)) {
		*from = lr;
		return ct_fail(e, CT_EINPUT, "is upsampled: give the CT that it was made from");
	}
	return known;
}

/* D, and the grid that test is degraded to: lr's. */
static int plan(struct ct_separable *s, struct ct_vol *grid, const struct ct_vol *lr,
	const struct ct_vol *test, const struct ct_degrade *d, struct ct_par *par, struct ct_err *e)
{
	int axis[2][3], sign[2][3];

	if (ct_degrade_plan(s, d, test->n, par, e))
		return -1;
	for (int a = 0; a < 3; a++)
		grid->n[a] = s->t[a].n_out;
	ct_degrade_affine(grid->affine, test->affine, test->n, d);
	if (ct_vol_same_grid(grid, lr, e) == 0)
		return 0;
	ct_separable_free(s);
	/* what D does along each axis is of the axes of lr, so the grids may differ in size, too */
	ct_vol_axes(lr, axis[0], sign[0]);
	ct_vol_axes(test, axis[1], sign[1]);
	if (memcmp(axis[0], axis[1], sizeof *axis) != 0 ||
		memcmp(sign[0], sign[1], sizeof *sign) != 0)
		return ct_fail(e, CT_EGEOM,
			"its axes are stored in another order or direction than those of the "
			"low-resolution CT; ct-convert --reorient RAS of both makes them one");
	return ct_blame(e, "degraded");
}

int ct_data_residual(struct ct_data_residual *c, struct ct_vol *map, const struct ct_vol *lr,
	const struct ct_vol *test, const struct ct_degrade *d, const struct ct_env *env,
	struct ct_err *e)
{
	struct ct_degrade by = *d;
	struct ct_separable s = {0};
	struct ct_vol grid = {0};
	int rc = -1;

	ct_degrade_take_first(&by, lr, test);
	if (plan(&s, &grid, lr, test, &by, env->par, e))
		return -1;
	if (ct_vol_alloc(map, grid.n, e))
		goto out;
	ct_separable_apply(&s, map->data, test->data, env->par);
	ct_separable_free(&s);
	for (size_t i = 0; i < ct_vol_count(map); i++)
		map->data[i] -= lr->data[i];
	memcpy(map->affine, lr->affine, sizeof map->affine);
	rc = summarise_measured(c, map, lr, e);
out:
	ct_separable_free(&s);
	return rc;
}
