/* water.c: see water.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "recon/water.h"
#include "core/mem.h"
#include "recon/centre.h"
#include "recon/reconstruct.h"
#include "recon/scan-grid.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { N = 3, VOXELS = 64, EDGE = 2, LEAST = 64, ROUNDS = 30 };

struct body {
	struct ct_vol power[N]; /* of (p/most)^(k + 1), on one grid */
	float threshold;
	double most;
};

static int reconstruct(
	struct body *b, const struct ct_stack *plane, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_reconstruct_rule how = {.filter = CT_RAMP_HANN, .parker = true};
	const struct ct_env quiet = {.par = env->par, .stop = env->stop};
	const size_t m = ct_stack_count(plane);
	struct ct_iterative_report report;
	struct ct_stack part = *plane;
	struct ct_vol grid = {0};
	int rc = -1;

	part.deviation = NULL;
	for (size_t i = 0; i < m; i++)
		b->most = fmax(b->most, (double)plane->data[i]);
	if (!(b->most > 0))
		return ct_fail(e, CT_EINPUT, "water: no line integral is above 0");
	if (ct_alloc(&part.data, m, sizeof *part.data, e))
		return -1;
	if (ct_scan_grid(&grid, VOXELS, plane, e))
		goto out;
	for (int k = 0; k < N; k++) {
		struct ct_vol *v = &b->power[k];

		for (size_t i = 0; i < m; i++)
			part.data[i] = (float)pow(
				fmax((double)plane->data[i], 0) / b->most, (double)k + 1);
		if (ct_vol_like(v, &grid, e))
			goto out;
		memset(v->data, 0, ct_vol_count(v) * sizeof *v->data);
		if (ct_reconstruct(v, &report, &part, &how, &quiet, e))
			goto out;
	}
	rc = 0;
out:
	free(part.data);
	return rc;
}

/* Half-way between the means above and below it. */
static float find_threshold(const float *x, size_t n)
{
	double at = 0;

	for (size_t i = 0; i < n; i++)
		at = fmax(at, (double)x[i] / 2);
	for (int round = 0; round < ROUNDS; round++) {
		double sum[2] = {0}, count[2] = {0};

		for (size_t i = 0; i < n; i++) {
			sum[(double)x[i] > at] += (double)x[i];
			count[(double)x[i] > at]++;
		}
		if (count[0] > 0 && count[1] > 0)
			at = (sum[0] / count[0] + sum[1] / count[1]) / 2;
	}
	return (float)at;
}

/* 1 in the body, 0 outside, -1 near its edge or beyond the circle that all views see. */
static int side(const struct body *b, size_t i, size_t j, const float *slice)
{
	const size_t w = b->power[0].n[0], h = b->power[0].n[1];
	const double x = (double)i - ((double)w - 1) / 2, y = (double)j - ((double)h - 1) / 2;
	const bool in = slice[j * w + i] > b->threshold;

	if (i < EDGE || j < EDGE || i + EDGE >= w || j + EDGE >= h ||
		hypot(x, y) > fmin((double)w, (double)h) / 2 - EDGE)
		return -1;
	for (size_t s = j - EDGE; s <= j + EDGE; s++)
		for (size_t r = i - EDGE; r <= i + EDGE; r++)
			if ((slice[s * w + r] > b->threshold) != in)
				return -1;
	return in;
}

/* The n normal equations a x = right side, the last column, by elimination. */
static bool solve(double *x, double a[N][N + 1], int n)
{
	for (int k = 0; k < n; k++) {
		if (!(a[k][k] > 0))
			return false;
		for (int r = k + 1; r < n; r++)
			for (int c = n; c >= k; c--)
				a[r][c] -= a[r][k] / a[k][k] * a[k][c];
	}
	for (int k = n - 1; k >= 0; k--) {
		x[k] = a[k][n];
		for (int c = k + 1; c < n; c++)
			x[k] -= a[k][c] * x[c];
		x[k] /= a[k][k];
	}
	return true;
}

/* The best c without a negative one: of the terms that each set of bits names. */
static bool solve_rising(double c[N], double a[N][N + 1])
{
	double best = 0;

	for (unsigned set = 1; set < 1U << N; set++) {
		double part[N][N + 1], x[N] = {0}, gain = 0;
		int of[N], n = 0;
		bool good;

		for (int k = 0; k < N; k++)
			if (set >> k & 1)
				of[n++] = k;
		for (int k = 0; k < n; k++) {
			for (int l = 0; l < n; l++)
				part[k][l] = a[of[k]][of[l]];
			part[k][n] = a[of[k]][N];
		}
		good = solve(x, part, n);
		for (int k = 0; k < n && good; k++) {
			good = x[k] >= 0;
			gain += x[k] * a[of[k]][N];
		}
		if (!good || !(gain > best))
			continue;
		best = gain;
		memset(c, 0, N * sizeof *c);
		for (int k = 0; k < n; k++)
			c[of[k]] = x[k];
	}
	return best > 0;
}

static int flatten(double *c, struct body *b, struct ct_err *e)
{
	const struct ct_vol *v = b->power;
	const size_t w = v->n[0], h = v->n[1], from = v->n[2] / 2 * w * h;
	const float *slice = v->data + from;
	double a[N][N + 1] = {{0}}, mean = 0, unit = 1;
	size_t count = 0;

	b->threshold = find_threshold(slice, w * h);
	for (size_t at = 0; at < w * h; at++) {
		const int in = side(b, at % w, at / w, slice);

		for (int k = 0; k < N && in >= 0; k++) {
			const double f = (double)v[k].data[from + at];

			for (int l = 0; l < N; l++)
				a[k][l] += f * (double)v[l].data[from + at];
			a[k][N] += in ? f : 0;
		}
		mean += in == 1 ? (double)slice[at] : 0;
		count += in == 1;
	}
	if (count < LEAST || !solve_rising(c, a))
		return ct_fail(e, CT_EINPUT,
			"water: no homogeneous body is seen in the middle plane: pass the "
			"coefficients");
	mean /= (double)count;
	for (int k = 0; k < N; k++, unit *= b->most)
		c[k] *= mean / unit;
	return 0;
}

int ct_water_find(double c[static CT_WATER_TERMS], const struct ct_stack *scan,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_stack plane = {0};
	struct body b = {0};
	int rc;

	memset(c, 0, CT_WATER_TERMS * sizeof *c);
	rc = ct_err_any(ct_centre_plane(&plane, scan, false, e) ||
			reconstruct(&b, &plane, env, e) || flatten(c, &b, e));

	for (int k = 0; k < N; k++)
		ct_vol_free(&b.power[k]);
	ct_stack_free(&plane);
	return rc;
}

int ct_water_apply(struct ct_stack *s, const double c[static CT_WATER_TERMS], struct ct_err *e)
{
	for (size_t i = 0, n = ct_stack_count(s); i < n; i++) {
		const double p = (double)s->data[i], x = fmax(p, 0);
		const double slope = c[0] + x * (2 * c[1] + x * (3 * c[2] + x * 4 * c[3]));

		if (!(slope > 0))
			return ct_fail(e, CT_EINPUT,
				"--water: the polynomial does not rise at a line integral of %.4g",
				p);
		s->data[i] = (float)(p * (c[0] + x * (c[1] + x * (c[2] + x * c[3]))));
		if (s->deviation)
			s->deviation[i] = (float)((double)s->deviation[i] * slope);
	}
	return 0;
}
