/* train.c: see train.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "diffusion/train.h"
#include "core/mem.h"
#include "core/rng.h"
#include "diffusion/measurement.h"
#include "diffusion/schedule.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum draw { PIECE, TIME, NOISE, DRAWS }; /* streams of a sample */

/* Scratch of one thread. */
struct bench {
	struct ct_unet_plan *train, *test;
	float *x0, *xt, *z, *eps; /* one block at x0 */
	double *t;                /* scratch of A */
};

struct ct_train {
	struct ct_unet *net, *ema; /* the second one's parameters are the average */
	struct ct_train_opts o;
	const struct ct_pictures *data;
	const struct ct_env *env;
	struct ct_schedule schedule;
	struct ct_measurement op; /* A, of super-resolution */
	struct ct_trainer trainer;
	size_t pixels, threads;
	struct bench *bench; /* [threads] */
	bool ema_stale;      /* the average has moved since it was last run */
};

/* One pass over the batch or the validation pieces. */
struct pass {
	struct ct_train *t;
	const struct ct_pictures *data;
	size_t count, groups;
	bool test;
	double *loss;       /* [count] */
	struct ct_err *err; /* [groups] */
};

void ct_train_default(struct ct_train_opts *o)
{
	*o = (struct ct_train_opts){
		.patches = {.size = 64, .channels = 1, .scales = 1, .scale = {1}},
		.batch = 16,
		.steps = 10000,
		.ema = 0.9999,
	};
	o->adam = ct_adamw_default();
}

static bool is_superres(const struct ct_train *t)
{
	return t->net->arch.net != CT_NET_UNET;
}

static uint64_t stream(uint64_t sample, enum draw d)
{
	return sample * DRAWS + (uint64_t)d;
}

/* Loss of one sample; with grads, its gradient is added. */
static int sample_loss(struct ct_train *t, struct bench *b, const struct pass *p, uint64_t seed,
	uint64_t sample, int time, float *grads, double *loss, struct ct_err *e)
{
	const double keep = sqrt(ct_schedule_abar(&t->schedule, time));
	const double add = sqrt(1.0 - ct_schedule_abar(&t->schedule, time));
	const struct ct_measurement *op = &t->op;
	const bool superres = is_superres(t);
	const float *want = superres ? b->x0 : b->z;
	double sum = 0;

	ct_patches_draw(&t->o.patches, p->data, b->x0, seed, stream(sample, PIECE));
	if (superres)
		for (size_t c = 0; c < t->o.patches.channels; c++)
			ct_measurement_forward(op, b->xt + c * op->h * op->w,
				b->x0 + c * op->high * op->wide, b->t);
	else
		ct_rng_normals(t->pixels, b->z, seed, stream(sample, NOISE), 0);
	for (size_t i = 0; !superres && i < t->pixels; i++)
		b->xt[i] = (float)(keep * (double)b->x0[i] + add * (double)b->z[i]);
	if (ct_unet_forward(p->test ? b->test : b->train, b->eps, b->xt, (double)time, e))
		return -1;
	for (size_t i = 0; i < t->pixels; i++) {
		const double d = (double)b->eps[i] - (double)want[i];
		const double slope = superres ? (double)((d > 0) - (d < 0)) : 2.0 * d;

		sum += superres ? fabs(d) : d * d;
		b->eps[i] = (float)(slope / (double)t->pixels);
	}
	*loss = sum / (double)t->pixels;
	return grads ? ct_unet_backward(b->train, grads, NULL, b->eps, e) : 0;
}

static void train_group(void *arg, size_t g, size_t worker)
{
	struct pass *p = arg;
	struct ct_train *t = p->t;
	float *grads = t->trainer.grad + g * t->trainer.n;

	memset(grads, 0, t->trainer.n * sizeof *grads);
	for (size_t k = g * p->count / p->groups; k < (g + 1) * p->count / p->groups; k++) {
		uint64_t sample = t->trainer.steps * t->o.batch + k;
		int time = (int)ct_rng_below(t->o.seed, stream(sample, TIME), 0, CT_TIMESTEPS);

		if (ct_check_stop(t->env, &p->err[g]) ||
			sample_loss(t, &t->bench[worker], p, t->o.seed, sample, time, grads,
				&p->loss[k], &p->err[g]))
			return;
	}
}

