/* t-fit.c: what a fit keeps account of, against the rules written out: settings, what there is to
 * explain, units, epochs, means, ends, new beginnings. Where it says so rates are next to nothing,
 * so that a view's loss stays what it is. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "core/gauss.h"
#include "gs/fit.h"
#include "gs/place.h"
#include "gs/gaussian.h"
#include "gs/splat.h"
#include "xray/project.h"
#include "tap.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { VIEWS = 3, H = 12, W = 14, PIXELS = H * W };
#define EXTENT 25.0 /* of the second axis */

struct scene {
	struct ct_vol base;
	struct ct_stack base_proj, target, weight;
	struct ct_fit_data data;
};

static void make(struct scene *s)
{
	struct ct_projector pr;

	*s = (struct scene){0};
	must(ct_vol_alloc(&s->base, (const size_t[]){12, 10, 8}, &err));
	for (int a = 0; a < 3; a++) {
		s->base.affine[a][a] = 2 + 0.5 * a;
		s->base.affine[a][3] = -(2 + 0.5 * a) * (double)(s->base.n[a] - 1) / 2;
	}
	for (size_t i = 0; i < ct_vol_count(&s->base); i++)
		s->base.data[i] = 0.4f + 0.2f * (float)(i % 3);
	must(ct_stack_alloc(&s->target, VIEWS, H, W, &err));
	for (size_t k = 0; k < VIEWS; k++) {
		double t = 2 * M_PI * (double)k / VIEWS, c = cos(t), r = sin(t);

		s->target.view[k] = (struct ct_view){{250 * c, 250 * r, 0}, {-125 * c, -125 * r, 0},
			{-4 * r, 4 * c, 0}, {0, 0, -4}, 0};
	}
	must(ct_stack_like(&s->base_proj, &s->target, 1, &err));
	must(ct_stack_like(&s->weight, &s->target, 1, &err));
	must(ct_projector_init(&pr, &s->base, &s->target, &err));
	ct_projector_load(&pr, s->base.data, NULL);
	ct_project(&pr, 0, VIEWS, s->base_proj.data, NULL);
	for (size_t i = 0; i < VIEWS * PIXELS; i++) {
		double middle = hypot((double)(i / W % H) - 5.5, (double)(i % W) - 6.5) < 4;

		s->target.data[i] =
			s->base_proj.data[i] + (float)(middle * (0.5 + 0.2 * (double)(i / PIXELS)) +
						       0.1 * (double)ct_rng_normal(1, 0, i));
		s->weight.data[i] = (float)ct_rng_uniform(1, 1, i);
	}
	s->data = (struct ct_fit_data){
		.target = &s->target, .base_projections = &s->base_proj, .base = &s->base};
}

static void scene_free(struct scene *s)
{
	ct_vol_free(&s->base);
	ct_stack_free(&s->base_proj);
	ct_stack_free(&s->target);
	ct_stack_free(&s->weight);
}

/* Nothing moves, nothing is born; L1 is all that counts. */
static void still(struct ct_fit_options *o, size_t iterations)
{
	const struct ct_rate none = {1e-30, 1e-30};

	ct_fit_defaults(o, 4, false, CT_PRELU);
	o->iterations = iterations;
	o->gaussians = o->max_gaussians = 20;
	o->start_density = 0.5;
	o->position = o->density = o->scaling = o->rotation = none;
	o->gamma_rate = 0;
	o->ssim = o->tv = 0;
	o->log_every = o->checkpoint_every = o->densify_every = 0;
}

/* c mean w |x - y| of a view of the Gaussians as they are. */
static double error_of(const struct scene *s, const struct ct_gauss *g, size_t view, double mean)
{
	size_t pitch = ct_rasterise_pitch(W);
	struct ct_gaussian b[64];
	struct ct_splat sp = {0};
	struct ct_camera c;
	double sum = 0;
	float *img;

	ct_gaussian_resolve(b, g, NULL);
	must(ct_alloc(&img, H * pitch, sizeof *img, &err) ||
		ct_camera_init(&c, &s->target.view[view], CT_CONE, H, W, &err) ||
		ct_splat_plan(&sp, &c, g->n, b, NULL, &err));
	ct_splat_draw(img, &sp, NULL);
	for (size_t i = 0; i < PIXELS; i++) {
		size_t at = view * PIXELS + i;
		double w = s->data.weight ? (double)s->weight.data[at] : 1;
		double base = s->data.base_projections ? (double)s->base_proj.data[at] : 0;

		sum += w *
		       fabs((double)img[i / W * pitch + i % W] + base - (double)s->target.data[at]);
	}
	free(img);
	ct_splat_free(&sp);
	return sum / PIXELS / mean;
}

