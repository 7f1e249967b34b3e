/* loss-lowres.h: what a low-resolution CT asks of the Gaussians: D r = l, with D of degrade.h.
 *
 * D is a Gaussian of standard deviation sigma, then samples at the centres of the coarse voxels. A
 * Gaussian that is blurred by a Gaussian is one again, so D r is evaluated on the coarse grid
 * directly (the blur of a block, mixture.h): no fine volume is made. What else D does is met thus:
 *
 *   sinc   its low-pass at the coarse Nyquist frequency has no short form in space; instead both
 *          sides are blurred on by the Gaussian that brings the whole down to 0.1 at that
 *          frequency, beyond which little is left to alias. l is known on a grid that holds all
 *          of its frequencies, so its side is exact: a product in the DCT, the transform of D.
 *   point  halfway between two voxels, their mean: a variance of 1/4 voxel^2
 *   mean   the mean of s voxels: a Gaussian of the same variance, (s^2 - 1)/12, whose response at
 *          the coarse Nyquist frequency is within 5 %
 *
 * The term is mean|D r - l| over a block of coarse voxels, those left out that lie within two of
 * the border along an axis that D works on: D reflects there, a Gaussian does not.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_GS_LOSS_LOWRES_H
#define CT_GS_LOSS_LOWRES_H
#include "core/vol.h"
#include "gs/mixture.h"
#include "operator/degrade.h"

struct ct_loss_lowres {
	size_t n[3], first[3]; /* the voxels that count, and where they begin */
	double blur[3];        /* coarse voxels^2 */
	double affine[3][4];
	float *want; /* n[2] x n[1] x n[0] */
};

/* lr: l, density. Allocates; *o must be zero: free it in any case. CT_EGEOM if no voxel counts,
 * CT_ENOMEM. */
int ct_loss_lowres_alloc(struct ct_loss_lowres *o, const struct ct_vol *lr,
	const struct ct_degrade *d, struct ct_par *par, struct ct_err *e);
/* Also legal on a zeroed struct. */
void ct_loss_lowres_free(struct ct_loss_lowres *o);
/* The block of n voxels from `first` on (of those that count), to plan and draw. CT_EGEOM. */
int ct_loss_lowres_block(struct ct_block *k, const struct ct_loss_lowres *o,
	const size_t first[static 3], const size_t n[static 3], struct ct_err *e);
/* mean|f - want| over a block, f[n2][n1][pitch] as ct_mixture_draw leaves it, and
 * df = weight times its gradient. */
double ct_loss_lowres_gradient(float *df, const float *f, const struct ct_loss_lowres *o,
	const size_t first[static 3], const size_t n[static 3], double weight);

#endif
