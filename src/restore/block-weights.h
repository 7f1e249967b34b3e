/* block-weights.h: weights of blocks of voxels, linear between the centres of the blocks.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_RESTORE_BLOCK_WEIGHTS_H
#define CT_RESTORE_BLOCK_WEIGHTS_H
#include <stddef.h>

/* Weights of blocks of s^3 voxels: m of them along i, j and k. row: work of m[0]. */
struct ct_block_weights {
	float *w, *row;
	size_t m[3], s;
};

/* w->row <- the weights of the blocks along i at voxels (j,k). */
void ct_block_weights_row(const struct ct_block_weights *w, size_t j, size_t k);
/* h, the row of n voxels for which w->row is, times `axes`, becomes w h; *sum += (w h)^2. */
void ct_block_weights_apply(
	double *sum, float *h, size_t n, double axes, const struct ct_block_weights *w);

#endif
