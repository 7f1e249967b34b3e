/* step-reconstruct.h: a volume of projections, by filtered back-projection or by iteration
 * (recon/reconstruct.h), all decisions once: method, window, grid, what the volume holds.
 *
 *     ct_step_reconstruct_plan, [ct_reconstruct_cost,] ct_step_reconstruct_run
 *
 * Line integrals, density mm. The same voxels for any number of threads.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_STEPS_STEP_RECONSTRUCT_H
#define CT_STEPS_STEP_RECONSTRUCT_H
#include "recon/reconstruct.h"
#include "steps/window-rule.h"

/* Behind these the methods that iterate: CT_STEP_RECONSTRUCT_ITERATE + enum ct_solver. */
#define CT_STEP_RECONSTRUCT_METHODS(X)                                                             \
	X(CT_STEP_RECONSTRUCT_AUTO, "auto")                                                        \
	X(CT_STEP_RECONSTRUCT_FDK, "fdk")                                                          \
	X(CT_STEP_RECONSTRUCT_FBP, "fbp")
enum ct_step_reconstruct_method {
	CT_STEP_RECONSTRUCT_METHODS(CT_WORD_VALUE) CT_STEP_RECONSTRUCT_ITERATE
};

/* Sets of them: those that filter, one that iterates, and all that iterate. */
#define CT_STEP_RECONSTRUCT_FILTERS (CT_BIT(CT_STEP_RECONSTRUCT_ITERATE) - 1)
#define CT_STEP_RECONSTRUCT_SOLVER(kind) CT_BIT(CT_STEP_RECONSTRUCT_ITERATE + (kind))
#define CT_STEP_RECONSTRUCT_ITERATES                                                               \
	(CT_STEP_RECONSTRUCT_SOLVER(CT_SIRT) | CT_STEP_RECONSTRUCT_SOLVER(CT_CGLS) |               \
		CT_STEP_RECONSTRUCT_SOLVER(CT_TV))

/* What is asked. */
struct ct_step_reconstruct_rule {
	const char *name, *like; /* of the projections, and of the volume whose grid is taken */
	struct ct_window_rule window;
	int method, filter; /* of their lists */
	int iterations;     /* at most; 0: 30 of CGLS, else 100 */
	int voxels;         /* along the longest side, without `like`; 0: as they were projected */
	double tv;          /* weight of the total variation, HU */
	bool density;       /* not HU */
	struct ct_reconstruct_rule how; /* cutoff, parker, projector, tolerance, nonnegative */
};
#define CT_STEP_RECONSTRUCT_DEFAULTS                                                               \
	{                                                                                          \
		.name = "projections", .like = "like", .tv = 10                                    \
	}

/* What was decided. */
struct ct_step_reconstruct {
	struct ct_step_reconstruct_rule rule;
	const struct ct_stack *in; /* borrowed */
	struct ct_vol grid;        /* size and affine, no data */
	struct ct_reconstruct_rule how;
};

/* *p (zeroed struct) <- how the volume is made, on the grid of `like`, or with NULL on that of
 * ct_scan_grid. CT_EINPUT for another quantity; CT_EUSAGE for a method or window that contradicts
 * the projections; CT_EGEOM; CT_ENUMERIC. */
int ct_step_reconstruct_plan(struct ct_step_reconstruct *p,
	const struct ct_step_reconstruct_rule *r, const struct ct_stack *in,
	const struct ct_vol *like, struct ct_err *e);
/* Size and affine into the zeroed *grid: of `like`, which must not lie beside the scan, or with
 * NULL those of ct_scan_grid. Errors name `like`, which `name` is. */
int ct_step_reconstruct_grid(struct ct_vol *grid, const struct ct_vol *like, const char *name,
	size_t voxels, const struct ct_stack *scan, struct ct_err *e);
/* What was done. */
struct ct_step_reconstruct_report {
	struct ct_iterative_report solver; /* zero of what does not iterate */
};

/* out (zeroed struct) <- the volume and its metadata; r may be NULL. Codes of ct_reconstruct,
 * naming the projections. */
int ct_step_reconstruct_run(struct ct_vol *out, struct ct_step_reconstruct_report *r,
	const struct ct_step_reconstruct *p, const struct ct_env *env, struct ct_err *e);

#endif
