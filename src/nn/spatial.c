/* spatial.c: see spatial.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "nn/spatial.h"
#include "core/vec.h"

#include <string.h>

void CT_SIMD_HERE(ct_spatial_shuffle_forward)(
	size_t h, size_t w, size_t c, size_t r, float *restrict y, const float *restrict x)
{
	for (size_t p = 0; p < h * w; p++)
		for (size_t i = 0; i < r; i++)
			for (size_t j = 0; j < r; j++) {
				float *to = y + ((p / w * r + i) * w * r + p % w * r + j) * c;

				for (size_t k = 0; k < c; k++)
					to[k] = x[((p * c + k) * r + i) * r + j];
			}
}

void CT_SIMD_HERE(ct_spatial_shuffle_back)(size_t h, size_t w, size_t c, size_t r,
	float *restrict dx, const float *restrict dy, bool acc)
{
	for (size_t p = 0; p < h * w; p++)
		for (size_t i = 0; i < r; i++)
			for (size_t j = 0; j < r; j++) {
				const float *g = dy + ((p / w * r + i) * w * r + p % w * r + j) * c;

				for (size_t k = 0; k < c; k++) {
					float *to = dx + ((p * c + k) * r + i) * r + j;

					*to = acc ? *to + g[k] : g[k];
				}
			}
}

/* [9][c] from [c][3][3]; turned: the last tap first. */
CT_INLINE void taps(size_t c, float *restrict to, const float *restrict weight, bool turned)
{
	for (size_t t = 0; t < 9; t++)
		for (size_t k = 0; k < c; k++)
			to[t * c + k] = weight[k * 9 + (turned ? 8 - t : t)];
}

/* y[c] += sum over the taps inside the picture, at pixel (i, j). */
CT_INLINE void pixel(size_t h, size_t w, size_t c, size_t i, size_t j, float *restrict y,
	const float *restrict x, const float *restrict tap)
{
	for (size_t a = i ? 0 : 1; a < 3 && i + a <= h; a++)
		for (size_t b = j ? 0 : 1; b < 3 && j + b <= w; b++) {
			const float *from = x + ((i + a - 1) * w + j + b - 1) * c;
			const float *by = tap + (3 * a + b) * c;

			for (size_t k = 0; k < c; k++)
				y[k] += by[k] * from[k];
		}
}

void CT_SIMD_HERE(ct_spatial_depth_forward)(size_t h, size_t w, size_t c, float *y, const float *x,
	const float *weight, const float *bias, float *scratch)
{
	taps(c, scratch, weight, false);
	for (size_t i = 0; i < h; i++)
		for (size_t j = 0; j < w; j++) {
			float *to = y + (i * w + j) * c;

			memcpy(to, bias, c * sizeof *to);
			pixel(h, w, c, i, j, to, x, scratch);
		}
}

/* sum[10][c] += dy x of each tap and dy, of row i. */
CT_INLINE void row_sums(size_t h, size_t w, size_t c, size_t i, float *restrict sum,
	const float *restrict dy, const float *restrict x)
{
	for (size_t j = 0; j < w; j++) {
		const float *g = dy + (i * w + j) * c;

		for (size_t a = i ? 0 : 1; a < 3 && i + a <= h; a++)
			for (size_t b = j ? 0 : 1; b < 3 && j + b <= w; b++) {
				const float *from = x + ((i + a - 1) * w + j + b - 1) * c;
				float *to = sum + (3 * a + b) * c;

				for (size_t k = 0; k < c; k++)
					to[k] += g[k] * from[k];
			}
		for (size_t k = 0; k < c; k++)
			sum[9 * c + k] += g[k];
	}
}

void CT_SIMD_HERE(ct_spatial_depth_back)(size_t h, size_t w, size_t c, float *dx, float *dw,
	float *db, const float *dy, const float *x, const float *weight, bool acc, float *scratch)
{
	double *all = (double *)(void *)scratch; /* [10][c] */
	float *row = scratch + 20 * c, *tap = row + 10 * c;

	taps(c, tap, weight, true);
	memset(all, 0, 10 * c * sizeof *all);
	for (size_t i = 0; i < h; i++) {
		for (size_t j = 0; j < w; j++) {
			float *to = dx + (i * w + j) * c;

			if (!acc)
				memset(to, 0, c * sizeof *to);
			pixel(h, w, c, i, j, to, dy, tap);
		}
		if (!dw)
			continue;
		memset(row, 0, 10 * c * sizeof *row);
		row_sums(h, w, c, i, row, dy, x);
		for (size_t k = 0; k < 10 * c; k++)
			all[k] += (double)row[k];
	}
	for (size_t k = 0; dw && k < c; k++) {
		for (size_t t = 0; t < 9; t++)
			dw[k * 9 + t] += (float)all[t * c + k];
		db[k] += (float)all[9 * c + k];
	}
}

