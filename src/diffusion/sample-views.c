/* sample-views.c: see sample-views.h.
 *
 * A task is one sample of one view. All threads draw tasks in waves of whole views, the fewest that
 * fill them; samples are added in order. What a view becomes does not depend on the threads, nor on
 * what was done before.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "diffusion/sample-views.h"
#include "core/mem.h"
#include "core/rng.h"

#include <assert.h>
#include <math.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct job {
	const struct ct_superres *p;
	const struct ct_denoiser *net;
	const struct ct_env *env;
	const struct ct_stack *in, *init;
	struct ct_stack *out, *deviation;
	struct ct_measurement op; /* of the network's picture */
	size_t pixels;            /* of a result */
	int *times;
	size_t ntimes, calls, threads;
	size_t wave, *view; /* [wave] */
	struct ct_err *err; /* [wave][samples] */
	float *result;      /* [wave][samples][pixels] */
	struct seat *seat;  /* [threads] */
	atomic_bool failed;
	atomic_size_t called;
};

/* What one worker has while it draws a sample. */
struct seat {
	struct job *j;
	size_t view, sample, worker;
	double least, size;  /* of what is 0, and from there to 1 */
	float *x, *y, *init; /* as in sampler.h; x owns them, init NULL if there is none */
	double *scratch;     /* of the operator; NULL if nothing is reduced by it */
};

struct ct_superres ct_superres_default(size_t scale)
{
	return (struct ct_superres){.scale = scale,
		.steps = 50,
		.samples = 1,
		.start = -1,
		.travel_length = 1,
		.travel_repeat = 1,
		.how = ct_sampler_default(CT_SAMPLER_PLUS),
		.op = CT_MEASUREMENT_MEAN,
		.sigma_det = (double)scale / (2.0 * sqrt(2.0 * log(2.0)))};
}

int ct_superres_norm(const struct ct_stack *in, double *norm, struct ct_err *e)
{
	size_t n = ct_stack_count(in);
	float most = 0;

	for (size_t i = 0; i < n; i++)
		most = in->data[i] > most ? in->data[i] : most;
	*norm = (double)most;
	return most > 0 ? 0 : ct_fail(e, CT_EINPUT, "no projection value is positive");
}

void ct_superres_size(const struct ct_superres *p, size_t multiple, size_t h, size_t w,
	size_t *high, size_t *wide)
{
	size_t m = 1; /* coarse pixels that are a multiple of the network's */

	if (p->refined) {
		h = (h + p->scale - 1) / p->scale;
		w = (w + p->scale - 1) / p->scale;
	}
	while (m * p->scale % multiple)
		m++;
	*high = (h + m - 1) / m * m * p->scale;
	*wide = (w + m - 1) / m * m * p->scale;
}

/* The timesteps of a chain (schedule.h); free() them. CT_EUSAGE if steps and start do not fit. */
static int times_of(const struct ct_superres *p, int **t, size_t *n, struct ct_err *e)
{
	return ct_schedule_times(t, n, p->steps,
		p->start < 0 ? ct_schedule_start(p->steps) : p->start, p->travel_length,
		p->travel_repeat, e);
}

int ct_superres_calls(
	const struct ct_superres *p, size_t *calls, size_t *gradients, struct ct_err *e)
{
	bool fits = p->how.rule == CT_SAMPLER_BIRD;
	size_t n, chain = 0;
	int *t;

	*calls = *gradients = 0;
	if (p->how.rule == CT_SAMPLER_NONE)
		return 0;
	if (times_of(p, &t, &n, e))
		return -1;
	for (size_t k = 0; k + 1 < n; k++)
		chain += t[k + 1] < t[k] ? p->samples : 0;
	*calls = chain * (fits ? p->how.iterations : 1);
	*gradients = fits && !p->how.frozen ? chain * (p->how.iterations - 1) : 0;
	free(t);
	return 0;
}

/* The published method keeps pictures within [0, 1.05]; a band-limited one overshoots at edges, and
 * what is cut off there would be missing everywhere else. */
static double range_of(const struct job *j, double v, double most)
{
	return j->p->op == CT_MEASUREMENT_MEAN ? fmin(fmax(v, 0.0), most) : v;
}

/* Index of a line of n pixels that goes on: ... 1 0 | 0 1 ... n-1 | n-1 ... */
static size_t mirror(size_t i, size_t n)
{
	i %= 2 * n;
	return i < n ? i : 2 * n - 1 - i;
}

