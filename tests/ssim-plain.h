/* ssim-plain.h: SSIM of two images by its definition (quality/ssim.h), in double.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TESTS_SSIM_PLAIN_H
#define CT_TESTS_SSIM_PLAIN_H
#include "quality/ssim.h"

#include <stddef.h>

/* S of one pixel by the double sum over its window. */
__attribute__((unused)) static double plain_ssim_pixel(const struct ct_ssim_rule *r, size_t h,
	size_t w, const float *x, const float *y, ptrdiff_t row, ptrdiff_t col)
{
	double mx = 0, my = 0, xx = 0, yy = 0, xy = 0;
	ptrdiff_t radius = (ptrdiff_t)r->radius;

	for (ptrdiff_t a = -radius; a <= radius; a++)
		for (ptrdiff_t b = -radius; b <= radius; b++) {
			ptrdiff_t p = row + a, q = col + b;
			double g = r->tap[a + radius] * r->tap[b + radius], u, v;

			if (p < 0 || q < 0 || p >= (ptrdiff_t)h || q >= (ptrdiff_t)w)
				continue;
			u = (double)x[p * (ptrdiff_t)w + q];
			v = (double)y[p * (ptrdiff_t)w + q];
			mx += g * u;
			my += g * v;
			xx += g * u * u;
			yy += g * v * v;
			xy += g * u * v;
		}
	xx = r->unbias * (xx - mx * mx);
	yy = r->unbias * (yy - my * my);
	xy = r->unbias * (xy - mx * my);
	return (2 * mx * my + r->c1) * (2 * xy + r->c2) /
	       ((mx * mx + my * my + r->c1) * (xx + yy + r->c2));
}

/* Mean SSIM; weight (h x w, or NULL for ones) weights the pixels. */
__attribute__((unused)) static double plain_ssim(const struct ct_ssim_rule *r, size_t h, size_t w,
	const float *x, const float *y, const float *weight)
{
	double sum = 0, count = 0;

	for (size_t i = r->crop; i < h - r->crop; i++)
		for (size_t j = r->crop; j < w - r->crop; j++) {
			double a = weight ? (double)weight[i * w + j] : 1.0;

			sum += a * plain_ssim_pixel(r, h, w, x, y, (ptrdiff_t)i, (ptrdiff_t)j);
			count += a;
		}
	return sum / count;
}

#endif
