/* iterative.c: see iterative.h. */
#include "config.h"
#include "recon/iterative.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
	PIECE = 1 << 16, /* elements of one task */
	INNER = 10,      /* dual steps of the TV problem */
};

struct run {
	const struct ct_system *a;
	const struct ct_iterate_rule *rule;
	const struct ct_env *env;
	size_t n, m;
	const float *b;
	double norm_b;
	struct ct_iterate_report *report;
};

/* One pass over n elements in pieces; `sum`, if there is one, takes a partial sum each. */
struct pass {
	size_t n;
	float *y, *z;
	const float *x, *w;
	double c, *sum;
};

static void run_pass(const struct run *r, struct pass *p, ct_par_fn *fn)
{
	ct_par_for(r->env->par, (p->n + PIECE - 1) / PIECE, fn, p);
}

static size_t piece(const struct pass *p, size_t i, size_t *from)
{
	*from = i * PIECE;
	return p->n - *from < PIECE ? p->n - *from : PIECE;
}

static void dot_piece(void *arg, size_t i, size_t worker)
{
	const struct pass *p = arg;
	size_t from, n = piece(p, i, &from);
	double sum[8] = {0};

	(void)worker;
	for (size_t k = 0; k < n; k++)
		sum[k % 8] += (double)p->x[from + k] * (double)p->w[from + k];
	for (int k = 1; k < 8; k++)
		sum[0] += sum[k];
	p->sum[i] = sum[0];
}

/* <x, w> */
static int dot(double *out, const struct run *r, size_t n, const float *x, const float *w,
	struct ct_err *e)
{
	size_t pieces = (n + PIECE - 1) / PIECE;
	struct pass p = {.n = n, .x = x, .w = w};

	if (ct_alloc(&p.sum, pieces, sizeof *p.sum, e))
		return -1;
	run_pass(r, &p, dot_piece);
	*out = 0;
	for (size_t i = 0; i < pieces; i++)
		*out += p.sum[i];
	free(p.sum);
	return 0;
}

/* y += c x */
static void add_piece(void *arg, size_t i, size_t worker)
{
	const struct pass *p = arg;
	size_t from, n = piece(p, i, &from);
	float c = (float)p->c;

	(void)worker;
	for (size_t k = from; k < from + n; k++)
		p->y[k] += c * p->x[k];
}

/* y = x + c y */
static void advance_piece(void *arg, size_t i, size_t worker)
{
	const struct pass *p = arg;
	size_t from, n = piece(p, i, &from);
	float c = (float)p->c;

	(void)worker;
	for (size_t k = from; k < from + n; k++)
		p->y[k] = p->x[k] + c * p->y[k];
}

/* y += w x; c > 0: and no less than 0 */
static void correct_piece(void *arg, size_t i, size_t worker)
{
	const struct pass *p = arg;
	size_t from, n = piece(p, i, &from);

	(void)worker;
	for (size_t k = from; k < from + n; k++)
		p->y[k] += p->w[k] * p->x[k];
	if (p->c > 0)
		for (size_t k = from; k < from + n; k++)
			p->y[k] = p->y[k] > 0 ? p->y[k] : 0;
}

/* y = x - y */
static void misfit_piece(void *arg, size_t i, size_t worker)
{
	const struct pass *p = arg;
	size_t from, n = piece(p, i, &from);

	(void)worker;
	for (size_t k = from; k < from + n; k++)
		p->y[k] = p->x[k] - p->y[k];
}

/* y *= w */
static void times_piece(void *arg, size_t i, size_t worker)
{
	const struct pass *p = arg;
	size_t from, n = piece(p, i, &from);

	(void)worker;
	for (size_t k = from; k < from + n; k++)
		p->y[k] *= p->w[k];
}

