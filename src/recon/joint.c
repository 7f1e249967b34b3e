/* joint.c: see joint.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "recon/joint.h"
#include "core/mem.h"
#include "solve/passes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
	POWER = 5, /* applications of P' W F P that measure its norm */
	TRIES = 9, /* values of mu to choose from */
	SUMS = 4,
};

#define LEAST_GAIN 0.05 /* of the filter */
#define HIGHEST 1.6     /* mu to begin with, of the first step */
#define UNCHOSEN 0.25   /* and if there are too few views to choose it */
#define FALL 0.7        /* of mu in a step of the choice; its TRIES make 0.1 of the first step */
#define SLOWLY 0.85     /* and when all views are fitted, which pays: edges first */
#define TOLD 1.5        /* or faster: a mu that was told is reached in 1 / TOLD of the iterations */
/* What is best with all views is more than what predicts best from half: measured, with errors as
 * large as what is true, 2; with small ones 1. */
#define MARGIN 1.5
#define GIVE_UP 0.02 /* the choice is made when the prediction is worse than its best by this */
/* The norm of P' W F P of all views, and of half of them, in that of a quarter: with F views hardly
 * overlap. Measured 1.2 to 1.3 and less; FISTA bears a step of 4/3 / L. */
#define NORM_ALL 1.4
#define NORM_HALF 1.2
#define PATIENCE 1.2 /* the misfit grows by more: the norm was more */

/* At d pixels the samples of sinc^2, whose transform is a triangle; by: f0. */
static double triangle(double d, const double *by)
{
	const double a = M_PI * by[0] * d;

	return d == 0 ? 1 : sin(a) / a * (sin(a) / a);
}

/* F: one less their average; by: f0, and their sum. */
static double gain(double d, const double *by)
{
	return (d == 0) - (1 - LEAST_GAIN) * triangle(d, by) / by[1];
}

static int make_filter(struct ct_taps *t, size_t views, size_t w, struct ct_err *e)
{
	double by[2] = {fmin(0.5, 2 * (double)views / (M_PI * (double)w)), 0};
	const double half = fmin(floor(2 / by[0]), (double)w - 1);

	for (double d = -half; d <= half; d++)
		by[1] += triangle(d, by);
	return ct_taps_filter(t, w, (size_t)half, gain, by, e);
}

int ct_joint_alloc(struct ct_joint *j, const struct ct_degrade *d, const size_t n[static 3],
	const float *z, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_linear *r = j->rays;
	size_t threads = ct_par_threads(env->par), m = 1, view = r->part;
	float *zero = NULL;
	int rc = -1;

	if (!(j->rule.mu >= 0 && isfinite(j->rule.mu)))
		return ct_fail(e, CT_EUSAGE, "a weight of the total variation of %g", j->rule.mu);
	for (int a = 0; a < 3; a++)
		m *= ct_degrade_size(n[a], d->factor[a]);
	j->n = n[0] * n[1] * n[2];
	if (make_filter(&j->filter, r->parts, j->cols, e) ||
		ct_consistency_alloc(&j->dc, d, n, z, 0, env->par, e) ||
		ct_alloc0(&zero, m, sizeof *zero, e) ||
		ct_consistency_alloc(&j->null, d, n, zero, 0, env->par, e))
		goto out;
	j->taps = ct_taps_scratch(&j->filter, NULL);
	j->share = 2 * j->taps + view;
	j->share += j->share % 2; /* doubles stand at its beginning */
	if (ct_alloc(&j->x, j->n, sizeof(float), e) ||
		ct_alloc(&j->ahead, j->n, sizeof(float), e) ||
		ct_alloc(&j->g, j->n, sizeof(float), e) ||
		ct_alloc0(&j->dual, CT_TV_DUAL * j->n, sizeof *j->dual, e) ||
		ct_alloc(&j->q, ct_linear_out(r), sizeof(float), e) ||
		ct_alloc(&j->scratch, threads * j->share, sizeof(float), e) ||
		ct_alloc(&j->sums, SUMS * r->parts, sizeof(double), e))
		goto out;
	rc = 0;
out:
	free(zero);
	return rc;
}

