/* A fit as tensors and back: every number that is kept, and what is refused. Fits that are started
 * badly, or have little to see, end well or say why not.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/gauss.h"
#include "core/mem.h"
#include "core/rng.h"
#include "gs/fit.h"
#include "xray/project.h"
#include "tap.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { COUNT = 5, SCALARS = 9, SETS = 3 };

static double *scalar(struct ct_fit *f, int k)
{
	double *const s[SCALARS] = {&f->g.gamma, &f->gamma.m, &f->gamma.v, &f->first_loss,
		&f->last_loss, &f->first_l1, &f->epoch_l1, &f->error, &f->pace};

	return s[k];
}

static float *array(struct ct_fit *f, size_t set, size_t k)
{
	return set == 0 ? f->g.column[k] : set == 1 ? f->adam.m[k] : f->adam.v[k];
}

/* A number of its own for everything that is kept. */
static void make_fit(struct ct_fit *f)
{
	*f = (struct ct_fit){.opt = {.iterations = 50}, .end = CT_FIT_ENOUGH};
	must(ct_gauss_reserve(&f->g, COUNT, &err));
	must(ct_gs_adam_reserve(&f->adam, 0, COUNT, &err));
	f->g.n = COUNT;
	for (size_t i = 0; i < COUNT; i++) {
		for (size_t set = 0; set < SETS; set++)
			for (size_t k = 0; k < CT_GS_FIELDS; k++)
				array(f, set, k)[i] = (float)(1 + i + 10 * k + 200 * set) / 3;
		f->adam.steps[i] = 16777216 - (float)i;
		f->adam.screen[i] = (float)i / 7;
		f->adam.seen[i] = (float)i * 3;
	}
	for (int k = 0; k < SCALARS; k++)
		*scalar(f, k) = (1 + k) / 7.0;
	f->g.step = 50;
	f->gamma.steps = 31;
}

static bool same(struct ct_fit *a, struct ct_fit *b)
{
	bool ok = a->g.n == b->g.n && a->g.step == b->g.step && a->gamma.steps == b->gamma.steps &&
		  a->end == b->end;

	for (int k = 0; k < SCALARS; k++)
		ok &= memcmp(scalar(a, k), scalar(b, k), sizeof(double)) == 0;
	for (size_t set = 0; ok && set < SETS; set++)
		for (size_t k = 0; k < CT_GS_FIELDS; k++)
			ok &= memcmp(array(a, set, k), array(b, set, k), COUNT * sizeof(float)) ==
			      0;
	return ok && memcmp(a->adam.steps, b->adam.steps, COUNT * sizeof(float)) == 0 &&
	       memcmp(a->adam.seen, b->adam.seen, COUNT * sizeof(float)) == 0 &&
	       memcmp(a->adam.screen, b->adam.screen, COUNT * sizeof(float)) == 0;
}

/* Into a fit that has begun otherwise. */
static int unpack(struct ct_fit *to, const struct ct_tensors *t)
{
	*to = (struct ct_fit){.opt = {.iterations = 50}};
	return ct_fit_state_unpack(to, t, &err);
}

static bool same_floats(const struct ct_tensors *t, const char *name, const float *x)
{
	return memcmp(ct_tensors_find(t, name)->data, x, COUNT * sizeof *x) == 0;
}

static void and_back(void)
{
	for (int bare = 0; bare < 2; bare++) {
		struct ct_tensors t = {0};
		struct ct_fit f, to;

		make_fit(&f);
		if (bare) {
			f.end = CT_FIT_RUNNING;
			f.g.step = 0;
		}
		must(ct_fit_state_pack(&t, &f, &err));
		must(unpack(&to, &t));
		OK(same(&f, &to), "packed and unpacked: the same, %s",
			bare ? "as it runs" : "at its end");
		OK(same_floats(&t, "y.m", f.adam.m[1]) &&
				same_floats(&t, "scale_2.v", f.adam.v[5]) &&
				same_floats(&t, "rot_0", f.g.rot[0]) &&
				same_floats(&t, "screen", f.adam.screen) &&
				ct_tensors_find(&t, "steps")->data[1] == 16777215 &&
				ct_tensors_find(&t, "seen")->data[1] == 3,
			"by name");
		OK(t.n == SETS * CT_GS_FIELDS + 3, "in %zu tensors", t.n);
		ct_fit_free(&f);
		ct_fit_free(&to);
		ct_tensors_free(&t);
	}
}

static bool refused(const struct ct_tensors *t, const char *word)
{
	struct ct_fit to;
	bool ok;

	err = (struct ct_err){0};
	ok = unpack(&to, t) == -1 && (err.code == CT_EINPUT || err.code == CT_ENUMERIC) &&
	     strstr(err.msg, word);
	ct_fit_free(&to);
	if (!ok)
		printf("# %s: %s\n", word, err.msg);
	return ok;
}

