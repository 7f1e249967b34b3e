/* t-fit-extreme.c: fits that are started badly, or have little to see, end well or say why not.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "core/gauss.h"
#include "gs/fit.h"
#include "xray/project.h"
#include "tap.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { N = 24, PIXELS = 28 };

struct scene {
	struct ct_vol base, truth;
	struct ct_stack base_proj, target;
	struct ct_fit_data data;
};

static void project(struct ct_stack *s, const struct ct_vol *v)
{
	struct ct_projector pr;

	must(ct_projector_init(&pr, v, s, &err));
	ct_projector_load(&pr, v->data, NULL);
	ct_project(&pr, 0, s->views, s->data, NULL);
}

/* A ball of density 0.5 of 2 mm voxels; the truth has a denser and a thinner ball in it. */
static void make(struct scene *s, size_t views, size_t pixels)
{
	const size_t n[3] = {N, N, N};

	*s = (struct scene){0};
	must(ct_vol_alloc(&s->base, n, &err));
	must(ct_vol_alloc(&s->truth, n, &err));
	for (int a = 0; a < 3; a++) {
		s->base.affine[a][a] = 2;
		s->base.affine[a][3] = -(N - 1.0);
	}
	memcpy(s->truth.affine, s->base.affine, sizeof s->truth.affine);
	for (size_t i = 0; i < N * N * N; i++) {
		double x = (double)(i % N) - 11.5, y = (double)(i / N % N) - 11.5;
		double z = (double)(i / N / N) - 11.5, r = x * x + y * y + z * z;
		double more = (x - 4) * (x - 4) + y * y + z * z < 9;
		double less = (x + 4) * (x + 4) + y * y + (z - 2) * (z - 2) < 9;

		s->base.data[i] = r < 100 ? 0.5f : 0;
		s->truth.data[i] = s->base.data[i] + (float)(0.2 * (more - less));
	}
	must(ct_stack_alloc(&s->target, views, pixels, pixels, &err));
	for (size_t k = 0; k < views; k++) {
		double t = M_PI * (double)k / (double)views, c = cos(t), r = sin(t);
		double pitch = 90.0 / (double)pixels;

		s->target.view[k] = (struct ct_view){{250 * c, 250 * r, 0}, {-125 * c, -125 * r, 0},
			{-pitch * r, pitch * c, 0}, {0, 0, -pitch}, 0};
	}
	must(ct_stack_like(&s->base_proj, &s->target, 1, &err));
	project(&s->target, &s->truth);
	project(&s->base_proj, &s->base);
	s->data = (struct ct_fit_data){
		.target = &s->target, .base_projections = &s->base_proj, .base = &s->base};
}

static void scene_free(struct scene *s)
{
	ct_vol_free(&s->base);
	ct_vol_free(&s->truth);
	ct_stack_free(&s->base_proj);
	ct_stack_free(&s->target);
}

static void options(struct ct_fit_options *o, size_t iterations)
{
	ct_fit_defaults(o, 4, false, CT_PRELU);
	o->iterations = iterations;
	o->gaussians = 400;
	o->max_gaussians = 600;
	o->densify_from = 60;
	o->densify_every = 40;
	o->tv_block = 16;
	o->checkpoint_every = 0;
}

struct kept {
	size_t saves, step;
	bool finite;
};

static int keep(void *ctx, const struct ct_fit *f, struct ct_err *e)
{
	struct kept *k = ctx;

	k->saves++;
	k->step = f->g.step;
	k->finite = ct_gauss_check_finite(&f->g, e) == 0;
	return 0;
}

/* Steps are bounded, so much too fast may still end well; if not, the end says why. */
static void rates(double times, size_t kinds, bool ends)
{
	const struct ct_env env = {.seed = 1};
	struct ct_fit_options o;
	struct kept k = {0};
	struct scene s;
	struct ct_fit f;
	int rc;

	make(&s, 12, PIXELS);
	options(&o, 200);
	o.checkpoint_every = 1;
	ct_fit_paper(&o);
	o.rate_steps = 0;
	o.start_density = 0.05;
	for (size_t i = 0; i < kinds; i++) {
		struct ct_rate *r[] = {&o.density, &o.position, &o.scaling, &o.rotation};

		r[i]->first *= times;
		r[i]->last *= times;
	}
	must(ct_fit_init(&f, &o, &s.data, &env, &err));
	f.save = keep;
	f.ctx = &k;
	rc = ct_fit_run(&f, &s.data, &env, &err);
	if (ends) {
		OK(rc == 0 && f.error < 0.8, "all rates %g times too high: the error falls to %.2g",
			times, f.error);
	} else {
		OK(rc == -1 && err.code == CT_ENUMERIC && strstr(err.msg, "iteration") &&
				strstr(err.msg, "term"),
			"that of density %g times: iteration and term are named", times);
		OK(k.saves >= 1 && k.finite && k.step < 200, "and the last good state is kept");
	}
	ct_fit_free(&f);
	scene_free(&s);
}

static void slope(double gamma, const char *name)
{
	const struct ct_env env = {.seed = 1};
	struct ct_fit_options o;
	struct scene s;
	struct ct_fit f;

	make(&s, 12, PIXELS);
	options(&o, 240);
	o.gamma_rate = 0.1; /* pushes through the bound if nothing holds it */
	must(ct_fit_init(&f, &o, &s.data, &env, &err));
	f.g.gamma = gamma;
	must(ct_fit_run(&f, &s.data, &env, &err));
	OK(f.g.gamma >= CT_GAMMA_MIN && f.g.gamma <= CT_GAMMA_MAX && f.error < 0.85,
		"gamma starts at its %s bound: stays inside (%g), the error falls to %.2g", name,
		f.g.gamma, f.error);
	ct_fit_free(&f);
	scene_free(&s);
}

