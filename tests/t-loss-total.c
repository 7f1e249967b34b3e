/* The terms of a fit's loss as they are brought together: which block of the volume an iteration
 * looks at, values there in double, gradients uphill. The Gaussians on the coarse grid against D of
 * the fine volume, and the gradient.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/gauss.h"
#include "core/mem.h"
#include "core/rng.h"
#include "gs/gaussian.h"
#include "gs/loss-lowres.h"
#include "gs/loss-total.h"
#include "gaussian-plain.h"
#include "tap.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 48, COUNT = 40 };

static const double fine[3][4] = {{1.5, 0, 0, -35.25}, {0, 1.5, 0, -35.25}, {0, 0, 1.5, -35.25}};

static void crowd(struct ct_gauss *g)
{

	must(ct_gauss_reserve(g, COUNT, &err));
	g->n = COUNT;
	g->gamma = 1;
	for (size_t i = 0; i < COUNT; i++) {
		for (size_t a = 0; a < 3; a++) {
			g->pos[a][i] = (float)(32 * ct_rng_uniform(9, a, i) - 16);
			g->scale[a][i] = (float)log(1.2 + 3 * ct_rng_uniform(9, 3 + a, i));
		}
		for (size_t a = 0; a < 4; a++)
			g->rot[a][i] = ct_rng_normal(9, 6 + a, i);
		g->raw[i] = ct_rng_normal(9, 10, i);
	}
}

/* l = D of the Gaussians on the fine grid. */
static void reduce(struct ct_vol *lr, const struct ct_gauss *g, const struct ct_degrade *d)
{
	const size_t n[3] = {SIDE, SIDE, SIDE};
	size_t m[3];
	struct ct_separable s = {0};
	struct ct_env env = {0};
	float *vol;

	for (int a = 0; a < 3; a++)
		m[a] = ct_degrade_size(SIDE, d->factor[a]);
	must(ct_alloc0(&vol, (size_t)SIDE * SIDE * SIDE, sizeof *vol, &err));
	must(ct_mixture_render(vol, n, fine, g, 1, NULL, &env, &err));
	must(ct_vol_alloc(lr, m, &err));
	ct_degrade_affine(lr->affine, fine, n, d);
	must(ct_degrade_plan(&s, d, n, NULL, &err));
	ct_separable_apply(&s, lr->data, vol, NULL);
	ct_separable_free(&s);
	free(vol);
}

struct coarse {
	struct ct_loss_lowres low;
	struct ct_mixture v;
	struct ct_gradient grad;
	struct ct_gaussian b[COUNT];
	float *f, *df;
};

static double loss(struct coarse *s, const struct ct_gauss *g)
{
	const size_t zero[3] = {0};
	struct ct_block block;

	ct_gaussian_resolve(s->b, g, NULL);
	must(ct_loss_lowres_block(&block, &s->low, zero, s->low.n, &err));
	must(ct_mixture_plan(&s->v, &block, g->n, s->b, NULL, &err));
	ct_mixture_draw(s->f, &s->v, NULL);
	return ct_loss_lowres_gradient(s->df, s->f, &s->low, zero, s->low.n, 1);
}

static void begin(struct coarse *s, const struct ct_vol *lr, const struct ct_degrade *d)
{
	size_t count;

	*s = (struct coarse){0};
	must(ct_loss_lowres_alloc(&s->low, lr, d, NULL, &err));
	count = ct_rasterise_pitch(s->low.n[0]) * s->low.n[1] * s->low.n[2];
	must(ct_alloc(&s->f, count, sizeof(float), &err));
	must(ct_alloc(&s->df, count, sizeof(float), &err));
	must(ct_gradient_reserve(&s->grad, COUNT, &err));
	for (int k = 0; k < CT_GS_FIELDS; k++)
		memset(s->grad.d[k], 0, COUNT * sizeof(float));
}

static void end(struct coarse *s)
{
	ct_loss_lowres_free(&s->low);
	ct_mixture_free(&s->v);
	ct_gradient_free(&s->grad);
	free(s->f);
	free(s->df);
}

/* The term of the Gaussians that made l is small beside that of none. */
static void agrees(struct ct_gauss *g, const struct ct_degrade *d, double most, const char *name)
{
	struct ct_vol lr = {0};
	struct coarse s;
	double left, all;

	reduce(&lr, g, d);
	begin(&s, &lr, d);
	left = loss(&s, g);
	g->n = 0;
	all = loss(&s, g);
	g->n = COUNT;
	if (!OK(left < most * all, "%s: D of the Gaussians without a fine volume", name))
		printf("# %g of %g: %g\n", left, all, left / all);
	end(&s);
	ct_vol_free(&lr);
}

