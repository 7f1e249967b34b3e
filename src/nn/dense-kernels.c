/* dense-kernels.c: see dense-kernels.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "nn/dense-kernels.h"
#include "core/vec-exp.h"

/* Accumulators are ROWS x WIDE vectors, few enough for the registers of the level. */
#if defined(__AVX512F__)
enum { ROWS = 4, WIDE = 4, STEP = CT_DENSE_LANES };
#else
enum { ROWS = 4, WIDE = 2, STEP = 2 * CT_F32_LANES };
#endif
enum { PARTS = CT_DENSE_LANES / CT_F32_LANES, SIDE = 4 };

CT_INLINE ct_f32 finish(const struct ct_dense_product *p, size_t at, ct_f32 s)
{
	const ct_f32 turned = s * p->slope;
	ct_f32 by = s;

	if (p->mask)
		by = ct_f32_load(p->mask + at);
	return ct_f32_pick((ct_i32)(by > (ct_f32){0}), s, turned);
}

/* Rows [r, r + rows) of columns [i, i + wide vectors). */
CT_INLINE void tile(
	const struct ct_dense_product *p, size_t r, size_t i, const size_t rows, const size_t wide)
{
	const float *w = p->w + r * p->wr, *x = p->x + i;
	ct_f32 acc[ROWS][WIDE];

#pragma GCC unroll 4
	for (size_t a = 0; a < rows; a++)
#pragma GCC unroll 4
		for (size_t b = 0; b < wide; b++)
			acc[a][b] =
				p->add ? ct_f32_load(p->y + (r + a) * p->ld + i + b * CT_F32_LANES)
				       : ct_f32_set(p->b ? p->b[r + a] : 0.0f);
	for (size_t k = 0; k < p->depth; k++, w += p->wk, x += p->ld) {
		ct_f32 v[WIDE];

#pragma GCC unroll 4
		for (size_t b = 0; b < wide; b++)
			v[b] = ct_f32_load(x + b * CT_F32_LANES);
#pragma GCC unroll 4
		for (size_t a = 0; a < rows; a++) {
			const ct_f32 by = ct_f32_set(w[a * p->wr]);

#pragma GCC unroll 4
			for (size_t b = 0; b < wide; b++)
				acc[a][b] = ct_f32_fma(by, v[b], acc[a][b]);
		}
	}
#pragma GCC unroll 4
	for (size_t a = 0; a < rows; a++)
#pragma GCC unroll 4
		for (size_t b = 0; b < wide; b++) {
			const size_t at = (r + a) * p->ld + i + b * CT_F32_LANES;

			ct_f32_store(p->y + at, finish(p, at, acc[a][b]));
		}
}

CT_INLINE void strip(const struct ct_dense_product *p, size_t i, const size_t wide)
{
	size_t r = 0;

	for (; r + 4 <= p->rows; r += 4)
		tile(p, r, i, 4, wide);
	if (r + 2 <= p->rows) {
		tile(p, r, i, 2, wide);
		r += 2;
	}
	if (r < p->rows)
		tile(p, r, i, 1, wide);
}

void CT_SIMD_HERE(ct_dense_kernels_product)(const struct ct_dense_product *given)
{
	const struct ct_dense_product p = *given; /* nothing that is written can be part of it */
	size_t i = 0;

	for (; i + WIDE * CT_F32_LANES <= p.cols; i += WIDE * CT_F32_LANES)
		strip(&p, i, WIDE);
	for (; i < p.cols; i += STEP)
		strip(&p, i, STEP / CT_F32_LANES);
}

void CT_SIMD_HERE(ct_dense_kernels_finish)(const struct ct_dense_product *p)
{
	for (size_t r = 0; r < p->rows; r++) {
		const ct_f32 b = ct_f32_set(p->b ? p->b[r] : 0.0f);

		for (size_t i = 0; i < p->cols; i += CT_F32_LANES) {
			const size_t at = r * p->ld + i;

			ct_f32_store(p->y + at, finish(p, at, ct_f32_load(p->y + at) + b));
		}
	}
}

/* sums[a] = the sum of 16 lanes, (0+1), (2+3), ... and so on as a tree: a of lanes[a][16], of
 * which a vector holds CT_F32_LANES in parts[]: the same at every level. */
