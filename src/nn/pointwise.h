/* pointwise.h: layers that see one pixel at a time, each forward beside its backward. Kernels
 * (core/simd.h).
 *
 * Pure functions of float values, [hw][c] order (channels last), any c. In a backward, dx is
 * written, or added to if `acc`; gradients of parameters are always added to. No pointer may
 * overlap another. Thread-safe.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_NN_POINTWISE_H
#define CT_NN_POINTWISE_H
#include "core/simd.h"

#include <stdbool.h>
#include <stddef.h>

enum ct_pointwise { CT_POINTWISE_RELU, CT_POINTWISE_GELU, CT_POINTWISE_SIGMOID };

/* max(0, x); x Phi(x), Phi the distribution of a normal number (Hendrycks and Gimpel 2016); or 1 /
 * (1 + e^-x). */
CT_SIMD_DECLARE(
	void, ct_pointwise_forward, (enum ct_pointwise f, size_t n, float *y, const float *x));
CT_SIMD_DECLARE(void, ct_pointwise_back,
	(enum ct_pointwise f, size_t n, float *dx, const float *dy, const float *x, bool acc));

/* y[hw][c] = GELU(x[hw][0..c-1]) x[hw][c..2c-1]. */
CT_SIMD_DECLARE(void, ct_pointwise_gate_forward, (size_t hw, size_t c, float *y, const float *x));
CT_SIMD_DECLARE(void, ct_pointwise_gate_back,
	(size_t hw, size_t c, float *dx, const float *dy, const float *x, bool acc));

/* y[hw][c] = x[hw][c] b, b of as many pixels, or of one for all. */
CT_SIMD_DECLARE(void, ct_pointwise_times_forward,
	(size_t hw, size_t c, bool one, float *y, const float *x, const float *b));
/* dx[hw][c] = dy b, or added to. */
CT_SIMD_DECLARE(void, ct_pointwise_times_back,
	(size_t hw, size_t c, bool one, float *dx, const float *dy, const float *b, bool acc));
/* db of one pixel: the sum over pixels of dy x, in double: sum[c] is scratch. Of as many pixels it
 * is ct_pointwise_times_back with x for b. */
CT_SIMD_DECLARE(void, ct_pointwise_times_sum,
	(size_t hw, size_t c, float *db, const float *dy, const float *x, bool acc, double *sum));

/* Layer normalisation (Ba, Kiros, Hinton 2016) of each pixel over its channels, biased variance:
 * y = gamma (x - mean) / sqrt(var + eps) + beta. */
CT_SIMD_DECLARE(void, ct_pointwise_norm_forward,
	(size_t hw, size_t c, double eps, float *y, const float *x, const float *gamma,
		const float *beta));
/* dgamma, dbeta [c] may both be NULL; sum[2c] is scratch. */
CT_SIMD_DECLARE(void, ct_pointwise_norm_back,
	(size_t hw, size_t c, double eps, float *dx, float *dgamma, float *dbeta, const float *dy,
		const float *x, const float *gamma, bool acc, double *sum));

#endif
