/* cosine-strip.c: the products of cosine.h, a strip of columns two registers wide at a time: it is
 * copied into a tile, so that the strides of a volume are walked once, folded there, and multiplied
 * in blocks of sums that are held in registers, of which v2 and v3 have 16 and v4 and NEON 32.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "operator/cosine.h"
#include "operator/turn.h"

enum { STRIP_WIDTH = 2 * CT_F32_LANES };
#if defined(__AVX512F__) || defined(__aarch64__)
enum { ROWS = 8 };
#else
enum { ROWS = 4 };
#endif
_Static_assert((int)STRIP_WIDTH <= (int)CT_COSINE_STRIP, "a tile holds a strip");

/* Register h, 0 or 1, of the n <= STRIP_WIDTH columns at p. */
CT_INLINE ct_f32 get(const float *p, size_t h, size_t n)
{
	if (n == STRIP_WIDTH)
		return ct_f32_load(p + h * CT_F32_LANES);
	return n > h * CT_F32_LANES ? ct_f32_load_n(p + h * CT_F32_LANES, n - h * CT_F32_LANES)
				    : ct_f32_set(0);
}

CT_INLINE void put(float *p, size_t h, ct_f32 v, size_t n)
{
	if (n == STRIP_WIDTH)
		ct_f32_store(p + h * CT_F32_LANES, v);
	else if (n > h * CT_F32_LANES)
		ct_f32_store_n(p + h * CT_F32_LANES, v, n - h * CT_F32_LANES);
}

/* c (rows,n; ldc) = at^T (k,rows; lda) b (k,STRIP_WIDTH). */
CT_INLINE void block(float *c, size_t ldc, const float *at, size_t lda, const float *b, size_t k,
	size_t n, const size_t rows)
{
	ct_f32 sum[ROWS][2] = {{{0}}};

	for (size_t q = 0; q < k; q++) {
		ct_f32 b0 = ct_f32_load(b + q * STRIP_WIDTH);
		ct_f32 b1 = ct_f32_load(b + q * STRIP_WIDTH + CT_F32_LANES);

#pragma GCC unroll 16
		for (size_t r = 0; r < rows; r++) {
			ct_f32 f = ct_f32_set(at[q * lda + r]);

			sum[r][0] = ct_f32_fma(f, b0, sum[r][0]);
			sum[r][1] = ct_f32_fma(f, b1, sum[r][1]);
		}
	}
#pragma GCC unroll 16
	for (size_t r = 0; r < rows; r++) {
		put(c + r * ldc, 0, sum[r][0], n);
		put(c + r * ldc, 1, sum[r][1], n);
	}
}

/* c (m,n; ldc) = at^T (k,m) b (k,STRIP_WIDTH), m rows. */
CT_INLINE void product(
	float *c, size_t ldc, const float *at, const float *b, size_t m, size_t k, size_t n)
{
	size_t i = 0;

	for (; i + ROWS <= m; i += ROWS)
		block(c + i * ldc, ldc, at + i, m, b, k, n, ROWS);
	for (; i + 4 <= m; i += 4)
		block(c + i * ldc, ldc, at + i, m, b, k, n, 4);
	for (; i + 2 <= m; i += 2)
		block(c + i * ldc, ldc, at + i, m, b, k, n, 2);
	if (i < m)
		block(c + i * ldc, ldc, at + i, m, b, k, n, 1);
}

/* Rows j and s-1-j of x to their sum and difference in the tile, which may be x; the difference
 * times twist[j]. */
CT_INLINE void fold(float *tile, const float *x, size_t ldx, size_t s, size_t n, const float *twist)
{
	for (size_t j = 0; j < s / 2; j++)
		for (size_t h = 0; h < 2; h++) {
			ct_f32 a = get(x + j * ldx, h, n), b = get(x + (s - 1 - j) * ldx, h, n);
			ct_f32 d = a - b;

			put(tile + j * STRIP_WIDTH, h, a + b, STRIP_WIDTH);
			put(tile + (s - 1 - j) * STRIP_WIDTH, h,
				twist ? ct_f32_set(twist[j]) * d : d, STRIP_WIDTH);
		}
	for (size_t h = 0; s % 2 && h < 2; h++)
		put(tile + s / 2 * STRIP_WIDTH, h, get(x + s / 2 * ldx, h, n), STRIP_WIDTH);
}

