/* Steps of total and second-order variation by their formulas, in double. D = 1, so that the volume
 * nearest to x within the noise lies on the line from x to y.
 * Where points are flat: the weights, against their formula; when; and what it is for.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "inverse/flat.h"
#include "inverse/tv-row.h"
#include "inverse/tv.h"
#include "inverse/upsample.h"
#include "operator/resample.h"
#include "numbers.h"

#include <signal.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static const struct ct_env quiet = {0};

static void make(struct ct_vol *v, const size_t n[3], uint64_t stream)
{
	float *x;

	*v = (struct ct_vol){0};
	must(ct_vol_alloc(v, n, &err));
	x = normals(ct_vol_count(v), 5, stream, 9);
	for (size_t i = 0; i < ct_vol_count(v); i++) /* here flat, there not */
		v->data[i] = 40 + x[i] * (i / 4 % 3 == 0 ? 9 : 1);
	free(x);
}

/* The weight of the cell that begins at point `at`: of its corners the variance, in two passes. */
static double weight(const struct ct_vol *lo, const ptrdiff_t at[3], double t)
{
	double y[8], mean = 0, var = 0;

	for (int c = 0; c < 8; c++) {
		size_t p[3];

		for (int a = 0; a < 3; a++) {
			const ptrdiff_t i = at[a] + (c >> a & 1), last = (ptrdiff_t)lo->n[a] - 1;

			p[a] = (size_t)(i > last ? last : i);
		}
		y[c] = (double)lo->data[(p[2] * lo->n[1] + p[1]) * lo->n[0] + p[0]];
		mean += y[c] / 8;
	}
	for (int c = 0; c < 8; c++)
		var += pow(y[c] - mean, 2) / 7;
	return 1 / (1 + pow(var / pow(4 * t, 2), 2));
}

/* Linear between the centres of the cells, the last ones beyond. */
static double weight_at(const struct ct_vol *lo, const double index[3], double t)
{
	ptrdiff_t cell[3][2];
	double part[3], sum = 0;

	for (int a = 0; a < 3; a++) {
		const double most = fmax((double)lo->n[a] - 2, 0);
		const double at = fmin(fmax(index[a] - 0.5, 0), most);

		cell[a][0] = (ptrdiff_t)floor(at);
		cell[a][1] = (ptrdiff_t)fmin(floor(at) + 1, most);
		part[a] = at - floor(at);
	}
	for (int c = 0; c < 8; c++) {
		const ptrdiff_t at[3] = {cell[0][c & 1], cell[1][c >> 1 & 1], cell[2][c >> 2]};
		double share = 1;

		for (int a = 0; a < 3; a++)
			share *= c >> a & 1 ? part[a] : 1 - part[a];
		sum += share * weight(lo, at, t);
	}
	return sum;
}

