/* voxel-integral.h: the line integral of one ray through a box of voxels, mm, and its transpose,
 * which adds weight times value to vol: exactly (Siddon, Med. Phys. 12, 1985), where the weight of
 * a voxel is the length in it, and by linear interpolation (Joseph, IEEE TMI 1, 1982). Voxels
 * beyond the box are 0; vol is at voxel (0,0,0). Pure kernels (core/simd.h). */
#ifndef CT_XRAY_VOXEL_INTEGRAL_H
#define CT_XRAY_VOXEL_INTEGRAL_H
#include "core/simd.h"
#include "xray/ray.h"

CT_SIMD_DECLARE(double, ct_voxel_integral_siddon,
	(const float *restrict vol, const struct ct_box *box, const struct ct_ray *r));
CT_SIMD_DECLARE(void, ct_voxel_integral_siddon_spread,
	(float *restrict vol, const struct ct_box *box, const struct ct_ray *r, double value));
CT_SIMD_DECLARE(double, ct_voxel_integral_joseph,
	(const float *restrict vol, const struct ct_box *box, const struct ct_ray *r));
CT_SIMD_DECLARE(void, ct_voxel_integral_joseph_spread,
	(float *restrict vol, const struct ct_box *box, const struct ct_ray *r, double value));

#endif