/* What is 0 to the network in a view, and 1. */
static void measure(struct seat *s)
{
	const struct job *j = s->j;
	const float *x = ct_stack_view(j->in, s->view);
	float least = x[0], most = x[0];

	s->least = 0;
	s->size = j->p->norm;
	if (j->p->range == CT_SUPERRES_STACK)
		return;
	for (size_t i = 1; i < j->in->h * j->in->w; i++) {
		least = fminf(least, x[i]);
		most = fmaxf(most, x[i]);
	}
	s->least = (double)least;
	s->size = most > least ? (double)most - (double)least : 1;
}

/* The network's picture dst (channels, high, wide) of a view src (h, w), which goes on by
 * reflection. */
static void to_picture(
	const struct seat *s, size_t high, size_t wide, float *dst, const struct ct_stack *from)
{
	const struct job *j = s->j;
	const float *src = ct_stack_view(from, s->view);
	const bool cut = j->p->range == CT_SUPERRES_BYTES && from == j->in;
	const size_t n = high * wide;

	for (size_t i = 0; i < n; i++) {
		const float x =
			src[mirror(i / wide, from->h) * from->w + mirror(i % wide, from->w)];
		double v = ((double)x - s->least) / s->size;

		v = cut ? floor(255 * v) / 255 : v;
		dst[i] = (float)(2.0 * range_of(j, v, HUGE_VAL) - 1.0);
	}
	for (size_t c = 1; c < j->net->channels; c++)
		memcpy(dst + c * n, dst, n * sizeof *dst);
}

/* The view of a picture, of the mean of its channels. */
static void to_view(const struct seat *s, float *result, const float *x)
{
	const struct job *j = s->j;
	const double most = j->p->range == CT_SUPERRES_STACK ? 1.05 : 1;
	const size_t n = j->op.high * j->op.wide, h = j->out->h, w = j->out->w;
	const size_t channels = j->p->first ? 1 : j->net->channels;

	for (size_t y = 0; y < h; y++)
		for (size_t k = 0; k < w; k++) {
			double sum = 0.0, v;

			for (size_t c = 0; c < channels; c++)
				sum += (double)x[c * n + y * j->op.wide + k];
			v = 0.5 * ((double)(float)(sum / (double)channels) + 1.0);
			result[y * w + k] = (float)(s->least + range_of(j, v, most) * s->size);
		}
}

/* Counts a call of the network. */
static int count(struct seat *s, struct ct_err *e)
{
	struct job *j = s->j;
	size_t done;

	if (atomic_load(&j->failed))
		return ct_fail(e, CT_ESTOP, "given up");
	if (ct_check_stop(j->env, e))
		return -1;
	done = atomic_fetch_add(&j->called, 1) + 1;
	if (s->worker == 0)
		ct_progress(j->env, "sampling", done, j->in->views * j->calls);
	return 0;
}

static int predict(void *ctx, double t, const float *x, float *eps, struct ct_err *e)
{
	struct seat *s = ctx;
	const struct ct_denoiser *net = s->j->net;

	return ct_err_any(count(s, e) || net->eps(net->ctx[s->worker], t, x, eps, e));
}

static int differentiate(
	void *ctx, double t, const float *x, float *dx, const float *deps, struct ct_err *e)
{
	struct seat *s = ctx;
	const struct ct_denoiser *net = s->j->net;

	return ct_err_any(count(s, e) || net->back(net->ctx[s->worker], t, x, dx, deps, e));
}

static void normals(void *ctx, size_t draw, size_t n, float *z)
{
	const struct seat *s = ctx;
	const uint64_t stream =
		(uint64_t)s->view << 40 | (uint64_t)s->sample << 24 | (uint64_t)draw;

	ct_rng_normals(n, z, s->j->env->seed, stream, 0);
}

/* What the network makes of y. */
static int ask_once(struct seat *s, struct ct_err *e)
{
	const size_t n = s->j->net->channels * s->j->op.high * s->j->op.wide;

	if (predict(s, 0, s->y, s->x, e))
		return -1;
	for (size_t i = 0; i < n; i++)
		if (!isfinite(s->x[i]))
			return ct_fail(e, CT_ENUMERIC, "the network's output is not finite");
	return 0;
}

