/* flat.h: a volume that was made of points, where these are flat.
 *
 * Between points that alias and differ by no more than noise or texture nothing is known but their
 * level. A solver that has to go through all of them makes creases and blobs of it, and lets what
 * is steep a few points away swing on; linear interpolation does neither. So
 *
 *   x <- x + w (l - x)       l the linear interpolation,
 *   w = 1 / (1 + (s / (CT_FLAT_EDGE t))^4)
 *
 * s is the standard deviation of the eight points about a cell, w linear between the cells'
 * centres; t what the flattest tissue of the scan shows (noise.h). That is the weight by which a
 * part of variance t^2 without correlation is told from structure, but steeper. Of eighteen scans
 * (heads, necks, chests, abdomens, limbs, phantoms; 4x, a Gaussian of an eighth) the best w of all
 * voxels with the same s falls from 1 to one half at 2 to 3 t, whether t is 2 HU or 15.
 */
#ifndef CT_RESOLUTION_FLAT_H
#define CT_RESOLUTION_FLAT_H
#include "core/vol.h"
#include "core/env.h"

#define CT_FLAT_EDGE 2.0

/* x, on the grid `factor` times as fine as that of lo (ct_degrade_cover); texture: t, HU; of 0 x
 * stays as it is. Memory: two volumes beside x and what is between the passes of an interpolation.
 * Touches nothing beyond the next point of a voxel. CT_ENOMEM. The same bytes for any number of
 * threads. */
int ct_flat_mix(struct ct_vol *x, const struct ct_vol *lo, const double factor[static 3],
	double texture, const struct ct_env *env, struct ct_err *e);

#endif
