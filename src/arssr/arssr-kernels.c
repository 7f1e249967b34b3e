/* arssr-kernels.c: see arssr-kernels.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "arssr/arssr-kernels.h"

void CT_SIMD_HERE(ct_arssr_kernels_mask)(size_t n, float *dy, const float *y)
{
	for (size_t i = 0; i < n; i++)
		dy[i] = y[i] > 0 ? dy[i] : 0;
}

void CT_SIMD_HERE(ct_arssr_kernels_gather)(
	size_t n, float *restrict y, const float *restrict x, const size_t at[8], const float w[8])
{
	for (size_t i = 0; i < n; i++)
		y[i] = w[0] * x[at[0] + i] + w[1] * x[at[1] + i] + w[2] * x[at[2] + i] +
		       w[3] * x[at[3] + i] + w[4] * x[at[4] + i] + w[5] * x[at[5] + i] +
		       w[6] * x[at[6] + i] + w[7] * x[at[7] + i];
}

void CT_SIMD_HERE(ct_arssr_kernels_scatter)(size_t n, float *restrict dx, const float *restrict dy,
	const size_t at[8], const float w[8])
{
	for (int k = 0; k < 8; k++)
		for (size_t i = 0; i < n; i++)
			dx[at[k] + i] += w[k] * dy[i];
}
