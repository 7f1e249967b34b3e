/* residual.c: see residual.h. */
#include "config.h"
#include "diffusion/residual.h"
#include "core/mem.h"
#include "diffusion/range-null.h"
#include "diffusion/mirror.h"
#include "diffusion/waves.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

int ct_residual_get(struct ct_residual *r, const struct ct_meta *m, struct ct_err *e)
{
	const char *map = ct_meta_get(m, CT_META_INTENSITY_MAP);
	double factor = 0, weight[2] = {-1, -1};

	*r = (struct ct_residual){0};
	if (!map || strcmp(map, CT_RESIDUAL_MAP) != 0)
		return 1;
	if (ct_meta_numbers(m, CT_META_COARSEN, 1, &factor, e) ||
		ct_meta_numbers(m, CT_META_MISSING, 1, &r->missing, e) ||
		ct_meta_numbers(m, CT_META_WEIGHT, 2, weight, e) ||
		!(factor >= 3 && factor <= 64 && factor == floor(factor)) ||
		!(r->missing > 0 && r->missing < 1e6) || !(weight[0] >= 0 && weight[0] <= 1) ||
		!(weight[1] >= 0 && weight[1] <= 1))
		return ct_fail(e, CT_EINPUT,
			"%s, %s or %s: a prior of what is missing states all three",
			CT_META_COARSEN, CT_META_MISSING, CT_META_WEIGHT);
	r->factor = (size_t)factor;
	r->sampled = weight[0];
	r->aliased = weight[1];
	return 0;
}

int ct_residual_put(const struct ct_residual *r, struct ct_meta *m, struct ct_err *e)
{
	return ct_meta_set(m, CT_META_INTENSITY_MAP, CT_RESIDUAL_MAP, e) ||
			       ct_meta_setf(m, e, CT_META_COARSEN, "%zu", r->factor) ||
			       ct_meta_setf(m, e, CT_META_MISSING, "%.6g", r->missing) ||
			       ct_meta_setf(
				       m, e, CT_META_WEIGHT, "%.6g,%.6g", r->sampled, r->aliased)
		       ? -1
		       : 0;
}

int ct_residual_frame_alloc(
	struct ct_residual_frame *f, size_t factor, size_t high, size_t wide, struct ct_err *e)
{
	const size_t h = high / factor, w = wide / factor;

	if (high % factor || wide % factor || h == 0 || w == 0)
		return ct_fail(
			e, CT_EGEOM, "%zux%zu pixels are no multiples of %zu", wide, high, factor);
	f->high = high;
	f->wide = wide;
	return ct_measurement_band(&f->known, 2 * h, 2 * w, high, wide, e) ||
			       ct_measurement_band(&f->half, h, w, high, wide, e) ||
			       ct_alloc0(&f->zero, 4 * h * w, sizeof *f->zero, e)
		       ? -1
		       : 0;
}

void ct_residual_frame_free(struct ct_residual_frame *f)
{
	ct_measurement_free(&f->known);
	ct_measurement_free(&f->half);
	free(f->zero);
	*f = (struct ct_residual_frame){0};
}

size_t ct_residual_frame_scratch(const struct ct_residual_frame *f)
{
	return ct_measurement_scratch(&f->known);
}

void ct_residual_hold(const struct ct_residual_frame *f, float *r, double *t)
{
	ct_range_null(&f->known, r, f->zero, t);
}

void ct_residual_condition(const struct ct_residual_frame *f, float *c, const float *b, double max,
	double octave, double *t)
{
	const size_t n = f->high * f->wide;
	float *detail = c + n;

	for (size_t i = 0; i < n; i++) {
		c[i] = (float)(2.0 * (double)b[i] / max - 1.0);
		detail[i] = (float)((double)b[i] / octave);
	}
	ct_range_null(&f->half, detail, f->zero, t);
}

int ct_residual_octave(double *rms, const struct ct_stack *b, size_t factor, struct ct_err *e)
{
	struct ct_residual_frame f = {0};
	double *c = NULL, sum = 0;
	int rc = -1;

	if (ct_residual_frame_alloc(&f, factor, b->h, b->w, e) ||
		ct_alloc(&c, f.known.h * f.known.w + ct_residual_frame_scratch(&f), sizeof *c, e))
		goto out;
	for (size_t k = 0; k < b->views; k++) {
		ct_measurement_analyse(&f.known, c, ct_stack_view(b, k), c + f.known.h * f.known.w);
		for (size_t i = 0; i < f.known.h; i++)
			for (size_t j = 0; j < f.known.w; j++)
				if (i >= f.half.h || j >= f.half.w)
					sum += c[i * f.known.w + j] * c[i * f.known.w + j];
	}
	*rms = sqrt(sum / (double)ct_stack_count(b));
	rc = *rms > 0 && isfinite(*rms)
		     ? 0
		     : ct_fail(e, CT_EINPUT, "there is no detail to tell from what is missing");
out:
	free(c);
	ct_residual_frame_free(&f);
	return rc;
}

