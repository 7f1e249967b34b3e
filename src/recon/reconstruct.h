/* reconstruct.h: a volume of projections, by filtered backprojection or iterations, and what that
 * will cost. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_RECON_RECONSTRUCT_H
#define CT_RECON_RECONSTRUCT_H
#include "core/env.h"
#include "core/stack.h"
#include "core/vol.h"
#include "recon/ramp.h"
#include "recon/iterative.h"

struct ct_reconstruct_rule {
	bool iterate;
	enum ct_ramp_kind filter; /* if not */
	double cutoff;            /* 0: what the voxels can show */
	bool parker;
	int projector;                 /* else an enum ct_method, */
	struct ct_iterative_rule rule; /* and how */
};

/* Density into the zeroed out->data, on its grid, from the stack; *report is zero of what does not
 * iterate. Codes of ct_fdk_alloc or ct_iterative_solve. */
int ct_reconstruct(struct ct_vol *out, struct ct_iterative_report *report,
	const struct ct_stack *in, const struct ct_reconstruct_rule *how, const struct ct_env *env,
	struct ct_err *e);
/* What that takes, timed on a few views; grid has no data. */
int ct_reconstruct_cost(struct ct_cost *cost, const struct ct_vol *grid, const struct ct_stack *in,
	const struct ct_reconstruct_rule *how, const struct ct_env *env, struct ct_err *e);

#endif
