/* cosine.c: see cosine.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "operator/cosine.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>

enum {
	LEAST_FUNCTIONS = 16, /* functions of a part that is worth another fold, or of a leaf */
	LEVELS = 3,           /* at most: each costs a rounding */
};

double ct_cosine_at(size_t k, size_t j, size_t n)
{
	return cos(M_PI * (double)(k * (2 * j + 1) % (4 * n)) / (2 * (double)n));
}

void ct_cosine_rows(double *v, size_t m, size_t n)
{
	for (size_t k = 0; k < m; k++) {
		const double norm = sqrt((k ? 2.0 : 1.0) / (double)n);

		for (size_t j = 0; j < n; j++)
			v[k * n + j] = norm * ct_cosine_at(k, j, n);
	}
}

/* Is v a_k cos(pi k (j + 1/2) / n), a_0 = sqrt(1/n), else sqrt(2/n)? */
static bool cosines(const double *v, size_t m, size_t n)
{
	for (size_t k = 0; k < m; k++) {
		double a = sqrt((k ? 2.0 : 1.0) / (double)n);

		for (size_t j = 0; j < n; j++)
			if (!(fabs(v[k * n + j] - a * ct_cosine_at(k, j, n)) < 1e-10))
				return false;
	}
	return true;
}

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
static void cut(struct ct_cosine *b, const double *v, size_t m, size_t n)
{
	size_t s = n, left = m, rows[CT_COSINE_PARTS], count[CT_COSINE_PARTS], folded = 0;

	do {
		rows[folded] = s / 2;
		count[folded] = left / 2;
		folded++;
		s -= s / 2;
		left -= left / 2;
	} while (folded + 1 < CT_COSINE_PARTS && left >= LEAST_FUNCTIONS &&
		 n % ((size_t)1 << folded) == 0 && folds(v, m, n, (size_t)1 << folded, s));
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

/* The matrices of the leaf, functions v (m,n), from `at` on. */
static void leaf(struct ct_cosine *b, const double *v, size_t n, float *at)
{
	for (size_t p = 0; p < b->parts; p++) {
		size_t rows = b->rows[p], count = b->count[p];

		b->v[p] = at;
		b->vt[p] = at + rows * count;
		at += 2 * rows * count;
		for (size_t k = 0; k < count; k++)
			for (size_t r = 0; r < rows; r++) {
				/* a difference stands opposite its first row */
				size_t j = p ? rows - 1 - r : r;
				float w = (float)v[function(b, p, k) * n + j];

				b->v[p][k * rows + r] = w;
				b->vt[p][r * count + k] = w;
			}
	}
}

static size_t leaf_place(const struct ct_cosine *b, size_t k)
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

/* Place of coefficient k of a transform of level `from`. */
static size_t place(const struct ct_cosine *b, size_t from, size_t k)
{
	size_t at = 0;

	for (size_t l = from; l < b->levels; l++, k /= 2)
		if (k % 2)
			at += b->m >> (l + 1);
	return at + leaf_place(b, k);
}

static void tables(struct ct_cosine *b)
{
	float *w = b->twist;
	size_t *order = b->order;

	for (size_t l = 0; l < b->levels; l++) {
		size_t s = b->n >> l;

		for (size_t j = 0; j < s / 2; j++)
			*w++ = (float)(2 * ct_cosine_at(1, j, s));
		for (size_t k = 0; k < b->m >> (l + 1); k++)
			*order++ = place(b, l + 1, k);
	}
}

int ct_cosine_alloc(struct ct_cosine *b, const double *v, size_t m, size_t n, struct ct_err *e)
{
	struct ct_cosine made = {.n = n, .m = m};
	double *functions = NULL;
	size_t all, rows = n, count = m;
	float *at = NULL;

	if (cosines(v, m, n))
		while (made.levels < LEVELS && rows % 2 == 0 && count % 2 == 0 &&
			count / 2 >= LEAST_FUNCTIONS / 2) {
			made.levels++;
			rows /= 2;
			count /= 2;
		}
	if (ct_size_mul(&all, 2 * count, rows - rows / 2, "basis", e) ||
		ct_alloc0(&at, all + n, sizeof *at, e) ||
		ct_alloc0(&made.order, m + 1, sizeof *made.order, e) ||
		(made.levels && ct_alloc(&functions, count * rows, sizeof *functions, e))) {
		free(at);
		free(made.order);
		return -1;
	}
	for (size_t k = 0; k < count && functions; k++)
		for (size_t j = 0; j < rows; j++)
			functions[k * rows + j] = sqrt(2.0 / (double)n) * ct_cosine_at(k, j, rows);
	cut(&made, functions ? functions : v, count, rows);
	leaf(&made, functions ? functions : v, rows, at);
	made.twist = at + all;
	tables(&made);
	free(functions);
	*b = made;
	return 0;
}

void ct_cosine_free(struct ct_cosine *b)
{
	free(b->v[0]);
	free(b->order);
	*b = (struct ct_cosine){0};
}

size_t ct_cosine_place(const struct ct_cosine *b, size_t k)
{
	return place(b, 0, k);
}

size_t ct_cosine_scratch(const struct ct_cosine *b)
{
	return (b->n + b->m) * CT_COSINE_STRIP;
}
