/* joseph.h: one ray through a box of voxels by linear interpolation (Joseph, IEEE TMI 1, 1982): the
 * sum of weight times voxel, mm, and its transpose, vol += weight times value. Voxels beyond the
 * box are 0; vol is at voxel (0,0,0). Pure kernels (core/simd.h). */
#ifndef CT_XRAY_JOSEPH_H
#define CT_XRAY_JOSEPH_H
#include "core/simd.h"
#include "xray/ray.h"

CT_SIMD_DECLARE(double, ct_joseph_sum,
	(const float *restrict vol, const struct ct_box *box, const struct ct_ray *r));
CT_SIMD_DECLARE(void, ct_joseph_spread,
	(float *restrict vol, const struct ct_box *box, const struct ct_ray *r, double value));

#endif
