/* step-project.h: projections of a volume, all decisions once: what its values are, the window from
 * HU to density, overshoots, pixels that are means of smaller ones, photons (xray/project.h has the
 * integrals; the paper: the low-resolution projections are those of the volume on a detector that
 * is as much coarser).
 *
 * A rule says what is asked; the plan decides and holds density and detector; a pass makes views,
 * as many as its caller likes. HU, mm; projections are density mm. The same bytes for any number of
 * threads. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_STEPS_STEP_PROJECT_H
#define CT_STEPS_STEP_PROJECT_H
#include "diffusion/measurement.h"
#include "steps/window-rule.h"
#include "xray/photons.h"
#include "xray/project.h"

#define CT_STEP_PROJECT_QUANTITIES(X)                                                              \
	X(CT_STEP_PROJECT_SAYS, "file")                                                            \
	X(CT_STEP_PROJECT_HU, CT_QUANTITY_HU)                                                      \
	X(CT_STEP_PROJECT_DENSITY, CT_QUANTITY_DENSITY)
enum ct_step_project_quantity { CT_STEP_PROJECT_QUANTITIES(CT_WORD_VALUE) };

/* What is asked. */
struct ct_step_project_rule {
	const char *name; /* of the volume, for messages */
	struct ct_window_rule window;
	int quantity, method, pixel; /* of their lists */
	int coarsen;                 /* pixels so many times larger; 1: as they are */
	bool overshoot; /* what a volume that was clipped has beyond the window stays */
	double photons, electronic, water; /* photons.h; 0 photons: no noise */
};
#define CT_STEP_PROJECT_DEFAULTS                                                                   \
	{                                                                                          \
		.name = "volume", .coarsen = 1, .water = 0.02                                      \
	}

/* What was decided. */
struct ct_step_project {
	struct ct_step_project_rule rule;
	struct ct_vol *v;            /* density; borrowed */
	float *mu;                   /* its attenuation, 1/mm; NULL without noise */
	double unit;                 /* attenuation of a mm of density 1 */
	const struct ct_stack *rays; /* rays that are followed; their data are not used */
	struct ct_stack *out;        /* rays, or pixels of `coarsen` squared of them */
	struct ct_stack coarse;
	struct ct_photons how;
};

/* *p (zeroed struct) <- what is to be projected: v becomes density, in place, and `scan` is the
 * detector, which p borrows. A volume beside the scan is warned of. CT_EINPUT for a quantity that
 * is none of both; CT_EUSAGE for what contradicts the volume; CT_EGEOM; CT_ENUMERIC; CT_ENOMEM. */
int ct_step_project_plan(struct ct_step_project *p, const struct ct_step_project_rule *r,
	struct ct_vol *v, struct ct_stack *scan, const struct ct_env *env, struct ct_err *e);
/* All views, and their metadata. CT_ENOMEM, CT_ESTOP. */
int ct_step_project_run(
	const struct ct_step_project *p, const struct ct_env *env, struct ct_err *e);
void ct_step_project_free(struct ct_step_project *p);

/* What making views needs. */
struct ct_step_project_pass {
	const struct ct_step_project *of;
	struct ct_projector g; /* the volume is to be loaded into it */
	struct ct_measurement op;
	float *fine, *noise;
	double *scratch;
};
/* CT_EGEOM naming the volume, CT_ENOMEM; then close it. */
int ct_step_project_pass_open(
	struct ct_step_project_pass *s, const struct ct_step_project *p, struct ct_err *e);
/* View k of the volume that is loaded. */
void ct_step_project_pass_view(
	struct ct_step_project_pass *s, size_t k, float *out, struct ct_par *par);
void ct_step_project_pass_close(struct ct_step_project_pass *s);

#endif
