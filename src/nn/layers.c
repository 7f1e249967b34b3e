/* layers.c: see layers.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "nn/layers.h"
#include "core/vec-exp.h"

#include <math.h>

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

void CT_SIMD_HERE(ct_layer_softmax)(size_t rows, size_t n, float *w)
{
	for (size_t i = 0; i < rows; i++) {
		float *row = w + i * n, top = row[0], part[LANES], scale;
		ct_f32 parts[LANES / CT_F32_LANES] = {{0}};
		double sum = 0;
		size_t j = 0;

		for (size_t k = 1; k < n; k++)
			top = row[k] > top ? row[k] : top;
		for (; j + LANES <= n; j += LANES)
			for (size_t q = 0; q < LANES / CT_F32_LANES; q++) {
				float *at = row + j + q * CT_F32_LANES;
				const ct_f32 v = ct_f32_exp(ct_f32_load(at) - top);

				ct_f32_store(at, v);
				parts[q] += v;
			}
		for (; j < n; j++) {
			row[j] = ct_f32_exp(ct_f32_set(row[j] - top))[0];
			sum += (double)row[j];
		}
		memcpy(part, parts, sizeof part);
		for (size_t l = 0; l < LANES; l++)
			sum += (double)part[l];
		scale = (float)(1.0 / sum);
		for (j = 0; j < n; j++)
			row[j] *= scale;
	}
}

void CT_SIMD_HERE(ct_layer_softmax_back)(
	size_t rows, size_t n, float *restrict dw, const float *restrict w)
{
	for (size_t i = 0; i < rows; i++) {
		float part[LANES] = {0}, mean;
		double sum = 0;
		size_t j = 0;

		for (; j + LANES <= n; j += LANES)
			for (size_t l = 0; l < LANES; l++)
				part[l] += w[i * n + j + l] * dw[i * n + j + l];
		for (; j < n; j++)
			sum += (double)(w[i * n + j] * dw[i * n + j]);
		for (size_t l = 0; l < LANES; l++)
			sum += (double)part[l];
		mean = (float)sum;
		for (j = 0; j < n; j++)
			dw[i * n + j] = w[i * n + j] * (dw[i * n + j] - mean);
	}
}

void CT_SIMD_HERE(ct_layer_embed)(size_t dim, float *emb, double t)
{
	const size_t half = dim / 2;

	for (size_t i = 0; i < half; i++) {
		double f = exp(-log(10000.0) * (double)i / (double)half);

		emb[i] = (float)cos(t * f);
		emb[half + i] = (float)sin(t * f);
	}
	if (dim % 2)
		emb[dim - 1] = 0.0f;
}
