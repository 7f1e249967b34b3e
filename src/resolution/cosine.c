/* cosine.c: see cosine.h. */
#include "config.h"
#include "resolution/cosine.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>

enum { LEAST = 16 }; /* functions of a part that is worth another fold */

/* Are functions 0, step, 2 step ... alternately even and odd about the middle of their first s
 * samples? */
static bool folds(const double *v, size_t m, size_t n, size_t step, size_t s)
{
	for (size_t k = 0; k < m; k += step) {
		double sign = k / step % 2 ? -1 : 1;

		for (size_t j = 0; j < s / 2; j++)
			if (fabs(v[k * n + j] - sign * v[k * n + s - 1 - j]) > 1e-10)
				return false;
	}
	return true;
}

/* Parts, first the odd functions of each fold in turn, then what is even to the last, reversed. */
static void cut(struct ct_cosine *b, const double *v)
{
	size_t s = b->n, left = b->m, rows[CT_COSINE_PARTS], count[CT_COSINE_PARTS], folded = 0;

	do {
		rows[folded] = s / 2;
		count[folded] = left / 2;
		folded++;
		s -= s / 2;
		left -= left / 2;
	} while (folded + 1 < CT_COSINE_PARTS && left >= LEAST &&
		 b->n % ((size_t)1 << folded) == 0 && folds(v, b->m, b->n, (size_t)1 << folded, s));
	b->parts = folded + 1;
	b->rows[0] = s;
	b->count[0] = left;
	for (size_t p = 1; p < b->parts; p++) {
		b->rows[p] = rows[folded - p];
		b->count[p] = count[folded - p];
	}
}

/* Function `index` of part p. */
static size_t function(const struct ct_cosine *b, size_t p, size_t index)
{
	size_t step = (size_t)1 << (p ? b->parts - p : b->parts - 1);

	return p ? step * index + step / 2 : step * index;
}

int ct_cosine_alloc(struct ct_cosine *b, const double *v, size_t m, size_t n, struct ct_err *e)
{
	struct ct_cosine made = {.n = n, .m = m};
	size_t all;
	float *at;

	cut(&made, v);
	if (ct_size_mul(&all, 2 * m, n - n / 2, "basis", e) || ct_alloc0(&at, all, sizeof *at, e))
		return -1;
	for (size_t p = 0; p < made.parts; p++) {
		size_t rows = made.rows[p], count = made.count[p];

		made.v[p] = at;
		made.vt[p] = at + rows * count;
		at += 2 * rows * count;
		for (size_t k = 0; k < count; k++)
			for (size_t r = 0; r < rows; r++) {
				/* a difference stands opposite its first row */
				size_t j = p ? rows - 1 - r : r;
				float w = (float)v[function(&made, p, k) * n + j];

				made.v[p][k * rows + r] = w;
				made.vt[p][r * count + k] = w;
			}
	}
	*b = made;
	return 0;
}

void ct_cosine_free(struct ct_cosine *b)
{
	free(b->v[0]);
	*b = (struct ct_cosine){0};
}

size_t ct_cosine_place(const struct ct_cosine *b, size_t k)
{
	size_t p = b->parts - 1, at = 0;

	while (p > 0 && k % 2 == 0) {
		k /= 2;
		p--;
	}
	for (size_t q = 0; q < p; q++)
		at += b->count[q];
	return at + (p ? k / 2 : k);
}

size_t ct_cosine_scratch(const struct ct_cosine *b)
{
	return (b->n + b->m) * CT_COSINE_STRIP;
}
