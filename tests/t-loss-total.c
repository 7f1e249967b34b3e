/* t-loss-total.c: the terms of a fit's loss as they are brought together: which block of the volume
 * an iteration looks at, values there in double, gradients uphill.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "core/gauss.h"
#include "gs/loss-total.h"
#include "gs/gaussian.h"
#include "gaussian-plain.h"
#include "tap.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { N = 12, VIEWS = 2, H = 12, W = 14, SEED = 6 };

struct scene {
	struct ct_vol base, lr;
	struct ct_stack base_proj, target, weight;
	struct ct_degrade by;
	struct ct_fit_data data;
	struct ct_fit f;
	struct ct_loss_total w;
	struct ct_env env;
};

static void make(struct scene *s, bool full, bool weighted)
{
	struct ct_fit_options o;

	*s = (struct scene){.by = {{2, 2, 2}, {0}, CT_DECIMATE_MEAN, {0}}, .env = {.seed = SEED}};
	must(ct_vol_alloc(&s->base, (const size_t[]){40, 14, 12}, &err));
	must(ct_vol_alloc(&s->lr, (const size_t[]){20, 7, 6}, &err));
	for (int a = 0; a < 3; a++) {
		s->base.affine[a][a] = a ? 2 : 0.8;
		s->base.affine[a][3] = s->base.affine[a][a] * (1 - (double)s->base.n[a]) / 2;
	}
	ct_degrade_affine(s->lr.affine, s->base.affine, s->base.n, &s->by);
	for (size_t i = 0; i < ct_vol_count(&s->base); i++)
		s->base.data[i] = 0.5f + 0.02f * ct_rng_normal(4, 0, i);
	for (size_t i = 0; i < ct_vol_count(&s->lr); i++)
		s->lr.data[i] = 0.1f * ct_rng_normal(4, 1, i);
	must(ct_stack_alloc(&s->target, VIEWS, H, W, &err));
	for (size_t k = 0; k < VIEWS; k++) {
		double c = k ? 0 : 1, r = k ? 1 : 0;

		s->target.view[k] = (struct ct_view){{250 * c, 250 * r, 0}, {-125 * c, -125 * r, 0},
			{-4 * r, 4 * c, 0}, {0, 0, -4}, 0};
	}
	must(ct_stack_like(&s->base_proj, &s->target, 1, &err));
	must(ct_stack_like(&s->weight, &s->target, 1, &err));
	for (size_t i = 0; i < ct_stack_count(&s->target); i++) {
		s->base_proj.data[i] = 9 + ct_rng_normal(4, 2, i);
		s->target.data[i] = (full ? 0 : s->base_proj.data[i]) + (i % 2 ? 30.0f : -30.0f);
		s->weight.data[i] = (float)ct_rng_uniform(4, 3, i);
	}
	s->data = (struct ct_fit_data){.target = &s->target,
		.base_projections = full ? NULL : &s->base_proj,
		.base = &s->base,
		.weight = weighted ? &s->weight : NULL,
		.lr = &s->lr,
		.by = &s->by};
	ct_fit_defaults(&o, 4, full, CT_PRELU);
	o.gaussians = o.max_gaussians = N;
	o.from_base = true;
	o.tv_block = 5;
	o.tv = 0.3;
	o.lr = 0.7;
	o.l1 = full ? 0.9 : 1.9;
	must(ct_fit_init(&s->f, &o, &s->data, &s->env, &err));
	for (size_t i = 0; i < N; i++) {
		for (size_t a = 0; a < 3; a++) {
			s->f.g.pos[a][i] = (float)(18 * ct_rng_uniform(5, a, i) - 9);
			s->f.g.scale[a][i] = (float)log(2 + 3 * ct_rng_uniform(5, 3 + a, i));
		}
		for (size_t a = 0; a < 4; a++)
			s->f.g.rot[a][i] = ct_rng_normal(5, 6 + a, i);
		s->f.g.raw[i] = i % 2 ? 0.4f : -0.4f;
	}
	must(ct_loss_total_alloc(&s->w, &s->f, &s->data, &s->env, &err));
	must(ct_loss_total_grow(&s->w, N, &err));
}

static void scene_free(struct scene *s)
{
	ct_loss_total_free(&s->w);
	ct_fit_free(&s->f);
	ct_vol_free(&s->base);
	ct_vol_free(&s->lr);
	ct_stack_free(&s->base_proj);
	ct_stack_free(&s->target);
	ct_stack_free(&s->weight);
}

static void clear(struct scene *s)
{
	for (size_t k = 0; k < CT_GS_FIELDS; k++)
		memset(s->w.grad.d[k], 0, N * sizeof(float));
}

enum term { VIEW, TV, LOWRES };

/* A term of an iteration times its weight; its gradient is added to what is there. */
static double value(struct scene *s, enum term term, size_t k, struct ct_loss_terms *t)
{
	*t = (struct ct_loss_terms){0};
	ct_gaussian_resolve(s->w.gaussian, &s->f.g, NULL);
	if (term == VIEW) {
		must(ct_loss_total_view(&s->w, t, k % VIEWS, &err));
		return s->f.opt.l1 * t->l1 + s->f.opt.ssim * t->dssim;
	}
	if (term == TV) {
		must(ct_loss_total_tv(&s->w, t, k, &err));
		return s->f.opt.tv * t->tv;
	}
	must(ct_loss_total_lowres(&s->w, t, k, &err));
	return s->f.opt.lr * t->lr;
}