static void test_group(void *arg, size_t k, size_t worker)
{
	struct pass *p = arg;
	int time = (int)((2 * k + 1) * CT_TIMESTEPS / (2 * p->count));

	if (ct_check_stop(p->t->env, &p->err[k]) == 0)
		sample_loss(p->t, &p->t->bench[worker], p, ~p->t->o.seed, k, time, NULL,
			&p->loss[k], &p->err[k]);
}

static int run_pass(struct pass *p, ct_par_fn *fn, double *loss, struct ct_err *e)
{
	int rc = -1;

	if (ct_alloc0(&p->loss, p->count, sizeof *p->loss, e) ||
		ct_alloc0(&p->err, p->groups, sizeof *p->err, e))
		goto out;
	ct_par_for(p->t->env->par, p->groups, fn, p);
	*loss = 0;
	if (ct_err_first(e, p->groups, p->err, sizeof *p->err))
		goto out;
	for (size_t k = 0; k < p->count; k++)
		*loss += p->loss[k] / (double)p->count;
	rc = 0;
out:
	free(p->loss);
	free(p->err);
	return rc;
}

uint64_t ct_train_steps(const struct ct_train *t)
{
	return t->trainer.steps;
}

double ct_train_rate(const struct ct_train *t)
{
	return ct_trainer_rate(&t->trainer);
}

double ct_train_bytes(const struct ct_train *t)
{
	/* parameters in plain order, in two packed ones, and the average with one; moments */
	double floats = (double)t->trainer.n * (double)(7 + t->trainer.groups), bytes = 0;

	for (size_t i = 0; i < t->threads; i++)
		bytes += (double)ct_unet_plan_bytes(t->bench[i].train) +
			 4.0 * (double)(t->pixels * sizeof(float));
	return bytes + floats * sizeof(float);
}

int ct_train_step(void *training, double *loss, struct ct_err *e)
{
	struct ct_train *t = training;
	struct pass p = {.t = t, .data = t->data, .count = t->o.batch, .groups = t->trainer.groups};

	if (run_pass(&p, train_group, loss, e) ||
		ct_trainer_step(&t->trainer, *loss, 1.0 / (double)t->o.batch, e))
		return -1;
	t->ema_stale = true;
	ct_unet_changed(t->net, t->env->par);
	return 0;
}

/* Edge of what the network is given. */
static size_t input_size(const struct ct_train *t)
{
	return is_superres(t) ? t->o.patches.size / t->net->arch.factor : t->o.patches.size;
}

int ct_train_validate(struct ct_train *t, const struct ct_pictures *data, size_t n, double *loss,
	struct ct_err *e)
{
	struct pass p = {.t = t, .data = data, .count = n, .groups = n, .test = true};
	const size_t size = input_size(t);

	for (size_t i = 0; i < t->threads; i++)
		if (!t->bench[i].test &&
			ct_unet_plan_alloc(&t->bench[i].test, t->ema, size, size, false, e))
			return -1;
	if (t->ema_stale)
		ct_unet_changed(t->ema, t->env->par);
	t->ema_stale = false;
	return run_pass(&p, test_group, loss, e);
}

static int bench_alloc(struct ct_train *t, struct bench *b, struct ct_err *e)
{
	const size_t size = input_size(t);

	if (ct_alloc(&b->x0, 4 * t->pixels, sizeof(float), e) ||
		ct_alloc(&b->t, is_superres(t) ? ct_measurement_scratch(&t->op) : 0, sizeof *b->t,
			e))
		return -1;
	b->xt = b->x0 + t->pixels;
	b->z = b->xt + t->pixels;
	b->eps = b->z + t->pixels;
	return ct_unet_plan_alloc(&b->train, t->net, size, size, true, e);
}

