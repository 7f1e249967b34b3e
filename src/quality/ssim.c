/* ssim.c: the rules of SSIM, and its gradient tile by tile; see ssim.h and ssim-tile.c. */
#include "config.h"
#include "quality/ssim.h"
#include "quality/ssim-tile.h"

#include <math.h>
#include <stdbool.h>

void ct_ssim_rule(struct ct_ssim_rule *r, enum ct_ssim_kind kind, double range)
{
	bool box = kind == CT_SSIM_SKIMAGE || kind == CT_SSIM_SKIMAGE11 || kind == CT_SSIM_3D;
	double sum = 0, voxels = 1;

	*r = (struct ct_ssim_rule){.unbias = 1};
	r->dims = kind == CT_SSIM_3D || kind == CT_SSIM_3D_GAUSS ? 3 : 2;
	r->radius = kind == CT_SSIM_SKIMAGE || kind == CT_SSIM_3D ? 3 : 5;
	for (size_t k = 0; k <= 2 * r->radius; k++) {
		double d = (double)k - (double)r->radius;

		r->tap[k] = box ? 1.0 : exp(-d * d / (2 * 1.5 * 1.5));
		sum += r->tap[k];
	}
	for (size_t k = 0; k <= 2 * r->radius; k++)
		r->tap[k] /= sum;
	for (int d = 0; d < r->dims; d++)
		voxels *= (double)(2 * r->radius + 1);
	if (box)
		r->unbias = voxels / (voxels - 1);
	if (kind != CT_SSIM_R2)
		r->crop = r->radius;
	r->c1 = 0.01 * range * (0.01 * range);
	r->c2 = 0.03 * range * (0.03 * range);
}

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