static int draw(const struct job *j, struct seat *s, float *result, struct ct_err *e)
{
	const struct ct_measurement *op = &j->op;
	const struct ct_sampler d = {.schedule = j->net->schedule,
		.t = j->times,
		.nt = j->ntimes,
		.how = j->p->how,
		.op = op,
		.channels = j->net->channels,
		.eps = predict,
		.back = differentiate,
		.eps_ctx = s,
		.normals = normals,
		.normals_ctx = s};

	measure(s);
	if (j->p->refined) {
		to_picture(s, op->high, op->wide, s->init, j->in);
		for (size_t c = 0; c < j->net->channels; c++)
			ct_measurement_forward(op, s->y + c * op->h * op->w,
				s->init + c * op->high * op->wide, s->scratch);
	} else
		to_picture(s, op->h, op->w, s->y, j->in);
	if (s->init)
		to_picture(s, op->high, op->wide, s->init, j->init);
	if (j->p->how.rule == CT_SAMPLER_ONCE ? ask_once(s, e)
					      : ct_sampler_draw(&d, s->x, s->y, s->init, e))
		return -1;
	to_view(s, result, s->x);
	return 0;
}

static void run_task(void *arg, size_t i, size_t worker)
{
	struct job *j = arg;
	struct seat *s = &j->seat[worker];
	char name[40];

	if (atomic_load(&j->failed))
		return;
	s->worker = worker;
	s->view = j->view[i / j->p->samples];
	s->sample = i % j->p->samples;
	if (draw(j, s, j->result + i * j->pixels, &j->err[i]) == 0)
		return;
	snprintf(name, sizeof name, "view %zu", s->view);
	if (j->err[i].code != CT_ESTOP)
		ct_blame(&j->err[i], name);
	atomic_store(&j->failed, true);
}

/* The first failure of a wave of so many tasks that is not the request to stop. */
static int wave_failed(struct job *j, size_t tasks, struct ct_err *e)
{
	bool stop = false;

	if (!atomic_load(&j->failed))
		return 0;
	for (size_t i = 0; i < tasks; i++) {
		stop = stop || j->err[i].code == CT_ESTOP;
		if (j->err[i].code != CT_OK && j->err[i].code != CT_ESTOP) {
			*e = j->err[i];
			return -1;
		}
	}
	return stop ? ct_fail(e, CT_ESTOP, "stopped on request") : 0;
}

/* The next unfinished views from *at on, at most a wave. */
static size_t next_wave(struct job *j, const bool *done, size_t *at)
{
	size_t n = 0;

	for (; *at < j->in->views && n < j->wave; ++*at)
		if (!done[*at])
			j->view[n++] = *at;
	return n;
}

/* Samples that begin with one view also agree in what the network does to every view. With g itself
 * nine stacks of patients and phantoms became worse, by up to 1.2 dB, with its cube by .08 at most
 * (doc/samplers.md). */
#define BELIEF 3

/* What the mean of the samples adds to a refined view, as far as they agree; var: the sum of their
 * variances. */
static void believe(const struct job *j, size_t view, double var)
{
	const float *from = ct_stack_view(j->in, view);
	float *mean = ct_stack_view(j->out, view);
	double e = -var / (double)j->p->samples, g;

	for (size_t i = 0; i < j->pixels; i++)
		e += ((double)mean[i] - (double)from[i]) * ((double)mean[i] - (double)from[i]);
	g = e > 0 ? pow(e / (e + var), BELIEF) : 0;
	for (size_t i = 0; i < j->pixels; i++)
		mean[i] = (float)((double)from[i] + g * ((double)mean[i] - (double)from[i]));
}

/* Mean and deviation of the samples. */
static void collect(const struct job *j, const float *result, size_t view)
{
	const size_t samples = j->p->samples;
	float *mean = ct_stack_view(j->out, view);
	double var = 0;

	for (size_t i = 0; i < j->pixels; i++) {
		const float *r = result + i;
		double sum = 0, sq = 0, m;

		for (size_t s = 0; s < samples; s++)
			sum += (double)r[s * j->pixels];
		m = sum / (double)samples;
		mean[i] = (float)m;
		if (samples < 2)
			continue;
		for (size_t s = 0; s < samples; s++)
			sq += ((double)r[s * j->pixels] - m) * ((double)r[s * j->pixels] - m);
		var += sq / (double)(samples - 1);
		if (j->deviation)
			ct_stack_view(j->deviation, view)[i] =
				(float)sqrt(sq / (double)(samples - 1));
	}
	if (j->p->refined && samples > 1)
		believe(j, view, var);
}

static int run(struct job *j, bool *done, struct ct_err *e)
{
	const struct ct_superres *p = j->p;
	size_t n, at = 0;

	while ((n = next_wave(j, done, &at)) > 0) {
		ct_par_for(j->env->par, n * p->samples, run_task, j);
		if (wave_failed(j, n * p->samples, e)) {
			struct ct_err other = {0};

			if (e->code == CT_ESTOP && p->save && p->save(p->save_ctx, true, &other))
				*e = other;
			return -1;
		}
		for (size_t v = 0; v < n; v++) {
			collect(j, j->result + v * p->samples * j->pixels, j->view[v]);
			done[j->view[v]] = true;
		}
		if (p->save && p->save(p->save_ctx, false, e))
			return -1;
	}
	return 0;
}

