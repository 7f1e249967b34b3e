/* init.h: where the Gaussians of a fit begin.
 *
 * As in R2-Gaussian (Zha et al., NeurIPS 2024): n voxels with density above 0.05, drawn without
 * replacement, become isotropic Gaussians at their centres, with the standard deviation
 *
 *   s = sqrt(mean squared distance to the three nearest others)
 *
 * and density `gain` times that of the voxel.
 */
#ifndef CT_GS_INIT_H
#define CT_GS_INIT_H
#include "core/env.h"
#include "core/gauss.h"
#include "core/vol.h"

/* Density from which a voxel may hold a Gaussian. */
#define CT_INIT_LEAST 0.05f

/* out[i] = mean squared distance from point i to its three nearest (fewer if there are not so
 * many; 0 for a lone point), exact: cells of about two points, rings of cells until none nearer can
 * follow. pos[3][n], mm. Allocates. */
int ct_near3(
	double *out, size_t n, float *const pos[static 3], struct ct_par *par, struct ct_err *e);
/* Fill g, which must be zero or hold an activation and gamma: at most n Gaussians on the grid of
 * `base`, whose data are density [0,1]. ln s is kept within ln_s. CT_EINPUT if no voxel qualifies.
 */
int ct_init(struct ct_gauss *g, const struct ct_vol *base, size_t n, double gain,
	const double ln_s[static 2], const struct ct_env *env, struct ct_err *e);

#endif
