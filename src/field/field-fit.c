/* field-fit.c: a fit from its beginning to its end (field-fit.h).
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "field/field-fit-step.h"
#include "core/clock.h"
#include "core/mem.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Items of a batch: of profile the voxels of the largest block. */
static size_t items_of(const struct ct_field_rule *r, const struct ct_field_data *d,
	const struct ct_field_operator *op)
{
	size_t m[3], n[3], all;

	if (r->samples.kind == CT_SAMPLES_RAYS)
		return r->batch + r->windows * CT_FIELD_WINDOW * CT_FIELD_WINDOW;
	if (r->samples.kind == CT_SAMPLES_PROFILE) {
		for (int a = 0; a < 3; a++)
			m[a] = r->batch < d->lr->n[a] ? r->batch : d->lr->n[a];
		ct_field_operator_most(n, op, m);
		return n[0] * n[1] * n[2];
	}
	all = ct_vol_count(d->lr);
	return r->batch && r->batch < all ? r->batch : all;
}

static int pass_alloc(
	struct ct_field_pass *p, const struct ct_field_fit *f, size_t pass, struct ct_err *e)
{
	const size_t points = f->items * ct_samples_count(&f->rule.samples, pass);
	size_t n;

	if (ct_field_alloc(&p->field, &f->rule.shape, f->seed + pass, e))
		return -1;
	n = p->field->count;
	if (f->rule.shape.network.outputs == 2) /* the bias of the density */
		p->field->weights[n - 2] = 1;
	if (ct_alloc0(&p->m, n, sizeof *p->m, e) || ct_alloc0(&p->v, n, sizeof *p->v, e) ||
		ct_alloc0(&p->grad, n, sizeof *p->grad, e) ||
		ct_alloc(&p->net, CT_FIELD_GROUPS * p->field->net, sizeof *p->net, e) ||
		ct_alloc(&p->x, 3 * points, sizeof *p->x, e))
		return -1;
	return p->field->encoded
		       ? ct_alloc(&p->dcode, points * p->field->width, sizeof *p->dcode, e)
		       : 0;
}

static int scratch_alloc(struct ct_field_scratch *s, const struct ct_field_fit *f, struct ct_err *e)
{
	const struct ct_samples *how = &f->rule.samples;
	const size_t piece = ct_field_step_piece(&f->rule), passes = ct_samples_passes(how);
	const size_t most = piece * ct_samples_count(how, passes - 1);

	for (size_t p = 0; p < passes; p++) {
		const size_t n = piece * ct_samples_count(how, p);

		if (ct_field_work_alloc(&s->work[p], f->pass[p].field, n, e) ||
			ct_alloc(&s->t[p], n, sizeof *s->t[p], e) ||
			ct_alloc(&s->w[p], n, sizeof *s->w[p], e))
			return -1;
	}
	if (ct_alloc(&s->y, 2 * most, sizeof *s->y, e) ||
		ct_alloc(&s->dy, 2 * most, sizeof *s->dy, e))
		return -1;
	return ct_alloc(&s->item, piece, sizeof *s->item, e);
}

static void scratch_free(struct ct_field_scratch *s)
{
	for (size_t p = 0; p < 2; p++) {
		ct_field_work_free(s->work[p]);
		free(s->t[p]);
		free(s->w[p]);
	}
	free(s->y);
	free(s->dy);
	free(s->item);
}

static int block_alloc(struct ct_field_fit *f, const struct ct_field_data *d, struct ct_err *e)
{
	const size_t b = f->rule.batch;
	const size_t lo = (b < d->lr->n[0] ? b : d->lr->n[0]) *
			  (b < d->lr->n[1] ? b : d->lr->n[1]) * (b < d->lr->n[2] ? b : d->lr->n[2]);

	if (ct_alloc(&f->hr[0], f->items, sizeof *f->hr[0], e) ||
		ct_alloc(&f->hr[1], f->items, sizeof *f->hr[1], e))
		return -1;
	return ct_alloc(&f->lo, lo, sizeof *f->lo, e);
}