static void test_formula(void)
{
	static const size_t sizes[][3] = {{7, 6, 5}, {9, 8, 6}, {6, 1, 4}, {8, 2, 3}};
	static const double factors[][3] = {{4, 4, 4}, {1, 1, 4}, {2, 3, 2}, {2.5, 4, 1.5}};
	struct ct_par *par;

	must(ct_par_alloc(&par, 3, &err));
	for (int k = 0; k < 4; k++) {
		const double *f = factors[k];
		const struct ct_env three = {.par = par};
		struct ct_vol lo, x, y;
		struct ct_separable s;
		double worst = 0;
		float *l, *was;
		size_t n[3];

		make(&lo, sizes[k], 1);
		for (int a = 0; a < 3; a++)
			n[a] = ct_degrade_cover(lo.n[a], f[a]);
		make(&x, n, 2);
		make(&y, n, 2);
		l = normals(ct_vol_count(&x), 1, 0, 1);
		was = normals(ct_vol_count(&x), 1, 0, 1);
		memcpy(was, x.data, ct_vol_count(&x) * sizeof *was);
		must(ct_flat_mix(&x, &lo, f, 0, &quiet, &err));
		OK(memcmp(was, x.data, ct_vol_count(&x) * sizeof *was) == 0, "without texture: x");
		must(ct_flat_mix(&x, &lo, f, 3, &quiet, &err) ||
			ct_flat_mix(&y, &lo, f, 3, &three, &err) ||
			ct_resample_up_plan(&s, lo.n, f, CT_LINEAR, NULL, &err));
		OK(memcmp(y.data, x.data, ct_vol_count(&x) * sizeof *was) == 0, "any threads");
		ct_separable_apply(&s, l, lo.data, NULL);
		for (size_t i = 0; i < ct_vol_count(&x); i++) {
			const size_t p[3] = {i % n[0], i / n[0] % n[1], i / n[0] / n[1]};
			double at[3], w;

			for (int a = 0; a < 3; a++)
				at[a] = ((double)p[a] + 0.5 -
						0.5 * ((double)n[a] - (double)lo.n[a] * f[a])) /
						f[a] -
					0.5;
			w = weight_at(&lo, at, 3);
			worst = fmax(worst, fabs((double)x.data[i] - (1 - w) * (double)was[i] -
						    w * (double)l[i]));
		}
		OK(worst < 1e-4, "%gx%gx%g: linear by the weight of eight points: %g", f[0], f[1],
			f[2], worst);
		ct_separable_free(&s);
		free(l);
		free(was);
		ct_vol_free(&lo);
		ct_vol_free(&x);
		ct_vol_free(&y);
	}
	ct_par_free(par);
}

/* What one in fifty cells of tissue does not exceed. */
static void test_texture(void)
{
	static const size_t n[3] = {40, 40, 40};
	struct ct_vol v = {0};
	double t, again;

	must(ct_vol_alloc(&v, n, &err));
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = 40 + 10 * ct_rng_normal(3, 0, i);
	must(ct_flat_texture(&t, &v, &err));
	NEAR(t, 10 * sqrt(1.564 / 7), 0.2, "of noise the root of 2 % of chi^2 of 7");
	for (size_t i = 0; i < ct_vol_count(&v); i++) /* a half that is rough */
		v.data[i] = i % 40 < 20 ? v.data[i] : 40 + 30 * ct_rng_normal(4, 0, i);
	must(ct_flat_texture(&t, &v, &err));
	NEAR(t, 10 * sqrt(2.0 / 7), 0.3, "of twice as many cells 4 %");
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = i % 40 < 5    ? -1000
			    : i % 40 < 10 ? -900 + 5 * v.data[i] / 40
					  : v.data[i];
	must(ct_flat_texture(&t, &v, &err));
	NEAR(t, 10 * sqrt(2.3 / 7), 0.5, "air does not count");
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = i % 40 < 10 ? -512 : v.data[i];
	must(ct_flat_texture(&again, &v, &err));
	NEAR(again, t, 1e-9, "nor what was clipped");
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = i % 40 < 20 && i % 40 > 10 ? 40 : v.data[i];
	must(ct_flat_texture(&t, &v, &err));
	OK(t == 0, "constant tissue: none");
	ct_vol_free(&v);
	must(ct_vol_alloc(&v, (const size_t[3]){4, 3, 3}, &err));
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = (float)(i * i % 13);
	must(ct_flat_texture(&t, &v, &err));
	OK(t == 0, "nor of few cells");
	ct_vol_free(&v);
}

/* Two tissues with an edge between them and white noise of 10 HU, in points. */
static void scene(struct ct_vol *hr, struct ct_vol *lo, const struct ct_degrade *d)
{
	static const size_t n[3] = {64, 64, 64};
	struct ct_separable s;
	size_t m[3];

	*hr = *lo = (struct ct_vol){0};
	must(ct_vol_alloc(hr, n, &err));
	for (size_t i = 0; i < ct_vol_count(hr); i++)
		hr->data[i] = (i % 64 < 40 ? 40.0F : 900.0F) + 10 * ct_rng_normal(3, 0, i);
	for (int a = 0; a < 3; a++)
		m[a] = ct_degrade_size(n[a], d->factor[a]);
	must(ct_vol_alloc(lo, m, &err) || ct_degrade_plan(&s, d, n, NULL, &err));
	ct_separable_apply(&s, lo->data, hr->data, NULL);
	ct_separable_free(&s);
}

