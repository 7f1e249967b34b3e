/* norm-map.h: what norm.c does to every value of an image [hw][c], c a multiple of 16. Kernels
 * (core/simd.h). */
#ifndef CT_UNET_NORM_MAP_H
#define CT_UNET_NORM_MAP_H
#include "core/simd.h"

#include <stdbool.h>
#include <stddef.h>

/* sums[c] = sum of a, sums[c..2c] = sum of a b, per channel. */
CT_SIMD_DECLARE(void, ct_norm_map_sums,
	(size_t hw, size_t c, double *sums, const float *a, const float *b));
/* y = z = ab[0..c] x + ab[c..2c], and y = z sigmoid(z). y may be x. */
CT_SIMD_DECLARE(
	void, ct_norm_map, (size_t hw, size_t c, float *y, const float *x, const float *ab));
CT_SIMD_DECLARE(
	void, ct_norm_map_silu, (size_t hw, size_t c, float *y, const float *x, const float *ab));
/* dy *= the slope of that. */
CT_SIMD_DECLARE(
	void, ct_norm_map_slope, (size_t hw, size_t c, float *dy, const float *x, const float *ab));
/* dx (+)= p dz + q x + r, of pqr[3][c]. */
CT_SIMD_DECLARE(void, ct_norm_map_combine,
	(size_t hw, size_t c, float *dx, const float *dz, const float *x, const float *pqr,
		bool acc));

#endif
