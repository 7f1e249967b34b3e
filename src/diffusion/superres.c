/* superres.c: see superres.h.
 *
 * Samples are drawn as waves.h says, and added in order.
 */
#include "config.h"
#include "diffusion/superres.h"
#include "core/rng.h"
#include "core/vol.h"
#include "diffusion/waves.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct superres_job {
	const struct ct_superres *p;
	const struct ct_stack *in, *init;
	struct ct_stack *out, *deviation;
	struct ct_measurement op; /* of the network's picture */
	struct ct_waves waves;
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

	while (m * p->scale % multiple)
		m++;
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

void ct_superres_normals(uint64_t seed, size_t view, size_t sample, size_t draw, size_t n, float *z)
{
	ct_rng_normals(
		n, z, seed, (uint64_t)view << 40 | (uint64_t)sample << 24 | (uint64_t)draw, 0);
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
	if (ct_superres_times(p, &t, &n, e))
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
static double range_of(const struct superres_job *j, double v, double most)
{
	return j->p->op == CT_MEASUREMENT_MEAN ? fmin(fmax(v, 0.0), most) : v;
}

/* The network's picture dst (channels, high, wide) of a view src (h, w). */
static void to_picture(const struct superres_job *j, size_t high, size_t wide, float *dst, size_t h,
	size_t w, const float *src)
{
	const size_t n = high * wide;

	ct_waves_extend(high, wide, dst, h, w, src);
	for (size_t i = 0; i < n; i++)
		dst[i] = (float)(2.0 * range_of(j, (double)dst[i] / j->p->norm, HUGE_VAL) - 1.0);
	for (size_t c = 1; c < j->waves.channels; c++)
		memcpy(dst + c * n, dst, n * sizeof *dst);
}

static void begin(void *ctx, struct ct_seat *s)
{
	const struct superres_job *j = ctx;
	const size_t all = j->waves.channels * j->op.high * j->op.wide;

	s->x = s->room;
	s->y = s->x + all;
	to_picture(j, j->op.h, j->op.w, s->y, j->in->h, j->in->w, ct_stack_view(j->in, s->view));
	if (!j->init)
		return;
	s->init = s->y + all / (j->p->scale * j->p->scale);
	to_picture(j, j->op.high, j->op.wide, s->init, j->init->h, j->init->w,
		ct_stack_view(j->init, s->view));
}

/* The view of a picture, of the mean of its channels. */
static void end(void *ctx, const struct ct_seat *s, float *result)
{
	const struct superres_job *j = ctx;
	const size_t n = j->op.high * j->op.wide, h = j->out->h, w = j->out->w;
	const size_t channels = j->p->first ? 1 : j->waves.channels;

	for (size_t y = 0; y < h; y++)
		for (size_t k = 0; k < w; k++) {
			double sum = 0.0, v;

			for (size_t c = 0; c < channels; c++)
				sum += (double)s->x[c * n + y * j->op.wide + k];
			v = 0.5 * ((double)(float)(sum / (double)channels) + 1.0);
			result[y * w + k] = (float)(range_of(j, v, 1.05) * j->p->norm);
		}
}

static void collect(void *ctx, const float *result, size_t view)
{
	const struct superres_job *j = ctx;

	ct_waves_mean(&j->waves, result, ct_stack_view(j->out, view),
		j->deviation ? ct_stack_view(j->deviation, view) : NULL);
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
	if (out->views != in->views || out->h != in->h * p->scale || out->w != in->w * p->scale)
		return ct_fail(e, CT_EGEOM, "the output is not %zu times finer", p->scale);
	return ct_waves_deviates(p, deviation, out, e) || (init && ct_stack_same(init, out, e)) ? -1
												: 0;
}

/* The two neighbours of fine pixel k in a line of n, and the weight of the second. */
static double neighbours(size_t k, size_t n, size_t s, size_t at[static 2])
{
	double index = ct_cell_index(ct_cell_centre((double)k) / (double)s),
	       within = fmin(fmax(index, 0.0), (double)(n - 1));

	at[0] = (size_t)within;
	at[1] = at[0] + 1 < n ? at[0] + 1 : at[0];
	return within - (double)at[0];
}

void ct_superres_bilinear(size_t h, size_t w, size_t s, float *restrict x, const float *restrict y)
{
	size_t row[2], col[2];

	for (size_t i = 0; i < h * s; i++) {
		double b = neighbours(i, h, s, row);

		for (size_t j = 0; j < w * s; j++) {
			double a = neighbours(j, w, s, col);
			const float *up = y + row[0] * w, *down = y + row[1] * w;

			x[i * w * s + j] = (float)((1 - b) * ((1 - a) * (double)up[col[0]] +
								     a * (double)up[col[1]]) +
						   b * ((1 - a) * (double)down[col[0]] +
							       a * (double)down[col[1]]));
		}
	}
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
			ct_superres_bilinear(in->h, in->w, p->scale, x, ct_stack_view(in, k));
		done[k] = true;
	}
}

int ct_superres(const struct ct_superres *p, const struct ct_denoiser *net,
	const struct ct_stack *in, const struct ct_stack *init, struct ct_stack *out,
	struct ct_stack *deviation, bool *done, const struct ct_env *env, struct ct_err *e)
{
	const size_t scale = p->scale;
	struct superres_job j = {
		.p = p, .in = in, .init = init, .out = out, .deviation = deviation};
	size_t high, wide;
	int rc;

	if (check(p, in, init, out, deviation, e))
		return -1;
	if (p->how.rule == CT_SAMPLER_NONE) {
		start_pictures(p, in, init, out, done);
		return 0;
	}
	ct_superres_size(p, net->multiple, in->h, in->w, &high, &wide);
	if (ct_measurement_alloc(&j.op, p->op, high / scale, wide / scale, scale, p->sigma_det, e))
		return -1;
	j.waves = (struct ct_waves){.p = p,
		.net = net,
		.env = env,
		.how = p->how,
		.op = &j.op,
		.views = in->views,
		.channels = net->channels,
		.room = net->channels * (2 * high * wide + j.op.h * j.op.w),
		.pixels = out->h * out->w,
		.begin = begin,
		.end = end,
		.collect = collect,
		.ctx = &j};
	rc = ct_waves_run(&j.waves, done, e);
	ct_measurement_free(&j.op);
	return rc;
}
