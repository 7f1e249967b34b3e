/* loss-total.c: see loss-total.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "gs/loss-total.h"
#include "core/mem.h"
#include "core/rng.h"
#include "core/gauss.h"
#include "gs/gaussian.h"

#include <stdlib.h>

enum { LOW_BLOCK = 12 }; /* coarse voxels along an axis that an iteration looks at */

void ct_loss_total_free(struct ct_loss_total *w)
{
	free(w->gaussian);
	ct_splat_free(&w->splat);
	ct_mixture_free(&w->vox);
	ct_gradient_free(&w->grad);
	ct_loss_image_free(&w->loss);
	ct_loss_lowres_free(&w->low);
	free(w->img);
	free(w->dgamma);
	free(w->tv);
	*w = (struct ct_loss_total){0};
}

static size_t least(size_t a, size_t b)
{
	return a < b ? a : b;
}

int ct_loss_total_alloc(struct ct_loss_total *w, const struct ct_fit *f,
	const struct ct_fit_data *d, const struct ct_env *env, struct ct_err *e)
{
	size_t h = d->target->h, n = f->opt.tv_block, pitch = ct_rasterise_pitch(d->target->w);
	size_t block = ct_rasterise_pitch(n) * n * n, low = 0;

	w->f = f;
	w->d = d;
	w->env = env;
	if (d->lr && f->opt.lr > 0) {
		if (ct_loss_lowres_alloc(&w->low, d->lr, d->by, env->par, e))
			return -1;
		low = ct_rasterise_pitch(least(w->low.n[0], LOW_BLOCK)) *
		      least(w->low.n[1], LOW_BLOCK) * least(w->low.n[2], LOW_BLOCK);
	}
	block = block > low ? block : low;
	if (ct_loss_image_init(&w->loss, h, d->target->w, f->opt.multi, e) ||
		ct_alloc(&w->img, 2 * (h * pitch + block), sizeof *w->img, e) ||
		ct_alloc(&w->tv, n, sizeof *w->tv, e))
		return -1;
	w->dimg = w->img + h * pitch;
	w->block = w->dimg + h * pitch;
	w->dblock = w->block + block;
	return 0;
}

int ct_loss_total_grow(struct ct_loss_total *w, size_t n, struct ct_err *e)
{
	if (ct_grow(&w->gaussian, &w->gaussians, n, sizeof *w->gaussian, e) ||
		ct_gradient_reserve(&w->grad, n, e))
		return -1;
	return ct_grow(&w->dgamma, &w->dgammas, n / CT_GS_CHUNK + 1, sizeof *w->dgamma, e);
}

int ct_loss_total_view(struct ct_loss_total *w, struct ct_loss_terms *t, size_t k, struct ct_err *e)
{
	const struct ct_fit *f = w->f;
	const struct ct_fit_data *d = w->d;
	const struct ct_stack *y = d->target;
	struct ct_par *par = w->env->par;
	const struct ct_loss_view v = {w->dimg, w->img,
		f->opt.full ? NULL : ct_stack_view(d->base_projections, k), ct_stack_view(y, k),
		d->weight ? ct_stack_view(d->weight, k) : NULL, ct_rasterise_pitch(y->w), f->opt.l1,
		f->opt.ssim, 2 / f->extent / f->opt.one, f->mean_weight, f->opt.clamp};
	struct ct_camera cam;

	if (ct_camera_init(&cam, &y->view[k], y->beam, y->h, y->w, e) ||
		ct_splat_plan(&w->splat, &cam, f->g.n, w->gaussian, par, e) ||
		ct_check_stop(w->env, e))
		return -1;
	if (f->opt.gate > 0)
		ct_splat_gate(&w->splat, f->opt.gate * f->extent / 2 * f->opt.one);
	ct_splat_draw(w->img, &w->splat, par);
	ct_loss_image_gradient(&w->loss, t, &v, par);
	ct_splat_backward(&w->grad, &w->splat, w->gaussian, &f->g, w->dimg, par);
	return 0;
}

/* The block of n[] <= most voxels of a grid that this iteration looks at. */
static void random_block(size_t first[static 3], size_t n[static 3], const size_t grid[static 3],
	size_t most, uint64_t seed, uint64_t stream)
{
	for (size_t a = 0; a < 3; a++) {
		n[a] = least(grid[a], most);
		first[a] = (size_t)ct_rng_below(seed, stream, a, grid[a] - n[a] + 1);
	}
}

