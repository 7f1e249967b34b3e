/* pointwise.c: see pointwise.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "nn/pointwise.h"
#include "core/vec-exp.h"

#include <math.h>

/* Phi(x), to 2e-7. erfc(z) = t exp(-z^2 + p(t)), t = 1 / (1 + z/2), z >= 0, to 1.2e-7 relative:
 * Press et al., Numerical recipes, 1992, section 6.2. */
CT_INLINE ct_f32 distribution(ct_f32 x)
{
	static const float p[] = {-0.82215223f, 1.48851587f, -1.13520398f, 0.27886807f,
		-0.18628806f, 0.09678418f, 0.37409196f, 1.00002368f, -1.26551223f};
	const ct_f32 z = ct_f32_abs(x) * 0.70710678f, t = 1.0f / (1.0f + 0.5f * z);
	ct_f32 s = ct_f32_set(0.17087277f), tail;

#pragma GCC unroll 9
	for (int k = 0; k < 9; k++)
		s = s * t + p[k];
	tail = 0.5f * t * ct_f32_exp(s - z * z);
	return ct_f32_pick((ct_i32)(x < 0.0f), tail, 1.0f - tail);
}

CT_INLINE ct_f32 gelu(ct_f32 x)
{
	return x * distribution(x);
}

CT_INLINE ct_f32 gelu_slope(ct_f32 x)
{
	return distribution(x) + x * 0.39894228f * ct_f32_exp(-0.5f * x * x);
}

CT_INLINE ct_f32 value(enum ct_pointwise f, ct_f32 x)
{
	switch (f) {
	case CT_POINTWISE_GELU: return gelu(x);
	case CT_POINTWISE_SIGMOID: return ct_f32_sigmoid(x);
	case CT_POINTWISE_RELU: break;
	}
	return ct_f32_pick((ct_i32)(x < 0.0f), ct_f32_set(0), x); /* NaN stays */
}

CT_INLINE ct_f32 slope(enum ct_pointwise f, ct_f32 x)
{
	ct_f32 s;

	switch (f) {
	case CT_POINTWISE_GELU: return gelu_slope(x);
	case CT_POINTWISE_SIGMOID: s = ct_f32_sigmoid(x); return s * (1.0f - s);
	case CT_POINTWISE_RELU: break;
	}
	return ct_f32_pick((ct_i32)(x > 0.0f), ct_f32_set(1), ct_f32_set(0));
}

void CT_SIMD_HERE(ct_pointwise_forward)(enum ct_pointwise f, size_t n, float *y, const float *x)
{
	for (size_t i = 0; i < n; i += CT_F32_LANES)
		ct_f32_store_n(y + i, value(f, ct_f32_load_n(x + i, n - i)), n - i);
}

/* dx (+)= d, of the first n of a vector. */
CT_INLINE void give(float *dx, ct_f32 d, size_t n, bool acc)
{
	if (acc)
		d += ct_f32_load_n(dx, n);
	ct_f32_store_n(dx, d, n);
}

void CT_SIMD_HERE(ct_pointwise_back)(
	enum ct_pointwise f, size_t n, float *dx, const float *dy, const float *x, bool acc)
{
	for (size_t i = 0; i < n; i += CT_F32_LANES)
		give(dx + i, ct_f32_load_n(dy + i, n - i) * slope(f, ct_f32_load_n(x + i, n - i)),
			n - i, acc);
}

void CT_SIMD_HERE(ct_pointwise_gate_forward)(size_t hw, size_t c, float *y, const float *x)
{
	for (size_t p = 0; p < hw; p++, y += c, x += 2 * c)
		for (size_t i = 0; i < c; i += CT_F32_LANES)
			ct_f32_store_n(y + i,
				gelu(ct_f32_load_n(x + i, c - i)) * ct_f32_load_n(x + c + i, c - i),
				c - i);
}

void CT_SIMD_HERE(ct_pointwise_gate_back)(
	size_t hw, size_t c, float *dx, const float *dy, const float *x, bool acc)
{
	for (size_t p = 0; p < hw; p++, dy += c, dx += 2 * c, x += 2 * c)
		for (size_t i = 0; i < c; i += CT_F32_LANES) {
			const size_t n = c - i;
			const ct_f32 d = ct_f32_load_n(dy + i, n), a = ct_f32_load_n(x + i, n),
				     b = ct_f32_load_n(x + c + i, n);

			give(dx + i, d * b * gelu_slope(a), n, acc);
			give(dx + c + i, d * gelu(a), n, acc);
		}
}