/* TV of what is not below zero: none of a base far below, the same of one far above. */
static void clamped_tv(void)
{
	struct ct_loss_terms t = {0}, u = {0};
	struct scene s;
	double up;

	make(&s, false, false);
	value(&s, TV, 3, &t);
	for (int k = 0; k < 2; k++) {
		s.f.opt.clamp = true;
		for (size_t i = 0; i < ct_vol_count(&s.base); i++)
			s.base.data[i] += k ? 8.0f : -4.0f;
		clear(&s);
		value(&s, TV, 3, &u);
		up = 0;
		for (size_t i = 0; i < N; i++)
			up = fmax(up, fabs((double)s.w.grad.d[CT_GS_RAW][i]));
		OK(k ? fabs(u.tv - t.tv) < 1e-3 * t.tv && up > 0 : u.tv == 0 && up == 0,
			"the TV of what is not below zero, of a base far %s",
			k ? "above" : "below");
	}
	scene_free(&s);
}

/* Uphill, of every parameter by as much; once from nothing and once on top of what is there. */
static void gradient(struct scene *s, enum term term, size_t k, const char *name)
{
	const double h = 5e-4;
	float keep[CT_GS_FIELDS][N], up[CT_GS_FIELDS][N];
	double val[2], dot = 0, twice = 0;
	struct ct_loss_terms t;

	for (int times = 0; times < 2; times++) {
		if (times == 0)
			clear(s);
		value(s, term, k, &t);
		for (size_t f = 0; f < CT_GS_FIELDS; f++)
			for (size_t i = 0; i < N; i++) {
				float d = s->w.grad.d[f][i],
				      want = (term == VIEW ? 1 : 2) * up[f][i];

				if (times == 0)
					up[f][i] = d;
				else
					twice = fmax(twice, fabs((double)(d - want)));
			}
	}
	ct_loss_total_chain(&s->w);
	for (size_t f = 0; f < CT_GS_FIELDS; f++) {
		float most = 0;

		memcpy(keep[f], s->f.g.column[f], sizeof keep[f]);
		for (size_t i = 0; i < N; i++) {
			up[f][i] = s->w.grad.d[f][i] / (term == VIEW ? 1 : 2);
			most = fmaxf(most, fabsf(up[f][i]));
		}
		for (size_t i = 0; i < N; i++) {
			dot += (double)up[f][i] * (double)(up[f][i] / most);
			up[f][i] /= most;
		}
	}
	for (int sign = 0; sign < 2; sign++) {
		for (size_t f = 0; f < CT_GS_FIELDS; f++)
			for (size_t i = 0; i < N; i++)
				s->f.g.column[f][i] =
					keep[f][i] + (float)(sign ? h : -h) * up[f][i];
		val[sign] = value(s, term, k, &t);
	}
	for (size_t f = 0; f < CT_GS_FIELDS; f++)
		memcpy(s->f.g.column[f], keep[f], sizeof keep[f]);
	if (!OK(fabs((val[1] - val[0]) / (2 * h) / dot - 1) < 3e-2, "%s: uphill", name))
		printf("# %g, not %g\n", dot, (val[1] - val[0]) / (2 * h));
	OK(twice < 1e-6, "%s", term == VIEW ? "set" : "added to what is there");
}

