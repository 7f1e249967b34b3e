/* residual.c: see residual.h. */
#include "config.h"
#include "diffusion/residual.h"
#include "core/mem.h"
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
	return ct_measurement_band(&f->known, 2 * h, 2 * w, high, wide, e) ||
			       ct_measurement_band(&f->half, h, w, high, wide, e)
		       ? -1
		       : 0;
}

void ct_residual_frame_free(struct ct_residual_frame *f)
{
	ct_measurement_free(&f->known);
	ct_measurement_free(&f->half);
}

size_t ct_residual_frame_scratch(const struct ct_residual_frame *f)
{
	return ct_measurement_scratch(&f->known);
}

/* x <- x - V^T V x of a band. */
static void take_off(const struct ct_measurement *band, float *x, double *t)
{
	const size_t n = band->h * band->w;
	double *c = t, *rest = t + n;

	ct_measurement_analyse(band, c, x, rest);
	for (size_t i = 0; i < n; i++)
		c[i] = -c[i];
	ct_measurement_synth_add(band, x, c, rest);
}

void ct_residual_hold(const struct ct_residual_frame *f, float *r, double *t)
{
	take_off(&f->known, r, t);
}

void ct_residual_condition(const struct ct_residual_frame *f, float *c, const float *b, double max,
	double octave, double *t)
{
	const size_t n = f->known.high * f->known.wide;
	float *detail = c + n;

	for (size_t i = 0; i < n; i++) {
		c[i] = (float)(2.0 * (double)b[i] / max - 1.0);
		detail[i] = (float)((double)b[i] / octave);
	}
	take_off(&f->half, detail, t);
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

bool ct_residual_draws(enum ct_sampler_rule rule)
{
	return rule == CT_SAMPLER_DDNM || rule == CT_SAMPLER_DDIM || rule == CT_SAMPLER_DDPM ||
	       rule == CT_SAMPLER_DPM;
}

struct residual_job {
	const struct ct_residual *r;
	double weight, max, octave;
	const struct ct_superres *p;
	const struct ct_stack *b;
	struct ct_stack *out, *deviation;
	struct ct_residual_frame frame, view; /* the network's picture; a view */
	float *told;                          /* [h][w], and scratch of view */
	double *t;
	struct ct_waves waves;
};

/* The network's input [CT_RESIDUAL_PLANES][n] begins the room of a seat. */
static int evaluate(void *ctx, double t, const float *x, float *eps, struct ct_err *e)
{
	const struct ct_seat *s = ctx;
	const struct residual_job *j = s->w->ctx;
	const size_t n = j->frame.known.high * j->frame.known.wide;
	const double abar = ct_schedule_abar(s->w->net->schedule, (int)t), a = sqrt(abar),
		     sig = sqrt(1.0 - abar);

	memcpy(s->room, x, n * sizeof *x);
	if (ct_waves_eps(ctx, t, s->room, eps, e))
		return -1;
	for (size_t i = 0; i < n; i++)
		eps[i] = (float)(sig * (double)x[i] + a * (double)eps[i]);
	return 0;
}

static void begin(void *ctx, struct ct_seat *s)
{
	struct residual_job *j = ctx;
	const struct ct_residual_frame *f = &j->frame;
	const size_t high = f->known.high, wide = f->known.wide, n = high * wide;
	float *b = s->room + CT_RESIDUAL_PLANES * n;

	s->x = b + n;
	s->first = s->x + n;
	ct_waves_extend(high, wide, b, j->b->h, j->b->w, ct_stack_view(j->b, s->view));
	ct_residual_condition(f, s->room + n, b, j->max, j->octave, s->scratch);
}

/* The first estimate, and the sample. */
static void end(void *ctx, const struct ct_seat *s, float *result)
{
	const struct residual_job *j = ctx;
	const size_t h = j->b->h, w = j->b->w, wide = j->frame.known.wide;

	for (size_t y = 0; y < h; y++) {
		memcpy(result + y * w, s->first + y * wide, w * sizeof *result);
		memcpy(result + (h + y) * w, s->x + y * wide, w * sizeof *result);
	}
}

static void collect(void *ctx, const float *result, size_t view)
{
	const struct residual_job *j = ctx;
	const float *b = ct_stack_view(j->b, view);
	float *out = ct_stack_view(j->out, view);
	const double m = j->r->missing * j->octave;

	if (j->deviation)
		ct_waves_mean(&j->waves, result, 1, j->told, m, ct_stack_view(j->deviation, view));
	ct_waves_mean(&j->waves, result, 0, j->told, 0, NULL);
	ct_residual_hold(&j->view, j->told, j->t); /* what was cut off of it is missing */
	for (size_t i = 0; i < j->waves.pixels; i++)
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
	return ct_waves_deviates(p, j->deviation, j->out, e) || ct_stack_same(j->b, j->out, e) ? -1
											       : 0;
}

bool ct_residual_asks(double weight, bool deviation)
{
	return weight > 0 || deviation;
}

static int job_run(struct residual_job *j, const struct ct_denoiser *net, bool *done,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_superres *p = j->p;
	const size_t h = j->b->h, w = j->b->w;
	size_t high, wide;

	ct_superres_size(p, net->multiple, h / p->scale, w / p->scale, &high, &wide);
	if (ct_superres_norm(j->b, &j->max, e) ||
		ct_residual_octave(&j->octave, j->b, j->r->factor, e) ||
		ct_residual_frame_alloc(&j->frame, j->r->factor, high, wide, e) ||
		ct_residual_frame_alloc(&j->view, j->r->factor, h, w, e) ||
		ct_alloc(&j->told, h, w * sizeof *j->told, e) ||
		ct_alloc(&j->t, ct_residual_frame_scratch(&j->view), sizeof *j->t, e))
		return -1;
	j->waves = (struct ct_waves){.p = p,
		.net = net,
		.env = env,
		.how = p->how,
		.op = &j->frame.known,
		.eps = evaluate,
		.views = j->b->views,
		.channels = 1,
		.room = (CT_RESIDUAL_PLANES + 3) * high * wide,
		.scratch = ct_residual_frame_scratch(&j->frame),
		.pixels = h * w,
		.parts = 2,
		.begin = begin,
		.end = end,
		.collect = collect,
		.ctx = j};
	j->waves.how.range = HUGE_VAL;
	return ct_waves_run(&j->waves, done, e);
}

int ct_residual_draw(const struct ct_residual *r, double weight, const struct ct_superres *p,
	const struct ct_denoiser *net, const struct ct_stack *b, struct ct_stack *out,
	struct ct_stack *deviation, bool *done, const struct ct_env *env, struct ct_err *e)
{
	struct residual_job j = {
		.r = r, .weight = weight, .p = p, .b = b, .out = out, .deviation = deviation};
	int rc;

	if (check(&j, e))
		return -1;
	if (!ct_residual_asks(weight, deviation)) {
		memcpy(out->data, b->data, ct_stack_count(b) * sizeof *out->data);
		for (size_t v = 0; v < b->views; v++)
			done[v] = true;
		return 0;
	}
	rc = job_run(&j, net, done, env, e);
	free(j.told);
	free(j.t);
	ct_residual_frame_free(&j.frame);
	ct_residual_frame_free(&j.view);
	return rc;
}
