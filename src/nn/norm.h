/* norm.h: group normalisation, forward and backward. Kernels (core/simd.h).
 *
 * Pure functions on one image in [hw][c] order (channels last), c a multiple of 32; float storage,
 * sums in double and in a fixed order. dx is written, or added to if `acc`; gradients of parameters
 * are always added to. No pointer may overlap another unless said. Thread-safe.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_NN_NORM_H
#define CT_NN_NORM_H
#include "core/simd.h"

#include <stdbool.h>
#include <stddef.h>

enum { CT_NORM_GROUPS = 32 };

/* Group normalisation (Wu and He 2018) of x + shift into 32 groups, eps 1e-5, biased variance, then
 * a per-channel affine map and, for a residual block of guided diffusion (Dhariwal and Nichol
 * 2021), the map of the time embedding e and SiLU:
 *
 *   xhat = (x + o_c - mean_g) / sqrt(var_g + eps)
 *   z    = (gamma_c xhat + beta_c)(1 + s_c) + t_c       y = z sigmoid(z)  or  z
 *
 * (s, t) are the halves of e if scale_shift (o = 0), else o = e; without e all are 0. */
struct ct_norm {
	size_t hw, c;
	const float *gamma, *beta; /* [c] */
	const float *e;            /* [2c] if scale_shift, [c] if not, or NULL */
	bool scale_shift, silu;
};

/* sums[2c] = per-channel sum of x and of x^2. */
CT_SIMD_DECLARE(void, ct_norm_sums, (size_t hw, size_t c, double *sums, const float *x));
/* y[hw][c] from x and its sums; ab[2c] is scratch. y may be x. */
CT_SIMD_DECLARE(void, ct_norm_forward,
	(const struct ct_norm *n, float *y, const float *x, const double *sums, float *ab));
/* Floats of scratch that the backward of c channels needs: three float maps, two double sums. */
static inline size_t ct_norm_scratch(size_t c)
{
	return 3 * c + 4 * c;
}
/* dx[hw][c]; dgamma, dbeta [c] added to (or both NULL); de as e, added to (or NULL). dy is
 * overwritten. */
CT_SIMD_DECLARE(void, ct_norm_back,
	(const struct ct_norm *n, float *dx, float *dgamma, float *dbeta, float *de, float *dy,
		const float *x, const double *sums, bool acc, float *scratch));

#endif