void CT_SIMD_HERE(ct_pointwise_times_forward)(
	size_t hw, size_t c, bool one, float *y, const float *x, const float *b)
{
	for (size_t p = 0; p < hw; p++)
		for (size_t i = 0; i < c; i++)
			y[p * c + i] = x[p * c + i] * b[(one ? 0 : p * c) + i];
}

void CT_SIMD_HERE(ct_pointwise_times_back)(
	size_t hw, size_t c, bool one, float *dx, const float *dy, const float *b, bool acc)
{
	for (size_t p = 0; p < hw; p++)
		for (size_t i = 0; i < c; i++) {
			const float d = dy[p * c + i] * b[(one ? 0 : p * c) + i];

			dx[p * c + i] = acc ? dx[p * c + i] + d : d;
		}
}

void CT_SIMD_HERE(ct_pointwise_times_sum)(size_t hw, size_t c, float *db, const float *dy,
	const float *x, bool acc, double *restrict sum)
{
	memset(sum, 0, c * sizeof *sum);
	for (size_t p = 0; p < hw; p++)
		for (size_t i = 0; i < c; i++)
			sum[i] += (double)(dy[p * c + i] * x[p * c + i]);
	for (size_t i = 0; i < c; i++)
		db[i] = (float)((acc ? (double)db[i] : 0) + sum[i]);
}

enum { LANES = 16 }; /* partial sums */

/* Sum of n values (x - at) (y - to), in a fixed order. */
CT_INLINE double product(size_t n, const float *x, float at, const float *y, float to)
{
	float part[LANES] = {0};
	double sum = 0;
	size_t i = 0;

	for (; i + LANES <= n; i += LANES)
		for (size_t l = 0; l < LANES; l++)
			part[l] += (x[i + l] - at) * (y[i + l] - to);
	for (; i < n; i++)
		sum += (double)((x[i] - at) * (y[i] - to));
	for (size_t l = 0; l < LANES; l++)
		sum += (double)part[l];
	return sum;
}

CT_INLINE float mean_of(size_t n, const float *x)
{
	double sum = 0;

	for (size_t i = 0; i < n; i++)
		sum += (double)x[i];
	return (float)(sum / (double)n);
}

void CT_SIMD_HERE(ct_pointwise_norm_forward)(size_t hw, size_t c, double eps, float *restrict y,
	const float *restrict x, const float *restrict gamma, const float *restrict beta)
{
	for (size_t p = 0; p < hw; p++, x += c, y += c) {
		const float mean = mean_of(c, x);
		const float by = (float)(1 / sqrt(product(c, x, mean, x, mean) / (double)c + eps));

		for (size_t i = 0; i < c; i++)
			y[i] = gamma[i] * ((x[i] - mean) * by) + beta[i];
	}
}

/* With h = (x - mean) by and g = gamma dy: dx = by (g - mean g - h mean (g h)). */
void CT_SIMD_HERE(ct_pointwise_norm_back)(size_t hw, size_t c, double eps, float *restrict dx,
	float *restrict dgamma, float *restrict dbeta, const float *restrict dy,
	const float *restrict x, const float *restrict gamma, bool acc, double *restrict sum)
{
	double *restrict const shift = sum + c;

	memset(sum, 0, 2 * c * sizeof *sum);
	for (size_t p = 0; p < hw; p++, x += c, dx += c, dy += c) {
		const float mean = mean_of(c, x);
		const float by = (float)(1 / sqrt(product(c, x, mean, x, mean) / (double)c + eps));
		double g = 0, gh = 0;

		for (size_t i = 0; i < c; i++) {
			const double d = (double)dy[i], h = (double)((x[i] - mean) * by);

			g += d * (double)gamma[i];
			gh += d * (double)gamma[i] * h;
			sum[i] += d * h;
			shift[i] += d;
		}
		g /= (double)c;
		gh /= (double)c;
		for (size_t i = 0; i < c; i++) {
			const float h = (x[i] - mean) * by;
			const float d = by * (gamma[i] * dy[i] - (float)g - h * (float)gh);

			dx[i] = acc ? dx[i] + d : d;
		}
	}
	for (size_t i = 0; dgamma && i < c; i++) {
		dgamma[i] += (float)sum[i];
		dbeta[i] += (float)shift[i];
	}
}
