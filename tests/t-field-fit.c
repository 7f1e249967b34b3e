/* t-field-fit.c: the fit of a neural field: the gradient of every kind of samples, through to all
 * weights; the operator on a block; states; threads. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "field-tensors.h"
#include "field/field-fit-step.h"
#include "field/render.h"
#include "formats/format.h"
#include "xray/geometry.h"
#include "numbers.h"
#include "tap.h"

#include <stdlib.h>
#include <string.h>

enum { LR = 6, HR = 12 };

struct scene {
	struct ct_vol lr, fine;
	struct ct_stack rays;
	struct ct_degrade by;
};

static double shape_at(double x, double y, double z)
{
	return 0.5 + 0.3 * sin(5 * x) * cos(4 * y + 1) * sin(3 * z + 2);
}

static void grid(struct ct_vol *v, size_t n, double mm)
{
	const size_t all[3] = {n, n, n + 1};

	must(ct_vol_alloc(v, all, &err));
	for (int a = 0; a < 3; a++) {
		v->affine[a][a] = mm;
		v->affine[a][3] = 0.5 * mm;
	}
	for (size_t i = 0; i < ct_vol_count(v); i++)
		v->data[i] = (float)shape_at((double)(i % n) / (double)n,
			(double)(i / n % n) / (double)n, (double)(i / n / n) / (double)n);
}

static void make(struct scene *s)
{
	struct ct_geometry g;

	s->by = (struct ct_degrade){.factor = {2, 2, 2}};
	ct_degrade_protocol(&s->by, 1);
	grid(&s->lr, LR, 4);
	s->fine = (struct ct_vol){.n = {HR, HR, HR + 2}};
	ct_degrade_refine(s->fine.affine, (const double(*)[4])s->lr.affine, s->lr.n, s->by.factor);
	ct_geometry_default(&g, CT_CONE, &s->lr);
	g.views = 3;
	g.w = g.h = 9;
	g.pitch[0] = g.pitch[1] = 6;
	must(ct_geometry_fill(&s->rays, &g, &err));
	for (size_t i = 0; i < ct_stack_count(&s->rays); i++)
		s->rays.data[i] = i % 7 ? (float)(3 + sin((double)i)) : 0;
}

static struct ct_field_data data_of(const struct scene *s, enum ct_samples_kind kind)
{
	struct ct_field_data d = {.fine = &s->fine, .by = &s->by};

	if (kind == CT_SAMPLES_RAYS)
		d.rays = &s->rays;
	else
		d.lr = &s->lr;
	ct_field_data_box(&d, &s->fine);
	return d;
}

/* Small, and far from its first state, in which all gradients are small. */
static struct ct_field_rule rule_of(enum ct_samples_kind kind)
{
	struct ct_field_rule r;

	ct_field_rule_like(&r, CT_FIELD_LIKE_AUTO, 0);
	ct_field_rule_samples(&r, kind);
	ct_field_rule_network(&r, 2, 8);
	r.shape.encoding =
		(struct ct_encoding){.kind = CT_ENCODING_GRID, .levels = 2, .base = 3, .growth = 2};
	r.shape.network.slope = 0.3;
	r.adaptive = false;
	r.rate[0] = 1e-2;
	r.rate[1] = 1e-3;
	r.iterations = 40;
	r.every = 0;
	if (kind != CT_SAMPLES_POINTS)
		r.batch = kind == CT_SAMPLES_PROFILE ? 4 : 20;
	if (kind == CT_SAMPLES_LINES || kind == CT_SAMPLES_CUBES) {
		r.samples.n = 8;
		r.samples.fine = 6;
	}
	if (kind == CT_SAMPLES_RAYS)
		r.samples.n = 10;
	return r;
}

static void stir(struct ct_field_fit *f, size_t passes)
{
	for (size_t p = 0; p < passes; p++) {
		const size_t n = f->pass[p].field->count;
		float *w = f->pass[p].field->weights, *x = normals(n, 7, p, 0.5);

		for (size_t i = 0; i < n; i++)
			w[i] += x[i];
		free(x);
	}
}

