/* trainer.c: see trainer.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "solve/trainer.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { CHUNK = 1 << 15 }; /* weights a task */

static size_t chunks(const struct ct_trainer *t)
{
	return (t->n + CHUNK - 1) / CHUNK;
}

int ct_trainer_alloc(struct ct_trainer *t, const struct ct_trainer_rule *r, size_t n, size_t groups,
	float *weights, float *average, struct ct_par *par, struct ct_err *e)
{
	const size_t parts = groups + 2 + !weights + !average;
	size_t total;
	float *at;

	*t = (struct ct_trainer){.rule = *r, .par = par, .n = n, .groups = groups};
	if (ct_size_mul(&total, parts, n, "gradients", e) ||
		ct_alloc0(&t->own, total, sizeof *t->own, e) ||
		ct_alloc0(&t->norm, chunks(t), sizeof *t->norm, e))
		return -1;
	at = t->own;
	t->weights = weights ? weights : at;
	at += weights ? 0 : n;
	t->average = average ? average : at;
	at += average ? 0 : n;
	t->m = at;
	t->v = at + n;
	t->grad = at + 2 * n;
	return 0;
}

void ct_trainer_free(struct ct_trainer *t)
{
	free(t->own);
	free(t->norm);
	*t = (struct ct_trainer){0};
}

double ct_trainer_rate(const struct ct_trainer *t)
{
	const struct ct_trainer_rule *r = &t->rule;
	const double s = (double)t->steps, warm = (double)r->warmup, span = (double)r->steps - warm;

	if (t->steps < r->warmup)
		return r->adam.lr * (s + 1) / warm;
	if (!r->cosine || span <= 0)
		return r->adam.lr;
	return r->adam.lr * 0.5 * (1 + cos(M_PI * fmin(s - warm, span) / span));
}

/* What the tasks of a step share. */
struct step {
	struct ct_trainer *t;
	struct ct_adamw adam;
	double scale, clip, average; /* of the gradients, of their sum; kept of the average */
};

static size_t chunk_size(const struct ct_trainer *t, size_t c)
{
	return t->n - c * CHUNK < CHUNK ? t->n - c * CHUNK : CHUNK;
}

/* The gradient into the first accumulator, and its squared norm. */
static void reduce(void *arg, size_t c, size_t worker)
{
	const struct step *s = arg;
	struct ct_trainer *t = s->t;

	(void)worker;
	t->norm[c] = CT_SIMD(ct_adam_gradient)(
		chunk_size(t, c), t->grad + c * CHUNK, t->groups, t->n, (float)s->scale);
}

static void update(void *arg, size_t c, size_t worker)
{
	const struct step *s = arg;
	struct ct_trainer *t = s->t;
	const size_t n = chunk_size(t, c), at = c * CHUNK;
	float *g = t->grad + at;

	(void)worker;
	if (s->clip < 1.0)
		for (size_t i = 0; i < n; i++)
			g[i] *= (float)s->clip;
	CT_SIMD(ct_adamw_step)
	(&s->adam, t->steps, n, t->weights + at, t->m + at, t->v + at, g);
	CT_SIMD(ct_adam_average)(s->average, n, t->average + at, t->weights + at);
}

int ct_trainer_step(struct ct_trainer *t, double loss, double scale, struct ct_err *e)
{
	const struct ct_trainer_rule *r = &t->rule;
	struct step s = {.t = t, .adam = r->adam, .scale = scale};
	double norm = 0, k;

	ct_par_for(t->par, chunks(t), reduce, &s);
	for (size_t c = 0; c < chunks(t); c++)
		norm += t->norm[c];
	norm = sqrt(norm);
	if (!isfinite(loss) || !isfinite(norm))
		return ct_fail(e, CT_ENUMERIC,
			"training diverged at step %llu: loss %g, norm of the gradient %g",
			(unsigned long long)t->steps + 1, loss, norm);
	s.adam.lr = ct_trainer_rate(t);
	k = (double)++t->steps;
	s.average = fmin(r->average, (1 + k) / (10 + k));
	s.clip = r->clip > 0 && norm > r->clip ? r->clip / norm : 1.0;
	ct_par_for(t->par, chunks(t), update, &s);
	return 0;
}

enum { VECTORS = 4 };
static const char *const names[VECTORS] = {"weights", "average", "adam.m", "adam.v"};

const float *ct_trainer_vector(
	const struct ct_tensors *w, const char *name, size_t n, struct ct_err *e)
{
	if (ct_tensors_find(w, name))
		return ct_tensors_vector(w, name, n, e);
	ct_fail(e, CT_EINPUT,
		"not a state of this version of ctsr: no tensor \"%s\"; run again without --resume, with --force",
		name);
	return NULL;
}

int ct_trainer_save(const struct ct_trainer *t, struct ct_tensors *w, struct ct_err *e)
{
	const float *const v[VECTORS] = {t->weights, t->average, t->m, t->v};

	for (size_t i = 0; i < VECTORS; i++)
		if (ct_tensors_put(w, names[i], 1, &t->n, v[i], e))
			return -1;
	return ct_meta_setf(&w->meta, e, CT_META_STEP, "%llu", (unsigned long long)t->steps);
}

int ct_trainer_restore(struct ct_trainer *t, const struct ct_tensors *w, struct ct_err *e)
{
	float *const v[VECTORS] = {t->weights, t->average, t->m, t->v};
	const float *from[VECTORS];
	double step;

	if (ct_meta_numbers(&w->meta, CT_META_STEP, 1, &step, e) || !(step >= 0 && step < 0x1p53))
		return ct_fail(e, CT_EINPUT, "not the state of a training: no \"step\"");
	for (size_t i = 0; i < VECTORS; i++) {
		from[i] = ct_trainer_vector(w, names[i], t->n, e);
		if (!from[i])
			return -1;
	}
	for (size_t i = 0; i < VECTORS; i++)
		memcpy(v[i], from[i], t->n * sizeof **v);
	t->steps = (uint64_t)step;
	return 0;
}
