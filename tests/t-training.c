/* Training against its formulas written out: pieces of pictures, the loss of a step and of a
 * validation, AdamW, the average of the weights. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "diffusion/train.h"
#include "tap.h"
#include "diffusion/schedule.h"
#include "numbers.h"

#include <stdlib.h>
#include <string.h>

enum { SIZE = 8 };
enum { PIECE = 0, TIME = 1, NOISE = 2, DRAWS = 3 };

/* Value of a pixel: no two pieces, mirrored or not, are alike. */
static float value(size_t row, size_t col)
{
	return (float)(0.1 + 0.01 * (double)row + 0.001 * (double)(col * col % 97));
}

static void picture(struct ct_pictures *s, size_t h, size_t w)
{
	float *px = malloc(h * w * sizeof *px);

	for (size_t i = 0; px && i < h * w; i++)
		px[i] = value(i / w, i % w);
	must(!px || ct_pictures_add(s, h, w, px, "a picture", &err));
}

static void options(struct ct_train_opts *o, struct ct_unet_arch *a)
{
	ct_train_default(o);
	o->patches.size = SIZE;
	o->batch = 3;
	o->seed = 17;
	o->adam.lr = 0.02;
	ct_unet_arch_default(a);
	a->levels = 1;
	a->num_res_blocks = 1;
}

/* The weights, their average and their moments. */
static const struct ct_tensor *vector(const struct ct_tensors *state, const char *name)
{
	const struct ct_tensor *t = ct_tensors_find(state, name);

	if (!t)
		exit(99);
	return t;
}

/* Is x the area means of f x f pixels from (row, col) on, mirrored? */
static bool is_piece(const float *x, size_t n, size_t row, size_t col, size_t f, bool mirrored)
{
	for (size_t i = 0; i < n; i++)
		for (size_t j = 0; j < n; j++) {
			size_t r = row + i * f, c = col + (mirrored ? n - 1 - j : j) * f;
			double sum = 0;

			for (size_t k = 0; k < f * f; k++)
				sum += (double)value(r + k / f, c + k % f);
			sum = 2 * sum / (double)(f * f) - 1;
			if (fabs((double)x[i * n + j] - sum) > 1e-5)
				return false;
		}
	return true;
}

/* Pieces of 4 of a picture of 11 x 13, at scales 1 and 2: each is one of the pieces there are, and
 * both mirrorings and both scales come. */
static void pieces(void)
{
	enum { H = 11, W = 13, N = 4 };
	const struct ct_patches p = {.size = N, .channels = 2, .scales = 3, .scale = {1, 2, 3}};
	struct ct_pictures s = {0};
	size_t how[2] = {0}, scale[3] = {0}, strange = 0, edge = 0;
	float x[2 * N * N];

	picture(&s, 2, 2); /* too small: passed over */
	picture(&s, H, W);
	for (size_t k = 0; k < 400; k++) {
		bool found = false;

		ct_patches_draw(&p, &s, x, 5, k);
		for (size_t f = 1; f <= 3 && !found; f++)
			for (size_t at = 0; at < H * W && !found; at++)
				for (int m = 0; m < 2 && !found; m++) {
					found = at / W + N * f <= H && at % W + N * f <= W &&
						is_piece(x, N, at / W, at % W, f, m);
					if (!found)
						continue;
					how[m]++;
					scale[f - 1]++;
					edge += at / W + N * f == H && at % W + N * f == W;
				}
		strange += !found || memcmp(x, x + N * N, N * N * sizeof *x) != 0;
	}
	OK(strange == 0, "every piece is one of the picture's, in every channel");
	OK(how[0] > 120 && how[1] > 120, "mirrored, or not: %zu, %zu", how[0], how[1]);
	OK(scale[0] > 120 && scale[1] > 120 && scale[2] == 0,
		"at the scales that it is large enough for: %zu, %zu", scale[0], scale[1]);
	OK(edge > 0, "up to its last row and column");
	ct_pictures_free(&s);
}