static double loss_at(struct ct_field_fit *f, const struct ct_field_data *d, size_t pass,
	const float *from, const float *v, double h, const struct ct_env *env)
{
	const size_t n = f->pass[pass].field->count;
	float *w = f->pass[pass].field->weights;
	double loss;

	for (size_t i = 0; i < n; i++)
		w[i] = (float)((double)from[i] + h * (double)v[i]);
	must(ct_field_fit_step(f, d, 0, true, &loss, env, &err));
	return loss;
}

/* Along random directions, of the weights of one pass. */
static void check_pass(struct ct_field_fit *f, const struct ct_field_data *d, size_t pass,
	const char *name, const struct ct_env *env)
{
	const size_t n = f->pass[pass].field->count;
	const size_t encoded = f->pass[pass].field->encoded;
	float *from = malloc(n * sizeof *from), *grad = malloc(n * sizeof *grad);
	double worst = 0, loss;

	memcpy(from, f->pass[pass].field->weights, n * sizeof *from);
	must(ct_field_fit_step(f, d, 0, true, &loss, env, &err));
	memcpy(grad, f->pass[pass].grad, n * sizeof *grad);
	for (uint64_t k = 0; k < 6; k++) { /* of the encoding, of the network */
		const double h = 5e-4;
		float *v = normals(n, 11, k, 1);
		double slope, want;

		for (size_t i = 0; i < n; i++)
			v[i] *= (i < encoded) == (k < 3);
		want = (loss_at(f, d, pass, from, v, h, env) -
			       loss_at(f, d, pass, from, v, -h, env)) /
		       (2 * h);
		slope = dot(n, grad, v);
		worst = fmax(
			worst, fabs(slope - want) / (fabs(want) + 0.02 * sqrt(dot(n, grad, grad))));
		free(v);
	}
	(void)loss_at(f, d, pass, from, from, 0, env);
	OK(worst < 0.05, "%s: gradient of pass %zu (%.2g off)", name, pass + 1, worst);
	free(from);
	free(grad);
}

static void check_kind(
	const struct scene *s, enum ct_samples_kind kind, double tv, const struct ct_env *env)
{
	const struct ct_field_data d = data_of(s, kind);
	struct ct_field_rule r = rule_of(kind);
	const size_t passes = ct_samples_passes(&r.samples);
	struct ct_field_fit f;

	r.tv = tv;
	must(ct_field_rule_check(&r, &err));
	must(ct_field_fit_init(&f, &r, &d, env, &err));
	stir(&f, passes);
	if (passes == 2)
		check_pass(&f, &d, 1, CT_WORD(CT_SAMPLES_LIST, kind), env);
	if (passes == 2) /* a second field of zeros sees nothing, wherever it is asked */
		memset(f.pass[1].field->weights, 0, f.pass[1].field->count * sizeof(float));
	check_pass(&f, &d, 0, tv > 0 ? "TV" : CT_WORD(CT_SAMPLES_LIST, kind), env);
	ct_field_fit_free(&f);
}

/* Of one voxel the adaptive gradient is sqrt|error| times the other. */
static void check_adaptive(const struct scene *s, const struct ct_env *env)
{
	const struct ct_field_data d = data_of(s, CT_SAMPLES_POINTS);
	struct ct_field_rule r = rule_of(CT_SAMPLES_POINTS);
	struct ct_field_fit a, b;
	double la, lb;
	size_t n;

	r.batch = 1;
	must(ct_field_fit_init(&a, &r, &d, env, &err));
	r.adaptive = true;
	must(ct_field_fit_init(&b, &r, &d, env, &err));
	must(ct_field_fit_step(&a, &d, 0, true, &la, env, &err));
	must(ct_field_fit_step(&b, &d, 0, true, &lb, env, &err));
	n = a.pass[0].field->count;
	NEAR(lb, pow(la, 1.25), 1e-6, "adaptive: the loss of one voxel");
	NEAR(sqrt(dot(n, b.pass[0].grad, b.pass[0].grad) / dot(n, a.pass[0].grad, a.pass[0].grad)),
		pow(la, 0.25), 1e-5, "and its gradient");
	ct_field_fit_free(&a);
	ct_field_fit_free(&b);
}