int ct_residual_missing(
	double *m, const struct ct_residual *r, const struct ct_stack *b, struct ct_err *e)
{
	if (ct_residual_octave(m, b, r->factor, e))
		return -1;
	*m *= r->missing;
	return 0;
}

bool ct_residual_draws(enum ct_sampler_rule rule)
{
	return rule == CT_SAMPLER_DDNM || rule == CT_SAMPLER_DDIM || rule == CT_SAMPLER_DDPM ||
	       rule == CT_SAMPLER_DPM;
}

/* What one worker needs: the network's input [CT_RESIDUAL_PLANES][n], and b, x, first [n]. */
struct seat {
	float *input, *b, *x, *first;
	double *t;
};

struct residual_job {
	const struct ct_residual *r;
	double weight;
	const struct ct_superres *p;
	const struct ct_denoiser *net;
	const struct ct_stack *b;
	struct ct_stack *out, *deviation;
	const struct ct_env *env;
	struct ct_residual_frame frame, view; /* the network's picture; a view */
	float *told;                          /* [h][w], and scratch of view */
	double *t;
	int *times;
	size_t ntimes, threads;
	double max, octave;
	struct seat *seat; /* [threads] */
	float *result;     /* [places][2][h][w]: the first estimate, and the sample */
	struct ct_waves waves;
};

struct draw {
	struct residual_job *job;
	size_t view, sample, worker;
};

static int evaluate(void *ctx, double t, const float *x, float *eps, struct ct_err *e)
{
	const struct draw *d = ctx;
	struct residual_job *j = d->job;
	const struct seat *s = &j->seat[d->worker];
	const size_t n = j->frame.high * j->frame.wide;
	const double abar = ct_schedule_abar(j->net->schedule, (int)t), a = sqrt(abar),
		     sig = sqrt(1.0 - abar);

	memcpy(s->input, x, n * sizeof *x);
	if (ct_waves_call(&j->waves, d->worker, e) ||
		j->net->eps(j->net->ctx[d->worker], t, s->input, eps, e))
		return -1;
	for (size_t i = 0; i < n; i++)
		eps[i] = (float)(sig * (double)x[i] + a * (double)eps[i]);
	return 0;
}

static void normals(void *ctx, size_t draw, size_t n, float *z)
{
	const struct draw *d = ctx;

	ct_superres_normals(d->job->env->seed, d->view, d->sample, draw, n, z);
}

/* The picture dst (high, wide) of a view, continued by reflection; and back. */
static void extend(const struct residual_job *j, float *dst, const float *src)
{
	const size_t h = j->b->h, w = j->b->w;

	for (size_t y = 0; y < j->frame.high; y++)
		for (size_t x = 0; x < j->frame.wide; x++)
			dst[y * j->frame.wide + x] =
				src[ct_mirror_index(y, h) * w + ct_mirror_index(x, w)];
}

static void cut(const struct residual_job *j, float *dst, const float *src)
{
	for (size_t y = 0; y < j->b->h; y++)
		memcpy(dst + y * j->b->w, src + y * j->frame.wide, j->b->w * sizeof *dst);
}

static int draw_view(
	void *arg, size_t place, size_t view, size_t sample, size_t worker, struct ct_err *e)
{
	struct residual_job *j = arg;
	const struct seat *s = &j->seat[worker];
	const size_t n = j->frame.high * j->frame.wide, pixels = j->b->h * j->b->w;
	struct draw draw = {j, view, sample, worker};
	struct ct_sampler d = {.schedule = j->net->schedule,
		.t = j->times,
		.nt = j->ntimes,
		.how = j->p->how,
		.op = &j->frame.known,
		.channels = 1,
		.eps = evaluate,
		.eps_ctx = &draw,
		.normals = normals,
		.normals_ctx = &draw,
		.first = s->first};

	d.how.range = HUGE_VAL;
	extend(j, s->b, ct_stack_view(j->b, view));
	ct_residual_condition(&j->frame, s->input + n, s->b, j->max, j->octave, s->t);
	if (ct_sampler_draw(&d, s->x, j->frame.zero, NULL, e))
		return -1;
	cut(j, j->result + 2 * place * pixels, s->first);
	cut(j, j->result + (2 * place + 1) * pixels, s->x);
	return 0;
}

static void collect(void *arg, size_t first, size_t view)
{
	const struct residual_job *j = arg;
	const size_t n = j->b->h * j->b->w, k = j->p->samples;
	const float *r = j->result + 2 * first * n, *b = ct_stack_view(j->b, view);
	float *out = ct_stack_view(j->out, view),
	      *dev = j->deviation ? ct_stack_view(j->deviation, view) : NULL;
	const double m = j->r->missing * j->octave;

	for (size_t i = 0; i < n; i++) {
		double told = 0, mean = 0, sq = 0;

		for (size_t s = 0; s < k; s++) {
			told += (double)r[2 * s * n + i] / (double)k;
			mean += (double)r[(2 * s + 1) * n + i] / (double)k;
		}
		j->told[i] = (float)told;
		for (size_t s = 0; dev && s < k; s++)
			sq += pow((double)r[(2 * s + 1) * n + i] - mean, 2);
		if (dev)
			dev[i] = (float)(m * sqrt(sq / (double)(k - 1)));
	}
	ct_residual_hold(&j->view, j->told, j->t); /* what was cut off of it is missing */
	for (size_t i = 0; i < n; i++)
		out[i] = (float)((double)b[i] + j->weight * m * (double)j->told[i]);
}

