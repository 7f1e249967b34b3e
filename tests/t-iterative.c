/* t-iterative.c: SIRT, conjugate gradients and total variation against their formulas in double, on
 * a small matrix of any rows. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "numbers.h"
#include "recon/iterative.h"
#include "recon/rof.h"

#include <stdbool.h>
#include <string.h>

enum { A = 5, B = 4, C = 3, N = A * B * C, VIEWS = 9, PART = 8, M = VIEWS * PART };

static double matrix[M][N];
static const size_t dim[3] = {A, B, C};

static int forward(void *ctx, float *p, size_t views, const float *x, const struct ct_env *env,
	struct ct_err *e)
{
	(void)ctx;
	(void)env;
	(void)e;
	for (size_t r = 0; r < views * PART; r++) {
		double sum = 0;

		for (size_t i = 0; i < N; i++)
			sum += matrix[r][i] * (double)x[i];
		p[r] = (float)sum;
	}
	return 0;
}

static int adjoint(void *ctx, float *x, size_t views, const float *p, const struct ct_env *env,
	struct ct_err *e)
{
	(void)ctx;
	(void)env;
	(void)e;
	for (size_t i = 0; i < N; i++) {
		double sum = 0;

		for (size_t r = 0; r < views * PART; r++)
			sum += matrix[r][i] * (double)p[r];
		x[i] = (float)sum;
	}
	return 0;
}

static const struct ct_linear rays = {N, VIEWS, PART, forward, adjoint, NULL};

/* Few elements, none negative; a row and a column of nothing. */
static void fill(float *b)
{
	for (size_t r = 0; r < M; r++)
		for (size_t i = 0; i < N; i++) {
			double u = ct_rng_uniform(1, 2, r * N + i);

			matrix[r][i] = u < 0.7 || r == 11 || i == 17 ? 0 : u;
		}
	for (size_t r = 0; r < M; r++) {
		b[r] = 0.2F * (float)ct_rng_normal(1, 3, r);
		for (size_t i = 0; i < N; i++)
			b[r] += (float)(matrix[r][i] * (i % A < 2 ? 3 : -1 + (double)(i % 4)));
	}
}

/* q = b - A x; |q| / |b|. */
static double misfit(double q[M], const double x[N], const float *b)
{
	double sum = 0, all = 0;

	for (size_t r = 0; r < M; r++) {
		q[r] = (double)b[r];
		for (size_t i = 0; i < N; i++)
			q[r] -= matrix[r][i] * x[i];
		sum += q[r] * q[r];
		all += (double)b[r] * (double)b[r];
	}
	return sqrt(sum / all);
}

static void transpose(double s[N], const double q[M])
{
	for (size_t i = 0; i < N; i++) {
		s[i] = 0;
		for (size_t r = 0; r < M; r++)
			s[i] += matrix[r][i] * q[r];
	}
}

static double row_sum(size_t r)
{
	double sum = 0;

	for (size_t i = 0; i < N; i++)
		sum += matrix[r][i];
	return sum;
}

static double column_sum(size_t i)
{
	double sum = 0;

	for (size_t r = 0; r < M; r++)
		sum += matrix[r][i];
	return sum;
}

static double sirt(double x[N], const float *b, size_t steps, bool nonnegative)
{
	double q[M], s[N];

	for (size_t k = 0; k < steps; k++) {
		misfit(q, x, b);
		for (size_t r = 0; r < M; r++)
			q[r] /= r == 11 ? HUGE_VAL : row_sum(r);
		transpose(s, q);
		for (size_t i = 0; i < N; i++) {
			x[i] += i == 17 ? 0 : s[i] / column_sum(i);
			x[i] = nonnegative ? fmax(x[i], 0) : x[i];
		}
	}
	return misfit(q, x, b);
}

static double cgls(double x[N], const float *b, size_t steps)
{
	double q[M], s[N], d[N], gamma = 0;

	misfit(q, x, b);
	transpose(s, q);
	for (size_t i = 0; i < N; i++)
		gamma += (d[i] = s[i]) * s[i];
	for (size_t k = 0; k < steps; k++) {
		double curve = 0, next = 0;

		for (size_t r = 0; r < M; r++) {
			double sum = 0;

			for (size_t i = 0; i < N; i++)
				sum += matrix[r][i] * d[i];
			curve += sum * sum;
		}
		for (size_t i = 0; i < N; i++)
			x[i] += gamma / curve * d[i];
		misfit(q, x, b);
		transpose(s, q);
		for (size_t i = 0; i < N; i++)
			next += s[i] * s[i];
		for (size_t i = 0; i < N; i++)
			d[i] = s[i] + next / gamma * d[i];
		gamma = next;
	}
	return misfit(q, x, b);
}

/* FISTA with the denoiser of rof.h, ten steps warm. */
static double tv(double x[N], const float *b, size_t steps, double mu, bool nonnegative)
{
	static float p[3 * N];
	struct ct_rof rof = {{A, B, C}, p, (float)mu, nonnegative};
	double ahead[N], q[M], s[N], norm = 0, t = 1;

	memset(p, 0, sizeof p);
	memcpy(ahead, x, sizeof ahead);
	for (size_t i = 0; i < N; i++)
		norm = fmax(norm, column_sum(i));
	for (size_t k = 0; k < steps; k++) {
		double next = (1 + sqrt(1 + 4 * t * t)) / 2;
		float to[N], near[N];

		misfit(q, ahead, b);
		for (size_t r = 0; r < M; r++)
			q[r] /= r == 11 ? HUGE_VAL : row_sum(r);
		transpose(s, q);
		for (size_t i = 0; i < N; i++)
			to[i] = (float)(ahead[i] + s[i] / norm);
		ct_rof_solve(&rof, near, to, 10, NULL);
		for (size_t i = 0; i < N; i++) {
			ahead[i] = (double)near[i] + (t - 1) / next * ((double)near[i] - x[i]);
			x[i] = (double)near[i];
		}
		t = next;
	}
	return misfit(q, x, b);
}

