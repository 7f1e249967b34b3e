/* fit.c: see fit.h. */
#include "config.h"
#include "gs/fit.h"
#include "core/mem.h"
#include "core/rng.h"
#include "gs/act.h"
#include "gs/init.h"
#include "gs/stream.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void ct_fit_defaults(struct ct_fit_options *o, size_t scale, bool full, enum ct_activation a)
{
	bool unsigned_density = a == CT_SOFTPLUS || a == CT_RELU;
	double fine = scale >= 8 ? 0.1 : 1;

	*o = (struct ct_fit_options){
		.iterations = 5000,
		.gaussians = 50000,
		.max_gaussians = 500000,
		.activation = a,
		.full = full,
		/* 0.15 is R2-Gaussian's; for a signed residual 0.05 ended 0.1 to 0.25 dB better
		 * than 0 on a phantom, a chest and a torso, 0.15 not better than 0.05 */
		.init_density = full || unsigned_density ? 0.15 : 0.05,
		.l1 = 1,
		.res = full ? 0 : 1,
		.ssim = full ? 0.25 : 0.5,
		.tv = 0.05,
		.position = {2e-4, 2e-5},
		.density = {1e-2, 1e-3},
		.scaling = {5e-3 * fine, 5e-4 * fine},
		.rotation = {1e-3 * fine, 1e-4 * fine},
		.gamma_rate = 1e-3,
		.s_least = 0.0005,
		.s_most = 0.5,
		.densify_from = 500,
		.densify_every = 100,
		.densify_grad = 5e-5,
		.densify_large = 0.1,
		.tv_block = 32,
		.log_every = 500,
		.checkpoint_every = 1000,
	};
}

/* Scratch of the loop. */
struct work {
	struct ct_blob *blob;
	size_t blobs;
	struct ct_splat splat;
	struct ct_voxels vox;
	struct ct_gs_grad grad;
	struct ct_loss loss;
	float *img, *dimg;	      /* h x pitch */
	float *block, *dblock, *crop; /* of the TV block; crop without padding */
	double *dgamma;
	size_t dgammas;
};

static void work_free(struct work *w)
{
	free(w->blob);
	ct_splat_free(&w->splat);
	ct_voxels_free(&w->vox);
	ct_gs_grad_free(&w->grad);
	ct_loss_free(&w->loss);
	free(w->img);
	free(w->dimg);
	free(w->block);
	free(w->dblock);
	free(w->crop);
	free(w->dgamma);
}

static int work_alloc(struct work *w, const struct ct_fit *f, const struct ct_fit_data *d,
	size_t threads, struct ct_err *e)
{
	size_t h = d->target->h, n = f->opt.tv_block, pitch = ct_dab_pitch(d->target->w);
	size_t block = ct_dab_pitch(n) * n * n;

	*w = (struct work){0};
	if (ct_loss_init(&w->loss, h, d->target->w, threads, e) ||
		ct_alloc(&w->img, h, pitch * sizeof(float), e) ||
		ct_alloc(&w->dimg, h, pitch * sizeof(float), e) ||
		ct_alloc(&w->block, block, sizeof(float), e) ||
		ct_alloc(&w->dblock, block, sizeof(float), e) ||
		ct_alloc(&w->crop, n * n * n, sizeof(float), e))
		return -1;
	return 0;
}

static int work_grow(struct work *w, size_t n, struct ct_err *e)
{
	return ct_grow(&w->blob, &w->blobs, n, sizeof *w->blob, e) ||
			       ct_gs_grad_reserve(&w->grad, n, e) ||
			       ct_grow(&w->dgamma, &w->dgammas, n / CT_GS_CHUNK + 1,
				       sizeof *w->dgamma, e)
		       ? -1
		       : 0;
}

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
	size_t pixels = y->h * y->w;

	if (ct_alloc(&f->blank, y->views, sizeof *f->blank, e))
		return -1;
	f->residual = *whole = 0;
	for (size_t k = 0; k < y->views; k++) {
		const float *a = ct_stack_view(y, k);
		const float *b = f->opt.full ? NULL : ct_stack_view(d->base_projections, k);
		double left = 0, all = 0;

		for (size_t i = 0; i < pixels; i++) {
			left += fabs((double)a[i] - (b ? (double)b[i] : 0));
			all += fabs((double)a[i]);
		}
		f->blank[k] = left / (double)pixels;
		f->residual += f->blank[k] / (double)y->views;
		*whole += all / (double)pixels / (double)y->views;
	}
	return 0;
}

