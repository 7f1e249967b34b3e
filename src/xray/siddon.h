/* siddon.h: one ray through a box of voxels, exactly (Siddon, Med. Phys. 12, 1985): the sum of
 * length times voxel, mm, and its transpose, vol += length times value. vol is at voxel (0,0,0).
 * Pure kernels (core/simd.h). */
#ifndef CT_XRAY_SIDDON_H
#define CT_XRAY_SIDDON_H
#include "core/simd.h"
#include "xray/ray.h"

CT_SIMD_DECLARE(double, ct_siddon_sum,
	(const float *restrict vol, const struct ct_box *box, const struct ct_ray *r));
CT_SIMD_DECLARE(void, ct_siddon_spread,
	(float *restrict vol, const struct ct_box *box, const struct ct_ray *r, double value));

#endif
