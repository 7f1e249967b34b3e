/* Expected against actual errors: those that are normal, by tenths, ties, masks, what is refused.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "core/rng.h"
#include "quality/calibration.h"
#include "tap.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

enum { N = 60, COUNT = N * N * N };
static struct ct_vol ref, test, std, mask;
static struct ct_calibration c;
static struct ct_err err;

static void fill(double times)
{
	for (size_t i = 0; i < COUNT; i++) {
		std.data[i] = 1 + 100 * (float)ct_rng_uniform(1, 0, i);
		ref.data[i] = 1000 * ct_rng_normal(1, 1, i);
		test.data[i] = ref.data[i] + (float)times * std.data[i] * ct_rng_normal(1, 2, i);
		mask.data[i] = i % 3 == 0 ? 2 : 0;
	}
}

static void normal(void)
{
	size_t sum = 0;
	bool level = true, rising = true, within = true;

	fill(1);
	OK(ct_calibration(&c, &ref, &test, &std, NULL, &err) == 0, "normal errors");
	for (int k = 0; k < CT_CALIBRATION_ROWS; k++) {
		const struct ct_calibration_row *r = &c.row[k];

		sum += r->voxels;
		level = level && fabs((double)r->voxels / COUNT - 0.1) < 0.01 &&
			fabs(r->actual / r->expected - 1) < 0.02;
		rising = rising && fabs(r->expected - (6 + 10 * k)) < 1;
		within = within && fabs(r->within[0] - 0.683) < 0.02 &&
			 fabs(r->within[1] - 0.954) < 0.01;
	}
	OK(sum == COUNT && c.all.voxels == COUNT, "every voxel is in one tenth");
	OK(level, "tenths are tenths, their error the expected one");
	OK(rising, "the smallest std first");
	OK(within, "68 and 95 percent within one and two of it");
	OK(fabs(c.all.expected / sqrt(1 + 100 + 1e4 / 3) - 1) < 0.01 &&
			fabs(c.all.within[0] - 0.683) < 0.01,
		"and so in all (%g)", c.all.expected);
	fill(2);
	OK(ct_calibration(&c, &ref, &test, &std, NULL, &err) == 0 &&
			fabs(c.all.actual / c.all.expected - 2) < 0.02 &&
			fabs(c.all.within[0] - 0.383) < 0.01 &&
			fabs(c.all.within[1] - 0.683) < 0.01,
		"errors twice as large are told");
}

static void special(void)
{
	fill(1);
	for (size_t i = 0; i < COUNT; i++)
		if (mask.data[i] == 0)
			test.data[i] += 1e4f;
	OK(ct_calibration(&c, &ref, &test, &std, &mask, &err) == 0 && c.all.voxels == COUNT / 3 &&
			fabs(c.all.actual / c.all.expected - 1) < 0.02,
		"only what the mask has counts");
	for (size_t i = 0; i < COUNT; i++)
		std.data[i] = i % 4 ? 10 : 20;
	OK(ct_calibration(&c, &ref, &test, &std, NULL, &err) == 0 &&
			c.row[3].voxels == COUNT / 4 * 3 && c.row[8].voxels == COUNT / 4 &&
			c.row[0].voxels == 0,
		"voxels of one std stay together");
	std.data[N + 2] = 0;
	OK(ct_calibration(&c, &ref, &test, &std, NULL, &err) == -1 && err.code == CT_ENUMERIC,
		"a std of 0 is refused: %s", err.msg);
	std.data[N + 2] = NAN;
	OK(ct_calibration(&c, &ref, &test, &std, NULL, &err) == -1 && err.code == CT_ENUMERIC,
		"and one that is none");
	std.n[2]--;
	OK(ct_calibration(&c, &ref, &test, &std, NULL, &err) == -1 && err.code == CT_EGEOM,
		"and another grid: %s", err.msg);
	std.n[2]++;
}

int main(void)
{
	static const size_t n[3] = {N, N, N};

	if (ct_vol_alloc(&ref, n, &err) || ct_vol_alloc(&test, n, &err) ||
		ct_vol_alloc(&std, n, &err) || ct_vol_alloc(&mask, n, &err))
		return 1;
	normal();
	special();
	ct_vol_free(&ref);
	ct_vol_free(&test);
	ct_vol_free(&std);
	ct_vol_free(&mask);
	return tap_done();
}
