/* refit.c: see refit.h. */
#include "config.h"
#include "gs/refit.h"
#include "core/mem.h"
#include "gs/prelu.h"
#include "solve/cg.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct refit {
	struct ct_fit *f;
	const struct ct_fit_data *d;
	struct ct_loss_total *w;
	const struct ct_env *env;
	struct ct_cg cg;       /* x: the unknowns, a number a Gaussian; one block at x */
	double *q, *unit;      /* A^T W A of the direction; rho of an unknown 1; one block at q */
	float *low, *dlow;     /* all coarse voxels, padded; one block at low */
	struct ct_block block; /* of them */
};

/* w->dimg = gain * (view k of what is drawn - want), want y without the base, or 0; times w. */
static void view_error(const struct refit *s, size_t k, bool want, double gain)
{
	const struct ct_fit_data *d = s->d;
	size_t pitch = ct_rasterise_pitch(d->target->w), width = d->target->w;
	const float *y = want ? ct_stack_view(d->target, k) : NULL;
	const float *b = want && !s->f->opt.full ? ct_stack_view(d->base_projections, k) : NULL;
	const float *c = d->weight ? ct_stack_view(d->weight, k) : NULL;

	for (size_t r = 0; r < d->target->h; r++) {
		float *to = s->w->dimg + r * pitch;
		const float *from = s->w->img + r * pitch;

		for (size_t i = 0, at = r * width; i < width; i++, at++)
			to[i] = (float)gain * (c ? c[at] : 1) *
				(from[i] - (y ? y[at] : 0) + (b ? b[at] : 0));
		memset(to + width, 0, (pitch - width) * sizeof *to);
	}
}

static void gather(const struct refit *s, double *out)
{
	const float *g = s->w->grad.d[CT_GS_RAW];

	for (size_t i = 0; i < s->f->g.n; i++)
		out[i] += s->unit[i] * (double)g[i];
}

/* out += k/M D^T (D x - want) in the unknowns, M coarse voxels. */
static int lowres(const struct refit *s, double *out, bool want, struct ct_err *e)
{
	const struct ct_loss_lowres *o = &s->w->low;
	const struct ct_fit_options *opt = &s->f->opt;
	size_t pitch = ct_rasterise_pitch(o->n[0]), rows = o->n[1] * o->n[2];
	double k = opt->lr / opt->l1 / ((double)rows * (double)o->n[0]);

	if (ct_mixture_plan(&s->w->vox, &s->block, s->f->g.n, s->w->gaussian, s->env->par, e))
		return -1;
	ct_mixture_draw(s->low, &s->w->vox, s->env->par);
	for (size_t r = 0; r < rows; r++) {
		for (size_t i = 0; i < o->n[0]; i++)
			s->dlow[r * pitch + i] =
				(float)k *
				(s->low[r * pitch + i] - (want ? o->want[r * o->n[0] + i] : 0));
		memset(s->dlow + r * pitch + o->n[0], 0, (pitch - o->n[0]) * sizeof(float));
	}
	memset(s->w->grad.d[CT_GS_RAW], 0, s->f->g.n * sizeof(float)); /* all that is gathered */
	ct_mixture_backward(
		&s->w->grad, &s->w->vox, s->w->gaussian, &s->f->g, s->dlow, s->env->par);
	gather(s, out);
	return 0;
}

/* out = A^T W (A x - b), b = 0 unless `want`. */
static int normal(const struct refit *s, double *out, const float *x, bool want, struct ct_err *e)
{
	const struct ct_stack *y = s->d->target;
	double c = 2 / s->f->extent, gain = c * c / (s->f->mean_weight * (double)ct_stack_count(y));

	memset(out, 0, s->f->g.n * sizeof *out);
	for (size_t i = 0; i < s->f->g.n; i++)
		s->w->gaussian[i].rho = (double)x[i] * s->unit[i];
	for (size_t k = 0; k < y->views; k++) {
		if (ct_check_stop(s->env, e) ||
			ct_loss_total_project(s->w, s->f, s->d, k, s->env, e))
			return -1;
		view_error(s, k, want, gain);
		ct_splat_backward(&s->w->grad, &s->w->splat, s->w->gaussian, &s->f->g, s->w->dimg,
			s->env->par);
		gather(s, out);
	}
	return s->w->low.want ? lowres(s, out, want, e) : 0;
}

static int along(
	void *ctx, double *curve, const float *d, const struct ct_env *env, struct ct_err *e)
{
	const struct refit *s = ctx;

	(void)env;
	if (normal(s, s->q, d, false, e))
		return -1;
	*curve = 0;
	for (size_t i = 0; i < s->cg.n; i++)
		*curve += (double)d[i] * s->q[i];
	return 0;
}