static int check(const struct residual_job *j, struct ct_err *e)
{
	const struct ct_superres *p = j->p;

	if (!ct_residual_draws(p->how.rule))
		return ct_fail(e, CT_EUSAGE, "the sampler %s does not draw what is missing",
			CT_WORD(CT_SAMPLER_LIST, p->how.rule));
	if (p->scale != j->r->factor)
		return ct_fail(e, CT_EUSAGE, "the prior knows scans %zu times coarser, not %zu",
			j->r->factor, p->scale);
	if (j->deviation && p->samples < 2)
		return ct_fail(e, CT_EUSAGE, "a standard deviation needs two samples or more");
	return ct_stack_same(j->b, j->out, e) ||
			       (j->deviation && ct_stack_same(j->deviation, j->out, e))
		       ? -1
		       : 0;
}

bool ct_residual_asks(double weight, bool deviation)
{
	return weight > 0 || deviation;
}

static int job_alloc(struct residual_job *j, struct ct_err *e)
{
	const struct ct_superres *p = j->p;
	const size_t scratch = ct_residual_frame_scratch(&j->frame);
	size_t n = j->frame.high * j->frame.wide, none;

	j->waves = (struct ct_waves){.env = j->env,
		.views = j->b->views,
		.samples = p->samples,
		.draw = draw_view,
		.collect = collect,
		.ctx = j,
		.save = p->save,
		.save_ctx = p->save_ctx};
	if (ct_superres_times(p, &j->times, &j->ntimes, e) ||
		ct_superres_calls(p, &j->waves.calls, &none, e) ||
		ct_alloc0(&j->seat, j->threads, sizeof *j->seat, e) ||
		ct_alloc(&j->told, j->b->h, j->b->w * sizeof *j->told, e) ||
		ct_alloc(&j->t, ct_residual_frame_scratch(&j->view), sizeof *j->t, e) ||
		ct_alloc(&j->result, 2 * ct_waves_places(&j->waves),
			j->b->h * j->b->w * sizeof *j->result, e))
		return -1;
	for (size_t k = 0; k < j->threads; k++) {
		struct seat *seat = &j->seat[k];

		if (ct_alloc(&seat->input, n, (CT_RESIDUAL_PLANES + 3) * sizeof *seat->x, e) ||
			ct_alloc(&seat->t, scratch, sizeof *seat->t, e))
			return -1;
		seat->b = seat->input + CT_RESIDUAL_PLANES * n;
		seat->x = seat->b + n;
		seat->first = seat->x + n;
	}
	return 0;
}

static void job_free(struct residual_job *j)
{
	for (size_t k = 0; j->seat && k < j->threads; k++) {
		free(j->seat[k].input);
		free(j->seat[k].t);
	}
	free(j->seat);
	free(j->result);
	free(j->times);
	free(j->told);
	free(j->t);
	ct_residual_frame_free(&j->frame);
	ct_residual_frame_free(&j->view);
}

int ct_residual_draw(const struct ct_residual *r, double weight, const struct ct_superres *p,
	const struct ct_denoiser *net, const struct ct_stack *b, struct ct_stack *out,
	struct ct_stack *deviation, bool *done, const struct ct_env *env, struct ct_err *e)
{
	struct residual_job j = {.r = r,
		.weight = weight,
		.p = p,
		.net = net,
		.b = b,
		.out = out,
		.deviation = deviation,
		.env = env,
		.threads = ct_par_threads(env->par)};
	size_t high, wide;
	int rc = -1;

	if (!ct_residual_asks(weight, deviation)) {
		if (check(&j, e))
			return -1;
		memcpy(out->data, b->data, ct_stack_count(b) * sizeof *out->data);
		for (size_t v = 0; v < b->views; v++)
			done[v] = true;
		return 0;
	}
	if (check(&j, e) || ct_superres_norm(b, &j.max, e) ||
		ct_residual_octave(&j.octave, b, r->factor, e))
		return -1;
	ct_superres_size(p, net->multiple, b->h / p->scale, b->w / p->scale, &high, &wide);
	if (ct_residual_frame_alloc(&j.frame, r->factor, high, wide, e) == 0 &&
		ct_residual_frame_alloc(&j.view, r->factor, b->h, b->w, e) == 0 &&
		job_alloc(&j, e) == 0)
		rc = ct_waves_run(&j.waves, done, e);
	job_free(&j);
	return rc;
}
