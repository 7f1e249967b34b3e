/* draw.c: see sampler.h and draw.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "diffusion/draw.h"
#include "core/mem.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

int ct_draw_alloc(struct ct_draw *w, const struct ct_sampler *s, const float *y, struct ct_err *e)
{
	const struct ct_measurement *op = s->op;
	size_t doubles;

	w->s = s;
	if (ct_size_mul(&w->m, op->h, op->w, "picture", e) ||
		ct_size_mul(&w->n, op->high, op->wide, "picture", e) ||
		ct_size_mul(&w->all, w->n, s->channels, "picture", e) ||
		ct_alloc(&w->floats, w->all, 4 * sizeof *w->floats, e))
		return -1;
	w->x0 = w->floats;
	w->before = w->x0 + w->all;
	w->eps = w->before + w->all;
	w->z = w->eps + w->all;
	doubles = (s->channels + 3) * w->m + ct_measurement_scratch(op);
	if (ct_alloc0(&w->data, doubles, sizeof *w->data, e))
		return -1;
	w->c0 = w->data + s->channels * w->m;
	w->cz = w->c0 + w->m;
	w->ce = w->cz + w->m;
	w->t = w->ce + w->m;
	for (size_t c = 0; c < s->channels; c++)
		ct_measurement_data(op, w->data + c * w->m, y + c * w->m, w->t);
	return 0;
}

void ct_draw_free(struct ct_draw *w)
{
	free(w->floats);
	free(w->data);
	*w = (struct ct_draw){0};
}

/* x0 from the network's eps. */
static int estimate(struct ct_draw *w, int t, const float *x, struct ct_err *e)
{
	const struct ct_sampler *s = w->s;
	double abar = ct_schedule_abar(s->schedule, t), a = 1.0 / sqrt(abar), b = sqrt(1.0 - abar);

	if (s->eps(s->eps_ctx, (double)t, x, w->eps, e))
		return -1;
	for (size_t i = 0; i < w->all; i++) {
		w->x0[i] = (float)(((double)x[i] - b * (double)w->eps[i]) * a);
		if (!isfinite(w->x0[i]))
			return ct_fail(e, CT_ENUMERIC,
				"timestep %d: the network's output is not finite", t);
	}
	return 0;
}

/* x = sqrt(abar) clean + sqrt(1 - abar) z */
static void noised(const struct ct_draw *w, int t, float *x, const float *clean)
{
	double abar = ct_schedule_abar(w->s->schedule, t), a = sqrt(abar), b = sqrt(1.0 - abar);

	for (size_t i = 0; i < w->all; i++)
		x[i] = (float)(a * (double)clean[i] + b * (double)w->z[i]);
}

void ct_draw_begin(const struct ct_draw *w, float *x, const float *init)
{
	if (init)
		noised(w, w->s->t[0], x, init);
	else
		memcpy(x, w->z, w->all * sizeof *x);
}

int ct_draw_run(struct ct_draw *w, float *x, float *trail, struct ct_err *e)
{
	const struct ct_sampler *s = w->s;
	float *last;

	w->known = false;
	for (size_t k = 0; k + 1 < s->nt; k++) {
		if (trail)
			memcpy(trail + k * w->all, x, w->all * sizeof *x);
		if (s->t[k + 1] > s->t[k]) { /* back in time: the last estimate, noised again */
			s->normals(s->normals_ctx, k + 1, w->all, w->z);
			noised(w, s->t[k + 1], x, w->x0);
			w->known = false;
			continue;
		}
		last = w->before;
		w->before = w->x0;
		w->x0 = last;
		if (estimate(w, s->t[k], x, e))
			return -1;
		s->normals(s->normals_ctx, k + 1, w->all, w->z);
		if (s->how.rule <= CT_SAMPLER_SIMPLE)
			ct_draw_ddnm(w, k, x);
		else
			ct_draw_ddim(w, k, x);
		w->known = true;
	}
	return 0;
}

void ct_draw_pull(const struct ct_draw *w, double by, float *x, const float *x0)
{
	for (size_t c = 0; c < w->s->channels; c++)
		ct_measurement_pull(
			w->s->op, by, x + c * w->n, x0 + c * w->n, w->data + c * w->m, w->c0, w->t);
}

struct ct_sampler_how ct_sampler_default(enum ct_sampler_rule rule)
{
	return (struct ct_sampler_how){.rule = rule,
		.eta = rule == CT_SAMPLER_DDIM ? 0 : 0.99,
		.sigma_y = 0.0015,
		.guidance = 2000,
		.iterations = 100,
		.rate = 1e-3};
}

size_t ct_sampler_steps(enum ct_sampler_rule rule)
{
	return rule == CT_SAMPLER_GDP    ? 1000
	       : rule == CT_SAMPLER_BIRD ? 10
	       : rule == CT_SAMPLER_ONCE ? 1
	       : rule == CT_SAMPLER_NONE ? 0
					 : 50;
}

int ct_sampler_draw(
	const struct ct_sampler *s, float *x, const float *y, const float *init, struct ct_err *e)
{
	struct ct_draw w = {0};
	int rc;

	assert(s->how.rule < CT_SAMPLER_ONCE);
	rc = ct_draw_alloc(&w, s, y, e);
	if (rc == 0) {
		s->normals(s->normals_ctx, 0, w.all, w.z);
		if (s->how.rule == CT_SAMPLER_BIRD)
			rc = ct_draw_bird(&w, x, y, init, e);
		else {
			ct_draw_begin(&w, x, init);
			rc = ct_draw_run(&w, x, NULL, e);
		}
	}
	ct_draw_free(&w);
	return rc;
}
