/* banded-strip.c: the kernels of banded.h. Sums are held in registers, four at a time; what is
 * turned goes by way of a tile of a strip of rows, two registers wide.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "operator/banded.h"
#include "operator/turn.h"

enum { STRIP_WIDTH = 2 * CT_F32_LANES, PARTS = 4 };

/* The rows that a sum is of: `ld` apart, or each anywhere. */
struct rows {
	const float *first;
	size_t ld;
	const float *const *each;
};

/* `parts` registers of a row from column i on; the last has n <= CT_F32_LANES columns. */
CT_INLINE void sum(float *out, const float *add, const struct rows in, size_t i, const float *w,
	size_t taps, const size_t parts, size_t n)
{
	ct_f32 acc[PARTS] = {{0}};

#pragma GCC unroll 4
	for (size_t p = 0; add && p < parts; p++)
		acc[p] =
			ct_f32_load_n(add + i + p * CT_F32_LANES, p + 1 < parts ? CT_F32_LANES : n);
	for (size_t q = 0; q < taps; q++) {
		const float *row = (in.each ? in.each[q] : in.first + q * in.ld) + i;
		const ct_f32 f = ct_f32_set(w[q]);

#pragma GCC unroll 4
		for (size_t p = 0; p < parts; p++)
			acc[p] = ct_f32_fma(f,
				ct_f32_load_n(
					row + p * CT_F32_LANES, p + 1 < parts ? CT_F32_LANES : n),
				acc[p]);
	}
#pragma GCC unroll 4
	for (size_t p = 0; p < parts; p++)
		ct_f32_store_n(
			out + i + p * CT_F32_LANES, acc[p], p + 1 < parts ? CT_F32_LANES : n);
}

CT_INLINE void row(float *out, const float *add, const struct rows in, const float *w,
	const size_t taps, size_t n)
{
	size_t i = 0;

	for (; i + PARTS * CT_F32_LANES <= n; i += PARTS * CT_F32_LANES)
		sum(out, add, in, i, w, taps, PARTS, CT_F32_LANES);
	for (; i < n; i += CT_F32_LANES)
		sum(out, add, in, i, w, taps, 1, n - i < CT_F32_LANES ? n - i : CT_F32_LANES);
}

void CT_SIMD_HERE(ct_banded_across)(const struct ct_banded_rows *t, float *out, size_t ldo,
	const float *add, const float *in, size_t ldi, size_t w)
{
	for (size_t r = 0; r < t->n; r++)
		row(out + r * ldo, add ? add + r * ldo : NULL,
			(struct rows){in + t->first[r] * ldi, ldi, NULL}, t->w + r * t->taps,
			t->taps, w);
}

void CT_SIMD_HERE(ct_banded_down)(const struct ct_banded *b, float *out, size_t ldo,
	const float *in, size_t ldi, size_t w, float *tile)
{
	for (size_t at = 0; at < w; at += STRIP_WIDTH) {
		const size_t n = w - at < STRIP_WIDTH ? w - at : STRIP_WIDTH;

		ct_turn(tile, STRIP_WIDTH, in + at * ldi, ldi, n, b->up.n);
		CT_SIMD_HERE(ct_banded_across)(&b->down, out + at, ldo, NULL, tile, STRIP_WIDTH, n);
	}
}

void CT_SIMD_HERE(ct_banded_up)(const struct ct_banded *b, float *out, size_t ldo, const float *in,
	size_t ldi, size_t w, float *tile)
{
	for (size_t at = 0; at < w; at += STRIP_WIDTH) {
		const size_t n = w - at < STRIP_WIDTH ? w - at : STRIP_WIDTH;

		CT_SIMD_HERE(ct_banded_across)(&b->up, tile, STRIP_WIDTH, NULL, in + at, ldi, n);
		ct_turn(out + at * ldo, ldo, tile, STRIP_WIDTH, b->up.n, n);
	}
}

/* Down by L, back by its transpose and d. */
void CT_SIMD_HERE(ct_banded_solve)(const struct ct_banded *b, float *x, size_t ld, size_t w)
{
	const size_t m = b->down.n, half = b->half;

	for (size_t i = 1; half > 0 && i < m; i++) {
		const size_t q = i < half ? i : half;

		row(x + i * ld, x + i * ld, (struct rows){x + (i - q) * ld, ld, NULL},
			b->lower + (i + 1) * half - q, q, w);
	}
	for (size_t i = m; i-- > 0;) {
		const size_t q = m - 1 - i < half ? m - 1 - i : half;

		for (size_t c = 0; c < w; c++)
			x[i * ld + c] *= b->inverse[i];
		if (q > 0)
			row(x + i * ld, x + i * ld, (struct rows){x + (i + 1) * ld, ld, NULL},
				b->upper + i * half, q, w);
	}
}

void CT_SIMD_HERE(ct_banded_solve_turned)(
	const struct ct_banded *b, float *x, size_t ld, size_t w, float *tile)
{
	for (size_t at = 0; at < w; at += STRIP_WIDTH) {
		const size_t n = w - at < STRIP_WIDTH ? w - at : STRIP_WIDTH;

		ct_turn(tile, STRIP_WIDTH, x + at * ld, ld, n, b->down.n);
		CT_SIMD_HERE(ct_banded_solve)(b, tile, STRIP_WIDTH, n);
		ct_turn(x + at * ld, ld, tile, STRIP_WIDTH, b->down.n, n);
	}
}

void CT_SIMD_HERE(ct_banded_blend)(
	float *out, size_t parts, const float *const *part, const float *w, size_t n)
{
	if (part) /* so that it is known */
		row(out, NULL, (struct rows){.each = part}, w, parts, n);
}
