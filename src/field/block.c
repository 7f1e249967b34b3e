/* block.c: see block.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "field/block.h"

#include <math.h>

/* Middle of a row. */
static double middle(const struct ct_taps *t, size_t row)
{
	double sum = 0, at = 0;

	for (size_t q = 0; q < t->taps; q++) {
		double w = fabs(t->w[row * t->taps + q]);

		sum += w;
		at += w * (double)(t->first[row] + q);
	}
	return sum > 0 ? at / sum : (double)t->first[row];
}

/* How much of the weights of a row is farther than `reach` from its middle. */
static double beyond(const struct ct_taps *t, size_t row, double reach)
{
	const double at = middle(t, row);
	double sum = 0, far = 0;

	for (size_t q = 0; q < t->taps; q++) {
		double w = fabs(t->w[row * t->taps + q]);

		sum += w;
		if (fabs((double)(t->first[row] + q) - at) > reach)
			far += w;
	}
	return sum > 0 ? far / sum : 0;
}

int ct_field_operator_alloc(struct ct_field_operator *o, const struct ct_degrade *d,
	const size_t n[static 3], struct ct_err *e)
{
	for (int a = 0; a < 3; a++) {
		const size_t most = (size_t)ceil(CT_FIELD_BLOCK_REACH * d->factor[a]);

		if (ct_degrade_axis_taps(&o->row[a], d, a, n[a], e))
			return -1;
		o->reach[a] = 0;
		while (o->reach[a] < most && beyond(&o->row[a], o->row[a].n_out / 2,
						     (double)o->reach[a]) > CT_FIELD_BLOCK_REST)
			o->reach[a]++;
	}
	return 0;
}

void ct_field_operator_free(struct ct_field_operator *o)
{
	for (int a = 0; a < 3; a++)
		ct_taps_free(&o->row[a]);
	*o = (struct ct_field_operator){0};
}

static void range(
	size_t *first, size_t *n, const struct ct_field_operator *o, int a, size_t lo, size_t m)
{
	const struct ct_taps *t = &o->row[a];
	const double reach = (double)o->reach[a];
	double from = floor(middle(t, lo) - reach), to = ceil(middle(t, lo + m - 1) + reach) + 1;

	if (lo == 0)
		from = 0;
	if (lo + m == t->n_out)
		to = (double)t->n_in;
	from = fmax(from, 0);
	to = fmin(to, (double)t->n_in);
	*first = (size_t)from;
	*n = (size_t)(to - from);
}

void ct_field_operator_most(
	size_t n[static 3], const struct ct_field_operator *o, const size_t m[static 3])
{
	for (int a = 0; a < 3; a++) {
		n[a] = 0;
		for (size_t lo = 0; lo + m[a] <= o->row[a].n_out; lo++) {
			size_t first, long_;

			range(&first, &long_, o, a, lo, m[a]);
			n[a] = long_ > n[a] ? long_ : n[a];
		}
	}
}

/* Rows lo, ..., lo + m - 1 of a table, of inputs first, ..., first + n - 1. */
static int cut(struct ct_taps *t, const struct ct_taps *all, size_t lo, size_t m, size_t first,
	size_t n, struct ct_err *e)
{
	if (ct_taps_alloc(t, n, m, all->taps, e))
		return -1;
	for (size_t r = 0; r < m; r++) {
		const double *w = all->w + (lo + r) * all->taps;
		const size_t from = all->first[lo + r];
		double sum = 0;

		ct_taps_place(t, r, (ptrdiff_t)from - (ptrdiff_t)first);
		for (size_t q = 0; q < all->taps; q++)
			if (from + q >= first && from + q < first + n)
				sum += w[q];
		for (size_t q = 0; q < all->taps; q++)
			if (from + q >= first && from + q < first + n && sum != 0)
				ct_taps_add(t, r, from + q - first, w[q] / sum);
	}
	return 0;
}

int ct_field_block_plan(struct ct_field_block *b, const struct ct_field_operator *o,
	const size_t lo[static 3], const size_t m[static 3], const struct ct_par *par,
	struct ct_err *e)
{
	for (int a = 0; a < 3; a++) {
		b->lo[a] = lo[a];
		b->m[a] = m[a];
		range(&b->first[a], &b->n[a], o, a, lo[a], m[a]);
		if (cut(&b->forward.t[a], &o->row[a], lo[a], m[a], b->first[a], b->n[a], e) ||
			ct_taps_transpose(&b->adjoint.t[a], &b->forward.t[a], e))
			return -1;
	}
	if (ct_separable_plan(&b->forward, par, e))
		return -1;
	return ct_separable_plan(&b->adjoint, par, e);
}

void ct_field_block_free(struct ct_field_block *b)
{
	ct_separable_free(&b->forward);
	ct_separable_free(&b->adjoint);
	*b = (struct ct_field_block){0};
}

double ct_field_block_tv(float *dx, const float *x, const size_t n[static 3],
	const double weight[static 3], double factor)
{
	const size_t stride[3] = {1, n[0], n[0] * n[1]};
	const float eps2 = (float)(CT_FIELD_BLOCK_EPS * CT_FIELD_BLOCK_EPS);
	const float w[3] = {(float)weight[0], (float)weight[1], (float)weight[2]};
	double sum = 0;

	for (size_t r = 0; r < n[1] * n[2]; r++) {
		const size_t at[2] = {r % n[1], r / n[1]};
		double row = 0;

		for (size_t i = 0; i < n[0]; i++) {
			const size_t v = r * n[0] + i;
			const bool in[3] = {i + 1 < n[0], at[0] + 1 < n[1], at[1] + 1 < n[2]};
			float d[3] = {0}, size = eps2, per;

			for (int a = 0; a < 3; a++)
				if (in[a])
					d[a] = w[a] * (x[v + stride[a]] - x[v]);
			size = sqrtf(size + d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
			row += (double)size - CT_FIELD_BLOCK_EPS;
			per = (float)factor / size;
			for (int a = 0; a < 3; a++)
				if (in[a]) {
					dx[v + stride[a]] += per * w[a] * d[a];
					dx[v] -= per * w[a] * d[a];
				}
		}
		sum += row;
	}
	return sum;
}
