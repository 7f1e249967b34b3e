/* packet.h: sixteen rays at once through a row of voxel columns.
 *
 * The rays of a detector column that runs along a grid axis lie in one plane with that axis: they
 * meet the same columns of voxels, each at its own height. So the path across the columns is
 * cut once into pieces, and a piece is shared by all rows of the detector. Row r is at height
 *
 *   z_r(x) = pa + pb x + r (qa + qb x)            voxels, at x along the path
 *
 * with at most one crossing of a height k in a piece (slopes dz/dx of at most 1).
 * Siddon: piece [x0, x1] of one column: the share of the piece below the crossing belongs to one
 * voxel, the rest to the other. Joseph: at x0 = x1, between two voxel centres.
 *
 * Pure kernels (core/simd.h).
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_XRAY_PACKET_H
#define CT_XRAY_PACKET_H
#include "core/simd.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
	CT_PACKET = 16, /* rays of a packet, and voxels of a store */
	CT_PIECES = 64, /* pieces of a path handled at once */
	CT_PAD = 32,    /* zeros required before and behind each column of voxels */
	CT_ROWS = 256   /* rows of the detector handled at once */
};

/* To be zeroed before its first use. */
struct ct_pieces {
	size_t n;
	double x0[CT_PIECES], x1[CT_PIECES];
	float weight[CT_PIECES], inverse[CT_PIECES]; /* length or share; 1/(x1 - x0) */
	size_t at[CT_PIECES];                        /* voxel 0 of the column */
	int32_t lo[CT_PIECES], hi[CT_PIECES];        /* heights outside [lo, hi) are zero */
};

/* Heights of the rays of a detector column. */
struct ct_heights {
	double pa, pb, qa, qb; /* dz/dx of row r is pb + r qb */
	int32_t n;             /* voxels of a column */
	bool joseph;
};

/* sum[j] += pieces of rows row + j, j < CT_PACKET. vol as `at` counts, columns padded. */
CT_SIMD_DECLARE(void, ct_packet_sum,
	(double sum[static CT_PACKET], const struct ct_pieces *restrict s,
		const struct ct_heights *z, double row, const float *restrict vol));
/* vol += the transpose of rows [row, row + rows), rows <= CT_ROWS; value[r - row] holds their
 * values. Only voxels within [0, n) change; the padding behind them is read and written as it is.
 */
CT_SIMD_DECLARE(void, ct_packet_spread,
	(float *restrict vol, const struct ct_pieces *restrict s, const struct ct_heights *z,
		size_t row, size_t rows, const float *restrict value));

#endif