static void adamw(void)
{
	enum { N = 5 };
	const struct ct_adamw a = {
		.lr = 0.01, .beta1 = 0.8, .beta2 = 0.95, .eps = 1e-3, .decay = 0.5};
	float p[N], m[N] = {0}, v[N] = {0}, g[3 * N], mean[N];
	double P[N], M[N] = {0}, V[N] = {0}, worst = 0, squares = 0, norm;

	for (int i = 0; i < N; i++)
		P[i] = (double)(p[i] = ct_rng_normal(1, 1, (uint64_t)i));
	for (uint64_t step = 1; step <= 4; step++) {
		ct_rng_normals(N, g, 2, step, 0);
		CT_SIMD(ct_adamw_step)(&a, step, N, p, m, v, g);
		for (int i = 0; i < N; i++) {
			double d = (double)g[i];

			M[i] = a.beta1 * M[i] + (1 - a.beta1) * d;
			V[i] = a.beta2 * V[i] + (1 - a.beta2) * d * d;
			P[i] = (1 - a.lr * a.decay) * P[i] -
			       a.lr * (M[i] / (1 - pow(a.beta1, (double)step))) /
				       (sqrt(V[i] / (1 - pow(a.beta2, (double)step))) + a.eps);
			worst = fmax(worst, fabs(P[i] - (double)p[i]));
		}
	}
	NEAR(worst, 0, 2e-7, "four steps of AdamW");
	worst = 0;
	for (int i = 0; i < N; i++)
		mean[i] = (float)i;
	CT_SIMD(ct_adam_average)(0.75, N, mean, p);
	for (int i = 0; i < N; i++)
		worst = fmax(worst, fabs((double)mean[i] - (0.75 * i + 0.25 * (double)p[i])));
	NEAR(worst, 0, 3e-7, "an average of weights");
	ct_rng_normals(3 * N, g, 3, 0, 0);
	for (int i = 0; i < N; i++)
		P[i] = 0.5 * ((double)g[i] + (double)g[N + i] + (double)g[2 * N + i]);
	norm = CT_SIMD(ct_adam_gradient)(N, g, 3, N, 0.5f);
	worst = 0;
	for (int i = 0; i < N; i++) {
		squares += P[i] * P[i];
		worst = fmax(worst, fabs(P[i] - (double)g[i]));
	}
	NEAR(worst, 0, 1e-6, "groups of gradients added");
	NEAR(norm / squares, 1, 1e-5, "and their squares");
}

/* Normal numbers are Box and Muller's pairs: the first half of what draws a pair is its radius. */
static void noise(void)
{
	double worst = 0;

	for (uint64_t i = 0; i < 200; i++) {
		double a = (double)ct_rng_normal(3, 4, 2 * i);
		double b = (double)ct_rng_normal(3, 4, 2 * i + 1);

		worst = fmax(worst, fabs(hypot(a, b) - sqrt(-2 * log(ct_rng_uniform(3, 4, i)))));
	}
	NEAR(worst, 0, 1e-6, "normal numbers by Box and Muller");
}

