/* banded.c: see banded.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "operator/banded.h"
#include "core/mem.h"

#include <stdlib.h>
#include <string.h>

enum { STRIP = 32 }; /* of the widest kernel */

static int rows_alloc(struct ct_banded_rows *r, const struct ct_taps *t, struct ct_err *e)
{
	if (ct_alloc(&r->first, t->n_out, sizeof *r->first, e) ||
		ct_alloc(&r->w, t->n_out * t->taps, sizeof *r->w, e))
		return -1;
	r->n = t->n_out;
	r->taps = t->taps;
	memcpy(r->first, t->first, t->n_out * sizeof *r->first);
	for (size_t i = 0; i < t->n_out * t->taps; i++)
		r->w[i] = (float)t->w[i];
	return 0;
}

/* Row i of D times row j. */
static double product(const struct ct_taps *d, size_t i, size_t j)
{
	double sum = 0;

	for (size_t p = 0; p < d->taps; p++) {
		const size_t at = d->first[i] + p;

		if (at >= d->first[j] && at < d->first[j] + d->taps)
			sum += d->w[i * d->taps + p] * d->w[j * d->taps + at - d->first[j]];
	}
	return sum;
}

static size_t reach(const struct ct_taps *d)
{
	size_t half = 0;

	for (size_t i = 0; i < d->n_out; i++)
		for (size_t j = i; j-- > 0 && d->first[j] + d->taps > d->first[i];)
			if (i - j > half && product(d, i, j) != 0.0)
				half = i - j;
	return half;
}

/* l[i half + q] = L[i][i - half + q] */
static int factor(struct ct_banded *b, const struct ct_taps *d, struct ct_err *e)
{
	const size_t m = d->n_out, half = reach(d);
	double *l = NULL, *pivot = NULL;
	int rc = -1;

	b->half = half;
	b->plain = half == 0;
	if (ct_alloc0(&l, m * half + 1, sizeof *l, e) || ct_alloc(&pivot, m, sizeof *pivot, e) ||
		ct_alloc0(&b->lower, m * half + 1, sizeof(float), e) ||
		ct_alloc0(&b->upper, m * half + 1, sizeof(float), e) ||
		ct_alloc(&b->inverse, m, sizeof(float), e))
		goto out;
	for (size_t i = 0; i < m; i++) {
		for (size_t j = i < half ? 0 : i - half; j <= i; j++) {
			double v = product(d, i, j);

			for (size_t k = i < half ? 0 : i - half; k < j; k++)
				if (k + half >= j)
					v -= l[i * half + k + half - i] *
					     l[j * half + k + half - j] * pivot[k];
			if (j == i)
				pivot[i] = v;
			else
				l[i * half + j + half - i] = v / pivot[j];
		}
		b->inverse[i] = (float)(1 / pivot[i]);
		b->plain = b->plain && b->inverse[i] == b->inverse[0];
		for (size_t q = 0; q < half; q++) {
			const float v = (float)-l[i * half + q];

			b->lower[i * half + q] = v;
			if (i + q >= half) /* of column i - half + q the row half - 1 - q below */
				b->upper[(i + q - half) * half + half - 1 - q] = v;
		}
	}
	rc = 0;
out:
	free(l);
	free(pivot);
	return rc;
}

int ct_banded_alloc(struct ct_banded *b, const struct ct_taps *d, struct ct_err *e)
{
	struct ct_taps up = {0};
	int rc = -1;

	if (ct_taps_transpose(&up, d, e) == 0 && rows_alloc(&b->down, d, e) == 0 &&
		rows_alloc(&b->up, &up, e) == 0 && factor(b, d, e) == 0)
		rc = 0;
	ct_taps_free(&up);
	if (rc)
		ct_banded_free(b);
	return rc;
}

void ct_banded_free(struct ct_banded *b)
{
	free(b->down.first);
	free(b->down.w);
	free(b->up.first);
	free(b->up.w);
	free(b->lower);
	free(b->upper);
	free(b->inverse);
	*b = (struct ct_banded){0};
}

size_t ct_banded_scratch(const struct ct_banded *b)
{
	return (b->up.n > b->down.n ? b->up.n : b->down.n) * STRIP;
}