CT_INLINE void trees(float sums[SIDE * SIDE], float *restrict lanes)
{
	float half[SIDE * SIDE * 8], four[SIDE * SIDE * 4], two[SIDE * SIDE * 2];

	for (size_t j = 0; j < SIDE * SIDE * 8; j++)
		half[j] = lanes[2 * j] + lanes[2 * j + 1];
	for (size_t j = 0; j < SIDE * SIDE * 4; j++)
		four[j] = half[2 * j] + half[2 * j + 1];
	for (size_t j = 0; j < SIDE * SIDE * 2; j++)
		two[j] = four[2 * j] + four[2 * j + 1];
	for (size_t j = 0; j < SIDE * SIDE; j++)
		sums[j] = two[2 * j] + two[2 * j + 1];
}

/* lanes[4][4][16], those of `part`: of rows d[a] and x[b]. */
CT_INLINE void lanes_of(float *lanes, size_t part, size_t cols, const float *const d[SIDE],
	const float *const x[SIDE], size_t first, size_t across)
{
	ct_f32 acc[SIDE][SIDE] = {{{0}}};

	for (size_t i = part * CT_F32_LANES; i < cols; i += CT_DENSE_LANES) {
		ct_f32 v[SIDE];

#pragma GCC unroll 4
		for (size_t b = 0; b < across; b++)
			v[b] = ct_f32_load(x[first + b] + i);
#pragma GCC unroll 4
		for (size_t a = 0; a < SIDE; a++) {
			const ct_f32 by = ct_f32_load(d[a] + i);

#pragma GCC unroll 4
			for (size_t b = 0; b < across; b++)
				acc[a][b] = ct_f32_fma(by, v[b], acc[a][b]);
		}
	}
#pragma GCC unroll 4
	for (size_t a = 0; a < SIDE; a++)
#pragma GCC unroll 4
		for (size_t b = 0; b < across; b++)
			ct_f32_store(lanes + (a * SIDE + first + b) * CT_DENSE_LANES +
					     part * CT_F32_LANES,
				acc[a][b]);
}

void CT_SIMD_HERE(ct_dense_kernels_gradient)(size_t out, size_t in, size_t cols, size_t ld,
	float *restrict dw, size_t ldw, const float *restrict d, const float *restrict x)
{
	float lanes[SIDE * SIDE * CT_DENSE_LANES], sums[SIDE * SIDE];

	for (size_t o = 0; o < out; o += SIDE)
		for (size_t k = 0; k < in; k += SIDE) {
			const float *rows[SIDE], *by[SIDE]; /* the last row once more beyond it */

			for (size_t a = 0; a < SIDE; a++) {
				rows[a] = d + (o + a < out ? o + a : out - 1) * ld;
				by[a] = x + (k + a < in ? k + a : in - 1) * ld;
			}
			for (size_t q = 0; q < PARTS; q++)
#if defined(__AVX512F__)
				lanes_of(lanes, q, cols, rows, by, 0, SIDE);
#else
				for (size_t first = 0; first < SIDE; first += 2)
					lanes_of(lanes, q, cols, rows, by, first, 2);
#endif
			trees(sums, lanes);
			for (size_t a = 0; a < SIDE && o + a < out; a++)
				for (size_t b = 0; b < SIDE && k + b < in; b++)
					dw[(o + a) * ldw + k + b] += sums[a * SIDE + b];
		}
}

void CT_SIMD_HERE(ct_dense_kernels_sums)(size_t rows, size_t cols, size_t ld, float *restrict sums,
	const float *restrict a, const float *restrict b)
{
	for (size_t r = 0; r < rows; r++, a += ld) {
		float lane[CT_DENSE_LANES] = {0};
		double sum = 0;

		for (size_t i = 0; i < cols; i += CT_DENSE_LANES)
			if (b)
				for (size_t l = 0; l < CT_DENSE_LANES; l++)
					lane[l] += a[i + l] * b[r * ld + i + l];
			else
				for (size_t l = 0; l < CT_DENSE_LANES; l++)
					lane[l] += a[i + l];
		for (size_t l = 0; l < CT_DENSE_LANES; l++)
			sum += (double)lane[l];
		sums[r] += (float)sum;
	}
}

void CT_SIMD_HERE(ct_dense_kernels_sigmoid)(size_t cols, float *y)
{
	for (size_t i = 0; i < cols; i += CT_F32_LANES)
		ct_f32_store(y + i, ct_f32_sigmoid(ct_f32_load(y + i)));
}
