/* step-compose.h: a base volume and a residual, of Gaussians or of voxels, make the final CT (the
 * paper: the volume of the base plus the Gaussians on voxels, max(0, .)):
 *
 *   out = max(floor, clamp(base, LO, HI) + gain residual)     HU, xray/window.h
 *
 * Gaussians that are the whole object (metadata mode full) stand on LO; where the fit was to
 * projections with overshoots, the base keeps its own. The residual is on the grid of the base.
 * In memory; the same bytes for any number of threads. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_STEPS_STEP_COMPOSE_H
#define CT_STEPS_STEP_COMPOSE_H
#include "core/gauss.h"
#include "steps/window-rule.h"

/* What is asked: what messages call the data, and */
struct ct_step_compose_rule {
	const char *base, *residual, *lr;
	struct ct_window_rule window;
	double floor;   /* least value, HU; NaN: LO */
	double gain;    /* of the residual */
	double gamma;   /* PReLU's slope of Gaussians in their scene; 0: as they say */
	double spacing; /* mm of the voxels, to which the base is interpolated; NaN: its own grid */
};
#define CT_STEP_COMPOSE_DEFAULTS                                                                   \
	{                                                                                          \
		.base = "base", .residual = "residual", .lr = "lr", .floor = (double)NAN,          \
		.gain = 1, .spacing = (double)NAN                                                  \
	}

/* What is put together: */
struct ct_step_compose {
	struct ct_vol *base;           /* HU; becomes the result, in place */
	const struct ct_gauss *gauss;  /* in their scene: of the box of the base; or NULL: */
	const struct ct_vol *residual; /* HU, on the grid of the base */
	const struct ct_vol *lr;       /* CT in HU that the result is made to agree with; or NULL */
};

/* What was done. */
struct ct_step_compose_report {
	size_t touching, gaussians; /* so many of them are on the grid */
	double before, after;       /* HU RMS from lr, before and after they agree; 0 without */
};

/* added (zeroed struct) <- the residual in HU, before gain and floor, and its metadata. CT_EINPUT
 * for another quantity; CT_EGEOM; CT_ENUMERIC; CT_EUSAGE for a window or voxel size that is none;
 * CT_ENOMEM; CT_ESTOP. */
int ct_step_compose_run(struct ct_vol *added, struct ct_step_compose_report *r,
	const struct ct_step_compose *d, const struct ct_step_compose_rule *rule,
	const struct ct_env *env, struct ct_err *e);

#endif
