/* fit.c: see fit.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "gs/fit.h"
#include "core/mem.h"
#include "core/rng.h"
#include "core/gauss.h"
#include "gs/place.h"
#include "gs/gaussian.h"
#include "gs/loss-total.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Standard deviations of a Gaussian, parts of the largest extent. */
#define LEAST_SIZE 0.0005
#define MOST_SIZE 0.5

static double extent_of(const struct ct_vol *v)
{
	double mm[3], most = 0;

	ct_vol_spacing(v, mm);
	for (int a = 0; a < 3; a++)
		most = fmax(most, mm[a] * (double)v->n[a]);
	return most;
}

/* What is left to explain without a Gaussian, view by view; *whole = mean |y|. */
static int measure(struct ct_fit *f, const struct ct_fit_data *d, double *whole, struct ct_err *e)
{
	const struct ct_stack *y = d->target;
	size_t pixels = y->h * y->w, count = ct_stack_count(y);
	double sum = 0;

	if (ct_alloc(&f->blank, y->views, sizeof *f->blank, e))
		return -1;
	for (size_t i = 0; d->weight && i < count; i++)
		sum += (double)d->weight->data[i];
	f->mean_weight = d->weight ? sum / (double)count : 1;
	if (!(f->mean_weight > 0))
		return ct_fail(e, CT_EINPUT, "no pixel has a weight");
	f->residual = *whole = 0;
	for (size_t k = 0; k < y->views; k++) {
		const float *a = ct_stack_view(y, k);
		const float *b = f->opt.full ? NULL : ct_stack_view(d->base_projections, k);
		const float *w = d->weight ? ct_stack_view(d->weight, k) : NULL;
		double left = 0, all = 0;

		for (size_t i = 0; i < pixels; i++) {
			double c = w ? (double)w[i] / f->mean_weight : 1;

			left += c * fabs((double)a[i] - (b ? (double)b[i] : 0));
			all += c * fabs((double)a[i]);
		}
		f->blank[k] = left / (double)pixels;
		f->residual += f->blank[k] / (double)y->views;
		*whole += all / (double)pixels / (double)y->views;
	}
	return 0;
}

/* Where a volume is dense. */
static int place_dense(
	struct ct_fit *f, const struct ct_vol *v, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_fit_options *o = &f->opt;

	return ct_place_base(&f->g, v, (double)CT_PLACE_LEAST * o->one, o->gaussians,
		o->start_density, o->compat ? -0.5 : 0, f->ln_s, env, e);
}

static int follow_residual(
	struct ct_fit *f, const struct ct_vol *field, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_fit_options *o = &f->opt;
	double cover;

	f->unit = ct_place_typical(field);
	if (ct_place_residual(&f->g, field, o->gaussians, o->start_density, f->ln_s, env, e))
		return -1;
	cover = ct_place_cover(&f->g, field) * o->rate_factor * o->density.first;
	if (o->adapt && f->unit * cover > CT_FIT_STEP)
		f->unit = CT_FIT_STEP / cover;
	return 0;
}

/* The first Gaussians. A scan that cannot be inverted has no residual to follow. */
static int place(
	struct ct_fit *f, const struct ct_fit_data *d, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_fit_options *o = &f->opt;
	struct ct_vol field = {0};
	bool base = o->from_base || o->full;
	int rc;

	if (!base && ct_place_field(&field, d->base, d->target,
			     o->from_fdk ? NULL : d->base_projections, env, e)) {
		if (e->code != CT_EGEOM)
			return -1;
		ct_log(env, CT_INFO, "Gaussians begin where the base is dense: %s", e->msg);
		base = true;
		f->unit = o->one / o->rate_factor; /* not known: the published rate of density */
	}
	if (base)
		return place_dense(f, d->base, env, e);
	rc = o->from_fdk ? place_dense(f, &field, env, e) : follow_residual(f, &field, env, e);
	ct_vol_free(&field);
	return rc;
}

static int begin(
	struct ct_fit *f, const struct ct_fit_data *d, const struct ct_env *env, struct ct_err *e)
{
	const size_t zero[3] = {0};
	double whole = 0;

	if (ct_stack_check(d->target, e) ||
		ct_block_init(&f->rule.box, d->base->affine, zero, d->base->n, e) ||
		measure(f, d, &whole, e))
		return -1;
	if (f->residual <= CT_FIT_NOTHING * whole) {
		ct_log(env, CT_INFO, "nothing to fit: the projections are those of the base");
		memcpy(f->g.grid, d->base->n, sizeof f->g.grid);
		memcpy(f->g.affine, d->base->affine, sizeof f->g.affine);
		f->end = CT_FIT_EMPTY;
		f->error = 0;
		return 0;
	}
	return ct_err_any(place(f, d, env, e) || ct_gs_adam_reserve(&f->adam, 0, f->g.n, e));
}