/* A number that none of its kind can be. */
static void numbers(struct ct_tensors *t)
{
	static const struct {
		const char *name;
		float to;
		bool wrong;
	} row[] = {{"x", NAN, true}, {"raw.v", INFINITY, true}, {"screen", -INFINITY, true},
		{"screen", -1, false}, {"steps", -1, true}, {"steps", 16777218, true},
		{"steps", 16777216, false}, {"seen", -1, true}, {"seen", 0, false}};

	for (size_t k = 0; k < sizeof row / sizeof *row; k++) {
		struct ct_tensor *x = ct_tensors_find(t, row[k].name);
		float was = x->data[COUNT - 1];
		struct ct_fit to;

		x->data[COUNT - 1] = row[k].to;
		if (row[k].wrong) {
			OK(refused(t, row[k].name), "%s is never %g", row[k].name,
				(double)row[k].to);
		} else {
			OK(unpack(&to, t) == 0, "%s may be %g", row[k].name, (double)row[k].to);
			ct_fit_free(&to);
		}
		x->data[COUNT - 1] = was;
	}
}

/* A tensor that is missing, or of another shape. */
static void shapes(struct ct_tensors *t)
{
	static const char *const name[] = {"x", "rot_3.m", "raw", "steps", "screen", "seen"};

	for (size_t k = 0; k < sizeof name / sizeof *name; k++) {
		struct ct_tensor *x = ct_tensors_find(t, name[k]);
		const char was = x->name[0];

		x->name[0] = '?';
		OK(refused(t, k ? name[k] : "no Gaussians"), "%s is missing", name[k]);
		x->name[0] = was;
		if (k == 0)
			continue;
		x->dim[0]--;
		OK(refused(t, name[k]), "%s is too short", name[k]);
		x->dim[0]++;
		x->rank = 2;
		x->dim[1] = 1;
		OK(refused(t, name[k]), "%s has two dimensions", name[k]);
		x->rank = 1;
	}
	ct_tensors_find(t, "x")->dim[0] = 0;
	OK(refused(t, "no Gaussians"), "no Gaussian");
	ct_tensors_find(t, "x")->dim[0] = COUNT;
}

/* The metadata: scalars, step, end. */
static void words(struct ct_tensors *t)
{
	static const struct {
		const char *key, *value, *word; /* word NULL: that is fine */
	} row[] = {{CT_META_SCALARS, "1 2 3 4 5 6 7 8", "scalar 8"},
		{CT_META_SCALARS, "1 2 inf 4 5 6 7 8 9", "scalar 2"},
		{CT_META_SCALARS, "1 2 x 4 5 6 7 8 9", "scalar 2"},
		{CT_META_SCALARS, "0 2 3 4 5 6 7 8 9", "gamma"},
		{CT_META_SCALARS, "0x1p-3 2 3 4 5 6 7 8 9", NULL}, {CT_META_STEP, "51 1", "step"},
		{CT_META_STEP, "50", "step"}, {CT_META_STEP, "50 1", NULL},
		{CT_META_AT, "x", "ended"}, {CT_META_AT, "-1 0", "ended"},
		{CT_META_AT, "3 0", "ended"}, {CT_META_AT, "0 0", NULL}, {CT_META_AT, "2 1", NULL}};

	for (size_t k = 0; k < sizeof row / sizeof *row; k++) {
		char *was = strdup(ct_meta_get(&t->meta, row[k].key));
		struct ct_fit to;

		must(ct_meta_set(&t->meta, row[k].key, row[k].value, &err));
		if (row[k].word) {
			OK(refused(t, row[k].word), "%s is refused", row[k].value);
		} else {
			OK(unpack(&to, t) == 0, "%s is taken", row[k].value);
			ct_fit_free(&to);
		}
		must(ct_meta_set(&t->meta, row[k].key, was, &err));
		free(was);
	}
	for (int k = 0; k < 3; k++) {
		struct ct_meta all = t->meta, none = {0};

		t->meta = none;
		if (k > 0)
			must(ct_meta_set(&t->meta, CT_META_SCALARS, "1 2 3 4 5 6 7 8 9", &err));
		if (k > 1)
			must(ct_meta_set(&t->meta, CT_META_STEP, "1 1", &err));
		OK(refused(t, k == 0   ? "scalar 0"
			      : k == 1 ? "step"
				       : "ended"),
			"without metadata %d", k);
		ct_meta_free(&t->meta);
		t->meta = all;
	}
}

static void t_fit_state(void)
{
	struct ct_tensors t = {0};
	struct ct_fit f;

	and_back();
	make_fit(&f);
	must(ct_fit_state_pack(&t, &f, &err));
	numbers(&t);
	shapes(&t);
	words(&t);
	ct_tensors_free(&t);
	ct_fit_free(&f);
}

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
	t_fit_state();
	return tap_done();
}
