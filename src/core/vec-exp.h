/* vec-exp.h: the exponential on vectors (vec.h), for kernels. No branch, no table: the same bits at
 * every level. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_CORE_VEC_EXP_H
#define CT_CORE_VEC_EXP_H
#include "core/vec.h"

/* e^x to 1.2e-7 relative for -87 <= x <= 88, as at the end beyond; NaN gives NaN. x = n ln 2 + r,
 * |r| <= ln 2 / 2: 2^n goes into the exponent, e^r is its Taylor series up to r^7/7! (remainder
 * 5e-9). */
CT_INLINE ct_f32 ct_f32_exp(ct_f32 x)
{
	const ct_f32 magic = ct_f32_set(12582912.0f);
	const ct_f32 c = ct_f32_max(ct_f32_set(-87.0f), ct_f32_min(ct_f32_set(88.0f), x));
	const ct_f32 t = c * 1.44269504f + magic, n = t - magic;
	const ct_f32 r = (c - n * 0.693359375f) + n * 2.12194440e-4f;
	static const float taylor[] = {
		1.38888889e-3f, 8.33333333e-3f, 4.16666667e-2f, 1.66666667e-1f, 0.5f, 1.0f, 1.0f};
	ct_f32 p = ct_f32_set(1.98412698e-4f);

#pragma GCC unroll 7
	for (int k = 0; k < 7; k++)
		p = p * r + taylor[k];
	return p * (ct_f32)(((ct_u32)t + 127u) << 23);
}

/* 1/(1 + e^-x). */
CT_INLINE ct_f32 ct_f32_sigmoid(ct_f32 x)
{
	return 1.0f / (1.0f + ct_f32_exp(-x));
}

/* e^x, |x| <= 700 (as at the end beyond), to 4e-16 relative; likewise, up to r^13/13!. */
CT_INLINE ct_f64 ct_f64_exp(ct_f64 x)
{
	const ct_f64 magic = ct_f64_set(6755399441055744.0);
	const ct_f64 c = ct_f64_min(ct_f64_set(700), ct_f64_max(ct_f64_set(-700), x));
	const ct_f64 t = c * 1.4426950408889634 + magic, n = t - magic;
	const ct_f64 r = c - n * 6.93147180369123816490e-01 - n * 1.90821492927058770002e-10;
	static const double factorial[] = {
		479001600, 39916800, 3628800, 362880, 40320, 5040, 720, 120, 24, 6, 2, 1, 1};
	ct_f64 y = ct_f64_set(1.0 / 6227020800.0);

#pragma GCC unroll 13
	for (int k = 0; k < 13; k++)
		y = y * r + 1.0 / factorial[k];
	/* the low bits of t are those of n */
	return y * (ct_f64)(((ct_i64)t << 52) + ((int64_t)1023 << 52));
}

#endif
