/* spatial.h: layers that move or mix pixels of one channel, each forward beside its backward.
 * Kernels (core/simd.h).
 *
 * Pure functions on one image in [h][w][c] order (channels last), any c, float storage. In a
 * backward, dx is written, or added to if `acc`; gradients of parameters are always added to. No
 * pointer may overlap another. Thread-safe.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_NN_SPATIAL_H
#define CT_NN_SPATIAL_H
#include "core/simd.h"

#include <stdbool.h>
#include <stddef.h>

/* Pixel shuffle (Shi et al. 2016): y[r h][r w][c] from x[h][w][c r r], pixel (i, j) of r x r from
 * channel (k r + i) r + j. */
CT_SIMD_DECLARE(void, ct_spatial_shuffle_forward,
	(size_t h, size_t w, size_t c, size_t r, float *y, const float *x));
CT_SIMD_DECLARE(void, ct_spatial_shuffle_back,
	(size_t h, size_t w, size_t c, size_t r, float *dx, const float *dy, bool acc));

/* 3 x 3 of every channel alone, zeros beyond the edges: weight[c][3][3], bias[c]. */
CT_SIMD_DECLARE(void, ct_spatial_depth_forward,
	(size_t h, size_t w, size_t c, float *y, const float *x, const float *weight,
		const float *bias, float *scratch));
/* dw, db may both be NULL. */
CT_SIMD_DECLARE(void, ct_spatial_depth_back,
	(size_t h, size_t w, size_t c, float *dx, float *dw, float *db, const float *dy,
		const float *x, const float *weight, bool acc, float *scratch));
/* Floats of scratch of both. */
static inline size_t ct_spatial_depth_scratch(size_t c)
{
	return (9 + 10 + 20) * c;
}

/* y[c], the mean of all pixels; sum[c] is scratch. */
CT_SIMD_DECLARE(void, ct_spatial_mean_forward,
	(size_t hw, size_t c, float *y, const float *x, double *sum));
CT_SIMD_DECLARE(
	void, ct_spatial_mean_back, (size_t hw, size_t c, float *dx, const float *dy, bool acc));

/* The largest of k x k at every `step`: (h - k) / step + 1 rows. */
CT_SIMD_DECLARE(void, ct_spatial_pool_forward,
	(size_t h, size_t w, size_t c, size_t k, size_t step, float *y, const float *x));
/* To the first of the largest, by row and column. */
CT_SIMD_DECLARE(void, ct_spatial_pool_back,
	(size_t h, size_t w, size_t c, size_t k, size_t step, float *dx, const float *dy,
		const float *x, bool acc));

/* Bilinear between centres of pixels that are cells: y[nh][nw][c] from x[h][w][c], constant beyond
 * the outermost centres. */
CT_SIMD_DECLARE(void, ct_spatial_stretch_forward,
	(size_t h, size_t w, size_t nh, size_t nw, size_t c, float *y, const float *x));
CT_SIMD_DECLARE(void, ct_spatial_stretch_back,
	(size_t h, size_t w, size_t nh, size_t nw, size_t c, float *dx, const float *dy, bool acc));

#endif
