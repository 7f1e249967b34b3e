/* Total and second-order variation under data consistency, against closed forms.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "inverse/tv.h"
#include "tap.h"
#include "core/par.h"
#include "numbers.h"
#include "recon/rof.h"

#include <stdlib.h>
#include <string.h>

typedef int solver(float *x, struct ct_consistency *dc, const struct ct_tv_rule *rule,
	struct ct_tv_report *report, const struct ct_env *env, struct ct_err *e);

static float *volume(const size_t n[3])
{
	float *x = calloc(n[0] * n[1] * n[2], sizeof *x);

	if (!x)
		exit(1);
	return x;
}

/* The plain definitions, in double. */
static double variation(const float *x, const size_t n[3])
{
	double sum = 0;

	for (size_t k = 0; k < n[2]; k++)
		for (size_t j = 0; j < n[1]; j++)
			for (size_t i = 0; i < n[0]; i++) {
				const float *p = x + (k * n[1] + j) * n[0] + i;
				double a = i + 1 < n[0] ? (double)p[1] - (double)p[0] : 0;
				double b = j + 1 < n[1] ? (double)p[n[0]] - (double)p[0] : 0;
				double c = k + 1 < n[2] ? (double)p[n[0] * n[1]] - (double)p[0] : 0;

				sum += sqrt(a * a + b * b + c * c);
			}
	return sum;
}

static void solve(solver *fn, float *x, const struct ct_degrade *d, const size_t n[3],
	const float *y, double noise, size_t iterations, struct ct_tv_report *report,
	struct ct_par *par)
{
	const struct ct_tv_rule rule = {{1, 1, 1}, 50, iterations, 0, {0}};
	const struct ct_env env = {.par = par};
	struct ct_consistency dc = {0};

	must(ct_consistency_alloc(&dc, d, n, y, noise, par, &err) ||
		fn(x, &dc, &rule, report, &env, &err));
	ct_consistency_free(&dc);
}

static size_t count(const size_t n[3])
{
	return n[0] * n[1] * n[2];
}

/* Two half-spaces of +-100, D = 1, noise e: each comes nearer by e. */
static void test_step(void)
{
	const struct ct_degrade one = {{1, 1, 1}, {0}, CT_DECIMATE_SINC, {0}};
	const size_t n[3] = {20, 18, 40};

	for (int axis = 0; axis < 3; axis++) {
		float *y = volume(n), *x = volume(n);
		struct ct_tv_report r;
		double worst = 0;

		for (size_t i = 0; i < count(n); i++) {
			const size_t at[3] = {i % n[0], i / n[0] % n[1], i / (n[0] * n[1])};

			y[i] = at[axis] < n[axis] / 2 ? -100 : 100;
		}
		memcpy(x, y, count(n) * sizeof *x);
		solve(ct_tv, x, &one, n, y, 30, 600, &r, NULL);
		for (size_t i = 0; i < count(n); i++)
			worst = fmax(worst, fabs((double)x[i] - 0.7 * (double)y[i]));
		OK(worst < 1, "a step along axis %d is lowered by the noise allowed (%.2g HU)",
			axis, worst);
		free(x);
		free(y);
	}
}

/* A box that fills whole cells, through blur and low-pass: far nearer than the start, and
 * consistent. */