static bool equal(double a, double b)
{
	return fabs(a - b) <= 1e-12 * fabs(b);
}

/* The table of settings: 4-fold, 8-fold, full. */
static void settings(void)
{
	for (int k = 0; k < 3; k++) {
		const bool full = k == 2;
		const double fine = k == 1 ? 0.1 : 1;
		struct ct_fit_options o;

		ct_fit_defaults(&o, k == 1 ? 8 : 7, full, CT_PRELU);
		OK(o.iterations == 5000 && o.gaussians == 50000 && o.max_gaussians == 500000 &&
				o.tv_block == 32 && o.log_every == 500 &&
				o.checkpoint_every == 1000 && o.densify_from == 500 &&
				o.densify_every == 100 && o.densify_until == 0 && o.rate_steps == 0,
			"%d: how many and how often", k);
		OK(equal(o.l1, full ? 1 : 2) && equal(o.ssim, full ? 0.25 : 0.5) &&
				equal(o.tv, 0.05) && equal(o.lr, 0),
			"weights of the terms");
		OK(equal(o.position.first, 2e-4) && equal(o.position.last, 2e-5) &&
				equal(o.density.first, 1e-2) && equal(o.density.last, 1e-3) &&
				equal(o.scaling.first, 5e-3 * fine) &&
				equal(o.scaling.last, 5e-4 * fine) &&
				equal(o.rotation.first, 1e-3 * fine) &&
				equal(o.rotation.last, 1e-4 * fine) && equal(o.gamma_rate, 1e-3),
			"rates");
		OK(equal(o.rate_factor, full ? 1 : 10) && equal(o.densify_grad, 5e-5) &&
				equal(o.densify_large, 0.1),
			"factors and limits");
		OK(o.adapt && !o.compat && o.full == full && !o.from_base &&
				equal(o.start_density, full ? 0.15 : 0.05),
			"what is on, and the density to begin from");
		ct_fit_compat(&o);
		OK(o.compat && equal(o.gate, full ? 1e-5 : 0), "the gate of the program");
		ct_fit_paper(&o);
		OK(o.rate_steps == 30000 && o.densify_until == 14999 && o.from_base &&
				equal(o.start_density, 0.15) && equal(o.rate_factor, 1) && !o.adapt,
			"the published ones");
	}
	for (size_t scale = 4; scale <= 8; scale += 4) {
		struct ct_fit_options o;

		ct_fit_defaults(&o, scale, false, CT_PRELU);
		ct_fit_release(&o, scale);
		OK(o.compat && o.multi && o.clamp && o.by_density && o.from_fdk && !o.from_base &&
				!o.adapt && o.gamma_soft && o.rate_steps == 30000 &&
				o.densify_until == 30000 && equal(o.start_density, 0.15) &&
				equal(o.ssim, 0.5) && equal(o.l1, 2) && equal(o.tv, 0.05),
			"%zu-fold: what the release's fit does otherwise", scale);
		OK(equal(o.gamma, scale == 4 ? 0.1 : 0.001) && equal(o.gamma_rate, 1e-2) &&
				equal(o.gamma_last, 1e-4),
			"%zu-fold: the release's slope and its rate", scale);
		OK(equal(o.position.first, 2e-4) && equal(o.position.last, 2e-5) &&
				equal(o.density.first, 1e-2) && equal(o.density.last, 1e-3) &&
				equal(o.scaling.first, 5e-3) && equal(o.scaling.last, 5e-4) &&
				equal(o.rotation.first, 1e-3) && equal(o.rotation.last, 1e-4) &&
				equal(o.rate_factor, 1),
			"%zu-fold: the release's rates do not depend on the factor", scale);
	}
	for (int a = CT_PRELU; a <= CT_SINE; a++) {
		struct ct_fit_options o;

		ct_fit_defaults(&o, 4, false, (enum ct_activation)a);
		OK(o.activation == (enum ct_activation)a &&
				equal(o.start_density,
					a == CT_SOFTPLUS || a == CT_RELU ? 0.15 : 0.05),
			"where %s begins", CT_WORD(CT_ACTIVATION_LIST, a));
	}
}

