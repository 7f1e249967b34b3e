/* fdk-cosine.h: the cosine weight of filtered back-projection. Pure kernels (core/simd.h). */
#ifndef CT_RECON_FDK_COSINE_H
#define CT_RECON_FDK_COSINE_H
#include "core/simd.h"

#include <stddef.h>

/* weight[c] = share_of[c] times the cosine of the angle between the central ray and the ray through
 * column c, x = (c - foot) pitch mm from the foot of the perpendicular, in a row y mm from it; d:
 * from source to detector, mm. share_of may be weight. */
CT_SIMD_DECLARE(void, ct_fdk_cosine,
	(size_t w, float *weight, const float *share_of, double foot, double pitch, double y,
		double d));

#endif