void ct_joint_free(struct ct_joint *j)
{
	free(j->x);
	free(j->ahead);
	free(j->dual);
	free(j->g);
	free(j->q);
	free(j->scratch);
	free(j->sums);
	ct_consistency_free(&j->dc);
	ct_consistency_free(&j->null);
	ct_taps_free(&j->filter);
	j->x = j->ahead = j->g = j->q = j->scratch = NULL;
	j->dual = NULL;
	j->sums = NULL;
}

/* The views of q, each of which adds to its sums. */
struct pass {
	struct ct_joint *j;
	size_t fit; /* views to fit */
	bool data;  /* q is what P makes of a volume, to be compared with y */
};

/* Views below `fit`: q <- W^(1/2) F W^(1/2) (q - y), sum 0 the misfit. Others: sums 1 to 3 are
 * |c|^2, <c, b>, |b|^2, c = q - y + b. */
static void view_task(void *arg, size_t v, size_t worker)
{
	const struct pass *p = arg;
	const struct ct_joint *j = p->j;
	size_t n = j->rays->part, from = v * n;
	double *taps = (double *)(void *)(j->scratch + worker * j->share), sum[SUMS] = {0};
	float *row = (float *)(taps + j->taps), *q = j->q + from;

	for (size_t i = 0; i < n; i++) {
		double w = j->weight ? (double)j->weight[from + i] : 1;
		double r = (double)q[i] - (p->data ? (double)j->y[from + i] : 0);

		if (v < p->fit) {
			sum[0] += w * r * r;
			row[i] = (float)(sqrt(w) * r);
		} else {
			double b = (double)j->gap[from + i], c = r + b;

			sum[1] += w * c * c;
			sum[2] += w * c * b;
			sum[3] += w * b * b;
		}
	}
	memcpy(j->sums + SUMS * v, sum, sizeof sum);
	if (v >= p->fit)
		return;
	ct_taps_apply(
		q, row, (const size_t[3]){j->cols, n / j->cols, 1}, 0, &j->filter, taps, NULL);
	for (size_t i = 0; i < n && j->weight; i++)
		q[i] *= sqrtf(j->weight[from + i]);
}

/* q <- W^(1/2) F W^(1/2) (q - y) of the views below `fit`, and what they and the others, below
 * `views`, sum to. */
static void weigh(struct ct_joint *j, size_t fit, size_t views, bool data, struct ct_par *par)
{
	struct pass p = {.j = j, .fit = fit, .data = data};

	ct_par_for(par, views, view_task, &p);
	memset(j->at.total, 0, sizeof j->at.total);
	for (size_t v = 0; v < views; v++)
		for (int s = 0; s < SUMS; s++)
			j->at.total[s] += j->sums[SUMS * v + (size_t)s];
}

/* g <- P' W F (P x - y) of the views to be fitted; the others are predicted. */
static int gradient(void *ctx, float *g, double *misfit, const float *x, const struct ct_env *env,
	struct ct_err *e)
{
	struct ct_joint *j = ctx;
	const struct ct_linear *r = j->rays;
	int rc;

	ct_par_heed(env->par, env->stop);
	rc = ct_linear_apply(r, j->q, x, env, e);
	if (rc == 0) {
		weigh(j, j->fit, r->parts, true, env->par);
		rc = r->adjoint(r->ctx, g, j->fit, j->q, env, e);
	}
	ct_par_heed(env->par, NULL);
	if (ct_check_stop(env, e) || rc)
		return -1;
	*misfit = j->at.total[0];
	return isfinite(*misfit)
		       ? 0
		       : ct_fail(e, CT_ENUMERIC, "iteration %zu diverged", j->at.done + 1);
}

/* Norm of P' W F P of the first quarter of the views, by the power method from P' W F gap within
 * what D does not see. x is not touched. */
