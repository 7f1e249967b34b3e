/* place.h: where the Gaussians of a fit begin.
 *
 * As in R2-Gaussian (Zha et al., NeurIPS 2024): n voxels with density above 0.05, drawn without
 * replacement, become isotropic Gaussians at their centres, with the standard deviation
 *
 *   s = sqrt(mean squared distance to the three nearest others)
 *
 * and density `gain` times that of the voxel. Or the voxels are those of another field, what the
 * projections of the base leave of a filtered back-projection, with its sign: n points whose number
 * in every place follows its size.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_GS_PLACE_H
#define CT_GS_PLACE_H
#include "core/env.h"
#include "core/gauss.h"
#include "core/stack.h"
#include "core/vol.h"

/* Density from which a voxel may hold a Gaussian, `least`, where 1 counts as one. */
#define CT_PLACE_LEAST 0.05f

/* Fill g, which must be zero or hold an activation and gamma: at most n Gaussians on the grid of
 * `base`, whose data are density [0,1]. ln s is kept within ln_s. Centres are `shift` voxels along
 * each axis from those of the voxels. CT_EINPUT if no voxel qualifies.
 */
int ct_place_base(struct ct_gauss *g, const struct ct_vol *base, double least, size_t n,
	double gain, double shift, const double ln_s[static 2], const struct ct_env *env,
	struct ct_err *e);
/* The same from a signed field: `gain` times its value. CT_EINPUT if it is zero. */
int ct_place_residual(struct ct_gauss *g, const struct ct_vol *field, size_t n, double gain,
	const double ln_s[static 2], const struct ct_env *env, struct ct_err *e);
/* Sum of squares / sum of sizes: the mean size where ct_place_residual puts Gaussians; at most 1.
 */
double ct_place_typical(const struct ct_vol *field);
/* How many times all that a field has (the sum of its sizes, in density mm^3) one density 1 of
 * every Gaussian is; 0 if there is no field. */
double ct_place_cover(const struct ct_gauss *g, const struct ct_vol *field);
/* The filtered back-projection of y - base on a grid, whose data may be NULL; *field
 * must be zero. Of y alone if base is NULL: all of the ramp then, as TIGRE's FDK for R2-Gaussian.
 * CT_EGEOM for a scan that has none, CT_ESTOP, CT_ENOMEM. */
int ct_place_field(struct ct_vol *field, const struct ct_vol *grid, const struct ct_stack *y,
	const struct ct_stack *base, const struct ct_env *env, struct ct_err *e);

/* out[i] = mean squared distance from point i to its three nearest (fewer if there are not so
 * many; 0 for a lone point), exact: cells of about two points, cubes of cells until none nearer can
 * follow. pos[3][n], mm. Allocates. */
int ct_place_neighbours(
	double *out, size_t n, float *const pos[static 3], struct ct_par *par, struct ct_err *e);

#endif