static struct ct_upsample_report up(
	struct ct_vol *hi, const struct ct_vol *lo, const struct ct_upsample_rule *rule)
{
	struct ct_upsample_report r;

	*hi = (struct ct_vol){0};
	must(ct_upsample(hi, lo, rule, &r, &quiet, &err));
	return r;
}

/* RMS of the error at least 8 voxels from edge and border, and of the error beside the edge. */
static double deep(const struct ct_vol *x, const struct ct_vol *hr, size_t from, size_t to)
{
	double sum = 0, count = 0;

	for (size_t i = 0; i < ct_vol_count(hr); i++)
		if (i % 64 >= from && i % 64 < to && i / 64 % 64 >= 8 && i / 64 % 64 < 56 &&
			i / 4096 >= 8 && i / 4096 < 56) {
			sum += pow((double)x->data[i] - (double)hr->data[i], 2);
			count++;
		}
	return sqrt(sum / count);
}

static void test_scene(void)
{
	const struct ct_degrade points = {{4, 4, 4}, {0.5, 0.5, 0.5}, CT_DECIMATE_POINT, {0}};
	struct ct_upsample_rule rule = {
		.method = CT_UPSAMPLE_AUTO, .known = true, .by = points, .iterations = 60};
	struct ct_vol hr, lo, mixed, htv, cubic;
	struct ct_upsample_report r;
	double residual, texture;

	scene(&hr, &lo, &points);
	must(ct_flat_texture(&texture, &lo, &err));
	r = up(&mixed, &lo, &rule);
	OK(r.method == CT_UPSAMPLE_HTV && r.texture == texture && texture > 0,
		"points: as flat as the scan shows");
	OK(r.residual < 1e-4, "and consistent: %g", r.residual);
	rule.method = CT_UPSAMPLE_HTV;
	r = up(&htv, &lo, &rule);
	OK(r.texture == 0, "htv is what it says");
	rule.method = CT_UPSAMPLE_CUBIC;
	up(&cubic, &lo, &rule);
	OK(deep(&mixed, &hr, 8, 30) < 0.99 * deep(&htv, &hr, 8, 30) &&
			deep(&mixed, &hr, 8, 30) < deep(&cubic, &hr, 8, 30),
		"less texture: %.3f, htv %.3f, cubic %.3f", deep(&mixed, &hr, 8, 30),
		deep(&htv, &hr, 8, 30), deep(&cubic, &hr, 8, 30));
	OK(deep(&mixed, &hr, 38, 42) < 1.01 * deep(&htv, &hr, 38, 42), "the edge stays: %.1f %.1f",
		deep(&mixed, &hr, 38, 42), deep(&htv, &hr, 38, 42));
	must(ct_flat_mix(&htv, &lo, points.factor, texture, &quiet, &err) ||
		ct_upsample_settle(&htv, &lo, &points, 0, &residual, &quiet, &err));
	OK(apart(ct_vol_count(&hr), mixed.data, htv.data) < 1e-5, "htv, mixed, settled");
	ct_vol_free(&mixed);
	rule.method = CT_UPSAMPLE_AUTO;
	rule.spread = 300;
	rule.texture = 2;
	r = up(&mixed, &lo, &rule);
	OK(r.texture == 2, "of a part, that of the whole");
	ct_vol_free(&mixed);
	rule.spread = 0;
	rule.plain = true;
	r = up(&mixed, &lo, &rule);
	OK(r.method == CT_UPSAMPLE_HTV && r.texture == 0, "not where it is to be plain");
	ct_vol_free(&mixed);
	rule.plain = false;
	rule.noise = 10;
	r = up(&mixed, &lo, &rule);
	OK(r.texture == 0, "nor where noise is known");
	ct_vol_free(&mixed);
	rule.noise = 0;
	rule.by.decimate = CT_DECIMATE_MEAN;
	r = up(&mixed, &lo, &rule);
	OK(r.method == CT_UPSAMPLE_TV && r.texture == 0, "nor of means");
	ct_vol_free(&mixed);
	ct_vol_free(&htv);
	ct_vol_free(&cubic);
	ct_vol_free(&hr);
	ct_vol_free(&lo);
}