static int begin(struct ct_fit *f, const struct ct_fit_data *d, const double ln_s[static 2],
	const struct ct_env *env, struct ct_err *e)
{
	const size_t zero[3] = {0};
	double whole;

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
	return ct_init(&f->g, d->base, f->opt.gaussians, f->opt.init_density, ln_s, env, e) ||
			       ct_adam_reserve(&f->adam, 0, f->g.n, e)
		       ? -1
		       : 0;
}

int ct_fit_init(struct ct_fit *f, const struct ct_fit_options *o, const struct ct_fit_data *d,
	const struct ct_env *env, struct ct_err *e)
{
	double ln_s[2];

	*f = (struct ct_fit){.opt = *o, .extent = extent_of(d->base), .error = 1};
	ln_s[0] = log(o->s_least * f->extent);
	ln_s[1] = log(o->s_most * f->extent);
	f->g.activation = o->activation;
	f->g.gamma = CT_GAMMA_INIT;
	f->rule = (struct ct_density_rule){.grad = o->densify_grad,
		.large = o->densify_large * f->extent,
		.most = o->max_gaussians,
		.ln_least = ln_s[0]};
	if (!o->full && (!d->base_projections || ct_stack_same(d->target, d->base_projections, e)))
		return d->base_projections
			       ? -1
			       : ct_fail(e, CT_EINPUT,
					 "a residual needs the projections of its base");
	if (begin(f, d, ln_s, env, e)) {
		ct_fit_free(f);
		return -1;
	}
	return 0;
}

void ct_fit_free(struct ct_fit *f)
{
	ct_gauss_free(&f->g);
	ct_adam_free(&f->adam);
	free(f->blank);
	free(f->point);
	*f = (struct ct_fit){0};
}

const char *ct_fit_end_name(enum ct_fit_end end)
{
	static const char *const name[] = {"no end", "iterations", "tolerance", "nothing to fit"};

	return name[end];
}

