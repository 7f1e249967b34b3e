/* ct-fdk: a volume from projections: filtered back-projection, or iteration.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/cli.h"
#include "cli/cost-report.h"
#include "cli/keep.h"
#include "formats/format.h"
#include "recon/centre.h"
#include "steps/step-reconstruct.h"
#include "tools/lib/geometry-opts.h"
#include "xray/project.h"

struct params {
	const char *out, *grid, *window;
	struct ct_step_reconstruct_rule rule;
	int quantity;
	bool find_centre;
};

#define QUANTITIES(X)                                                                              \
	X(HU, CT_QUANTITY_HU)                                                                      \
	X(DENSITY, CT_QUANTITY_DENSITY)
enum quantity { QUANTITIES(CT_WORD_VALUE) };

static const struct params defaults = {.rule = CT_STEP_RECONSTRUCT_DEFAULTS};

#define CT_PARAMS struct params
static const struct ct_opt opts[] = {
	CT_ARG(rule.name, CT_READS, "IN", "projections, EXR, or -"),
	CT_ARG_OUT(out, CT_WRITES, "OUT", CT_ENDS_VOLUME, "the volume, NIfTI, or -"),
	CT_CHOICE(rule.method, 'm', "method",
		CT_WORDS_TWO(CT_STEP_RECONSTRUCT_METHODS, CT_SOLVER_LIST),
		"how: fdk for a cone or a fan, fbp for parallel rays, either by auto; or iterate, "
		"for any geometry"),
	CT_INPUT(grid, 0, "grid", "N|FILE",
		"N voxels along the longest side of the region, or the grid of this volume (that "
		"of the projected volume, or the cube that all views see)"),
	CT_CHOICE(rule.filter, 0, "filter", CT_WORDS(CT_RAMP_LIST),
		"window of the ramp filter; none "
		"leaves the ramp out too, and needs --quantity density",
		CT_WHEN(CT_IF_WORD(rule.method, CT_STEP_RECONSTRUCT_FILTERS))),
	CT_EXPERT(rule.how.cutoff, "cutoff", "X", 0, 1,
		"end of the filter, as a part of the highest frequency of the detector; 0 stands "
		"for that of the voxels",
		CT_WHEN(CT_IF_WORD(rule.method, CT_STEP_RECONSTRUCT_FILTERS),
			CT_UNLESS_WORD(rule.filter, CT_BIT(CT_RAMP_NONE)))),
	CT_FLAG(rule.how.parker, 0, "parker",
		"weigh the rays of a short scan so that those seen twice count once; a full turn "
		"needs none",
		CT_WHEN(CT_IF_WORD(rule.method, CT_STEP_RECONSTRUCT_FILTERS))),
	CT_FLAG(find_centre, 0, "find-centre",
		"find where the axis is on the detector, and move it there; --verbose prints it"),
	CT_OPT(rule.iterations, 'n', "iterations", "N", 0, 1000000,
		"at most so many iterations; 0 stands for 30 of cgls, 100 of sirt and tv",
		CT_WHEN(CT_IF_WORD(rule.method, CT_STEP_RECONSTRUCT_ITERATES))),
	CT_EXPERT_CHOICE(rule.how.projector, "projector", CT_WORDS(CT_METHOD_LIST),
		"voxels as boxes, or linear between their centres",
		CT_WHEN(CT_IF_WORD(rule.method, CT_STEP_RECONSTRUCT_ITERATES))),
	CT_EXPERT(rule.how.rule.tolerance, "tolerance", "X", 0, 1,
		"stop when the residual |A x - b| / |b| is below",
		CT_WHEN(CT_IF_WORD(rule.method, CT_STEP_RECONSTRUCT_ITERATES))),
	CT_FLAG(rule.how.rule.nonnegative, 0, "nonnegative", "no density below 0",
		CT_WHEN(CT_IF_WORD(rule.method,
			CT_STEP_RECONSTRUCT_SOLVER(CT_SIRT) | CT_STEP_RECONSTRUCT_SOLVER(CT_TV)))),
	CT_OPT(rule.tv, 0, "tv", "HU", 0, 1e6, "weight of the total variation",
		CT_WHEN(CT_IF_WORD(rule.method, CT_STEP_RECONSTRUCT_SOLVER(CT_TV)))),
	CT_TEXT(window, 'w', "window", "LO:HI", "HU of density 0 and 1 (from IN, else -1024:3071)"),
	CT_CHOICE(quantity, 0, "quantity", CT_WORDS(QUANTITIES), "what OUT holds"),
	CT_OPT_END,
};

/* The projections, and what the options ask for. */
static int read_all(struct ct_stack *in, struct ct_vol *like, struct ct_step_reconstruct_rule *r,
	const struct params *p, struct ct_err *e)
{
	*r = p->rule;
	r->density = p->quantity == DENSITY;
	r->like = p->grid;
	return ct_err_any(ct_stack_read(r->name, in, e) ||
			  ct_geometry_opts_asked(&r->window, p->window, e) ||
			  ct_geometry_opts_grid(&r->voxels, like, p->grid, e));
}

static int centre(struct ct_stack *in, const char *name, const struct ct_env *env, struct ct_err *e)
{
	double columns;

	if (ct_centre_find(&columns, in, env, e) && ct_blame(e, "--find-centre"))
		return ct_blame(e, name);
	ct_centre_shift(in, columns);
	ct_log(env, CT_INFO, "%s: the detector is moved by %.3f columns along u", name, columns);
	return 0;
}

static int keep(struct ct_vol *out, const struct ct_stack *in, const char *path,
	const struct ct_env *env, struct ct_err *e)
{
	return ct_err_any(
		ct_meta_step(&out->meta, env, 1, (const struct ct_meta *const[]){&in->meta}, e) ||
		ct_keep_vol(path, out, env, e));
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;
	struct ct_step_reconstruct_rule rule;
	struct ct_step_reconstruct_report did = {0};
	struct ct_step_reconstruct plan = {0};
	struct ct_stack in = {0};
	struct ct_vol like = {0}, out = {0};
	struct ct_cost cost;
	int rc = read_all(&in, &like, &rule, p, e) ||
		 (p->find_centre && centre(&in, rule.name, env, e)) ||
		 ct_step_reconstruct_plan(&plan, &rule, &in, like.data ? &like : NULL, e);

	ct_vol_free(&like);
	if (rc == 0 && env->command->dry_run) {
		rc = ct_reconstruct_cost(&cost, &plan.grid, &in, &plan.how, env, e);
		if (rc && e->code != CT_ESTOP)
			ct_blame(e, rule.name);
		rc = rc || ct_cost_print(&cost, env, e);
	} else if (rc == 0)
		rc = ct_step_reconstruct_run(&out, &did, &plan, env, e) ||
		     keep(&out, &in, p->out, env, e);
	if (rc == 0 && did.solver.iterations)
		ct_log(env, CT_INFO, "%zu iterations, residual %.5f", did.solver.iterations,
			did.solver.residual);
	ct_stack_free(&in);
	ct_vol_free(&out);
	return rc ? -1 : 0;
}

CT_CLI_MAIN("ct-fdk", "Reconstruct a volume from projections.", CT_LONG)
