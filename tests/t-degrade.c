/* The degradation operator against closed forms. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "core/vol.h"
#include "operator/slice-profile.h"
#include "numbers.h"
#include "separable-pair.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* y = D x along one axis. */
static int line(float *y, const float *x, size_t n, size_t s, double sigma, enum ct_decimate d)
{
	const size_t dims[3] = {n, 1, 1};
	struct ct_taps t = {0};
	double *scratch = NULL;
	int rc = -1;

	if (ct_degrade_taps(&t, n, s, sigma, d, &err) == 0 &&
		ct_alloc(&scratch, ct_taps_scratch(&t, NULL), sizeof *scratch, &err) == 0) {
		ct_taps_apply(y, x, dims, 0, &t, scratch, NULL);
		rc = 0;
	}
	free(scratch);
	ct_taps_free(&t);
	return rc;
}

/* Row i of D over the n voxels of an axis, from the definition in degrade.h: decimation of the N in
 * the middle, and then the Gaussian of each of them. */
static void defined(double *row, size_t i, size_t n, double s, double sigma, enum ct_decimate how)
{
	const size_t m = (size_t)floor((double)n / s + 1e-9),
		     N = (size_t)ceil((double)m * s - 1e-9);
	const ptrdiff_t reach = (ptrdiff_t)floor(4 * sigma + 0.5), last = (ptrdiff_t)N - 1;
	const double from = ((double)N - (double)m * s) / 2 + (double)i * s, mid = from + s / 2;
	double total = 0;

	memset(row, 0, n * sizeof *row);
	for (ptrdiff_t d = -reach; d <= reach; d++)
		total += sigma > 0 ? exp(-(double)(d * d) / (2 * sigma * sigma)) : 1;
	for (size_t k = 0; k < N; k++) {
		double w = 0;

		if (m == N)
			w = k == i;
		else if (how == CT_DECIMATE_MEAN)
			w = fmax(0, fmin((double)k + 1, from + s) - fmax((double)k, from)) / s;
		else if (how == CT_DECIMATE_POINT)
			w = fmax(0, 1 - fabs((double)k + 0.5 - mid));
		else
			for (size_t p = 0; p < m; p++)
				w += (p ? 2.0 : 1.0) / (double)N *
				     cos(M_PI * (double)p * ((double)k + 0.5) / (double)N) *
				     cos(M_PI * (double)p * mid / (double)N);
		for (ptrdiff_t d = -reach; d <= reach; d++) {
			ptrdiff_t at = (ptrdiff_t)k + d;

			while (at < 0 || at > last)
				at = at < 0 ? -1 - at : 2 * last + 1 - at;
			row[(size_t)at + (n - N) / 2] +=
				w / total *
				(sigma > 0 ? exp(-(double)(d * d) / (2 * sigma * sigma)) : 1);
		}
	}
}

static void test_definition(void)
{
	static const double factor[] = {1, 1.5, 2, 2.5, 3, 8.0 / 3, 4, 3.7},
			    sigma[] = {0, 0.1, 0.4, 1.1, 2.34};
	static const size_t size[] = {4, 9, 17, 26};
	double row[26], worst = 0;
	size_t n_out = 0;

	for (size_t c = 0; c < 8 * 5 * 4 * 3; c++) {
		const double s = factor[c % 8], g = sigma[c / 8 % 5];
		const size_t n = size[c / 40 % 4];
		const enum ct_decimate how = (enum ct_decimate)(c / 160);
		struct ct_taps t = {0};

		must(ct_degrade_taps(&t, n, s, g, how, &err));
		n_out += t.n_in == n && t.n_out == (size_t)((double)n / s + 1e-9);
		for (size_t i = 0; i < t.n_out; i++) {
			defined(row, i, n, s, g, how);
			for (size_t q = 0; q < t.taps; q++)
				row[t.first[i] + q] -= t.w[i * t.taps + q];
			for (size_t k = 0; k < n; k++)
				worst = fmax(worst, fabs(row[k]));
		}
		ct_taps_free(&t);
	}
	OK(n_out == 480 && worst < 1e-9, "rows as they are defined, fractions of voxels too (%.2g)",
		worst);
	OK(ct_degrade_size(30, 30 / (10 - 0.8e-6)) == 10 &&
			ct_degrade_size(30, 30 / (10 - 1.2e-6)) == 9 &&
			ct_degrade_cover(10, 3.0000002) == 30 &&
			ct_degrade_cover(10, 3.0000004) == 31,
		"a factor in decimals counts as whole when it nearly is");
	n_out = 0;
	for (size_t n = 8; n < 200; n++)
		for (size_t m = 4; m < n; m++) {
			const double s = (double)((float)n / (float)m) + 1e-8;

			n_out += ct_degrade_cover(ct_degrade_size(n, s), s) > n;
		}
	OK(n_out == 0, "cells stay within the axis: %zu do not", n_out);
}