static void t_flat(void)
{
	test_formula();
	test_texture();
	test_scene();
}

enum { MOST = 37 * 5 * 19, PARTS = 6, STEPS = 4 };

static const double w[3] = {0.7, 1, 0.45};
static const int first[PARTS] = {0, 1, 2, 0, 0, 1}, second[PARTS] = {0, 1, 2, 1, 2, 2};
static size_t n[3], step[3], count;

/* Neighbours that part c of a voxel is made of, with their weights; 0 if it has none. For tv the
 * three differences. */
static int parts(bool htv, int c, size_t i, size_t at[4], double weight[4])
{
	const int a = first[c], b = second[c];
	const size_t x = i / step[a] % n[a], y = i / step[b] % n[b];
	const double cross = sqrt(2) * w[a] * w[b], own = w[a] * w[a];

	if (!htv) {
		at[0] = i;
		at[1] = i + step[a];
		weight[0] = -w[a];
		weight[1] = w[a];
		return x + 1 < n[a] ? 2 : 0;
	}
	if (a == b) {
		at[0] = i - step[a];
		at[1] = i;
		at[2] = i + step[a];
		weight[0] = weight[2] = own;
		weight[1] = -2 * own;
		return x > 0 && x + 1 < n[a] ? 3 : 0;
	}
	for (int k = 0; k < 4; k++) {
		at[k] = i + (size_t)(k % 2) * step[a] + (size_t)(k / 2) * step[b];
		weight[k] = k == 0 || k == 3 ? cross : -cross;
	}
	return x + 1 < n[a] && y + 1 < n[b] ? 4 : 0;
}

/* q <- q + s H x, and no longer than 1. */
static void ascend(bool htv, double q[PARTS][MOST], const double *x, double s)
{
	for (size_t i = 0; i < count; i++) {
		double length = 0;

		for (int c = 0; c < (htv ? 6 : 3); c++) {
			size_t at[4];
			double weight[4];

			for (int k = parts(htv, c, i, at, weight); k-- > 0;)
				q[c][i] += s * weight[k] * x[at[k]];
			length += q[c][i] * q[c][i];
		}
		for (int c = 0; c < (htv ? 6 : 3); c++)
			q[c][i] /= fmax(sqrt(length), 1);
	}
}

/* x <- x - t H' q */
static void descend(bool htv, double *x, double q[PARTS][MOST], double t)
{
	for (size_t i = 0; i < count; i++)
		for (int c = 0; c < (htv ? 6 : 3); c++) {
			size_t at[4];
			double weight[4];

			for (int k = parts(htv, c, i, at, weight); k-- > 0;)
				x[at[k]] -= t * weight[k] * q[c][i];
		}
}

static void within(double *x, const float *y, double noise)
{
	double off = 0;

	for (size_t i = 0; i < count; i++)
		off += pow(x[i] - (double)y[i], 2);
	off = sqrt(off / (double)count);
	for (size_t i = 0; i < count && off > noise; i++)
		x[i] = (double)y[i] + noise / off * (x[i] - (double)y[i]);
}

static double norm_of(void)
{
	double square = 0;

	for (int a = 0; a < 3; a++)
		square += n[a] > 1 ? 4 * w[a] * w[a] : 0;
	return square > 0 ? square : 1;
}

