/* ssim-tile.h: the gradient of SSIM of a tile of columns. A kernel (core/simd.h). */
#ifndef CT_QUALITY_SSIM_TILE_H
#define CT_QUALITY_SSIM_TILE_H
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

#endif
