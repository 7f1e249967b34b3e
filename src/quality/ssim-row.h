/* ssim-row.h: rows of the four maps of ssim.c. Kernels (core/simd.h).
 *
 * Rows are wp columns, a multiple of CT_SSIM_ROW. Filters are symmetric: their two ends are added
 * first. Nothing overlaps.
 */
#ifndef CT_QUALITY_SSIM_ROW_H
#define CT_QUALITY_SSIM_ROW_H
#include "core/simd.h"
#include "quality/ssim.h"

enum { CT_SSIM_ROW = 16 };

/* map[0..3][j] = x, y, x^2 + y^2 and xy of w pixels. */
CT_SIMD_DECLARE(
	void, ct_ssim_row_load, (double *const map[4], size_t w, const float *x, const float *y));
/* out[j] = sum_k tap[k] in[j + k]. */
CT_SIMD_DECLARE(void, ct_ssim_row_along,
	(double *out, const double *in, size_t wp, size_t radius, const double *tap));
/* out[j] = sum_k tap[k] row[k][j], k <= 2 radius. */
CT_SIMD_DECLARE(void, ct_ssim_row_across,
	(double *out, const double *const row[CT_SSIM_TAPS], size_t wp, size_t radius,
		const double *tap));
/* s = S of the means of the four maps. */
CT_SIMD_DECLARE(void, ct_ssim_row_similarity,
	(double *s, const double *const mean[4], size_t wp, const struct ct_ssim_rule *r));

#endif
