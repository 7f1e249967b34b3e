/* Algebra of both measurement operators, and what the matched one does to known pictures.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "operator/degrade.h"
#include "numbers.h"
#include "pinv.h"

#include <stdlib.h>
#include <string.h>

enum { H = 6, W = 10, S = 4, NY = H * W, NX = NY * S * S, NT = NY * (S + 2) };

static int forward(void *op, float *y, size_t parts, const float *x, const struct ct_env *env,
	struct ct_err *e)
{
	static double t[NT];

	(void)parts, (void)env, (void)e;
	ct_measurement_forward(op, y, x, t);
	return 0;
}

static int adjoint(void *op, float *x, size_t parts, const float *y, const struct ct_env *env,
	struct ct_err *e)
{
	static double t[NT];

	(void)parts, (void)env, (void)e;
	ct_measurement_adjoint(op, x, y, t);
	return 0;
}

/* The range-null step. */
static void range_null(const struct ct_measurement *op, float *x, const float *y, double *t)
{
	static double cy[NY], c[NY];

	ct_measurement_data(op, cy, y, t);
	ct_measurement_pull(op, 1, x, x, cy, c, t);
}

static void test_algebra(const struct ct_measurement *op, const char *name)
{
	static float x[NX], back[NX], y[NY], ax[NY], z[NY];
	static double t[NT];
	struct ct_linear a = {NX, 1, NY, forward, adjoint, (void *)(uintptr_t)op};

	printf("# %s\n", name);
	OK(ct_measurement_scratch(op) <= NT, "scratch");
	ct_rng_normals(NX, x, 1, 1, 0);
	ct_rng_normals(NY, y, 1, 2, 0);
	OK(adjoint_error(&a) < 1e-6, "<A x, y> = <x, A^T y>");
	ct_measurement_forward(op, ax, x, t);
	measurement_pinv(op, back, ax, t);
	ct_measurement_forward(op, z, back, t);
	NEAR(maxdiff(NY, z, ax), 0, 2e-6, "A A+ A = A");
	range_null(op, x, y, t);
	ct_measurement_forward(op, ax, x, t);
	measurement_pinv(op, back, y, t);
	ct_measurement_forward(op, z, back, t);
	NEAR(maxdiff(NY, ax, z), 0, 5e-6, "the corrected x agrees with y");
	memcpy(back, x, sizeof x);
	range_null(op, x, y, t);
	NEAR(maxdiff(NX, x, back), 0, 5e-6, "a second correction changes nothing");
}

/* c S is U A x, so S^2 c comes from A^T A: the parts fit together. */
static void test_svd(const struct ct_measurement *op, const char *name)
{
	static float x[NX], y[NY], back[NX];
	static double t[NT], c[NY], d[NY];
	double bad = 0, norm = 0;

	ct_rng_normals(NX, x, 3, 1, 0);
	ct_measurement_analyse(op, c, x, t);
	ct_measurement_forward(op, y, x, t);
	ct_measurement_data(op, d, y, t);
	for (size_t i = 0; i < NY; i++)
		if (ct_measurement_singular(op, i) > 0)
			bad = fmax(bad, fabs(c[i] - d[i]));
	NEAR(bad, 0, 1e-3, name);
	memset(back, 0, sizeof back);
	ct_measurement_synth_add(op, back, c, t);
	for (size_t i = 0; i < NY; i++)
		norm += c[i] * c[i];
	NEAR(dot(NX, back, back) / norm, 1, 1e-6, "and the right vectors are orthonormal");
}

static void test_pictures(const struct ct_measurement *op, double sigma)
{
	static float x[NX], y[NY], want[NY];
	static double t[NT];

	for (size_t i = 0; i < NX; i++)
		x[i] = 2.5f;
	ct_measurement_forward(op, y, x, t);
	for (size_t i = 0; i < NY; i++)
		want[i] = 2.5f;
	NEAR(maxdiff(NY, y, want), 0, 1e-6, "a constant stays");
	/* A mirrored wave of the rows: sampled at the cell centres, weakened as the Gaussian says.
	 */
	for (size_t i = 0; i < NX; i++)
		x[i] = (float)cos(M_PI * 4 * ((double)(i % (S * W)) + 0.5) / (S * W));
	for (size_t i = 0; i < NY; i++)
		want[i] =
			(float)(exp(-2 * M_PI * M_PI * sigma * sigma * pow(4.0 / (2 * S * W), 2)) *
				cos(M_PI * 4 * ((double)(i % W) + 0.5) / W));
	ct_measurement_forward(op, y, x, t);
	NEAR(maxdiff(NY, y, want), 0, 5e-4, "a wave is sampled at the centres and weakened");
	for (size_t i = 0; i < NX; i++)
		x[i] = (float)cos(M_PI * (W + 3) * ((double)(i % (S * W)) + 0.5) / (S * W));
	ct_measurement_forward(op, y, x, t);
	memset(want, 0, sizeof want);
	NEAR(maxdiff(NY, y, want), 0, 1e-6, "nothing is aliased");
}