static void test_box(void)
{
	const struct ct_degrade d = {{4, 4, 4}, {1.7, 1.7, 1.7}, CT_DECIMATE_SINC, {0}};
	const size_t n[3] = {48, 40, 44}, m[3] = {12, 10, 11};
	float *truth = volume(n), *y = volume(m), *x = volume(n), *back = volume(m);
	struct ct_separable down, up;
	struct ct_tv_report r;
	double before = 0, after = 0, off = 0;

	for (size_t i = 0; i < count(n); i++) {
		size_t a = i % n[0], b = i / n[0] % n[1], c = i / (n[0] * n[1]);

		truth[i] =
			a >= 12 && a < 36 && b >= 8 && b < 28 && c >= 16 && c < 32 ? 1000 : -1000;
	}
	must(ct_degrade_plan(&down, &d, n, NULL, &err) ||
		ct_consistency_pinv_plan(&up, &d, n, NULL, &err));
	ct_separable_apply(&down, y, truth, NULL);
	ct_separable_apply(&up, x, y, NULL);
	for (size_t i = 0; i < count(n); i++)
		before += pow((double)x[i] - (double)truth[i], 2);
	solve(ct_tv, x, &d, n, y, 0, 400, &r, NULL);
	for (size_t i = 0; i < count(n); i++)
		after += pow((double)x[i] - (double)truth[i], 2);
	ct_separable_apply(&down, back, x, NULL);
	for (size_t i = 0; i < count(m); i++)
		off = fmax(off, fabs((double)back[i] - (double)y[i]));
	OK(after < 0.1 * before, "a box: error energy %.3g of that of D+ y", after / before);
	OK(variation(x, n) < variation(truth, n) * 1.001, "no more variation than the truth has");
	OK(off < 0.05, "D x = y (%.2g HU)", off);
	ct_separable_free(&down);
	ct_separable_free(&up);
	free(truth);
	free(y);
	free(x);
	free(back);
}

/* A ramp, sampled at cell centres, has no second-order variation: htv gives it back. */
static void test_ramp(void)
{
	const struct ct_degrade d = {{4, 3, 2}, {0}, CT_DECIMATE_POINT, {0}};
	const size_t n[3] = {20, 18, 12}, m[3] = {5, 6, 6};
	float *truth = volume(n), *y = volume(m), *x = volume(n);
	struct ct_separable down, up;
	struct ct_tv_report r;
	double worst = 0, start = 0;

	for (size_t i = 0; i < count(n); i++)
		truth[i] = 10 * (float)(i % n[0]) - 7 * (float)(i / n[0] % n[1]) +
			   3 * (float)(i / (n[0] * n[1]));
	must(ct_degrade_plan(&down, &d, n, NULL, &err) ||
		ct_consistency_pinv_plan(&up, &d, n, NULL, &err));
	ct_separable_apply(&down, y, truth, NULL);
	ct_separable_apply(&up, x, y, NULL);
	for (size_t i = 0; i < count(n); i++)
		start = fmax(start, fabs((double)x[i] - (double)truth[i]));
	solve(ct_tv_hessian, x, &d, n, y, 0, 10000, &r, NULL);
	for (size_t i = 0; i < count(n); i++)
		worst = fmax(worst, fabs((double)x[i] - (double)truth[i]));
	OK(worst < 1 && worst < 0.01 * start, "htv: a ramp (%.2g HU, from %.3g)", worst, start);
	ct_separable_free(&down);
	ct_separable_free(&up);
	free(truth);
	free(y);
	free(x);
}

/* Thin axes, one voxel, and a constant, for both. */
static void test_thin(solver *fn, const char *name)
{
	static const size_t sizes[][3] = {
		{16, 12, 1}, {1, 8, 40}, {24, 1, 1}, {1, 1, 1}, {5, 1, 33}};

	for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
		const size_t *n = sizes[s];
		struct ct_degrade d = {{1, 1, 1}, {0}, CT_DECIMATE_MEAN, {0}};
		float *x = volume(n), *y = volume(n);
		struct ct_tv_report r;
		double worst = 0;

		for (int a = 0; a < 3; a++)
			d.factor[a] = n[a] % 4 == 0 ? 4 : 1;
		for (size_t i = 0; i < count(n); i++)
			x[i] = y[i] = -1000;
		x[count(n) / 2] = 3000;
		solve(fn, x, &d, n, y, 0, 4000, &r, NULL);
		for (size_t i = 0; i < count(n); i++)
			worst = fmax(worst, fabs((double)x[i] + 1000));
		OK(worst < 2, "%s of a constant %zux%zux%zu is constant (%.2g)", name, n[0], n[1],
			n[2], worst);
		free(x);
		free(y);
	}
}

