/* softmax.h: exp(x) / sum exp(x) of rows of n floats. Kernels (core/simd.h); sums in a fixed order.
 */
#ifndef CT_UNET_SOFTMAX_H
#define CT_UNET_SOFTMAX_H
#include "core/simd.h"

#include <stddef.h>

/* In place. */
CT_SIMD_DECLARE(void, ct_softmax, (size_t rows, size_t n, float *w));
/* dw = w (dw - sum w dw). */
CT_SIMD_DECLARE(void, ct_softmax_back, (size_t rows, size_t n, float *dw, const float *w));

#endif