static void little(size_t views, size_t pixels, double error, const char *name)
{
	const struct ct_env env = {.seed = 1};
	struct ct_fit_options o;
	struct scene s;
	struct ct_fit f;

	make(&s, views, pixels);
	options(&o, 240);
	must(ct_fit_init(&f, &o, &s.data, &env, &err));
	must(ct_fit_run(&f, &s.data, &env, &err));
	OK(f.error < error && ct_gauss_check_finite(&f.g, &err) == 0, "%s: the error falls to %.2g",
		name, f.error);
	ct_fit_free(&f);
	scene_free(&s);
}

/* Mean |x - y| against the true projections of the views from first on, every second. */
static double error_of(struct scene *s, const struct ct_gauss *g)
{
	size_t pitch = ct_rasterise_pitch(PIXELS);
	struct ct_stack clean = {0};
	struct ct_splat sp = {0};
	struct ct_gaussian *b;
	double sum = 0, all = 0;
	float *img;

	must(ct_stack_like(&clean, &s->target, 1, &err));
	project(&clean, &s->truth);
	must(ct_alloc(&b, g->n, sizeof *b, &err));
	must(ct_alloc(&img, PIXELS, pitch * sizeof *img, &err));
	ct_gaussian_resolve(b, g, NULL);
	for (size_t k = 0; k < clean.views; k++) {
		struct ct_camera c;

		must(ct_camera_init(&c, &clean.view[k], CT_CONE, PIXELS, PIXELS, &err));
		must(ct_splat_plan(&sp, &c, g->n, b, NULL, &err));
		ct_splat_draw(img, &sp, NULL);
		for (size_t i = 0; i < PIXELS * PIXELS; i++) {
			double r = (double)ct_stack_view(&clean, k)[i] -
				   (double)ct_stack_view(&s->base_proj, k)[i];

			sum += fabs(r - (double)img[i / PIXELS * pitch + i % PIXELS]);
			all += fabs(r);
		}
	}
	free(img);
	free(b);
	ct_splat_free(&sp);
	ct_stack_free(&clean);
	return sum / all;
}

/* Every third view is half noise: the others still say what is there. */
static void mixed(void)
{
	const struct ct_env env = {.seed = 1};
	struct ct_fit_options o;
	struct scene s;
	struct ct_fit f;
	double error;

	make(&s, 18, PIXELS);
	for (size_t k = 0; k < 18; k += 3)
		for (size_t i = 0; i < PIXELS * PIXELS; i++)
			ct_stack_view(&s.target, k)[i] += ct_rng_normal(8, k, i);
	options(&o, 360);
	must(ct_fit_init(&f, &o, &s.data, &env, &err));
	must(ct_fit_run(&f, &s.data, &env, &err));
	error = error_of(&s, &f.g);
	OK(error < 0.8, "views of different quality: the error of the true projections is %.2g",
		error);
	ct_fit_free(&f);
	scene_free(&s);
}

/* Little to fit, without noise: a small ball alone, of which the base has half, by many Gaussians
 * on top of each other at the default rates. */
static void ball(void)
{
	const struct ct_env env = {.seed = 1};
	struct ct_fit_options o;
	struct scene s;
	struct ct_fit f;

	make(&s, 12, PIXELS);
	for (size_t i = 0; i < N * N * N; i++) {
		double x = (double)(i % N) - 11.5, y = (double)(i / N % N) - 11.5;
		double z = (double)(i / N / N) - 11.5, r = x * x + y * y + z * z;

		s.truth.data[i] = r < 1 ? 0.25F : 0;
		s.base.data[i] = s.truth.data[i] / 2;
	}
	project(&s.target, &s.truth);
	project(&s.base_proj, &s.base);
	options(&o, 120);
	o.gaussians = o.max_gaussians = 2000;
	must(ct_fit_init(&f, &o, &s.data, &env, &err));
	must(ct_fit_run(&f, &s.data, &env, &err));
	OK(f.error < 0.5 && f.pace == 1, "a small ball alone: the error falls to %.2g, at pace %g",
		f.error, f.pace);
	ct_fit_free(&f);
	scene_free(&s);
}

/* Where the first step is not what leaps: half as fast, until it ends well. */
static void pace(void)
{
	const struct ct_env env = {.seed = 1};
	struct ct_fit_options o;
	struct kept k = {0};
	struct scene s;
	struct ct_fit f;

	make(&s, 12, PIXELS);
	options(&o, 200);
	o.scaling.first *= 30;
	o.scaling.last *= 30;
	o.checkpoint_every = 50;
	must(ct_fit_init(&f, &o, &s.data, &env, &err));
	f.save = keep;
	f.ctx = &k;
	must(ct_fit_run(&f, &s.data, &env, &err));
	OK(f.error < 0.8 && f.pace < 1 && f.g.step == 200,
		"scales learnt 300 times too fast: begun anew at pace %g, the error falls to %.2g",
		f.pace, f.error);
	OK(k.saves >= 3 && k.finite && k.step == 150, "and checkpoints go on");
	ct_fit_free(&f);
	scene_free(&s);
}

int main(void)
{
	rates(100, 4, true);
	rates(1e4, 1, false);
	slope(CT_GAMMA_MIN, "lower");
	slope(CT_GAMMA_MAX, "upper");
	little(1, PIXELS, 0.5, "one view");
	little(12, 1, 0.9, "a detector of one pixel");
	little(1, 1, 0.9, "one pixel of one view");
	mixed();
	ball();
	pace();
	return tap_done();
}