/* y = 1/y, 0 where y is next to nothing (below c). */
static void invert_piece(void *arg, size_t i, size_t worker)
{
	const struct pass *p = arg;
	size_t from, n = piece(p, i, &from);

	(void)worker;
	for (size_t k = from; k < from + n; k++)
		p->y[k] = (double)p->y[k] > p->c ? 1 / p->y[k] : 0;
}

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

/* 1 / the row or column sums that stand in y. */
static void invert(const struct run *r, float *y, size_t n)
{
	struct pass p = {.n = n, .y = y, .c = 1e-6 * largest(y, n)};

	run_pass(r, &p, invert_piece);
}

/* q = b - A x, and its relative norm into the report. */
static int misfit(float *q, const struct run *r, const float *x, struct ct_err *e)
{
	struct pass p = {.n = r->m, .y = q, .x = r->b};
	double qq;

	if (r->a->forward(r->a->ctx, q, x, e))
		return -1;
	run_pass(r, &p, misfit_piece);
	if (dot(&qq, r, r->m, q, q, e))
		return -1;
	r->report->residual = r->norm_b > 0 ? sqrt(qq) / r->norm_b : sqrt(qq);
	if (!isfinite(r->report->residual))
		return ct_fail(e, CT_ENUMERIC, "iteration %zu diverged", r->report->iterations + 1);
	ct_log(r->env, CT_INFO, "iteration %zu: residual %.5f", r->report->iterations,
		r->report->residual);
	return 0;
}

static int begin(const struct run *r, struct ct_err *e)
{
	ct_progress(r->env, "iterations", r->report->iterations, r->rule->iterations);
	return ct_check_stop(r->env, e);
}

static int sirt(float *x, const struct run *r, struct ct_err *e)
{
	float *rows = NULL, *cols = NULL, *q = NULL, *g = NULL;
	struct pass weigh, step;
	int rc = -1;

	if (ct_alloc(&rows, r->m, sizeof *rows, e) || ct_alloc(&q, r->m, sizeof *q, e) ||
		ct_alloc(&cols, r->n, sizeof *cols, e) || ct_alloc(&g, r->n, sizeof *g, e))
		goto out;
	fill(g, r->n, 1);
	fill(q, r->m, 1);
	if (r->a->forward(r->a->ctx, rows, g, e) || r->a->adjoint(r->a->ctx, cols, q, e))
		goto out;
	invert(r, rows, r->m);
	invert(r, cols, r->n);
	weigh = (struct pass){.n = r->m, .y = q, .w = rows};
	step = (struct pass){.n = r->n, .y = x, .x = g, .w = cols, .c = r->rule->nonnegative};
	for (; r->report->iterations < r->rule->iterations; r->report->iterations++) {
		if (begin(r, e) || misfit(q, r, x, e))
			goto out;
		if (r->report->residual < r->rule->tolerance)
			break;
		run_pass(r, &weigh, times_piece);
		if (r->a->adjoint(r->a->ctx, g, q, e))
			goto out;
		run_pass(r, &step, correct_piece);
	}
	rc = 0;
out:
	free(rows);
	free(cols);
	free(q);
	free(g);
	return rc;
}