/* What is there to explain: view by view, weighted or not, with a base or without. */
static void measured(struct scene *s)
{
	const struct ct_env env = {.seed = 2};
	struct ct_fit_options o;
	struct ct_fit f;

	for (int k = 0; k < 4; k++) {
		struct ct_gauss none = {0};
		double mean = 0, all = 0, off = 0;

		still(&o, 1);
		o.full = k & 1;
		o.max_gaussians = 33;
		s->data.weight = k & 2 ? &s->weight : NULL;
		s->data.base_projections = o.full ? NULL : &s->base_proj;
		for (size_t i = 0; i < VIEWS * PIXELS; i++)
			mean += (k & 2 ? (double)s->weight.data[i] : 1) / (VIEWS * PIXELS);
		must(ct_fit_init(&f, &o, &s->data, &env, &err));
		for (size_t v = 0; v < VIEWS; v++) {
			double want = error_of(s, &none, v, mean);

			off = fmax(off, fabs(f.blank[v] - want) / want);
			all += want / VIEWS;
		}
		OK(off < 1e-9 && fabs(f.residual / all - 1) < 1e-9 &&
				fabs(f.mean_weight - mean) < 1e-12,
			"%s, %s: what is to be explained, view by view",
			k & 1 ? "full" : "residual", k & 2 ? "weighted" : "not weighted");
		OK(equal(f.extent, EXTENT) && equal(f.rule.large, 0.1 * EXTENT) &&
				equal(f.rule.grad, 5e-5) && f.rule.most == 33 &&
				equal(f.rule.ln_least, log(5e-4 * EXTENT)) &&
				f.rule.box.n[1] == 10 && equal(f.rule.box.world[1], -11.25),
			"the extent, and the rule of density control");
		OK(equal(f.error, 1) && equal(f.pace, 1) && equal(f.g.gamma, 0.25) &&
				f.end == CT_FIT_RUNNING && f.g.n == 20,
			"as it begins");
		ct_fit_free(&f);
	}
	s->data.weight = NULL;
	s->data.base_projections = NULL;
	still(&o, 1);
	OK(ct_fit_init(&f, &o, &s->data, &env, &err) == -1 && err.code == CT_EINPUT,
		"a residual needs a base: %s", err.msg);
	s->data.base_projections = &s->base_proj;
	s->base_proj.views--;
	OK(ct_fit_init(&f, &o, &s->data, &env, &err) == -1 && err.code == CT_EGEOM,
		"of the same views: %s", err.msg);
	s->base_proj.views++;
}

/* The unit of the rate of density. */
static void unit(struct scene *s)
{
	const struct ct_env env = {.seed = 2};
	struct ct_vol field = {0};
	struct ct_fit_options o;
	struct ct_fit f;
	double typical, cover;

	still(&o, 1);
	o.density = (struct ct_rate){0.01, 0.001};
	o.rate_factor = 3;
	must(ct_place_field(&field, &s->base, &s->target, &s->base_proj, &env, &err));
	typical = ct_place_typical(&field);
	for (int k = 0; k < 3; k++) { /* not adapted; adapted; so slow that there is no need */
		o.adapt = k > 0;
		o.density.first = k < 2 ? 5 : 1e-9;
		must(ct_fit_init(&f, &o, &s->data, &env, &err));
		cover = ct_place_cover(&f.g, &field) * 3 * 5;
		OK(k != 1 || CT_FIT_STEP / cover < 0.9 * typical, "the bound is tried");
		NEAR(f.unit / (k == 1 ? CT_FIT_STEP / cover : typical), 1, 1e-9,
			"the unit of density");
		ct_fit_free(&f);
	}
	ct_vol_free(&field);
	for (int k = 0; k < 2; k++) { /* the published rate; a scan that cannot be inverted */
		o.from_base = k == 0;
		s->target.views = s->base_proj.views = k ? 1 : VIEWS;
		must(ct_fit_init(&f, &o, &s->data, &env, &err));
		NEAR(f.unit, k ? 1.0 / 3 : 1, 1e-12, "beginning from the base");
		ct_fit_free(&f);
	}
	s->target.views = s->base_proj.views = VIEWS;
	o.full = true;
	s->target.views = 1;
	must(ct_fit_init(&f, &o, &s->data, &env, &err));
	NEAR(f.unit, 1, 0, "as mode full does");
	s->target.views = VIEWS;
	ct_fit_free(&f);
}

