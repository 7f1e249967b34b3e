/* ssim-row.c: see ssim-row.h. */
#include "config.h"
#include "quality/ssim-row.h"
#include "core/vec.h"

enum { LANES = CT_F64_LANES };

void CT_SIMD_HERE(ct_ssim_row_load)(
	double *const map[4], size_t w, const float *restrict x, const float *restrict y)
{
	double *restrict a = map[0], *restrict b = map[1];
	double *restrict square = map[2], *restrict product = map[3];

#pragma GCC ivdep
	for (size_t j = 0; j < w; j++) {
		double p = (double)x[j], q = (double)y[j];

		a[j] = p;
		b[j] = q;
		square[j] = p * p + q * q;
		product[j] = p * q;
	}
}

/* All columns, with a radius that the compiler knows. */
CT_INLINE void weigh(double *restrict out, const double *const row[CT_SSIM_TAPS], size_t wp,
	const size_t radius, const double *restrict tap)
{
	for (size_t j = 0; j < wp; j += LANES) {
		ct_f64 sum = tap[radius] * ct_f64_load(row[radius] + j);

#pragma GCC unroll 5
		for (size_t k = 0; k < radius; k++)
			sum += tap[k] *
			       (ct_f64_load(row[k] + j) + ct_f64_load(row[2 * radius - k] + j));
		ct_f64_store(out + j, sum);
	}
}

void CT_SIMD_HERE(ct_ssim_row_across)(double *out, const double *const row[CT_SSIM_TAPS], size_t wp,
	size_t radius, const double *tap)
{
	if (radius == 5)
		weigh(out, row, wp, 5, tap);
	else
		weigh(out, row, wp, 3, tap);
}

void CT_SIMD_HERE(ct_ssim_row_along)(
	double *out, const double *in, size_t wp, size_t radius, const double *tap)
{
	const double *row[CT_SSIM_TAPS];

	for (size_t k = 0; k < CT_SSIM_TAPS; k++)
		row[k] = in + k;
	if (radius == 5)
		weigh(out, row, wp, 5, tap);
	else
		weigh(out, row, wp, 3, tap);
}

void CT_SIMD_HERE(ct_ssim_row_similarity)(
	double *restrict s, const double *const mean[4], size_t wp, const struct ct_ssim_rule *r)
{
	const double *restrict mx = mean[0], *restrict my = mean[1];
	const double *restrict e2 = mean[2], *restrict exy = mean[3];
	const double c1 = r->c1, c2 = r->c2, unbias = r->unbias;

#pragma GCC ivdep
	for (size_t i = 0; i < wp; i++) {
		double xy = mx[i] * my[i], m2 = mx[i] * mx[i] + my[i] * my[i];

		s[i] = (2 * xy + c1) * (2 * unbias * (exy[i] - xy) + c2) /
		       ((m2 + c1) * (unbias * (e2[i] - m2) + c2));
	}
}