/* A colour that is the same everywhere, and density that lets nothing through. */
static void check_render(void)
{
	float t[4] = {-0.9f, -0.2f, 0.3f, 0.8f}, w[4], y[8];

	for (size_t i = 0; i < 4; i++) {
		y[2 * i] = 1e4f;
		y[2 * i + 1] = 0.25f * (float)(i + 1);
	}
	NEAR(ct_render(4, w, t, 1, false, y), 0.25, 1e-6, "a dense line shows what comes first");
	y[0] = y[2] = -1;
	NEAR(ct_render(4, w, t, 1, false, y), 0.75, 1e-6, "density below 0 is none");
	for (size_t i = 0; i < 4; i++)
		y[2 * i] = 1;
	t[0] = 0;
	NEAR(ct_render(1, w, t, 1, true, y), 0, 1e-9, "the centre of a cube has no shell");
	t[0] = 0.5f;
	NEAR(ct_render(1, w, t, 1, true, y), 0.25 * (1 - exp(-0.5)) * 0.25, 1e-6,
		"a shell counts by its area");
}

static void check_chord(void)
{
	const double from[3] = {-1, 0.5, 0.5}, along[3] = {1, 0, 0}, back[3] = {-1, 0, 0};
	const double off[3] = {-1, 1.5, 0.5};
	double span[2];

	NEAR(ct_samples_chord(span, from, along, 0), 1, 1e-12, "a ray through the box");
	NEAR(span[0], 1, 1e-12, "enters at its face");
	NEAR(ct_samples_chord(span, from, back, 0), 0, 0, "not behind the source");
	NEAR(ct_samples_chord(span, from, back, 1), 1, 1e-12, "but of a line");
	NEAR(ct_samples_chord(span, off, along, 0), 0, 0, "a ray beside the box");
}

/* The block is the CT: D itself. A part of it: nearly, and its adjoint is one. */
static void check_block(const struct scene *s)
{
	const size_t all[3] = {LR, LR, LR + 1}, zero[3] = {0}, lo[3] = {1, 2, 3}, m[3] = {2, 3, 2};
	struct ct_field_operator op = {0};
	struct ct_field_block b = {0};
	struct ct_vol hi = {0}, want = {0};
	float *x, *y, *back, got[LR * LR * (LR + 1)];
	double worst = 0;

	must(ct_vol_alloc(&hi, s->fine.n, &err));
	memcpy(hi.affine, s->fine.affine, sizeof hi.affine);
	for (size_t i = 0; i < ct_vol_count(&hi); i++)
		hi.data[i] = (float)shape_at((double)(i % HR) / HR, (double)(i / HR % HR) / HR,
			(double)(i / HR / HR) / HR);
	must(ct_degrade_volume(&want, &hi, &s->by, 0, 1, NULL, &err));
	must(ct_field_operator_alloc(&op, &s->by, hi.n, &err));
	must(ct_field_block_plan(&b, &op, zero, all, NULL, &err));
	ct_separable_apply(&b.forward, got, hi.data, NULL);
	OK(maxdiff(ct_vol_count(&want), got, want.data) < 1e-6, "D of the whole block");
	ct_field_block_free(&b);
	must(ct_field_block_plan(&b, &op, lo, m, NULL, &err));
	x = malloc(b.n[0] * b.n[1] * b.n[2] * sizeof *x);
	for (size_t i = 0; i < b.n[0] * b.n[1] * b.n[2]; i++) {
		const size_t at[3] = {b.first[0] + i % b.n[0], b.first[1] + i / b.n[0] % b.n[1],
			b.first[2] + i / b.n[0] / b.n[1]};

		x[i] = hi.data[(at[2] * HR + at[1]) * HR + at[0]];
	}
	ct_separable_apply(&b.forward, got, x, NULL);
	for (size_t i = 0; i < 12; i++) {
		const size_t v = ((lo[2] + i / 6) * LR + lo[1] + i / 2 % 3) * LR + lo[0] + i % 2;

		worst = fmax(worst, fabs((double)got[i] - (double)want.data[v]));
	}
	OK(worst < 0.02, "D of a part of it (%.2g off)", worst);
	y = normals(12, 3, 0, 1);
	back = malloc(b.n[0] * b.n[1] * b.n[2] * sizeof *back);
	ct_separable_apply(&b.adjoint, back, y, NULL);
	NEAR(dot(b.n[0] * b.n[1] * b.n[2], back, x), dot(12, y, got), 1e-5, "and its adjoint");
	ct_field_block_free(&b);
	for (size_t i = 0; i + m[1] <= LR; i++) {
		must(ct_field_block_plan(&b, &op, (size_t[]){i + 1, i, i + 1}, m, NULL, &err));
		for (int a = 0; a < 3; a++)
			worst = fmax(worst, (double)(b.first[a] + b.n[a]) - (double)hi.n[a]);
		ct_field_block_free(&b);
	}
	OK(worst < 0.02, "no block reaches beyond the faces of the volume");
	ct_field_operator_free(&op);
	ct_vol_free(&hi);
	ct_vol_free(&want);
	free(x);
	free(y);
	free(back);
}

