/* The error to expect of a solver: G against its formula, of ramps and of noise; what it becomes;
 * the table; any number of threads. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "numbers.h"
#include "estimate/expected.h"
#include "inverse/upsample.h"
#include "core/rng.h"
#include "quality/calibration.h"
#include "tap.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static const double millimetres[3] = {0.5, 0.8, 2};
static struct ct_env quiet;

static float *gradient(const float *x, const size_t n[3], const struct ct_degrade *by)
{
	float *g = malloc(n[0] * n[1] * n[2] * sizeof *g);

	if (!g)
		exit(99);
	must(ct_expected_gradient(g, x, n, millimetres, by, &quiet, &err));
	return g;
}

/* Of a slope along one axis G is its square in voxels of the scan, but at the two faces, where one
 * neighbour is missing. */
static void test_ramp(void)
{
	static const struct {
		struct ct_degrade by;
		double w[3];
	} c[] = {{.by.factor = {4, 3, 2.5}, .w = {4, 3, 2.5}},
		/* half of 4 voxels of 2 mm, in voxels of .5 and .8 */
		{.by.factor = {1, 1, 4}, .w = {8, 5, 4}},
		{.by.factor = {2, 1, 2}, .w = {2, 0.625, 2}}};
	const size_t n[3] = {24, 22, 20}, stride[3] = {1, 24, 24 * 22}, count = 24 * 22 * 20;
	float *x = malloc(count * sizeof *x), *g;
	double worst = 0, face = 0;

	for (size_t q = 0; q < sizeof c / sizeof *c; q++)
		for (int a = 0; a < 3; a++) {
			const size_t middle = 10 * (stride[0] + stride[1] + stride[2]);

			for (size_t i = 0; i < count; i++)
				x[i] = 7 * (float)(i / stride[a] % n[a]) - 900;
			g = gradient(x, n, &c[q].by);
			worst = fmax(worst, fabs((double)g[middle] / pow(7 * c[q].w[a], 2) - 1));
			/* the window there is 1 at the face, exp(-t^2 / 2) of the others */
			if (q == 1 && a == 0)
				face = (double)g[10 * (stride[1] + stride[2])] / (49 * 64);
			free(g);
		}
	OK(worst < 1e-6, "a ramp: its slope in voxels of the scan (%.2g)", worst);
	OK(fabs(face - (0.5 + exp(-2)) / (1 + exp(-2))) < 1e-6, "half of it at a face (%.6g)",
		face);
	free(x);
}

/* The same in double and along whole axes. */
static void plain(double *to, const float *x, const size_t n[3], const struct ct_degrade *by)
{
	const size_t stride[3] = {1, n[0], n[0] * n[1]}, count = n[0] * n[1] * n[2];
	double *from = malloc(count * sizeof *from);

	if (!from)
		exit(99);
	for (size_t i = 0; i < count; i++) {
		to[i] = 0;
		for (int a = 0; a < 3; a++) {
			const size_t at = i / stride[a] % n[a];
			const double w = by->factor[a] > 1 ? by->factor[a]
							   : 0.5 * by->factor[2] * millimetres[2] /
								     millimetres[a];

			if (at + 1 < n[a])
				to[i] +=
					w * w / 2 * pow((double)x[i + stride[a]] - (double)x[i], 2);
			if (at > 0)
				to[i] +=
					w * w / 2 * pow((double)x[i] - (double)x[i - stride[a]], 2);
		}
	}
	for (int a = 0; a < 3; a++) {
		const double sd = by->factor[a] / 2;

		memcpy(from, to, count * sizeof *from);
		for (size_t i = 0; i < count; i++) {
			double all = 0, sum = 0;

			for (size_t q = 0; q < n[a]; q++) {
				const double t = (double)q - (double)(i / stride[a] % n[a]);
				const double w =
					fabs(t) <= 2 * sd ? exp(-t * t / (2 * sd * sd)) : 0;

				all += w;
				sum += w * from[i % stride[a] + q * stride[a] +
						   i / stride[a] / n[a] * n[a] * stride[a]];
			}
			to[i] = sum / all;
		}
	}
	free(from);
}

