/* ssim-kernels.h: the inner parts of ssim.c, whose head explains them. Kernels (core/simd.h).
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_QUALITY_SSIM_KERNELS_H
#define CT_QUALITY_SSIM_KERNELS_H
#include "core/simd.h"
#include "quality/ssim.h"

enum { CT_SSIM_TILE = 128 };

/* Columns [first, first + n), n <= CT_SSIM_TILE, of images h x w; see ct_ssim_back_rows. */
struct ct_ssim_tile {
	size_t h, w, first, n;
	const float *x, *y, *weight;
};

/* Rows [first, end) of it: gx += scale times their gradient, gx h x w; their sum of 1 - SSIM. */
CT_SIMD_DECLARE(double, ct_ssim_tile_back,
	(const struct ct_ssim_rule *r, const struct ct_ssim_tile *t, size_t first, size_t end,
		float *gx, float scale));

enum {
	CT_SSIM_TX = 128,             /* columns of a tile */
	CT_SSIM_PX = CT_SSIM_TX + 16, /* and those that filtering them along x needs */
	CT_SSIM_TZ = 8,               /* slices of a block */
	CT_SSIM_CY = 16,              /* rows of a chunk */
	CT_SSIM_MAPS = 4,
	CT_SSIM_AROUND = CT_SSIM_TAPS - 1,
	/* numbers of scratch: floats or doubles */
	CT_SSIM_PRODUCTS = CT_SSIM_MAPS * (CT_SSIM_TZ + CT_SSIM_AROUND) * CT_SSIM_PX,
	CT_SSIM_ROWS = CT_SSIM_MAPS * CT_SSIM_TZ * CT_SSIM_PX,
	CT_SSIM_LAYER = (CT_SSIM_CY + CT_SSIM_AROUND) * CT_SSIM_TX,
	CT_SSIM_CHUNK = CT_SSIM_TZ * CT_SSIM_MAPS * CT_SSIM_LAYER,
	CT_SSIM_S = CT_SSIM_CY * CT_SSIM_TX,
	CT_SSIM_SCRATCH = CT_SSIM_PRODUCTS + CT_SSIM_ROWS + CT_SSIM_CHUNK + CT_SSIM_S + CT_SSIM_TX
};

/* What is asked of ct_ssim_volume. */
struct ct_ssim_block {
	const struct ct_ssim_rule *rule;
	const struct ct_ssim_map *map;
	int axis;
	size_t n[3], radius[3], crop[3]; /* radius, crop: 0 along axes that are not filtered */
	const float *ref, *test, *mask;
};

/* Slices [z0, z0 + slices), CT_SSIM_TZ at most: the S of the pixels that count are added to sum and
 * their number to count, each by the index along the axis. Of slices across axis 0 both are
 * written up to a multiple of CT_SSIM_TX. In float for values up to twice the data range; scratch
 * is 64-byte aligned. */
CT_SIMD_DECLARE(void, ct_ssim_block_float,
	(const struct ct_ssim_block *b, size_t z0, size_t slices, float *scratch, double *sum,
		double *count));
CT_SIMD_DECLARE(void, ct_ssim_block_double,
	(const struct ct_ssim_block *b, size_t z0, size_t slices, double *scratch, double *sum,
		double *count));

#endif
