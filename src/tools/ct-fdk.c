/* ct-fdk: a volume from projections: filtered back-projection, or iteration. */
#include "config.h"
#include "cli/cli.h"
#include "cli/cost-report.h"
#include "cli/keep.h"
#include "formats/io.h"
#include "xray/project.h"
#include "xray/window.h"
#include "recon/scan-grid.h"
#include "recon/reconstruct.h"
#include "tools/lib/evidence-files.h"
#include "tools/lib/geometry-opts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct params {
	const char *in, *out, *grid, *window;
	struct ct_reconstruct_rule rule; /* what is not said below */
	int method, filter, quantity, iterations;
	double tv;
};

/* Behind these the methods that iterate: ITERATE + enum ct_solver. */
#define METHODS(X)                                                                                 \
	X(AUTO, "auto")                                                                            \
	X(FDK, "fdk")                                                                              \
	X(FBP, "fbp")
enum method { METHODS(CT_WORD_VALUE) ITERATE };
#define QUANTITIES(X)                                                                              \
	X(HU, CT_QUANTITY_HU)                                                                      \
	X(DENSITY, CT_QUANTITY_DENSITY)
enum quantity { QUANTITIES(CT_WORD_VALUE) };

#define FILTERS (CT_BIT(AUTO) | CT_BIT(FDK) | CT_BIT(FBP))
#define SOLVER(kind) CT_BIT(ITERATE + (kind))
#define ITERATES (SOLVER(CT_SIRT) | SOLVER(CT_CGLS) | SOLVER(CT_TV))

static const struct params defaults = {.tv = 10};

#define CT_PARAMS struct params
static const struct ct_opt opts[] = {
	CT_ARG(in, CT_READS, "IN", "projections, EXR, or -"),
	CT_ARG_OUT(out, CT_WRITES, "OUT", CT_ENDS_VOLUME, "the volume, NIfTI, or -"),
	CT_CHOICE(method, 'm', "method", CT_WORDS_TWO(METHODS, CT_SOLVER_LIST),
		"how: fdk for a cone or a fan, fbp for parallel rays, either by auto; or iterate, "
		"for any geometry"),
	CT_INPUT(grid, 0, "grid", "N|FILE",
		"N voxels along the longest side of the region, or the grid of this volume (that "
		"of the projected volume, or the cube that all views see)"),
	CT_CHOICE(filter, 0, "filter", CT_WORDS(CT_RAMP_LIST),
		"window of the ramp filter; none "
		"leaves the ramp out too, and needs --quantity density",
		CT_WHEN(CT_IF_WORD(method, FILTERS))),
	CT_EXPERT(rule.cutoff, "cutoff", "X", 0, 1,
		"end of the filter, as a part of the highest frequency of the detector; 0 stands "
		"for that of the voxels",
		CT_WHEN(CT_IF_WORD(method, FILTERS), CT_UNLESS_WORD(filter, CT_BIT(CT_RAMP_NONE)))),
	CT_FLAG(rule.parker, 0, "parker",
		"weigh the rays of a short scan so that those seen twice count once",
		CT_WHEN(CT_IF_WORD(method, FILTERS))),
	CT_OPT(iterations, 'n', "iterations", "N", 0, 1000000,
		"at most so many iterations; 0 stands for 30 of cgls, 100 of sirt and tv",
		CT_WHEN(CT_IF_WORD(method, ITERATES))),
	CT_EXPERT_CHOICE(rule.projector, "projector", CT_WORDS(CT_METHOD_LIST),
		"voxels as boxes, or linear between their centres",
		CT_WHEN(CT_IF_WORD(method, ITERATES))),
	CT_EXPERT(rule.rule.tolerance, "tolerance", "X", 0, 1,
		"stop when the residual |A x - b| / |b| is below",
		CT_WHEN(CT_IF_WORD(method, ITERATES))),
	CT_FLAG(rule.rule.nonnegative, 0, "nonnegative", "no density below 0",
		CT_WHEN(CT_IF_WORD(method, SOLVER(CT_SIRT) | SOLVER(CT_TV)))),
	CT_OPT(tv, 0, "tv", "HU", 0, 1e6, "weight of the total variation",
		CT_WHEN(CT_IF_WORD(method, SOLVER(CT_TV)))),
	CT_TEXT(window, 'w', "window", "LO:HI",
		"HU of density 0 and 1 (what IN says, or -1024:3071)"),
	CT_CHOICE(quantity, 0, "quantity", CT_WORDS(QUANTITIES), "what OUT holds"),
	CT_OPT_END,
};