static void test_noise(void)
{
	static const struct ct_degrade by[] = {{.factor = {3, 3, 3}}, {.factor = {1, 2.5, 4}}};
	static const size_t size[][3] = {{300, 9, 5}, {5, 70, 34}, {3, 2, 1}};
	double worst = 0;
	bool same = true;

	for (int k = 0; k < 6; k++) {
		const size_t *n = size[k / 2], count = n[0] * n[1] * n[2];
		float *x = normals(count, 4, (uint64_t)k, 100), *g = gradient(x, n, &by[k % 2]), *h;
		double *want = malloc(count * sizeof *want);

		if (!want)
			exit(99);
		plain(want, x, n, &by[k % 2]);
		for (size_t i = 0; i < count; i++)
			worst = fmax(worst, fabs((double)g[i] - want[i]) / (1 + want[i]));
		must(ct_par_alloc(&quiet.par, 3, &err));
		h = gradient(x, n, &by[k % 2]);
		same = same && memcmp(g, h, count * sizeof *g) == 0;
		ct_par_free(quiet.par);
		quiet.par = NULL;
		free(want);
		free(x);
		free(g);
		free(h);
	}
	OK(worst < 1e-5, "noise: the formula, across boxes and small volumes (%.2g)", worst);
	OK(same, "any number of threads: the same bytes");
}

static void test_variance(void)
{
	static const struct ct_expected k = {{3, 0.5, 0.25, 2, 0.125}};
	static const struct ct_expected none = {{0}};

	OK(fabs(ct_expected_deviation(&k, 64, 8) - sqrt(3 + 32 + 16 + 16 + 8)) < 1e-12,
		"a + b n^2 + c G + (d + e n) sqrt(G)");
	OK(ct_expected_deviation(&none, 64, 8) == 1, "and no less than 1 HU");
}

/* Noise is little beside the rest, or tells by what it adds to the slope alone. */
static bool steep(enum ct_expected_kind kind, double factor)
{
	return factor == 8 || (factor == 4 && kind == CT_EXPECTED_POINTS);
}

static void test_table(void)
{
	static const double known[] = {2, 3, 4, 8};
	bool grows = true, noisy = true, ends = true, between = true;

	for (int kind = 0; kind < CT_EXPECTED_KINDS; kind++) {
		const enum ct_expected_kind of = (enum ct_expected_kind)kind;
		struct ct_expected low = ct_expected_find(of, 4), high = ct_expected_find(of, 8);
		struct ct_expected r = ct_expected_find(of, 5);
		double last = 0;

		for (int t = 0; t < CT_EXPECTED_TERMS; t++)
			between = between && fabs(r.k[t] - low.k[t] -
						     (high.k[t] - low.k[t]) * log2(1.25)) < 1e-9;
		for (int f = 0; f < 4; f++) {
			r = ct_expected_find(of, known[f]);
			noisy = noisy && ct_expected_deviation(&r, 1e4, 20) + steep(of, known[f]) >
						 ct_expected_deviation(&r, 1e4, 0);
			if (known[f] ==
				3) /* of points of an odd factor, which are no means of two */
				continue;
			grows = grows && ct_expected_deviation(&r, 1e4, 0) > last;
			last = ct_expected_deviation(&r, 1e4, 0);
		}
		r = ct_expected_find(of, 16);
		ends = ends && memcmp(&r, &high, sizeof r) == 0;
		low = ct_expected_find(of, 2);
		r = ct_expected_find(of, 1.2);
		ends = ends && memcmp(&r, &low, sizeof r) == 0;
	}
	OK(grows, "where the volume varies more is left open of larger factors");
	OK(noisy, "and of noisy scans");
	OK(between && ends, "between two factors and beyond the last");
}