static int check_options(
	const struct ct_unet_arch *a, const struct ct_train_opts *o, struct ct_err *e)
{
	if (a->in_channels != a->out_channels || a->in_channels != o->patches.channels)
		return ct_fail(e, CT_EINPUT,
			"training predicts the noise of every channel: %zu in, "
			"%zu out, pictures of %zu",
			a->in_channels, a->out_channels, o->patches.channels);
	if (a->net != CT_NET_UNET && o->patches.size % a->factor)
		return ct_fail(e, CT_EUSAGE,
			"a piece of %zu pixels is no multiple of the factor %zu", o->patches.size,
			a->factor);
	assert(o->batch >= 1 && o->ema >= 0 && o->ema < 1 && o->adam.lr >= 0);
	return 0;
}

int ct_train_alloc(struct ct_train **out, const struct ct_unet_arch *a,
	const struct ct_train_opts *o, const struct ct_pictures *data, const struct ct_env *env,
	struct ct_err *e)
{
	const struct ct_trainer_rule rule = {
		o->adam, o->steps, o->warmup, o->cosine, o->ema, o->clip};
	const size_t groups = o->batch < CT_TRAIN_GROUPS ? o->batch : CT_TRAIN_GROUPS;
	struct ct_train *t;

	if (check_options(a, o, e) || ct_patches_check(&o->patches, data, "training data", e) ||
		ct_alloc0(&t, 1, sizeof *t, e))
		return -1;
	t->o = *o;
	t->data = data;
	t->env = env;
	t->pixels = o->patches.channels * o->patches.size * o->patches.size;
	ct_schedule_default(&t->schedule);
	if (ct_unet_init(&t->net, a, o->seed, e) || ct_unet_init(&t->ema, a, o->seed, e))
		goto fail;
	if (is_superres(t) && ct_measurement_alloc(&t->op, CT_MEASUREMENT_MEAN, input_size(t),
				      input_size(t), a->factor, 0, e))
		goto fail;
	t->threads = ct_par_threads(env->par);
	if (ct_trainer_alloc(&t->trainer, &rule, t->net->graph.count, groups, t->net->param,
		    t->ema->param, env->par, e) ||
		ct_alloc0(&t->bench, t->threads, sizeof *t->bench, e))
		goto fail;
	for (size_t i = 0; i < t->threads; i++)
		if (bench_alloc(t, &t->bench[i], e))
			goto fail;
	*out = t;
	return 0;
fail:
	ct_train_free(t);
	return -1;
}

void ct_train_free(struct ct_train *t)
{
	if (!t)
		return;
	for (size_t i = 0; t->bench && i < t->threads; i++) {
		struct bench *b = &t->bench[i];

		ct_unet_plan_free(b->train);
		ct_unet_plan_free(b->test);
		free(b->x0);
		free(b->t);
	}
	free(t->bench);
	ct_trainer_free(&t->trainer);
	ct_measurement_free(&t->op);
	ct_unet_free(t->ema);
	ct_unet_free(t->net);
	free(t);
}

int ct_train_result(const struct ct_train *t, struct ct_tensors *w, struct ct_err *e)
{
	return ct_err_any(
		ct_unet_tensors(t->ema, t->ema->param, w, e) ||
		(is_superres(t) ? ct_meta_set(&w->meta, CT_META_OPERATOR,
					  CT_WORD(CT_MEASUREMENT_LIST, CT_MEASUREMENT_MEAN), e)
				: ct_meta_set(&w->meta, CT_META_BETA_SCHEDULE, "linear", e)) ||
		ct_meta_setf(
			&w->meta, e, CT_META_STEP, "%llu", (unsigned long long)t->trainer.steps) ||
		ct_meta_setf(&w->meta, e, CT_META_EMA, "%.10g", t->o.ema));
}

int ct_train_save(const void *training, struct ct_tensors *w, struct ct_err *e)
{
	return ct_trainer_save(&((const struct ct_train *)training)->trainer, w, e);
}

int ct_train_restore(void *training, const struct ct_tensors *w, struct ct_err *e)
{
	struct ct_train *t = training;

	if (ct_trainer_restore(&t->trainer, w, e))
		return -1;
	t->ema_stale = true;
	ct_unet_changed(t->net, t->env->par);
	return 0;
}
