/* t-loss-lowres.c: the Gaussians on the coarse grid against D of the fine volume, and the gradient.
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
	must(ct_voxelise_render(vol, n, fine, g, 1, NULL, &env, &err));
	must(ct_vol_alloc(lr, m, &err));
	ct_degrade_affine(lr->affine, fine, n, d);
	must(ct_degrade_plan(&s, d, n, NULL, &err));
	ct_separable_apply(&s, lr->data, vol, NULL);
	ct_separable_free(&s);
	free(vol);
}

struct scene {
	struct ct_loss_lowres low;
	struct ct_voxelise v;
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
	must(ct_voxelise_plan(&s->v, &block, g->n, s->b, NULL, &err));
	ct_voxelise_draw(s->f, &s->v, NULL);
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
	ct_voxelise_free(&s->v);
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
	ct_voxelise_backward(&s.grad, &s.v, s.b, g, s.df, NULL);
	for (size_t k = 0; k < CT_GS_FIELDS; k++)
		memcpy(keep[k], ct_gaussian_field(g, k), sizeof keep[k]);
	for (int t = 0; t < 2; t++) {
		for (size_t k = 0; k < CT_GS_FIELDS; k++)
			for (size_t i = 0; i < COUNT; i++) {
				float r = ct_rng_normal(3, k, i);

				ct_gaussian_field(g, k)[i] = keep[k][i] + (float)(t ? h : -h) * r;
				dot += t ? (double)(r * s.grad.d[k][i]) : 0;
			}
		val[t] = loss(&s, g);
	}
	NEAR((val[1] - val[0]) / (2 * h) / dot, 1, 2e-2, "gradient along a direction");
	for (size_t k = 0; k < CT_GS_FIELDS; k++)
		memcpy(ct_gaussian_field(g, k), keep[k], sizeof keep[k]);
	end(&s);
	ct_vol_free(&lr);
}

int main(void)
{
	struct ct_degrade d = {{4, 4, 4}, {0}, CT_DECIMATE_SINC};
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
	d = (struct ct_degrade){{3, 3, 3}, {0.5, 0.5, 0.5}, CT_DECIMATE_POINT};
	agrees(&g, &d, 0.017, "point, odd factor");
	d = (struct ct_degrade){{1, 1, 4}, {0, 0, 1}, CT_DECIMATE_MEAN};
	agrees(&g, &d, 0.0145, "thick slices");
	d = (struct ct_degrade){{2, 2, 2}, {0}, CT_DECIMATE_MEAN};
	agrees(&g, &d, 0.0085, "means of 2");
	d = (struct ct_degrade){{2, 2, 2}, {0.4, 0.4, 0.4}, CT_DECIMATE_POINT};
	agrees(&g, &d, 0.026, "point, even factor");
	must(ct_vol_alloc(&tiny, (const size_t[]){4, 9, 9}, &err));
	OK(ct_loss_lowres_alloc(&o, &tiny,
		   &(struct ct_degrade){{4, 4, 4}, {1, 1, 1}, CT_DECIMATE_SINC}, NULL,
		   &err) == -1 &&
			err.code == CT_EGEOM,
		"a grid that is all border is refused");
	ct_loss_lowres_free(&o);
	ct_vol_free(&tiny);
	ct_gauss_free(&g);
	return tap_done();
}
