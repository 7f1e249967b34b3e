/* step-fuse.c: see step-fuse.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "steps/step-fuse.h"
#include "core/meta.h"
#include "operator/regrid.h"
#include "xray/window.h"

#include <string.h>

static int turn(struct ct_step_fuse *p, struct ct_err *e)
{
	struct ct_evidence *d = p->of;
	bool turned = false;

	ct_vol_axes(&d->base, p->axis, p->sign);
	for (int a = 0; a < 3; a++)
		turned |= p->axis[a] != a || p->sign[a] < 0;
	for (int a = 0; a < 3; a++) {
		p->back[p->axis[a]] = a;
		p->back_sign[p->axis[a]] = p->sign[a];
	}
	p->turned = turned && !ct_meta_get(&d->lr.meta, CT_META_FIRST);
	if (!p->turned)
		return 0;
	ct_degrade_turn(&d->by, p->axis);
	return ct_err_any(ct_regrid_turn(&d->base, p->axis, p->sign, e) ||
			  ct_regrid_turn(&d->lr, p->axis, p->sign, e));
}

int ct_step_fuse_plan(struct ct_step_fuse *p, const struct ct_step_fuse_rule *r,
	struct ct_evidence *d, struct ct_err *e)
{
	if (!(r->lambda >= 0) || r->iterations < 1 || r->checkpoint_every < 0)
		return ct_fail(e, CT_EUSAGE,
			"a weight not below 0, at least 1 iteration and a state every 0 or more are "
			"expected");
	*p = (struct ct_step_fuse){.rule = *r, .of = d};
	return turn(p, e);
}

int ct_step_fuse_begin(
	struct ct_fuse *f, const struct ct_step_fuse *p, const struct ct_env *env, struct ct_err *e)
{
	struct ct_evidence *d = p->of;

	f->base = &d->base;
	f->lack = &d->lr;
	f->by = d->by;
	f->y = &d->in;
	f->gap = &d->base_proj;
	f->weight = &d->weight;
	f->window[0] = d->window[0];
	f->window[1] = d->window[1];
	f->lambda = p->rule.lambda;
	f->iterations = (size_t)p->rule.iterations;
	f->joint.rule.every = (size_t)p->rule.checkpoint_every;
	return ct_fuse_alloc(f, env, e);
}

int ct_step_fuse_run(struct ct_fuse *f, struct ct_fuse_report *report, struct ct_err *e)
{
	if (ct_fuse_run(f, report, e))
		return -1;
	if (report->verdict == CT_FUSE_DISTRUST)
		ct_log(f->env, CT_WARN,
			"projections do not predict each other: the base stays as it is "
			"(--expert lambda-projections=W insists)");
	return 0;
}

int ct_step_fuse_compose(struct ct_vol *added, const struct ct_fuse *f,
	const struct ct_step_fuse *p, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_evidence *d = p->of;
	struct ct_vol *base = &p->of->base;

	if (ct_vol_like(added, base, e) || ct_meta_copy(&added->meta, &base->meta, e))
		return -1;
	memcpy(added->data, f->residual, ct_vol_count(base) * sizeof *added->data);
	if (p->turned && (ct_regrid_turn(added, p->back, p->back_sign, e) ||
				 ct_regrid_turn(base, p->back, p->back_sign, e)))
		return -1;
	if (ct_window_put(&added->meta, d->window, e) ||
		ct_meta_set(&added->meta, CT_META_QUANTITY, CT_QUANTITY_RESIDUAL, e))
		return -1;
	ct_window_rule_warn(base, d->is.base, d->window, env);
	ct_window_add(ct_vol_count(base), base->data, added->data, 1, d->window[0], d->window);
	return 0;
}
