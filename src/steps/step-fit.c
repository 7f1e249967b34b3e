/* step-fit.c: see step-fit.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "steps/step-fit.h"
#include "xray/window.h"

#include <math.h>

#define USUAL 4095.0 /* HU of the window -1024:3071; what is wider has small numbers */
#define BEGINS 0.03  /* of a fit, where the Gaussians are placed */

/* The factor that the data say, else the one asked for, else 4. */
static int factor_of(size_t *factor, const struct ct_step_fit_rule *r, const struct ct_evidence *d,
	struct ct_err *e)
{
	struct ct_degrade by = {{4, 4, 4}, {0}, CT_DECIMATE_SINC, {0}};
	const char *who = d->is.base;
	int known = ct_degrade_get(&d->base.meta, &by, e);
	double most = 1;

	if (known > 0 && !ct_meta_get(&d->in.meta, CT_META_UPSAMPLE)) { /* which uses it up */
		who = d->is.in;
		known = ct_degrade_get(&d->in.meta, &by, e);
	}
	if (known < 0)
		return ct_blame(e, who);
	for (int a = 0; a < 3; a++)
		most = fmax(most, by.factor[a]);
	*factor = (size_t)(known > 0 && r->factor ? r->factor : lround(most));
	if (r->factor && (size_t)r->factor != *factor)
		return ct_fail(e, CT_EUSAGE, "%s %d contradicts %s, which was reduced %g times",
			r->factor_word, r->factor, who, most);
	return 0;
}

static int decide(struct ct_fit_options *o, const struct ct_step_fit_rule *r,
	const struct ct_evidence *d, struct ct_err *e)
{
	size_t factor = 0;

	if (factor_of(&factor, r, d, e))
		return -1;
	ct_fit_defaults(o, factor, r->mode == CT_STEP_FIT_FULL, (enum ct_activation)r->activation);
	if (r->paper || r->compat)
		ct_fit_paper(o);
	if (r->compat)
		ct_fit_compat(o);
	if (r->release)
		ct_fit_release(o, factor);
	if (!r->compat && !r->release) /* whose numbers are as their programs have them */
		o->one = fmin(1, USUAL / (d->window[1] - d->window[0]));
	o->iterations = (size_t)r->iterations;
	o->gaussians = (size_t)r->gaussians;
	o->max_gaussians = (size_t)r->max_gaussians;
	if (r->densify_until)
		o->densify_until = (size_t)r->densify_until;
	o->tv = r->tv;
	o->lr = d->is.lr ? r->lr : 0;
	o->checkpoint_every = (size_t)r->checkpoint_every;
	o->tolerance = r->tolerance;
	if (!isnan(r->ssim))
		o->ssim = r->ssim;
	if (!isnan(r->rate))
		o->rate_factor = r->rate;
	return 0;
}

/* What a CT lacks that is coarser than the base is no residual of the base. */
static void warn_coarser(const struct ct_evidence *d, const struct ct_env *env)
{
	const size_t *n = d->base.n;
	struct ct_err none;
	double of[3];

	if (ct_meta_numbers(&d->in.meta, CT_META_VOLUME_SIZE, 3, of, &none) == 0 &&
		of[0] * of[1] * of[2] < 0.5 * (double)(n[0] * n[1] * n[2]))
		ct_log(env, CT_WARN,
			"%s: is of a CT of %gx%gx%g voxels, and %s has %zux%zux%zu: what that CT "
			"lacks is taken for residual; project %s instead",
			d->is.in, of[0], of[1], of[2], d->is.base, n[0], n[1], n[2], d->is.base);
}

int ct_step_fit_plan(struct ct_step_fit *p, const struct ct_step_fit_rule *r,
	struct ct_evidence *data, const struct ct_env *env, struct ct_err *e)
{
	const bool full = r->mode == CT_STEP_FIT_FULL;
	const bool given = data->is.std && data->is.std != data->is.in,
		   published = r->paper || r->compat || r->release;

	if (data->in.beam == CT_FAN)
		return ct_fail(e, CT_EGEOM,
			"%s: Gaussians are projected in cone or parallel beam, not fan",
			data->is.in);
	if (r->release && given)
		return ct_fail(e, CT_EUSAGE,
			"%s: MS-SSIM, of the release, has no weights of pixels", data->is.std);
	if (!full && !published)
		warn_coarser(data, env);
	if (decide(&p->options, r, data, e) || ct_evidence_density(data, !full, env, e))
		return -1;
	p->of = data;
	p->mode = r->mode;
	p->data = (struct ct_fit_data){
		.target = &data->in,
		.base_projections = full ? NULL : &data->base_proj,
		.base = &data->base,
		.weight = given || (data->is.std && !published) ? &data->weight : NULL,
		.lr = data->is.lr ? &data->lr : NULL,
		.by = &data->by,
	};
	return 0;
}

int ct_step_fit_begin(
	struct ct_fit *f, const struct ct_step_fit *p, const struct ct_env *env, struct ct_err *e)
{
	struct ct_env_part part = {.env = env, .to = BEGINS};
	struct ct_env own;

	ct_env_part(&own, &part);
	return ct_fit_init(f, &p->options, &p->data, &own, e) ? ct_blame(e, p->of->is.base) : 0;
}

static int describe(
	struct ct_meta *m, const struct ct_step_fit *p, const struct ct_env *env, struct ct_err *e)
{
	ct_meta_free(m);
	return ct_err_any(
		ct_meta_copy(m, &p->of->in.meta, e) || ct_window_put(m, p->of->window, e) ||
		ct_meta_set(m, CT_META_QUANTITY,
			p->mode == CT_STEP_FIT_FULL ? CT_QUANTITY_DENSITY : CT_QUANTITY_RESIDUAL,
			e) ||
		ct_meta_set(m, CT_META_MODE, CT_WORD(CT_STEP_FIT_MODES, p->mode), e) ||
		ct_meta_setf(m, e, CT_META_SEED, "%llu", (unsigned long long)env->seed));
}

int ct_step_fit_run(struct ct_fit *f, struct ct_step_fit_report *r, const struct ct_step_fit *p,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_env_part part = {.env = env, .from = BEGINS, .to = 1};
	struct ct_env own;

	ct_env_part(&own, &part);
	if (ct_fit_run(f, &p->data, &own, e) || describe(&f->g.meta, p, env, e))
		return -1;
	if (f->end != CT_FIT_EMPTY && f->error > 1)
		ct_log(env, CT_WARN,
			"the error of the fit is %.3g times that without Gaussians: they explain "
			"nothing; do projections and base belong together?",
			f->error);
	if (!r)
		return 0;
	*r = (struct ct_step_fit_report){.gaussians = f->g.n,
		.iterations = f->g.step,
		.gamma = f->g.gamma,
		.first_loss = f->first_loss,
		.last_loss = f->last_loss,
		.error = f->error,
		.end = f->end};
	ct_fit_signs(&f->g, &r->positive, &r->negative);
	return 0;
}