/* Loss of one sample, from the weights, by train.h. */
static double by_hand(const struct ct_train_opts *o, const struct ct_pictures *s,
	const struct ct_tensors *weights, uint64_t seed, uint64_t sample, int time)
{
	enum { N = SIZE * SIZE };
	struct ct_unet_arch a;
	struct ct_unet *net = NULL;
	struct ct_unet_plan *plan = NULL;
	struct ct_schedule schedule;
	float x0[N], z[N], eps[N];
	double sum = 0, abar;

	ct_schedule_default(&schedule);
	abar = ct_schedule_abar(&schedule, time);
	must(ct_unet_arch_of(&a, weights, &err));
	must(ct_unet_init(&net, &a, 1, &err));
	for (size_t i = 0; i < net->graph.n_param; i++) {
		const struct ct_param *p = &net->graph.param[i];
		const struct ct_tensor *t = ct_tensors_find(weights, p->name);

		memcpy(net->param + p->offset, t->data, p->count * sizeof *t->data);
	}
	must(ct_unet_plan_alloc(&plan, net, SIZE, SIZE, false, &err));
	ct_patches_draw(&o->patches, s, x0, seed, sample * DRAWS + PIECE);
	ct_rng_normals(N, z, seed, sample * DRAWS + NOISE, 0);
	for (int i = 0; i < N; i++)
		x0[i] = (float)(sqrt(abar) * (double)x0[i] + sqrt(1 - abar) * (double)z[i]);
	must(ct_unet_forward(plan, eps, x0, time, &err));
	for (int i = 0; i < N; i++)
		sum += pow((double)eps[i] - (double)z[i], 2) / N;
	ct_unet_plan_free(plan);
	ct_unet_free(net);
	return sum;
}

/* A network that has learnt for a few steps, so that its output depends on its input; without an
 * average (ema 0), so that its weights can be asked for. */
static void losses(const struct ct_env *env)
{
	struct ct_train_opts o;
	struct ct_unet_arch a;
	struct ct_train *t = NULL;
	struct ct_tensors weights = {0};
	struct ct_pictures s = {0}, other = {0};
	double loss, want = 0;

	options(&o, &a);
	o.ema = 0;
	picture(&s, 20, 24);
	picture(&other, 15, 9);
	must(ct_train_alloc(&t, &a, &o, &s, env, &err));
	for (int k = 0; k < 6; k++)
		must(ct_train_step(t, &loss, &err));
	must(ct_train_result(t, &weights, &err));
	must(ct_train_validate(t, &other, 4, &loss, &err));
	for (uint64_t k = 0; k < 4; k++)
		want += by_hand(&o, &other, &weights, ~o.seed, k, (int)(125 + 250 * k)) / 4;
	NEAR(loss / want, 1, 1e-4, "the loss of a validation");
	OK(fabs(want - 1) > 0.02, "of a network that has learnt something (%g)", want);
	want = 0;
	for (uint64_t k = 0; k < 3; k++) {
		uint64_t sample = 6 * 3 + k;
		int time = (int)ct_rng_below(o.seed, sample * DRAWS + TIME, 0, CT_TIMESTEPS);

		want += by_hand(&o, &s, &weights, o.seed, sample, time) / 3;
	}
	must(ct_train_step(t, &loss, &err));
	NEAR(loss / want, 1, 1e-4, "the loss of step 7");
	OK(ct_train_steps(t) == 7, "seven steps");
	ct_tensors_free(&weights);
	ct_train_free(t);
	ct_pictures_free(&s);
	ct_pictures_free(&other);
}

/* Largest |ema' - (d ema + (1 - d) param')| over a step, d = min(ema, (2 + n) / (11 + n)). */
static double averaged(const struct ct_train_opts *o, const struct ct_tensors *before,
	const struct ct_tensors *after, double n)
{
	const struct ct_tensor *was = ct_tensors_find(before, "average");
	const struct ct_tensor *is = ct_tensors_find(after, "average");
	const struct ct_tensor *param = ct_tensors_find(after, "weights");
	double d = fmin(o->ema, (2 + n) / (11 + n)), worst = 0;

	for (size_t i = 0; i < ct_tensor_count(is); i++)
		worst = fmax(worst, fabs((double)is->data[i] - d * (double)was->data[i] -
					    (1 - d) * (double)param->data[i]));
	return worst;
}

