/* ctsr-compose.c: a base and what was fitted to it make a CT.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "ctsr/ctsr-impl.h"
#include "steps/step-compose.h"

#include <math.h>

void ctsr_compose_options_init(ctsr_compose_options *o, size_t size)
{
	const ctsr_compose_options all = {.size = size,
		.gain = 1,
		.floor = (double)NAN,
		.spacing = (double)NAN,
		.window = {(double)NAN, (double)NAN}};

	ctsr_give_defaults(o, size, &all, sizeof all);
}

/* Written so that NaN stands for what is not asked. */
static int rule_of(struct ct_step_compose_rule *r, const ctsr_compose_options *o, struct ct_err *e)
{
	if (!(fabs(o->gain) <= 1e3) || fabs(o->floor) > 1e6 || o->spacing < 1e-3 ||
		o->spacing > 1e6)
		return ct_fail(e, CT_EUSAGE,
			"a gain of -1e3 to 1e3, a floor of -1e6 to 1e6 HU, a spacing of 1e-3 to "
			"1e6 mm are expected");
	*r = (struct ct_step_compose_rule)CT_STEP_COMPOSE_DEFAULTS;
	r->gain = o->gain;
	r->floor = o->floor;
	r->spacing = o->spacing;
	return ctsr_take_window(&r->window, o->window, e);
}

static int compose(struct ct_vol *out, struct ct_vol *added, const ctsr_volume *base,
	const ctsr_gaussians *g, const ctsr_compose_options *o, struct ctsr_call *k)
{
	const ctsr_volume *res = o->residual, *lr = o->lr;
	const struct ct_step_compose d = {.base = out,
		.gauss = g ? &g->g : NULL,
		.residual = res ? &res->v : NULL,
		.lr = lr ? &lr->v : NULL};
	const struct ct_meta *of = g ? &g->g.meta : res ? &res->v.meta : NULL;
	const struct ct_meta *const from[] = {&base->v.meta, of, lr ? &lr->v.meta : NULL};
	struct ct_step_compose_rule rule;
	struct ct_step_compose_report did;
	struct ct_err *e = &k->err;

	if (!g == !res)
		return ct_fail(e, CT_EUSAGE, "Gaussians or a residual are needed, and not both");
	return ct_err_any(rule_of(&rule, o, e) || ctsr_check_hu(base, rule.base, e) ||
			  (lr && ctsr_check_hu(lr, rule.lr, e)) || ctsr_copy_volume(out, base, e) ||
			  ct_step_compose_run(added, &did, &d, &rule, &k->env, e) ||
			  ctsr_note_history(k, &out->meta, 3, from) ||
			  ctsr_note_history(k, &added->meta, 1, from + 1));
}

int ctsr_compose(ctsr_volume **out, ctsr_volume **added, const ctsr_volume *base,
	const ctsr_gaussians *g, const ctsr_compose_options *o, const ctsr_context *c,
	ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	ctsr_compose_options mine;
	struct ct_vol own = {0};
	int rc = (added && ctsr_make_volume(&k, added)) || ctsr_make_volume(&k, out) ||
		 ctsr_call_begin(&k, base, c);

	ctsr_compose_options_init(&mine, sizeof mine);
	rc = rc || ctsr_take_options(&mine, sizeof mine, o, &k.err) ||
	     compose(&(*out)->v, added ? &(*added)->v : &own, base, g, &mine, &k);
	ct_vol_free(&own);
	return ctsr_call_end(&k, rc, e);
}
