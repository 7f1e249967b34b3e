/* layers.c: see layers.h. */
#include "config.h"
#include "unet/layers.h"
#include "unet/sigmoid.h"

enum { LANES = 16 }; /* partial sums */

void CT_SIMD_HERE(ct_layer_silu_forward)(size_t n, float *y, const float *x)
{
	for (size_t i = 0; i < n; i += CT_F32_LANES) {
		const ct_f32 v = ct_f32_load_n(x + i, n - i);

		ct_f32_store_n(y + i, v * ct_f32_sigmoid(v), n - i);
	}
}

void CT_SIMD_HERE(ct_layer_silu_back)(
	size_t n, float *dx, const float *dy, const float *x, bool acc)
{
	for (size_t i = 0; i < n; i += CT_F32_LANES) {
		const ct_f32 v = ct_f32_load_n(x + i, n - i), s = ct_f32_sigmoid(v);
		ct_f32 d = ct_f32_load_n(dy + i, n - i) * s * (1.0f + v * (1.0f - s));

		if (acc)
			d += ct_f32_load_n(dx + i, n - i);
		ct_f32_store_n(dx + i, d, n - i);
	}
}

void CT_SIMD_HERE(ct_layer_linear_forward)(size_t ci, size_t co, float *restrict y,
	const float *restrict x, const float *restrict w, const float *restrict b)
{
	for (size_t o = 0; o < co; o++) {
		const float *row = w + o * ci;
		float part[LANES] = {0};
		double sum = (double)b[o];
		size_t i = 0;

		for (; i + LANES <= ci; i += LANES)
			for (size_t l = 0; l < LANES; l++)
				part[l] += row[i + l] * x[i + l];
		for (size_t l = 0; l < LANES; l++)
			sum += (double)part[l];
		for (; i < ci; i++)
			sum += (double)(row[i] * x[i]);
		y[o] = (float)sum;
	}
}

void CT_SIMD_HERE(ct_layer_linear_back)(size_t ci, size_t co, float *restrict dx,
	float *restrict dw, float *restrict db, const float *restrict dy, const float *restrict x,
	const float *restrict w, bool acc)
{
	if (!acc)
		memset(dx, 0, ci * sizeof *dx);
	for (size_t o = 0; o < co; o++) {
		const float g = dy[o];

		db[o] += g;
		for (size_t i = 0; i < ci; i++) {
			dw[o * ci + i] += g * x[i];
			dx[i] += g * w[o * ci + i];
		}
	}
}

void CT_SIMD_HERE(ct_layer_up_forward)(
	size_t h, size_t w, size_t c, float *restrict y, const float *restrict x)
{
	for (size_t i = 0; i < h; i++) {
		float *row = y + 2 * i * 2 * w * c;

		for (size_t j = 0; j < w; j++) {
			memcpy(row + 2 * j * c, x + (i * w + j) * c, c * sizeof *y);
			memcpy(row + (2 * j + 1) * c, x + (i * w + j) * c, c * sizeof *y);
		}
		memcpy(row + 2 * w * c, row, 2 * w * c * sizeof *y);
	}
}

/* y[c] (+)= gain (a + b + p + q). */
CT_INLINE void sum4(size_t c, float *restrict y, float gain, const float *restrict a,
	const float *restrict b, const float *restrict p, const float *restrict q, bool acc)
{
	if (acc)
		for (size_t k = 0; k < c; k++)
			y[k] += gain * ((a[k] + b[k]) + (p[k] + q[k]));
	else
		for (size_t k = 0; k < c; k++)
			y[k] = gain * ((a[k] + b[k]) + (p[k] + q[k]));
}

/* y[h][w][c] (+)= gain times the sum of 2 x 2 of x[2h][2w][c]. */
CT_INLINE void gather(size_t h, size_t w, size_t c, float *restrict y, float gain,
	const float *restrict x, bool acc)
{
	for (size_t i = 0; i < h; i++)
		for (size_t j = 0; j < w; j++) {
			const float *a = x + (2 * i * 2 * w + 2 * j) * c, *p = a + 2 * w * c;

			sum4(c, y + (i * w + j) * c, gain, a, a + c, p, p + c, acc);
		}
}

void CT_SIMD_HERE(ct_layer_up_back)(
	size_t h, size_t w, size_t c, float *dx, const float *dy, bool acc)
{
	gather(h, w, c, dx, 1.0f, dy, acc);
}

void CT_SIMD_HERE(ct_layer_down_forward)(size_t h, size_t w, size_t c, float *y, const float *x)
{
	gather(h / 2, w / 2, c, y, 0.25f, x, false);
}

void CT_SIMD_HERE(ct_layer_down_back)(
	size_t h, size_t w, size_t c, float *restrict dx, const float *restrict dy, bool acc)
{
	for (size_t i = 0; i < h; i++)
		for (size_t j = 0; j < w; j++) {
			const float *g = dy + (i / 2 * (w / 2) + j / 2) * c;
			float *d = dx + (i * w + j) * c;

			for (size_t k = 0; k < c; k++)
				d[k] = (acc ? d[k] : 0.0f) + 0.25f * g[k];
		}
}

void CT_SIMD_HERE(ct_layer_concat_forward)(size_t hw, size_t ca, size_t cb, float *restrict y,
	const float *restrict a, const float *restrict b)
{
	for (size_t i = 0; i < hw; i++) {
		memcpy(y + i * (ca + cb), a + i * ca, ca * sizeof *y);
		memcpy(y + i * (ca + cb) + ca, b + i * cb, cb * sizeof *y);
	}
}

/* y (+)= x. */
CT_INLINE void take(size_t n, float *restrict y, const float *restrict x, bool acc)
{
	if (!acc) {
		memcpy(y, x, n * sizeof *y);
		return;
	}
	for (size_t i = 0; i < n; i++)
		y[i] += x[i];
}

void CT_SIMD_HERE(ct_layer_concat_back)(size_t hw, size_t c, size_t first, size_t cx,
	float *restrict dx, const float *restrict dy, bool acc)
{
	for (size_t i = 0; i < hw; i++)
		take(cx, dx + i * cx, dy + i * c + first, acc);
}

void CT_SIMD_HERE(ct_layer_take)(size_t n, float *y, const float *x, bool acc)
{
	take(n, y, x, acc);
}

void CT_SIMD_HERE(ct_layer_to_last)(size_t hw, size_t c, float *restrict y, const float *restrict x)
{
	for (size_t i = 0; i < hw; i++)
		for (size_t k = 0; k < c; k++)
			y[i * c + k] = x[k * hw + i];
}

void CT_SIMD_HERE(ct_layer_to_first)(
	size_t hw, size_t c, float *restrict y, const float *restrict x)
{
	for (size_t k = 0; k < c; k++)
		for (size_t i = 0; i < hw; i++)
			y[k * hw + i] = x[i * c + k];
}
