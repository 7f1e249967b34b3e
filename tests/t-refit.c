/* t-refit.c: densities by least squares against the normal equations written out, one number a pair
 * of Gaussians: a single step of conjugate gradients, and the end of many. */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "gs/prelu.h"
#include "gs/refit.h"
#include "gaussian-plain.h"
#include "tap.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { N = 5, VIEWS = 3, H = 12, W = 14, PIXELS = H * W, COUNT = VIEWS * PIXELS };

struct scene {
	struct ct_vol base, lr;
	struct ct_stack base_proj, target, weight;
	struct ct_degrade by;
	struct ct_fit_data data;
};

static void make(struct scene *s)
{
	*s = (struct scene){.by = {{2, 2, 2}, {0.5, 0, 0.5}, CT_DECIMATE_MEAN, {0}}};
	must(ct_vol_alloc(&s->base, (const size_t[]){16, 14, 12}, &err));
	must(ct_vol_alloc(&s->lr, (const size_t[]){8, 7, 6}, &err));
	for (int a = 0; a < 3; a++) {
		s->base.affine[a][a] = 2;
		s->base.affine[a][3] = 1 - (double)s->base.n[a];
	}
	ct_degrade_affine(s->lr.affine, s->base.affine, s->base.n, &s->by);
	for (size_t i = 0; i < ct_vol_count(&s->base); i++)
		s->base.data[i] = 0.5f;
	for (size_t i = 0; i < ct_vol_count(&s->lr); i++)
		s->lr.data[i] = 0.1f * ct_rng_normal(4, 0, i);
	must(ct_stack_alloc(&s->target, VIEWS, H, W, &err));
	for (size_t k = 0; k < VIEWS; k++) {
		double t = 2 * M_PI * (double)k / VIEWS, c = cos(t), r = sin(t);

		s->target.view[k] = (struct ct_view){{250 * c, 250 * r, 0}, {-125 * c, -125 * r, 0},
			{-4 * r, 4 * c, 0}, {0, 0, -4}, 0};
	}
	must(ct_stack_like(&s->base_proj, &s->target, 1, &err));
	must(ct_stack_like(&s->weight, &s->target, 1, &err));
	for (size_t i = 0; i < COUNT; i++) {
		s->base_proj.data[i] = ct_rng_normal(4, 1, i);
		s->target.data[i] = s->base_proj.data[i] + 1 + ct_rng_normal(4, 2, i);
		s->weight.data[i] = (float)ct_rng_uniform(4, 3, i);
	}
	s->data = (struct ct_fit_data){
		.target = &s->target, .base_projections = &s->base_proj, .base = &s->base};
}

static void scene_free(struct scene *s)
{
	ct_vol_free(&s->base);
	ct_vol_free(&s->lr);
	ct_stack_free(&s->base_proj);
	ct_stack_free(&s->target);
	ct_stack_free(&s->weight);
}

/* A few that overlap, long ones and short. */
static void crowd(struct ct_gauss *g)
{
	g->n = N;
	for (size_t i = 0; i < N; i++) {
		for (size_t a = 0; a < 3; a++) {
			g->pos[a][i] = (float)(12 * ct_rng_uniform(5, a, i) - 6);
			g->scale[a][i] = (float)log(1.5 + 4 * ct_rng_uniform(5, 3 + a, i));
		}
		for (size_t a = 0; a < 4; a++)
			g->rot[a][i] = ct_rng_normal(5, 6 + a, i);
		g->raw[i] = i % 2 ? 0.2f : -0.1f;
	}
}

/* H rho - r is the gradient, half that of the sum of squares. */
struct normal {
	double h[N][N], r[N];
};

static void add(struct normal *m, const double row[static N], double want, double weight)
{
	for (int i = 0; i < N; i++) {
		for (int j = 0; j < N; j++)
			m->h[i][j] += weight * row[i] * row[j];
		m->r[i] += weight * row[i] * want;
	}
}

static void add_views(struct normal *m, const struct scene *s, const struct ct_fit *f,
	const struct ct_gaussian *b)
{
	static double img[N][PIXELS];
	const double c = 2 / f->extent;

	for (size_t k = 0; k < VIEWS; k++) {
		struct ct_camera cam;

		must(ct_camera_init(&cam, &s->target.view[k], CT_CONE, H, W, &err));
		memset(img, 0, sizeof img);
		for (int i = 0; i < N; i++) {
			struct footprint p;

			if (plain_footprint_of(&p, &cam, &b[i]))
				plain_footprint_draw(img[i], &cam, &p, 1, CT_GS_CUT);
		}
		for (size_t i = 0; i < PIXELS; i++) {
			const size_t at = k * PIXELS + i;
			const double y = (double)s->target.data[at] -
					 (f->opt.full ? 0 : (double)s->base_proj.data[at]);
			const double w = s->data.weight ? (double)s->weight.data[at] : 1;
			double row[N];

			for (int n = 0; n < N; n++)
				row[n] = img[n][i];
			add(m, row, y, w * c * c / f->mean_weight / COUNT);
		}
	}
}

static void add_lowres(
	struct normal *m, const struct ct_loss_lowres *o, double k, const struct ct_gaussian *b)
{
	const size_t zero[3] = {0}, count = o->n[0] * o->n[1] * o->n[2];
	struct ct_block block;
	double *vol[N];