/* So many steps, a state in between if `halt`; the volume. */
static void fitted(struct ct_vol *out, const struct scene *s, enum ct_samples_kind kind,
	size_t threads, bool halt)
{
	const struct ct_field_data d = data_of(s, kind);
	struct ct_env env = {.seed = 3};
	struct ct_field_rule r = rule_of(kind);
	struct ct_field_fit f, g;
	struct ct_tensors t = {0};
	double loss;

	must(ct_par_alloc(&env.par, threads, &err));
	must(ct_field_fit_init(&f, &r, &d, &env, &err));
	for (size_t k = 0; halt && k < 15; k++, f.step++)
		must(ct_field_fit_step(
			&f, &d, 1e-2 * pow(0.1, (double)k / 40), false, &loss, &env, &err));
	must(ct_field_fit_pack(&t, &f, &err));
	must(ct_field_fit_init(&g, &r, &d, &env, &err));
	must(ct_field_fit_unpack(&g, &t, &err));
	must(ct_field_fit_run(&g, &d, &env, &err));
	must(ct_vol_alloc(out, s->fine.n, &err));
	memcpy(out->affine, s->fine.affine, sizeof out->affine);
	must(ct_field_fit_volume(out, &g, &d, &env, &err));
	ct_tensors_free(&t);
	ct_field_fit_free(&f);
	ct_field_fit_free(&g);
	ct_par_free(env.par);
}

static void check_same(const struct scene *s, enum ct_samples_kind kind)
{
	const char *name = CT_WORD(CT_SAMPLES_LIST, kind);
	struct ct_vol a = {0}, b = {0}, c = {0};
	size_t bytes;

	fitted(&a, s, kind, 1, false);
	fitted(&b, s, kind, 3, false);
	fitted(&c, s, kind, 2, true);
	bytes = ct_vol_count(&a) * sizeof(float);
	OK(memcmp(a.data, b.data, bytes) == 0, "%s: 1 and 3 threads, same bytes", name);
	OK(memcmp(a.data, c.data, bytes) == 0, "%s: from a state, same bytes", name);
	ct_vol_free(&a);
	ct_vol_free(&b);
	ct_vol_free(&c);
}

/* A state with this word for `key`, or with NaN or a negative number among the second moments. */
static bool refused(
	const struct scene *s, const char *key, const char *value, float v, enum ct_code code)
{
	const struct ct_field_data d = data_of(s, CT_SAMPLES_LINES);
	const struct ct_field_rule r = rule_of(CT_SAMPLES_LINES);
	const struct ct_env env = {.seed = 3};
	struct ct_field_fit f;
	struct ct_tensors t = {0};
	struct ct_err e = {0};
	bool is;

	must(ct_field_fit_init(&f, &r, &d, &env, &err) || ct_field_fit_pack(&t, &f, &err));
	ct_tensors_find(&t, "v.1")->data[2] = v;
	must(ct_meta_set(&t.meta, key, value, &err));
	is = ct_field_fit_unpack(&f, &t, &e) && e.code == code;
	ct_tensors_free(&t);
	ct_field_fit_free(&f);
	return is;
}

