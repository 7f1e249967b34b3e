/* step-ddnm.c: see step-ddnm.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "inverse/upsample.h"
#include "steps/step-ddnm.h"
#include "core/mem.h"

#include <string.h>

/* Of a refined CT: the timestep whose noise, 1.4 % of the largest value, is about twice the error
 * of an inversion, and samples. */
enum { START = 5, SAMPLES = 4 };

/* Blur of the matched operator: that of the volume, seen on the detector at the isocentre. A
 * little less is assumed, since too much blur assumed costs more than too little; where no blur
 * is known, that of a quarter of a coarse voxel. */
static int blur_of(double *sigma, const struct ct_stack *in, size_t scale, struct ct_err *e)
{
	const struct ct_view *w = &in->view[0];
	const struct ct_meta *m = &in->meta;
	const char *up = ct_meta_get(m, CT_META_UPSAMPLE);
	double voxels[3] = {(double)scale / 4, 0, 0}, dso = 1, dsd = 1, a[12], mm = 0, pitch;
	double by[3] = {1, 1, 1};
	const int how = up ? ct_words_find(CT_WORDS(CT_UPSAMPLE_LIST), up) : 0;

	*sigma = 0;
	if (up && (how < 0 || how >= CT_UPSAMPLE_DC))
		return 0; /* the blur is undone, as by a prior */
	*sigma = 0.8 * (double)scale / 4;
	voxels[1] = voxels[2] = voxels[0];
	if (ct_meta_numbers(m, CT_META_SIGMA, 3, voxels, e) < 0 ||
		ct_meta_numbers(m, CT_META_FACTOR, 3, by, e) < 0 ||
		ct_meta_numbers(m, CT_META_SCAN_DSO, 1, &dso, e) < 0 ||
		ct_meta_numbers(m, CT_META_SCAN_DSD, 1, &dsd, e) < 0)
		return -1;
	switch (ct_meta_numbers(m, CT_META_VOLUME_AFFINE, 12, a, e)) {
	case 0: break;
	case 1: return 0;
	default: return -1;
	}
	for (int c = 0; c < 3; c++)
		mm += voxels[c] * hypot(hypot(a[c], a[c + 4]), a[c + 8]) / (up ? 3 : 3 * by[c]);
	pitch = hypot(hypot(w->u[0], w->u[1]), w->u[2]) / (double)scale;
	*sigma = 0.8 * mm * (in->beam == CT_PARALLEL ? 1 : dsd / dso) / pitch;
	return 0;
}

/* What the network sees as 1: what is asked for, or what suits the stack. */
static int norm_of(double *norm, double asked, const struct ct_stack *in, struct ct_err *e)
{
	const char *quantity = ct_meta_get(&in->meta, CT_META_QUANTITY);

	if (quantity && strcmp(quantity, CT_QUANTITY_LINE_INTEGRAL) != 0 &&
		strcmp(quantity, CT_QUANTITY_INTENSITY) != 0)
		return ct_fail(
			e, CT_EINPUT, "is a stack of %.40s, not of line integrals", quantity);
	*norm = asked;
	if (asked > 0)
		return 0;
	if (ct_superres_norm(in, norm, e))
		return -1;
	if (quantity && strcmp(quantity, CT_QUANTITY_INTENSITY) == 0)
		*norm = fmax(*norm, 1.0);
	return 0;
}

/* The factor of the volume that was seen, where the stack says no more: 0; 1 if it says none, or
 * one that a refined volume has used up; -1. */
static int factor_of(double *factor, const struct ct_step_ddnm_rule *r, const struct ct_stack *in,
	struct ct_err *e)
{
	double by[3];
	const int got = ct_meta_get(&in->meta, CT_META_UPSAMPLE)
				? 1
				: ct_meta_numbers(&in->meta, CT_META_FACTOR, 3, by, e);