int ct_fit_init(struct ct_fit *f, const struct ct_fit_options *o, const struct ct_fit_data *d,
	const struct ct_env *env, struct ct_err *e)
{
	*f = (struct ct_fit){
		.opt = *o, .extent = extent_of(d->base), .error = 1, .unit = o->one, .pace = 1};
	f->ln_s[0] = log(LEAST_SIZE * f->extent);
	f->ln_s[1] = log(MOST_SIZE * f->extent);
	f->g.activation = o->activation;
	f->g.gamma = o->gamma;
	f->rule = (struct ct_densify_rule){.grad = o->densify_grad,
		.large = o->densify_large * f->extent,
		.most = o->max_gaussians,
		.least = CT_DENSIFY_LEAST * o->one,
		.by_density = o->by_density,
		.ln_least = f->ln_s[0]};
	if (!o->full && !d->base_projections)
		return ct_fail(e, CT_EINPUT, "a residual needs the projections of its base");
	if ((!o->full && ct_stack_same(d->target, d->base_projections, e)) || begin(f, d, env, e)) {
		ct_fit_free(f);
		return -1;
	}
	return 0;
}

void ct_fit_free(struct ct_fit *f)
{
	ct_gauss_free(&f->g);
	ct_gs_adam_free(&f->adam);
	free(f->blank);
	*f = (struct ct_fit){0};
}

void ct_fit_signs(const struct ct_gauss *g, size_t *positive, size_t *negative)
{
	*positive = *negative = 0;
	for (size_t i = 0; i < g->n; i++) {
		double rho = ct_activation_apply(g->activation, g->gamma, (double)g->raw[i]);

		*positive += rho > 0;
		*negative += rho < 0;
	}
}

/* One place followed through the swaps of a shuffle: no table, nothing to save. */
size_t ct_fit_view(uint64_t seed, size_t iteration, size_t views)
{
	size_t at = iteration % views, epoch = iteration / views;

	for (size_t i = 1; i < views; i++) {
		size_t j = (size_t)ct_rng_below(seed, CT_STREAM_VIEW + epoch, i, i + 1);

		if (at == i)
			at = j;
		else if (at == j)
			at = i;
	}
	return at;
}

static double rate(const struct ct_rate *r, size_t iteration, size_t iterations)
{
	double t = fmin(1, (double)iteration / (double)iterations);

	return exp((1 - t) * log(r->first) + t * log(r->last));
}

static int check_term(double x, const char *name, size_t iteration, struct ct_err *e)
{
	if (isfinite(x))
		return 0;
	return ct_fail(e, CT_ENUMERIC, "iteration %zu: the %s term of the loss is not finite",
		iteration, name);
}

/* A fit that makes a view far worse than it was goes nowhere. */
static int check_growth(
	struct ct_fit *f, double l1, size_t view, size_t iteration, struct ct_err *e)
{
	double worst;

	if (iteration == 1)
		f->first_l1 = l1;
	worst = CT_FIT_WORST * fmax(f->first_l1, fmax(f->blank[view], f->residual));
	if (l1 <= worst)
		return 0;
	return ct_fail(e, CT_ENUMERIC,
		"iteration %zu: the L1 term of the loss has diverged: mean error %g density mm, at "
		"first %g, without Gaussians %g",
		iteration, l1, f->first_l1, f->blank[view]);
}

/* Error of the epoch that this iteration ends, if it does. */
static void note_epoch(struct ct_fit *f, size_t views, size_t iteration, double l1)
{
	f->epoch_l1 += l1;
	if (iteration % views)
		return;
	f->error = f->epoch_l1 / (double)views / f->residual;
	f->epoch_l1 = 0;
	if (f->opt.tolerance > 0 && f->error <= f->opt.tolerance)
		f->end = CT_FIT_ENOUGH;
}

/* The terms of an iteration, and the gradient. f stays as it is: to be left off anywhere, with
 * CT_ESTOP soon when asked to stop. */