static void warm_up(const struct ct_env *env)
{
	struct ct_train_opts o;
	struct ct_unet_arch a;
	struct ct_train *t = NULL;
	struct ct_pictures s = {0};
	double loss, worst = 0, rate = 0;

	options(&o, &a);
	o.ema = 0.2; /* reached in the second step: 2/11, 3/12 */
	o.warmup = 2;
	o.cosine = true;
	o.steps = 6;
	picture(&s, 20, 24);
	must(ct_train_alloc(&t, &a, &o, &s, env, &err));
	for (int k = 0; k < 5; k++) {
		struct ct_tensors before = {0}, after = {0};
		double lr = k < 2 ? o.adam.lr * (k + 1) / 2
				  : o.adam.lr * 0.5 * (1 + cos(M_PI * (k - 2) / 4));

		rate = fmax(rate, fabs(ct_train_rate(t) - lr));
		must(ct_train_save(t, &before, &err));
		must(ct_train_step(t, &loss, &err));
		must(ct_train_save(t, &after, &err));
		worst = fmax(worst, averaged(&o, &before, &after, k));
		ct_tensors_free(&before);
		ct_tensors_free(&after);
	}
	NEAR(worst, 0, 2e-6, "the average forgets faster at first");
	NEAR(rate, 0, 1e-12, "the rate rises, then falls as a cosine");
	ct_train_free(t);
	ct_pictures_free(&s);
}

/* The gradient of a step's batch, mean over its samples, by train.h; free() it. */
static float *gradient(const struct ct_train_opts *o, const struct ct_unet_arch *a,
	const struct ct_pictures *s, const struct ct_tensor *param, uint64_t step)
{
	enum { N = SIZE * SIZE };
	struct ct_unet *net = NULL;
	struct ct_unet_plan *plan = NULL;
	struct ct_schedule schedule;
	float x[N], z[N], eps[N], *g = calloc(ct_tensor_count(param), sizeof *g);

	ct_schedule_default(&schedule);
	must(!g || ct_unet_init(&net, a, 1, &err));
	memcpy(net->param, param->data, net->graph.count * sizeof *net->param);
	must(ct_unet_plan_alloc(&plan, net, SIZE, SIZE, true, &err));
	for (uint64_t k = 0; k < o->batch; k++) {
		uint64_t at = (step * o->batch + k) * DRAWS;
		int time = (int)ct_rng_below(o->seed, at + TIME, 0, CT_TIMESTEPS);
		double abar = ct_schedule_abar(&schedule, time);

		ct_patches_draw(&o->patches, s, x, o->seed, at + PIECE);
		ct_rng_normals(N, z, o->seed, at + NOISE, 0);
		for (int i = 0; i < N; i++)
			x[i] = (float)(sqrt(abar) * (double)x[i] + sqrt(1 - abar) * (double)z[i]);
		must(ct_unet_forward(plan, eps, x, time, &err));
		for (int i = 0; i < N; i++)
			eps[i] = 2 * (eps[i] - z[i]) / (float)(N * o->batch);
		must(ct_unet_backward(plan, g, NULL, eps, &err));
	}
	ct_unet_plan_free(plan);
	ct_unet_free(net);
	return g;
}

/* A step of the warm-up between two states, written out: the moments from the gradient, the weights
 * from the moments. */
static void step_by_hand(const struct ct_train_opts *o, const struct ct_tensors *before,
	const struct ct_tensors *after, uint64_t step, const float *g, double scale)
{
	const struct ct_tensor *p = vector(before, "weights"), *q = vector(after, "weights");
	const struct ct_tensor *m = vector(before, "adam.m"), *n = vector(after, "adam.m");
	const struct ct_tensor *v = vector(before, "adam.v"), *w = vector(after, "adam.v");
	const struct ct_adamw *a = &o->adam;
	double lr = a->lr * ((double)step + 1) / (double)o->warmup;
	double one = 1 - pow(a->beta1, (double)step + 1), two = 1 - pow(a->beta2, (double)step + 1);
	double first = 0, second = 0, weights = 0, most = 0;

	for (size_t i = 0; i < ct_tensor_count(p); i++) {
		double d = scale * (double)g[i], mean = (double)n->data[i] / one;
		double root = sqrt((double)w->data[i] / two);
		double want =
			(1 - lr * a->decay) * (double)p->data[i] - lr * mean / (root + a->eps);

		most = fmax(most, fabs(d));
		first = fmax(first, fabs(a->beta1 * (double)m->data[i] + (1 - a->beta1) * d -
					    (double)n->data[i]));
		second = fmax(second, fabs(a->beta2 * (double)v->data[i] + (1 - a->beta2) * d * d -
					      (double)w->data[i]));
		weights = fmax(weights, fabs(want - (double)q->data[i]));
	}
	NEAR(first / most, 0, 2e-5, "the first moment has the batch's gradient, each sample once");
	NEAR(second / (most * most), 0, 2e-5, "the second its square");
	NEAR(weights, 0, 1e-5, "and the weights go by Adam");
}

