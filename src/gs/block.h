/* block.h: a block of voxels of a grid, where a mixture of Gaussians is evaluated. */
#ifndef CT_GS_BLOCK_H
#define CT_GS_BLOCK_H
#include "core/err.h"

#include <stddef.h>

/* Voxels n[] whose voxel (0,0,0) is voxel first[] of the grid of an affine. */
struct ct_block {
	size_t n[3];
	double inv[3][3]; /* mm to voxels */
	double world[3];  /* position of the first voxel, mm */
	double blur[3];   /* voxel^2, >= 0; ct_block_init sets 0 */
};

/* CT_EGEOM if the affine has no inverse. */
int ct_block_init(struct ct_block *k, const double affine[static 3][4],
	const size_t first[static 3], const size_t n[static 3], struct ct_err *e);

#endif
