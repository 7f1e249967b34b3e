/* t-loss-lowres.c: the Gaussians on the coarse grid against D of the fine volume, and the gradient.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "gs/loss-lowres.h"
#include "tap.h"

#include <stdlib.h>
#include <string.h>

enum { N = 48, COUNT = 40 };

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
	const size_t n[3] = {N, N, N};
	size_t m[3];
	struct ct_separable s = {0};
	struct ct_env env = {0};
	float *vol;

	for (int a = 0; a < 3; a++)
		m[a] = ct_degrade_size(N, d->factor[a]);
	must(ct_alloc0(&vol, (size_t)N * N * N, sizeof *vol, &err));
	must(ct_mixture_render(vol, n, fine, g, 1, NULL, &env, &err));
	must(ct_vol_alloc(lr, m, &err));
	ct_degrade_affine(lr->affine, fine, n, d);
	must(ct_degrade_plan(&s, d, n, NULL, &err));
	ct_separable_apply(&s, lr->data, vol, NULL);
	ct_separable_free(&s);
	free(vol);
}

struct scene {
	struct ct_loss_lowres low;
	struct ct_mixture v;
	struct ct_gradient grad;
	struct ct_gaussian b[COUNT];
	float *f, *df;
};

static double loss(struct scene *s, const struct ct_gauss *g)
{
	const size_t zero[3] = {0};
	struct ct_block block;

	ct_gaussian_resolve(s->b, g, NULL);
	must(ct_loss_lowres_block(&block, &s->low, zero, s->low.n, &err));
	must(ct_mixture_plan(&s->v, &block, g->n, s->b, NULL, &err));
	ct_mixture_draw(s->f, &s->v, NULL);
	return ct_loss_lowres_gradient(s->df, s->f, &s->low, zero, s->low.n, 1);
}

static void begin(struct scene *s, const struct ct_vol *lr, const struct ct_degrade *d)
{
	size_t count;

	*s = (struct scene){0};
	must(ct_loss_lowres_alloc(&s->low, lr, d, NULL, &err));
	count = ct_rasterise_pitch(s->low.n[0]) * s->low.n[1] * s->low.n[2];
	must(ct_alloc(&s->f, count, sizeof(float), &err));
	must(ct_alloc(&s->df, count, sizeof(float), &err));
	must(ct_gradient_reserve(&s->grad, COUNT, &err));
	for (int k = 0; k < CT_GS_FIELDS; k++)
		memset(s->grad.d[k], 0, COUNT * sizeof(float));
}

static void end(struct scene *s)
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
	struct scene s;
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
static void gradient(struct ct_gauss *g, const struct ct_degrade *d)
{
	static float keep[CT_GS_FIELDS][COUNT];
	struct ct_vol lr = {0};
	struct scene s;
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

int main(void)
{
	struct ct_degrade d = {{4, 4, 4}, {0}, CT_DECIMATE_SINC, {0}};
	struct ct_gauss g = {0};
	struct ct_loss_lowres o = {0};
	struct ct_vol tiny = {0};

	crowd(&g);
	ct_degrade_protocol(&d, 1);
	agrees(&g, &d, 0.026, "P1");
	gradient(&g, &d);
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
	return tap_done();
}