	must(ct_loss_lowres_block(&block, o, zero, o->n, &err));
	for (int i = 0; i < N; i++) {
		struct ct_gaussian one = b[i];
		struct ct_voxel_gaussian v;

		one.rho = 1;
		must(ct_alloc0(&vol[i], count, sizeof **vol, &err));
		if (ct_mixture_gaussian(&v, &block, &one))
			plain_mixture_draw(vol[i], &block, &v, CT_GS_CUT);
	}
	for (size_t at = 0; at < count; at++) {
		double row[N];

		for (int i = 0; i < N; i++)
			row[i] = vol[i][at];
		add(m, row, (double)o->want[at], k / (double)count);
	}
	for (int i = 0; i < N; i++)
		free(vol[i]);
}

/* x with H x = r, H positive. */
static void solve(double x[static N], const struct normal *m)
{
	double a[N][N + 1];

	for (int i = 0; i < N; i++) {
		memcpy(a[i], m->h[i], sizeof m->h[i]);
		a[i][N] = m->r[i];
	}
	for (int k = 0; k < N; k++)
		for (int i = 0; i < N; i++)
			for (int j = N; i != k && j >= k; j--)
				a[i][j] -= a[i][k] / a[k][k] * a[k][j];
	for (int i = 0; i < N; i++)
		x[i] = a[i][N] / a[i][i];
}

/* One step from x, the unknowns of which are x / unit. */
static void step(double x[static N], const struct normal *m, const double unit[static N])
{
	double d[N], up = 0, curve = 0;

	for (int i = 0; i < N; i++) {
		d[i] = m->r[i];
		for (int j = 0; j < N; j++)
			d[i] -= m->h[i][j] * x[j];
		d[i] *= unit[i];
		up += d[i] * d[i];
	}
	for (int i = 0; i < N; i++)
		for (int j = 0; j < N; j++)
			curve += d[i] * unit[i] * m->h[i][j] * unit[j] * d[j];
	for (int i = 0; i < N; i++)
		x[i] += up / curve * d[i] * unit[i];
}

/* The error that these densities leave, as fit.h has it. */
static double error_of(const struct scene *s, const struct ct_fit *f, const struct ct_gaussian *b,
	const double x[static N])
{
	double sum = 0;

	for (size_t k = 0; k < VIEWS; k++) {
		static double img[PIXELS];
		struct ct_camera cam;

		must(ct_camera_init(&cam, &s->target.view[k], CT_CONE, H, W, &err));
		memset(img, 0, sizeof img);
		for (int i = 0; i < N; i++) {
			struct footprint p;

			if (plain_footprint_of(&p, &cam, &b[i]))
				plain_footprint_draw(img, &cam, &p, x[i], CT_GS_CUT);
		}
		for (size_t i = 0; i < PIXELS; i++) {
			const size_t at = k * PIXELS + i;

			sum += (s->data.weight ? (double)s->weight.data[at] : 1) *
			       fabs(img[i] - (double)s->target.data[at] +
				       (f->opt.full ? 0 : (double)s->base_proj.data[at]));
		}
	}
	return sum / f->mean_weight / COUNT / f->residual;
}

static void refit(struct scene *s, bool full, bool weighted, bool lowres, size_t steps)
{
	const struct ct_env env = {.seed = 1};
	struct ct_loss_total w = {0};
	struct ct_gaussian b[N];
	struct normal m = {0};
	struct ct_fit_options o;
	double want[N], unit[N], off = 0, moved = 0;
	struct ct_fit f;

	ct_fit_defaults(&o, 4, full, CT_PRELU);
	o.gaussians = o.max_gaussians = N;
	o.place = CT_PLACE_BASE;
	o.l1 = full ? 0.8 : 1.8;
	o.refit = steps;
	o.lr = lowres ? 3 : 0;
	s->data.weight = weighted ? &s->weight : NULL;
	s->data.lr = lowres ? &s->lr : NULL;
	s->data.by = lowres ? &s->by : NULL;
	must(ct_fit_init(&f, &o, &s->data, &env, &err));
	crowd(&f.g);
	ct_gaussian_resolve(b, &f.g, NULL);
	must(ct_loss_total_alloc(&w, &o, &s->data, NULL, &err));
	add_views(&m, s, &f, b);
	if (lowres)
		add_lowres(&m, &w.low, 3 / (0.8 + (full ? 0 : 1)), b);
	for (int i = 0; i < N; i++) {
		want[i] = b[i].rho;
		unit[i] = pow(16, 2) / cbrt(pow(b[i].s[0] * b[i].s[1] * b[i].s[2], 2));
	}
	if (steps == 1)
		step(want, &m, unit);
	else
		solve(want, &m);
	must(ct_refit_densities(&f, &s->data, &w, &env, &err));
	for (int i = 0; i < N; i++) {
		double got = ct_activation_apply(CT_PRELU, f.g.gamma, (double)f.g.raw[i]);

		off = fmax(off, fabs(got - want[i]));
		moved = fmax(moved, fabs(want[i] - b[i].rho));
	}
	if (!OK(off < 1e-3 * moved, "%s, %s, %s a low-resolution CT: %zu steps",
		    full ? "full" : "residual", weighted ? "weighted" : "not weighted",
		    lowres ? "with" : "without", steps))
		printf("# off by %g of %g\n", off, moved);
	NEAR(f.error / error_of(s, &f, b, want), 1, 1e-3, "and the error is measured anew");
	ct_loss_total_free(&w);
	ct_fit_free(&f);
}

int main(void)
{
	struct scene s;

	make(&s);
	for (int k = 0; k < 8; k++) {
		refit(&s, k & 1, k & 2, k & 4, 1);
		refit(&s, k & 1, k & 2, k & 4, 40);
	}
	scene_free(&s);
	return tap_done();
}