	if (got)
		return got < 0 ? ct_blame(e, r->in) : got;
	if (by[0] != by[1] || by[0] != by[2]) /* the detector sees them mixed */
		return 1;
	*factor = by[0];
	return 0;
}

/* The most of the factors that the volume was refined by, up to the next whole number. */
static int refined_by(double *factor, const struct ct_step_ddnm_rule *r, const struct ct_stack *in,
	struct ct_err *e)
{
	double by[3];
	const int got = ct_meta_numbers(&in->meta, CT_META_FACTOR, 3, by, e);

	if (got)
		return got < 0 ? ct_blame(e, r->in) : got;
	*factor = ceil(fmax(fmax(by[0], by[1]), by[2]));
	return 0;
}

/* By how much it was coarsened: what the stack says; what is asked, or the network is for; else 4.
 */
static int scale_of(size_t *scale, bool refined, const struct ct_step_ddnm_rule *r,
	const struct ct_stack *in, const struct ct_prior *prior, struct ct_err *e)
{
	const int network = prior ? (int)prior->factor : 0;
	const int asked = r->factor ? r->factor : network;
	const char *key = CT_META_COARSEN;
	double coarsen = asked ? asked : 4;
	int got = ct_meta_numbers(&in->meta, key, 1, &coarsen, e);

	if (got < 0)
		return ct_blame(e, r->in);
	if (got > 0) {
		key = CT_META_FACTOR;
		got = refined ? refined_by(&coarsen, r, in, e) : factor_of(&coarsen, r, in, e);
	}
	if (got < 0)
		return -1;
	if (!(coarsen >= 2 && coarsen <= 64) || coarsen != floor(coarsen))
		return ct_fail(e, CT_EINPUT, "%s: %s is %g, not a whole number from 2 to 64", r->in,
			key, coarsen);
	if (asked && asked != (int)coarsen)
		return ct_fail(e, CT_EUSAGE, "--factor %d contradicts %s, whose %s is %g", asked,
			r->in, key, coarsen);
	*scale = (size_t)coarsen;
	return !network || network == (int)*scale
		       ? 0
		       : ct_fail(e, CT_EUSAGE,
				 "--factor %zu: the network of %s makes %d times finer", *scale,
				 r->prior, network);
}

/* Is the detector fine already, and is it not asked to make it finer still? */
static bool is_refined(
	const struct ct_stack *in, const struct ct_step_ddnm_rule *r, enum ct_sampler_rule rule)
{
	return !r->factor && rule != CT_SAMPLER_ONCE && ct_meta_get(&in->meta, CT_META_UPSAMPLE) &&
	       ct_meta_get(&in->meta, CT_META_FACTOR) && !ct_meta_get(&in->meta, CT_META_COARSEN);
}

/* What a pixel measures: what the stack says of its pixels; what is asked, or else *op, where it
 * says nothing, or that it was a ray, which neither of them is. */
static int operator_of(enum ct_measurement_kind *op, const struct ct_step_ddnm_rule *r,
	const struct ct_stack *in, struct ct_err *e)
{
	const char *pixel = ct_meta_get(&in->meta, CT_META_PIXEL);
	int known = pixel ? ct_words_find(CT_WORDS(CT_PIXEL_LIST), pixel) : CT_PIXEL_POINT;

	if (known < 0)
		return ct_fail(e, CT_EINPUT, "%s: %s is '%.40s', not one of %s", r->in,
			CT_META_PIXEL, pixel, CT_WORDS(CT_PIXEL_LIST));
	if (r->op >= 0)
		*op = (enum ct_measurement_kind)r->op;
	if (known == CT_PIXEL_POINT)
		return 0;
	if (r->op >= 0 && *op != ct_pixel_measures((enum ct_pixel)known))
		return ct_fail(e, CT_EUSAGE,
			"--expert operator: %s contradicts %s, whose pixels are %s",
			CT_WORD(CT_MEASUREMENT_LIST, *op), r->in, pixel);
	*op = ct_pixel_measures((enum ct_pixel)known);
	return 0;
}

