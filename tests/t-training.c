/* Training against its formulas written out: pieces of pictures, the loss of a step and of a
 * validation, AdamW, the average of the weights. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "diffusion/schedule.h"
#include "numbers.h"
#include "training.h"

#include <stdlib.h>
#include <string.h>

enum { PIECE = 0, TIME = 1, NOISE = 2, DRAWS = 3 };

/* Is x the area means of f x f pixels from (row, col) on, mirrored?
 */
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
	return tap_done();
}
