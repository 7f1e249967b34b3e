/* ctsr-reconstruct.c: volumes of projections. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "ctsr/ctsr-impl.h"
#include "steps/step-reconstruct.h"

#include <math.h>

void ctsr_reconstruct_options_init(ctsr_reconstruct_options *o, size_t size)
{
	const ctsr_reconstruct_options all = {
		.size = size, .tv = 10, .window = {(double)NAN, (double)NAN}};

	ctsr_give_defaults(o, size, &all, sizeof all);
}

/* As the option table of ct-fdk has it. */
static int check_members(const ctsr_reconstruct_options *o, int method, struct ct_err *e)
{
	const unsigned filters = CT_STEP_RECONSTRUCT_FILTERS,
		       iterates = CT_STEP_RECONSTRUCT_ITERATES,
		       tv = CT_STEP_RECONSTRUCT_SOLVER(CT_TV);
	const struct ctsr_member members[] = {{"filter", o->filter != NULL, filters},
		{"cutoff", o->cutoff > 0, filters}, {"parker", o->parker != 0, filters},
		{"iterations", o->iterations > 0, iterates},
		{"integral", o->integral != CTSR_SIDDON, iterates},
		{"tolerance", o->tolerance > 0, iterates},
		{"nonnegative", o->nonnegative != 0, tv | CT_STEP_RECONSTRUCT_SOLVER(CT_SIRT)},
		{"tv", o->tv != 10, tv}, {NULL, false, 0}};

	return ctsr_check_members(members, "method",
		CT_WORDS_TWO(CT_STEP_RECONSTRUCT_METHODS, CT_SOLVER_LIST), method, e);
}

/* Written so that NaN is refused where a number is needed. */
static int rule_of(
	struct ct_step_reconstruct_rule *r, const ctsr_reconstruct_options *o, struct ct_err *e)
{
	if (!(o->cutoff >= 0 && o->cutoff <= 1) || !(o->tolerance >= 0 && o->tolerance <= 1) ||
		!(o->tv >= 0 && o->tv <= 1e6) || o->iterations > 1000000 || o->voxels > 65536)
		return ct_fail(e, CT_EUSAGE,
			"a cutoff and a tolerance of 0 to 1, a variation of 0 to 1e6 HU, at most "
			"1e6 iterations and 65536 voxels are expected");
	if (o->integral < CTSR_SIDDON || o->integral > CTSR_JOSEPH)
		return ct_fail(e, CT_EUSAGE, "the integral %d is not one of 0 and 1", o->integral);
	*r = (struct ct_step_reconstruct_rule)CT_STEP_RECONSTRUCT_DEFAULTS;
	if (ctsr_take_word(&r->method, CT_WORDS_TWO(CT_STEP_RECONSTRUCT_METHODS, CT_SOLVER_LIST),
		    "method", o->method, e) ||
		ctsr_take_word(&r->filter, CT_WORDS(CT_RAMP_LIST), "filter", o->filter, e) ||
		check_members(o, r->method, e))
		return -1;
	if (o->cutoff > 0 && r->filter == CT_RAMP_NONE)
		return ct_fail(e, CT_EUSAGE, "cutoff: not with filter=none");
	r->iterations = (int)o->iterations;
	r->voxels = (int)o->voxels;
	r->tv = o->tv;
	r->density = o->density != 0;
	r->how.cutoff = o->cutoff;
	r->how.parker = o->parker != 0;
	r->how.projector = o->integral;
	r->how.rule.tolerance = o->tolerance;
	r->how.rule.nonnegative = o->nonnegative != 0;
	return ctsr_take_window(&r->window, o->window, e);
}

static int reconstruct(struct ct_vol *v, const ctsr_projections *p, const ctsr_volume *like,
	const ctsr_reconstruct_options *o, struct ctsr_call *k)
{
	const struct ct_meta *const from[] = {&p->s.meta};
	struct ct_step_reconstruct_rule rule;
	struct ct_step_reconstruct plan = {0};

	if (like && o->voxels)
		return ct_fail(&k->err, CT_EUSAGE, "voxels: not with like");
	return ct_err_any(
		rule_of(&rule, o, &k->err) ||
		ct_step_reconstruct_plan(&plan, &rule, &p->s, like ? &like->v : NULL, &k->err) ||
		ct_step_reconstruct_run(v, NULL, &plan, &k->env, &k->err) ||
		ctsr_note_history(k, &v->meta, 1, from));
}

static int call(struct ctsr_call *k, ctsr_volume **v, const ctsr_projections *p,
	const ctsr_volume *like, const ctsr_reconstruct_options *o, const ctsr_context *c)
{
	ctsr_reconstruct_options mine;

	ctsr_reconstruct_options_init(&mine, sizeof mine);
	return ct_err_any(ctsr_make_volume(k, v) || ctsr_call_begin(k, p, c) ||
			  ctsr_take_options(&mine, sizeof mine, o, &k->err) ||
			  reconstruct(&(*v)->v, p, like, &mine, k));
}

int ctsr_reconstruct(ctsr_volume **v, const ctsr_projections *p, const ctsr_volume *like,
	const ctsr_reconstruct_options *o, const ctsr_context *c, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);

	return ctsr_call_end(&k, call(&k, v, p, like, o, c), e);
}

int ctsr_fdk(ctsr_volume **v, const ctsr_projections *p, const ctsr_volume *like,
	const ctsr_context *c, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);

	return ctsr_call_end(&k, call(&k, v, p, like, NULL, c), e);
}