static void check_states(const struct scene *s)
{
	static const char *const bad[][2] = {{CT_META_STEP, "-1"}, {CT_META_STEP, "41"},
		{CT_META_STEP, "5x"}, {CT_META_STEP, "0.5"}, {CT_META_STEP, "nan"},
		{CT_META_AT, ""}, {CT_META_SCALARS, "0 0"}, {CT_META_SCALARS, "nan 0 0"},
		{CT_META_SCALARS, "-1 0 0"}, {CT_META_SCALARS, "0 0 inf"}};

	OK(!refused(s, CT_META_STEP, "40", 0, CT_EINPUT), "a state");
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
		OK(refused(s, bad[i][0], bad[i][1], 0, CT_EINPUT), "%s '%s' is refused", bad[i][0],
			bad[i][1]);
	OK(refused(s, CT_META_STEP, "1", -1, CT_EINPUT), "so is a negative square");
	OK(refused(s, CT_META_STEP, "1", NAN, CT_ENUMERIC), "and NaN");
}

static void check_rule(void)
{
	struct ct_field_rule r = rule_of(CT_SAMPLES_PROFILE);
	struct ct_err e = {0};

	must(ct_field_rule_check(&r, &err));
	r.rate[0] = 0;
	OK(ct_field_rule_check(&r, &e) && e.code == CT_EUSAGE, "a rate of 0 is refused");
	ct_field_rule_like(&r, CT_FIELD_LIKE_AUTO, 0);
	ct_field_rule_network(&r, 1000, 8);
	OK(ct_field_rule_check(&r, &e) && e.code == CT_EUSAGE, "so are 1000 layers");
	ct_field_rule_network(&r, 2, 8);
	ct_field_rule_levels(&r, 500);
	OK(r.shape.encoding.levels == 6, "grids up to 256 for 500 voxels");
	ct_field_rule_levels(&r, 5000);
	OK(r.shape.encoding.levels == 7 && !ct_field_rule_check(&r, &e), "and 512 at most");
	ct_field_rule_network(&r, 8, 256);
	OK(r.shape.network.skip == 5, "8 layers have the code again at 5");
	ct_field_rule_network(&r, 5, 256);
	OK(r.shape.network.skip == 0, "5 layers do not");
}

/* The numbers of the papers. */
static void check_published(void)
{
	struct ct_field_rule r;

	ct_field_rule_like(&r, CT_FIELD_LIKE_NERF, 0);
	OK(r.samples.kind == CT_SAMPLES_LINES && r.shape.encoding.frequencies == 10, "nerf");
	ct_field_rule_like(&r, CT_FIELD_LIKE_CUNERF, 0);
	OK(r.samples.kind == CT_SAMPLES_CUBES && r.samples.n == 64 && r.samples.fine == 64 &&
			r.shape.encoding.frequencies == 11 && r.shape.network.width == 256 &&
			r.shape.network.depth == 8 && r.batch == 1024 && r.iterations == 200000 &&
			r.adaptive && r.rate[0] == 2e-3 && r.rate[1] == 2e-5 && r.warm == 1000,
		"cunerf");
	ct_field_rule_like(&r, CT_FIELD_LIKE_NAF, 100);
	OK(r.samples.n == 192 && r.shape.encoding.levels == 16 &&
			r.shape.encoding.log2_table == 19 && r.shape.encoding.base == 16 &&
			r.shape.network.width == 32 && r.batch == 1024 && r.windows == 0 &&
			r.rate[0] == 1e-3 && r.rate[1] == 1e-4 && r.iterations == 300000,
		"naf");
	ct_field_rule_like(&r, CT_FIELD_LIKE_SAX, 100);
	OK(r.samples.n == 256 && r.windows == 16 && r.shape.network.attention.segment == 2 &&
			r.shape.network.attention.heads == 8 &&
			r.shape.network.attention.head == 4 && r.iterations == 150000,
		"sax-nerf");
}

/* The largest change of a weight by a run to its end, from the state that `steps` steps at
 * `rate` lead to. */
static double moved(const struct scene *s, const struct ct_field_rule *r, size_t steps, double rate)
{
	const struct ct_field_data d = data_of(s, CT_SAMPLES_POINTS);
	const struct ct_env env = {.seed = 3};
	struct ct_field_fit f, g;
	double loss, most = 0;

	must(ct_field_fit_init(&f, r, &d, &env, &err) || ct_field_fit_init(&g, r, &d, &env, &err));
	for (; f.step < steps; f.step++)
		must(ct_field_fit_step(&f, &d, rate, false, &loss, &env, &err));
	must(ct_field_fit_run(&g, &d, &env, &err));
	for (size_t i = 0; i < f.pass[0].field->count; i++)
		most = fmax(most, fabs((double)f.pass[0].field->weights[i] -
					  (double)g.pass[0].field->weights[i]));
	ct_field_fit_free(&f);
	ct_field_fit_free(&g);
	return most;
}

