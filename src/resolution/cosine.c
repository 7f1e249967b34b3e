/* cosine.c: see cosine.h. */
#include "config.h"
#include "resolution/cosine.h"
#include "core/mem.h"
#include "resolution/fold.h"

#include <stdlib.h>
#include <string.h>

enum { ROWS = 16 }; /* that are folded at a time */

int ct_basis_alloc(struct ct_basis *b, const double *v, size_t m, size_t n, struct ct_err *e)
{
	size_t half = (n + 1) / 2, count[2] = {(m + 1) / 2, m / 2}, wide = CT_DENSE_ROW(half);
	size_t tall[2] = {CT_DENSE_ROW(count[0]), CT_DENSE_ROW(count[1])}, all;

	if (ct_size_mul(&all, m + tall[0] + tall[1], wide, "basis", e) ||
		ct_alloc0(&b->v[0], all, sizeof *b->v[0], e))
		return -1;
	b->n = n;
	b->m = m;
	b->half = half;
	b->odd = tall[0];
	b->row = tall[0] + tall[1];
	b->v[1] = b->v[0] + count[0] * wide;
	b->vt[0] = b->v[1] + count[1] * wide;
	b->vt[1] = b->vt[0] + half * tall[0];
	for (size_t k = 0; k < m; k++)
		for (size_t j = 0; j < half; j++) {
			float w = (float)v[k * n + j];

			b->v[k % 2][k / 2 * wide + j] = w;
			b->vt[k % 2][j * tall[k % 2] + k / 2] = w;
		}
	memcpy(b->count, count, sizeof count);
	return 0;
}

void ct_basis_free(struct ct_basis *b)
{
	free(b->v[0]);
	*b = (struct ct_basis){0};
}

size_t ct_basis_place(const struct ct_basis *b, size_t k)
{
	return k / 2 + k % 2 * b->count[0];
}

size_t ct_basis_row_place(const struct ct_basis *b, size_t k)
{
	return k / 2 + k % 2 * b->odd;
}

void ct_basis_analyse(
	const struct ct_basis *b, float *c, size_t ldc, float *x, size_t ldx, size_t w)
{
	size_t wide = CT_DENSE_ROW(b->half), pairs = b->n / 2;

	for (size_t j = 0; j < pairs; j++) /* the difference, in row n-1-j: upwards */
		CT_SIMD(ct_butterfly)(x + j * ldx, x + (b->n - 1 - j) * ldx, w);
	CT_SIMD(ct_dense)
	(c, (ptrdiff_t)ldc, b->v[0], wide, x, (ptrdiff_t)ldx, b->count[0], w, b->half);
	CT_SIMD(ct_dense)
	(c + b->count[0] * ldc, (ptrdiff_t)ldc, b->v[1], wide, x + (b->n - 1) * ldx,
		-(ptrdiff_t)ldx, b->count[1], w, pairs);
}

void ct_basis_synthesise(
	const struct ct_basis *b, float *x, size_t ldx, const float *c, size_t ldc, size_t w)
{
	size_t pairs = b->n / 2;

	CT_SIMD(ct_dense)
	(x, (ptrdiff_t)ldx, b->vt[0], CT_DENSE_ROW(b->count[0]), c, (ptrdiff_t)ldc, b->half, w,
		b->count[0]);
	CT_SIMD(ct_dense)
	(x + (b->n - 1) * ldx, -(ptrdiff_t)ldx, b->vt[1], CT_DENSE_ROW(b->count[1]),
		c + b->count[0] * ldc, (ptrdiff_t)ldc, pairs, w, b->count[1]);
	for (size_t j = 0; j < pairs; j++)
		CT_SIMD(ct_butterfly)(x + j * ldx, x + (b->n - 1 - j) * ldx, w);
}

size_t ct_basis_scratch(const struct ct_basis *b)
{
	return 2 * ROWS * CT_DENSE_ROW(b->half);
}

void ct_basis_analyse_rows(
	const struct ct_basis *b, float *c, const float *x, size_t h, float *scratch)
{
	size_t wide = CT_DENSE_ROW(b->half), tall[2] = {b->odd, b->row - b->odd};
	float *odd = scratch + ROWS * wide;

	for (size_t y = 0; y < h; y += ROWS) {
		size_t rows = h - y < ROWS ? h - y : ROWS;

		for (size_t r = 0; r < rows; r++)
			CT_SIMD(ct_fold)
			(scratch + r * wide, odd + r * wide, x + (y + r) * b->n, b->n);
		CT_SIMD(ct_dense)
		(c + y * b->row, (ptrdiff_t)b->row, scratch, wide, b->vt[0], (ptrdiff_t)tall[0],
			rows, tall[0], b->half);
		CT_SIMD(ct_dense)
		(c + y * b->row + b->odd, (ptrdiff_t)b->row, odd, wide, b->vt[1],
			(ptrdiff_t)tall[1], rows, tall[1], b->n / 2);
	}
}

void ct_basis_synthesise_rows(const struct ct_basis *b, float *out, const float *x, const float *c,
	size_t h, float *scratch)
{
	size_t wide = CT_DENSE_ROW(b->half);
	float *odd = scratch + ROWS * wide;

	for (size_t y = 0; y < h; y += ROWS) {
		size_t rows = h - y < ROWS ? h - y : ROWS;

		CT_SIMD(ct_dense)
		(scratch, (ptrdiff_t)wide, c + y * b->row, b->row, b->v[0], (ptrdiff_t)wide, rows,
			b->half, b->count[0]);
		CT_SIMD(ct_dense)
		(odd, (ptrdiff_t)wide, c + y * b->row + b->odd, b->row, b->v[1], (ptrdiff_t)wide,
			rows, b->n / 2, b->count[1]);
		for (size_t r = 0; r < rows; r++)
			CT_SIMD(ct_unfold_add)
			(out + (y + r) * b->n, x + (y + r) * b->n, scratch + r * wide,
				odd + r * wide, b->n);
	}
}