static int terms(const struct ct_fit *f, struct ct_loss_total *w, struct ct_loss_terms *t,
	size_t view, size_t iteration, struct ct_err *e)
{
	const struct ct_env *env = w->env;
	int rc;

	ct_par_heed(env->par, env->stop);
	ct_gaussian_resolve(w->gaussian, &f->g, env->par);
	rc = ct_loss_total_view(w, t, view, e) ||
	     (f->opt.tv > 0 && ct_loss_total_tv(w, t, iteration, e)) ||
	     (w->low.want && ct_loss_total_lowres(w, t, iteration, e));
	ct_par_heed(env->par, NULL);
	return ct_err_any(ct_check_stop(env, e) || rc);
}

/* R2-Gaussian's program makes its parameters anew when it controls their number, and then has no
 * gradient to step along; nor does it step at the end, where it may control it. */
static bool controls(const struct ct_fit_options *o, size_t iteration)
{
	size_t last = o->iterations - !o->compat; /* what is new at the end learns nothing */

	if (o->densify_until && o->densify_until < last)
		last = o->densify_until;
	return o->densify_every && iteration > o->densify_from && iteration <= last &&
	       iteration % o->densify_every == 0;
}

static void step_gamma(struct ct_fit *f, double dgamma, size_t iteration, size_t steps)
{
	const struct ct_fit_options *o = &f->opt;
	const struct ct_rate falls = {o->gamma_rate, o->gamma_last};
	const struct ct_adamw rule =
		ct_gs_adam_rule(o->gamma_last > 0 ? rate(&falls, iteration, steps) : o->gamma_rate);
	double raw;

	if (!o->gamma_soft) {
		ct_adam_scalar_step(&f->gamma, &rule, &f->g.gamma, dgamma);
		f->g.gamma = fmin(CT_GAMMA_MAX, fmax(CT_GAMMA_MIN, f->g.gamma));
		return;
	}
	raw = ct_activation_inverse(CT_SOFTPLUS, 0, f->g.gamma - CT_FIT_GAMMA_LEAST);
	ct_adam_scalar_step(
		&f->gamma, &rule, &raw, dgamma * ct_activation_slope(CT_SOFTPLUS, 0, raw));
	f->g.gamma = ct_activation_apply(CT_SOFTPLUS, 0, raw) + CT_FIT_GAMMA_LEAST;
}

static void update(struct ct_fit *f, struct ct_loss_total *w, size_t iteration)
{
	const struct ct_fit_options *o = &f->opt;
	size_t steps = o->rate_steps ? o->rate_steps : o->iterations;
	double lr[CT_GS_FIELDS], dgamma = ct_loss_total_chain(w);

	if (o->compat && (controls(o, iteration) || iteration == o->iterations))
		return;
	for (size_t k = 0; k < CT_GS_FIELDS; k++)
		lr[k] = f->pace * o->rate_factor *
			rate(k < CT_GS_SCALE    ? &o->position
				: k < CT_GS_ROT ? &o->scaling
				: k < CT_GS_RAW ? &o->rotation
						: &o->density,
				iteration, steps);
	for (size_t k = CT_GS_POS; k < CT_GS_SCALE; k++)
		lr[k] *= f->extent / 2;
	lr[CT_GS_RAW] *= f->unit;
	ct_gs_adam_step(&f->adam, &f->g, &w->grad, lr, f->ln_s, w->env->par);
	if (f->g.activation == CT_PRELU) {
		step_gamma(f, dgamma, iteration, steps);
	}
}

static int control(struct ct_fit *f, size_t iteration, const struct ct_env *env, struct ct_err *e)
{
	struct ct_densify_count n;
	float steps = f->adam.steps[0];

	if (!controls(&f->opt, iteration))
		return 0;
	if (ct_densify_control(&f->g, &f->adam, &f->rule, &n, env->seed, iteration, e))
		return -1;
	for (size_t i = 0; f->opt.compat && i < f->g.n; i++)
		f->adam.steps[i] = steps; /* one count for all */
	ct_log(env, CT_DEBUG, "iteration %zu: %zu cloned, %zu split, %zu pruned: %zu Gaussians",
		iteration, n.cloned, n.split, n.pruned, f->g.n);
	return 0;
}

/* The mean of the first epoch, and a mean that forgets an epoch ago. */
static void note_loss(struct ct_fit *f, size_t views, size_t iteration, double loss)
{
	double k = (double)(iteration < views ? iteration : views);

	f->last_loss += (loss - f->last_loss) / k;
	if (iteration <= views)
		f->first_loss = f->last_loss;
}