/* Is there a ray above 0 that meets the box? */
static int check_rays(const struct ct_field_data *d, struct ct_err *e)
{
	const struct ct_stack *s = d->rays;
	const size_t n = ct_stack_count(s), area = s->h * s->w;
	bool any = false;

	for (size_t i = 0; i < n; i++) {
		struct ct_field_item it;

		if (!(s->data[i] > 0))
			continue;
		any = true;
		if (ct_field_item_ray(&it, d, i / area, i % area / s->w, i % s->w))
			return 0;
	}
	return any ? ct_fail(e, CT_EGEOM, "no ray meets the grid of OUT")
		   : ct_fail(e, CT_EINPUT, "no line integral is above 0: there is nothing to fit");
}

int ct_field_fit_init(struct ct_field_fit *f, const struct ct_field_rule *r,
	const struct ct_field_data *d, const struct ct_env *env, struct ct_err *e)
{
	const bool rays = r->samples.kind == CT_SAMPLES_RAYS;

	*f = (struct ct_field_fit){.rule = *r, .seed = env->seed, .unit = 1};
	f->workers = ct_par_threads(env->par);
	if (rays && check_rays(d, e))
		return -1;
	if (r->samples.kind == CT_SAMPLES_PROFILE &&
		ct_field_operator_alloc(&f->op, d->by, d->fine->n, e))
		return -1;
	f->items = items_of(r, d, &f->op);
	for (int a = 0; rays && a < 3; a++) { /* a row of the box: 1 / side */
		const double *b = d->box[a];

		f->unit = fmax(a ? f->unit : 0, 1 / sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2]));
	}
	for (size_t p = 0; p < ct_samples_passes(&r->samples); p++)
		if (pass_alloc(&f->pass[p], f, p, e))
			return -1;
	if (ct_alloc0(&f->own, f->workers, sizeof *f->own, e))
		return -1;
	for (size_t i = 0; i < f->workers; i++)
		if (scratch_alloc(&f->own[i], f, e))
			return -1;
	return r->samples.kind == CT_SAMPLES_PROFILE ? block_alloc(f, d, e) : 0;
}

void ct_field_fit_free(struct ct_field_fit *f)
{
	for (size_t p = 0; p < 2; p++) {
		struct ct_field_pass *in = &f->pass[p];

		ct_field_free(in->field);
		free(in->m);
		free(in->v);
		free(in->grad);
		free(in->net);
		free(in->x);
		free(in->dcode);
	}
	for (size_t i = 0; f->own && i < f->workers; i++)
		scratch_free(&f->own[i]);
	free(f->own);
	free(f->hr[0]);
	free(f->hr[1]);
	free(f->lo);
	ct_field_operator_free(&f->op);
	*f = (struct ct_field_fit){0};
}

static double weights_of(const struct ct_field_rule *r, double *encoded)
{
	const struct ct_encoding *c = &r->shape.encoding;

	*encoded = (double)ct_encoding_offset(c, ct_encoding_levels(c));
	return *encoded + (double)ct_network_count(&r->shape.network, ct_encoding_width(c));
}

int ct_field_fit_bytes(double *bytes, double *state, const struct ct_field_rule *r,
	const struct ct_field_data *d, size_t threads, struct ct_err *e)
{
	const struct ct_network *net = &r->shape.network;
	const double width = (double)ct_encoding_width(&r->shape.encoding);
	const double piece = (double)(ct_field_step_piece(r) * (r->samples.n + r->samples.fine));
	struct ct_field_operator op = {0};
	double encoded, weights = weights_of(r, &encoded), points;

	if (r->samples.kind == CT_SAMPLES_PROFILE &&
		ct_field_operator_alloc(&op, d->by, d->fine->n, e)) {
		ct_field_operator_free(&op);
		return -1;
	}
	points = (double)items_of(r, d, &op) * (double)(r->samples.n + r->samples.fine);
	ct_field_operator_free(&op);
	*state = 12 * weights;
	*bytes = 16 * weights + 4 * CT_FIELD_GROUPS * (weights - encoded) +
		 points * (12 + 4 * (encoded > 0 ? width : 0));
	if (r->samples.fine) {
		*bytes *= 2;
		*state *= 2;
	}
	if (r->samples.kind == CT_SAMPLES_PROFILE)
		*bytes += 20 * points;
	*bytes += (double)threads * piece *
		  (60 + 8 * (width + (double)(net->depth + 1) *
					     (double)(net->width + (net->skip ? 1 : 0))));
	return 0;
}

