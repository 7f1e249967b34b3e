/* superres.c: see superres.h.
 *
 * A task is one sample of one view. Tasks run in waves of whole views that fill all threads;
 * samples are added in order after the wave.
 */
#include "config.h"
#include "diffusion/superres.h"
#include "core/mem.h"
#include "core/rng.h"
#include "diffusion/bilinear.h"

#include <math.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What one worker needs: x (channels, high, wide), init as x, y (channels, high/s, wide/s). */
struct seat {
	float *x, *init, *y;
	double *t;
};

struct job {
	const struct ct_superres *p;
	const struct ct_denoiser *net;
	const struct ct_stack *in, *init;
	const struct ct_env *env;
	struct ct_measurement op;
	int *times;
	size_t ntimes, calls; /* calls a view, of the network and of its derivative */
	size_t high, wide;    /* the network's picture */
	size_t h, w;          /* the result */
	struct seat *seat;    /* [threads] */
	size_t threads;
	size_t *view;       /* [wave] views of this wave */
	float *result;      /* [wave * samples] pictures (h, w) */
	struct ct_err *err; /* [wave * samples] */
	atomic_bool failed;
	atomic_size_t evaluated;
	size_t total;
};

/* A sample being drawn: what the callbacks of the sampler see. */
struct draw {
	struct job *job;
	size_t view, sample, worker;
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
		.sigma_det = ct_superres_sigma_det(scale)};
}