/* A Gaussian far from the edges is a Gaussian of variance sigma^2 + sigma_0^2. */
static void test_gaussian(void)
{
	enum { N = 24 };
	static float x[N * S * N * S], y[N * N];
	static double t[N * N * (S + 2)];
	const double s0 = 5.0, sigma = 3.0, v = s0 * s0 + sigma * sigma, at = 50.3;
	struct ct_measurement op = {0};
	struct ct_err e = {0};
	double bad = 0;

	if (ct_measurement_alloc(&op, CT_MEASUREMENT_MATCHED, N, N, S, sigma, &e))
		exit(99);
	for (size_t i = 0; i < N * S; i++)
		for (size_t j = 0; j < N * S; j++)
			x[i * N * S + j] = (float)exp(
				-(pow((double)i - at, 2) + pow((double)j - at, 2)) / (2 * s0 * s0));
	ct_measurement_forward(&op, y, x, t);
	for (size_t i = 0; i < N; i++)
		for (size_t j = 0; j < N;
			j++) { /* coarse pixel j has its centre at s j + (s-1)/2 */
			double p = S * (double)i + 1.5 - at, q = S * (double)j + 1.5 - at;

			bad = fmax(bad, fabs((double)y[i * N + j] -
						s0 * s0 / v * exp(-(p * p + q * q) / (2 * v))));
		}
	NEAR(bad, 0, 5e-4, "a Gaussian blurs as on paper");
	ct_measurement_free(&op);
}

/* One line through ct-degrade's table and through ours: the same operator. */
static void test_degrade(double sigma)
{
	enum { N = 16 };
	static float x[N * S * S], y[N];
	static double t[N * (S + 2) * S];
	struct ct_measurement op = {0};
	struct ct_taps taps = {0};
	struct ct_err e = {0};
	double bad = 0;

	if (ct_measurement_alloc(&op, CT_MEASUREMENT_MATCHED, 1, N, S, sigma, &e) ||
		ct_degrade_taps(&taps, N * S, S, sigma, CT_DECIMATE_SINC, &e))
		exit(99);
	ct_rng_normals(N * S, x, 6, 0, 0);
	for (size_t r = 1; r < S; r++) /* equal rows: the other axis has nothing to do */
		memcpy(x + r * N * S, x, N * S * sizeof *x);
	ct_measurement_forward(&op, y, x, t);
	for (size_t i = 0; i < N; i++) {
		double sum = 0;

		for (size_t k = 0; k < taps.taps; k++)
			sum += taps.w[i * taps.taps + k] * (double)x[taps.first[i] + k];
		bad = fmax(bad, fabs(sum - (double)y[i]));
	}
	NEAR(bad, 0, 1e-6, "what ct-degrade does to a line");
	ct_taps_free(&taps);
	ct_measurement_free(&op);
}

/* Coefficients of frequencies that are not measured are 0, whatever y has there. */
static void test_lost(const struct ct_measurement *op)
{
	static double t[NT], c[NY];
	static float y[NY];
	size_t lost = 0, other = 0;

	ct_rng_normals(NY, y, 7, 0, 0);
	ct_measurement_data(op, c, y, t);
	for (size_t i = 0; i < NY; i++) {
		double s = ct_measurement_singular(op, i);

		lost += s <= 0;
		other += (s <= 0) != (fabs(c[i]) <= 0);
	}
	OK(lost > 0 && lost < NY && other == 0, "%zu of %d are lost, no data of these", lost, NY);
}

/* Rows longer than what is summed at once. */
static void test_wide(void)
{
	enum { M = 80, N = M * S };
	static float x[S * N], y[M], back[M];
	static double t[M * (S + 2)];
	struct ct_measurement op = {0};
	struct ct_err e = {0};

	if (ct_measurement_alloc(&op, CT_MEASUREMENT_MATCHED, 1, M, S, 1.7, &e))
		exit(99);
	ct_rng_normals(M, y, 8, 0, 0);
	measurement_pinv(&op, x, y, t);
	ct_measurement_forward(&op, back, x, t);
	NEAR(maxdiff(M, back, y), 0, 2e-5, "A A+ y = y of 320 pixels a row");
	ct_measurement_free(&op);
	OK(!op.h && !op.rows.u && !op.cols.u, "nothing is left");
}

static void test_refused(size_t h, size_t w, size_t s, double sigma, enum ct_code code)
{
	struct ct_measurement op = {0};
	struct ct_err e = {0};

	OK(ct_measurement_alloc(&op, CT_MEASUREMENT_MATCHED, h, w, s, sigma, &e) == -1 &&
			e.code == code,
		"%zu x %zu by %zu, sigma %g: %s", w, h, s, sigma, e.msg);
}

