/* dense.c: see dense.h. Blocks of sums are held in registers: 4 rows of 32, or 8 of 16. */
#include "config.h"
#pragma GCC optimize("O3", "fp-contract=fast")
#include "resolution/dense.h"

#include <string.h>

#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__)
#define CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define CLONES
#endif

enum { LANES = CT_DENSE_WIDTH, MOST_ROWS = 8, MOST_VECTORS = 2 };

typedef float lanes __attribute__((vector_size(4 * LANES)));
typedef float loose __attribute__((vector_size(4 * LANES), aligned(4), may_alias));

static inline __attribute__((always_inline)) void store(float *c, lanes v, size_t n)
{
	if (n >= LANES)
		*(loose *)c = v;
	else
		memcpy(c, &v, n * sizeof *c);
}

/* rows x (vectors * LANES) elements of c, of which n columns exist. */
static inline __attribute__((always_inline)) void block(float *c, ptrdiff_t ldc, const float *a,
	size_t lda, const float *b, ptrdiff_t ldb, size_t n, size_t k, const size_t rows,
	const size_t vectors)
{
	lanes sum[MOST_ROWS][MOST_VECTORS] = {{{0}}};

	for (size_t q = 0; q < k; q++) {
		const float *in = b + (ptrdiff_t)q * ldb;
		lanes b0 = *(const loose *)in, b1 = b0;

		if (vectors > 1)
			b1 = *(const loose *)(in + LANES);

#pragma GCC unroll 8
		for (size_t r = 0; r < rows; r++) {
			float f = a[r * lda + q];

			sum[r][0] += f * b0;
			if (vectors > 1)
				sum[r][1] += f * b1;
		}
	}
#pragma GCC unroll 8
	for (size_t r = 0; r < rows; r++) {
		store(c + (ptrdiff_t)r * ldc, sum[r][0], n);
		if (vectors > 1 && n > LANES)
			store(c + (ptrdiff_t)r * ldc + LANES, sum[r][1], n - LANES);
	}
}

CLONES void ct_dense(float *c, ptrdiff_t ldc, const float *a, size_t lda, const float *b,
	ptrdiff_t ldb, size_t m, size_t n, size_t k)
{
	size_t i, j = 0;

	for (; j + LANES < n; j += 2 * LANES) {
		for (i = 0; i + 4 <= m; i += 4)
			block(c + (ptrdiff_t)i * ldc + j, ldc, a + i * lda, lda, b + j, ldb, n - j,
				k, 4, 2);
		for (; i < m; i++)
			block(c + (ptrdiff_t)i * ldc + j, ldc, a + i * lda, lda, b + j, ldb, n - j,
				k, 1, 2);
	}
	if (j >= n)
		return;
	for (i = 0; i + 8 <= m; i += 8)
		block(c + (ptrdiff_t)i * ldc + j, ldc, a + i * lda, lda, b + j, ldb, n - j, k, 8,
			1);
	for (; i < m; i++)
		block(c + (ptrdiff_t)i * ldc + j, ldc, a + i * lda, lda, b + j, ldb, n - j, k, 1,
			1);
}