double ct_superres_sigma_det(size_t scale)
{
	return (double)scale / (2.0 * sqrt(2.0 * log(2.0)));
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

static size_t gcd(size_t a, size_t b)
{
	while (b) {
		size_t r = a % b;

		a = b;
		b = r;
	}
	return a;
}

void ct_superres_size(const struct ct_superres *p, size_t multiple, size_t h, size_t w,
	size_t *high, size_t *wide)
{
	size_t m = multiple / gcd(multiple, p->scale); /* in coarse pixels */

	*high = (h + m - 1) / m * m * p->scale;
	*wide = (w + m - 1) / m * m * p->scale;
}

static int times_of(const struct ct_superres *p, int **t, size_t *n, struct ct_err *e)
{
	if (p->steps == 0 || p->steps > CT_TIMESTEPS)
		return ct_fail(
			e, CT_EUSAGE, "%zu steps: 1 to %d are possible", p->steps, CT_TIMESTEPS);
	return ct_schedule_times(t, n, p->steps,
		p->start < 0 ? ct_schedule_start(p->steps) : p->start, p->travel_length,
		p->travel_repeat, e);
}

static size_t count_calls(const int *t, size_t n)
{
	size_t calls = 0;

	for (size_t k = 0; k + 1 < n; k++)
		calls += t[k + 1] < t[k];
	return calls;
}

int ct_superres_calls(
	const struct ct_superres *p, size_t *calls, size_t *gradients, struct ct_err *e)
{
	bool fits = p->how.rule == CT_SAMPLER_BIRD;
	size_t n, chain;
	int *t;

	*calls = *gradients = 0;
	if (p->how.rule == CT_SAMPLER_NONE)
		return 0;
	if (times_of(p, &t, &n, e))
		return -1;
	chain = p->samples * count_calls(t, n);
	*calls = chain * (fits ? p->how.iterations : 1);
	*gradients = fits && !p->how.frozen ? chain * (p->how.iterations - 1) : 0;
	free(t);
	return 0;
}

/* Index of a line of n pixels continued by reflection: ... 1 0 | 0 1 ... n-1 | n-1 ... */
static size_t mirrored(size_t i, size_t n)
{
	i %= 2 * n;
	return i < n ? i : 2 * n - 1 - i;
}

/* The published method keeps pictures within [0, 1.05]; a band-limited one overshoots at edges, and
 * what is cut off there would be missing everywhere else. */
static double range_of(const struct job *j, double v, double most)
{
	return j->p->op == CT_MEASUREMENT_MEAN ? fmin(fmax(v, 0.0), most) : v;
}

/* The network's picture dst (channels, high, wide) of a view src (h, w). */
static void to_picture(const struct job *j, size_t high, size_t wide, float *dst, size_t h,
	size_t w, const float *src)
{
	for (size_t y = 0; y < high; y++)
		for (size_t x = 0; x < wide; x++) {
			double v = (double)src[mirrored(y, h) * w + mirrored(x, w)] / j->p->norm;

			v = range_of(j, v, HUGE_VAL);
			for (size_t c = 0; c < j->net->channels; c++)
				dst[(c * high + y) * wide + x] = (float)(2.0 * v - 1.0);
		}
}

/* Reduce the channels of x into its first. */
static void reduce(const struct job *j, float *x)
{
	size_t n = j->high * j->wide, channels = j->p->first ? 1 : j->net->channels;

	for (size_t i = 0; i < n; i++) {
		double sum = 0.0;

		for (size_t c = 0; c < channels; c++)
			sum += (double)x[c * n + i];
		x[i] = (float)(sum / (double)channels);
	}
}

/* The view dst (h, w) of a picture x (high, wide). */
static void from_picture(const struct job *j, float *dst, const float *x)
{
	for (size_t y = 0; y < j->h; y++)
		for (size_t k = 0; k < j->w; k++) {
			double v = 0.5 * ((double)x[y * j->wide + k] + 1.0);

			dst[y * j->w + k] = (float)(range_of(j, v, 1.05) * j->p->norm);
		}
}

static int may_go_on(const struct draw *d, struct ct_err *e)
{
	if (atomic_load(&d->job->failed))
		return ct_fail(e, CT_ESTOP, "given up");
	return ct_check_stop(d->job->env, e);
}

static void count(const struct draw *d)
{
	struct job *j = d->job;
	size_t done = atomic_fetch_add(&j->evaluated, 1) + 1;

	if (d->worker == 0)
		ct_progress(j->env, "sampling", done, j->total);
}

static int evaluate(void *ctx, double t, const float *x, float *eps, struct ct_err *e)
{
	const struct draw *d = ctx;
	const struct ct_denoiser *net = d->job->net;

	if (may_go_on(d, e) || net->eps(net->ctx[d->worker], t, x, eps, e))
		return -1;
	count(d);
	return 0;
}

static int differentiate(
	void *ctx, double t, const float *x, float *dx, const float *deps, struct ct_err *e)
{
	const struct draw *d = ctx;
	const struct ct_denoiser *net = d->job->net;

	if (may_go_on(d, e) || net->back(net->ctx[d->worker], t, x, dx, deps, e))
		return -1;
	count(d);
	return 0;
}

static void normals(void *ctx, size_t draw, size_t n, float *z)
{
	const struct draw *d = ctx;
	uint64_t stream = (uint64_t)d->view << 40 | (uint64_t)d->sample << 24 | (uint64_t)draw;

	ct_rng_normals(n, z, d->job->env->seed, stream, 0);
}

static void run_task(void *arg, size_t i, size_t worker)
{
	struct job *j = arg;
	const struct ct_superres *p = j->p;
	struct seat *s = &j->seat[worker];
	struct draw draw = {j, j->view[i / p->samples], i % p->samples, worker};
	struct ct_sampler d = {.schedule = j->net->schedule,
		.t = j->times,
		.nt = j->ntimes,
		.how = p->how,
		.op = &j->op,
		.channels = j->net->channels,
		.eps = evaluate,
		.back = differentiate,
		.eps_ctx = &draw,
		.normals = normals,
		.normals_ctx = &draw};
	char name[40];

	if (atomic_load(&j->failed))
		return;
	to_picture(j, j->op.h, j->op.w, s->y, j->in->h, j->in->w, ct_stack_view(j->in, draw.view));
	if (j->init)
		to_picture(j, j->high, j->wide, s->init, j->h, j->w,
			ct_stack_view(j->init, draw.view));
	if (ct_sampler_draw(&d, s->x, s->y, j->init ? s->init : NULL, &j->err[i])) {
		snprintf(name, sizeof name, "view %zu", draw.view);
		if (j->err[i].code != CT_ESTOP)
			ct_blame(&j->err[i], name);
		atomic_store(&j->failed, true);
		return;
	}
	reduce(j, s->x);
	if (p->final_consistency)
		ct_measurement_correct(&j->op, s->x, s->y, s->t);
	from_picture(j, j->result + i * j->h * j->w, s->x);
}

/* Mean and, if asked, standard deviation of the samples of the v-th view of the wave. */
static void collect(const struct job *j, size_t v, float *mean, float *dev)
{
	size_t n = j->h * j->w, k = j->p->samples;
	const float *r = j->result + v * k * n;

	for (size_t i = 0; i < n; i++) {
		double sum = 0.0, sq = 0.0, m;

		for (size_t s = 0; s < k; s++)
			sum += (double)r[s * n + i];
		m = sum / (double)k;
		mean[i] = (float)m;
		for (size_t s = 0; dev && s < k; s++)
			sq += ((double)r[s * n + i] - m) * ((double)r[s * n + i] - m);
		if (dev)
			dev[i] = (float)sqrt(sq / (double)(k - 1));
	}
}

/* The first real failure of the wave; a sample given up because of another is not one. */
static int wave_failed(const struct job *j, size_t tasks, struct ct_err *e)
{
	const struct ct_err *stop = NULL;

	if (!atomic_load(&j->failed))
		return 0;
	for (size_t i = 0; i < tasks; i++) {
		if (j->err[i].code == CT_ESTOP)
			stop = &j->err[i];
		else if (j->err[i].code != CT_OK) {
			*e = j->err[i];
			return -1;
		}
	}
	return stop ? ct_fail(e, CT_ESTOP, "stopped on request") : 0;
}

static void job_free(struct job *j)
{
	for (size_t k = 0; j->seat && k < j->threads; k++) {
		free(j->seat[k].x);
		free(j->seat[k].t);
	}
	free(j->seat);
	free(j->view);
	free(j->result);
	free(j->err);
	free(j->times);
	ct_measurement_free(&j->op);
}

static int job_alloc(struct job *j, size_t wave, struct ct_err *e)
{
	const struct ct_superres *p = j->p;
	size_t s = p->scale, all = j->net->channels * j->high * j->wide;

	size_t gradients;

	if (times_of(p, &j->times, &j->ntimes, e) || ct_superres_calls(p, &j->calls, &gradients, e))
		return -1;
	j->calls += gradients;
	if (ct_measurement_alloc(&j->op, p->op, j->high / s, j->wide / s, s, p->sigma_det, e) ||
		ct_alloc0(&j->seat, j->threads, sizeof *j->seat, e) ||
		ct_alloc(&j->view, wave, sizeof *j->view, e) ||
		ct_alloc0(&j->err, wave * p->samples, sizeof *j->err, e) ||
		ct_alloc(&j->result, wave * p->samples, j->h * j->w * sizeof *j->result, e))
		return -1;
	for (size_t k = 0; k < j->threads; k++) {
		struct seat *seat = &j->seat[k];

		if (ct_alloc(&seat->x, all * 2 + all / (s * s), sizeof *seat->x, e) ||
			ct_alloc(&seat->t, ct_measurement_scratch(&j->op), sizeof *seat->t, e))
			return -1;
		seat->init = seat->x + all;
		seat->y = seat->init + all;
	}
	return 0;
}

int ct_superres_measure(const struct ct_superres *p, struct ct_stack *in,
	const struct ct_stack *fine, struct ct_err *e)
{
	struct ct_measurement op = {0};
	double *t = NULL;
	int rc = -1;

	if (fine->views != in->views || fine->h != in->h * p->scale || fine->w != in->w * p->scale)
		return ct_fail(e, CT_EGEOM, "%zux%zu pixels are not %zu times %zux%zu", fine->w,
			fine->h, p->scale, in->w, in->h);
	if (ct_measurement_alloc(&op, p->op, in->h, in->w, p->scale, p->sigma_det, e) ||
		ct_alloc(&t, ct_measurement_scratch(&op), sizeof *t, e))
		goto out;
	for (size_t k = 0; k < in->views; k++)
		ct_measurement_forward(&op, ct_stack_view(in, k), ct_stack_view(fine, k), t);
	rc = 0;
out:
	free(t);
	ct_measurement_free(&op);
	return rc;
}

static int check(const struct ct_superres *p, const struct ct_stack *in,
	const struct ct_stack *init, const struct ct_stack *out, const struct ct_stack *deviation,
	struct ct_err *e)
{
	const struct ct_sampler_how *how = &p->how;

	if (!(p->norm > 0 || how->rule == CT_SAMPLER_NONE) || p->scale == 0 || p->samples == 0 ||
		p->samples > UINT16_MAX || !(how->eta >= 0 && how->eta <= 1) ||
		!(how->sigma_y >= 0))
		return ct_fail(e, CT_EUSAGE,
			"norm %g, scale %zu, %zu samples, eta %g or sigma_y %g is out of range",
			p->norm, p->scale, p->samples, how->eta, how->sigma_y);
	if (!(how->guidance >= 0) || how->iterations == 0 || !(how->rate >= 0))
		return ct_fail(e, CT_EUSAGE,
			"guidance %g, %zu iterations or rate %g is out of range", how->guidance,
			how->iterations, how->rate);
	if (deviation && p->samples < 2)
		return ct_fail(e, CT_EUSAGE, "a standard deviation needs two samples or more");
	if (out->views != in->views || out->h != in->h * p->scale || out->w != in->w * p->scale)
		return ct_fail(e, CT_EGEOM, "the output is not %zu times finer", p->scale);
	if ((deviation && ct_stack_same(deviation, out, e)) ||
		(init && ct_stack_same(init, out, e)))
		return -1;
	return 0;
}

/* The next unfinished views from *at on, at most `wave`. */
static size_t next_wave(struct job *j, const bool *done, size_t *at, size_t wave)
{
	size_t n = 0;

	for (; *at < j->in->views && n < wave; ++*at)
		if (!done[*at])
			j->view[n++] = *at;
	return n;
}

static int run_waves(struct job *j, size_t wave, struct ct_stack *out, struct ct_stack *deviation,
	bool *done, struct ct_err *e)
{
	const struct ct_superres *p = j->p;
	size_t n, at = 0;

	while ((n = next_wave(j, done, &at, wave)) > 0) {
		ct_par_for(j->env->par, n * p->samples, run_task, j);
		if (wave_failed(j, n * p->samples, e)) {
			struct ct_err other = {0};

			if (e->code == CT_ESTOP && p->save && p->save(p->save_ctx, true, &other))
				*e = other;
			return -1;
		}
		for (size_t v = 0; v < n; v++) {
			size_t k = j->view[v];

			collect(j, v, ct_stack_view(out, k),
				deviation ? ct_stack_view(deviation, k) : NULL);
			done[k] = true;
		}
		if (p->save && p->save(p->save_ctx, false, e))
			return -1;
	}
	return 0;
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
			ct_bilinear(in->h, in->w, p->scale, x, ct_stack_view(in, k));
		done[k] = true;
	}
}

int ct_superres(const struct ct_superres *p, const struct ct_denoiser *net,
	const struct ct_stack *in, const struct ct_stack *init, struct ct_stack *out,
	struct ct_stack *deviation, bool *done, const struct ct_env *env, struct ct_err *e)
{
	struct job j = {.p = p,
		.net = net,
		.in = in,
		.init = init,
		.env = env,
		.h = in->h * p->scale,
		.w = in->w * p->scale,
		.threads = ct_par_threads(env->par)};
	size_t wave, finished = 0;
	int rc;

	if (check(p, in, init, out, deviation, e))
		return -1;
	if (p->how.rule == CT_SAMPLER_NONE) {
		start_pictures(p, in, init, out, done);
		return 0;
	}
	ct_superres_size(p, net->multiple, in->h, in->w, &j.high, &j.wide);
	wave = j.threads / gcd(j.threads, p->samples);
	for (size_t k = 0; k < in->views; k++)
		finished += done[k];
	rc = job_alloc(&j, wave, e);
	if (rc == 0) {
		atomic_store(&j.evaluated, finished * j.calls);
		j.total = in->views * j.calls;
		rc = run_waves(&j, wave, out, deviation, done, e);
	}
	job_free(&j);
	return rc;
}