/* Algebra of the block-mean operator: properties, not stored numbers. */

static void t_block_mean(void)
{
	const struct ct_measurement op = {
		.kind = CT_MEASUREMENT_MEAN, .h = H, .w = W, .s = S, .high = S * H, .wide = S * W};
	float x[NX], x0[NX], up[NX], y[NY], ax[NY + 1];
	double c[NY], d[NY], cc = 0, cd = 0;

	ct_rng_normals(NX, x, 1, 1, 0);
	ct_rng_normals(NY, y, 1, 2, 0);
	memcpy(x0, x, sizeof x);

	block_mean_pinv(H, W, S, up, y);
	ct_measurement_forward(&op, ax, up, NULL);
	NEAR(maxdiff(NY, ax, y), 0, 1e-7, "A A+ = I");

	ax[NY] = 7;
	ct_measurement_forward(&op, ax, x, NULL);
	OK(ax[NY] == 7, "no more than (h,w) is written"); /* NOLINT: as it was */
	NEAR(dot(NY, ax, y), dot(NX, x, up) / (S * S), 1e-5, "<Ax, y> = <x, A+ y> / s^2");

	ct_measurement_data(&op, d, y, NULL);
	ct_measurement_pull(&op, 0, x, x, d, c, NULL);
	OK(memcmp(x, x0, sizeof x) == 0, "a pull of 0 leaves x as it was");

	ct_measurement_pull(&op, 1, x, x, d, c, NULL);
	ct_measurement_forward(&op, ax, x, NULL);
	NEAR(maxdiff(NY, ax, y), 0, 1e-6, "a pull of 1 makes A x = y");
	NEAR((double)(x[1] - x[0]), (double)(x0[1] - x0[0]), 1e-6, "the null space is not touched");

	ct_measurement_analyse(&op, c, x, NULL);
	memset(up, 0, sizeof up);
	ct_measurement_synth_add(&op, up, c, NULL);
	ct_measurement_analyse(&op, d, up, NULL);
	for (int i = 0; i < NY; i++) {
		cc += c[i] * c[i];
		cd = fmax(cd, fabs(c[i] - d[i]));
	}
	NEAR(cd, 0, 1e-6, "analysis undoes synthesis");
	NEAR(dot(NX, up, up) / cc, 1, 1e-6, "the block vectors are orthonormal");
	ct_measurement_forward(&op, ax, x, NULL);
	NEAR((double)ax[7] * S, c[7], 1e-6, "coefficients are s times the means");
}

int main(void)
{
	struct ct_measurement mean = {0}, fine = {0}, wide = {0}, big = {0};
	struct ct_err e = {0};
	size_t lost = 0;

	if (ct_measurement_alloc(&mean, CT_MEASUREMENT_MEAN, H, W, S, 0, &e) ||
		ct_measurement_alloc(&fine, CT_MEASUREMENT_MATCHED, H, W, S, 1.7, &e) ||
		ct_measurement_alloc(&wide, CT_MEASUREMENT_MATCHED, H, W, S, 8, &e))
		exit(99);
	test_algebra(&mean, "block mean");
	test_svd(&mean, "block mean: coefficients of A+ A x");
	test_algebra(&fine, "matched");
	test_svd(&fine, "matched: coefficients of A+ A x");
	test_pictures(&fine, 1.7);
	test_algebra(&wide, "a blur that loses frequencies");
	for (size_t i = 0; i < NY; i++)
		lost += ct_measurement_singular(&wide, i) <= 0;
	OK(lost > 0 && lost < NY, "some are lost, not all");
	test_lost(&wide);
	test_wide();
	test_refused(0, 4, 2, 1, CT_EGEOM);
	test_refused(4, 0, 2, 1, CT_EGEOM);
	test_refused(4, 4, 0, 1, CT_EGEOM);
	test_refused(4, 1025, 1, 1, CT_EGEOM);
	test_refused(4, 4, 2, -0.1, CT_EUSAGE);
	test_refused(4, 4, 2, 10001, CT_EUSAGE);
	test_refused(4, 4, 2, (double)NAN, CT_EUSAGE);
	OK(ct_measurement_alloc(&big, CT_MEASUREMENT_MATCHED, 1024, 1, 1, 0, &e) == 0,
		"the longest line");
	ct_measurement_free(&big);
	test_gaussian();
	test_degrade(S / 2.3548);
	test_degrade(0.5);
	test_degrade(0);
	OK(ct_measurement_alloc(&big, CT_MEASUREMENT_MATCHED, 10, 5000, 4, 1, &e) &&
			e.code == CT_EGEOM,
		"a line too long is refused");
	ct_measurement_free(&mean);
	ct_measurement_free(&fine);
	ct_measurement_free(&wide);
	t_block_mean();
	return tap_done();
}
