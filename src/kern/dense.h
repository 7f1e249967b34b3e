/* dense.h: product of small dense matrices in float, for planes that are in the cache.
 *
 * Row-major; rows of b and their padding are read in blocks of CT_DENSE_WIDTH columns, so b must
 * be readable up to the next multiple of it; c is written in its n columns only. Each element is
 * summed in order of k, without fused multiplies: the same bytes on every processor. Pure.
 */
#ifndef CT_KERN_DENSE_H
#define CT_KERN_DENSE_H
#include <stdbool.h>
#include <stddef.h>

#define CT_DENSE_WIDTH 32
/* n rounded up to whole blocks. */
#define CT_DENSE_ROW(n) (((n) + CT_DENSE_WIDTH - 1) / CT_DENSE_WIDTH * CT_DENSE_WIDTH)

/* c (m,n; ldc) = or += a (m,k; lda) b (k,n; ldb). */
void ct_dense(float *restrict c, size_t ldc, const float *restrict a, size_t lda,
	const float *restrict b, size_t ldb, size_t m, size_t n, size_t k, bool add);

#endif
