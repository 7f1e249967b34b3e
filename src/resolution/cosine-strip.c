/* cosine-strip.c: the products of cosine.h, a strip of columns two registers wide at a time: it is
 * copied into a tile, so that the strides of a volume are walked once, folded there, and multiplied
 * in blocks of sums that are held in registers, of which v2 and v3 have 16 and v4 and NEON 32. */
#include "config.h"
#include "resolution/cosine.h"
#include "core/vec.h"

enum { WIDE = 2 * CT_F32_LANES };
#if defined(__AVX512F__) || defined(__aarch64__)
enum { ROWS = 8 };
#else
enum { ROWS = 4 };
#endif
_Static_assert((int)WIDE <= (int)CT_COSINE_STRIP, "a tile holds a strip");

/* Register h, 0 or 1, of the n <= WIDE columns at p. */
CT_INLINE ct_f32 get(const float *p, size_t h, size_t n)
{
	if (n == WIDE)
		return ct_f32_load(p + h * CT_F32_LANES);
	return n > h * CT_F32_LANES ? ct_f32_load_n(p + h * CT_F32_LANES, n - h * CT_F32_LANES)
				    : ct_f32_set(0);
}

CT_INLINE void put(float *p, size_t h, ct_f32 v, size_t n)
{
	if (n == WIDE)
		ct_f32_store(p + h * CT_F32_LANES, v);
	else if (n > h * CT_F32_LANES)
		ct_f32_store_n(p + h * CT_F32_LANES, v, n - h * CT_F32_LANES);
}

/* c (rows,n; ldc) = at^T (k,rows; lda) b (k,WIDE). */
CT_INLINE void block(float *c, size_t ldc, const float *at, size_t lda, const float *b, size_t k,
	size_t n, const size_t rows)
{
	ct_f32 sum[ROWS][2] = {{{0}}};

	for (size_t q = 0; q < k; q++) {
		ct_f32 b0 = ct_f32_load(b + q * WIDE);
		ct_f32 b1 = ct_f32_load(b + q * WIDE + CT_F32_LANES);

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

/* c (m,n; ldc) = at^T (k,m) b (k,WIDE), m rows. */
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

			put(tile + j * WIDE, h, a + b, WIDE);
			put(tile + (s - 1 - j) * WIDE, h, twist ? ct_f32_set(twist[j]) * d : d,
				WIDE);
		}
	for (size_t h = 0; s % 2 && h < 2; h++)
		put(tile + s / 2 * WIDE, h, get(x + s / 2 * ldx, h, n), WIDE);
}

/* The folded rows of a tile to rows of out, of which n columns exist. */
CT_INLINE void unfold(float *out, size_t ldo, const float *add, const float *tile, size_t s,
	size_t n, const float *twist)
{
	for (size_t j = 0; j < s / 2; j++)
		for (size_t h = 0; h < 2; h++) {
			size_t p = j * ldo, q = (s - 1 - j) * ldo;
			ct_f32 a = get(tile + j * WIDE, h, WIDE);
			ct_f32 b = get(tile + (s - 1 - j) * WIDE, h, WIDE);
			ct_f32 d = twist ? ct_f32_set(twist[j]) * b : b, u = a + d, v = a - d;

			if (add) {
				u = get(add + p, h, n) + u;
				v = get(add + q, h, n) + v;
			}
			put(out + p, h, u, n);
			put(out + q, h, v, n);
		}
	for (size_t h = 0; s % 2 && h < 2; h++) {
		ct_f32 u = get(tile + s / 2 * WIDE, h, WIDE);

		put(out + s / 2 * ldo, h, add ? get(add + s / 2 * ldo, h, n) + u : u, n);
	}
}

typedef float quad __attribute__((vector_size(16)));

/* out (columns,rows; ldo) = in (rows,columns; ldi) turned, four by four. */
CT_INLINE void turn(
	float *out, size_t ldo, const float *in, size_t ldi, size_t rows, size_t columns)
{
	size_t r = 0;

	for (; r + 4 <= rows; r += 4) {
		size_t c = 0;

		for (; c + 4 <= columns; c += 4) {
			quad x[4], lo[2], hi[2], y[4];

			for (size_t i = 0; i < 4; i++)
				memcpy(&x[i], in + (r + i) * ldi + c, sizeof x[i]);
			for (size_t i = 0; i < 2; i++) {
				lo[i] = __builtin_shufflevector(x[i], x[i + 2], 0, 4, 1, 5);
				hi[i] = __builtin_shufflevector(x[i], x[i + 2], 2, 6, 3, 7);
			}
			y[0] = __builtin_shufflevector(lo[0], lo[1], 0, 4, 1, 5);
			y[1] = __builtin_shufflevector(lo[0], lo[1], 2, 6, 3, 7);
			y[2] = __builtin_shufflevector(hi[0], hi[1], 0, 4, 1, 5);
			y[3] = __builtin_shufflevector(hi[0], hi[1], 2, 6, 3, 7);
			for (size_t i = 0; i < 4; i++)
				memcpy(out + (c + i) * ldo + r, &y[i], sizeof y[i]);
		}
		for (; c < columns; c++)
			for (size_t i = 0; i < 4; i++)
				out[c * ldo + r + i] = in[(r + i) * ldi + c];
	}
	for (; r < rows; r++)
		for (size_t c = 0; c < columns; c++)
			out[c * ldo + r] = in[r * ldi + c];
}