/* Nine samples in eight groups, more parameters than one chunk has, without and with a clip. */
static void steps(const struct ct_env *env)
{
	struct ct_train_opts o;
	struct ct_unet_arch a;
	struct ct_pictures s = {0};
	double loss, norm = 0;

	picture(&s, 20, 24);
	for (int clip = 0; clip < 2; clip++) {
		struct ct_train *t = NULL;
		struct ct_tensors before = {0}, after = {0};
		float *g;

		options(&o, &a);
		o.batch = 9;
		o.warmup = 6;
		o.adam.decay = 0.1;
		o.adam.eps = 1e-3; /* no weight whose gradient is rounding alone moves */
		o.clip = clip ? norm / 3 : 0;
		must(ct_train_alloc(&t, &a, &o, &s, env, &err));
		for (int k = 0; k < 3; k++)
			must(ct_train_step(t, &loss, &err));
		must(ct_train_save(t, &before, &err));
		must(ct_train_step(t, &loss, &err));
		must(ct_train_save(t, &after, &err));
		g = gradient(&o, &a, &s, vector(&before, "weights"), 3);
		norm = sqrt(dot(ct_tensor_count(vector(&before, "weights")), g, g));
		OK(!clip || o.clip < 0.7 * norm, "clip %g of %g", o.clip, norm);
		step_by_hand(&o, &before, &after, 3, g, clip ? o.clip / norm : 1);
		free(g);
		ct_tensors_free(&before);
		ct_tensors_free(&after);
		ct_train_free(t);
	}
	ct_pictures_free(&s);
}

static void bad_pictures(void)
{
	static const float bad[] = {-1e-6f, 1.000001f, NAN};
	struct ct_pictures s = {0};

	for (int k = 0; k < 3; k++) {
		float *px = calloc(6, sizeof *px);

		must(!px);
		px[k == 2 ? 0 : 5] = bad[k];
		OK(ct_pictures_add(&s, 2, 3, px, "x.png", &err) == -1 && err.code == CT_ENUMERIC &&
				strstr(err.msg, k == 2 ? "x.png: row 0, column 0 is"
						       : "x.png: row 1, column 2 is"),
			"%s", err.msg);
	}
	OK(s.n == 0, "no picture");
	ct_pictures_free(&s);
}

/* A training stopped and resumed, its state and what it holds, and what cannot be trained. */

static bool same_state(const struct ct_tensors *a, const struct ct_tensors *b)
{
	static const char *const names[] = {"weights", "average", "adam.m", "adam.v"};

	for (int i = 0; i < 4; i++) {
		const struct ct_tensor *x = vector(a, names[i]), *y = vector(b, names[i]);
		size_t n = ct_tensor_count(x);

		if (n != ct_tensor_count(y) || memcmp(x->data, y->data, n * sizeof *x->data) != 0)
			return false;
	}
	return strcmp(ct_meta_get(&a->meta, CT_META_STEP), ct_meta_get(&b->meta, CT_META_STEP)) ==
	       0;
}