static void check_rates(const struct scene *s)
{
	struct ct_field_rule r = rule_of(CT_SAMPLES_POINTS);

	r.iterations = 4;
	r.stepwise = true;
	r.rate[1] = 1e-30;
	OK(moved(s, &r, 2, 1e-2) < 1e-12, "stepwise: the first rate for half of the steps");
	r.stepwise = false;
	r.rate[0] = r.rate[1] = 1e-2;
	r.iterations = 1;
	r.warm = 10;
	r.cold = 0.25;
	OK(moved(s, &r, 1, 0.25e-2) < 1e-9, "the first step is a cold one");
	r.warm = 1;
	r.iterations = 2;
	r.cold = 0;
	OK(moved(s, &r, 0, 0) > 1e-3, "and those after the warm-up are not");
}

/* The first loss, and the mean that forgets 5 % of it a step. */
static void check_loss(const struct scene *s)
{
	const struct ct_field_data d = data_of(s, CT_SAMPLES_POINTS);
	const struct ct_env env = {.seed = 3};
	struct ct_field_rule r = rule_of(CT_SAMPLES_POINTS);
	struct ct_field_fit f, g;
	double loss[3];

	r.iterations = 3;
	r.rate[0] = r.rate[1] = 1e-2;
	must(ct_field_fit_init(&f, &r, &d, &env, &err) ||
		ct_field_fit_init(&g, &r, &d, &env, &err));
	for (; f.step < 3; f.step++)
		must(ct_field_fit_step(&f, &d, 1e-2, false, &loss[f.step], &env, &err));
	must(ct_field_fit_run(&g, &d, &env, &err));
	NEAR(g.first, loss[0], 0, "the loss of the first step");
	NEAR(g.last, 0.95 * (0.95 * loss[0] + 0.05 * loss[1]) + 0.05 * loss[2], 1e-12 * loss[0],
		"and the running mean");
	ct_field_fit_free(&f);
	ct_field_fit_free(&g);
}

/* Pixel p of view v has the value 1000 v + p + 1. */
static void check_rays(const struct scene *s)
{
	struct ct_field_data d = data_of(s, CT_SAMPLES_RAYS);
	struct ct_field_rule r = rule_of(CT_SAMPLES_RAYS);
	const struct ct_env env = {.seed = 3};
	struct ct_stack rays = s->rays;
	const size_t w = rays.w, area = w * rays.h;
	size_t turns = 0, squares = 0;
	struct ct_field_fit f;

	rays.data = malloc(ct_stack_count(&rays) * sizeof *rays.data);
	for (size_t i = 0; i < ct_stack_count(&rays); i++)
		rays.data[i] = (float)(i / area * 1000 + i % area + 1);
	d.rays = &rays;
	r.batch = 1;
	r.windows = 1;
	must(ct_field_fit_init(&f, &r, &d, &env, &err));
	for (size_t turn = 0, seen = 0; turn < 20; turn++, seen = 0) {
		for (size_t k = 0; k < rays.views; k++, f.step++) {
			struct ct_field_item it;
			bool square = true;
			double first = 0;

			for (size_t i = 0; i < CT_FIELD_WINDOW * CT_FIELD_WINDOW; i++) {
				const size_t at = i / CT_FIELD_WINDOW * w + i % CT_FIELD_WINDOW;

				ct_field_item_of(&it, &f, &d, 1 + i);
				first = i ? first : it.value;
				square = square && it.value == first + (double)at;
			}
			squares += square;
			seen |= (size_t)1 << (size_t)(first / 1000);
		}
		turns += seen == ((size_t)1 << rays.views) - 1;
	}
	OK(turns == 20, "each view once in a turn (%zu of 20)", turns);
	OK(squares == 20 * rays.views, "windows are squares (%zu)", squares);
	ct_field_fit_free(&f);
	free(rays.data);
}

