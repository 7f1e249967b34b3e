/* difference.h: sums over the voxels of two volumes, of the whole and of every slice.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_QUALITY_DIFFERENCE_H
#define CT_QUALITY_DIFFERENCE_H
#include "core/env.h"
#include "quality/ssim.h"

#include <stdbool.h>

/* d = test - ref. A pair is two neighbours along an axis that both count. */
struct ct_sums {
	double count;                  /* voxels */
	double square, abs, diff, max; /* of d: sum d^2, sum |d|, sum d, largest |d| */
	double top;                    /* largest |value| of either, counted or not */
	double mapped;                 /* sum of the squared difference of the mapped values */
	double pairs[3], gradient[3];  /* sum (d of the next voxel - d)^2 along each axis */
};

struct ct_difference {
	struct ct_sums total;
	/* Of the n[a] slices across axis a: pairs[a] and gradient[a] are those with the next slice.
	 * slice[0] and slice[1] are NULL unless asked for. */
	struct ct_sums *slice[3];
	/* Has the slice a voxel of ref above map->zero? NULL unless asked for. */
	bool *above[3];
};

/* mask (NULL: everywhere) not zero is what counts; `above` is of all voxels. Volumes are n voxels,
 * i fastest; if a voxel of theirs is not finite, counted or not, neither is total.square. The mask
 * is finite. Does not depend on the number of threads. *d is to be freed, even on failure.
 * CT_ENOMEM, CT_ESTOP. */
int ct_difference(struct ct_difference *d, const size_t n[static 3], const float *ref,
	const float *test, const float *mask, const struct ct_ssim_map *map, bool slices,
	bool above, const struct ct_env *env, struct ct_err *e);
void ct_difference_free(struct ct_difference *d);

#endif