/* What is left is a part of all that is the rounding of a float, or a little more. */
static void nothing(void)
{
	const struct ct_env env = {.seed = 2};

	for (int k = 0; k < 2; k++) {
		struct ct_fit_options o;
		struct scene s;
		struct ct_fit f;

		make(&s);
		still(&o, 2);
		for (size_t i = 0; i < VIEWS * PIXELS; i++) {
			s.base_proj.data[i] = 1;
			s.target.data[i] = 1 + (k ? 24 : 8) * 0x1p-23f * (i % 2 ? 1 : -0.5f);
		}
		must(ct_fit_init(&f, &o, &s.data, &env, &err));
		must(ct_fit_run(&f, &s.data, &env, &err));
		if (k)
			OK(f.end == CT_FIT_DONE && f.g.n == 20 && f.g.step == 2,
				"2.1e-6 is fitted");
		else
			OK(f.end == CT_FIT_EMPTY && f.g.n == 0 && f.g.step == 0 && f.error <= 0 &&
					f.g.grid[0] == 12 && f.g.grid[2] == 8 &&
					equal(f.g.affine[1][1], 2.5) &&
					equal(f.g.affine[2][3], -10.5),
				"0.7e-6 is nothing, on the grid of the base");
		ct_fit_free(&f);
		scene_free(&s);
	}
}

static void signs(void)
{
	static float raw[] = {0.2f, -0.1f, 0, 3, -1e-20f, 1e-20f};
	struct ct_gauss g = {.n = 6, .raw = raw, .gamma = 0.5};
	size_t positive, negative;

	ct_fit_signs(&g, &positive, &negative);
	OK(positive == 3 && negative == 2, "of either sign, and none");
	OK(!strcmp(CT_WORD(CT_FIT_END_LIST, CT_FIT_ENOUGH), "tolerance"), "the word of an end");
}

/* The shuffle with its table: slots are swapped from the second on. */
static void order(void)
{
	enum { M = 9 };
	size_t wrong = 0;

	for (size_t epoch = 0; epoch < 4; epoch++) {
		size_t slot[M];

		for (size_t i = 0; i < M; i++)
			slot[i] = i;
		for (size_t i = 1; i < M; i++) {
			size_t j = ct_rng_below(7, CT_STREAM_VIEW + epoch, i, i + 1), t = slot[i];

			slot[i] = slot[j];
			slot[j] = t;
		}
		for (size_t i = 0; i < M; i++)
			wrong += slot[ct_fit_view(7, epoch * M + i, M)] != i;
	}
	OK(wrong == 0, "views as a shuffle has them");
}

struct seen {
	size_t saves, step[32], n[32];
	size_t fail; /* this many calls of save, with `code` */
	enum ct_code code;
	size_t anew, iterations, enough; /* messages */
	volatile sig_atomic_t stop;
};

static int save(void *ctx, const struct ct_fit *f, struct ct_err *e)
{
	struct seen *s = ctx;

	s->step[s->saves % 32] = f->g.step;
	s->n[s->saves % 32] = f->g.n;
	return ++s->saves <= s->fail ? ct_fail(e, s->code, "as told") : 0;
}

static void listen(const struct ct_env *env, enum ct_level level, const char *text)
{
	struct seen *s = env->ctx;

	s->anew += level == CT_INFO && strstr(text, "beginning anew");
	s->enough += level == CT_INFO && strstr(text, "good enough");
	s->iterations += level == CT_INFO && strstr(text, "iteration ") == text;
}