/* Where the first cell lies, of fractions of voxels too: voxels of 2, 0.5 and 3 mm, turned. */
static void test_place(void)
{
	const double hi[3][4] = {{1.2, -0.4, 0, 10}, {1.6, 0.3, 0, 20}, {0, 0, 3, 30}};
	const struct ct_degrade d = {{2.5, 3, 1.5}, {0}, CT_DECIMATE_MEAN, {0}};
	const size_t n[3] = {
		14, 10, 5}; /* 5 cells in 13; 3 in 9; 3 in 5, each a part from the edge */
	const double first[3] = {0 + 0.25 + 1.25 - 0.5, 0 + 1.5 - 0.5, 0 + 0.25 + 0.75 - 0.5};
	struct ct_vol a = {0}, b = {0};
	double p[3], q[3], mm[3];

	memcpy(a.affine, hi, sizeof hi);
	ct_degrade_affine(b.affine, hi, n, &d);
	ct_vol_world(&a, first, p);
	ct_vol_world(&b, (const double[3]){0, 0, 0}, q);
	ct_vol_spacing(&b, mm);
	OK(hypot(hypot(p[0] - q[0], p[1] - q[1]), p[2] - q[2]) < 1e-12, "the first cell's centre");
	OK(fabs(mm[0] - 5) + fabs(mm[1] - 1.5) + fabs(mm[2] - 4.5) < 1e-12, "and sizes");
}

static void test_limits(void)
{
	static const char *const bad[][3] = {{"1e7", "0", "factor"}, {"4,4,0.9", "0", "factor"},
		{"4", "-0.1", "sigma"}, {"4", "1,1,2e4", "sigma"}, {"4", "x", "sigma"},
		{"x", "0", "factor"}};
	struct ct_degrade d = {{2, 1.5, 1}, {0}, CT_DECIMATE_MEAN, {0}}, got = {0};
	struct ct_taps t = {0};
	struct ct_meta m = {0};
	bool refused = true;

	for (int p = 1; p <= 2; p++) {
		const double per = p == 1 ? 2.3548 : 4;

		ct_degrade_protocol(&d, p);
		OK(fabs(d.sigma[0] - 2 / per) + fabs(d.sigma[1] - 1.5 / per) < 1e-12 &&
				d.sigma[2] == 0 && d.decimate == CT_DECIMATE_SINC,
			"P%d", p);
	}
	OK(ct_degrade_taps(&t, 9, 0.99, 0, d.decimate, &err) < 0 && err.code == CT_EINPUT &&
			ct_degrade_taps(&t, 9, 2e6, 0, d.decimate, &err) < 0 &&
			err.code == CT_EINPUT &&
			ct_degrade_taps(&t, 9, 10, 0, d.decimate, &err) < 0 && err.code == CT_EGEOM,
		"factors that are none");
	OK(ct_degrade_taps(&t, 9, 2, -0.1, d.decimate, &err) < 0 && err.code == CT_EINPUT &&
			ct_degrade_taps(&t, 9, 2, 2e4, d.decimate, &err) < 0 &&
			err.code == CT_EINPUT,
		"and widths");
	for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
		must(ct_meta_set(&m, "factor", bad[k][0], &err) ||
			ct_meta_set(&m, "sigma", bad[k][1], &err));
		refused = refused && ct_degrade_get(&m, &got, &err) < 0 && err.code == CT_EINPUT &&
			  strstr(err.msg, bad[k][2]) && got.factor[0] == 0;
	}
	OK(refused, "in metadata too");
	must(ct_meta_set(&m, "factor", "1,2,1000", &err));
	ct_meta_drop(&m, "sigma");
	got.sigma[1] = 7;
	OK(ct_degrade_get(&m, &got, &err) == 0 && got.factor[2] == 1000 && got.sigma[1] == 0 &&
			got.decimate == CT_DECIMATE_SINC,
		"without blur if none is told");
	ct_meta_free(&m);
}