/* What a training holds, summed up. */
static void bytes(const struct ct_train *t, const struct ct_unet_arch *a, size_t threads)
{
	struct ct_unet *net = NULL;
	struct ct_unet_plan *plan = NULL;
	double want;

	must(ct_unet_init(&net, a, 1, &err));
	must(ct_unet_plan_alloc(&plan, net, SIZE, SIZE, true, &err));
	want = (double)threads * ((double)ct_unet_plan_bytes(plan) + 4.0 * 4 * SIZE * SIZE);
	/* weights, three times in an order of their own; average, twice; two moments; three groups
	 */
	want += 4.0 * (double)net->graph.count * (3 + 2 + 2 + 3);
	NEAR(ct_train_bytes(t) / want, 1, 1e-9, "the bytes it holds");
	ct_unet_plan_free(plan);
	ct_unet_free(net);
}

/* A training goes on from its state as if it had not been interrupted, and its average is the
 * state's. */
static void resumed(const struct ct_env *env)
{
	struct ct_train_opts o;
	struct ct_unet_arch a;
	struct ct_train *t = NULL, *u = NULL;
	struct ct_tensors state = {0}, one = {0}, two = {0};
	struct ct_pictures s = {0};
	double loss, want, got, was;

	options(&o, &a);
	picture(&s, 20, 24);
	must(ct_train_alloc(&t, &a, &o, &s, env, &err));
	must(ct_train_alloc(&u, &a, &o, &s, env, &err));
	bytes(t, &a, ct_par_threads(env->par));
	must(ct_train_validate(u, &s, 2, &was, &err));
	for (int k = 0; k < 3; k++)
		must(ct_train_step(t, &loss, &err));
	must(ct_train_validate(t, &s, 2, &want, &err));
	must(ct_train_save(t, &state, &err));
	must(ct_train_restore(u, &state, &err));
	OK(ct_train_steps(u) == 3, "three steps are done");
	must(ct_train_save(u, &one, &err));
	OK(same_state(&state, &one), "the state of what was restored is the same");
	must(ct_train_validate(u, &s, 2, &got, &err));
	OK(want == got && got < was, "so is the loss of its average: %g, %g before", got, was);
	must(ct_train_step(u, &loss, &err));
	must(ct_train_validate(u, &s, 2, &was, &err));
	OK(was != got, "which a step changes");
	must(ct_train_step(t, &loss, &err));
	ct_tensors_free(&one);
	must(ct_train_save(u, &one, &err));
	must(ct_train_save(t, &two, &err));
	OK(same_state(&one, &two) && !same_state(&one, &state), "and so is the next step");
	must(ct_train_validate(t, &s, 2, &want, &err));
	must(ct_train_restore(u, &two, &err));
	must(ct_train_validate(u, &s, 2, &got, &err));
	OK(want == got, "whose average is the one that is validated");
	ct_tensors_free(&state);
	ct_tensors_free(&one);
	ct_tensors_free(&two);
	ct_train_free(t);
	ct_train_free(u);
	ct_pictures_free(&s);
}

static void no_state(struct ct_train *t, const struct ct_tensors *w, enum ct_code code,
	const char *word, const char *what)
{
	struct ct_tensors before = {0}, after = {0};
	int rc;

	must(ct_train_save(t, &before, &err));
	rc = ct_train_restore(t, w, &err);
	must(ct_train_save(t, &after, &err));
	OK(rc == -1 && err.code == code && strstr(err.msg, word) && same_state(&before, &after),
		"no state: %s: %s", what, err.msg);
	ct_tensors_free(&before);
	ct_tensors_free(&after);
}

