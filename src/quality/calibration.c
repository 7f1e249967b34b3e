/* calibration.c: see calibration.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "quality/calibration.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { BINS = 1 << 15, ROWS = CT_CALIBRATION_ROWS };

/* The upper half of a positive float counts up with its value. */
static size_t bin_of(float v)
{
	uint32_t bits;

	memcpy(&bits, &v, sizeof bits);
	return bits >> 16;
}

/* In place of the voxels of each bin, `all` together, its row, by the middle of them. */
static void assign(size_t bin[BINS], size_t all)
{
	size_t before = 0;

	for (size_t b = 0; b < BINS; b++) {
		const size_t n = bin[b];

		bin[b] = (size_t)fmin(
			((double)before + 0.5 * (double)n) / (double)all * ROWS, ROWS - 1);
		before += n;
	}
}

static void add(struct ct_calibration_row *r, double miss, double std)
{
	r->voxels++;
	r->expected += std * std;
	r->actual += miss * miss;
	r->within[0] += fabs(miss) <= std;
	r->within[1] += fabs(miss) <= 2 * std;
}

static void finish(struct ct_calibration_row *r)
{
	const double n = (double)r->voxels;

	r->expected = sqrt(r->expected / n);
	r->actual = sqrt(r->actual / n);
	for (int k = 0; k < 2; k++)
		r->within[k] /= n;
}

static int check(const struct ct_vol *ref, const struct ct_vol *test, const struct ct_vol *std,
	const struct ct_vol *mask, struct ct_err *e)
{
	if (ct_vol_same_grid(ref, std, e) || ct_vol_same_grid(ref, test, e) ||
		(mask && ct_vol_same_grid(ref, mask, e)))
		return -1;
	for (size_t i = 0; i < ct_vol_count(std); i++) {
		if (!(std->data[i] > 0 && isfinite(std->data[i])))
			return ct_fail(e, isfinite(std->data[i]) ? CT_EINPUT : CT_ENUMERIC,
				"voxel (%zu,%zu,%zu) is %g, and a predicted error is above 0 HU",
				i % std->n[0], i / std->n[0] % std->n[1], i / std->n[0] / std->n[1],
				(double)std->data[i]);
	}
	return 0;
}

int ct_calibration(struct ct_calibration *c, const struct ct_vol *ref, const struct ct_vol *test,
	const struct ct_vol *std, const struct ct_vol *mask, struct ct_err *e)
{
	const size_t n = ct_vol_count(ref);
	size_t *bin, all = 0;

	*c = (struct ct_calibration){0};
	if (check(ref, test, std, mask, e) || ct_alloc0(&bin, BINS, sizeof *bin, e))
		return -1;
	for (size_t i = 0; i < n; i++) {
		if (!mask || mask->data[i] != 0) {
			bin[bin_of(std->data[i])]++;
			all++;
		}
	}
	assign(bin, all ? all : 1);
	for (size_t i = 0; i < n; i++) {
		const double miss = (double)test->data[i] - (double)ref->data[i];
		const double s = (double)std->data[i];

		if (mask && mask->data[i] == 0)
			continue;
		add(&c->all, miss, s);
		add(&c->row[bin[bin_of(std->data[i])]], miss, s);
	}
	finish(&c->all);
	for (int k = 0; k < ROWS; k++)
		if (c->row[k].voxels)
			finish(&c->row[k]);
	free(bin);
	return 0;
}