static void test_constant(void)
{
	static const size_t n[] = {4, 5, 7, 16, 31, 66};
	double worst = 0;
	float x[66], y[66];

	for (size_t i = 0; i < 66; i++)
		x[i] = -1000;
	for (size_t k = 0; k < sizeof n / sizeof *n; k++)
		for (size_t s = 1; s <= 4; s++)
			for (int d = CT_DECIMATE_SINC; d <= CT_DECIMATE_MEAN; d++) {
				if (line(y, x, n[k], s, 0.6 * (double)s, (enum ct_decimate)d))
					worst = 1e9;
				for (size_t m = 0; m < n[k] / s; m++)
					worst = fmax(worst, fabs((double)y[m] + 1000));
			}
	OK(worst < 1e-3, "a constant stays, for any size and factor (%.2g)", worst);
}

static void test_exact(void)
{
	const float x[11] = {9, 1, 2, 4, 8, 16, 32, 64, 128, 256, 77};
	float y[11];

	line(y, x, 11, 3, 0, CT_DECIMATE_MEAN); /* 2 over: one left out at each end */
	OK(fabsf(y[0] - 7.0f / 3) < 1e-6f && fabsf(y[1] - 56.0f / 3) < 1e-6f &&
			fabsf(y[2] - 448.0f / 3) < 1e-5f,
		"means of cells about the middle");
	line(y, x, 11, 3, 0, CT_DECIMATE_POINT);
	OK(y[0] == 2 && y[1] == 16 && y[2] == 128, "odd factor: the middle sample");
	line(y, x + 1, 8, 4, 0, CT_DECIMATE_POINT);
	OK(y[0] == 3 && y[1] == 48, "even factor: between the middle two");
	line(y, x, 11, 1, 0, CT_DECIMATE_SINC);
	OK(memcmp(x, y, sizeof x) == 0, "factor 1 without blur copies the bits");
	OK(line(y, x, 3, 4, 0, CT_DECIMATE_MEAN) < 0, "an axis shorter than the factor is refused");
}

/* cos(pi p (k+1/2)/n) is even about both faces: the Gaussian multiplies it by its transfer,
 * decimation samples it at cell centres if p < n/s and the low-pass removes it if not. */
static void test_frequencies(void)
{
	enum { N = 96, S = 4, M = N / S };
	const double sigma = 1.7;
	double worst = 0, sinc_stop = 0, point_alias = 0;
	float x[N], y[M];

	for (size_t p = 0; p < N; p++) {
		double w = M_PI * (double)p / N, sum = 1, gain = 1;

		for (int d = 1; d <= 7; d++) { /* floor(4 sigma + 1/2) */
			double g = exp(-d * d / (2 * sigma * sigma));

			sum += 2 * g;
			gain += 2 * g * cos(w * d);
		}
		gain /= sum;
		for (size_t k = 0; k < N; k++)
			x[k] = (float)cos(w * ((double)k + 0.5));
		line(y, x, N, S, sigma, CT_DECIMATE_SINC);
		for (size_t m = 0; m < M; m++) {
			double want = gain * cos(M_PI * (double)p * ((double)m + 0.5) / M);

			if (p < M)
				worst = fmax(worst, fabs((double)y[m] - want));
			else
				sinc_stop = fmax(sinc_stop, fabs((double)y[m]));
		}
		line(y, x, N, S, 0, CT_DECIMATE_POINT);
		for (size_t m = 0; m < M; m++)
			if (p > M)
				point_alias = fmax(point_alias, fabs((double)y[m]));
	}
	OK(worst < 1e-6, "pass band: the Gaussian's transfer at cell centres (%.2g)", worst);
	OK(sinc_stop < 1e-6, "stop band: nothing (%.2g)", sinc_stop);
	OK(point_alias > 0.1, "point sampling aliases");
}