/* Where blocks of 4 of the 6 voxels across begin: as often at a face as what reaches beyond it. */
static void check_blocks(const struct scene *s)
{
	const struct ct_field_data d = data_of(s, CT_SAMPLES_PROFILE);
	const struct ct_field_rule r = rule_of(CT_SAMPLES_PROFILE);
	const struct ct_env env = {.seed = 3};
	size_t count[LR] = {0}, lo[3];
	struct ct_field_fit f;

	must(ct_field_fit_init(&f, &r, &d, &env, &err));
	for (; f.step < 900; f.step++) {
		ct_field_item_block(lo, &f, (const size_t[3]){4, 4, 4});
		count[lo[0] < LR ? lo[0] : LR - 1]++;
	}
	OK(count[0] > 300 && count[1] > 50 && count[2] > 300 && count[3] + count[4] + count[5] == 0,
		"blocks begin at %zu %zu %zu of 900", count[0], count[1], count[2]);
	ct_field_fit_free(&f);
}

/* A density that is rendered begins above 0. */
static void check_begin(const struct scene *s)
{
	const struct ct_field_data d = data_of(s, CT_SAMPLES_LINES);
	const struct ct_field_rule r = rule_of(CT_SAMPLES_LINES);
	const struct ct_env env = {.seed = 3};
	struct ct_field_fit f;

	must(ct_field_fit_init(&f, &r, &d, &env, &err));
	for (size_t p = 0; p < 2; p++) {
		const size_t n = f.pass[p].field->count;
		const float bias = f.pass[p].field->weights[n - 2];

		OK(bias > 0.999f && bias < 1.001f, "pass %zu: its bias is %g", p, (double)bias);
	}
	ct_field_fit_free(&f);
}

/* Far outside the box there is what is on its face. */
static void check_outside(const struct scene *s)
{
	const struct ct_field_data d = data_of(s, CT_SAMPLES_POINTS);
	struct ct_field_rule r = rule_of(CT_SAMPLES_POINTS);
	const struct ct_env env = {.seed = 3};
	struct ct_field_fit f;
	struct ct_vol v[2] = {{.data = NULL}, {.data = NULL}};

	ct_field_rule_encoding(&r, CT_ENCODING_FREQUENCIES); /* grids end by themselves */
	must(ct_field_fit_init(&f, &r, &d, &env, &err));
	stir(&f, 1);
	for (int k = 0; k < 2; k++) {
		must(ct_vol_alloc(&v[k], (const size_t[3]){3, 1, 1}, &err));
		memcpy(v[k].affine, s->lr.affine, sizeof v[k].affine);
		v[k].affine[0][0] = k ? 5000 : 500;
		v[k].affine[0][3] = -v[k].affine[0][0];
		must(ct_field_fit_volume(&v[k], &f, &d, &env, &err));
	}
	OK(v[0].data[0] != v[0].data[2], "the faces of the box differ");
	OK(v[0].data[0] == v[1].data[0] && v[0].data[2] == v[1].data[2], "and reach outwards");
	ct_vol_free(&v[0]);
	ct_vol_free(&v[1]);
	ct_field_fit_free(&f);
}

/* DUMP/step-before.safetensors and -after: the field before and after its step 6, on points x of
 * these values; the moments before it, and its rate. For field-torch.py. */
