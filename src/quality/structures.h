/* structures.h: what a volume shows that the truth does not, counted: blobs in soft tissue.
 *
 * Both volumes become differences of two Gaussians, d = G(sigma) * x - G(10/3 sigma) * x. A
 * structure is a voxel where d is larger than at its 26 neighbours and than CT_STRUCTURES_LEAST, T
 * (bright), or likewise of -d (dark). It is false if d of the truth is below T / 2 there and at all
 * 26 neighbours, and missed if the truth has it and the volume does not. Soft tissue is where both
 * Gaussians of the truth lie within CT_STRUCTURES_SOFT HU of water. Faces are not searched, but
 * those of axes of one or two voxels, which have nothing else.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_QUALITY_STRUCTURES_H
#define CT_QUALITY_STRUCTURES_H
#include "core/env.h"
#include "core/vol.h"

#define CT_STRUCTURES_SOFT 150.0f
#define CT_STRUCTURES_LEAST 15.0f /* HU */

struct ct_structures {
	size_t soft;                         /* voxels that were searched */
	size_t falsely[2], missed[2], is[2]; /* bright, dark; `is`: of the truth */
};

/* sigma along each axis in voxels; mask as in metrics.h, or NULL. Volumes on one grid.
 * CT_ENOMEM. Memory: three volumes. The result does not depend on the number of threads. */
int ct_structures(struct ct_structures *s, const struct ct_vol *ref, const struct ct_vol *test,
	const struct ct_vol *mask, const double sigma[static 3], const struct ct_env *env,
	struct ct_err *e);

#endif
