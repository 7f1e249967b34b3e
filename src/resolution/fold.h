/* fold.h: rows split into what is even and what is odd about their middle, and back: half of the
 * work of a cosine basis, whose functions are either. Pure kernels (core/simd.h); nothing overlaps.
 */
#ifndef CT_RESOLUTION_FOLD_H
#define CT_RESOLUTION_FOLD_H
#include "core/simd.h"

#include <stddef.h>

/* (a, b) <- (a + b, a - b), n elements. */
CT_SIMD_DECLARE(void, ct_butterfly, (float *a, float *b, size_t n));
/* sum[j] = x[j] + x[n-1-j], difference likewise, j < n/2; the middle of an odd n stands alone, in
 * sum. */
CT_SIMD_DECLARE(void, ct_fold, (float *sum, float *difference, const float *x, size_t n));
/* out = x + what even and odd fold out to. out may be x. */
CT_SIMD_DECLARE(void, ct_unfold_add,
	(float *out, const float *x, const float *even, const float *odd, size_t n));

#endif
