/* flat.h: a volume that was made of points, where these are flat.
 *
 * Between aliased point samples that differ by no more than noise or texture nothing is known but
 * their level. A solver that has to go through all of them makes creases and blobs of it, and lets
 * what is steep a few points away swing on; linear interpolation does neither. So
 *
 *   x <- x + w (l - x)     l the linear interpolation,
 *   w = 1 / (1 + (s / (CT_FLAT_EDGE t))^4)
 *
 * s is the standard deviation of the eight points about a cell, w linear between the cells'
 * centres, t the texture: the s that one in fifty cells of tissue does not exceed. Of white noise
 * t is .47 of its deviation. CT_FLAT_EDGE was measured on eighteen scans (4x, a Gaussian of an
 * eighth): with 3 one has more texture deep in tissue than cubic interpolation leaves, with 4 none.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_INVERSE_FLAT_H
#define CT_INVERSE_FLAT_H
#include "core/env.h"
#include "core/vol.h"

#define CT_FLAT_EDGE 4.0

/* *texture <- t, HU, of cells whose points all lie above -850 HU and the lowest value, which may be
 * a mask or clipped; 0 if tissue is constant, or less than 16 cells are seen. CT_ENOMEM. */
int ct_flat_texture(double *texture, const struct ct_vol *lo, struct ct_err *e);
/* x, on the grid `factor` times as fine as that of lo (ct_degrade_cover); of a texture of 0 it
 * stays as it is. Nothing beyond the next point of a voxel is looked at. Memory: one of lo.
 * CT_ENOMEM. The same bytes for any number of threads. */
int ct_flat_mix(struct ct_vol *x, const struct ct_vol *lo, const double factor[static 3],
	double texture, const struct ct_env *env, struct ct_err *e);

#endif
