/* superres.c: see superres.h.
 *
 * Samples are drawn as waves.h says, and added in order.
 */
#include "config.h"
#include "diffusion/superres.h"
#include "core/mem.h"
#include "diffusion/range-null.h"
#include "core/rng.h"
#include "diffusion/bilinear.h"
#include "diffusion/mirror.h"
#include "diffusion/waves.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* What one worker needs: x (channels, high, wide), init as x, y (channels, high/s, wide/s). */
struct seat {
	float *x, *init, *y;
	double *t;
};

struct superres_job {
	const struct ct_superres *p;
	const struct ct_denoiser *net;
	const struct ct_stack *in, *init;
	const struct ct_env *env;
	struct ct_measurement op;
	int *times;
	size_t ntimes;
	size_t high, wide; /* the network's picture */
	size_t h, w;       /* the result */
	struct seat *seat; /* [threads] */
	size_t threads;
	float *result; /* [places] pictures (h, w) */
	struct ct_stack *out, *deviation;
	struct ct_waves waves;
};

/* A sample being drawn: what the callbacks of the sampler see. */
struct draw {
	struct superres_job *job;
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

int ct_superres_times(const struct ct_superres *p, int **t, size_t *n, struct ct_err *e)
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

void ct_superres_normals(uint64_t seed, size_t view, size_t sample, size_t draw, size_t n, float *z)
{
	ct_rng_normals(
		n, z, seed, (uint64_t)view << 40 | (uint64_t)sample << 24 | (uint64_t)draw, 0);
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
	if (ct_superres_times(p, &t, &n, e))
		return -1;
	chain = p->samples * count_calls(t, n);
	*calls = chain * (fits ? p->how.iterations : 1);
	*gradients = fits && !p->how.frozen ? chain * (p->how.iterations - 1) : 0;
	free(t);
	return 0;
}

/* The published method keeps pictures within [0, 1.05]; a band-limited one overshoots at edges, and
 * what is cut off there would be missing everywhere else. */
static double range_of(const struct superres_job *j, double v, double most)
{
	return j->p->op == CT_MEASUREMENT_MEAN ? fmin(fmax(v, 0.0), most) : v;
}

/* The network's picture dst (channels, high, wide) of a view src (h, w). */
static void to_picture(const struct superres_job *j, size_t high, size_t wide, float *dst, size_t h,
	size_t w, const float *src)
{
	for (size_t y = 0; y < high; y++)
		for (size_t x = 0; x < wide; x++) {
			double v = (double)src[ct_mirror_index(y, h) * w + ct_mirror_index(x, w)] /
				   j->p->norm;

			v = range_of(j, v, HUGE_VAL);
			for (size_t c = 0; c < j->net->channels; c++)
				dst[(c * high + y) * wide + x] = (float)(2.0 * v - 1.0);
		}
}

/* Reduce the channels of x into its first. */
static void reduce(const struct superres_job *j, float *x)
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
static void from_picture(const struct superres_job *j, float *dst, const float *x)
{
	for (size_t y = 0; y < j->h; y++)
		for (size_t k = 0; k < j->w; k++) {
			double v = 0.5 * ((double)x[y * j->wide + k] + 1.0);

			dst[y * j->w + k] = (float)(range_of(j, v, 1.05) * j->p->norm);
		}
}

static int evaluate(void *ctx, double t, const float *x, float *eps, struct ct_err *e)
{
	const struct draw *d = ctx;
	const struct ct_denoiser *net = d->job->net;

	return ct_waves_call(&d->job->waves, d->worker, e) ||
			       net->eps(net->ctx[d->worker], t, x, eps, e)
		       ? -1
		       : 0;
}

static int differentiate(
	void *ctx, double t, const float *x, float *dx, const float *deps, struct ct_err *e)
{
	const struct draw *d = ctx;
	const struct ct_denoiser *net = d->job->net;

	return ct_waves_call(&d->job->waves, d->worker, e) ||
			       net->back(net->ctx[d->worker], t, x, dx, deps, e)
		       ? -1
		       : 0;
}

static void normals(void *ctx, size_t draw, size_t n, float *z)
{
	const struct draw *d = ctx;

	ct_superres_normals(d->job->env->seed, d->view, d->sample, draw, n, z);
}

static int draw_view(
	void *arg, size_t place, size_t view, size_t sample, size_t worker, struct ct_err *e)
{
	struct superres_job *j = arg;
	const struct ct_superres *p = j->p;
	struct seat *s = &j->seat[worker];
	struct draw draw = {j, view, sample, worker};
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

	to_picture(j, j->op.h, j->op.w, s->y, j->in->h, j->in->w, ct_stack_view(j->in, view));
	if (j->init)
		to_picture(j, j->high, j->wide, s->init, j->h, j->w, ct_stack_view(j->init, view));
	if (ct_sampler_draw(&d, s->x, s->y, j->init ? s->init : NULL, e))
		return -1;
	reduce(j, s->x);
	from_picture(j, j->result + place * j->h * j->w, s->x);
	return 0;
}

/* Mean and, if asked, standard deviation of the samples of a view. */
static void collect(void *arg, size_t first, size_t view)
{
	const struct superres_job *j = arg;
	size_t n = j->h * j->w, k = j->p->samples;
	const float *r = j->result + first * n;
	float *mean = ct_stack_view(j->out, view),
	      *dev = j->deviation ? ct_stack_view(j->deviation, view) : NULL;

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

static void job_free(struct superres_job *j)
{
	for (size_t k = 0; j->seat && k < j->threads; k++) {
		free(j->seat[k].x);
		free(j->seat[k].t);
	}
	free(j->seat);
	free(j->result);
	free(j->times);
	ct_measurement_free(&j->op);
}

static int job_alloc(struct superres_job *j, struct ct_err *e)
{
	const struct ct_superres *p = j->p;
	size_t s = p->scale, all = j->net->channels * j->high * j->wide, gradients;

	j->waves = (struct ct_waves){.env = j->env,
		.views = j->in->views,
		.samples = p->samples,
		.draw = draw_view,
		.collect = collect,
		.ctx = j,
		.save = p->save,
		.save_ctx = p->save_ctx};
	if (ct_superres_times(p, &j->times, &j->ntimes, e) ||
		ct_superres_calls(p, &j->waves.calls, &gradients, e))
		return -1;
	j->waves.calls += gradients;
	if (ct_measurement_alloc(&j->op, p->op, j->high / s, j->wide / s, s, p->sigma_det, e) ||
		ct_alloc0(&j->seat, j->threads, sizeof *j->seat, e) ||
		ct_alloc(
			&j->result, ct_waves_places(&j->waves), j->h * j->w * sizeof *j->result, e))
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
	struct superres_job j = {.p = p,
		.net = net,
		.in = in,
		.init = init,
		.env = env,
		.h = in->h * p->scale,
		.w = in->w * p->scale,
		.threads = ct_par_threads(env->par),
		.out = out,
		.deviation = deviation};
	int rc;

	if (check(p, in, init, out, deviation, e))
		return -1;
	if (p->how.rule == CT_SAMPLER_NONE) {
		start_pictures(p, in, init, out, done);
		return 0;
	}
	ct_superres_size(p, net->multiple, in->h, in->w, &j.high, &j.wide);
	rc = job_alloc(&j, e);
	if (rc == 0)
		rc = ct_waves_run(&j.waves, done, e);
	job_free(&j);
	return rc;
}
