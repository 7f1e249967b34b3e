/* slice-row.h: the numbers of a slice, n of them. Kernels (core/simd.h). */
#ifndef CT_SERIES_SLICE_ROW_H
#define CT_SERIES_SLICE_ROW_H
#include "core/simd.h"
#include "series/slice.h"

CT_SIMD_DECLARE(void, ct_slice_row_widen,
	(size_t n, float *restrict out, const void *restrict in, const struct ct_slice_bits *how));
/* slope*x + inter, but none where x is from lo to hi. */
CT_SIMD_DECLARE(void, ct_slice_row_scale,
	(size_t n, float *x, double slope, double inter, double lo, double hi, float none));

#endif
