/* pairs.c: see pairs.h. */
#include "config.h"
#include "train/pairs.h"
#include "core/mem.h"
#include "formats/format.h"
#include "formats/hash.h"
#include "resolution/degrade.h"
#include "train/data.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { EVERY = 8 }; /* view, of those that are weighed */
#define LEAST_GAIN                                                                                 \
	(1.0 / 500) /* part of the squared error: what takes off less is taken for chance */

/* Mean square of (I - P)(truth - base). */
static int lack_of(double *rms, const struct train_pair *p, size_t factor, struct ct_err *e)
{
	const size_t n = p->base.h * p->base.w;
	struct ct_residual_frame f = {0};
	float *r = NULL;
	double *t = NULL, sum = 0;
	int rc = -1;

	if (ct_residual_frame_alloc(&f, factor, p->base.h, p->base.w, e) ||
		ct_alloc(&t, ct_residual_frame_scratch(&f), sizeof *t, e) ||
		ct_alloc(&r, n, sizeof *r, e))
		goto out;
	for (size_t k = 0; k < p->base.views; k++) {
		const float *truth = ct_stack_view(&p->truth, k), *b = ct_stack_view(&p->base, k);

		for (size_t i = 0; i < n; i++)
			r[i] = truth[i] - b[i];
		ct_residual_hold(&f, r, t);
		for (size_t i = 0; i < n; i++)
			sum += (double)r[i] * (double)r[i];
	}
	*rms = sqrt(sum / (double)ct_stack_count(&p->base));
	rc = *rms > 0 ? 0 : ct_fail(e, CT_EINPUT, "nothing is missing: it is as its truth");
out:
	free(r);
	free(t);
	ct_residual_frame_free(&f);
	return rc;
}

static int read_pair(
	struct train_pairs *s, const char *path, const char *base, size_t factor, struct ct_err *e)
{
	struct train_pair *p;
	char *other = NULL;
	int rc = -1;

	if (asprintf(&other, "%s/%s", base, basename(path)) < 0)
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	if (ct_grow(&s->pair, &s->cap, s->n + 1, sizeof *s->pair, e))
		goto out;
	p = &s->pair[s->n++];
	*p = (struct train_pair){.name = strdup(path)};
	if (!p->name)
		ct_fail(e, CT_ENOMEM, "no memory for a file name");
	else if (train_data_stack(&p->truth, path, e) == 0 &&
		 train_data_stack(&p->base, other, e) == 0)
		rc = ct_stack_same(&p->base, &p->truth, e) ||
				     ct_residual_octave(&p->octave, &p->base, factor, e) ||
				     lack_of(&p->lack, p, factor, e)
			     ? ct_blame(e, other)
			     : 0;
out:
	free(other);
	return rc;
}

int train_pairs_name(const struct train_pairs *s, size_t first, bool base, const char *name,
	struct ct_meta *meta, struct ct_err *e)
{
	struct ct_hash *hash;
	int rc;

	if (ct_hash_alloc(&hash, e))
		return -1;
	for (size_t i = first; i < s->n; i++) {
		const struct ct_stack *x = base ? &s->pair[i].base : &s->pair[i].truth;

		CT_SIMD(ct_hash_add)(hash, x->data, ct_stack_count(x) * sizeof *x->data);
	}
	rc = ct_hash_input(hash, meta, name, e);
	free(hash);
	return rc;
}

int train_pairs_read(struct train_pairs *s, const char *path, const char *base, size_t factor,
	struct ct_meta *meta, struct ct_err *e)
{
	const size_t first = s->n;
	struct train_names names = {0};
	int rc = train_data_names(&names, path, e);

	for (size_t i = 0; rc == 0 && i < names.n; i++)
		rc = read_pair(s, names.path[i], base, factor, e);
	train_names_free(&names);
	if (rc)
		return -1;
	if (s->n == first)
		return ct_fail(e, CT_EINPUT, "%s: no stacks in it", path);
	return train_pairs_name(s, first, false, path, meta, e);
}

void train_pairs_free(struct train_pairs *s)
{
	for (size_t i = 0; i < s->n; i++) {
		free(s->pair[i].name);
		ct_stack_free(&s->pair[i].truth);
		ct_stack_free(&s->pair[i].base);
	}
	free(s->pair);
	*s = (struct train_pairs){0};
}

double train_pairs_missing(const struct train_pairs *s)
{
	double sum = 0;

	for (size_t i = 0; i < s->n; i++)
		sum += log(s->pair[i].lack / s->pair[i].octave);
	return exp(sum / (double)s->n);
}

/* Planes of view k; b and t are scratch. */
static void planes_of(float *x, const struct train_pair *p, size_t k, double max, double missing,
	const struct ct_residual_frame *f, double *t)
{
	const size_t n = p->base.h * p->base.w;
	const float *truth = ct_stack_view(&p->truth, k), *b = ct_stack_view(&p->base, k);

	for (size_t i = 0; i < n; i++)
		x[i] = (float)(((double)truth[i] - (double)b[i]) / (missing * p->octave));
	ct_residual_hold(f, x, t);
	ct_residual_condition(f, x + n, b, max, p->octave, t);
}

