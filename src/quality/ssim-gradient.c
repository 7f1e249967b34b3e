/* ssim-gradient.c: the gradient of SSIM, tile by tile; see ssim.h and ssim-tile.c. */
#include "config.h"
#include "quality/ssim.h"
#include "quality/ssim-tile.h"

double ct_ssim_back_rows(const struct ct_ssim_rule *r, size_t h, size_t w, size_t first, size_t end,
	float *gx, const float *x, const float *y, const float *weight, double up)
{
	const float scale = (float)(up / ((double)h * (double)w));
	struct ct_ssim_tile t = {.h = h, .w = w, .x = x, .y = y, .weight = weight};
	double sum = 0;

	for (; t.first < w; t.first += CT_SSIM_TILE) {
		t.n = w - t.first < CT_SSIM_TILE ? w - t.first : CT_SSIM_TILE;
		sum += CT_SIMD(ct_ssim_tile_back)(r, &t, first, end, gx, scale);
	}
	return sum;
}

double ct_ssim_back(const struct ct_ssim_rule *r, size_t h, size_t w, float *gx, const float *x,
	const float *y, double up)
{
	return 1 - ct_ssim_back_rows(r, h, w, 0, h, gx, x, y, NULL, up) / ((double)h * (double)w);
}
