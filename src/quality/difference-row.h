/* difference-row.h: the sums of difference.h of one row of voxels. Kernels (core/simd.h). */
#ifndef CT_QUALITY_DIFFERENCE_ROW_H
#define CT_QUALITY_DIFFERENCE_ROW_H
#include "core/simd.h"
#include "quality/difference.h"

/* n > 0 voxels of a row. What lies at an offset of `down` and `next` voxels is the next row and the
 * same row of the next slice; 0 where there is none. */
struct ct_difference_row {
	size_t n, down, next;
	const float *ref, *test;
	const float *mask[3]; /* not 0: counts; of the row, the next one, that of the next slice */
};

/* Numbers of test - ref of a row of n, which end in zeros. */
#define CT_DIFFERENCE_PITCH(n) (((n) + 15) / 8 * 8)

/* d = test - ref; and of the sums those that need no neighbour. `mapped` lacks the factor
 * map->scale^2. */
CT_SIMD_DECLARE(void, ct_difference_row_sum,
	(struct ct_sums * s, double *d, const struct ct_difference_row *r,
		const struct ct_ssim_map *map));
/* The other sums, from d of this row and of the next one, which is ignored if r->down is 0. */
CT_SIMD_DECLARE(void, ct_difference_row_pairs,
	(struct ct_sums * s, const double *d, const double *down,
		const struct ct_difference_row *r));

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
