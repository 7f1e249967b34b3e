/* ssim-tile.c: see ssim-kernels.h.
 *
 * In float, of the sum s = x + y and the difference d = x - y: with S, D their means and V, E their
 * variances under the window
 *
 *   b1 = (S^2 + D^2)/2 + C1,   a1 = b1 - D^2,   b2 = (V + E)/2 + C2,   a2 = b2 - E
 *   SSIM = a1 a2 / (b1 b2),    1 - SSIM = (b1 E + a2 D^2)/(b1 b2)
 *
 * so that images which are nearly equal lose no digits; the slopes to S, D and to the means of s^2
 * and d^2 are written with E, D^2 and 1 - SSIM for the same reason. V itself is a difference, off
 * by some 1e-7 S^2, which counts beside C2: images should be of the order of one.
 *
 * Tiles of columns, each in one pass over the rows. A ring holds the last 11 rows of the four maps
 * filtered along the row; the gradient runs one more such ring behind, over the three maps of
 * slopes: the filter is symmetric and zero outside, hence its own adjoint. All of it stays in the
 * first cache. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "quality/ssim-kernels.h"
#include "core/vec.h"

enum {
	R = CT_SSIM_TAPS / 2,
	L = CT_F32_LANES,
	BLOCK = 16, /* columns are rounded up to it */
	TILE = CT_SSIM_TILE,
	WIDE = (TILE + 2 * R + BLOCK - 1) / BLOCK * BLOCK, /* of the slopes that a tile needs */
	IN = WIDE + BLOCK,                                 /* of the pixels that those need */
	MAPS = 4,
	GRADS = 3
};

struct work {
	float in[MAPS][IN];
	float ring[CT_SSIM_TAPS][MAPS][WIDE];
	float slope[GRADS][WIDE], less[WIDE]; /* less: 1 - SSIM */
	float slope_ring[CT_SSIM_TAPS][GRADS][TILE];
	float c1, c2;
};

/* The window over eleven vectors. */
CT_INLINE ct_f32 window(const float *const row[CT_SSIM_TAPS], size_t at, const ct_f32 tap[R + 1])
{
	ct_f32 acc = tap[R] * ct_f32_load(row[R] + at);

#pragma GCC unroll 5
	for (size_t k = 0; k < R; k++)
		acc += tap[k] * (ct_f32_load(row[k] + at) + ct_f32_load(row[2 * R - k] + at));
	return acc;
}

/* out[j] = sum_k tap[k] in[j + k]. */
CT_INLINE void along(float *out, const float *in, size_t n, const ct_f32 tap[R + 1])
{
	const float *row[CT_SSIM_TAPS];

	for (size_t k = 0; k < CT_SSIM_TAPS; k++)
		row[k] = in + k;
	for (size_t j = 0; j < n; j += L)
		ct_f32_store(out + j, window(row, j, tap));
}

/* out[k] = map m of the k-th of the eleven rows of a ring that end with row r. */
#define RING(out, ring, r, m)                                                                      \
	for (size_t k_ = 0; k_ < CT_SSIM_TAPS; k_++)                                               \
	(out)[k_] = (ring)[((r) + 1 + k_) % CT_SSIM_TAPS][m]

/* Row r of the image (beyond it: zeros), filtered along, into the ring. */
CT_INLINE void take(struct work *k, const struct ct_ssim_tile *t, size_t r, const ct_f32 tap[R + 1])
{
	const size_t skip = t->first < 2 * R ? 2 * R - t->first : 0;
	const size_t from = t->first + skip - 2 * R;
	const size_t n = t->w - from < IN - skip ? t->w - from : IN - skip;
	float x[IN] = {0}, y[IN] = {0};

	if (r >= t->h) {
		memset(k->ring[r % CT_SSIM_TAPS], 0, sizeof k->ring[0]);
		return;
	}
	memcpy(x + skip, t->x + r * t->w + from, n * sizeof *x);
	memcpy(y + skip, t->y + r * t->w + from, n * sizeof *y);
	for (size_t j = 0; j < IN; j += L) {
		const ct_f32 a = ct_f32_load(x + j), b = ct_f32_load(y + j);
		const ct_f32 m[MAPS] = {a + b, a - b, (a + b) * (a + b), (a - b) * (a - b)};

#pragma GCC unroll 4
		for (size_t q = 0; q < MAPS; q++)
			ct_f32_store(k->in[q] + j, m[q]);
	}
	for (size_t q = 0; q < MAPS; q++)
		along(k->ring[r % CT_SSIM_TAPS][q], k->in[q], WIDE, tap);
}

/* 1 - SSIM, and the slopes of SSIM to x through S and D, and to the means of s^2 and d^2, of the
 * row in the middle of a ring that ends with row r. */