static void test_threads(solver *fn, const char *name)
{
	static const struct {
		struct ct_degrade d;
		double noise;
	} by[] = {{{{3, 2, 4}, {1.2, 0.8, 1.7}, CT_DECIMATE_SINC, {0}}, 20},
		{{{1, 1, 4}, {0}, CT_DECIMATE_MEAN, {0}}, 0},
		{{{1, 1, 4}, {0}, CT_DECIMATE_MEAN, {0}}, 20},
		{{{3, 2, 2}, {0.5, 0.5, 0.5}, CT_DECIMATE_MEAN, {0}}, 0}};
	const size_t n[3] = {33, 20, 52};
	float *y = volume(n);

	ct_rng_normals(count(n), y, 5, 0, 0);
	for (size_t i = 0; i < count(n); i++)
		y[i] *= 300;
	for (size_t k = 0; k < sizeof by / sizeof *by; k++) {
		float *a = volume(n);
		struct ct_tv_report r;

		solve(fn, a, &by[k].d, n, y, by[k].noise, 15, &r, NULL);
		for (size_t threads = 2; threads <= 3; threads++) {
			float *b = volume(n);
			struct ct_par *par = NULL;
			struct ct_tv_report q;

			must(ct_par_alloc(&par, threads, &err));
			solve(fn, b, &by[k].d, n, y, by[k].noise, 15, &q, par);
			OK(memcmp(a, b, count(n) * sizeof *a) == 0 && memcmp(&r, &q, sizeof r) == 0,
				"%s, operator %zu: 1 and %zu threads, same bytes", name, k,
				threads);
			ct_par_free(par);
			free(b);
		}
		free(a);
	}
	free(y);
}

/* How far the sixth iteration says that it went. Three slabs of planes. */
static void test_report(void)
{
	enum { N = 11 * 6 * 36 };
	const struct ct_tv_rule rule = {{0.5, 1, 0.8}, 60, 0, 0, {0}};
	const struct ct_degrade d = {{1, 2, 3}, {0.4, 0.9, 1.3}, CT_DECIMATE_SINC, {0}};
	const struct ct_env env = {0};
	const size_t n[3] = {11, 6, 36}, m[3] = {11, 3, 12};
	float *y = volume(m), *x[2];

	ct_rng_normals(count(m), y, 8, 0, 0);
	for (size_t i = 0; i < count(m); i++)
		y[i] *= 100;
	for (int htv = 0; htv < 2; htv++) {
		double moved = 0;
		struct ct_tv_report r;

		for (size_t k = 0; k < 2; k++) { /* after 5 and 6 iterations */
			struct ct_tv_rule some = rule;
			struct ct_consistency dc = {0};

			some.iterations = 5 + k;
			x[k] = volume(n);
			must(ct_consistency_alloc(&dc, &d, n, y, 20, NULL, &err) ||
				(htv ? ct_tv_hessian : ct_tv)(x[k], &dc, &some, &r, &env, &err));
			ct_consistency_free(&dc);
		}
		for (size_t i = 0; i < N; i++)
			moved += pow((double)x[1][i] - (double)x[0][i], 2);
		OK(r.iterations == 6 && fabs(r.change / sqrt(moved / N) - 1) < 1e-4,
			"%s: its movement (%g, off %.2g)", htv ? "htv" : "tv", r.change,
			fabs(r.change / sqrt(moved / N) - 1));
		for (size_t k = 0; k < 2; k++)
			free(x[k]);
	}
	free(y);
}

static size_t told;

static void tell(
	const struct ct_env *env, const char *what, size_t done, size_t total, size_t likely)
{
	(void)likely;
	(void)env, (void)what, (void)total;
	told += done == told;
}

