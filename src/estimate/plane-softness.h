/* plane-softness.h: how soft a scan is by itself, as its planes show it.
 *
 * Edges across slices are softened by the profile of the slices and by all that softens the scan
 * along every axis: the kernel of reconstruction, and tissue that has no sharp borders. The result
 * is to be as sharp across slices as in plane, so the second part is not undone. The planes show
 * it: made as coarse as the slices are far apart, by means, their edges have a spread p with
 *
 *     p^2 = 1/12 + softness^2,
 *
 * as the profile of means is known. doc/blur-estimate.md, "What the planes show".
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_ESTIMATE_PLANE_SOFTNESS_H
#define CT_ESTIMATE_PLANE_SOFTNESS_H
#include "core/par.h"
#include "core/vol.h"

/* *square <- softness^2, in voxels of v along `axis`, the mean of what both other axes show; 0 if
 * they show none. v: HU, finite. CT_ENOMEM. */
int ct_plane_softness(
	double *square, const struct ct_vol *v, int axis, struct ct_par *par, struct ct_err *e);

#endif