static double x[MOST], ahead[MOST], q[PARTS][MOST], old[PARTS][MOST];

static void second_order(const float *y, double noise, double size)
{
	const double norm = norm_of();

	memcpy(ahead, x, sizeof x);
	for (int k = 0; k < STEPS; k++) {
		const double t = size * exp2(-(double)k / 30); /* as tv.h says */
		double next[MOST];

		ascend(true, q, ahead, 1 / (t * norm));
		memcpy(next, x, sizeof x);
		descend(true, next, q, t / norm);
		within(next, y, noise);
		for (size_t i = 0; i < count; i++)
			ahead[i] = 2 * next[i] - x[i];
		memcpy(x, next, sizeof x);
	}
}

/* Drawn towards `to`, if mu > 0. */
static void first_order(const float *y, double noise, double size, const float *to, double mu)
{
	const double norm = sqrt(norm_of()), t = size / norm, b = mu > 0 ? t / mu : 0;

	within(x, y, noise);
	for (int k = 0; k < STEPS; k++) {
		double turned[PARTS][MOST];

		memcpy(old, q, sizeof q);
		ascend(false, q, x, 1 / (size * norm));
		for (int c = 0; c < 3; c++)
			for (size_t i = 0; i < count; i++)
				turned[c][i] = 2 * q[c][i] - old[c][i];
		descend(false, x, turned, t);
		for (size_t i = 0; i < count; i++)
			x[i] = (x[i] + b * (to ? (double)to[i] : 0)) / (1 + b);
		within(x, y, noise);
	}
}

/* kind 0: tv; 1: near a volume, with a dual to begin with; 2: htv */
static void compare(const size_t size[3], int kind)
{
	static const char *const name[] = {"tv", "tv, drawn", "htv"};
	const struct ct_degrade one = {{1, 1, 1}, {0}, CT_DECIMATE_SINC, {0}};
	struct ct_tv_rule rule = {{w[0], w[1], w[2]}, 40, STEPS, 0, {0}};
	const struct ct_env env = {0};
	struct ct_consistency dc = {0};
	struct ct_tv_report r;
	float *y, *got, *to, *start;
	int16_t *dual;
	double worst = 0, apart_dual = 0;

	for (int a = 0; a < 3; a++)
		n[a] = size[a];
	step[0] = 1;
	step[1] = n[0];
	step[2] = n[0] * n[1];
	count = step[2] * n[2];
	y = normals(count, 11, 0, 100);
	got = normals(count, 12, 0, 60);
	to = normals(count, 13, 0, 60);
	dual = calloc(3 * count, sizeof *dual);
	start = normals(3 * count, 14, 0, 0.2);
	memset(q, 0, sizeof q);
	for (size_t i = 0; i < count; i++) {
		x[i] = (double)got[i];
		for (int c = 0; c < 3 && kind == 1; c++) {
			int16_t *p = &dual[(size_t)c * count + i];

			if (i / step[c] % n[c] + 1 < n[c]) /* a difference */
				*p = (int16_t)(CT_TV_ONE * start[(size_t)c * count + i]);
			q[c][i] = (double)*p / (double)CT_TV_ONE;
		}
	}
	must(ct_consistency_alloc(&dc, &one, n, y, 30, NULL, &err));
	if (kind == 1)
		rule.near = (struct ct_tv_near){to, 25, dual};
	must((kind == 2 ? ct_tv_hessian : ct_tv)(got, &dc, &rule, &r, &env, &err));
	if (kind == 2)
		second_order(y, 30, 40);
	else
		first_order(y, 30, 40, kind ? to : NULL, kind ? 25 : 0);
	for (size_t i = 0; i < count; i++) {
		worst = fmax(worst, fabs((double)got[i] - x[i]));
		for (int c = 0; c < 3 && kind == 1; c++)
			apart_dual = fmax(apart_dual,
				fabs((double)dual[(size_t)c * count + i] / (double)CT_TV_ONE -
					q[c][i]));
	}
	OK(worst < 0.01 && apart_dual < 1e-4, "%s of %zux%zux%zu: %d steps (%.2g, %.2g)",
		name[kind], n[0], n[1], n[2], STEPS, worst, apart_dual);
	ct_consistency_free(&dc);
	free(y);
	free(got);
	free(to);
	free(start);
	free(dual);
}