static int measure_norm(struct ct_joint *j, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_linear *r = j->rays;
	size_t quarter = (r->parts + 3) / 4;
	double rms = 0;

	memcpy(j->q, j->gap, quarter * r->part * sizeof *j->q);
	for (int k = 0;; k++) {
		weigh(j, quarter, quarter, false, env->par);
		if (r->adjoint(r->ctx, j->g, quarter, j->q, env, e))
			return -1;
		ct_consistency_apply(&j->null, j->g, env->par);
		memset(j->ahead, 0, j->n * sizeof *j->ahead);
		rms = ct_passes_lead(j->n, j->ahead, j->g, 0, env->par);
		if (k == POWER || rms == 0)
			break;
		ct_passes_scale(j->n, j->ahead, 1 / rms, env->par);
		if (r->forward(r->ctx, j->q, quarter, j->ahead, env, e))
			return -1;
	}
	if (!isfinite(rms))
		return ct_fail(e, CT_ENUMERIC, "projections are not finite");
	j->at.fista.norm = rms;
	return 0;
}

/* The first step in data, `to`, where D allows it: RMS. x and ahead are the same before and after.
 */
static void measure_first(struct ct_joint *j, const float *to, const struct ct_env *env)
{
	memcpy(j->ahead, to, j->n * sizeof *to);
	ct_consistency_apply(&j->dc, j->ahead, env->par);
	j->at.first = ct_passes_lead(j->n, j->ahead, j->x, 0, env->par);
	j->at.mu = fmax(HIGHEST * j->at.first, j->rule.mu);
}

static int near(void *ctx, float *x, const float *to, const struct ct_env *env, struct ct_err *e)
{
	struct ct_joint *j = ctx;
	struct ct_joint_at *at = &j->at;
	struct ct_tv_rule rule = {.iterations = CT_JOINT_SWEEPS - at->sweeps};
	const struct ct_env quiet = {.par = env->par, .stop = env->stop};
	struct ct_tv_report report;
	int rc;

	if (at->first == 0)
		measure_first(j, to, env);
	if (at->first == 0)
		return 0;
	memcpy(rule.weight, j->rule.weight, sizeof rule.weight);
	rule.step = at->mu * sqrt(ct_tv_norm(rule.weight, j->dc.n));
	rule.near = (struct ct_tv_near){to, at->mu, j->dual};
	rc = ct_tv(x, &j->dc, &rule, &report, &quiet, e);
	at->sweeps = rc == 0 ? 0 : at->sweeps + report.iterations;
	return rc;
}

/* One step of FISTA on the views below `fit`. */
static int step(struct ct_joint *j, size_t fit, const struct ct_env *env, struct ct_err *e)
{
	struct ct_joint_at *at = &j->at;
	const bool all = fit == j->rays->parts;
	const struct ct_fista f = {j->n, j->x, j->ahead, j->g, PATIENCE, gradient, near, j};
	double moved;

	j->fit = fit;
	if (ct_fista_step(&f, &at->fista, all ? NORM_ALL : NORM_HALF, &moved, env, e))
		return -1;
	ct_log(env, CT_INFO, "%s %zu: mu %.4g, misfit %.4g, moved %.3g",
		all ? "iteration" : "choice", at->done + 1, at->mu, sqrt(j->at.total[0]), moved);
	return 0;
}

/* Before the step whose sums these are, x came of mu: how well did it predict? */
static bool judge(struct ct_joint *j, double mu)
{
	struct ct_joint_at *at = &j->at;
	const double *total = j->at.total;
	double c = total[1] / total[3], cb = total[2] / total[3], off = 1 + c - 2 * cb;

	at->trust = fmin(at->trust, c - 3 * cb);
	if (off < at->best) {
		at->best = off;
		at->chosen = mu;
	}
	return off > at->best + GIVE_UP && at->trust < 0 && at->chosen > 0;
}