static size_t width(size_t w, size_t at)
{
	return w - at < WIDE ? w - at : WIDE;
}

/* Coefficients c (m,n; ldc) of a leaf from its tile, which is folded once. */
CT_INLINE void leaf(const struct ct_cosine *b, float *c, size_t ldc, float *tile, size_t n)
{
	size_t s = b->n >> b->levels;

	for (size_t f = 2; f < b->parts; f++) {
		s -= s / 2;
		fold(tile, tile, WIDE, s, WIDE, NULL);
	}
	for (size_t p = 0; p < b->parts; p++) {
		product(c, ldc, b->vt[p], tile, b->count[p], b->rows[p], n);
		c += b->count[p] * ldc;
		tile += b->rows[p] * WIDE;
	}
}

/* C_0, C_1, ... of odd functions, reversed samples, in rows order[] to X_1, X_3, ...: with the sign
 * of reversal a running sum. */
CT_INLINE void gather(float *c, const size_t *order, size_t count)
{
	ct_f32 sum[2] = {{0}, {0}};

	for (size_t k = 0; k < count; k++)
		for (size_t h = 0; h < 2; h++) {
			ct_f32 x = get(c + order[k] * WIDE, h, WIDE);

			sum[h] = k ? sum[h] + x : 0.5f * x;
			put(c + order[k] * WIDE, h, k % 2 ? -sum[h] : sum[h], WIDE);
		}
}

/* Its transpose. */
CT_INLINE void spread(float *c, const size_t *order, size_t count)
{
	ct_f32 sum[2] = {{0}, {0}};

	for (size_t k = count; k-- > 0;)
		for (size_t h = 0; h < 2; h++) {
			ct_f32 x = get(c + order[k] * WIDE, h, WIDE);

			sum[h] += k % 2 ? -x : x;
			put(c + order[k] * WIDE, h, k ? sum[h] : 0.5f * sum[h], WIDE);
		}
}

/* The function 0 is shorter than the others. */
CT_INLINE void first(float *c)
{
	for (size_t h = 0; h < 2; h++)
		put(c, h, 0.70710678f * get(c, h, WIDE), WIDE);
}

/* Coefficients from a tile that is folded once. */
static void multiply(const struct ct_cosine *b, float *c, size_t ldc, float *tile, size_t n)
{
	const size_t leaves = (size_t)1 << b->levels, rows = b->n >> b->levels;
	const size_t count = b->m >> b->levels;
	const float *twist = b->twist + b->n / 2;
	const size_t *order = b->order + b->m - count;
	float *out = tile + b->n * WIDE;

	if (b->levels == 0) {
		if (n == WIDE)
			leaf(b, c, ldc, tile, WIDE);
		else
			leaf(b, c, ldc, tile, n);
		return;
	}
	for (size_t l = 1; l < b->levels; twist += b->n >> ++l)
		for (size_t t = 0, s = b->n >> l; t < (size_t)1 << l; t++)
			fold(tile + t * s * WIDE, tile + t * s * WIDE, WIDE, s, WIDE, twist);
	for (size_t t = 0; t < leaves; t++) {
		fold(tile + t * rows * WIDE, tile + t * rows * WIDE, WIDE, rows, WIDE, NULL);
		leaf(b, out + t * count * WIDE, WIDE, tile + t * rows * WIDE, WIDE);
	}
	for (size_t l = b->levels; l-- > 0;) {
		const size_t half = b->m >> (l + 1);

		order -= half;
		for (size_t t = 0; t < (size_t)1 << l; t++)
			gather(out + (2 * t + 1) * half * WIDE, order, half);
	}
	first(out);
	for (size_t k = 0; k < b->m; k++)
		for (size_t h = 0; h < 2; h++)
			put(c + k * ldc, h, get(out + k * WIDE, h, WIDE), n);
}