/* Along a random direction of all parameters; densities are off, so no difference is near zero. */
static void coarse_gradient(struct ct_gauss *g, const struct ct_degrade *d)
{
	static float keep[CT_GS_FIELDS][COUNT];
	struct ct_vol lr = {0};
	struct coarse s;
	double h = 2e-3, val[2], dot = 0;

	reduce(&lr, g, d);
	for (size_t i = 0; i < COUNT; i++)
		g->raw[i] *= 1.3f;
	begin(&s, &lr, d);
	loss(&s, g);
	ct_mixture_backward(&s.grad, &s.v, s.b, g, s.df, NULL);
	for (size_t k = 0; k < CT_GS_FIELDS; k++)
		memcpy(keep[k], g->column[k], sizeof keep[k]);
	for (int t = 0; t < 2; t++) {
		for (size_t k = 0; k < CT_GS_FIELDS; k++)
			for (size_t i = 0; i < COUNT; i++) {
				float r = ct_rng_normal(3, k, i);

				g->column[k][i] = keep[k][i] + (float)(t ? h : -h) * r;
				dot += t ? (double)(r * s.grad.d[k][i]) : 0;
			}
		val[t] = loss(&s, g);
	}
	NEAR((val[1] - val[0]) / (2 * h) / dot, 1, 2e-2, "gradient along a direction");
	for (size_t k = 0; k < CT_GS_FIELDS; k++)
		memcpy(g->column[k], keep[k], sizeof keep[k]);
	end(&s);
	ct_vol_free(&lr);
}

/* The variance in coarse voxels that stands for each way of sampling, and the voxels that count. */
static void blurs(void)
{
	static const struct {
		double factor, sigma;
		enum ct_decimate by;
		double blur;
	} row[] = {{1, 0, CT_DECIMATE_SINC, 0}, {1, 0.7, CT_DECIMATE_SINC, 0.49},
		{1, 0, CT_DECIMATE_MEAN, 0}, {1, 0.5, CT_DECIMATE_MEAN, 0.25},
		{1, 0.5, CT_DECIMATE_POINT, 0.25}, {2, 0, CT_DECIMATE_MEAN, 0.0625},
		{3, 1.5, CT_DECIMATE_MEAN, 0.25 + 2 / 27.0}, {2, 0, CT_DECIMATE_POINT, 0.0625},
		{4, 2, CT_DECIMATE_POINT, 0.25 + 1 / 64.0}, {3, 0, CT_DECIMATE_POINT, 0},
		{5, 1, CT_DECIMATE_POINT, 0.04}, {1.6, 0.8, CT_DECIMATE_POINT, 0.25 + 0.25 / 2.56},
		{2.4, 1.2, CT_DECIMATE_POINT, 0.25 + 0.25 / 5.76},
		{1.4, 0.7, CT_DECIMATE_POINT, 0.25}, {2.6, 1.3, CT_DECIMATE_POINT, 0.25},
		{4, 4, CT_DECIMATE_SINC, 1}, {4, 2, CT_DECIMATE_SINC, 0.4666012941},
		{2, 0, CT_DECIMATE_SINC, 0.4666012941}};
	struct ct_vol lr = {0};

	must(ct_vol_alloc(&lr, (const size_t[]){9, 5, 7}, &err));
	for (size_t i = 0; i < 9 * 5 * 7; i++)
		lr.data[i] = ct_rng_normal(1, 0, i);
	for (size_t k = 0; k < sizeof row / sizeof *row; k++)
		for (int a = 0; a < 3; a++) {
			struct ct_degrade d = {{1, 1, 1}, {0}, row[k].by, {0}};
			const size_t lost = row[k].blur > 0 ? 2 : 0;
			struct ct_loss_lowres o = {0};
			const size_t *f = o.first, *n = o.n;
			struct ct_block block;
			size_t wrong = 0;

			d.factor[a] = row[k].factor;
			d.sigma[a] = row[k].sigma;
			must(ct_loss_lowres_alloc(&o, &lr, &d, NULL, &err));
			must(ct_loss_lowres_block(&block, &o, (const size_t[]){1, 0, 1},
				(const size_t[]){2, 1, 2}, &err));
			for (int c = 0; c < 3; c++)
				wrong += f[c] != (c == a ? lost : 0) ||
					 n[c] != lr.n[c] - 2 * f[c] ||
					 fabs(block.world[c] - (double)(f[c] + (c != 1))) > 1e-12 ||
					 fabs(block.blur[c] - (c == a ? row[k].blur : 0)) > 1e-6;
			for (size_t i = 0; row[k].by != CT_DECIMATE_SINC && i < n[0] * n[1] * n[2];
				i++)
				wrong += fabsf(o.want[i] - lr.data[((f[2] + i / n[0] / n[1]) * 5 +
									   f[1] + i / n[0] % n[1]) *
									   9 +
								   f[0] + i % n[0]]) > 0;
			OK(wrong == 0, "%g-fold, %g, kind %d, axis %d", row[k].factor, row[k].sigma,
				(int)row[k].by, a);
			ct_loss_lowres_free(&o);
		}
	ct_vol_free(&lr);
}

