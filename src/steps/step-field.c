/* step-field.c: see step-field.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "steps/evidence.h"
#include "steps/step-field.h"
#include "steps/step-reconstruct.h"
#include "xray/window.h"

#include <string.h>

/* Do the boxes along the world's axes meet? A field says nothing of what lies beyond IN. */
static int meet(const struct ct_vol *a, const struct ct_vol *b, struct ct_err *e)
{
	for (int c = 0; c < 3; c++) {
		double lo[2] = {(double)INFINITY, (double)INFINITY},
		       hi[2] = {-(double)INFINITY, -(double)INFINITY}, x[3];

		for (unsigned k = 0; k < 16; k++) {
			ct_vol_corner(k < 8 ? a : b, k % 8, x);
			lo[k / 8] = fmin(lo[k / 8], x[c]);
			hi[k / 8] = fmax(hi[k / 8], x[c]);
		}
		if (!(lo[0] < hi[1] && lo[1] < hi[0]))
			return ct_fail(e, CT_EGEOM,
				"lies beside IN along axis %d: from %g to %g mm, IN from %g to %g mm",
				c, lo[0], hi[0], lo[1], hi[1]);
	}
	return 0;
}

/* The CT refined, and where it is to be known. */
static int find_grids(struct ct_step_field *p, const struct ct_step_field_data *d,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_said said = CT_SAID_NOTHING;
	const struct ct_vol *lr = d->lr;

	memcpy(said.factor, p->rule.factor, sizeof said.factor);
	if (ct_operator_find(&p->scan, &said, false, lr, env, e))
		return ct_blame(e, p->rule.in);
	for (int a = 0; a < 3; a++)
		p->fine.n[a] = ct_degrade_cover(lr->n[a], p->scan.operator.factor[a]);
	ct_degrade_refine(
		p->fine.affine, (const double(*)[4])lr->affine, lr->n, p->scan.operator.factor);
	p->grid = p->fine;
	if (!d->like)
		return 0;
	memcpy(p->grid.n, d->like->n, sizeof p->grid.n);
	memcpy(p->grid.affine, d->like->affine, sizeof p->grid.affine);
	return ct_vol_check_grid(&p->grid, e) || meet(&p->grid, lr, e) ? ct_blame(e, p->rule.grid)
								       : 0;
}

static int plan_volume(struct ct_step_field *p, const struct ct_step_field_data *d,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_vol *v = d->lr;

	if (ct_evidence_volume(v, p->rule.in, e) ||
		ct_window_rule_choose(p->window, &p->rule.window, &v->meta, e) ||
		find_grids(p, d, env, e))
		return -1;
	ct_window_density_open(ct_vol_count(v), v->data, v->data, p->window);
	return 0;
}

static int plan_rays(struct ct_step_field *p, const struct ct_step_field_data *d, struct ct_err *e)
{
	const struct ct_step_field_rule *r = &p->rule;

	if (r->factor[0] > 0)
		return ct_fail(
			e, CT_EUSAGE, "--factor: %s is a stack, whose grid --grid says", r->in);
	if (ct_evidence_rays(d->rays, r->in, CT_QUANTITY_LINE_INTEGRAL, e) ||
		ct_window_rule_choose(p->window, &r->window, &d->rays->meta, e) ||
		ct_step_reconstruct_grid(&p->fine, d->like, r->grid, (size_t)r->voxels, d->rays, e))
		return -1;
	p->grid = p->fine;
	return 0;
}

static void take_experts(struct ct_field_rule *to, const struct ct_step_field_rule *r, size_t side)
{
	struct ct_network *net = &to->shape.network;

	to->every = (size_t)r->checkpoint_every;
	if (r->batch)
		to->batch = (size_t)r->batch;
	if (r->count)
		to->samples.n = (size_t)r->count;
	if (r->fine && to->samples.fine)
		to->samples.fine = (size_t)r->fine;
	if (r->levels == 0)
		ct_field_rule_levels(to, side);
	else if (to->shape.encoding.kind != CT_ENCODING_FREQUENCIES)
		to->shape.encoding.levels = (size_t)r->levels;
	if (!isnan(r->rate)) {
		to->rate[1] *= r->rate / to->rate[0];
		to->rate[0] = r->rate;
	}
	if (r->skip == CT_STEP_FIELD_CONCATENATE && net->depth > 1)
		net->depth--;
}

/* Published settings, and what is said in their place, but for what the data decide. */
static void take_rule(
	struct ct_field_rule *to, const struct ct_step_field_rule *r, const struct ct_stack *rays)
{
	ct_field_rule_like(to, (enum ct_field_like)r->like, rays ? rays->views + !rays->views : 0);
	if (r->samples)
		ct_field_rule_samples(to, (enum ct_samples_kind)(r->samples - 1));
	if (r->encoding)
		ct_field_rule_encoding(to, (enum ct_encoding_kind)(r->encoding - 1));
	if (r->depth)
		ct_field_rule_network(to, r->depth, r->width);
	if (r->loss != CT_STEP_FIELD_AS_LIKE) {
		to->adaptive = r->loss == CT_STEP_FIELD_ADAPTIVE;
		to->tv = r->loss == CT_STEP_FIELD_TV ? r->tv : 0;
	}
	if (r->iterations || r->seconds > 0) {
		to->iterations = r->iterations;
		if (!r->iterations)
			to->seconds = r->seconds;
	}
}