/* What part of the fit is done. */
static double part(const struct ct_field_fit *f)
{
	return f->rule.seconds > 0 ? f->used / f->rule.seconds
				   : (double)f->step / (double)f->rule.iterations;
}

static double rate_of(const struct ct_field_fit *f)
{
	const struct ct_field_rule *r = &f->rule;
	const double at = fmin(part(f), 1), k = (double)f->step;
	double rate = r->rate[0] * pow(r->rate[1] / r->rate[0], at);

	if (r->stepwise)
		rate = r->rate[at < 0.5 ? 0 : 1];
	if (f->step < r->warm)
		rate *= r->cold + (1 - r->cold) * sin(M_PI / 2 * k / (double)r->warm);
	return rate;
}

static int save(const struct ct_field_fit *f, struct ct_err *e)
{
	return f->save ? f->save(f->ctx, f, e) : 0;
}

static void tell(const struct ct_field_fit *f, const struct ct_env *env)
{
	const double tenths = 10 * f->rule.seconds;

	if (f->rule.seconds > 0)
		ct_progress(env, "fitting", (size_t)fmin(10 * f->used, tenths), (size_t)tenths);
	else
		ct_progress(env, "fitting", f->step, f->rule.iterations);
}

int ct_field_fit_run(struct ct_field_fit *f, const struct ct_field_data *d,
	const struct ct_env *env, struct ct_err *e)
{
	const double before = f->used, begun = ct_clock_cpu();

	while (!f->whole) {
		double loss;

		if (ct_stopping(env))
			return save(f, e) ? -1 : ct_check_stop(env, e);
		if (ct_field_fit_step(f, d, rate_of(f), false, &loss, env, e))
			return -1;
		f->first = f->step ? f->first : loss;
		f->last = f->step ? 0.95 * f->last + 0.05 * loss : loss;
		f->step++;
		f->used = before + ct_clock_cpu() - begun;
		f->whole = part(f) >= 1;
		tell(f, env);
		if (f->rule.every && (f->whole || f->step % f->rule.every == 0) && save(f, e))
			return -1;
	}
	return 0;
}

int ct_field_fit_cost(struct ct_cost *cost, struct ct_field_fit *f, const struct ct_field_data *d,
	const struct ct_vol *grid, const struct ct_env *env, struct ct_err *e)
{
	enum { TRIAL = 3, VOXELS = 512 };
	const struct ct_env quiet = {.par = env->par, .seed = env->seed};
	const double threads = (double)ct_par_threads(env->par);
	double begun = 0, loss, step, volume;
	struct ct_vol some = {0};
	int rc;

	for (int k = 0; k <= TRIAL; k++) {
		if (k == 1) /* the first one takes its memory */
			begun = ct_clock_cpu();
		if (ct_field_fit_step(f, d, 0, true, &loss, &quiet, e))
			return -1;
	}
	step = (ct_clock_cpu() - begun) / TRIAL;
	if (ct_vol_alloc(&some, (const size_t[]){VOXELS, 1, 1}, e))
		return -1;
	memcpy(some.affine, grid->affine, sizeof some.affine);
	begun = ct_clock_cpu();
	rc = ct_field_fit_volume(&some, f, d, &quiet, e);
	volume = (ct_clock_cpu() - begun) / VOXELS * (double)ct_vol_count(grid);
	ct_vol_free(&some);
	cost->seconds = (volume + (f->rule.seconds > 0 ? f->rule.seconds
						       : step * (double)f->rule.iterations)) /
			threads;
	snprintf(cost->work, sizeof cost->work,
		"iterations of %.3g s of processor time, and %.3g s for %.0f voxels", step, volume,
		(double)ct_vol_count(grid));
	return rc;
}