/* Beside an edge of 1000 HU lies noise of 5 HU that 160 iterations join as 2000 do. */
static void test_faint(void)
{
	const struct ct_degrade d = {{4, 4, 4}, {0.5, 0.5, 0.5}, CT_DECIMATE_POINT, {0}};
	const size_t n[3] = {48, 32, 32}, m[3] = {12, 8, 8}, enough[2] = {160, 2000};
	float *y = volume(m), *x[2];
	double apart = 0, faint = 0;

	for (size_t i = 0; i < count(m); i++)
		y[i] = (i % m[0] < 3 ? 1000 : 0) + 5 * (float)ct_rng_normal(5, 0, i);
	for (int k = 0; k < 2; k++) {
		struct ct_separable up;
		struct ct_tv_report r;

		x[k] = volume(n);
		must(ct_consistency_pinv_plan(&up, &d, n, NULL, &err));
		ct_separable_apply(&up, x[k], y, NULL);
		ct_separable_free(&up);
		solve(ct_tv_hessian, x[k], &d, n, y, 0, enough[k], &r, NULL);
	}
	for (size_t i = 0; i < count(n); i++)
		if (i % n[0] > n[0] / 2) {
			apart += pow((double)x[0][i] - (double)x[1][i], 2);
			faint += pow((double)x[1][i], 2);
		}
	OK(apart < 0.04 * faint, "htv: faint noise is at rest (%.2g of it)", sqrt(apart / faint));
	free(x[0]);
	free(x[1]);
	free(y);
}

/* It ends when an iteration moves less than the tolerance, of every fifth; htv after the 30 that
 * halve its step. */
static void test_tolerance(void)
{
	const struct ct_degrade one = {{1, 1, 1}, {0}, CT_DECIMATE_SINC, {0}};
	const size_t n[3] = {8, 8, 8};
	const struct ct_env env = {.progress = tell};

	for (int htv = 0; htv < 2; htv++)
		for (int k = 0; k < 2; k++) {
			const size_t all = htv ? 43 : 23, first = htv ? 35 : 5;
			const struct ct_tv_rule rule = {{1, 1, 1}, 50, all, k ? 1e9 : 0, {0}};
			struct ct_consistency dc = {0};
			struct ct_tv_report r;
			float *x = volume(n), *y = volume(n);

			told = 0;
			for (size_t i = 0; i < count(n); i++)
				y[i] = i % 3 ? 100 : -50;
			must(ct_consistency_alloc(&dc, &one, n, y, 20, NULL, &err) ||
				(htv ? ct_tv_hessian : ct_tv)(x, &dc, &rule, &r, &env, &err));
			OK(r.iterations == (k ? first : all) && told == (k ? first : all + 1),
				"%s: %zu iterations", htv ? "htv" : "tv", r.iterations);
			ct_consistency_free(&dc);
			free(x);
			free(y);
		}
}

static void test_divergence(void)
{
	const struct ct_degrade one = {{1, 1, 1}, {0}, CT_DECIMATE_SINC, {0}};
	const struct ct_tv_rule rule = {{1, 1, 1}, 50, 20, 0, {0}},
				none = {{1, 1, 1}, 50, 0, 0, {0}};
	const size_t n[3] = {8, 8, 8};
	const struct ct_env env = {0};
	float *x = volume(n), *y = volume(n);
	struct ct_tv_report r;
	struct ct_consistency dc = {0};

	x[77] = (float)INFINITY;
	must(ct_consistency_alloc(&dc, &one, n, y, 1, NULL, &err));
	OK(ct_tv(x, &dc, &rule, &r, &env, &err) < 0 && err.code == CT_ENUMERIC,
		"tv: infinity is an error");
	OK(ct_tv_hessian(x, &dc, &rule, &r, &env, &err) < 0 && err.code == CT_ENUMERIC,
		"htv: likewise");
	memset(&r, 0x55, sizeof r);
	OK(ct_tv(x, &dc, &none, &r, &env, &err) == 0 && r.iterations == 0 && r.change == 0,
		"tv: a report of no iterations is of zeroes");
	memset(&r, 0x55, sizeof r);
	OK(ct_tv_hessian(x, &dc, &none, &r, &env, &err) == 0 && r.iterations == 0 && r.change == 0,
		"htv: likewise");
	ct_consistency_free(&dc);
	free(x);
	free(y);
}

/* The denoiser of Rudin, Osher and Fatemi against its formulas in double, and at its optimum. */

enum { A = 21, B = 5, C = 4, N = A * B * C };

static const size_t dim[3] = {A, B, C}, stride[3] = {1, A, A *B};