/* The options of a run, a fit that has begun, and what is heard of it. */
static void begin(struct ct_fit *f, const struct ct_fit_options *o, const struct scene *s,
	struct seen *seen, struct ct_env *env)
{
	*env = (struct ct_env){
		.seed = 2, .verbose = 1, .log = listen, .ctx = seen, .stop = &seen->stop};
	must(ct_fit_init(f, o, &s->data, env, &err));
	f->save = save;
	f->ctx = seen;
}

/* Two epochs and a view; the mean of the first, and one that forgets. */
static void epochs(struct scene *s, bool weighted)
{
	const size_t iterations = 2 * VIEWS + 1;
	struct ct_fit_options o;
	struct seen seen = {0};
	double e[VIEWS], want = 0, mean = 0, first = 0, last_e = 0;
	struct ct_env env;
	struct ct_fit f;

	still(&o, iterations);
	o.l1 = 1.7;
	s->data.weight = weighted ? &s->weight : NULL;
	begin(&f, &o, s, &seen, &env);
	for (size_t v = 0; v < VIEWS; v++) {
		e[v] = error_of(s, &f.g, v, f.mean_weight);
		want += e[v] / VIEWS / f.residual;
	}
	for (size_t it = 1; it <= iterations; it++) {
		last_e = e[ct_fit_view(2, it - 1, VIEWS)];
		mean += (1.7 * 2 / EXTENT * last_e - mean) / (double)(it < VIEWS ? it : VIEWS);
		first = it == VIEWS ? mean : first;
	}
	must(ct_fit_run(&f, &s->data, &env, &err));
	NEAR(f.error / want, 1, 1e-5, "the error of an epoch, as a part of that of none");
	NEAR(f.first_loss / first, 1, 1e-5, "the mean loss of the first");
	NEAR(f.last_loss / mean, 1, 1e-5, "and of about one");
	NEAR(f.first_l1 / e[ct_fit_view(2, 0, VIEWS)], 1, 1e-5, "L1 of the first iteration");
	NEAR(f.epoch_l1 / last_e, 1, 1e-5, "L1 of the epoch that has begun");
	OK(f.end == CT_FIT_DONE && f.g.step == iterations && seen.saves == 0, "to the end");
	want = f.error;
	ct_fit_free(&f);
	for (int k = 0; k < 2; k++) {
		o.tolerance = want * (k ? 0.999 : 1.001);
		begin(&f, &o, s, &seen, &env);
		must(ct_fit_run(&f, &s->data, &env, &err));
		OK(k ? f.end == CT_FIT_DONE && f.g.step == iterations && seen.enough == 1
		     : f.end == CT_FIT_ENOUGH && f.g.step == VIEWS && seen.enough == 1,
			"a tolerance %s", k ? "below the error" : "above ends the first epoch");
		ct_fit_free(&f);
	}
	s->data.weight = NULL;
}

/* When numbers are controlled, and kept: all that a view shows is doubled. */
static void when(struct scene *s)
{
	static const struct {
		size_t iterations, until, at[3]; /* iterations that double */
	} row[] = {{9, 0, {4, 6, 8}}, {8, 0, {4, 6, 0}}, {9, 6, {4, 6, 0}}, {9, 5, {4, 0, 0}},
		{9, 8, {4, 6, 8}}};

	for (size_t k = 0; k < sizeof row / sizeof *row; k++) {
		struct ct_fit_options o;
		struct seen seen = {0};
		struct ct_env env;
		struct ct_fit f;
		size_t wrong = 0, n = 4, d = 0;

		still(&o, row[k].iterations);
		o.gaussians = 4;
		o.max_gaussians = 60;
		o.densify_from = o.densify_every = 2;
		o.densify_until = row[k].until;
		o.densify_grad = 0;
		o.densify_large = 9; /* clones, no children */
		o.checkpoint_every = 1;
		begin(&f, &o, s, &seen, &env);
		must(ct_fit_run(&f, &s->data, &env, &err));
		for (size_t i = 0; i < seen.saves; i++) {
			if (d < 3 && row[k].at[d] == i + 1) {
				n *= 2;
				d++;
			}
			wrong += seen.n[i] != n || seen.step[i] != i + 1;
		}
		OK(wrong == 0 && seen.saves == o.iterations - 1, "%zu, until %zu: when they double",
			o.iterations, o.densify_until);
		ct_fit_free(&f);
	}
}

