/* The data residual: residuals that are known, order statistics, and grids that do not fit.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "quality/data-residual.h"
#include "tap.h"

#include <stdlib.h>
#include <string.h>

static const size_t fine[3] = {26, 21, 17};
static const struct ct_degrade cells = {{4, 3, 2}, {1.1, 0.6, 0}, CT_DECIMATE_MEAN, {0}};

static void make(struct ct_vol *hi, struct ct_vol *lo)
{
	struct ct_separable s = {0};
	struct ct_err e;
	size_t n[3];

	*hi = *lo = (struct ct_vol){0};
	if (ct_vol_alloc(hi, fine, &e) || ct_degrade_plan(&s, &cells, fine, NULL, &e))
		exit(1);
	for (size_t i = 0; i < ct_vol_count(hi); i++)
		hi->data[i] = 500 * ct_rng_normal(1, 0, i);
	for (int a = 0; a < 3; a++)
		n[a] = s.t[a].n_out;
	if (ct_vol_alloc(lo, n, &e))
		exit(1);
	ct_separable_apply(&s, lo->data, hi->data, NULL);
	ct_degrade_affine(lo->affine, hi->affine, fine, &cells);
	ct_separable_free(&s);
}

static void test_residual(void)
{
	struct ct_vol hi, lo, map = {0};
	struct ct_data_residual c, d;
	struct ct_env env = {0}, four = {0};
	struct ct_err e;
	size_t n;

	make(&hi, &lo);
	n = ct_vol_count(&lo);
	OK(ct_data_residual(&c, &map, &lo, &hi, &cells, &env, &e) == 0, "runs");
	OK(c.max == 0 && c.p95 == 0 && c.rms == 0 && c.mean == 0 && c.voxels == n,
		"the volume that was degraded leaves nothing");
	ct_vol_free(&map);
	for (size_t i = 0; i < n; i++)
		lo.data[i] -= i == 3 ? 20.0f : 1.0f;
	ct_data_residual(&c, &map, &lo, &hi, &cells, &env, &e);
	NEAR(c.max, 20, 1e-3, "the largest residual");
	NEAR(c.p95, 1, 1e-3, "most are smaller");
	NEAR(c.mean, 1 + 19.0 / (double)n, 1e-4, "the sign is degraded minus measured");
	NEAR(c.rms, sqrt(1 + 399.0 / (double)n), 1e-4, "root mean square");
	NEAR((double)map.data[3], 20, 1e-3, "the map says where");
	OK(ct_vol_same_grid(&map, &lo, &e) == 0, "on the coarse grid");
	if (ct_par_alloc(&four.par, 4, &e))
		exit(1);
	ct_vol_free(&map);
	ct_data_residual(&d, &map, &lo, &hi, &cells, &four, &e);
	OK(memcmp(&c, &d, sizeof c) == 0, "1 and 4 threads, same bits");
	ct_par_free(four.par);
	ct_vol_free(&map);
	lo.affine[0][3] += 1;
	OK(ct_data_residual(&c, &map, &lo, &hi, &cells, &env, &e) < 0 && e.code == CT_EGEOM,
		"a coarse grid elsewhere is refused");
	ct_vol_free(&map);
	ct_vol_free(&hi);
	ct_vol_free(&lo);
}

static int ascending(const void *a, const void *b)
{
	float x = fabsf(*(const float *)a), y = fabsf(*(const float *)b);

	return (x > y) - (x < y);
}

/* Many ties, ascending, negative, random: selection gives what sorting by size gives. */
static void test_quantile(void)
{
	static const double q[] = {0, 0.05, 0.5, 0.95, 1};
	static float v[1000], sorted[1000];
	double worst = 0;

	for (int kind = 0; kind < 4; kind++)
		for (size_t n = 1; n <= 1000; n = n * 5 / 3 + 1)
			for (size_t k = 0; k < 5; k++) {
				double at = q[k] * (double)(n - 1), part = at - floor(at), want;
				size_t lo = (size_t)at, hi = lo + 1 < n ? lo + 1 : lo;
				double got;

				for (size_t i = 0; i < n; i++)
					v[i] = kind == 0   ? (float)ct_rng_below(3, 0, i, 5)
					       : kind == 1 ? (float)i
					       : kind == 2 ? -(float)i
							   : ct_rng_normal(4, 0, i);
				memcpy(sorted, v, sizeof v);
				qsort(sorted, n, sizeof *sorted, ascending);
				want = fabs((double)sorted[lo]);
				want += part * (fabs((double)sorted[hi]) - want);
				must(ct_data_residual_quantile(&got, v, n, q[k], &err));
				worst = fmax(worst, fabs(got - want));
			}
	OK(worst < 1e-6, "quantiles are those of the sorted values: %.1e", worst);
}

int main(void)
{
	test_residual();
	test_quantile();
	return tap_done();
}
