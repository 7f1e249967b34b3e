/* dense.c: see dense.h. Blocks of sums are held in registers, of which v2 and v3 have 16 and v4 and
 * NEON 32. */
#include "config.h"
#include "resolution/dense.h"
#include "core/vec.h"

#if defined(__AVX512F__) || defined(__aarch64__)
enum { ROWS = 8 };
#else
enum { ROWS = 4 };
#endif

/* rows x (vectors registers) elements of c, of which n columns exist. */
CT_INLINE void block(float *c, ptrdiff_t ldc, const float *a, size_t lda, const float *b,
	ptrdiff_t ldb, size_t n, size_t k, const size_t rows, const size_t vectors)
{
	ct_f32 sum[ROWS][2] = {{{0}}};

	for (size_t q = 0; q < k; q++) {
		const float *in = b + (ptrdiff_t)q * ldb;
		ct_f32 b0 = ct_f32_load(in), b1 = b0;

		if (vectors > 1)
			b1 = ct_f32_load(in + CT_F32_LANES);

#pragma GCC unroll 8
		for (size_t r = 0; r < rows; r++) {
			ct_f32 f = ct_f32_set(a[r * lda + q]);

			sum[r][0] = ct_f32_fma(f, b0, sum[r][0]);
			if (vectors > 1)
				sum[r][1] = ct_f32_fma(f, b1, sum[r][1]);
		}
	}
#pragma GCC unroll 8
	for (size_t r = 0; r < rows; r++) {
		ct_f32_store_n(c + (ptrdiff_t)r * ldc, sum[r][0], n);
		if (vectors > 1 && n > CT_F32_LANES)
			ct_f32_store_n(
				c + (ptrdiff_t)r * ldc + CT_F32_LANES, sum[r][1], n - CT_F32_LANES);
	}
}

/* Columns [j, j + 2 registers) or, with vectors 1, [j, j + 1 register), of all rows. */
CT_INLINE void column(float *c, ptrdiff_t ldc, const float *a, size_t lda, const float *b,
	ptrdiff_t ldb, size_t m, size_t n, size_t k, const size_t vectors)
{
	size_t i = 0;

	for (; i + ROWS <= m; i += ROWS)
		block(c + (ptrdiff_t)i * ldc, ldc, a + i * lda, lda, b, ldb, n, k, ROWS, vectors);
	for (; i + 2 <= m; i += 2)
		block(c + (ptrdiff_t)i * ldc, ldc, a + i * lda, lda, b, ldb, n, k, 2, vectors);
	if (i < m)
		block(c + (ptrdiff_t)i * ldc, ldc, a + i * lda, lda, b, ldb, n, k, 1, vectors);
}

void CT_SIMD_HERE(ct_dense)(float *c, ptrdiff_t ldc, const float *a, size_t lda, const float *b,
	ptrdiff_t ldb, size_t m, size_t n, size_t k)
{
	size_t j = 0;

	for (; j + CT_F32_LANES < n; j += 2 * CT_F32_LANES)
		column(c + j, ldc, a, lda, b + j, ldb, m, n - j, k, 2);
	if (j < n)
		column(c + j, ldc, a, lda, b + j, ldb, m, n - j, k, 1);
}
