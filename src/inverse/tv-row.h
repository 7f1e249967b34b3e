/* tv-row.h: one row of an iteration of total variation, and the sum that measures it (tv.c). Pure
 * kernels (core/simd.h). SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_INVERSE_TV_ROW_H
#define CT_INVERSE_TV_ROW_H
#include "core/simd.h"

#include <stddef.h>
#include <stdint.h>

/* A dual of length 1, in the unit of its numbers. */
#define CT_TV_ONE 32767.0f

/* What a row needs: x and its neighbours along j and k (itself at the last), its dual, the
 * k-component below (2 p' - p, replaced by this row's), the j-component of the row before. No two
 * of the rows overlap, but xj, to and, without `ahead`, xk may be x, and plus may be xk. */
struct ct_tv_row {
	int16_t *p[3];
	float *out, *below, *before, *after; /* after: j-component of this row */
	float *step;                         /* x' - x of each voxel, or NULL */
	float *xk; /* made here, ahead + by plus, unless `ahead` is NULL */
	const float *x, *xj, *ahead, *plus, *to;
	float by, pull;
	float s[3], t[3]; /* steps in the unit of the dual, times the weight of an axis */
};

/* One step of dual ascent and primal descent on the n voxels of a row. */
CT_SIMD_DECLARE(void, ct_tv_row_sweep, (const struct ct_tv_row *row, size_t n));
/* x -= t below; sum |x - before|^2, or 0 if that is NULL. */
CT_SIMD_DECLARE(double, ct_tv_row_mend,
	(float *restrict x, const float *restrict before, const float *restrict below, float t,
		size_t n));

#endif