static size_t calls, total;

static void count(
	const struct ct_env *env, const char *what, size_t done, size_t all, size_t likely)
{
	(void)likely;
	(void)env;
	calls += strcmp(what, "iterations") == 0 && done == calls;
	total = all;
}

static void t_same(enum ct_solver solver, bool nonnegative, double mu)
{
	static const char *const name[] = {"SIRT", "CGLS", "TV"};
	const struct ct_env env = {.progress = count};
	const size_t steps = solver == CT_CGLS ? 3 : 6; /* floats lose a digit in each of CGLS */
	struct ct_iterative_rule rule = {solver, steps, 0, nonnegative, mu};
	struct ct_iterative_report report;
	float b[M], *got = normals(N, 3, 1, 0.5);
	double x[N], residual, worst = 0, least = 0;

	fill(b);
	for (size_t i = 0; i < N; i++)
		x[i] = (double)got[i];
	residual = solver == CT_SIRT   ? sirt(x, b, steps, nonnegative)
		   : solver == CT_CGLS ? cgls(x, b, steps)
				       : tv(x, b, steps, mu, nonnegative);
	calls = total = 0;
	must(ct_iterative_solve(got, dim, &rays, b, &rule, &report, &env, &err));
	for (size_t i = 0; i < N; i++) {
		worst = fmax(worst, fabs((double)got[i] - x[i]));
		least = fmin(least, (double)got[i]);
	}
	OK(worst < 1e-4, "%s, %snegative, mu %g (%.2g)", name[solver], nonnegative ? "not " : "",
		mu, worst);
	NEAR(report.residual, residual, 1e-5, "the residual");
	OK(least >= 0 || !nonnegative, "the least is %.3g", least);
	OK(report.iterations == steps && calls == steps && total == steps,
		"%zu iterations, %zu of %zu told", report.iterations, calls, total);
	free(got);
}

/* Stops when the residual is below what is asked. */
static void t_tolerance(enum ct_solver solver)
{
	const struct ct_env env = {0};
	struct ct_iterative_report report, other;
	struct ct_iterative_rule rule = {solver, 5, 0, false, 0};
	float b[M], x[N] = {0}, y[N] = {0};

	fill(b);
	must(ct_iterative_solve(x, dim, &rays, b, &rule, &report, &env, &err));
	rule = (struct ct_iterative_rule){solver, 100, report.residual * 1.0001, false, 0};
	must(ct_iterative_solve(y, dim, &rays, b, &rule, &other, &env, &err));
	OK(other.iterations == (solver == CT_TV ? 6 : 5) && other.residual < rule.tolerance,
		"stops after %zu, at %.5g", other.iterations, other.residual);
	rule.tolerance = report.residual;
	memset(x, 0, sizeof x);
	must(ct_iterative_solve(x, dim, &rays, b, &rule, &report, &env, &err));
	/* TV looks at the volume that it steps from, and reports that of the one it writes */
	OK(solver == CT_TV ? report.iterations >= other.iterations
			   : report.iterations == other.iterations + 1,
		"and later at what it was, which is not below");
}

static void refused(
	const struct ct_iterative_rule *rule, const float *b, int code, const char *words)
{
	const struct ct_env env = {0};
	struct ct_iterative_report report;
	float x[N] = {0};

	OK(ct_iterative_solve(x, dim, &rays, b, rule, &report, &env, &err) == -1 &&
			(int)err.code == code && strstr(err.msg, words),
		"refused: %s", err.msg);
}

static void t_refused(void)
{
	const struct ct_env env = {0};
	struct ct_iterative_report report;
	float b[M], x[N] = {0}, zero[M] = {0};

	fill(b);
	refused(&(struct ct_iterative_rule){CT_CGLS, 5, 0, true, 0}, b, CT_EUSAGE, "below zero");
	refused(&(struct ct_iterative_rule){CT_TV, 5, 0, false, -1}, b, CT_EUSAGE, "weight of -1");
	refused(&(struct ct_iterative_rule){CT_TV, 5, 0, false, (double)NAN}, b, CT_EUSAGE,
		"weight of");
	for (int solver = CT_SIRT; solver <= CT_TV; solver++) {
		struct ct_iterative_rule rule = {(enum ct_solver)solver, 5, 0, false, 0};

		b[7] = INFINITY;
		refused(&rule, b, CT_ENUMERIC, "diverged after 0");
		must(ct_iterative_solve(x, dim, &rays, zero, &rule, &report, &env, &err));
		OK(report.residual == 0 && maxdiff(N, x, NULL) == 0, "nothing of nothing");
	}
	for (size_t i = 0; i < M; i++)
		b[i] = 5e36f;
	refused(&(struct ct_iterative_rule){CT_CGLS, 5, 0, false, 0}, b, CT_ENUMERIC,
		"diverged after 0");
}

int main(void)
{
	t_same(CT_SIRT, false, 0);
	t_same(CT_SIRT, true, 0);
	t_same(CT_CGLS, false, 0);
	t_same(CT_TV, false, 0);
	t_same(CT_TV, false, 0.1);
	t_same(CT_TV, true, 0.1);
	for (int solver = CT_SIRT; solver <= CT_TV; solver++)
		t_tolerance((enum ct_solver)solver);
	t_refused();
	return tap_done();
}