/* The Gaussians in double on a block. */
static double *drawn(const struct scene *s, const struct ct_block *block)
{
	double *f;

	must(ct_alloc0(&f, block->n[0] * block->n[1] * block->n[2], sizeof *f, &err));
	ct_gaussian_resolve(s->w.gaussian, &s->f.g, NULL);
	for (size_t i = 0; i < N; i++) {
		struct ct_voxel_gaussian v;

		if (ct_mixture_gaussian(&v, block, &s->w.gaussian[i]))
			plain_mixture_draw(f, block, &v, CT_GS_CUT);
	}
	return f;
}

static void block_of(size_t first[static 3], size_t n[static 3], const size_t grid[static 3],
	size_t most, uint64_t stream)
{
	for (size_t a = 0; a < 3; a++) {
		n[a] = grid[a] < most ? grid[a] : most;
		first[a] = ct_rng_below(SEED, stream, a, grid[a] - n[a] + 1);
	}
}

static double tv_of(const struct scene *s, size_t iteration)
{
	const size_t *g = s->base.n;
	struct ct_block block;
	size_t n[3], first[3], count = 0;
	double *f, sum = 0;

	block_of(first, n, g, s->f.opt.tv_block, CT_STREAM_TV + iteration);
	must(ct_block_init(&block, s->base.affine, first, n, &err));
	f = drawn(s, &block);
	for (size_t i = 0; i < n[0] * n[1] * n[2]; i++) {
		const size_t x = i % n[0], y = i / n[0] % n[1], z = i / n[0] / n[1];

		if (!s->f.opt.full)
			f[i] += (double)s->base.data[((first[2] + z) * g[1] + first[1] + y) * g[0] +
						     first[0] + x];
	}
	for (size_t i = 0; i < n[0] * n[1] * n[2]; i++) {
		const size_t at[3] = {i % n[0], i / n[0] % n[1], i / n[0] / n[1]};
		const size_t step[3] = {1, n[0], n[0] * n[1]};

		for (int a = 0; a < 3; a++)
			if (at[a] + 1 < n[a]) {
				sum += fabs(f[i + step[a]] - f[i]);
				count++;
			}
	}
	free(f);
	return sum / (double)count;
}

static double lowres_of(const struct scene *s, size_t iteration)
{
	const struct ct_loss_lowres *o = &s->w.low;
	struct ct_block block;
	size_t n[3], first[3];
	double *f, sum = 0;

	block_of(first, n, o->n, 12, CT_STREAM_LOWRES + iteration);
	must(ct_loss_lowres_block(&block, o, first, n, &err));
	f = drawn(s, &block);
	for (size_t i = 0; i < n[0] * n[1] * n[2]; i++)
		sum += fabs(f[i] - (double)o->want[((first[2] + i / n[0] / n[1]) * o->n[1] +
							   first[1] + i / n[0] % n[1]) *
							   o->n[0] +
						   first[0] + i % n[0]]);
	free(f);
	return sum / (double)(n[0] * n[1] * n[2]);
}

static void terms(bool full, bool weighted)
{
	struct ct_loss_terms t;
	double off[2] = {0};
	struct scene s;

	make(&s, full, weighted);
	for (size_t it = 1; it <= 8; it++) {
		value(&s, TV, it, &t);
		off[0] = fmax(off[0], fabs(t.tv / tv_of(&s, it) - 1));
		value(&s, LOWRES, it, &t);
		off[1] = fmax(off[1], fabs(t.lr / lowres_of(&s, it) - 1));
	}
	if (!OK(off[0] < 1e-4 && off[1] < 1e-4, "%s: blocks of either term",
		    full ? "full" : "residual"))
		printf("# %g %g\n", off[0], off[1]);
	s.f.opt.tv_block = 32; /* more than the grid; the buffers are for that */
	ct_loss_total_free(&s.w);
	must(ct_loss_total_alloc(&s.w, &s.f, &s.data, &s.env, &err));
	must(ct_loss_total_grow(&s.w, N, &err));
	value(&s, TV, 1, &t);
	NEAR(t.tv / tv_of(&s, 1), 1, 1e-4, "a block that is larger than the grid");
	gradient(&s, TV, 1, "TV");
	gradient(&s, LOWRES, 2, "the low-resolution CT");
	gradient(&s, VIEW, 0, "a view");
	gradient(&s, VIEW, 1, "another");
	scene_free(&s);
}