void ct_fit_signs(const struct ct_gauss *g, size_t *positive, size_t *negative)
{
	*positive = *negative = 0;
	for (size_t i = 0; i < g->n; i++) {
		double rho = ct_act(g->activation, g->gamma, (double)g->raw[i]);

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
	return isfinite(x) ? 0
			   : ct_fail(e, CT_ENUMERIC,
				     "iteration %zu: the %s term of the loss is not finite",
				     iteration, name);
}

/* A fit that makes a view far worse than it was goes nowhere. */
static int check_growth(
	struct ct_fit *f, double l1, size_t view, size_t iteration, struct ct_err *e)
{
	double worst;

	if (iteration == 1)
		f->first_l1 = l1;
	worst = CT_FIT_WORST * fmax(f->first_l1, f->blank[view]);
	return l1 <= worst ? 0
			   : ct_fail(e, CT_ENUMERIC,
				     "iteration %zu: the L1 term of the loss has diverged: mean "
				     "error %g density mm, at first %g, without Gaussians %g",
				     iteration, l1, f->first_l1, f->blank[view]);
}

/* Projection of one view, its loss, and the gradient of both: the Gaussians' sets w->grad. */
static int view_term(struct ct_fit *f, const struct ct_fit_data *d, struct work *w,
	struct ct_loss_terms *t, const struct ct_loss_weights *k, size_t iteration,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_stack *y = d->target;
	size_t view = ct_fit_view(env->seed, iteration - 1, y->views), pitch = ct_dab_pitch(y->w);
	struct ct_camera cam;

	if (ct_camera_init(&cam, &y->view[view], y->beam, y->h, y->w, e) ||
		ct_splat_plan(&w->splat, &cam, f->g.n, w->blob, env->par, e))
		return -1;
	ct_splat_draw(w->img, &w->splat, env->par);
	ct_loss_image(&w->loss, t, w->dimg, w->img, pitch,
		f->opt.full ? NULL : ct_stack_view(d->base_projections, view),
		ct_stack_view(y, view), k, env->par);
	if (check_term(t->l1, "L1", iteration, e) || check_term(t->dssim, "SSIM", iteration, e) ||
		check_growth(f, t->l1 / k->scale, view, iteration, e))
		return -1;
	ct_splat_back(&w->grad, &w->splat, w->blob, &f->g, w->dimg, env->par);
	return 0;
}

/* TV of a random block; adds to w->grad. */
static int tv_term(struct ct_fit *f, const struct ct_fit_data *d, struct work *w,
	struct ct_loss_terms *t, const struct ct_loss_weights *k, size_t iteration,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_vol *base = d->base;
	size_t n[3], first[3];
	struct ct_block block;

	for (size_t a = 0; a < 3; a++) {
		n[a] = base->n[a] < f->opt.tv_block ? base->n[a] : f->opt.tv_block;
		first[a] = (size_t)ct_rng_below(
			env->seed, CT_STREAM_TV + iteration, a, base->n[a] - n[a] + 1);
	}
	if (ct_block_init(&block, base->affine, first, n, e) ||
		ct_voxels_plan(&w->vox, &block, f->g.n, w->blob, env->par, e))
		return -1;
	ct_voxels_draw_all(w->block, &w->vox, env->par);
	for (size_t r = 0; !f->opt.full && r < n[1] * n[2]; r++)
		memcpy(w->crop + r * n[0],
			base->data +
				((first[2] + r / n[1]) * base->n[1] + first[1] + r % n[1]) *
					base->n[0] +
				first[0],
			n[0] * sizeof *w->crop);
	t->tv = ct_loss_tv(
		w->dblock, w->block, ct_dab_pitch(n[0]), f->opt.full ? NULL : w->crop, n, k->tv);
	if (check_term(t->tv, "TV", iteration, e))
		return -1;
	ct_voxels_back(&w->grad, &w->vox, w->blob, &f->g, w->dblock, env->par);
	return 0;
}

struct chain {
	struct ct_fit *f;
	struct work *w;
};

/* dL/drho to dL/draw, and a part of dL/dgamma. */
static void chain_some(void *arg, size_t chunk, size_t worker)
{
	const struct chain *c = arg;
	const struct ct_gauss *g = &c->f->g;
	float *d = c->w->grad.d[CT_GS_RAW];
	size_t first = chunk * CT_GS_CHUNK, end = first + CT_GS_CHUNK;
	double sum = 0;

	(void)worker;
	for (size_t i = first; i < end && i < g->n; i++) {
		double z = (double)g->raw[i];

		sum += (double)d[i] * ct_act_dgamma(g->activation, z);
		d[i] = (float)((double)d[i] * ct_act_slope(g->activation, g->gamma, z));
	}
	c->w->dgamma[chunk] = sum;
}

static void update(struct ct_fit *f, struct work *w, size_t iteration, const struct ct_env *env)
{
	const struct ct_fit_options *o = &f->opt;
	const double ln_s[2] = {log(o->s_least * f->extent), log(o->s_most * f->extent)};
	size_t chunks = (f->g.n + CT_GS_CHUNK - 1) / CT_GS_CHUNK;
	double lr[CT_GS_FIELDS], dgamma = 0;
	struct chain c = {f, w};

	ct_par_for(env->par, chunks, chain_some, &c);
	for (size_t i = 0; i < chunks; i++)
		dgamma += w->dgamma[i];
	for (size_t k = 0; k < CT_GS_FIELDS; k++)
		lr[k] = k < CT_GS_SCALE
				? rate(&o->position, iteration, o->iterations) * f->extent / 2
				: rate(k < CT_GS_ROT	  ? &o->scaling
					  : k < CT_GS_RAW ? &o->rotation
							  : &o->density,
					  iteration, o->iterations);
	ct_adam_step(&f->adam, &f->g, &w->grad, lr, ln_s, env->par);
	if (f->g.activation == CT_PRELU) {
		ct_adam1_step(&f->gamma, &f->g.gamma, dgamma, o->gamma_rate);
		f->g.gamma = fmin(CT_GAMMA_MAX, fmax(CT_GAMMA_MIN, f->g.gamma));
	}
}

static int control(struct ct_fit *f, size_t iteration, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_fit_options *o = &f->opt;
	size_t until = o->densify_until ? o->densify_until : o->iterations;
	struct ct_density_count n;

	if (!o->densify_every || iteration <= o->densify_from || iteration >= until ||
		iteration % o->densify_every)
		return 0;
	if (ct_density_control(&f->g, &f->adam, &f->rule, &n, env->seed, iteration, e))
		return -1;
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

/* Error of the turn that this iteration ends, if it does, beside the number of Gaussians that
 * most of it had. */
static int note_turn(struct ct_fit *f, size_t views, size_t iteration, double l1, struct ct_err *e)
{
	float n = (float)f->g.n;

	f->turn += l1;
	if (iteration % views)
		return 0;
	f->error = f->turn / (double)views / f->residual;
	f->turn = 0;
	if (!f->points || f->point[f->points - 1].gaussians < n ||
		f->point[f->points - 1].gaussians > n) {
		if (ct_grow(&f->point, &f->points_cap, f->points + 1, sizeof *f->point, e))
			return -1;
		f->points++;
	}
	f->point[f->points - 1] = (struct ct_fit_point){n, (float)f->error, (float)iteration};
	if (f->opt.tolerance > 0 && f->error <= f->opt.tolerance)
		f->end = CT_FIT_ENOUGH;
	return 0;
}

static int iterate(struct ct_fit *f, const struct ct_fit_data *d, struct work *w, size_t iteration,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_fit_options *o = &f->opt;
	const struct ct_loss_weights k = {o->l1 + o->res, o->ssim, o->tv, 2 / f->extent};
	struct ct_loss_terms t = {0};

	if (work_grow(w, f->g.n, e))
		return -1;
	ct_blobs(w->blob, &f->g, env->par);
	if (view_term(f, d, w, &t, &k, iteration, env, e) ||
		(k.tv > 0 && tv_term(f, d, w, &t, &k, iteration, env, e)))
		return -1;
	t.total = k.l1 * t.l1 + k.ssim * t.dssim + k.tv * t.tv;
	note_loss(f, d->target->views, iteration, t.total);
	if (note_turn(f, d->target->views, iteration, t.l1 / k.scale, e))
		return -1;
	if (o->log_every && (iteration == 1 || iteration % o->log_every == 0))
		ct_log(env, CT_INFO,
			"iteration %zu: loss %.6g = %g L1 %.4g + %g (1 - SSIM) %.4g + "
			"%g TV %.4g; mean %.6g, %zu Gaussians, gamma %.4g",
			iteration, t.total, k.l1, t.l1, k.ssim, t.dssim, k.tv, t.tv, f->last_loss,
			f->g.n, f->g.gamma);
	ct_density_note(&f->adam, f->g.n, &w->grad);
	update(f, w, iteration, env);
	f->g.step = iteration;
	return control(f, iteration, env, e);
}

static int check_set(const struct ct_fit *f, struct ct_err *e)
{
	struct ct_err why;

	return ct_gauss_check_finite(&f->g, &why) == 0
		       ? 0
		       : ct_fail(e, CT_ENUMERIC, "iteration %zu: %s", f->g.step, why.msg);
}

static int save(const struct ct_fit *f, struct ct_err *e)
{
	return check_set(f, e) || (f->save && f->save(f->ctx, f, e)) ? -1 : 0;
}

int ct_fit_run(
	struct ct_fit *f, const struct ct_fit_data *d, const struct ct_env *env, struct ct_err *e)
{
	size_t every = f->opt.checkpoint_every;
	struct work w;
	int rc = -1;

	if (f->end == CT_FIT_EMPTY)
		return 0;
	f->end = CT_FIT_RUNNING;
	if (work_alloc(&w, f, d, ct_par_threads(env->par), e))
		goto out;
	while (f->end == CT_FIT_RUNNING && f->g.step < f->opt.iterations) {
		size_t it = f->g.step + 1;

		if (ct_stopping(env)) {
			if (save(f, e) == 0)
				ct_check_stop(env, e);
			goto out;
		}
		if (iterate(f, d, &w, it, env, e) ||
			(every && it % every == 0 && it < f->opt.iterations && save(f, e)))
			goto out;
		ct_progress(env, "fit", it, f->opt.iterations);
	}
	if (f->end == CT_FIT_RUNNING)
		f->end = CT_FIT_DONE;
	else
		ct_log(env, CT_INFO, "error %.4g after %zu iterations: good enough", f->error,
			f->g.step);
	rc = check_set(f, e);
out:
	work_free(&w);
	return rc;
}
