/* silu.h: kernels of the slice network's hidden layers, rows of n neurons. */
#ifndef CT_RESTORE_SILU_H
#define CT_RESTORE_SILU_H
#include "core/simd.h"

#include <stddef.h>

/* a <- a + bias, h <- a / (1 + e^-a). */
CT_SIMD_DECLARE(void, ct_silu_rows, (size_t rows, size_t n, float *h, float *a, const float *bias));
/* d <- d times the derivative there: S + h (1 - S), S = 1 / (1 + e^-a). */
CT_SIMD_DECLARE(void, ct_silu_rows_back, (size_t count, float *d, const float *h, const float *a));

#endif