/* A sinc's side is blurred on: every cosine of the grid by its factor. */
static void cosines(void)
{
	const size_t m[3] = {9, 11, 8};
	const struct ct_degrade d = {{4, 2, 3}, {1, 0, 0.6}, CT_DECIMATE_SINC, {0}};
	struct ct_vol lr = {0};

	must(ct_vol_alloc(&lr, m, &err));
	for (size_t p = 0; p < 8; p += p ? 3 : 1) {
		struct ct_loss_lowres o = {0};
		double gain = 1, off = 0;

		for (size_t i = 0; i < ct_vol_count(&lr); i++) {
			const size_t at[3] = {i % m[0], i / m[0] % m[1], i / m[0] / m[1]};
			double v = 1;

			for (int a = 0; a < 3; a++)
				v *= cos(M_PI * (double)p * ((double)at[a] + 0.5) / (double)m[a]);
			lr.data[i] = (float)v;
		}
		must(ct_loss_lowres_alloc(&o, &lr, &d, NULL, &err));
		for (int a = 0; a < 3; a++) {
			double more = 0.4666012941 - pow(d.sigma[a] / d.factor[a], 2);

			gain *= exp(-more / 2 * pow(M_PI * (double)p / (double)m[a], 2));
		}
		for (size_t i = 0; i < o.n[0] * o.n[1] * o.n[2]; i++) {
			const size_t at =
				((2 + i / o.n[0] / o.n[1]) * m[1] + 2 + i / o.n[0] % o.n[1]) *
					m[0] +
				2 + i % o.n[0];

			off = fmax(off, fabs((double)o.want[i] - gain * (double)lr.data[at]));
		}
		OK(off < 1e-6, "cosine %zu: %g times", p, gain);
		ct_loss_lowres_free(&o);
	}
	ct_vol_free(&lr);
}

/* The mean difference in a block, and a sign for each voxel. */
static void signs(void)
{
	const size_t first[3] = {2, 1, 3}, n[3] = {5, 3, 4}, pitch = ct_rasterise_pitch(5);
	struct ct_loss_lowres o = {.n = {9, 5, 8}};
	float *f, *df;
	double sum = 0, got;
	size_t wrong = 0;

	must(ct_alloc(&o.want, 360, sizeof(float), &err) ||
		ct_alloc(&f, pitch * 12, sizeof *f, &err) ||
		ct_alloc(&df, pitch * 12, sizeof *df, &err));
	for (size_t i = 0; i < 360; i++)
		o.want[i] = (float)(int)(2 * ct_rng_normal(1, 0, i));
	for (size_t i = 0; i < pitch * 12; i++) {
		f[i] = (float)(int)(2 * ct_rng_normal(1, 1, i));
		df[i] = 9;
	}
	got = ct_loss_lowres_gradient(df, f, &o, first, n, 1.2);
	for (size_t i = 0; i < pitch * 12; i++) {
		const size_t x = i % pitch, y = i / pitch % 3, z = i / pitch / 3;
		float d = x < 5 ? f[i] - o.want[((z + 3) * 5 + y + 1) * 9 + x + 2] : 0;

		sum += fabs((double)d) / 60;
		wrong += fabsf(df[i] - 0.02f * (float)((d > 0) - (d < 0))) > 1e-7f;
	}
	NEAR(got, sum, 1e-9, "the mean difference in a block");
	OK(wrong == 0, "its gradient: a sign");
	free(f);
	free(df);
	ct_loss_lowres_free(&o);
}

static void t_loss_lowres(void)
{
	struct ct_degrade d = {{4, 4, 4}, {0}, CT_DECIMATE_SINC, {0}};
	struct ct_gauss g = {0};
	struct ct_loss_lowres o = {0};
	struct ct_vol tiny = {0};

	crowd(&g);
	ct_degrade_protocol(&d, 1);
	agrees(&g, &d, 0.026, "P1");
	coarse_gradient(&g, &d);
	ct_degrade_protocol(&d, 2);
	agrees(&g, &d, 0.026, "P2");
	ct_degrade_protocol(&d, 3);
	agrees(&g, &d, 0.0135, "P3");
	d = (struct ct_degrade){{3, 3, 3}, {0.5, 0.5, 0.5}, CT_DECIMATE_POINT, {0}};
	agrees(&g, &d, 0.017, "point, odd factor");
	d = (struct ct_degrade){{1, 1, 4}, {0, 0, 1}, CT_DECIMATE_MEAN, {0}};
	agrees(&g, &d, 0.0145, "thick slices");
	d = (struct ct_degrade){{2, 2, 2}, {0}, CT_DECIMATE_MEAN, {0}};
	agrees(&g, &d, 0.0085, "means of 2");
	d = (struct ct_degrade){{2, 2, 2}, {0.4, 0.4, 0.4}, CT_DECIMATE_POINT, {0}};
	agrees(&g, &d, 0.026, "point, even factor");
	must(ct_vol_alloc(&tiny, (const size_t[]){4, 9, 9}, &err));
	OK(ct_loss_lowres_alloc(&o, &tiny,
		   &(struct ct_degrade){{4, 4, 4}, {1, 1, 1}, CT_DECIMATE_SINC, {0}}, NULL,
		   &err) == -1 &&
			err.code == CT_EGEOM,
		"a grid that is all border is refused");
	ct_loss_lowres_free(&o);
	ct_vol_free(&tiny);
	ct_gauss_free(&g);
	blurs();
	cosines();
	signs();
}

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
	t_loss_lowres();
	return tap_done();
}