static int moved(void *ctx, float *slope, double alpha, const struct ct_env *env, struct ct_err *e)
{
	const struct refit *s = ctx;

	(void)env, (void)e;
	for (size_t i = 0; i < s->cg.n; i++)
		slope[i] = (float)((double)slope[i] - alpha * s->q[i]);
	return 0;
}

static int solve(struct refit *s, struct ct_err *e)
{
	size_t steps = s->f->opt.refit;
	bool done = false;
	double first;

	if (normal(s, s->q, s->cg.x, true, e))
		return -1;
	for (size_t i = 0; i < s->cg.n; i++)
		s->cg.s[i] = -(float)s->q[i];
	ct_cg_begin(&s->cg, s->env->par);
	first = s->cg.gamma;
	for (size_t k = 0; k < steps && !done; k++) {
		ct_progress(s->env, "densities", k, steps);
		if (ct_cg_step(&s->cg, &done, s->env, e))
			return -1;
	}
	ct_log(s->env, CT_INFO, "densities: %zu steps, gradient %.3g of what it was", steps,
		first > 0 ? sqrt(s->cg.gamma / first) : 0);
	return 0;
}

/* The error of fit.h, of all views with the same Gaussians. */
static int measure(const struct refit *s, struct ct_err *e)
{
	const struct ct_stack *y = s->d->target;
	size_t pitch = ct_rasterise_pitch(y->w);
	double sum = 0;

	ct_gaussian_resolve(s->w->gaussian, &s->f->g, s->env->par);
	for (size_t k = 0; k < y->views; k++) {
		if (ct_loss_total_project(s->w, s->f, s->d, k, s->env, e))
			return -1;
		view_error(s, k, true, 1); /* weighted */
		for (size_t i = 0; i < y->h * y->w; i++)
			sum += fabs((double)s->w->dimg[i / y->w * pitch + i % y->w]);
	}
	if (ct_check_stop(s->env, e))
		return -1;
	s->f->error = sum / s->f->mean_weight / (double)ct_stack_count(y) / s->f->residual;
	return 0;
}

static int alloc(struct refit *s, struct ct_err *e)
{
	const size_t zero[3] = {0}, *m = s->w->low.n;
	size_t n = s->f->g.n, low = ct_rasterise_pitch(m[0]) * m[1] * m[2];

	s->cg = (struct ct_cg){.n = n, .along = along, .moved = moved, .ctx = s};
	if (ct_alloc(&s->cg.x, n, 3 * sizeof(float), e) ||
		ct_alloc(&s->q, n, 2 * sizeof(double), e) ||
		(s->w->low.want && (ct_loss_lowres_block(&s->block, &s->w->low, zero, m, e) ||
					   ct_alloc(&s->low, low, 2 * sizeof(float), e))))
		return -1;
	s->cg.d = s->cg.x + n;
	s->cg.s = s->cg.d + n;
	s->unit = s->q + n;
	s->dlow = s->low ? s->low + low : NULL;
	return 0;
}

int ct_refit_densities(struct ct_fit *f, const struct ct_fit_data *d, struct ct_loss_total *w,
	const struct ct_env *env, struct ct_err *e)
{
	struct refit s = {.f = f, .d = d, .w = w, .env = env};
	struct ct_gauss *g = &f->g;
	int rc = -1;

	if (ct_loss_total_grow(w, g->n, e) || alloc(&s, e))
		goto out;
	ct_gaussian_resolve(w->gaussian, g, env->par);
	for (size_t i = 0; i < g->n; i++) {
		const double *l = w->gaussian[i].s;

		s.unit[i] = pow(f->extent / 2, 2) / pow(l[0] * l[1] * l[2], 2.0 / 3);
		s.cg.x[i] = (float)(w->gaussian[i].rho / s.unit[i]);
	}
	ct_par_heed(env->par, env->stop);
	rc = solve(&s, e);
	if (ct_check_stop(env, e) || rc) {
		rc = -1;
		goto out;
	}
	memcpy(s.cg.d, g->raw, g->n * sizeof *g->raw);
	for (size_t i = 0; i < g->n; i++)
		g->raw[i] = (float)ct_activation_inverse(
			g->activation, g->gamma, (double)s.cg.x[i] * s.unit[i]);
	rc = measure(&s, e);
	if (rc) /* as they were, to be refitted */
		memcpy(g->raw, s.cg.d, g->n * sizeof *g->raw);
out:
	ct_par_heed(env->par, NULL);
	free(s.cg.x);
	free(s.q);
	free(s.low);
	return rc;
}