static int prepare(struct job *j, const bool *done, struct ct_err *e)
{
	const struct ct_superres *p = j->p;
	const size_t samples = p->samples;
	size_t high, wide, all, gradients;

	ct_superres_size(p, j->net->multiple, j->in->h, j->in->w, &high, &wide);
	all = j->net->channels * high * wide;
	j->pixels = j->out->h * j->out->w;
	j->threads = ct_par_threads(j->env->par);
	for (j->wave = 1; j->wave * samples % j->threads; j->wave++)
		;
	if (ct_measurement_alloc(
		    &j->op, p->op, high / p->scale, wide / p->scale, p->scale, p->sigma_det, e) ||
		times_of(p, &j->times, &j->ntimes, e) ||
		ct_superres_calls(p, &j->calls, &gradients, e) ||
		ct_alloc(&j->view, j->wave, sizeof *j->view, e) ||
		ct_alloc0(&j->err, j->wave * samples, sizeof *j->err, e) ||
		ct_alloc(&j->result, j->wave * samples, j->pixels * sizeof *j->result, e) ||
		ct_alloc0(&j->seat, j->threads, sizeof *j->seat, e))
		return -1;
	j->calls += gradients;
	for (size_t k = 0; k < j->in->views; k++)
		j->called += done[k] ? j->calls : 0;
	if (j->called > 0)
		ct_progress(j->env, "sampling", 0, 0);
	for (size_t k = 0; k < j->threads; k++) {
		struct seat *s = &j->seat[k];

		s->j = j;
		if (ct_alloc(&s->x, 2 * all + all / (p->scale * p->scale), sizeof *s->x, e))
			return -1;
		s->y = s->x + all;
		s->init = j->init ? s->y + all / (p->scale * p->scale) : NULL;
		if (p->refined && ct_alloc(&s->scratch, ct_measurement_scratch(&j->op),
					  sizeof *s->scratch, e))
			return -1;
	}
	return 0;
}

static int check(const struct ct_superres *p, const struct ct_stack *in,
	const struct ct_stack *init, const struct ct_stack *out, const struct ct_stack *deviation,
	struct ct_err *e)
{
	const size_t finer = p->refined ? 1 : p->scale;

	assert(p->norm > 0 || p->how.rule == CT_SAMPLER_NONE);
	assert(p->scale > 0 && p->samples > 0 && p->samples <= UINT16_MAX);
	if (out->views != in->views || out->h != in->h * finer || out->w != in->w * finer)
		return ct_fail(e, CT_EGEOM, "the output is not %zu times finer", finer);
	if (deviation && p->samples < 2)
		return ct_fail(e, CT_EUSAGE, "a standard deviation needs two samples or more");
	return ct_err_any((deviation && ct_stack_same(deviation, out, e)) ||
			  (init && ct_stack_same(init, out, e)));
}

/* CT_SAMPLER_NONE. */
static void start_pictures(const struct ct_superres *p, const struct ct_stack *in,
	const struct ct_stack *init, struct ct_stack *out, bool *done)
{
	for (size_t k = 0; k < in->views; k++) {
		float *x = ct_stack_view(out, k);

		if (init)
			memcpy(x, ct_stack_view(init, k), out->h * out->w * sizeof *x);
		else
			ct_measurement_bilinear(in->h, in->w, p->scale, x, ct_stack_view(in, k));
		done[k] = true;
	}
}

int ct_superres(const struct ct_superres *p, const struct ct_denoiser *net,
	const struct ct_stack *in, const struct ct_stack *init, struct ct_stack *out,
	struct ct_stack *deviation, bool *done, const struct ct_env *env, struct ct_err *e)
{
	struct job j = {.p = p,
		.net = net,
		.env = env,
		.in = in,
		.init = p->refined && !init ? in : init,
		.out = out,
		.deviation = deviation};
	int rc;

	if (check(p, in, init, out, deviation, e))
		return -1;
	if (p->how.rule == CT_SAMPLER_NONE) {
		start_pictures(p, in, j.init, out, done);
		return 0;
	}
	rc = ct_err_any(prepare(&j, done, e) || run(&j, done, e));
	for (size_t k = 0; j.seat && k < j.threads; k++) {
		free(j.seat[k].x);
		free(j.seat[k].scratch);
	}
	free(j.seat);
	free(j.result);
	free(j.err);
	free(j.view);
	free(j.times);
	ct_measurement_free(&j.op);
	return rc;
}