/* A wide Gaussian blurred is the wider Gaussian, in three dimensions. */
static void test_gaussian(void)
{
	const size_t n[3] = {48, 40, 64};
	const struct ct_degrade d = {{4, 2, 1}, {1.7, 0.9, 1.2}, CT_DECIMATE_SINC, {0}};
	const double wide[3] = {5, 4, 6}, mid[3] = {23.5, 19.5, 31.5};
	float *x = malloc(48 * 40 * 64 * sizeof *x), *y = malloc(12 * 20 * 64 * sizeof *y);
	struct ct_separable s;
	double worst = 0;

	if (!x || !y || ct_degrade_plan(&s, &d, n, NULL, &err))
		exit(1);
	for (size_t i = 0; i < 48 * 40 * 64; i++) {
		const size_t at[3] = {i % 48, i / 48 % 40, i / (48 * 40)};
		double v = 1000;

		for (int a = 0; a < 3; a++)
			v *= exp(-0.5 * pow(((double)at[a] - mid[a]) / wide[a], 2));
		x[i] = (float)v;
	}
	ct_separable_apply(&s, y, x, NULL);
	for (size_t i = 0; i < 12 * 20 * 64; i++) {
		const size_t at[3] = {i % 12, i / 12 % 20, i / (12 * 20)};
		double v = 1000;

		for (int a = 0; a < 3; a++) {
			double f = (double)d.factor[a], c = ((double)at[a] + 0.5) * f - 0.5;
			double total = hypot(wide[a], d.sigma[a]);

			v *= wide[a] / total * exp(-0.5 * pow((c - mid[a]) / total, 2));
		}
		worst = fmax(worst, fabs((double)y[i] - v));
	}
	OK(worst < 0.5, "blur adds variances, decimation samples (%.2g of 1000)", worst);
	ct_separable_free(&s);
	free(x);
	free(y);
}

static void test_adjoint(void)
{
	const size_t n[3] = {30, 1, 19};
	double worst = 0;

	for (int p = 1; p <= 3; p++) {
		struct ct_degrade d = {{4, 1, 3}, {0}, CT_DECIMATE_MEAN, {0}};
		struct ct_separable pair[2];
		struct ct_linear a;

		ct_degrade_protocol(&d, p);
		must(ct_degrade_plan(&pair[0], &d, n, NULL, &err));
		must(separable_adjoint(&pair[1], &pair[0], NULL, &err));
		a = separable_linear(pair);
		worst = fmax(worst, adjoint_error(&a));
		ct_separable_free(&pair[0]);
		ct_separable_free(&pair[1]);
	}
	OK(worst < 1e-6, "<D x, y> = <x, D^T y>, three protocols, a thin axis (%.2g)", worst);
}

/* A measured slice profile of 9 steps of 1 mm, slices and their spacing 5 mm. */
static const double measured[9] = {0.022, 0.067, 0.128, 0.181, 0.203, 0.179, 0.128, 0.067, 0.024};

static void test_profile_rows(void)
{
	struct ct_degrade d = {.factor = {1, 1, 5}};
	struct ct_slice_profile_said said = CT_SLICE_PROFILE_NOTHING;
	struct ct_taps t = {0};
	double worst = 0, rows = 0;

	said.samples = (struct ct_slice_profile){.n = 9, .first = -4, .step = 1};
	for (size_t i = 0; i < 9; i++)
		said.samples.w[i] = measured[i] / 0.999;
	must(ct_slice_profile_set(&d, 2, &said, 5, &err));
	must(ct_degrade_axis_taps(&t, &d, 2, 40, &err));
	for (size_t q = 0; q < t.taps; q++) {
		const ptrdiff_t k = (ptrdiff_t)(t.first[3] + q) - 17; /* the middle of cell 3 */
		const bool in = k >= -4 && k <= 4;

		worst = fmax(
			worst, fabs(t.w[3 * t.taps + q] -
				       (in ? (measured[4 + k] + measured[4 - k]) / 2 / 0.999 : 0)));
	}
	for (size_t i = 0; i < t.n_out; i++) {
		double sum = 0;

		for (size_t q = 0; q < t.taps; q++)
			sum += t.w[i * t.taps + q];
		rows = fmax(rows, fabs(sum - 1));
	}
	OK(t.n_out == 8 && worst < 1e-12, "a measured profile, sample by sample (%.2g)", worst);
	OK(rows < 1e-12, "whose rows sum up to 1, at the borders too (%.2g)", rows);
	ct_taps_free(&t);
	d.factor[2] = 4; /* the same mm, spacing and thickness 4: between two voxels */
	must(ct_slice_profile_set(&d, 2, &said, 4, &err));
	must(ct_degrade_axis_taps(&t, &d, 2, 40, &err));
	worst = 0;
	for (size_t q = 0; q < t.taps; q++) {
		const ptrdiff_t k = (ptrdiff_t)(t.first[3] + q) - 14; /* from the middle, and 1/2 */
		double want = 0;

		for (ptrdiff_t side = k; side <= k + 1; side++)
			if (side >= -4 && side <= 4)
				want += (measured[4 + side] + measured[4 - side]) / 4 / 0.999;
		worst = fmax(worst, fabs(t.w[3 * t.taps + q] - want));
	}
	OK(worst < 1e-12, "and half of each on either side between voxels (%.2g)", worst);
	ct_taps_free(&t);
}

