/* soft.h: softness that is the scan's own, and not the profile's.
 *
 * What is measured on edges is the blur of everything that happened before the scan was sampled. A
 * scan whose slices were interpolated once is softer along z than in plane before any operator that
 * is to be undone. Edges do not show which of the two blurred them. Undoing too much costs up to 11
 * dB and ends below cubic interpolation; undoing too little costs a part of the gain. So:
 *
 *   slices     less than CT_SOFT_FACTOR times as far apart as the result's: softness of the
 *              result's own size is as large as theirs. A spread of more than .37 (adjacent slices
 *              have .29 to .42), up to those of slices that overlap by half (.74), is taken for
 *              .37: by least squares that is not worse than cubic interpolation whether softness
 *              made it or not. Slices that do not alias keep theirs.
 *   all axes   a band-limited scan is no softer along z than in plane, in voxels.
 *
 * Planes show a softness, too: that of the kernel of reconstruction, and of tissue that has no
 * sharp borders. The result is to be as sharp across slices as in plane, so it is not undone. Made
 * as coarse as the slices are far apart, by means, the edges of planes have a spread p with p^2 =
 * 1/12 + softness^2, as the profile of means is known.
 *
 * Where the operator is known, what edges show beyond it is softness; the operator stays. Soft
 * slices are inverted by least squares alone (refine.h).
 *
 * doc/blur-estimate.md, "Slices that were interpolated" and "What the planes show", has what this
 * gains and loses. SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_ESTIMATE_SOFT_H
#define CT_ESTIMATE_SOFT_H
#include "core/par.h"
#include "core/vol.h"
#include "estimate/profile.h"

#define CT_SOFT_FACTOR 2.5

/* The one axis that is refined, and less than CT_SOFT_FACTOR times; or -1. */
int ct_soft_axis(const double factor[static 3]);
/* The spreads of the axes that are refined, by `factor`, become those of the profiles alone. True
 * if slices are softer than a profile explains. Pure. */
bool ct_soft_leave(struct ct_profile p[static 3], const double factor[static 3]);
/* Is the noise of slices, of which so much is alike, that of interpolated ones, whose spread was
 * left? Pure. */
bool ct_soft_noise(const struct ct_profile *p, double alike);
/* Do edges show more than slices of a known spread, voxels, explain? Pure. */
bool ct_soft_beyond(const struct ct_profile *p, double known);
/* *square <- softness^2 of planes across `axis`, in voxels of v along it, the mean of what both
 * other axes show; 0 if they show none. v: HU, finite. CT_ENOMEM. */
int ct_soft_planes(
	double *square, const struct ct_vol *v, int axis, struct ct_par *par, struct ct_err *e);

#endif