/* The folded rows of a tile to rows of out, of which n columns exist. */
CT_INLINE void unfold(float *out, size_t ldo, const float *add, const float *tile, size_t s,
	size_t n, const float *twist)
{
	for (size_t j = 0; j < s / 2; j++)
		for (size_t h = 0; h < 2; h++) {
			size_t p = j * ldo, q = (s - 1 - j) * ldo;
			ct_f32 a = get(tile + j * STRIP_WIDTH, h, STRIP_WIDTH);
			ct_f32 b = get(tile + (s - 1 - j) * STRIP_WIDTH, h, STRIP_WIDTH);
			ct_f32 d = twist ? ct_f32_set(twist[j]) * b : b, u = a + d, v = a - d;

			if (add) {
				u = get(add + p, h, n) + u;
				v = get(add + q, h, n) + v;
			}
			put(out + p, h, u, n);
			put(out + q, h, v, n);
		}
	for (size_t h = 0; s % 2 && h < 2; h++) {
		ct_f32 u = get(tile + s / 2 * STRIP_WIDTH, h, STRIP_WIDTH);

		put(out + s / 2 * ldo, h, add ? get(add + s / 2 * ldo, h, n) + u : u, n);
	}
}

static size_t width(size_t w, size_t at)
{
	return w - at < STRIP_WIDTH ? w - at : STRIP_WIDTH;
}

/* Coefficients c (m,n; ldc) of a leaf from its tile, which is folded once. */
CT_INLINE void leaf(const struct ct_cosine *b, float *c, size_t ldc, float *tile, size_t n)
{
	size_t s = b->n >> b->levels;

	for (size_t f = 2; f < b->parts; f++) {
		s -= s / 2;
		fold(tile, tile, STRIP_WIDTH, s, STRIP_WIDTH, NULL);
	}
	for (size_t p = 0; p < b->parts; p++) {
		product(c, ldc, b->vt[p], tile, b->count[p], b->rows[p], n);
		c += b->count[p] * ldc;
		tile += b->rows[p] * STRIP_WIDTH;
	}
}

/* C_0, C_1, ... of odd functions, reversed samples, in rows order[] to X_1, X_3, ...: with the sign
 * of reversal a running sum. */
CT_INLINE void gather(float *c, const size_t *order, size_t count)
{
	ct_f32 sum[2] = {{0}, {0}};

	for (size_t k = 0; k < count; k++)
		for (size_t h = 0; h < 2; h++) {
			ct_f32 x = get(c + order[k] * STRIP_WIDTH, h, STRIP_WIDTH);

			sum[h] = k ? sum[h] + x : 0.5f * x;
			put(c + order[k] * STRIP_WIDTH, h, k % 2 ? -sum[h] : sum[h], STRIP_WIDTH);
		}
}

/* Its transpose. */
CT_INLINE void spread(float *c, const size_t *order, size_t count)
{
	ct_f32 sum[2] = {{0}, {0}};

	for (size_t k = count; k-- > 0;)
		for (size_t h = 0; h < 2; h++) {
			ct_f32 x = get(c + order[k] * STRIP_WIDTH, h, STRIP_WIDTH);

			sum[h] += k % 2 ? -x : x;
			put(c + order[k] * STRIP_WIDTH, h, k ? sum[h] : 0.5f * sum[h], STRIP_WIDTH);
		}
}

/* The function 0 is shorter than the others. */
CT_INLINE void first(float *c)
{
	for (size_t h = 0; h < 2; h++)
		put(c, h, 0.70710678f * get(c, h, STRIP_WIDTH), STRIP_WIDTH);
}

/* Coefficients from a tile that was folded once. */
static void multiply(const struct ct_cosine *b, float *c, size_t ldc, float *tile, size_t n)
{
	const size_t rows = b->n >> b->levels, count = b->m >> b->levels;
	const size_t *order = b->order + b->m - count;
	float *out = tile + b->n * STRIP_WIDTH;

	if (b->levels == 0) {
		leaf(b, c, ldc, tile, n);
		return;
	}
	for (size_t l = 1; l < b->levels; l++)
		for (size_t t = 0, s = b->n >> l; t < (size_t)1 << l; t++)
			fold(tile + t * s * STRIP_WIDTH, tile + t * s * STRIP_WIDTH, STRIP_WIDTH, s,
				STRIP_WIDTH, b->twist + b->n - s);
	for (size_t t = 0; t < (size_t)1 << b->levels; t++) {
		float *at = tile + t * rows * STRIP_WIDTH;

		fold(at, at, STRIP_WIDTH, rows, STRIP_WIDTH, NULL);
		leaf(b, out + t * count * STRIP_WIDTH, STRIP_WIDTH, at, STRIP_WIDTH);
	}
	for (size_t l = b->levels; l-- > 0;) {
		const size_t half = b->m >> (l + 1);

		order -= half;
		for (size_t t = 0; t < (size_t)1 << l; t++)
			gather(out + (2 * t + 1) * half * STRIP_WIDTH, order, half);
	}
	first(out);
	for (size_t k = 0; k < b->m; k++)
		for (size_t h = 0; h < 2; h++)
			put(c + k * ldc, h, get(out + k * STRIP_WIDTH, h, STRIP_WIDTH), n);
}