static const float *twist_of(const struct ct_cosine *b)
{
	return b->levels ? b->twist : NULL;
}

void CT_SIMD_HERE(ct_cosine_analyse)(const struct ct_cosine *b, float *c, size_t ldc,
	const float *x, size_t ldx, size_t w, bool turned, float *tile)
{
	const float *twist = twist_of(b);

	for (size_t at = 0; at < w; at += WIDE) {
		size_t n = width(w, at);

		if (turned) {
			if (n < WIDE)
				memset(tile, 0, b->n * WIDE * sizeof *tile);
			turn(tile, WIDE, x + at * ldx, ldx, n, b->n);
			fold(tile, tile, WIDE, b->n, WIDE, twist);
		} else if (n == WIDE) {
			fold(tile, x + at, ldx, b->n, WIDE, twist);
		} else {
			fold(tile, x + at, ldx, b->n, n, twist);
		}
		multiply(b, c + at, ldc, tile, n);
	}
}

/* The tile of a leaf from its coefficients in (m,WIDE), folded but for its last unfolding. */
CT_INLINE void leaf_back(const struct ct_cosine *b, float *tile, const float *in)
{
	size_t s[CT_COSINE_PARTS] = {b->n >> b->levels};
	float *out = tile;

	for (size_t p = 0; p < b->parts; p++) {
		product(out, WIDE, b->v[p], in, b->rows[p], b->count[p], WIDE);
		in += b->count[p] * WIDE;
		out += b->rows[p] * WIDE;
	}
	for (size_t f = 1; f + 1 < b->parts; f++)
		s[f] = s[f - 1] - s[f - 1] / 2;
	for (size_t f = b->parts - 2; f > 0; f--)
		unfold(tile, WIDE, NULL, tile, s[f], WIDE, NULL);
}

/* tile = V^T c of a strip, folded but for its last unfolding. */
static void expand(
	const struct ct_cosine *b, float *tile, const float *c, size_t ldc, size_t n, float *in)
{
	const size_t leaves = (size_t)1 << b->levels, rows = b->n >> b->levels;
	const size_t count = b->m >> b->levels;
	const float *twist = b->twist + b->n - rows;
	const size_t *order = b->order;

	for (size_t k = 0; k < b->m; k++)
		for (size_t h = 0; h < 2; h++)
			put(in + k * WIDE, h, get(c + k * ldc, h, n), WIDE);
	if (b->levels == 0) {
		leaf_back(b, tile, in);
		return;
	}
	first(in);
	for (size_t l = 0; l < b->levels; l++) {
		const size_t half = b->m >> (l + 1);

		for (size_t t = 0; t < (size_t)1 << l; t++)
			spread(in + (2 * t + 1) * half * WIDE, order, half);
		order += half;
	}
	for (size_t t = 0; t < leaves; t++) {
		leaf_back(b, tile + t * rows * WIDE, in + t * count * WIDE);
		unfold(tile + t * rows * WIDE, WIDE, NULL, tile + t * rows * WIDE, rows, WIDE,
			NULL);
	}
	for (size_t l = b->levels - 1; l > 0; l--) {
		const size_t s = b->n >> l;

		twist -= s / 2;
		for (size_t t = 0; t < (size_t)1 << l; t++)
			unfold(tile + t * s * WIDE, WIDE, NULL, tile + t * s * WIDE, s, WIDE,
				twist);
	}
}

void CT_SIMD_HERE(ct_cosine_synthesise)(const struct ct_cosine *b, float *out, size_t ldo,
	const float *add, const float *c, size_t ldc, size_t w, float *tile)
{
	const float *twist = twist_of(b);

	for (size_t at = 0; at < w; at += WIDE) {
		size_t n = width(w, at);

		expand(b, tile, c + at, ldc, n, tile + b->n * WIDE);
		if (n == WIDE && add)
			unfold(out + at, ldo, add + at, tile, b->n, WIDE, twist);
		else
			unfold(out + at, ldo, add ? add + at : NULL, tile, b->n, n, twist);
	}
}

void CT_SIMD_HERE(ct_cosine_synthesise_turned)(const struct ct_cosine *b, float *out, size_t ldo,
	const float *c, size_t ldc, size_t w, float *tile)
{
	for (size_t at = 0; at < w; at += WIDE) {
		size_t n = width(w, at);

		expand(b, tile, c + at, ldc, n, tile + b->n * WIDE);
		unfold(tile, WIDE, NULL, tile, b->n, WIDE, twist_of(b));
		turn(out + at * ldo, ldo, tile, WIDE, b->n, n);
	}
}