static void kept(struct scene *s)
{
	struct ct_fit_options o;
	struct seen seen = {0};
	struct ct_env env;
	struct ct_fit f;

	still(&o, 6);
	o.checkpoint_every = o.log_every = 2;
	begin(&f, &o, s, &seen, &env);
	must(ct_fit_run(&f, &s->data, &env, &err));
	OK(seen.saves == 2 && seen.step[0] == 2 && seen.step[1] == 4 && seen.enough == 0,
		"kept every second iteration, but the last");
	OK(seen.iterations == 4, "%zu lines: of the first, and every second", seen.iterations);
	f.g.step = 0;
	must(ct_fit_run(&f, &s->data, &env, &err));
	OK(f.g.step == 0 && seen.saves == 2, "what has ended is left alone");
	f.end = CT_FIT_RUNNING;
	f.g.step = 6;
	f.g.raw[3] = NAN;
	OK(ct_fit_run(&f, &s->data, &env, &err) == -1 && err.code == CT_ENUMERIC,
		"no end with what is no number: %s", err.msg);
	ct_fit_free(&f);
}

/* A run that fails k times, for this reason or that. */
static void again(struct scene *s)
{
	static const struct {
		size_t fail;
		enum ct_code code;
		bool adapt;
		size_t anew; /* new beginnings */
		int rc;
	} row[] = {{3, CT_ENUMERIC, true, 3, 0}, {10, CT_ENUMERIC, true, 10, 0},
		{99, CT_ENUMERIC, true, 10, -1}, {1, CT_ENUMERIC, false, 0, -1},
		{1, CT_EINPUT, true, 0, -1}};

	for (size_t k = 0; k < sizeof row / sizeof *row; k++) {
		struct seen seen = {.fail = row[k].fail, .code = row[k].code};
		struct ct_fit_options o;
		struct ct_env env;
		struct ct_fit f;

		still(&o, 4);
		o.adapt = row[k].adapt;
		o.checkpoint_every = 2;
		begin(&f, &o, s, &seen, &env);
		OK(ct_fit_run(&f, &s->data, &env, &err) == row[k].rc && seen.anew == row[k].anew &&
				equal(f.pace, pow(2, -(double)row[k].anew)) &&
				(row[k].rc == 0 || err.code == row[k].code),
			"%zu failures: %zu new beginnings, pace %g", row[k].fail, seen.anew,
			f.pace);
		ct_fit_free(&f);
	}
}

/* Ten times what it was at first, or without Gaussians in this view or in the mean. */
static void growth(struct scene *s)
{
	for (int k = 0; k < 6; k++) {
		struct ct_fit_options o;
		struct seen seen = {0};
		struct ct_env env;
		struct ct_fit f;
		double l1;
		int rc;

		still(&o, 6);
		o.adapt = false;
		begin(&f, &o, s, &seen, &env);
		f.g.step = 5;
		l1 = error_of(s, &f.g, ct_fit_view(2, 5, VIEWS), 1);
		f.first_l1 = f.residual = 0;
		memset(f.blank, 0, VIEWS * sizeof *f.blank);
		*(k / 2 == 0         ? &f.first_l1
			: k / 2 == 1 ? &f.residual
				     : &f.blank[ct_fit_view(2, 5, VIEWS)]) =
			l1 * (k % 2 ? 0.11 : 0.09);
		rc = ct_fit_run(&f, &s->data, &env, &err);
		OK(k % 2 ? rc == 0
			 : rc == -1 && strstr(err.msg, "iteration 6") &&
					strstr(err.msg, "diverged"),
			"%s times what it was is %s", k % 2 ? "nine" : "eleven",
			k % 2 ? "no divergence" : "one");
		ct_fit_free(&f);
	}
}