/* Without a low-resolution CT, or its weight, there is none; a gate is in density mm. */
static void without(void)
{
	struct ct_loss_terms t;
	const size_t pitch = ct_rasterise_pitch(W);
	struct ct_splat sp = {0};
	struct ct_camera c;
	struct scene s;
	float *img = NULL;

	make(&s, true, false);
	OK(s.w.low.want != NULL, "a low-resolution CT");
	for (int k = 0; k < 2; k++) {
		ct_loss_total_free(&s.w);
		if (k == 0)
			s.f.opt.lr = 0;
		else
			s.data.lr = NULL;
		must(ct_loss_total_alloc(&s.w, &s.f, &s.data, &s.env, &err));
		OK(!s.w.low.want, "without its %s there is none", k ? "voxels" : "weight");
		s.f.opt.lr = 0.7;
	}
	must(ct_loss_total_grow(&s.w, N, &err) || ct_alloc(&img, H * pitch, sizeof *img, &err));
	s.f.opt.gate = 0.02;
	ct_gaussian_resolve(s.w.gaussian, &s.f.g, NULL);
	must(ct_loss_total_view(&s.w, &t, 1, &err));
	must(ct_camera_init(&c, &s.target.view[1], CT_CONE, H, W, &err) ||
		ct_splat_plan(&sp, &c, N, s.w.gaussian, NULL, &err));
	ct_splat_gate(&sp, 0.02 * 32 / 2);
	ct_splat_draw(img, &sp, NULL);
	OK(memcmp(img, s.w.img, H * pitch * sizeof *img) == 0, "the gate");
	free(img);
	ct_splat_free(&sp);
	scene_free(&s);
}

/* dL/drho to dL/draw and dL/dgamma, in many chunks. */
static void chain(void)
{
	enum { MANY = 3 * CT_GS_CHUNK + 7 };
	struct ct_fit f = {.g.gamma = 0.3};
	struct ct_gauss *g = &f.g;
	struct ct_env env[2] = {{0}};
	struct ct_loss_total w[2] = {{.f = &f, .env = &env[0]}, {.f = &f, .env = &env[1]}};
	double want = 0, got[2], off = 0;

	must(ct_par_alloc(&env[1].par, 3, &err) || ct_gauss_reserve(g, MANY, &err));
	for (g->n = CT_GS_CHUNK; g->n <= MANY; g->n += MANY - CT_GS_CHUNK) {
		want = 0;
		for (size_t i = 0; i < g->n; i++)
			g->raw[i] = ct_rng_normal(8, 0, i);
		for (int k = 0; k < 2; k++) {
			must(ct_loss_total_grow(&w[k], g->n, &err));
			for (size_t i = 0; i < g->n; i++)
				w[k].grad.d[CT_GS_RAW][i] = ct_rng_normal(8, 1, i);
			w[k].dgamma[g->n / CT_GS_CHUNK] = 5; /* of a chunk that may not be */
			got[k] = ct_loss_total_chain(&w[k]);
		}
		for (size_t i = 0; i < g->n; i++) {
			double d = (double)ct_rng_normal(8, 1, i), z = (double)g->raw[i];

			want += z < 0 ? d * z : 0;
			off = fmax(off,
				fabs((double)w[0].grad.d[CT_GS_RAW][i] - d * (z < 0 ? 0.3 : 1)));
		}
		NEAR(got[0], want, 1e-9, "the gradient of gamma");
		OK(off < 1e-6 && memcmp(&got[0], &got[1], sizeof(double)) == 0 &&
				memcmp(w[0].grad.d[CT_GS_RAW], w[1].grad.d[CT_GS_RAW],
					g->n * sizeof(float)) == 0,
			"and of raw densities, %zu Gaussians; the same with three threads", g->n);
	}
	for (int k = 0; k < 2; k++)
		ct_loss_total_free(&w[k]);
	ct_gauss_free(g);
	ct_par_free(env[1].par);
}

int main(void)
{
	clamped_tv();
	terms(false, false);
	terms(false, true);
	terms(true, false);
	without();
	chain();
	return tap_done();
}