/* The sampler is one for the network. */
static int check_sampler(
	const struct ct_prior *prior, const struct ct_step_ddnm_rule *r, struct ct_err *e)
{
	if (!prior->factor && r->sampler == CT_SAMPLER_ONCE)
		return ct_fail(e, CT_EUSAGE,
			"--sampler once: it is a diffusion prior, not a network of ct-train --kind superres");
	if (prior->factor && r->insists && r->sampler != CT_SAMPLER_ONCE)
		return ct_fail(e, CT_EUSAGE,
			"--sampler %s: it is a network of super-resolution, not a diffusion prior: "
			"give --sampler once",
			CT_WORD(CT_SAMPLER_LIST, r->sampler));
	return 0;
}

static int classify(struct ct_prior *prior, const struct ct_step_ddnm_rule *r, struct ct_err *e)
{
	const size_t n = prior->unet->arch.num_classes;

	if (r->label >= 0)
		return ct_prior_classify(prior, (size_t)r->label, e);
	return n ? ct_fail(e, CT_EUSAGE, "is conditioned on %zu classes: --class states one", n)
		 : 0;
}

int ct_step_ddnm_prior(struct ct_prior *prior, struct ct_tensors *w,
	const struct ct_step_ddnm_rule *r, struct ct_err *e)
{
	return ct_prior_alloc(prior, w, e) || check_sampler(prior, r, e) || classify(prior, r, e)
		       ? ct_blame(e, r->prior)
		       : 0;
}

/* The sampler, its settings, and how the stack was made. */
static int decide(struct ct_superres *s, const struct ct_step_ddnm_rule *r,
	const struct ct_stack *in, const struct ct_prior *prior, struct ct_err *e)
{
	enum ct_sampler_rule rule =
		prior && prior->factor ? CT_SAMPLER_ONCE : (enum ct_sampler_rule)r->sampler;
	const bool refined = is_refined(in, r, rule);
	enum ct_measurement_kind op = refined ? CT_MEASUREMENT_MATCHED : CT_MEASUREMENT_MEAN;
	size_t scale = 0;

	if (scale_of(&scale, refined, r, in, prior, e) ||
		(rule != CT_SAMPLER_ONCE && operator_of(&op, r, in, e)))
		return -1;
	if (r->start >= 0 && !r->init && !refined)
		return ct_fail(e, CT_EUSAGE, "%s: is not of a refined CT, so %s", r->in,
			"--expert t-start needs --init");
	if (refined && rule == CT_SAMPLER_PLUS && !r->insists)
		rule = CT_SAMPLER_DDNM; /* what they say is exact */
	*s = ct_superres_default(scale);
	s->refined = refined;
	s->how = ct_sampler_default(rule);
	s->steps = r->steps ? (size_t)r->steps : refined ? 1 : ct_sampler_steps(rule);
	s->samples = (size_t)(r->samples ? r->samples : refined ? SAMPLES : 1);
	s->start = r->start >= 0 ? r->start : refined && !r->init ? START : r->init ? 60 : -1;
	s->how.guidance = r->guidance;
	s->how.iterations = (size_t)r->iterations;
	s->how.rate = r->rate;
	s->how.frozen = r->frozen;
	s->op = op;
	s->first = r->first;
	s->range = (enum ct_superres_range)r->range;
	if (!isnan(r->eta))
		s->how.eta = r->eta;
	if (!isnan(r->sigma_y))
		s->how.sigma_y = r->sigma_y;
	if (refined)
		s->sigma_det = 0;
	else if (op == CT_MEASUREMENT_MATCHED && blur_of(&s->sigma_det, in, scale, e))
		return ct_blame(e, r->in);
	if (r->travel_length) {
		s->travel_length = r->travel_length;
		s->travel_repeat = r->travel_repeat;
	}
	if (rule != CT_SAMPLER_NONE && norm_of(&s->norm, r->norm, in, e))
		return ct_blame(e, r->in);
	return 0;
}