static void test_error(void)
{
	static const struct {
		struct ct_degrade by;
		double aliasing;
		enum ct_expected_kind kind;
	} c[] = {{{{2, 2, 2}, {1, 1, 1}, CT_DECIMATE_SINC, {0}}, 0, CT_EXPECTED_WELL},
		{{{1, 4, 1}, {0, 1.7, 0}, CT_DECIMATE_SINC, {0}}, 0, CT_EXPECTED_WELL_THICK},
		{{{1, 4, 4}, {0}, CT_DECIMATE_POINT, {0}}, 0.7, CT_EXPECTED_POINTS},
		{{{1, 4, 1}, {0}, CT_DECIMATE_POINT, {0}}, 0.7, CT_EXPECTED_POINTS_THICK},
		{{{2, 2, 2}, {0}, CT_DECIMATE_MEAN, {0}}, 0.18, CT_EXPECTED_MEANS},
		{{{1, 4, 4}, {0}, CT_DECIMATE_MEAN, {0}}, 0.2, CT_EXPECTED_MEANS},
		{{{1, 1, 8}, {0}, CT_DECIMATE_MEAN, {0}}, 0.3, CT_EXPECTED_MEANS_THICK},
		{{{4, 4, 4}, {2, 2, 2}, CT_DECIMATE_POINT, {0}}, 0.02, CT_EXPECTED_WELL}};
	const size_t n[3] = {32, 32, 32}, count = 32 * 32 * 32;
	bool kinds = true, errors = true;
	struct ct_vol x = {0};
	float *std = malloc(count * sizeof *std);

	must(ct_vol_alloc(&x, n, &err));
	ct_rng_normals(count, x.data, 1, 1, 0);
	for (size_t i = 0; i < count; i++)
		x.data[i] *= 100 * (float)(i % 16 > 6);
	for (int a = 0; a < 3; a++)
		x.affine[a][a] = millimetres[a];
	for (size_t q = 0; q < sizeof c / sizeof *c; q++) {
		const double *f = c[q].by.factor;
		const struct ct_expected k =
			ct_expected_find(c[q].kind, fmax(fmax(f[0], f[1]), f[2]));
		float *g = gradient(x.data, n, &c[q].by);

		kinds = kinds && ct_expected_kind_of(&c[q].by, c[q].aliasing) == c[q].kind;
		must(ct_expected_error(std, &x, &c[q].by, 9, &quiet, &err));
		for (size_t i = 0; i < count; i++)
			errors = errors &&
				 std[i] == (float)ct_expected_deviation(&k, (double)g[i], 9);
		free(g);
	}
	OK(kinds, "what the errors go with");
	OK(errors, "of a volume: that of its operator, its factor and the noise");
	free(std);
	ct_vol_free(&x);
}

/* Expected against actual errors: those that are normal, by tenths, ties, masks, what is refused.
 */

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
	OK(ct_calibration(&c, &ref, &test, &std, NULL, &err) == -1 && err.code == CT_EINPUT,
		"a std of 0 is refused: %s", err.msg);
	std.data[N + 2] = NAN;
	OK(ct_calibration(&c, &ref, &test, &std, NULL, &err) == -1 && err.code == CT_ENUMERIC,
		"and one that is none");
	std.n[2]--;
	OK(ct_calibration(&c, &ref, &test, &std, NULL, &err) == -1 && err.code == CT_EGEOM,
		"and another grid: %s", err.msg);
	std.n[2]++;
}

static void t_calibration(void)
{
	static const size_t n[3] = {N, N, N};

	if (ct_vol_alloc(&ref, n, &err) || ct_vol_alloc(&test, n, &err) ||
		ct_vol_alloc(&std, n, &err) || ct_vol_alloc(&mask, n, &err))
		exit(99);
	normal();
	special();
	ct_vol_free(&ref);
	ct_vol_free(&test);
	ct_vol_free(&std);
	ct_vol_free(&mask);
}

int main(void)
{
	test_ramp();
	test_noise();
	test_variance();
	test_table();
	test_error();
	t_calibration();
	return tap_done();
}
