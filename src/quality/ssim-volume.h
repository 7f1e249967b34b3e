/* ssim-volume.h: structural similarity of two volumes, slice by slice across any axis or in 3-D,
 * from the volumes as they lie in memory.
 *
 * The window is separable, so a slice across an axis is the volume filtered along the two other
 * axes, and the 3-D index is the volume filtered along three: nothing is gathered or transposed.
 * A worker keeps a block of 8 slices by 16 rows by 128 columns of the local moments, which stays
 * in its cache: about 0.5 MiB, whatever the volumes' size.
 */
#ifndef CT_QUALITY_SSIM_VOLUME_H
#define CT_QUALITY_SSIM_VOLUME_H
#include "core/env.h"
#include "quality/ssim.h"

/* What is compared: (clip(v, lo, hi) - zero) scale. Bounds that are not too wide for float make it
 * twice as fast. */
struct ct_ssim_map {
	double lo, hi, zero, scale;
};

/* For each of the n[axis] slices across `axis` the sum of S over its pixels that count, and their
 * number, into sum and count. Pixels count that the rule does not crop and where mask (NULL:
 * everywhere) is not zero. With rule->dims == 3 the window is three-dimensional, crops all three
 * axes, and axis must be 2. Volumes are n voxels, i fastest, finite. Does not depend on the number
 * of threads. CT_ENOMEM, CT_ESTOP. */
int ct_ssim_volume(double *sum, double *count, const struct ct_ssim_rule *rule, int axis,
	const size_t n[static 3], const float *ref, const float *test, const float *mask,
	const struct ct_ssim_map *map, const struct ct_env *env, struct ct_err *e);

#endif