static int draw_block(struct ct_loss_total *w, const struct ct_block *block, struct ct_err *e)
{
	if (ct_mixture_plan(&w->vox, block, w->f->g.n, w->gaussian, w->env->par, e))
		return -1;
	ct_mixture_draw(w->block, &w->vox, w->env->par);
	return 0;
}

static void block_back(struct ct_loss_total *w)
{
	ct_mixture_backward(&w->grad, &w->vox, w->gaussian, &w->f->g, w->dblock, w->env->par);
}

/* Of max(0, base + residual). */
static int clamped_tv(struct ct_loss_total *w, struct ct_loss_terms *t, const struct ct_vol *base,
	size_t at, const size_t n[static 3])
{
	const size_t pitch = ct_rasterise_pitch(n[0]);

	for (size_t r = 0; r < n[1] * n[2]; r++) {
		const size_t row = r / n[1] * base->n[0] * base->n[1] + r % n[1] * base->n[0];

		for (size_t c = 0; c < n[0]; c++) {
			float *f = &w->block[r * pitch + c];

			*f += w->f->opt.full ? 0 : base->data[at + row + c];
			*f = *f > 0 ? *f : 0;
		}
	}
	t->tv = ct_loss_tv_gradient(w->dblock, w->tv, w->block, pitch, NULL, base->n, n,
			w->f->opt.tv / w->f->opt.one, w->env->par) /
		w->f->opt.one;
	for (size_t i = 0; i < n[1] * n[2] * pitch; i++)
		if (!(w->block[i] > 0))
			w->dblock[i] = 0;
	block_back(w);
	return 0;
}

int ct_loss_total_tv(
	struct ct_loss_total *w, struct ct_loss_terms *t, size_t iteration, struct ct_err *e)
{
	const struct ct_fit_options *o = &w->f->opt;
	const struct ct_vol *base = w->d->base;
	size_t n[3], first[3], at;
	struct ct_block block;

	random_block(first, n, base->n, o->tv_block, w->env->seed, CT_STREAM_TV + iteration);
	if (ct_block_init(&block, base->affine, first, n, e) || draw_block(w, &block, e))
		return -1;
	at = (first[2] * base->n[1] + first[1]) * base->n[0] + first[0];
	if (o->clamp)
		return clamped_tv(w, t, base, at, n);
	t->tv = ct_loss_tv_gradient(w->dblock, w->tv, w->block, ct_rasterise_pitch(n[0]),
			o->full ? NULL : base->data + at, base->n, n, o->tv / o->one, w->env->par) /
		o->one;
	block_back(w);
	return 0;
}

int ct_loss_total_lowres(
	struct ct_loss_total *w, struct ct_loss_terms *t, size_t iteration, struct ct_err *e)
{
	size_t n[3], first[3];
	struct ct_block block;

	random_block(first, n, w->low.n, LOW_BLOCK, w->env->seed, CT_STREAM_LOWRES + iteration);
	if (ct_loss_lowres_block(&block, &w->low, first, n, e) || draw_block(w, &block, e))
		return -1;
	t->lr = ct_loss_lowres_gradient(
			w->dblock, w->block, &w->low, first, n, w->f->opt.lr / w->f->opt.one) /
		w->f->opt.one;
	block_back(w);
	return 0;
}

/* A part of dL/dgamma. */
static void chain_some(void *arg, size_t chunk, size_t worker)
{
	struct ct_loss_total *w = arg;
	const struct ct_gauss *g = &w->f->g;
	float *d = w->grad.d[CT_GS_RAW];
	size_t first = chunk * CT_GS_CHUNK, end = first + CT_GS_CHUNK;
	double sum = 0;

	(void)worker;
	for (size_t i = first; i < end && i < g->n; i++) {
		double z = (double)g->raw[i];

		sum += (double)d[i] * ct_activation_dgamma(g->activation, z);
		d[i] = (float)((double)d[i] * ct_activation_slope(g->activation, g->gamma, z));
	}
	w->dgamma[chunk] = sum;
}

double ct_loss_total_chain(struct ct_loss_total *w)
{
	size_t chunks = (w->f->g.n + CT_GS_CHUNK - 1) / CT_GS_CHUNK;
	double dgamma = 0;

	ct_par_for(w->env->par, chunks, chain_some, w);
	for (size_t i = 0; i < chunks; i++)
		dgamma += w->dgamma[i];
	return dgamma;
}
