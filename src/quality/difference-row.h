/* difference-row.h: the sums of difference.h of one row of voxels. Kernels (core/simd.h). */
#ifndef CT_QUALITY_DIFFERENCE_ROW_H
#define CT_QUALITY_DIFFERENCE_ROW_H
#include "core/simd.h"
#include "quality/difference.h"

/* n voxels of the row, of n > 0. What lies at an offset of `down` and `next` voxels is the next row
 * and the same row of the next slice; 0 where there is none. */
struct ct_difference_row {
	size_t n, down, next;
	const float *ref, *test, *mask; /* mask NULL: all count */
};

/* The sums of the row; `mapped` lacks the factor map->scale^2. */
CT_SIMD_DECLARE(void, ct_difference_row_sum,
	(struct ct_sums * s, const struct ct_difference_row *r, const struct ct_ssim_map *map));

enum { CT_DIFFERENCE_COLUMNS = 7 };

/* Add the row to the sums of its columns: count, square, abs, diff, mapped, and pairs and gradient
 * along the row, n each, `pitch` apart. */
CT_SIMD_DECLARE(void, ct_difference_row_columns,
	(double *column, size_t pitch, const struct ct_difference_row *r,
		const struct ct_ssim_map *map));
/* flag[i] |= v[i] > threshold; is any of them? */
CT_SIMD_DECLARE(bool, ct_difference_row_mark,
	(unsigned char *flag, const float *v, size_t n, float threshold));

#endif
