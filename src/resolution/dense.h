/* dense.h: product of small dense matrices in float, for data that are in the cache.
 *
 * Row-major. b is read in blocks of CT_DENSE_WIDTH columns, so its rows must be readable up to the
 * next multiple of it; c is written in its n columns only. A negative ldb or ldc takes rows
 * upwards. Each element is summed in order of k, with fused multiplies where AVX-512 has them.
 * Pure; c must not overlap a or b.
 */
#ifndef CT_RESOLUTION_DENSE_H
#define CT_RESOLUTION_DENSE_H
#include "core/simd.h"

#include <stddef.h>

#define CT_DENSE_WIDTH 16
/* n rounded up to whole blocks. */
#define CT_DENSE_ROW(n) (((n) + CT_DENSE_WIDTH - 1) / CT_DENSE_WIDTH * CT_DENSE_WIDTH)

/* c (m,n; ldc) = a (m,k; lda) b (k,n; ldb). */
CT_SIMD_DECLARE(void, ct_dense,
	(float *c, ptrdiff_t ldc, const float *a, size_t lda, const float *b, ptrdiff_t ldb,
		size_t m, size_t n, size_t k));

#endif
