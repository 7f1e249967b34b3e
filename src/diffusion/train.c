/* train.c: see train.h. */
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

enum { CHUNK = 1 << 15 };                /* parameters a task */
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
	uint64_t step;
	size_t n, pixels, groups, threads, chunks;
	float *m, *v, *grads; /* [n], [n], [groups][n] */
	double *norm;         /* [chunks] */
	struct bench *bench;  /* [threads] */
	bool ema_stale;       /* the average has moved since it was last run */
};

/* One pass over the batch or the validation pieces. */
struct pass {
	struct ct_train *t;
	const struct ct_pictures *data;
	size_t count, groups;
	bool test;
	double rate, ema, scale; /* of the update */
	double *loss;            /* [count] */
	struct ct_err *err;      /* [groups] */
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
	float *grads = t->grads + g * t->n;

	memset(grads, 0, t->n * sizeof *grads);
	for (size_t k = g * p->count / p->groups; k < (g + 1) * p->count / p->groups; k++) {
		uint64_t sample = t->step * t->o.batch + k;
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
	for (size_t g = 0; g < p->groups; g++)
		if (p->err[g].code != CT_OK) {
			*e = p->err[g];
			goto out;
		}
	for (size_t k = 0; k < p->count; k++)
		*loss += p->loss[k] / (double)p->count;
	rc = 0;
out:
	free(p->loss);
	free(p->err);
	return rc;
}

static size_t chunk_size(const struct ct_train *t, size_t c)
{
	return t->n - c * CHUNK < CHUNK ? t->n - c * CHUNK : CHUNK;
}

/* Gradient of the batch into the first accumulator, and its squared norm. */
static void reduce_chunk(void *arg, size_t c, size_t worker)
{
	struct pass *p = arg;
	struct ct_train *t = p->t;

	(void)worker;
	t->norm[c] = CT_SIMD(ct_adam_gradient)(chunk_size(t, c), t->grads + c * CHUNK, t->groups,
		t->n, (float)(1.0 / (double)t->o.batch));
}

static void update_chunk(void *arg, size_t c, size_t worker)
{
	struct pass *p = arg;
	struct ct_train *t = p->t;
	struct ct_adamw a = t->o.adam;
	const size_t n = chunk_size(t, c), at = c * CHUNK;
	float *g = t->grads + at;

	(void)worker;
	a.lr = p->rate;
	if (p->scale < 1.0)
		for (size_t i = 0; i < n; i++)
			g[i] *= (float)p->scale;
	CT_SIMD(ct_adamw_step)(&a, t->step + 1, n, t->net->param + at, t->m + at, t->v + at, g);
	CT_SIMD(ct_adam_average)(p->ema, n, t->ema->param + at, t->net->param + at);
}

uint64_t ct_train_steps(const struct ct_train *t)
{
	return t->step;
}

double ct_train_rate(const struct ct_train *t)
{
	const double s = (double)t->step, warm = (double)t->o.warmup, end = (double)t->o.steps;

	if (t->step < t->o.warmup)
		return t->o.adam.lr * (s + 1) / warm;
	if (!t->o.cosine || end <= warm)
		return t->o.adam.lr;
	return t->o.adam.lr * 0.5 * (1 + cos(M_PI * fmin((s - warm) / (end - warm), 1.0)));
}

double ct_train_bytes(const struct ct_train *t)
{
	/* parameters in plain order, in two packed ones, and the average with one; moments */
	double floats = (double)t->n * (double)(7 + t->groups), bytes = 0;

	for (size_t i = 0; i < t->threads; i++)
		bytes += (double)ct_unet_plan_bytes(t->bench[i].train) +
			 4.0 * (double)(t->pixels * sizeof(float));
	return bytes + floats * sizeof(float);
}

int ct_train_step(struct ct_train *t, double *loss, struct ct_err *e)
{
	struct pass p = {.t = t, .data = t->data, .count = t->o.batch, .groups = t->groups};
	double norm = 0, n = (double)t->step;

	if (run_pass(&p, train_group, loss, e))
		return -1;
	ct_par_for(t->env->par, t->chunks, reduce_chunk, &p);
	for (size_t c = 0; c < t->chunks; c++)
		norm += t->norm[c];
	norm = sqrt(norm);
	if (!isfinite(*loss) || !isfinite(norm))
		return ct_fail(e, CT_ENUMERIC,
			"training diverged at step %llu: loss %g, norm of the gradient %g",
			(unsigned long long)t->step + 1, *loss, norm);
	p.rate = ct_train_rate(t);
	p.ema = fmin(t->o.ema, (1 + n) / (10 + n));
	p.scale = t->o.clip > 0 && norm > t->o.clip ? t->o.clip / norm : 1.0;
	ct_par_for(t->env->par, t->chunks, update_chunk, &p);
	t->step++;
	t->ema_stale = true;
	return ct_unet_changed(t->net, t->env->par, e);
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
	if (t->ema_stale && ct_unet_changed(t->ema, t->env->par, e))
		return -1;
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
	struct ct_train *t;
	size_t total;

	if (check_options(a, o, e) || ct_patches_check(&o->patches, data, "training data", e) ||
		ct_alloc0(&t, 1, sizeof *t, e))
		return -1;
	t->o = *o;
	t->data = data;
	t->env = env;
	t->groups = o->batch < CT_TRAIN_GROUPS ? o->batch : CT_TRAIN_GROUPS;
	t->pixels = o->patches.channels * o->patches.size * o->patches.size;
	ct_schedule_default(&t->schedule);
	if (ct_unet_init(&t->net, a, o->seed, e) || ct_unet_init(&t->ema, a, o->seed, e))
		goto fail;
	if (is_superres(t) && ct_measurement_alloc(&t->op, CT_MEASUREMENT_MEAN, input_size(t),
				      input_size(t), a->factor, 0, e))
		goto fail;
	t->n = t->net->graph.count;
	t->chunks = (t->n + CHUNK - 1) / CHUNK;
	t->threads = ct_par_threads(env->par);
	if (ct_size_mul(&total, t->groups, t->n, "gradients", e) ||
		ct_alloc0(&t->m, t->n, sizeof *t->m, e) ||
		ct_alloc0(&t->v, t->n, sizeof *t->v, e) ||
		ct_alloc(&t->grads, total, sizeof *t->grads, e) ||
		ct_alloc0(&t->norm, t->chunks, sizeof *t->norm, e) ||
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
	free(t->m);
	free(t->v);
	free(t->grads);
	free(t->norm);
	ct_measurement_free(&t->op);
	ct_unet_free(t->ema);
	ct_unet_free(t->net);
	free(t);
}

int ct_train_result(const struct ct_train *t, struct ct_tensors *w, struct ct_err *e)
{
	return ct_unet_tensors(t->ema, t->ema->param, w, e) ||
			       (is_superres(t) ? ct_meta_set(&w->meta, CT_META_OPERATOR,
							 CT_WORD(CT_MEASUREMENT_LIST,
								 CT_MEASUREMENT_MEAN),
							 e)
					       : ct_meta_set(&w->meta, CT_META_BETA_SCHEDULE,
							 "linear", e)) ||
			       ct_meta_setf(&w->meta, e, CT_META_STEP, "%llu",
				       (unsigned long long)t->step) ||
			       ct_meta_setf(&w->meta, e, CT_META_EMA, "%.10g", t->o.ema)
		       ? -1
		       : 0;
}

static const char *const vector_names[] = {"param", "ema", "adam.m", "adam.v"};

enum { VECTORS = 4 };

int ct_train_save(const struct ct_train *t, struct ct_tensors *w, struct ct_err *e)
{
	const float *const v[VECTORS] = {t->net->param, t->ema->param, t->m, t->v};

	if (ct_meta_setf(&w->meta, e, CT_META_STEP, "%llu", (unsigned long long)t->step))
		return -1;
	for (size_t i = 0; i < VECTORS; i++)
		if (ct_tensors_put(w, vector_names[i], 1, &t->n, v[i], e))
			return -1;
	return 0;
}

int ct_train_restore(struct ct_train *t, const struct ct_tensors *w, struct ct_err *e)
{
	float *const v[VECTORS] = {t->net->param, t->ema->param, t->m, t->v};
	const float *from[VECTORS];
	double step;

	if (ct_meta_numbers(&w->meta, CT_META_STEP, 1, &step, e) || !(step >= 0 && step < 0x1p53))
		return ct_fail(e, CT_EINPUT, "not the state of a training: no \"step\"");
	for (size_t i = 0; i < VECTORS; i++) {
		from[i] = ct_tensors_vector(w, vector_names[i], t->n, e);
		if (!from[i])
			return -1;
	}
	for (size_t i = 0; i < VECTORS; i++)
		memcpy(v[i], from[i], t->n * sizeof **v);
	t->step = (uint64_t)step;
	t->ema_stale = true;
	return ct_unet_changed(t->net, t->env->par, e);
}