/* The term that is not finite is named. */
static void not_finite(struct scene *s)
{
	static const char *const name[] = {"TV", "LR", "SSIM"};
	struct ct_degrade by = {{2, 2, 2}, {0}, CT_DECIMATE_MEAN, {0}};
	const struct ct_vol base = s->base;
	struct ct_vol lr = {0}, bad = {0};

	must(ct_vol_alloc(&lr, (const size_t[]){6, 5, 6}, &err));
	must(ct_vol_alloc(&bad, base.n, &err));
	memcpy(bad.affine, base.affine, sizeof bad.affine);
	memcpy(bad.data, base.data, ct_vol_count(&base) * sizeof(float));
	for (size_t i = 0; i < 180; i++)
		lr.data[i] = NAN;
	bad.data[5] = NAN;
	for (int k = 0; k < 3; k++) {
		struct ct_fit_options o;
		struct seen seen = {0};
		struct ct_env env;
		struct ct_fit f;
		float was = s->target.data[PIXELS + 5];

		still(&o, VIEWS);
		o.adapt = false;
		begin(&f, &o, s, &seen, &env);
		f.opt.tv = k == 0 ? 0.1 : 0;
		f.opt.lr = k == 1 ? 0.1 : 0;
		f.opt.ssim = k == 2 ? 0.1 : 0;
		s->data.base = k == 0 ? &bad : &s->base;
		s->data.lr = k == 1 ? &lr : NULL;
		s->data.by = k == 1 ? &by : NULL;
		if (k == 2)
			s->target.data[PIXELS + 5] = 3e30f;
		f.residual = 1e32;
		OK(ct_fit_run(&f, &s->data, &env, &err) == -1 && err.code == CT_ENUMERIC &&
				strstr(err.msg, name[k]),
			"%s: %s", name[k], err.msg);
		s->target.data[PIXELS + 5] = was;
		ct_fit_free(&f);
	}
	s->data.base = &s->base;
	s->data.lr = NULL;
	s->data.by = NULL;
	ct_vol_free(&lr);
	ct_vol_free(&bad);
}

/* Adam's first step is its rate: of every parameter, beyond the steps in which rates fall. */
static void steps(struct scene *s)
{
	struct ct_fit_options o;
	struct seen seen = {0};
	struct ct_env env;
	struct ct_fit f;

	still(&o, 5);
	o.position = (struct ct_rate){1, 1e-3};
	o.scaling = (struct ct_rate){1, 2e-3};
	o.rotation = (struct ct_rate){1, 3e-3};
	o.density = (struct ct_rate){1, 4e-3};
	o.rate_factor = 2;
	o.rate_steps = 3;
	begin(&f, &o, s, &seen, &env);
	f.g.step = 4;
	f.pace = 0.5;
	f.unit = 0.3;
	for (size_t i = 0; i < f.g.n; i++)
		for (int k = 0; k < 4; k++) {
			f.g.rot[k][i] = k == 0 ? 0.8f : 0.3f * (float)(k - 2) + 0.2f;
			f.g.scale[k % 3][i] = 1.2f + 0.3f * (float)(k % 3);
		}
	{
		float was[CT_GS_FIELDS][20];

		for (size_t k = 0; k < CT_GS_FIELDS; k++)
			memcpy(was[k], f.g.column[k], sizeof was[k]);
		must(ct_fit_run(&f, &s->data, &env, &err));
		for (size_t k = 0; k < CT_GS_FIELDS; k++) {
			double want = k < 3    ? 1e-3 * EXTENT / 2
				      : k < 6  ? 2e-3
				      : k < 10 ? 3e-3
					       : 4e-3 * 0.3;
			double most = 0;

			for (size_t i = 0; i < 20; i++)
				most = fmax(
					most, fabs((double)f.g.column[k][i] - (double)was[k][i]));
			if (!OK(fabs(most / want - 1) < 1e-3, "the step of parameter %zu", k))
				printf("# %g, not %g\n", most, want);
		}
	}
	ct_fit_free(&f);
}

int main(void)
{
	struct scene s;

	make(&s);
	settings();
	measured(&s);
	unit(&s);
	nothing();
	signs();
	order();
	epochs(&s, false);
	epochs(&s, true);
	when(&s);
	kept(&s);
	again(&s);
	growth(&s);
	not_finite(&s);
	steps(&s);
	scene_free(&s);
	return tap_done();
}
