/* mixture-ref.h: one Gaussian in voxels, in double, with plain loops: what the fast functions of
 * mixture.h are tested against. cut >= 0 is free. Pure.
 */
#ifndef CT_GS_MIXTURE_REF_H
#define CT_GS_MIXTURE_REF_H
#include "gs/mixture.h"

/* out[n2][n1][n0] += the Gaussian where the exponent is at least -cut. */
void ct_mixture_ref_draw(
	double *out, const struct ct_block *k, const struct ct_voxel_gaussian *b, double cut);
/* Moments of g e in the conditional coordinates: 1, x, y, z, xx, xy, xz, yy, yz, zz. */
void ct_mixture_ref_sums(double s[static 10], const double *g, const struct ct_block *k,
	const struct ct_voxel_gaussian *b, double cut);

#endif