static bool last(size_t at, int a)
{
	return at / stride[a] % dim[a] == dim[a] - 1;
}

/* x = v + mu div p. */
static void primal(double *x, const float *v, double p[3][N], double mu, bool nonnegative)
{
	for (size_t i = 0; i < N; i++) {
		double div = 0;

		for (int a = 0; a < 3; a++)
			div += p[a][i] - (i / stride[a] % dim[a] ? p[a][i - stride[a]] : 0);
		x[i] = (double)v[i] + mu * div;
		if (nonnegative && !(x[i] > 0))
			x[i] = 0;
	}
}

static void dual(double p[3][N], const double *x, double step)
{
	for (size_t i = 0; i < N; i++) {
		double q[3], length = 0;

		for (int a = 0; a < 3; a++) {
			q[a] = p[a][i] + (last(i, a) ? 0 : step * (x[i + stride[a]] - x[i]));
			length += q[a] * q[a];
		}
		length = length > 1 ? sqrt(length) : 1;
		for (int a = 0; a < 3; a++)
			p[a][i] = q[a] / length;
	}
}

static double energy(const float *x, const float *v, double mu)
{
	double e = 0;

	for (size_t i = 0; i < N; i++) {
		double g = 0;

		e += pow((double)x[i] - (double)v[i], 2) / (2 * mu);
		for (int a = 0; a < 3; a++)
			g += last(i, a) ? 0 : pow((double)x[i + stride[a]] - (double)x[i], 2);
		e += sqrt(g);
	}
	return e;
}

static void steps(bool nonnegative)
{
	static double p[3][N], x[N];
	static float pf[3 * N], got[N], again[N];
	const double mu = 0.7;
	struct ct_rof r = {{A, B, C}, pf, (float)mu, nonnegative};
	float *v = normals(N, 5, nonnegative, 1);
	struct ct_err e = {0};
	struct ct_par *par = NULL;
	double worst = 0;

	memset(p, 0, sizeof p);
	memset(pf, 0, sizeof pf);
	for (int k = 0; k < 5; k++) {
		primal(x, v, p, mu, nonnegative);
		dual(p, x, 1 / (12 * mu));
	}
	primal(x, v, p, mu, nonnegative);
	ct_rof_solve(&r, got, v, 2, NULL);
	ct_rof_solve(&r, got, v, 3, NULL);
	for (size_t i = 0; i < N; i++)
		worst = fmax(worst, fabs((double)got[i] - x[i]));
	OK(worst < 1e-5, "five steps, two and then three, %snegative (%.1g)",
		nonnegative ? "not " : "", worst);
	memset(pf, 0, sizeof pf);
	if (ct_par_alloc(&par, 3, &e))
		exit(99);
	ct_rof_solve(&r, again, v, 5, par);
	ct_par_free(par);
	OK(memcmp(got, again, sizeof got) == 0, "the same bytes with three threads");
	free(v);
}

static void optimum(void)
{
	static float p[3 * N], x[N], y[N];
	struct ct_rof r = {{A, B, C}, p, 0.4F, false};
	float *v = normals(N, 6, 0, 1), *d = normals(N, 6, 1, 1e-3);
	double least, most = HUGE_VAL;

	ct_rof_solve(&r, x, v, 3000, NULL);
	least = energy(x, v, 0.4);
	for (int k = -3; k <= 3; k++) {
		for (size_t i = 0; i < N; i++)
			y[i] = x[i] + (float)k * d[i];
		if (k)
			most = fmin(most, energy(y, v, 0.4));
	}
	OK(most > least, "nothing near the solution is better (%.7g, %.7g)", most, least);
	free(v);
	free(d);
}

static void t_rof(void)
{
	steps(false);
	steps(true);
	optimum();
}

int main(void)
{
	test_step();
	test_box();
	test_ramp();
	test_thin(ct_tv, "tv");
	test_thin(ct_tv_hessian, "htv");
	test_threads(ct_tv, "tv");
	test_threads(ct_tv_hessian, "htv");
	test_report();
	test_faint();
	test_tolerance();
	test_divergence();
	t_rof();
	return tap_done();
}
