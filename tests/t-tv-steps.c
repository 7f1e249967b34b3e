/* Steps of total and second-order variation by their formulas, in double. D = 1, so that the volume
 * nearest to x within the noise lies on the line from x to y.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "numbers.h"
#include "inverse/tv-row.h"
#include "inverse/tv.h"

#include <signal.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

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
	return tap_done();
}
