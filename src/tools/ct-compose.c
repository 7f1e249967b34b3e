/* ct-compose: a base volume and a residual, of Gaussians or of voxels, make the final CT.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/cli.h"
#include "cli/keep.h"
#include "formats/any.h"
#include "formats/units.h"
#include "steps/step-compose.h"
#include "tools/lib/geometry-opts.h"

#include <math.h>

struct params {
	const char *out, *window, *res_out;
	struct ct_step_compose_rule rule;
};

static const struct params defaults = {
	.rule = {.floor = (double)NAN, .gain = 1, .spacing = (double)NAN}};

#define CT_PARAMS struct params
static const struct ct_opt opts[] = {
	CT_ARG(rule.base, CT_READS, "BASE", "CT in HU, NIfTI, or -"),
	CT_ARG(rule.residual, CT_READS, "RESIDUAL",
		"Gaussians, PLY or R2-Gaussian's pickle, or HU to add, NIfTI, or -"),
	CT_ARG_OUT(out, CT_WRITES, "OUT", CT_ENDS_VOLUME, "the CT in HU, NIfTI, or -"),
	CT_OPT(rule.floor, 0, "floor", "HU", -1e6, 1e6, "least value of OUT (LO of the window)"),
	CT_OPT(rule.gain, 'g', "gain", "X", -1e3, 1e3, "multiply the residual by this"),
	CT_OPT(rule.spacing, 's', "spacing", "MM", 1e-3, 1e6,
		"render on voxels of MM in the box of BASE, which is interpolated (its own grid)"),
	CT_TEXT(window, 'w', "window", "LO:HI",
		"HU of density 0 and 1 (-1024:3071, or what RESIDUAL or else BASE says)"),
	CT_INPUT(rule.lr, 0, "consistent", "LR",
		"change OUT as little as makes it agree with this low-resolution CT, NIfTI; it, or "
		"else BASE, says what operator made it"),
	CT_EXPERT(rule.gamma, "gamma", "X", 0, 1e3,
		"of a pickle of the paper's program, which does not keep it: PReLU's slope; 0: its "
		"densities are softplus, as R2-Gaussian's"),
	CT_OUTPUT(res_out, 0, "residual-out", "FILE", CT_ENDS_VOLUME,
		"write the residual too, in HU, before gain and floor"),
	CT_OPT_END,
};

struct compose_job {
	struct ct_vol base, lr, added;
	struct ct_any residual;
};

static int read_all(struct compose_job *j, const struct ct_step_compose_rule *r,
	const struct ct_env *env, struct ct_err *e)
{
	const enum ct_kind *kind = &j->residual.kind;

	if (ct_vol_read_hu(r->base, &j->base, env, e) || ct_any_read(r->residual, &j->residual, e))
		return -1;
	if (*kind != CT_KIND_GAUSS && *kind != CT_KIND_VOLUME)
		return ct_fail(e, CT_EINPUT, "%s: is %s, not Gaussians or a volume", r->residual,
			ct_kind_name(*kind));
	return r->lr ? ct_vol_read_hu(r->lr, &j->lr, env, e) : 0;
}

static int describe(struct compose_job *j, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_meta *in = ct_any_meta(&j->residual), *const all[] = {&j->base.meta, in,
								      &j->lr.meta};

	return ct_err_any(ct_meta_step(&j->base.meta, env, 3, all, e) ||
			  ct_meta_step(&j->added.meta, env, 1, &in, e));
}

static int compose(
	struct compose_job *j, const struct params *p, const struct ct_env *env, struct ct_err *e)
{
	struct ct_step_compose_rule rule = p->rule;
	struct ct_step_compose_report did;

	if (read_all(j, &rule, env, e) || ct_geometry_opts_asked(&rule.window, p->window, e))
		return -1;
	return ct_err_any(
		ct_step_compose_run(&j->added, &did,
			&(struct ct_step_compose){.base = &j->base,
				.gauss = j->residual.kind == CT_KIND_GAUSS ? &j->residual.gauss
									   : NULL,
				.residual = &j->residual.vol,
				.lr = rule.lr ? &j->lr : NULL},
			&rule, env, e) ||
		describe(j, env, e) ||
		ct_keep_vols(p->out, &j->base, p->res_out, &j->added, env, e));
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	struct compose_job j = {0};
	const int rc = compose(&j, params, env, e);

	ct_vol_free(&j.base);
	ct_vol_free(&j.lr);
	ct_vol_free(&j.added);
	ct_any_free(&j.residual);
	return rc;
}

CT_CLI_MAIN("ct-compose", "Add a residual, of Gaussians or voxels, to a CT.", CT_IN_HU)