void CT_SIMD_HERE(ct_cosine_analyse)(const struct ct_cosine *b, float *c, size_t ldc,
	const float *x, size_t ldx, size_t w, bool turned, float *tile)
{
	const float *twist = b->levels ? b->twist : NULL;

	for (size_t at = 0; at < w; at += STRIP_WIDTH) {
		size_t n = width(w, at);

		if (turned) {
			if (n < STRIP_WIDTH)
				memset(tile, 0, b->n * STRIP_WIDTH * sizeof *tile);
			ct_turn(tile, STRIP_WIDTH, x + at * ldx, ldx, n, b->n);
			fold(tile, tile, STRIP_WIDTH, b->n, STRIP_WIDTH, twist);
		} else if (n == STRIP_WIDTH) {
			fold(tile, x + at, ldx, b->n, STRIP_WIDTH, twist);
		} else {
			fold(tile, x + at, ldx, b->n, n, twist);
		}
		multiply(b, c + at, ldc, tile, n);
	}
}

/* The tile of a leaf from its coefficients in (m,STRIP_WIDTH), folded but for its last unfolding.
 */
CT_INLINE void leaf_back(const struct ct_cosine *b, float *tile, const float *in)
{
	size_t s[CT_COSINE_PARTS] = {b->n >> b->levels};
	float *out = tile;

	for (size_t p = 0; p < b->parts; p++) {
		product(out, STRIP_WIDTH, b->v[p], in, b->rows[p], b->count[p], STRIP_WIDTH);
		in += b->count[p] * STRIP_WIDTH;
		out += b->rows[p] * STRIP_WIDTH;
	}
	for (size_t f = 1; f + 1 < b->parts; f++)
		s[f] = s[f - 1] - s[f - 1] / 2;
	for (size_t f = b->parts - 2; f > 0; f--)
		unfold(tile, STRIP_WIDTH, NULL, tile, s[f], STRIP_WIDTH, NULL);
}

/* tile = V^T c of a strip, folded but for its last unfolding. */
static void expand(
	const struct ct_cosine *b, float *tile, const float *c, size_t ldc, size_t n, float *in)
{
	const size_t rows = b->n >> b->levels, count = b->m >> b->levels;
	const size_t *order = b->order;

	for (size_t k = 0; k < b->m; k++)
		for (size_t h = 0; h < 2; h++)
			put(in + k * STRIP_WIDTH, h, get(c + k * ldc, h, n), STRIP_WIDTH);
	if (b->levels == 0) {
		leaf_back(b, tile, in);
		return;
	}
	first(in);
	for (size_t l = 0; l < b->levels; l++) {
		const size_t half = b->m >> (l + 1);

		for (size_t t = 0; t < (size_t)1 << l; t++)
			spread(in + (2 * t + 1) * half * STRIP_WIDTH, order, half);
		order += half;
	}
	for (size_t t = 0; t < (size_t)1 << b->levels; t++) {
		float *at = tile + t * rows * STRIP_WIDTH;

		leaf_back(b, at, in + t * count * STRIP_WIDTH);
		unfold(at, STRIP_WIDTH, NULL, at, rows, STRIP_WIDTH, NULL);
	}
	for (size_t l = b->levels - 1; l > 0; l--)
		for (size_t t = 0, s = b->n >> l; t < (size_t)1 << l; t++)
			unfold(tile + t * s * STRIP_WIDTH, STRIP_WIDTH, NULL,
				tile + t * s * STRIP_WIDTH, s, STRIP_WIDTH, b->twist + b->n - s);
}

void CT_SIMD_HERE(ct_cosine_synthesise)(const struct ct_cosine *b, float *out, size_t ldo,
	const float *add, const float *c, size_t ldc, size_t w, bool turned, float *tile)
{
	const float *twist = b->levels ? b->twist : NULL;

	for (size_t at = 0; at < w; at += STRIP_WIDTH) {
		size_t n = width(w, at);

		expand(b, tile, c + at, ldc, n, tile + b->n * STRIP_WIDTH);
		if (turned) {
			unfold(tile, STRIP_WIDTH, NULL, tile, b->n, STRIP_WIDTH, twist);
			ct_turn(out + at * ldo, ldo, tile, STRIP_WIDTH, b->n, n);
		} else if (n == STRIP_WIDTH && add) {
			unfold(out + at, ldo, add + at, tile, b->n, STRIP_WIDTH, twist);
		} else {
			unfold(out + at, ldo, add ? add + at : NULL, tile, b->n, n, twist);
		}
	}
}