int ct_step_ddnm_plan(struct ct_step_ddnm *p, const struct ct_step_ddnm_rule *r,
	const struct ct_step_ddnm_data *d, struct ct_err *e)
{
	const struct ct_stack *in = d->in;
	const struct ct_prior *prior = r->sampler == CT_SAMPLER_NONE ? NULL : d->prior;
	double finer;

	*p = (struct ct_step_ddnm){.asks = prior != NULL};
	if (ct_stack_check(in, e) || ct_stack_check_finite(in, e))
		return ct_blame(e, r->in);
	if (decide(&p->s, r, in, prior, e))
		return -1;
	if (prior)
		ct_superres_size(&p->s, prior->multiple, in->h, in->w, &p->high, &p->wide);
	finer = p->s.refined ? 1 : (double)p->s.scale;
	if (ct_stack_like(d->out, in, finer, e) ||
		(d->std && p->s.samples > 1 && ct_stack_like(d->std, in, finer, e)))
		return ct_blame(e, r->in);
	if (d->init && (ct_stack_check_finite(d->init, e) || ct_stack_same(d->init, d->out, e)))
		return ct_blame(e, r->init);
	return 0;
}

int ct_step_ddnm_reserve(
	const struct ct_step_ddnm *p, struct ct_prior *prior, size_t workers, struct ct_err *e)
{
	const struct ct_sampler_how *how = &p->s.how;

	return p->asks ? ct_prior_plan(prior, workers, p->high, p->wide,
				 how->rule == CT_SAMPLER_BIRD && !how->frozen, e)
		       : 0;
}

/* The deviation travels with the views. */
static int attach(struct ct_stack *out, const struct ct_stack *std, struct ct_err *e)
{
	const size_t n = ct_stack_count(out);

	if (ct_alloc(&out->deviation, n, sizeof *out->deviation, e))
		return -1;
	memcpy(out->deviation, std->data, n * sizeof *out->deviation);
	return 0;
}

static int describe(const struct ct_step_ddnm *p, const struct ct_step_ddnm_data *d, uint64_t seed,
	struct ct_err *e)
{
	struct ct_meta *m = &d->out->meta;

	ct_meta_drop(m, CT_META_COARSEN);
	ct_meta_drop(m, CT_META_PIXEL);
	if ((p->asks && p->s.range == CT_SUPERRES_STACK &&
		    ct_meta_setf(m, e, CT_META_NORM, "%.9g", p->s.norm)) ||
		(p->asks && p->s.how.rule != CT_SAMPLER_ONCE &&
			(ct_meta_set(
				 m, CT_META_OPERATOR, CT_WORD(CT_MEASUREMENT_LIST, p->s.op), e) ||
				ct_meta_setf(
					m, e, CT_META_SEED, "%llu", (unsigned long long)seed))))
		return -1;
	if (!d->std || !d->std->data)
		return 0;
	ct_meta_free(&d->std->meta);
	return ct_err_any(attach(d->out, d->std, e) || ct_meta_copy(&d->std->meta, m, e) ||
			  ct_meta_set(&d->std->meta, CT_META_QUANTITY, CT_QUANTITY_DEVIATION, e));
}

int ct_step_ddnm_run(const struct ct_step_ddnm *p, const struct ct_step_ddnm_data *d, bool *done,
	int (*save)(void *ctx, bool last, struct ct_err *e), void *save_ctx,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_superres s = p->s;
	struct ct_denoiser net = {0};

	s.save = save;
	s.save_ctx = save_ctx;
	if (p->asks)
		net = ct_prior_denoiser(d->prior);
	return ct_err_any(ct_superres(&s, &net, d->in, d->init, d->out,
				  d->std && d->std->data ? d->std : NULL, done, env, e) ||
			  describe(p, d, env->seed, e));
}