static int iterate(struct ct_fit *f, struct ct_loss_total *w, size_t iteration, struct ct_err *e)
{
	const struct ct_fit_options *o = &f->opt;
	const struct ct_env *env = w->env;
	size_t views = w->d->target->views, k = ct_fit_view(env->seed, iteration - 1, views);
	struct ct_loss_terms t = {0};
	double l1, total;

	if (ct_loss_total_grow(w, f->g.n, e) || terms(f, w, &t, k, iteration, e))
		return -1;
	l1 = t.l1 * f->extent / 2 * o->one; /* mm */
	if (check_term(t.l1, "L1", iteration, e) || check_term(t.dssim, "SSIM", iteration, e) ||
		check_term(t.tv, "TV", iteration, e) || check_term(t.lr, "LR", iteration, e) ||
		check_growth(f, l1, k, iteration, e))
		return -1;
	note_epoch(f, views, iteration, l1);
	ct_densify_note(&f->adam, f->g.n, &w->grad);
	total = o->l1 * t.l1 + o->ssim * t.dssim + o->tv * t.tv + o->lr * t.lr;
	note_loss(f, views, iteration, total);
	if (o->log_every && (iteration == 1 || iteration % o->log_every == 0))
		ct_log(env, CT_INFO,
			"iteration %zu: loss %.6g = %g L1 %.4g + %g (1 - %sSSIM) %.4g + %g TV %.4g + "
			"%g LR %.4g; mean %.6g, %zu Gaussians, gamma %.4g",
			iteration, total, o->l1, t.l1, o->ssim, o->multi ? "MS-" : "", t.dssim,
			o->tv, t.tv, o->lr, t.lr, f->last_loss, f->g.n, f->g.gamma);
	update(f, w, iteration);
	f->g.step = iteration;
	return control(f, iteration, env, e);
}

static int check_set(const struct ct_fit *f, struct ct_err *e)
{
	struct ct_err why;

	if (ct_gauss_check_finite(&f->g, &why) == 0)
		return 0;
	return ct_fail(e, CT_ENUMERIC, "iteration %zu: %s", f->g.step, why.msg);
}

static int save(const struct ct_fit *f, struct ct_err *e)
{
	return ct_err_any(check_set(f, e) || (f->save && f->save(f->ctx, f, e)));
}

/* After a divergence, and if it can: begin anew, half as fast. */
static int retreat(
	struct ct_fit *f, const struct ct_fit_data *d, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_fit was = *f;
	const struct ct_fit_options opt = f->opt;
	const double pace = f->pace / 2;
	const struct ct_err why = *e;

	if (e->code != CT_ENUMERIC || !opt.adapt || pace < pow(2, -CT_FIT_RETREATS))
		return -1;
	ct_log(env, CT_INFO, "%s; beginning anew with rates %g times as high", e->msg, pace);
	ct_fit_free(f);
	if (ct_fit_init(f, &opt, d, env, e)) {
		if (e->code != CT_ESTOP)
			*e = why;
		return -1;
	}
	f->pace = pace;
	f->save = was.save;
	f->ctx = was.ctx;
	f->end = CT_FIT_RUNNING;
	return 0;
}

int ct_fit_run(
	struct ct_fit *f, const struct ct_fit_data *d, const struct ct_env *env, struct ct_err *e)
{
	size_t every = f->opt.checkpoint_every;
	struct ct_loss_total w = {0};
	int rc = -1;

	if (f->end != CT_FIT_RUNNING)
		return 0;
	if (ct_loss_total_alloc(&w, f, d, env, e))
		goto out;
	if (f->g.step > 0)
		ct_progress(env, "fit", 0, 0);
	while (f->end == CT_FIT_RUNNING && f->g.step < f->opt.iterations) {
		size_t it = f->g.step + 1;

		if (ct_stopping(env)) {
			if (save(f, e) == 0)
				ct_check_stop(env, e);
			goto out;
		}
		if (iterate(f, &w, it, e) ||
			(every && it % every == 0 && it < f->opt.iterations && save(f, e))) {
			if (e->code != CT_ESTOP && retreat(f, d, env, e))
				goto out;
			continue;
		}
		ct_progress_until(env, "fit", it, f->opt.iterations,
			f->opt.tolerance > 0 ? f->opt.iterations : 0);
	}
	if (f->end == CT_FIT_RUNNING)
		f->end = CT_FIT_DONE;
	else
		ct_log(env, CT_INFO, "error %.4g after %zu iterations: good enough", f->error,
			f->g.step);
	rc = check_set(f, e);
out:
	ct_loss_total_free(&w);
	return rc;
}
