/* surface-error.h: how far the surface of a volume at a level is from that of the truth, mm.
 *
 * Each crossing of isosurface.h is a point. Its distance is that from the nearest place of the
 * other volume's surface. The distance is symmetric: mean, root mean square and 95th percentile are
 * over the points of both, each counted once (Heimann et al., IEEE Trans. Medical Imaging 28, 1251,
 * 2009). With a mask only points between two voxels of it count; what they are nearest to may lie
 * outside. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_QUALITY_SURFACE_ERROR_H
#define CT_QUALITY_SURFACE_ERROR_H
#include "core/env.h"
#include "core/vol.h"

struct ct_surface_error {
	size_t points[2]; /* of ref, test */
	/* mm; p95 interpolates order statistics. NaN if one of the two has no point. */
	double mean, rms, p95;
};

/* Volumes on one grid, finite; mask as in metrics.h, or NULL. Memory: 4 bytes a point, and a byte
 * for 28 voxels. CT_ENOMEM, CT_ESTOP. The result does not depend on the number of threads. */
int ct_surface_error(struct ct_surface_error *to, const struct ct_vol *ref,
	const struct ct_vol *test, const struct ct_vol *mask, double level,
	const struct ct_env *env, struct ct_err *e);

#endif
