/* iterative.c: see iterative.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "recon/iterative.h"
#include "core/mem.h"
#include "recon/rof.h"
#include "solve/fista.h"
#include "solve/passes.h"
#include "solve/trend.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { INNER = 40 }; /* dual steps of the TV problem; of 10 a weight of 10 HU left ripples */

struct run {
	const struct ct_linear *a;
	const struct ct_iterative_rule *rule;
	const struct ct_env *env;
	size_t n, m;
	const float *b;
	double norm_b;
	struct ct_iterative_report *report;
	struct ct_trend trend; /* of the residual */
	struct ct_rof rof;
	float *rows, *q; /* [m]: inverse row sums; the misfit. CGLS: the misfit; A d */
};

static void fill(float *y, size_t n, float c)
{
	for (size_t k = 0; k < n; k++)
		y[k] = c;
}

static double largest(const float *y, size_t n)
{
	float most = 0;

	for (size_t k = 0; k < n; k++)
		most = y[k] > most ? y[k] : most;
	return (double)most;
}

/* 1 / the row or column sums that stand in y, 0 where they are next to nothing. */
static void invert(float *y, size_t n)
{
	const double least = 1e-6 * largest(y, n);

	for (size_t k = 0; k < n; k++)
		y[k] = (double)y[k] > least ? 1 / y[k] : 0;
}

static int diverged(const struct run *r, struct ct_err *e)
{
	return ct_fail(e, CT_ENUMERIC, "diverged after %zu iterations", r->report->iterations);
}

/* The relative norm of q into the report. */
static int measure(struct run *r, const float *q, struct ct_err *e)
{
	struct ct_iterative_report *to = r->report;
	double norm = sqrt(ct_passes_dot(r->m, q, q, r->env->par));

	to->residual = r->norm_b > 0 ? norm / r->norm_b : norm;
	if (!isfinite(to->residual))
		return diverged(r, e);
	if (to->iterations)
		ct_trend_see(&r->trend, to->iterations, to->residual);
	ct_log(r->env, CT_INFO, "iteration %zu: residual %.5f", to->iterations, to->residual);
	return 0;
}

/* q = b - A x, and its relative norm into the report. */
static int misfit(float *q, struct run *r, const float *x, struct ct_err *e)
{
	if (ct_linear_apply(r->a, q, x, r->env, e))
		return -1;
	ct_passes_advance(r->m, q, r->b, -1, r->env->par);
	return measure(r, q, e);
}

/* q <- rows q */
static void weigh(const struct run *r)
{
	ct_passes_run(CT_SIMD(ct_vector_times), r->m, &(struct ct_vector){.y = r->q, .w = r->rows},
		r->env->par);
}

static int begin(const struct run *r, struct ct_err *e)
{
	ct_progress_until(r->env, "iterations", r->report->iterations, r->rule->iterations,
		ct_trend_likely(&r->trend));
	return ct_check_stop(r->env, e);
}

/* r->rows <- 1 / the sums of the rows of A, cols <- those of its columns; g[n], work, may be cols.
 */
static int sums(const struct run *r, float *g, float *cols, struct ct_err *e)
{
	fill(g, r->n, 1);
	fill(r->q, r->m, 1);
	if (ct_linear_apply(r->a, r->rows, g, r->env, e) ||
		ct_linear_adjoint(r->a, cols, r->q, r->env, e))
		return -1;
	invert(r->rows, r->m);
	return 0;
}

static int sirt(float *x, struct run *r, struct ct_err *e)
{
	float *cols = NULL, *g = NULL;
	struct ct_vector step;
	int rc = -1;

	if (ct_alloc(&cols, r->n, sizeof *cols, e) || ct_alloc(&g, r->n, sizeof *g, e) ||
		sums(r, g, cols, e))
		goto out;
	invert(cols, r->n);
	step = (struct ct_vector){.y = x, .x = g, .w = cols, .c = r->rule->nonnegative};
	for (;; r->report->iterations++) {
		if (misfit(r->q, r, x, e))
			goto out;
		if (r->report->residual < r->rule->tolerance ||
			r->report->iterations >= r->rule->iterations)
			break;
		weigh(r);
		if (begin(r, e) || ct_linear_adjoint(r->a, g, r->q, r->env, e))
			goto out;
		ct_passes_run(CT_SIMD(ct_vector_correct), r->n, &step, r->env->par);
	}
	rc = 0;
out:
	free(cols);
	free(g);
	return rc;
}

/* On A'A x = A'b: rows the misfit, s = A' of it, d the direction, q = A d. Ends, too, where nothing
 * is left to go down. */