static int add_pair(struct ct_pictures *to, const struct train_pair *p, const struct ct_residual *r,
	struct ct_err *e)
{
	const size_t h = p->base.h, w = p->base.w;
	struct ct_residual_frame f = {0};
	double *t = NULL, max;
	int rc = -1;

	if (ct_superres_norm(&p->base, &max, e)) {
		ct_blame(e, p->name);
		goto out;
	}
	if (ct_residual_frame_alloc(&f, r->factor, h, w, e) ||
		ct_alloc(&t, ct_residual_frame_scratch(&f), sizeof *t, e))
		goto out;
	for (size_t k = 0; k < p->base.views; k++) {
		float *x;

		if (ct_alloc(&x, h * w, CT_RESIDUAL_PLANES * sizeof *x, e))
			goto out;
		planes_of(x, p, k, max, r->missing, &f, t);
		if (ct_pictures_add(to, CT_RESIDUAL_PLANES, h, w, x, p->name, e))
			goto out;
	}
	rc = 0;
out:
	free(t);
	ct_residual_frame_free(&f);
	return rc;
}

int train_pairs_pictures(struct ct_pictures *to, const struct train_pairs *s,
	const struct ct_residual *r, struct ct_err *e)
{
	for (size_t i = 0; i < s->n; i++)
		if (add_pair(to, &s->pair[i], r, e))
			return -1;
	return 0;
}

/* Of the views that are drawn: the energy of what is missing, that of what is expected, and what
 * both share. */
struct share {
	double lack, told, both;
};

static int share_of(struct share *s, const struct ct_prior *prior, const struct train_pair *p,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_denoiser net = ct_prior_denoiser(prior);
	const struct ct_residual *r = &prior->residual;
	struct ct_superres how = ct_superres_default(r->factor);
	struct ct_stack out = {0};
	const size_t n = p->base.h * p->base.w;
	bool *done = NULL;
	int rc = -1;

	how.how = ct_sampler_default(CT_SAMPLER_DDNM);
	how.steps = 1;
	how.start = CT_TIMESTEPS - 1;
	*s = (struct share){0};
	if (ct_stack_like(&out, &p->base, 1, e) || ct_alloc(&done, p->base.views, sizeof *done, e))
		goto out;
	for (size_t k = 0; k < p->base.views; k++)
		done[k] = k % EVERY != 0;
	if (ct_residual_draw(r, 1, &how, &net, &p->base, &out, NULL, done, env, e))
		goto out;
	for (size_t k = 0; k < p->base.views; k += EVERY)
		for (size_t i = k * n; i < (k + 1) * n; i++) {
			const double told = (double)out.data[i] - (double)p->base.data[i],
				     lack = (double)p->truth.data[i] - (double)p->base.data[i];

			s->told += told * told;
			s->both += told * lack;
			s->lack += lack * lack;
		}
	rc = 0;
out:
	ct_stack_free(&out);
	free(done);
	return rc;
}

static int plan(struct ct_prior *prior, const struct train_pair *p, const struct ct_env *env,
	struct ct_err *e)
{
	const struct ct_superres how = ct_superres_default(prior->residual.factor);
	size_t high, wide;

	ct_superres_size(
		&how, prior->multiple, p->base.h / how.scale, p->base.w / how.scale, &high, &wide);
	return high == prior->high && wide == prior->wide
		       ? 0
		       : ct_prior_plan(prior, ct_par_threads(env->par), high, wide, false, e);
}

int train_pairs_weigh(struct ct_residual *r, const struct train_pairs *s,
	struct ct_tensors *weights, const struct ct_env *env, struct ct_err *e)
{
	struct ct_prior prior = {0};
	struct ct_env quiet = {.par = env->par, .stop = env->stop, .seed = env->seed};
	int rc = ct_prior_alloc(&prior, weights, e);

	r->sampled = r->aliased = 1;
	for (size_t i = 0; rc == 0 && i < s->n; i++) {
		const struct train_pair *p = &s->pair[i];
		double best, part, *least;
		struct share share = {0};
		bool aliases;

		rc = plan(&prior, p, env, e) || share_of(&share, &prior, p, &quiet, e) ||
				     ct_degrade_aliases(&aliases, &p->base.meta, e)
			     ? ct_blame(e, p->name)
			     : 0;
		if (rc)
			break;
		best = share.told > 0 ? share.both / share.told : 0;
		part = best * share.both / share.lack;
		least = aliases ? &r->aliased : &r->sampled;
		*least = part < LEAST_GAIN ? 0 : fmax(0, fmin(*least, best));
		ct_log(env, CT_INFO,
			"%s: %.4f octaves missing, best weight %.3f, which takes off %.3f %%",
			basename(p->name), p->lack / p->octave, best, 100 * part);
	}
	if (rc == 0)
		ct_log(env, CT_INFO, "weight %.3f of scans that are well sampled, %.3f of others",
			r->sampled, r->aliased);
	ct_prior_free(&prior);
	return rc;
}
