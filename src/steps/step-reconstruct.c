/* step-reconstruct.c: see step-reconstruct.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "recon/scan-grid.h"
#include "steps/evidence.h"
#include "steps/step-reconstruct.h"
#include "xray/geometry.h"

#include <string.h>

static int check(
	const struct ct_step_reconstruct_rule *r, const struct ct_stack *in, struct ct_err *e)
{
	const char *had = ct_meta_get(&in->meta, CT_META_QUANTITY);
	const bool parallel = in->beam == CT_PARALLEL, fbp = r->method == CT_STEP_RECONSTRUCT_FBP;

	if (ct_evidence_rays(in, r->name, NULL, e))
		return -1;
	if (had && strcmp(had, CT_QUANTITY_LINE_INTEGRAL) != 0 &&
		strcmp(had, CT_QUANTITY_RESIDUAL) != 0)
		return ct_fail(
			e, CT_EINPUT, "%s: quantity is %.40s, not lineIntegral", r->name, had);
	if ((fbp || r->method == CT_STEP_RECONSTRUCT_FDK) && parallel != fbp)
		return ct_fail(e, CT_EUSAGE, "--method %s, but %s has a %s beam",
			CT_WORD(CT_STEP_RECONSTRUCT_METHODS, r->method), r->name,
			CT_WORD(CT_BEAM_LIST, in->beam));
	if (r->filter == CT_RAMP_NONE && !r->density)
		return ct_fail(e, CT_EUSAGE,
			"--filter none gives no density, so no HU: add --quantity density");
	return 0;
}

/* mu of TV is in HU, densities are not. */
static int choose(struct ct_step_reconstruct *p, struct ct_err *e)
{
	static const size_t iterations[] = {[CT_SIRT] = 100, [CT_CGLS] = 30, [CT_TV] = 100};
	const struct ct_step_reconstruct_rule *r = &p->rule;
	struct ct_iterative_rule *it = &p->how.rule;
	double window[2];

	if (ct_window_rule_choose(window, &r->window, &p->in->meta, e))
		return -1;
	p->how = r->how;
	p->how.iterate = r->method >= CT_STEP_RECONSTRUCT_ITERATE;
	p->how.filter = (enum ct_ramp_kind)r->filter;
	if (!p->how.iterate)
		return 0;
	it->solver = (enum ct_solver)(r->method - CT_STEP_RECONSTRUCT_ITERATE);
	it->iterations = r->iterations ? (size_t)r->iterations : iterations[it->solver];
	it->mu = r->tv / (window[1] - window[0]);
	return 0;
}

int ct_step_reconstruct_grid(struct ct_vol *grid, const struct ct_vol *like, const char *name,
	size_t voxels, const struct ct_stack *scan, struct ct_err *e)
{
	if (!like)
		return ct_scan_grid(grid, voxels, scan, e);
	memcpy(grid->n, like->n, sizeof like->n);
	memcpy(grid->affine, like->affine, sizeof like->affine);
	return ct_vol_check_grid(grid, e) || ct_geometry_seen(scan, grid, e) ? ct_blame(e, name)
									     : 0;
}

int ct_step_reconstruct_plan(struct ct_step_reconstruct *p,
	const struct ct_step_reconstruct_rule *r, const struct ct_stack *in,
	const struct ct_vol *like, struct ct_err *e)
{
	p->rule = *r;
	p->in = in;
	return ct_err_any(
		check(r, in, e) || choose(p, e) ||
		ct_step_reconstruct_grid(&p->grid, like, r->like, (size_t)r->voxels, in, e));
}

int ct_step_reconstruct_run(struct ct_vol *out, struct ct_step_reconstruct_report *r,
	const struct ct_step_reconstruct *p, const struct ct_env *env, struct ct_err *e)
{
	struct ct_step_reconstruct_report did;

	if (ct_vol_like(out, &p->grid, e))
		return -1;
	memset(out->data, 0, ct_vol_count(out) * sizeof *out->data);
	if (ct_reconstruct(out, &did.solver, p->in, &p->how, env, e))
		return e->code == CT_ESTOP ? -1 : ct_blame(e, p->rule.name);
	if (r)
		*r = did;
	return ct_window_rule_reconstructed(out, p->in, &p->rule.window, p->rule.density, e);
}
