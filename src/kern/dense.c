/* dense.c: see dense.h. ROWS x WIDTH sums are held in registers. */
#include "config.h"
#pragma GCC optimize("O3")
#include "kern/dense.h"

#include <string.h>

#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__)
#define CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define CLONES
#endif

enum { ROWS = 4, LANES = 16, VECTORS = CT_DENSE_WIDTH / LANES };

typedef float lanes __attribute__((vector_size(4 * LANES)));
typedef float loose __attribute__((vector_size(4 * LANES), aligned(4), may_alias));

static inline __attribute__((always_inline)) void block(float *restrict c, size_t ldc,
	const float *restrict a, size_t lda, const float *restrict b, size_t ldb, size_t n,
	size_t k, bool add, const size_t rows)
{
	lanes sum[ROWS][VECTORS] = {{{0}}};
	float row[CT_DENSE_WIDTH];

	for (size_t q = 0; q < k; q++) {
		lanes b0 = *(const loose *)(b + q * ldb), b1 = *(const loose *)(b + q * ldb + LANES);

#pragma GCC unroll 4
		for (size_t r = 0; r < rows; r++) {
			float f = a[r * lda + q];

			sum[r][0] += f * b0;
			sum[r][1] += f * b1;
		}
	}
#pragma GCC unroll 4
	for (size_t r = 0; r < rows; r++) {
		memcpy(row, sum[r], sizeof row);
		for (size_t j = 0; j < n; j++)
			c[r * ldc + j] = add ? c[r * ldc + j] + row[j] : row[j];
	}
}

CLONES void ct_dense(float *restrict c, size_t ldc, const float *restrict a, size_t lda,
	const float *restrict b, size_t ldb, size_t m, size_t n, size_t k, bool add)
{
	for (size_t j = 0; j < n; j += CT_DENSE_WIDTH) {
		size_t wide = n - j < CT_DENSE_WIDTH ? n - j : CT_DENSE_WIDTH, i = 0;

		for (; i + ROWS <= m; i += ROWS)
			block(c + i * ldc + j, ldc, a + i * lda, lda, b + j, ldb, wide, k, add, ROWS);
		for (; i < m; i++)
			block(c + i * ldc + j, ldc, a + i * lda, lda, b + j, ldb, wide, k, add, 1);
	}
}