CT_INLINE void differentiate(struct work *k, size_t r, const ct_f32 tap[R + 1])
{
	const float *row[MAPS][CT_SSIM_TAPS];

	for (size_t q = 0; q < MAPS; q++)
		RING(row[q], k->ring, r, q);
	for (size_t j = 0; j < WIDE; j += L) {
		const ct_f32 s = window(row[0], j, tap), d = window(row[1], j, tap);
		const ct_f32 ss = s * s, dd = d * d;
		const ct_f32 v = window(row[2], j, tap) - ss, e = window(row[3], j, tap) - dd;
		const ct_f32 b1 = 0.5f * (ss + dd) + k->c1, b2 = 0.5f * (v + e) + k->c2;
		const ct_f32 a1 = b1 - dd, a2 = b2 - e, by = 1 / (b1 * b2);
		const ct_f32 less = (b1 * e + a2 * dd) * by, more = (b2 - b1) * less;
		const ct_f32 out[GRADS] = {
			by * (s * (more + dd - e) + d * (a1 - a2 + (b1 - b2) * (1 - less))),
			0.5f * a1 * e * by / b2, -0.5f * a1 * (b2 + a2) * by / b2};

		ct_f32_store(k->less + j, less);
#pragma GCC unroll 3
		for (size_t q = 0; q < GRADS; q++)
			ct_f32_store(k->slope[q] + j, out[q]);
	}
}

/* Slopes of row o outside the image are none; inside they count as the pixel does. Returns the sum
 * of 1 - SSIM over the tile's own pixels. */
CT_INLINE double weigh(struct work *k, const struct ct_ssim_tile *t, size_t o)
{
	const size_t low = t->first < R ? R - t->first : 0, left = t->w + R - t->first;
	const size_t high = left < WIDE ? left : WIDE, from = t->first + low - R;
	ct_f32 part[BLOCK / L] = {{0}};
	float all[BLOCK];
	double sum = 0;

	memset(k->less + high, 0, (WIDE - high) * sizeof(float));
	for (size_t q = 0; q < GRADS; q++) {
		memset(k->slope[q], 0, low * sizeof(float));
		memset(k->slope[q] + high, 0, (WIDE - high) * sizeof(float));
	}
	for (size_t j = low; t->weight && j < high; j++) {
		const float w = t->weight[o * t->w + from + j - low];

		k->less[j] *= w;
		for (size_t q = 0; q < GRADS; q++)
			k->slope[q][j] *= w;
	}
	for (size_t j = 0; j < TILE; j += BLOCK)
		for (size_t q = 0; q < BLOCK / L; q++)
			part[q] += ct_f32_load(k->less + R + j + q * L);
	memcpy(all, part, sizeof all);
	for (size_t j = 0; j < BLOCK; j++)
		sum += (double)all[j];
	return sum;
}

/* gx[0, n) += scale times the gradient of n <= L pixels x and y, whose slopes begin at column j. */
CT_INLINE void give_some(const float *const row[GRADS][CT_SSIM_TAPS], size_t j, float *gx,
	const float *px, const float *py, size_t n, float scale, const ct_f32 tap[R + 1])
{
	const ct_f32 x = ct_f32_load_n(px, n), y = ct_f32_load_n(py, n);
	ct_f32 g = ct_f32_load_n(gx, n);

	g += scale * (window(row[0], j, tap) + 2 * ((x + y) * window(row[1], j, tap) +
							   (x - y) * window(row[2], j, tap)));
	ct_f32_store_n(gx, g, n);
}

/* Row q of gx, in the middle of a ring that ends with row r. */
CT_INLINE void give(struct work *k, const struct ct_ssim_tile *t, size_t r, size_t q, float *gx,
	float scale, const ct_f32 tap[R + 1])
{
	const size_t at = q * t->w + t->first;
	const float *row[GRADS][CT_SSIM_TAPS];
	size_t j = 0;

	for (size_t m = 0; m < GRADS; m++)
		RING(row[m], k->slope_ring, r, m);
	for (; j + L <= t->n; j += L)
		give_some(row, j, gx + at + j, t->x + at + j, t->y + at + j, L, scale, tap);
	if (j < t->n)
		give_some(row, j, gx + at + j, t->x + at + j, t->y + at + j, t->n - j, scale, tap);
}

/* Rows [first, end) of a tile; returns their sum of 1 - SSIM. */
double CT_SIMD_HERE(ct_ssim_tile_back)(const struct ct_ssim_rule *r, const struct ct_ssim_tile *t,
	size_t first, size_t end, float *gx, float scale)
{
	const size_t begin = first > 2 * R ? first - 2 * R : 0;
	double sum = 0;
	struct work k; /* 47 kB */
	ct_f32 tap[R + 1];

	memset(&k, 0, sizeof k);
	for (size_t i = 0; i <= R; i++)
		tap[i] = ct_f32_set((float)r->tap[i]);
	k.c1 = (float)r->c1;
	k.c2 = (float)r->c2;
	for (size_t row = begin; row < end + 2 * R; row++) {
		const size_t o = row - R;

		take(&k, t, row, tap);
		if (row < begin + R)
			continue;
		if (o < t->h) {
			double part;

			differentiate(&k, row, tap);
			part = weigh(&k, t, o);
			sum += o >= first && o < end ? part : 0;
			for (size_t q = 0; q < GRADS; q++)
				along(k.slope_ring[o % CT_SSIM_TAPS][q], k.slope[q], TILE, tap);
		} else
			memset(k.slope_ring[o % CT_SSIM_TAPS], 0, sizeof k.slope_ring[0]);
		if (row >= first + 2 * R)
			give(&k, t, o, row - 2 * R, gx, scale, tap);
	}
	return sum;
}