static void test_profile_shapes(void)
{
	static const double spread[] = {0.371, 0.288675, 0.408248, 0.322749};
	const size_t n[3] = {3, 4, 33};
	double worst = 0, off = 0;

	for (int shape = 0; shape < 4; shape++) {
		struct ct_slice_profile_said said = CT_SLICE_PROFILE_NOTHING;
		struct ct_degrade d = {{1, 1, 4}, {0}, CT_DECIMATE_SINC, {0}}, got;
		struct ct_separable pair[2];
		struct ct_meta m = {0};
		struct ct_linear a;

		said.shape = shape;
		said.mm = 1.5; /* wider than their spacing, 1 mm */
		must(ct_slice_profile_set(&d, 2, &said, 1, &err));
		worst = fmax(worst, fabs(sqrt(pow(d.sigma[2] / 4, 2) +
						 (d.decimate == CT_DECIMATE_MEAN ? 1 / 12. : 0)) -
					    1.5 * spread[shape]));
		must(ct_degrade_put(&m, &d, &err));
		must(ct_degrade_get(&m, &got, &err));
		worst = fmax(worst, fabs(got.sigma[2] - d.sigma[2]));
		OK(got.profile.n == d.profile.n &&
				(shape == CT_SLICE_GAUSSIAN) == (d.profile.n == 0) &&
				got.decimate == d.decimate && got.profile.axis == d.profile.axis,
			"%s travels", CT_WORD(CT_SLICE_SHAPE_LIST, shape));
		must(ct_degrade_plan(&pair[0], &got, n, NULL, &err));
		must(separable_adjoint(&pair[1], &pair[0], NULL, &err));
		a = separable_linear(pair);
		off = fmax(off, adjoint_error(&a));
		ct_separable_free(&pair[0]);
		ct_separable_free(&pair[1]);
		ct_meta_free(&m);
	}
	OK(worst < 2e-3, "shapes have their spread (%.2g)", worst);
	OK(off < 1e-6, "<D x, y> = <x, D^T y> of each (%.2g)", off);
}

static void test_profile_text(void)
{
	static const char good[] = "# mm weight\n-1 .25\n0 .5 # middle\n\n1 .25";
	static const char *const bad[][2] = {{"0 1", "too few"},
		{"-1 1\n0 x\n1 1", "line 2: field 2"}, {"-1 1\n0 1\n2 1", "line 3: field 1"},
		{"a 1\n0 1\n1 1", "line 1: field 1"}, {"-1 1\n0 1 7\n1 1", "line 2"},
		{"-1 1\n0 inf\n1 1", "line 2"}, {"4 1\n5 1\n6 1", "about 5"},
		{"-1 1\n0 -1\n1 0", "weights"}, {"", "too few"}};
	struct ct_slice_profile p;
	bool refused = true;

	OK(ct_slice_profile_parse(&p, good, sizeof good - 1, &err) == 0 && p.n == 3 &&
			p.first == -1 && p.step == 1 && p.w[1] == 0.5,
		"a file of a profile");
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
		refused = refused &&
			  ct_slice_profile_parse(&p, bad[i][0], strlen(bad[i][0]), &err) < 0 &&
			  err.code == CT_EINPUT && strstr(err.msg, bad[i][1]);
	OK(refused, "what is none is refused with line and field");
}