static int cgls(float *x, const struct run *r, struct ct_err *e)
{
	float *d = NULL, *s = NULL, *res = NULL, *q = NULL;
	double gamma, next, qq, rr;
	int rc = -1;

	if (ct_alloc(&d, r->n, sizeof *d, e) || ct_alloc(&s, r->n, sizeof *s, e) ||
		ct_alloc(&res, r->m, sizeof *res, e) || ct_alloc(&q, r->m, sizeof *q, e) ||
		misfit(res, r, x, e) || r->a->adjoint(r->a->ctx, s, res, e) ||
		dot(&gamma, r, r->n, s, s, e))
		goto out;
	memcpy(d, s, r->n * sizeof *d);
	while (r->report->iterations < r->rule->iterations && gamma > 0 &&
		r->report->residual >= r->rule->tolerance) {
		if (begin(r, e) || r->a->forward(r->a->ctx, q, d, e) || dot(&qq, r, r->m, q, q, e))
			goto out;
		if (!(qq > 0))
			break;
		run_pass(r, &(struct pass){.n = r->n, .y = x, .x = d, .c = gamma / qq}, add_piece);
		run_pass(r, &(struct pass){.n = r->m, .y = res, .x = q, .c = -gamma / qq},
			add_piece);
		if (r->a->adjoint(r->a->ctx, s, res, e) || dot(&next, r, r->n, s, s, e) ||
			dot(&rr, r, r->m, res, res, e))
			goto out;
		run_pass(r, &(struct pass){.n = r->n, .y = d, .x = s, .c = next / gamma},
			advance_piece);
		gamma = next;
		r->report->iterations++;
		r->report->residual = r->norm_b > 0 ? sqrt(rr) / r->norm_b : sqrt(rr);
		if (!isfinite(r->report->residual + gamma)) {
			ct_fail(e, CT_ENUMERIC, "iteration %zu diverged", r->report->iterations);
			goto out;
		}
		ct_log(r->env, CT_INFO, "iteration %zu: residual %.5f", r->report->iterations,
			r->report->residual);
	}
	rc = 0;
out:
	free(d);
	free(s);
	free(res);
	free(q);
	return rc;
}

/* Planes of the inner problem of TV: z = v + mu div p, p <- p + grad z / (12 mu), |p| <= 1. */
struct dual {
	const size_t *dim;
	float *z, *p[3];
	const float *v;
	float mu;
	bool nonnegative;
};

static void primal_plane(void *arg, size_t k, size_t worker)
{
	const struct dual *d = arg;
	size_t w = d->dim[0], plane = w * d->dim[1];

	(void)worker;
	for (size_t j = 0; j < d->dim[1]; j++) {
		size_t row = k * plane + j * w;
		const float *restrict px = d->p[0] + row, *restrict py = d->p[1] + row,
				      *restrict pz = d->p[2] + row;
		const float *restrict v = d->v + row;
		float *restrict z = d->z + row;

		for (size_t i = 0; i < w; i++) { /* p is 0 at the last voxel of its axis */
			float div = px[i] + py[i] + pz[i];

			div -= i ? px[i - 1] : 0;
			div -= j ? py[(ptrdiff_t)i - (ptrdiff_t)w] : 0;
			div -= k ? pz[(ptrdiff_t)i - (ptrdiff_t)plane] : 0;
			z[i] = v[i] + d->mu * div;
		}
		if (d->nonnegative)
			for (size_t i = 0; i < w; i++)
				z[i] = z[i] > 0 ? z[i] : 0;
	}
}

static void dual_plane(void *arg, size_t k, size_t worker)
{
	const struct dual *d = arg;
	size_t w = d->dim[0], plane = w * d->dim[1];
	float step = 1 / (12 * d->mu);

	(void)worker;
	for (size_t j = 0; j < d->dim[1]; j++) {
		size_t row = k * plane + j * w;
		float *restrict px = d->p[0] + row, *restrict py = d->p[1] + row,
				*restrict pz = d->p[2] + row;
		const float *restrict z = d->z + row;
		bool last_j = j + 1 == d->dim[1], last_k = k + 1 == d->dim[2];

		for (size_t i = 0; i < w; i++) {
			float gx = i + 1 < w ? z[i + 1] - z[i] : 0;
			float gy = last_j ? 0 : z[i + w] - z[i];
			float gz = last_k ? 0 : z[i + plane] - z[i];
			float x = px[i] + step * gx, y = py[i] + step * gy, t = pz[i] + step * gz;
			float len = sqrtf(x * x + y * y + t * t);
			float scale = len > 1 ? 1 / len : 1;

			px[i] = scale * x;
			py[i] = scale * y;
			pz[i] = scale * t;
		}
	}
}