static int check_options(const struct params *p, const struct ct_stack *in, struct ct_err *e)
{
	const char *had = ct_meta_get(&in->meta, CT_META_QUANTITY);
	bool parallel = in->beam == CT_PARALLEL;

	if (had && strcmp(had, CT_QUANTITY_LINE_INTEGRAL) != 0 &&
		strcmp(had, CT_QUANTITY_RESIDUAL) != 0)
		return ct_fail(e, CT_EINPUT, "%s: quantity is %.40s, not lineIntegral", p->in, had);
	if ((p->method == FDK || p->method == FBP) && parallel != (p->method == FBP))
		return ct_fail(e, CT_EUSAGE, "-m %s, but %s has a %s beam",
			CT_WORD(METHODS, p->method), p->in, CT_WORD(CT_BEAM_LIST, in->beam));
	if (p->filter == CT_RAMP_NONE && p->quantity == HU)
		return ct_fail(e, CT_EUSAGE,
			"--filter none gives no density, so no HU: add --quantity density");
	return 0;
}

/* The rule of the options. mu of TV is in HU, densities are not. */
static int choose(struct ct_reconstruct_rule *how, const struct params *p,
	const struct ct_stack *in, struct ct_err *e)
{
	static const size_t iterations[] = {[CT_SIRT] = 100, [CT_CGLS] = 30, [CT_TV] = 100};
	double window[2];

	if (ct_geometry_opts_window(window, p->window, &in->meta, e))
		return -1;
	*how = p->rule;
	how->iterate = p->method >= ITERATE;
	how->filter = (enum ct_ramp_kind)p->filter;
	if (!how->iterate)
		return 0;
	how->rule.solver = (enum ct_solver)(p->method - ITERATE);
	how->rule.iterations = (size_t)p->iterations;
	how->rule.mu = p->tv / (window[1] - window[0]);
	if (p->iterations == 0)
		how->rule.iterations = iterations[how->rule.solver];
	return 0;
}

static int reconstruct(struct ct_vol *out, const struct ct_vol *grid, const struct ct_stack *in,
	const struct ct_reconstruct_rule *how, const struct ct_env *env, struct ct_err *e)
{
	if (ct_vol_like(out, grid, e))
		return -1;
	memset(out->data, 0, ct_vol_count(out) * sizeof *out->data);
	return ct_reconstruct(out, in, how, env, e);
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;
	struct ct_stack in = {0};
	struct ct_vol grid = {0}, out = {0};
	struct ct_reconstruct_rule how;
	struct ct_cost cost;
	int rc = -1;

	if (ct_evidence_files_stack(&in, p->in, NULL, e) || check_options(p, &in, e) ||
		choose(&how, p, &in, e) || ct_geometry_opts_grid(&grid, p->grid, &in, e))
		goto out;
	if (env->command->dry_run ? ct_reconstruct_cost(&cost, &grid, &in, &how, env, e) ||
					    ct_cost_print(&cost, env, e)
				  : reconstruct(&out, &grid, &in, &how, env, e)) {
		if (e->code != CT_ESTOP)
			ct_blame(e, p->in);
		goto out;
	}
	rc = 0;
	if (!env->command->dry_run)
		rc = ct_geometry_opts_volume(&out, &in, p->window, p->quantity == DENSITY, e) ||
				     ct_meta_step(&out.meta, env, 1,
					     (const struct ct_meta *const[]){&in.meta}, e) ||
				     ct_keep_vol(p->out, &out, env, e)
			     ? -1
			     : 0;
out:
	ct_stack_free(&in);
	ct_vol_free(&out);
	return rc;
}

CT_CLI_MAIN("ct-fdk", "Reconstruct a volume from projections.", CT_LONG)
