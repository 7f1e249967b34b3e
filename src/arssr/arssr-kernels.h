/* arssr-kernels.h: what the layers of ArSSR do beside their products, and the trilinear sample of
 * features with its adjoint. Pure kernels (core/simd.h); rows of floats, sums in order.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_ARSSR_ARSSR_KERNELS_H
#define CT_ARSSR_ARSSR_KERNELS_H
#include "core/simd.h"

#include <stddef.h>

/* dy = 0 where y is not above 0; y may be dy. */
CT_SIMD_DECLARE(void, ct_arssr_kernels_mask, (size_t n, float *dy, const float *y));
/* y[n] = the sum of w[i] x[at[i] + .] over eight corners; and dx[at[i] + .] += w[i] dy[n]. */
CT_SIMD_DECLARE(void, ct_arssr_kernels_gather,
	(size_t n, float *y, const float *x, const size_t at[8], const float w[8]));
CT_SIMD_DECLARE(void, ct_arssr_kernels_scatter,
	(size_t n, float *dx, const float *dy, const size_t at[8], const float w[8]));

#endif