static void dump(const struct scene *s, const char *folder, const struct ct_env *env)
{
	const struct ct_field_data d = data_of(s, CT_SAMPLES_POINTS);
	const struct ct_field_rule r = rule_of(CT_SAMPLES_POINTS);
	const float rate = 1e-2f;
	struct ct_field_fit f;
	struct ct_tensors t = {0}, after = {0};
	char path[4096];
	size_t n, one = 1, shape[2] = {0, 3};
	double loss;

	must(ct_field_fit_init(&f, &r, &d, env, &err));
	n = f.pass[0].field->count;
	stir(&f, 1);
	for (; f.step < 5; f.step++)
		must(ct_field_fit_step(&f, &d, (double)rate, false, &loss, env, &err));
	must(field_put(f.pass[0].field, &r.shape, &t, &err));
	shape[0] = ct_vol_count(&s->lr);
	must(ct_tensors_put(&t, "x", 2, shape, f.pass[0].x, &err));
	must(ct_tensors_put(&t, "value", 1, shape, s->lr.data, &err));
	must(ct_tensors_put(&t, "m", 1, &n, f.pass[0].m, &err));
	must(ct_tensors_put(&t, "v", 1, &n, f.pass[0].v, &err));
	must(ct_tensors_put(&t, "rate", 1, &one, &rate, &err));
	snprintf(path, sizeof path, "%s/step-before.safetensors", folder);
	must(ct_tensors_write(path, &t, false, env, &err));
	must(ct_field_fit_step(&f, &d, (double)rate, false, &loss, env, &err));
	must(field_put(f.pass[0].field, &r.shape, &after, &err));
	snprintf(path, sizeof path, "%s/step-after.safetensors", folder);
	must(ct_tensors_write(path, &after, false, env, &err));
	ct_tensors_free(&t);
	ct_tensors_free(&after);
	ct_field_fit_free(&f);
}

/* Samples of a cube lie as far from its centre as they say, in all directions and by distance;
 * those of a ray one in each of equal parts, anywhere in it. */
static void check_samples(void)
{
	enum { N = 64 };
	const struct ct_samples cube = {CT_SAMPLES_CUBES, N, N}, ray = {CT_SAMPLES_RAYS, N, 0};
	const struct ct_samples_draw draw = {.seed = 3, .item = 7};
	const double centre[3] = {0.5, 0.5, 0.5}, span[2] = {0, 1}, from[3] = {0, 0.5, 0.5};
	const double edge[3][3] = {{0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}}, along[3] = {1, 0, 0};
	float x[2 * 3 * N], t[2 * N], x1[3 * N], t1[N], w[N];
	double far = 0, least = 1, most = 0, mean[3] = {0};
	bool sorted = true, inside = true;

	for (size_t i = 0; i < N; i++)
		w[i] = 1;
	ct_samples_voxel(&cube, x1, t1, centre, edge, &draw);
	ct_samples_second(&cube, x, t, x1, t1, w, centre, edge, &draw);
	for (size_t i = 0; i < 2 * N; i++) {
		double r = 0;

		for (size_t a = 0; a < 3; a++) {
			const double o = ((double)x[3 * i + a] - 0.5) / 0.1;

			r += o * o;
			mean[a] += o / (2 * N);
		}
		far = fmax(far, fabs(sqrt(r) - (double)t[i]));
		sorted = sorted && (i == 0 || t[i] >= t[i - 1]);
	}
	OK(far < 1e-5 && sorted, "samples of a cube lie where they say, the nearest first");
	OK(fabs(mean[0]) < 0.2 && fabs(mean[1]) < 0.2 && fabs(mean[2]) < 0.2, "on all sides");
	ct_samples_ray(&ray, x, from, along, span, &draw);
	for (size_t i = 0; i < N; i++) {
		const double at = N * (double)x[3 * i] - (double)i;

		inside = inside && at > -1e-5 && at < 1 + 1e-5;
		least = fmin(least, at);
		most = fmax(most, at);
	}
	OK(inside && least < 0.2 && most > 0.8, "samples of a ray lie anywhere in its parts");
}

int main(int argc, char **argv)
{
	const struct ct_env env = {.seed = 5};
	struct scene s = {0};

	make(&s);
	if (argc == 3 && strcmp(argv[1], "dump") == 0) {
		dump(&s, argv[2], &env);
		return 0;
	}
	check_render();
	check_chord();
	check_samples();
	check_block(&s);
	for (int k = 0; k <= CT_SAMPLES_RAYS; k++)
		check_kind(&s, (enum ct_samples_kind)k, 0, &env);
	check_kind(&s, CT_SAMPLES_PROFILE, 0.3, &env);
	check_adaptive(&s, &env);
	for (int k = 0; k <= CT_SAMPLES_RAYS; k++)
		check_same(&s, (enum ct_samples_kind)k);
	check_states(&s);
	check_rule();
	check_published();
	check_rates(&s);
	check_loss(&s);
	check_rays(&s);
	check_blocks(&s);
	check_begin(&s);
	check_outside(&s);
	ct_vol_free(&s.lr);
	ct_stack_free(&s.rays);
	return tap_done();
}
