/* fdk-solve.h: the methods of ct-fdk, and what they will cost. */
#ifndef CT_TOOLS_FDK_SOLVE_H
#define CT_TOOLS_FDK_SOLVE_H
#include "cli/cost.h"
#include "core/env.h"
#include "core/stack.h"
#include "core/vol.h"
#include "recon/ramp.h"
#include "recon/iterative.h"

struct fdk_how {
	bool iterate;
	enum ct_ramp_kind filter; /* if not */
	double cutoff;            /* 0: what the voxels can show */
	bool parker;
	int projector;                 /* else an enum ct_method, */
	struct ct_iterative_rule rule; /* and how */
};

/* Density into the zeroed out->data, on its grid, from the stack. Codes of ct_fdk_alloc or
 * ct_iterative_solve. */
int fdk_solve(struct ct_vol *out, const struct ct_stack *in, const struct fdk_how *how,
	const struct ct_env *env, struct ct_err *e);
/* What that takes, timed on a few views; grid has no data. */
int fdk_solve_cost(struct ct_cost *cost, const struct ct_vol *grid, const struct ct_stack *in,
	const struct fdk_how *how, const struct ct_env *env, struct ct_err *e);

#endif