static int cgls(float *x, struct run *r, struct ct_err *e)
{
	struct ct_iterative_report *report = r->report;
	struct ct_par *par = r->env->par;
	float *d = NULL, *s = NULL;
	double gamma; /* |s|^2 */
	int rc = -1;

	if (ct_alloc(&d, r->n, sizeof *d, e) || ct_alloc(&s, r->n, sizeof *s, e) ||
		misfit(r->rows, r, x, e) || ct_linear_adjoint(r->a, s, r->rows, r->env, e))
		goto out;
	gamma = ct_passes_dot(r->n, s, s, par);
	memcpy(d, s, r->n * sizeof *d);
	while (gamma > 0 && report->iterations < r->rule->iterations &&
		report->residual >= r->rule->tolerance) {
		double curve, next;

		if (begin(r, e) || ct_linear_apply(r->a, r->q, d, r->env, e))
			goto out;
		curve = ct_passes_dot(r->m, r->q, r->q, par);
		if (!isfinite(curve)) {
			diverged(r, e);
			goto out;
		}
		if (!(curve > 0))
			break;
		ct_passes_add(r->n, x, gamma / curve, d, par);
		ct_passes_add(r->m, r->rows, -gamma / curve, r->q, par);
		if (ct_linear_adjoint(r->a, s, r->rows, r->env, e))
			goto out;
		report->iterations++;
		if (measure(r, r->rows, e))
			goto out;
		next = ct_passes_dot(r->n, s, s, par);
		ct_passes_advance(r->n, d, s, next / gamma, par);
		gamma = next;
	}
	rc = isfinite(gamma) ? 0 : diverged(r, e);
out:
	free(d);
	free(s);
	return rc;
}

/* g = A' R (A x - b), rows being -R. */
static int slope(void *ctx, float *g, double *value, const float *x, const struct ct_env *env,
	struct ct_err *e)
{
	struct run *r = ctx;

	if (misfit(r->q, r, x, e))
		return -1;
	*value = r->report->residual;
	weigh(r);
	return ct_linear_adjoint(r->a, g, r->q, env, e);
}

static int denoise(void *ctx, float *x, const float *to, const struct ct_env *env, struct ct_err *e)
{
	const struct run *r = ctx;

	(void)e;
	ct_rof_solve(&r->rof, x, to, INNER, env->par);
	return 0;
}

static int tv(float *x, const size_t dim[3], struct run *r, struct ct_err *e)
{
	struct ct_fista_at at = {.momentum = 1};
	struct ct_fista f = {.n = r->n, .x = x, .gradient = slope, .near = denoise, .ctx = r};
	double change;
	int rc = -1;

	r->rof = (struct ct_rof){.dim = {dim[0], dim[1], dim[2]},
		.mu = (float)r->rule->mu,
		.nonnegative = r->rule->nonnegative};
	if (ct_alloc(&f.ahead, r->n, sizeof *f.ahead, e) || ct_alloc(&f.g, r->n, sizeof *f.g, e) ||
		ct_alloc0(&r->rof.p, 3 * r->n, sizeof *r->rof.p, e) || sums(r, f.g, f.g, e))
		goto out;
	ct_passes_scale(r->m, r->rows, -1, r->env->par);
	at.norm = largest(f.g, r->n);
	at.norm = at.norm > 0 ? at.norm : HUGE_VAL;
	memcpy(f.ahead, x, r->n * sizeof *x);
	while (r->report->iterations < r->rule->iterations) {
		if (begin(r, e) || ct_fista_step(&f, &at, 1, &change, r->env, e))
			goto out;
		r->report->iterations++;
		if (r->report->residual < r->rule->tolerance)
			break;
	}
	rc = misfit(r->q, r, x, e);
out:
	free(f.ahead);
	free(f.g);
	free(r->rof.p);
	return rc;
}

int ct_iterative_solve(float *x, const size_t dim[static 3], const struct ct_linear *a,
	const float *b, const struct ct_iterative_rule *rule, struct ct_iterative_report *report,
	const struct ct_env *env, struct ct_err *e)
{
	struct run r = {.a = a,
		.rule = rule,
		.env = env,
		.n = a->in,
		.m = ct_linear_out(a),
		.b = b,
		.report = report,
		.trend = ct_trend_begin(rule->tolerance, rule->iterations)};
	int rc = -1;

	*report = (struct ct_iterative_report){0};
	if (rule->solver == CT_CGLS && rule->nonnegative)
		return ct_fail(e, CT_EUSAGE, "CGLS cannot keep values from going below zero");
	if (!(rule->mu >= 0))
		return ct_fail(e, CT_EUSAGE, "a total variation weight of %g", rule->mu);
	r.norm_b = sqrt(ct_passes_dot(r.m, b, b, env->par));
	if (ct_alloc(&r.rows, r.m, sizeof *r.rows, e) == 0 &&
		ct_alloc(&r.q, r.m, sizeof *r.q, e) == 0)
		rc = rule->solver == CT_SIRT   ? sirt(x, &r, e)
		     : rule->solver == CT_CGLS ? cgls(x, &r, e)
					       : tv(x, dim, &r, e);
	free(r.rows);
	free(r.q);
	return rc;
}