static void bad_states(const struct ct_env *env)
{
	static const char *const names[] = {"weights", "average", "adam.m", "adam.v"};
	struct ct_train_opts o;
	struct ct_unet_arch a;
	struct ct_train *t = NULL;
	struct ct_tensors w = {0};
	struct ct_pictures s = {0};

	options(&o, &a);
	picture(&s, 20, 24);
	must(ct_train_alloc(&t, &a, &o, &s, env, &err));
	must(ct_train_save(t, &w, &err));
	for (int i = 0; i < 4; i++) {
		struct ct_tensor *x = ct_tensors_find(&w, names[i]);
		size_t n = x->dim[0];
		char was = x->name[0];

		for (size_t k = 0; k < n; k += n - 1) {
			x->data[k] = k ? HUGE_VALF : NAN;
			no_state(t, &w, CT_ENUMERIC, k ? " is inf" : "value 0 is", names[i]);
			x->data[k] = 0;
		}
		x->dim[0]--;
		no_state(t, &w, CT_EINPUT, names[i], "a value less");
		x->dim[0]++;
		x->rank = 2;
		x->dim[1] = 1;
		no_state(t, &w, CT_EINPUT, names[i], "a matrix");
		x->rank = 1;
		x->name[0] = 'x';
		no_state(t, &w, CT_EINPUT, names[i], "another name");
		x->name[0] = was;
	}
	must(ct_meta_set(&w.meta, CT_META_STEP, "-1", &err));
	no_state(t, &w, CT_EINPUT, "step", "before the first step");
	must(ct_meta_set(&w.meta, CT_META_STEP, "9007199254740992", &err));
	no_state(t, &w, CT_EINPUT, "step", "step 2^53");
	ct_meta_drop(&w.meta, CT_META_STEP);
	no_state(t, &w, CT_EINPUT, "step", "no step");
	must(ct_meta_set(&w.meta, CT_META_STEP, "9007199254740991", &err));
	OK(ct_train_restore(t, &w, &err) == 0 && ct_train_steps(t) == ((uint64_t)1 << 53) - 1,
		"the last step that there is");
	ct_tensors_free(&w);
	ct_train_free(t);
	ct_pictures_free(&s);
}

/* Weights of the last convolution so large that the loss is a number, but no gradient is; and the
 * user's wish to stop: the weights stay as they were. */
static void failed_steps(const struct ct_env *quiet)
{
	volatile sig_atomic_t stop = 0;
	struct ct_env env = *quiet;
	struct ct_train_opts o;
	struct ct_unet_arch a;
	struct ct_train *t = NULL;
	struct ct_tensors before = {0}, after = {0};
	struct ct_pictures s = {0};
	struct ct_tensor *p;
	double loss = 0;
	size_t n;

	env.stop = &stop;
	options(&o, &a);
	o.batch = 1;
	picture(&s, 20, 24);
	must(ct_train_alloc(&t, &a, &o, &s, &env, &err));
	must(ct_train_save(t, &before, &err));
	p = ct_tensors_find(&before, "weights");
	n = ct_tensor_count(p);
	p->data[n - 1] = 1e25f; /* its bias */
	for (size_t i = n - 1 - 32 * 9; i < n - 1; i++)
		p->data[i] = 1e16f;
	must(ct_train_restore(t, &before, &err));
	OK(ct_train_step(t, &loss, &err) == -1 && err.code == CT_ENUMERIC &&
			strstr(err.msg, "step 1: loss ") && isfinite(loss) && loss > 1e40,
		"no gradient: %s", err.msg);
	must(ct_train_save(t, &after, &err));
	OK(same_state(&before, &after), "the weights are those before");
	p->data[n - 1] = 1;
	memset(p->data + n - 1 - 32 * 9, 0, 32 * 9 * sizeof *p->data);
	must(ct_train_restore(t, &before, &err));
	stop = 1;
	OK(ct_train_step(t, &loss, &err) == -1 && err.code == CT_ESTOP, "stopped: %s", err.msg);
	OK(ct_train_validate(t, &s, 1, &loss, &err) == -1 && err.code == CT_ESTOP,
		"validation too");
	ct_tensors_free(&after);
	must(ct_train_save(t, &after, &err));
	OK(same_state(&before, &after), "the weights are those before");
	ct_tensors_free(&before);
	ct_tensors_free(&after);
	ct_train_free(t);
	ct_pictures_free(&s);
}

