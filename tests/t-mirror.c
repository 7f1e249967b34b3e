/* A volume and the dual of its variation, mirrored; and the mean of solutions of a scan that is.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "numbers.h"
#include "operator/mirror.h"
#include "inverse/tv.h"
#include "inverse/upsample.h"

#include <string.h>

static const size_t size[3] = {9, 6, 7};
enum { ALL = 9 * 6 * 7, SIDE = 32, ITERATIONS = 40, REST = 4000 };

static size_t mirrored(size_t i, const size_t n[3], unsigned axes)
{
	const size_t at[3] = {i % n[0], i / n[0] % n[1], i / n[0] / n[1]};
	size_t of[3];

	for (int a = 0; a < 3; a++)
		of[a] = axes >> a & 1 ? n[a] - 1 - at[a] : at[a];
	return (of[2] * n[1] + of[1]) * n[0] + of[0];
}

/* Forward differences along the axes, 0 at the last voxels. */
static void differences(int16_t *d, const float *x)
{
	const size_t stride[3] = {1, size[0], size[0] * size[1]};

	for (int a = 0; a < 3; a++)
		for (size_t i = 0; i < ALL; i++)
			*d++ = i / stride[a] % size[a] + 1 < size[a]
				       ? (int16_t)(x[i + stride[a]] - x[i])
				       : 0;
}

static void test_volumes(void)
{
	float x[ALL], y[ALL];
	int16_t want[3 * ALL], got[3 * ALL];
	struct ct_par *par;
	bool volume = true, dual = true, twice = true;

	for (size_t i = 0; i < ALL; i++)
		x[i] = (float)ct_rng_below(1, 2, i, 2000);
	must(ct_par_alloc(&par, 3, &err));
	for (unsigned axes = 0; axes < 8; axes++) {
		memcpy(y, x, sizeof y);
		differences(got, x);
		ct_mirror_volume(y, size, axes, par);
		ct_mirror_dual(got, size, axes, par);
		for (size_t i = 0; i < ALL; i++)
			volume = volume && fabsf(y[i] - x[mirrored(i, size, axes)]) <= 0;
		differences(want, y);
		dual = dual && memcmp(want, got, sizeof got) == 0;
		ct_mirror_volume(y, size, axes, NULL);
		ct_mirror_dual(got, size, axes, NULL);
		differences(want, x);
		twice = twice && memcmp(x, y, sizeof y) == 0 && memcmp(want, got, sizeof got) == 0;
	}
	OK(volume, "a volume is mirrored along any axes");
	OK(dual, "and its differences become those of the mirrored one");
	OK(twice, "twice changes nothing");
	ct_par_free(par);
}

static void solve(struct ct_vol *hi, const struct ct_vol *lo, enum ct_upsample method,
	size_t iterations, bool mirrors)
{
	const struct ct_upsample_rule rule = {.method = method,
		.known = true,
		.by = {{4, 4, 4}, {1.4, 1.4, 1.4}, CT_DECIMATE_SINC, {0}},
		.iterations = iterations,
		.mirrors = mirrors};
	const struct ct_env env = {0};
	struct ct_upsample_report did;

	*hi = (struct ct_vol){0};
	must(ct_upsample(hi, lo, &rule, &did, &env, &err));
	OK(did.iterations == iterations && did.residual < 1e-3,
		"%zu iterations: it agrees with the scan", iterations);
}

/* As it is, and after few iterations nearly, the mean for the scan as it lies and mirrored. */
static void test_mirrors(void)
{
	static const unsigned turns[] = {0, 5, 3, 6};
	const size_t n[3] = {SIDE / 4, SIDE / 4, SIDE / 4}, all = SIDE * SIDE * SIDE;
	const size_t fine[3] = {SIDE, SIDE, SIDE};
	const struct ct_degrade by = {{4, 4, 4}, {1.4, 1.4, 1.4}, CT_DECIMATE_SINC, {0}};
	struct ct_vol lo = {0}, hi = {0}, one;
	float *mean = calloc(all, sizeof *mean);

	must(!mean || ct_vol_alloc(&hi, fine, &err));
	for (size_t i = 0; i < all; i++) {
		const double x = (double)(i % SIDE), y = (double)(i / SIDE % SIDE),
			     z = (double)(i / SIDE / SIDE);

		hi.data[i] = x + 0.6 * y < 22                       ? -1000
			     : hypot(y - 20, z - 14) + 0.3 * x < 18 ? 900
								    : 40;
	}
	for (int a = 0; a < 3; a++)
		hi.affine[a][a] = 1;
	must(ct_degrade_volume(&lo, &hi, &by, 0, 0, NULL, &err));
	ct_vol_free(&hi);
	for (int k = 0; k < 4; k++) {
		ct_mirror_volume(lo.data, n, turns[k], NULL);
		solve(&one, &lo, CT_UPSAMPLE_TV, REST, false);
		ct_mirror_volume(lo.data, n, turns[k], NULL);
		ct_mirror_volume(one.data, fine, turns[k], NULL);
		for (size_t i = 0; i < all; i++)
			mean[i] += one.data[i] / 4;
		if (k < 3)
			ct_vol_free(&one);
	}
	solve(&hi, &lo, CT_UPSAMPLE_TV, REST, true);
	OK(apart(all, hi.data, mean) < 0.05 * apart(all, one.data, mean),
		"the mean for the scan as it lies and mirrored (%.2g of %.2g)",
		apart(all, hi.data, mean), apart(all, one.data, mean));
	ct_vol_free(&hi);
	solve(&hi, &lo, CT_UPSAMPLE_TV, ITERATIONS, true);
	OK(apart(all, hi.data, mean) < 0.25, "each way begins with the dual of that before (%.2g)",
		apart(all, hi.data, mean));
	for (int k = 0; k < 2; k++) {
		ct_vol_free(k ? &one : &hi);
		solve(k ? &one : &hi, &lo, CT_UPSAMPLE_HTV, ITERATIONS, k);
	}
	OK(memcmp(hi.data, one.data, all * sizeof *hi.data) == 0, "only TV has ways");
	ct_vol_free(&hi);
	ct_vol_free(&one);
	ct_vol_free(&lo);
	free(mean);
}

int main(void)
{
	test_volumes();
	test_mirrors();
	return tap_done();
}