static void test_affine(void)
{
	const double hi[3][4] = {{-0.5, 0, 0, 10}, {0, 0.5, 0, 20}, {0, 0, 2, 30}};
	const struct ct_degrade d = {{4, 3, 1}, {0}, CT_DECIMATE_MEAN, {0}};
	struct ct_vol a = {.n = {14, 9, 5}}, b = {.n = {3, 3, 5}};
	const double first[3] = {1 + 1.5, 1, 0}, zero[3] = {0, 0, 0};
	double p[3], q[3], mm[3];

	memcpy(a.affine, hi, sizeof hi);
	ct_degrade_affine(b.affine, hi, a.n, &d);
	ct_vol_world(&a, first, p); /* 14 = 3*4 + 2: one left out before */
	ct_vol_world(&b, zero, q);
	OK(hypot(hypot(p[0] - q[0], p[1] - q[1]), p[2] - q[2]) < 1e-12,
		"LR voxel 0 is the centre of the first cell");
	ct_vol_spacing(&b, mm);
	OK(fabs(mm[0] - 2) + fabs(mm[1] - 1.5) + fabs(mm[2] - 2) < 1e-12, "spacing times factor");
}

static void test_meta(void)
{
	struct ct_degrade d = {{4, 4, 1}, {0}, CT_DECIMATE_MEAN, {0}},
			  got = {{0}, {0}, CT_DECIMATE_MEAN, {0}};
	struct ct_meta m = {0};

	ct_degrade_protocol(&d, 3);
	NEAR(d.sigma[0], 0.5, 1e-15, "P3: sigma s/8");
	OK(d.sigma[2] == 0 && d.decimate == CT_DECIMATE_POINT, "none on an axis that stays");
	OK(ct_degrade_get(&m, &got, &err) == 1 && got.factor[0] == 0, "no factor, no operator");
	OK(ct_degrade_put(&m, &d, &err) == 0 && ct_degrade_get(&m, &got, &err) == 0 &&
			memcmp(got.factor, d.factor, sizeof d.factor) == 0 &&
			memcmp(got.sigma, d.sigma, sizeof d.sigma) == 0 &&
			got.decimate == CT_DECIMATE_POINT,
		"the operator travels");
	ct_meta_set(&m, "decimate", "magic", &err);
	OK(ct_degrade_get(&m, &got, &err) < 0 && err.code == CT_EINPUT,
		"unknown decimation refused");
	ct_meta_set(&m, "decimate", "mean", &err);
	ct_meta_set(&m, "factor", "4,0,1", &err);
	OK(ct_degrade_get(&m, &got, &err) < 0 && err.code == CT_EINPUT, "factor 0 refused");
	ct_meta_set(&m, "factor", "0.5", &err);
	OK(ct_degrade_get(&m, &got, &err) < 0 && err.code == CT_EINPUT, "factor 0.5 refused");
	ct_meta_set(&m, "factor", "2.5", &err);
	OK(ct_degrade_get(&m, &got, &err) == 0 && got.factor[1] == 2.5, "factor 2.5 read");
	ct_meta_free(&m);
}

static void test_noise(void)
{
	enum { N = 200000 };
	float *a = calloc(N, sizeof *a), *b = calloc(N, sizeof *b);
	double sum = 0, squares = 0, worst = 0;
	struct ct_par *par = NULL;

	if (!a || !b || ct_par_alloc(&par, 4, &err))
		exit(1);
	ct_degrade_noise(a, N, 11, 5, NULL);
	ct_degrade_noise(b, N, 11, 5, par);
	OK(memcmp(a, b, N * sizeof *a) == 0, "noise: 1 and 4 threads, same bytes");
	for (size_t i = 0; i < N; i++)
		worst = fmax(worst, fabs((double)a[i] - 11 * (double)ct_rng_normal(5, 0, i)));
	OK(worst < 1e-5, "number i for value i");
	for (size_t i = 0; i < N; i++) {
		sum += (double)a[i];
		squares += (double)a[i] * (double)a[i];
	}
	NEAR(sum / N, 0, 11 * 5 / sqrt(N), "mean zero");
	NEAR(sqrt(squares / N), 11, 11 * 5 / sqrt(2.0 * N), "standard deviation as asked");
	ct_par_free(par);
	free(a);
	free(b);
}

int main(void)
{
	test_definition();
	test_place();
	test_limits();
	test_constant();
	test_exact();
	test_frequencies();
	test_gaussian();
	test_adjoint();
	test_profile_rows();
	test_profile_shapes();
	test_profile_text();
	test_affine();
	test_meta();
	test_noise();
	return tap_done();
}