static void no_training(const struct ct_train_opts *o, const struct ct_unet_arch *a,
	const struct ct_pictures *s, const struct ct_env *env, enum ct_code code, const char *what)
{
	struct ct_train *t = NULL;
	int rc = ct_train_alloc(&t, a, o, s, env, &err);

	OK(rc == -1 && err.code == code, "no training: %s: %s", what, err.msg);
	ct_train_free(rc ? NULL : t);
}

static void bad_options(const struct ct_env *env)
{
	struct ct_train_opts good, o;
	struct ct_unet_arch a;
	struct ct_train *t = NULL;
	struct ct_pictures s = {0};

	options(&good, &a);
	picture(&s, SIZE, SIZE);
	good.batch = 1;
	good.adam.lr = 0;
	good.ema = 0;
	OK(ct_train_alloc(&t, &a, &good, &s, env, &err) == 0 && ct_train_rate(t) == 0,
		"a picture of one piece, a rate of 0");
	ct_train_free(t);
	o = good;
	o.patches.channels = 2;
	no_training(&o, &a, &s, env, CT_EINPUT, "pictures of two channels");
	a.in_channels = 2;
	no_training(&o, &a, &s, env, CT_EINPUT, "two channels in, one out");
	a.out_channels = 2;
	o.patches.size = 2 * SIZE;
	no_training(&o, &a, &s, env, CT_EGEOM, "a piece larger than the picture");
	ct_pictures_free(&s);
}

/* The metadata of what was learnt, and what is used when nothing is said. */
static void result(const struct ct_env *env)
{
	struct ct_train_opts o;
	struct ct_unet_arch a;
	struct ct_train *t = NULL;
	struct ct_tensors w = {0};
	struct ct_pictures s = {0};
	double loss, v = 0;

	options(&o, &a);
	o.ema = 0.75;
	picture(&s, 20, 24);
	must(ct_train_alloc(&t, &a, &o, &s, env, &err));
	must(ct_train_step(t, &loss, &err));
	must(ct_train_result(t, &w, &err));
	OK(strcmp(ct_meta_get(&w.meta, CT_META_BETA_SCHEDULE), "linear") == 0 &&
			strcmp(ct_meta_get(&w.meta, CT_META_STEP), "1") == 0 &&
			ct_meta_numbers(&w.meta, CT_META_EMA, 1, &v, &err) == 0 && v == 0.75,
		"a result says its schedule, step and average");
	ct_tensors_free(&w);
	ct_train_free(t);
	ct_pictures_free(&s);
	ct_train_default(&o);
	OK(o.patches.size == 64 && o.patches.channels == 1 && o.patches.scales == 1 &&
			o.patches.scale[0] == 1 && o.batch == 16 && o.steps == 10000 &&
			o.warmup == 0 && !o.cosine,
		"defaults: pieces of 64, 16 at a time");
	OK(o.ema == 0.9999 && o.clip == 0 && o.adam.lr == 1e-4 && o.adam.beta1 == 0.9 &&
			o.adam.beta2 == 0.999 && o.adam.eps == 1e-8 && o.adam.decay == 0,
		"and Adam's own");
}

static void t_train_state(void)
{
	struct ct_env env = {0};

	must(ct_par_alloc(&env.par, 2, &err));
	resumed(&env);
	bad_states(&env);
	failed_steps(&env);
	bad_options(&env);
	result(&env);
	ct_par_free(env.par);
}

int main(void)
{
	struct ct_env env = {0};

	must(ct_par_alloc(&env.par, 2, &err));
	pieces();
	adamw();
	noise();
	losses(&env);
	warm_up(&env);
	steps(&env);
	bad_pictures();
	ct_par_free(env.par);
	t_train_state();
	return tap_done();
}
