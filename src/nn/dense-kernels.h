/* dense-kernels.h: the loops of dense.h. Kernels (core/simd.h): multiplications and additions are
 * fused where the processor does so, in the same order at every level.
 *
 * Matrices are rows of floats, feature-major: row f holds feature f of all points. The number of
 * columns is a multiple of CT_DENSE_LANES. Pure functions; thread-safe.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_NN_DENSE_KERNELS_H
#define CT_NN_DENSE_KERNELS_H
#include "core/simd.h"

#include <stdbool.h>
#include <stddef.h>

enum { CT_DENSE_LANES = 16 };

/* y[rows][ld] = s, with s = b[r] (0 if NULL; y if `add`) + sum over k < depth of
 * w[r wr + k wk] x[k ld + i], then, if `mask` (rows of ld as well), times `slope` where that is not
 * positive, and otherwise times `slope` where s itself is negative. */
struct ct_dense_product {
	size_t rows, depth, cols, ld;
	float *y;
	const float *w, *x, *b, *mask;
	size_t wr, wk;
	float slope;
	bool add;
};
CT_SIMD_DECLARE(void, ct_dense_kernels_product, (const struct ct_dense_product *p));
/* The last step of that alone, y being the sum without b. */
CT_SIMD_DECLARE(void, ct_dense_kernels_finish, (const struct ct_dense_product *p));
/* dw[out][ldw] += d[out][ld] x[in][ld]^T. */
CT_SIMD_DECLARE(void, ct_dense_kernels_gradient,
	(size_t out, size_t in, size_t cols, size_t ld, float *dw, size_t ldw, const float *d,
		const float *x));
/* sums[r] += sum of a[r ld + i] b[r ld + i], or of a if b is NULL. */
CT_SIMD_DECLARE(void, ct_dense_kernels_sums,
	(size_t rows, size_t cols, size_t ld, float *sums, const float *a, const float *b));
/* y = 1 / (1 + e^-y). */
CT_SIMD_DECLARE(void, ct_dense_kernels_sigmoid, (size_t cols, float *y));

#endif