void CT_SIMD_HERE(ct_spatial_mean_forward)(
	size_t hw, size_t c, float *restrict y, const float *restrict x, double *restrict sum)
{
	memset(sum, 0, c * sizeof *sum);
	for (size_t p = 0; p < hw; p++)
		for (size_t k = 0; k < c; k++)
			sum[k] += (double)x[p * c + k];
	for (size_t k = 0; k < c; k++)
		y[k] = (float)(sum[k] / (double)hw);
}

void CT_SIMD_HERE(ct_spatial_mean_back)(
	size_t hw, size_t c, float *restrict dx, const float *restrict dy, bool acc)
{
	const float by = (float)(1.0 / (double)hw);

	for (size_t p = 0; p < hw; p++)
		for (size_t k = 0; k < c; k++)
			dx[p * c + k] = (acc ? dx[p * c + k] : 0.0f) + by * dy[k];
}

void CT_SIMD_HERE(ct_spatial_pool_forward)(size_t h, size_t w, size_t c, size_t k, size_t step,
	float *restrict y, const float *restrict x)
{
	const size_t nh = (h - k) / step + 1, nw = (w - k) / step + 1;

	for (size_t p = 0; p < nh * nw; p++, y += c) {
		const float *at = x + (p / nw * step * w + p % nw * step) * c;

		memcpy(y, at, c * sizeof *y);
		for (size_t q = 1; q < k * k; q++)
			for (size_t z = 0; z < c; z++) {
				const float v = at[(q / k * w + q % k) * c + z];

				y[z] = v <= y[z] ? y[z] : v; /* NaN is found */
			}
	}
}

void CT_SIMD_HERE(ct_spatial_pool_back)(size_t h, size_t w, size_t c, size_t k, size_t step,
	float *restrict dx, const float *restrict dy, const float *restrict x, bool acc)
{
	const size_t nh = (h - k) / step + 1, nw = (w - k) / step + 1;

	if (!acc)
		memset(dx, 0, h * w * c * sizeof *dx);
	for (size_t p = 0; p < nh * nw; p++)
		for (size_t z = 0; z < c; z++) {
			const size_t at = (p / nw * step * w + p % nw * step) * c + z;
			size_t most = at;

			for (size_t q = 1; q < k * k; q++) {
				const size_t to = at + (q / k * w + q % k) * c;

				most = x[to] > x[most] ? to : most;
			}
			dx[most] += dy[p * c + z];
		}
}

/* The two neighbours of pixel i of n in a line of m, and the weight of the second. */
CT_INLINE float neighbours(size_t i, size_t n, size_t m, size_t at[static 2])
{
	const double u = ((double)i + 0.5) * (double)m / (double)n - 0.5, v = u > 0 ? u : 0;

	at[0] = (size_t)v < m ? (size_t)v : m - 1;
	at[1] = at[0] + 1 < m ? at[0] + 1 : at[0];
	return (float)(v - (double)at[0]);
}

void CT_SIMD_HERE(ct_spatial_stretch_forward)(size_t h, size_t w, size_t nh, size_t nw, size_t c,
	float *restrict y, const float *restrict x)
{
	for (size_t i = 0; i < nh; i++) {
		size_t r[2], q[2];
		const float b = neighbours(i, nh, h, r);

		for (size_t j = 0; j < nw; j++, y += c) {
			const float a = neighbours(j, nw, w, q);
			const float *p0 = x + (r[0] * w + q[0]) * c,
				    *p1 = x + (r[0] * w + q[1]) * c;
			const float *p2 = x + (r[1] * w + q[0]) * c,
				    *p3 = x + (r[1] * w + q[1]) * c;

			for (size_t k = 0; k < c; k++)
				y[k] = (1 - b) * ((1 - a) * p0[k] + a * p1[k]) +
				       b * ((1 - a) * p2[k] + a * p3[k]);
		}
	}
}

void CT_SIMD_HERE(ct_spatial_stretch_back)(size_t h, size_t w, size_t nh, size_t nw, size_t c,
	float *restrict dx, const float *restrict dy, bool acc)
{
	if (!acc)
		memset(dx, 0, h * w * c * sizeof *dx);
	for (size_t i = 0; i < nh; i++) {
		size_t r[2], q[2];
		const float b = neighbours(i, nh, h, r);

		for (size_t j = 0; j < nw; j++, dy += c) {
			const float a = neighbours(j, nw, w, q);

			for (size_t n = 0; n < 4; n++) {
				const float by = (n / 2 ? b : 1 - b) * (n % 2 ? a : 1 - a);
				float *to = dx + (r[n / 2] * w + q[n % 2]) * c;

				for (size_t k = 0; k < c; k++)
					to[k] += by * dy[k];
			}
		}
	}
}
