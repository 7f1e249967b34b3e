/* separable-rows.h: the sums of separable.c over a tile of lines. A pure kernel (core/simd.h). */
#ifndef CT_RESOLUTION_SEPARABLE_ROWS_H
#define CT_RESOLUTION_SEPARABLE_ROWS_H
#include "core/simd.h"
#include "resolution/separable.h"

enum { CT_SEPARABLE_WIDTH = 32 }; /* lines of a tile */

/* out[r][i] = sum_q w[m + r][q] tile[first[m + r] + q][i], r < rows, i < CT_SEPARABLE_WIDTH, each
 * in order of q. They must not overlap. */
CT_SIMD_DECLARE(void, ct_separable_rows,
	(float *out, const double *tile, const struct ct_taps *t, size_t m, size_t rows));

#endif