static volatile sig_atomic_t halt;

static void halt_at(
	const struct ct_env *env, const char *what, size_t done, size_t total, size_t likely)
{
	(void)likely;
	(void)what, (void)total;
	if (done == *(size_t *)env->ctx)
		halt = 1;
}

/* Stopped after any of its iterations, then continued with those that are left: the same bytes. */
static void left_off(const struct ct_degrade *by)
{
	const size_t size[3] = {9, 6, 36};
	enum { ALL = 8, COUNT = 9 * 6 * 36 };
	struct ct_tv_rule rule = {{w[0], w[1], w[2]}, 40, ALL, 0, {0}};
	float *z = normals(COUNT, 21, 0, 100), *to = normals(COUNT, 22, 0, 60);
	float *start = normals(COUNT, 23, 0, 60), *got[2];
	int16_t *dual[2];
	struct ct_consistency dc = {0};
	bool stops = true, same = true;

	must(ct_consistency_alloc(&dc, by, size, z, 0, NULL, &err));
	for (size_t at = 0; at < ALL; at++) {
		struct ct_env env = {.progress = halt_at, .stop = &halt, .ctx = &at};
		struct ct_tv_report r;

		for (int k = 0; k < 2; k++) {
			got[k] =
				memcpy(malloc(COUNT * sizeof(float)), start, COUNT * sizeof(float));
			dual[k] = calloc(3 * COUNT, sizeof *dual[k]);
		}
		rule.iterations = ALL;
		rule.near = (struct ct_tv_near){to, 25, dual[0]};
		must(ct_tv(got[0], &dc, &rule, &r, &(struct ct_env){0}, &err));
		rule.near.dual = dual[1];
		stops &= ct_tv(got[1], &dc, &rule, &r, &env, &err) == -1 && err.code == CT_ESTOP &&
			 r.iterations == at + 1;
		halt = 0;
		rule.iterations = ALL - r.iterations;
		must(ct_tv(got[1], &dc, &rule, &r, &(struct ct_env){0}, &err));
		same &= memcmp(got[0], got[1], COUNT * sizeof(float)) == 0 &&
			memcmp(dual[0], dual[1], 3 * COUNT * sizeof *dual[0]) == 0;
		for (int k = 0; k < 2; k++) {
			free(got[k]);
			free(dual[k]);
		}
	}
	OK(stops && same, "left off between iterations, it goes on");
	ct_consistency_free(&dc);
	free(z);
	free(to);
	free(start);
}

int main(void)
{
	static const size_t sizes[][3] = {
		{37, 5, 19}, {16, 3, 33}, {33, 4, 16}, {9, 1, 2}, {1, 4, 5}, {5, 2, 1}, {17, 1, 1}};

	static const struct ct_degrade by[] = {
		{{3, 2, 2}, {0.85, 0.85, 0.85}, CT_DECIMATE_SINC, {0}},
		{{1, 1, 4}, {0}, CT_DECIMATE_MEAN, {0}}, {{3, 2, 3}, {0}, CT_DECIMATE_MEAN, {0}},
		{{1, 1, 3}, {0, 0, 0.5}, CT_DECIMATE_POINT, {0}}};

	for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++)
		for (int kind = 0; kind < 3; kind++)
			compare(sizes[s], kind);
	for (size_t d = 0; d < sizeof by / sizeof *by; d++)
		left_off(&by[d]);
	t_flat();
	return tap_done();
}