/* z <- z + c (z - y), y <- the old z: the extrapolation of FISTA. */
static void extrapolate_piece(void *arg, size_t i, size_t worker)
{
	const struct pass *p = arg;
	size_t from, n = piece(p, i, &from);
	float c = (float)p->c;

	(void)worker;
	for (size_t k = from; k < from + n; k++) {
		float now = p->z[k];

		p->z[k] = now + c * (now - p->y[k]);
		p->y[k] = now;
	}
}

static int tv(float *x, const struct run *r, struct ct_err *e)
{
	float *rows = NULL, *q = NULL, *v = NULL, *y = NULL, *p = NULL;
	double t = 1, step;
	struct dual d;
	int rc = -1;

	if (ct_alloc(&rows, r->m, sizeof *rows, e) || ct_alloc(&q, r->m, sizeof *q, e) ||
		ct_alloc(&v, r->n, sizeof *v, e) || ct_alloc(&y, r->n, sizeof *y, e) ||
		ct_alloc0(&p, 3 * r->n, sizeof *p, e))
		goto out;
	fill(v, r->n, 1);
	fill(q, r->m, 1);
	if (r->a->forward(r->a->ctx, rows, v, e) || r->a->adjoint(r->a->ctx, v, q, e))
		goto out;
	invert(r, rows, r->m);
	step = largest(v, r->n);
	step = step > 0 ? 1 / step : 0;
	d = (struct dual){.dim = r->a->dim,
		.z = y,
		.p = {p, p + r->n, p + 2 * r->n},
		.v = v,
		.mu = (float)r->rule->mu,
		.nonnegative = r->rule->nonnegative};
	memcpy(y, x, r->n * sizeof *y);
	for (; r->report->iterations < r->rule->iterations; r->report->iterations++) {
		double next = (1 + sqrt(1 + 4 * t * t)) / 2;

		if (begin(r, e) || misfit(q, r, y, e))
			goto out;
		if (r->report->residual < r->rule->tolerance)
			break;
		run_pass(r, &(struct pass){.n = r->m, .y = q, .w = rows}, times_piece);
		if (r->a->adjoint(r->a->ctx, v, q, e))
			goto out;
		run_pass(r, &(struct pass){.n = r->n, .y = v, .x = y, .c = step}, advance_piece);
		for (int i = 0; i < INNER && d.mu > 0; i++) {
			ct_par_for(r->env->par, d.dim[2], primal_plane, &d);
			ct_par_for(r->env->par, d.dim[2], dual_plane, &d);
		}
		ct_par_for(r->env->par, d.dim[2], primal_plane, &d);
		run_pass(r, &(struct pass){.n = r->n, .y = x, .z = y, .c = (t - 1) / next},
			extrapolate_piece);
		t = next;
	}
	rc = 0;
out:
	free(rows);
	free(q);
	free(v);
	free(y);
	free(p);
	return rc;
}

int ct_iterate(float *x, const struct ct_system *a, const float *b,
	const struct ct_iterate_rule *rule, struct ct_iterate_report *report,
	const struct ct_env *env, struct ct_err *e)
{
	struct run r = {.a = a,
		.rule = rule,
		.env = env,
		.n = a->dim[0] * a->dim[1] * a->dim[2],
		.m = a->m,
		.b = b,
		.report = report};
	double bb;

	*report = (struct ct_iterate_report){0};
	if (rule->solver == CT_CGLS && rule->nonnegative)
		return ct_fail(e, CT_EUSAGE, "CGLS cannot keep values from going below zero");
	if (!(rule->mu >= 0))
		return ct_fail(e, CT_EUSAGE, "a total variation weight of %g", rule->mu);
	if (dot(&bb, &r, r.m, b, b, e))
		return -1;
	r.norm_b = sqrt(bb);
	switch (rule->solver) {
	case CT_SIRT: return sirt(x, &r, e);
	case CT_CGLS: return cgls(x, &r, e);
	case CT_TV: break;
	}
	return tv(x, &r, e);
}