/* Keys of --expert that would do nothing, or harm. */
static int check_experts(
	const struct ct_step_field_rule *r, const struct ct_field_rule *how, struct ct_err *e)
{
	const enum ct_samples_kind kind = how->samples.kind;
	const bool one = kind == CT_SAMPLES_POINTS || kind == CT_SAMPLES_PROFILE;

	if ((r->count && one) || (r->fine && !how->samples.fine))
		return ct_fail(e, CT_EUSAGE, "--expert %s: not with --samples %s",
			r->count && one ? "count" : "fine", CT_WORD(CT_SAMPLES_LIST, kind));
	if (r->levels && how->shape.encoding.kind == CT_ENCODING_FREQUENCIES)
		return ct_fail(e, CT_EUSAGE, "--expert levels: not with --encoding frequencies");
	return r->skip == CT_STEP_FIELD_CONCATENATE && !how->shape.network.skip
		       ? ct_fail(e, CT_EUSAGE, "--expert at-skip: this network has no skip")
		       : 0;
}

/* What the data have to be. */
static int check_kind(const struct ct_step_field *p, bool stack, struct ct_err *e)
{
	const enum ct_samples_kind kind = p->how.samples.kind;

	if (stack && kind != CT_SAMPLES_RAYS)
		return ct_fail(e, CT_EINPUT,
			"%s: a stack of projections, but samples '%s' need a CT", p->rule.in,
			CT_WORD(CT_SAMPLES_LIST, kind));
	if (!stack && kind == CT_SAMPLES_RAYS)
		return ct_fail(e, CT_EINPUT,
			"%s: not a stack of projections (EXR), which samples 'rays' need",
			p->rule.in);
	return 0;
}

/* Voxels across what is fitted: of the scan, or of the grid that its operator begins from. */
static size_t side_of(const struct ct_step_field *p, const struct ct_vol *lr)
{
	const bool fine = p->how.samples.kind == CT_SAMPLES_PROFILE || !lr;
	const size_t *n = fine ? p->fine.n : lr->n;
	size_t most = n[0];

	for (int a = 1; a < 3; a++)
		most = n[a] > most ? n[a] : most;
	return most;
}

int ct_step_field_plan(struct ct_step_field *p, const struct ct_step_field_rule *r,
	const struct ct_step_field_data *d, const struct ct_env *env, struct ct_err *e)
{
	p->rule = *r;
	take_rule(&p->how, r, d->rays);
	if (check_kind(p, d->rays != NULL, e) || check_experts(r, &p->how, e) ||
		(d->rays ? plan_rays(p, d, e) : plan_volume(p, d, env, e)))
		return -1;
	take_experts(&p->how, r, side_of(p, d->lr));
	p->data.lr = d->lr;
	p->data.rays = d->rays;
	p->data.fine = &p->fine;
	p->data.by = &p->scan.operator;
	ct_field_data_box(&p->data, &p->fine);
	if (ct_field_rule_check(&p->how, e))
		return -1;
	return p->how.samples.kind != CT_SAMPLES_PROFILE || p->scan.known
		       ? 0
		       : ct_fail(e, CT_EINPUT,
				 "%s: does not say how it was made (key \"sigma\" of ct-degrade): "
				 "use --samples points",
				 r->in);
}

int ct_step_field_run(struct ct_field_fit *f, struct ct_step_field_report *r,
	const struct ct_step_field *p, const struct ct_env *env, struct ct_err *e)
{
	if (ct_field_fit_run(f, &p->data, env, e))
		return -1;
	if (r)
		*r = (struct ct_step_field_report){
			.weights = f->pass[0].field->count * ct_samples_passes(&f->rule.samples),
			.iterations = f->step,
			.first_loss = f->first,
			.last_loss = f->last};
	return 0;
}

int ct_step_field_volume(struct ct_vol *out, const struct ct_field_fit *f,
	const struct ct_step_field *p, const struct ct_env *env, struct ct_err *e)
{
	struct ct_err why;
	/* of another grid nobody knows what operator makes LR */
	const bool own = ct_vol_same_grid(&p->grid, &p->fine, &why) == 0;

	if (ct_vol_like(out, &p->grid, e) || ct_field_fit_volume(out, f, &p->data, env, e))
		return -1;
	for (size_t k = 0, n = ct_vol_count(out); k < n; k++)
		out->data[k] = out->data[k] < 0 ? 0 : out->data[k] > 1 ? 1 : out->data[k];
	if (p->data.rays)
		return ct_window_rule_reconstructed(out, p->data.rays, &p->rule.window, false, e);
	if (ct_meta_copy(&out->meta, &p->data.lr->meta, e))
		return -1;
	if (!own)
		ct_degrade_drop(&out->meta);
	return ct_err_any(
		ct_window_put(&out->meta, p->window, e) ||
		ct_window_volume(out, false, p->window, e) ||
		(own && p->scan.known && ct_degrade_put(&out->meta, &p->scan.operator, e)) ||
		ct_meta_set(&out->meta, CT_META_UPSAMPLE, "field", e));
}