static int choose(struct ct_joint *j, const struct ct_env *env, struct ct_err *e)
{
	struct ct_joint_at *at = &j->at;
	double mu = at->mu / FALL; /* of the iteration before */
	size_t fit = (j->rays->parts + 1) / 2;
	bool over;

	if (step(j, fit, env, e))
		return -1;
	over = at->first == 0 || !(j->at.total[3] > 0) || (at->done > 0 && judge(j, mu)) ||
	       ++at->done >= TRIES;
	if (!over) {
		at->mu *= FALL;
		return 0;
	}
	at->trusted = at->trust < 0;
	at->chosen = MARGIN * (at->chosen > 0 ? at->chosen : at->mu);
	ct_log(env, CT_INFO,
		"projections predict each other: %.3f of the misfit is left, mu %.4g%s", at->best,
		at->chosen, at->trusted ? "" : ": not trusted");
	at->mu = fmax(at->chosen, at->first);
	at->fista.momentum = 1;
	at->fista.misfit = 0;
	at->done = 0;
	at->phase = at->trusted ? CT_JOINT_SOLVE : CT_JOINT_DONE;
	memcpy(j->ahead, j->x, j->n * sizeof *j->x);
	return 0;
}

/* By how much mu falls in a step with all views. */
static double fall(const struct ct_joint *j)
{
	const double part = j->rule.mu / (HIGHEST * j->at.first);

	return part > 0 ? fmin(SLOWLY, pow(part, TOLD / (double)j->rule.iterations)) : SLOWLY;
}

static int solve(struct ct_joint *j, const struct ct_env *env, struct ct_err *e)
{
	struct ct_joint_at *at = &j->at;

	if (step(j, j->rays->parts, env, e))
		return -1;
	at->done++;
	if (at->chosen == 0)
		at->chosen = j->rule.mu > 0 ? j->rule.mu : UNCHOSEN * at->first;
	at->mu = fmax(at->mu * fall(j), at->chosen);
	if (at->done >= j->rule.iterations || at->first == 0)
		at->phase = CT_JOINT_DONE;
	return 0;
}

static int begin(struct ct_joint *j, const struct ct_env *env, struct ct_err *e)
{
	int rc;

	ct_par_heed(env->par, env->stop);
	rc = measure_norm(j, env, e);
	ct_par_heed(env->par, NULL);
	if (ct_check_stop(env, e) || rc)
		return -1;
	j->at.fista.momentum = j->at.best = 1;
	j->at.trust = 0;
	j->at.trusted = true;
	memcpy(j->ahead, j->x, j->n * sizeof *j->x);
	j->at.phase = j->at.fista.norm == 0 || j->rule.iterations == 0    ? CT_JOINT_DONE
		      : j->rule.mu > 0 || j->rays->parts < CT_JOINT_TESTS ? CT_JOINT_SOLVE
									  : CT_JOINT_CHOOSE;
	return 0;
}

int ct_joint_run(struct ct_joint *j, const struct ct_env *env, struct ct_err *e)
{
	struct ct_joint_at *at = &j->at;
	size_t tries = j->rule.mu > 0 || j->rays->parts < 4 ? 0 : TRIES;
	int rc = 0;

	while (rc == 0 && at->phase != CT_JOINT_DONE) {
		size_t before = at->phase == CT_JOINT_SOLVE ? tries : 0;

		ct_progress_until(env, "iterations", before + at->done, tries + j->rule.iterations,
			tries ? tries + j->rule.iterations : 0);
		if (at->phase == CT_JOINT_NEW)
			rc = begin(j, env, e);
		else
			rc = (at->phase == CT_JOINT_CHOOSE ? choose : solve)(j, env, e);
		if (rc == 0)
			rc = ct_check_stop(env, e);
		if (j->save && ((rc && e->code == CT_ESTOP) ||
				       (rc == 0 && j->rule.every && at->done % j->rule.every == 0)))
			rc = j->save(j->ctx, j, e) ? -1 : rc;
	}
	if (rc == 0)
		ct_progress(env, "iterations", 1, 1);
	return rc;
}
