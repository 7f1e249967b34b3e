/* separable.c: see separable.h.
 *
 * A task takes WIDTH neighbouring lines: it copies them into a tile [n_in][WIDTH] of doubles, so
 * that the strides of the three axes, which are powers of two more often than not, are walked
 * once, and then works on contiguous memory only.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "operator/separable.h"
#include "core/mem.h"

#include <stdlib.h>
#include <string.h>

enum { WIDTH = CT_SEPARABLE_WIDTH, ROWS = 16, FETCH = 16, LINE = 16 }; /* LINE: of the cache */

int ct_taps_alloc(struct ct_taps *t, size_t n_in, size_t n_out, size_t taps, struct ct_err *e)
{
	size_t count;

	*t = (struct ct_taps){.n_in = n_in, .n_out = n_out, .taps = taps < n_in ? taps : n_in};
	if (n_in == 0 || n_out == 0 || taps == 0)
		return ct_fail(e, CT_EINPUT, "an axis of no samples");
	if (ct_size_mul(&count, n_out, t->taps, "weights", e) ||
		ct_alloc0(&t->first, n_out, sizeof *t->first, e) ||
		ct_alloc0(&t->w, count, sizeof *t->w, e)) {
		ct_taps_free(t);
		return -1;
	}
	return 0;
}

void ct_taps_free(struct ct_taps *t)
{
	free(t->first);
	free(t->w);
	*t = (struct ct_taps){0};
}

void ct_taps_place(struct ct_taps *t, size_t m, ptrdiff_t lo)
{
	size_t last = t->n_in - t->taps;

	t->first[m] = lo < 0 ? 0 : (size_t)lo > last ? last : (size_t)lo;
}

void ct_taps_add(struct ct_taps *t, size_t m, size_t k, double w)
{
	t->w[m * t->taps + k - t->first[m]] += w;
}

size_t ct_taps_reflect(ptrdiff_t k, size_t n)
{
	ptrdiff_t period = 2 * (ptrdiff_t)n, r = (k % period + period) % period;

	return r < (ptrdiff_t)n ? (size_t)r : (size_t)(period - 1 - r);
}

int ct_taps_identity(struct ct_taps *t, size_t n, struct ct_err *e)
{
	if (ct_taps_alloc(t, n, n, 1, e))
		return -1;
	for (size_t m = 0; m < n; m++) {
		t->first[m] = m;
		t->w[m] = 1.0;
	}
	return 0;
}

bool ct_taps_is_identity(const struct ct_taps *t)
{
	if (t->n_in != t->n_out)
		return false;
	for (size_t m = 0; m < t->n_out; m++)
		for (size_t q = 0; q < t->taps; q++)
			if (t->w[m * t->taps + q] != (t->first[m] + q == m ? 1.0 : 0.0))
				return false;
	return true;
}

int ct_taps_filter(struct ct_taps *t, size_t n, size_t reach,
	double (*weight)(double d, const double *by), const double *by, struct ct_err *e)
{
	const ptrdiff_t far = (ptrdiff_t)reach;

	if (ct_taps_alloc(t, n, n, 2 * reach + 1, e))
		return -1;
	for (size_t m = 0; m < n; m++) {
		ct_taps_place(t, m, (ptrdiff_t)m - far);
		for (ptrdiff_t d = -far; d <= far; d++)
			ct_taps_add(
				t, m, ct_taps_reflect((ptrdiff_t)m + d, n), weight((double)d, by));
	}
	return 0;
}

/* Inputs of b that row m of a b reaches: [*lo, *hi). */
static void reach(
	size_t *lo, size_t *hi, const struct ct_taps *a, const struct ct_taps *b, size_t m)
{
	*lo = b->n_in;
	*hi = 0;
	for (size_t q = a->first[m]; q < a->first[m] + a->taps; q++) {
		*lo = b->first[q] < *lo ? b->first[q] : *lo;
		*hi = b->first[q] + b->taps > *hi ? b->first[q] + b->taps : *hi;
	}
}

int ct_taps_product(
	struct ct_taps *t, const struct ct_taps *a, const struct ct_taps *b, struct ct_err *e)
{
	size_t taps = 1, lo, hi;

	for (size_t m = 0; m < a->n_out; m++) {
		reach(&lo, &hi, a, b, m);
		taps = hi - lo > taps ? hi - lo : taps;
	}
	if (ct_taps_alloc(t, b->n_in, a->n_out, taps, e))
		return -1;
	for (size_t m = 0; m < a->n_out; m++) {
		reach(&lo, &hi, a, b, m);
		ct_taps_place(t, m, (ptrdiff_t)lo);
		for (size_t q = 0; q < a->taps; q++) {
			size_t row = a->first[m] + q;
			double w = a->w[m * a->taps + q];

			for (size_t k = 0; k < b->taps; k++)
				ct_taps_add(t, m, b->first[row] + k, w * b->w[row * b->taps + k]);
		}
	}
	return 0;
}

int ct_taps_transpose(struct ct_taps *t, const struct ct_taps *a, struct ct_err *e)
{
	size_t *lo = NULL, *hi = NULL, taps = 1;
	int rc = -1;

	if (ct_alloc(&lo, a->n_in, sizeof *lo, e) || ct_alloc0(&hi, a->n_in, sizeof *hi, e))
		goto out;
	for (size_t k = 0; k < a->n_in; k++)
		lo[k] = a->n_out;
	for (size_t m = 0; m < a->n_out; m++)
		for (size_t q = 0; q < a->taps; q++)
			if (a->w[m * a->taps + q] != 0.0) {
				size_t k = a->first[m] + q;

				lo[k] = m < lo[k] ? m : lo[k];
				hi[k] = m + 1;
			}
	for (size_t k = 0; k < a->n_in; k++)
		if (hi[k] > lo[k] && hi[k] - lo[k] > taps)
			taps = hi[k] - lo[k];
	if (ct_taps_alloc(t, a->n_out, a->n_in, taps, e))
		goto out;
	for (size_t k = 0; k < a->n_in; k++)
		ct_taps_place(t, k, (ptrdiff_t)lo[k]);
	for (size_t m = 0; m < a->n_out; m++)
		for (size_t q = 0; q < a->taps; q++)
			if (a->w[m * a->taps + q] != 0.0)
				ct_taps_add(t, a->first[m] + q, m, a->w[m * a->taps + q]);
	rc = 0;
out:
	free(lo);
	free(hi);
	return rc;
}

size_t ct_taps_scratch(const struct ct_taps *t, const struct ct_par *par)
{
	return ct_par_threads(par) * t->n_in * WIDTH;
}

struct separable_job {
	float *out;
	const float *in;
	const struct ct_taps *t;
	double *scratch;
	bool add;      /* to what out holds */
	size_t inner;  /* samples between neighbours along the axis */
	size_t blocks; /* of WIDTH lines in each run of `inner` lines (axis 0: in all lines) */
	size_t lines;  /* axis 0 only: how many */
};

static void put(const struct separable_job *j, float *out, const float *row, size_t n)
{
	if (!j->add)
		memcpy(out, row, n * sizeof *out);
	for (size_t i = 0; j->add && i < n; i++)
		out[i] += row[i];
}

/* Lines that are `inner` apart along the axis and contiguous across it. */
static void across(void *arg, size_t task, size_t worker)
{
	const struct separable_job *j = arg;
	size_t outer = task / j->blocks, at = task % j->blocks * WIDTH;
	size_t width = j->inner - at < WIDTH ? j->inner - at : WIDTH;
	const float *in = j->in + outer * j->t->n_in * j->inner + at;
	float *out = j->out + outer * j->t->n_out * j->inner + at, rows[ROWS * WIDTH];
	double *tile = j->scratch + worker * j->t->n_in * WIDTH;

	if (width < WIDTH)
		memset(tile, 0, j->t->n_in * WIDTH * sizeof *tile);
	for (size_t k = 0; k < j->t->n_in; k++) {
		const float *row = in + k * j->inner;

		/* each row is on a page of its own, which no processor sees coming */
		for (size_t i = 0; i < width && k + FETCH < j->t->n_in; i += LINE)
			__builtin_prefetch(row + FETCH * j->inner + i);
		for (size_t i = 0; i < width; i++)
			tile[k * WIDTH + i] = (double)row[i];
	}
	for (size_t m = 0; m < j->t->n_out; m += ROWS) {
		size_t n = j->t->n_out - m < ROWS ? j->t->n_out - m : ROWS;

		CT_SIMD(ct_separable_rows)(rows, tile, j->t, m, n);
		for (size_t r = 0; r < n; r++)
			put(j, out + (m + r) * j->inner, rows + r * WIDTH, width);
	}
}

/* Lines contiguous along the axis: transposed on the way in and on the way out. */
static void along(void *arg, size_t task, size_t worker)
{
	const struct separable_job *j = arg;
	size_t at = task * WIDTH, n_in = j->t->n_in, n_out = j->t->n_out;
	size_t width = j->lines - at < WIDTH ? j->lines - at : WIDTH;
	const float *in = j->in + at * n_in;
	float *out = j->out + at * n_out, rows[ROWS * WIDTH];
	double *tile = j->scratch + worker * n_in * WIDTH;

	if (width < WIDTH)
		memset(tile, 0, n_in * WIDTH * sizeof *tile);
	for (size_t k = 0; k < n_in; k += ROWS) {
		size_t n = n_in - k < ROWS ? n_in - k : ROWS;

		for (size_t i = 0; i < width; i++)
			for (size_t r = 0; r < n; r++)
				tile[(k + r) * WIDTH + i] = (double)in[i * n_in + k + r];
	}
	for (size_t m = 0; m < n_out; m += ROWS) {
		size_t n = n_out - m < ROWS ? n_out - m : ROWS;

		CT_SIMD(ct_separable_rows)(rows, tile, j->t, m, n);
		for (size_t i = 0; i < width; i++) {
			float line[ROWS];

			for (size_t r = 0; r < n; r++)
				line[r] = rows[r * WIDTH + i];
			put(j, out + i * n_out + m, line, n);
		}
	}
}

static void apply(struct separable_job j, const size_t n[static 3], int axis, struct ct_par *par)
{
	j.inner = n[0];

	if (axis == 0) {
		j.lines = n[1] * n[2];
		ct_par_for(par, (j.lines + WIDTH - 1) / WIDTH, along, &j);
		return;
	}
	if (axis == 2)
		j.inner *= n[1];
	j.blocks = (j.inner + WIDTH - 1) / WIDTH;
	ct_par_for(par, j.blocks * (axis == 1 ? n[2] : 1), across, &j);
}

void ct_taps_apply(float *restrict out, const float *restrict in, const size_t n[static 3],
	int axis, const struct ct_taps *t, double *scratch, struct ct_par *par)
{
	apply((struct separable_job){.out = out, .in = in, .t = t, .scratch = scratch}, n, axis,
		par);
}

/* Shrink first, grow last; among equals the slowest axis first, which has the worst strides. */
static void choose_order(struct ct_separable *s)
{
	for (int a = 2; a >= 0; a--) {
		const struct ct_taps *p = &s->t[a];
		int at = s->passes;

		if (ct_taps_is_identity(p))
			continue;
		for (; at > 0; at--) {
			const struct ct_taps *q = &s->t[s->order[at - 1]];

			if ((double)p->n_out * (double)q->n_in >=
				(double)q->n_out * (double)p->n_in)
				break;
			s->order[at] = s->order[at - 1];
		}
		s->order[at] = a;
		s->passes++;
	}
}

int ct_separable_plan(struct ct_separable *s, const struct ct_par *par, struct ct_err *e)
{
	size_t n[3], scratch = 0, count;

	for (int a = 0; a < 3; a++) {
		n[a] = s->t[a].n_in;
		if (ct_taps_scratch(&s->t[a], par) > scratch)
			scratch = ct_taps_scratch(&s->t[a], par);
	}
	choose_order(s);
	if (ct_alloc(&s->scratch, scratch, sizeof *s->scratch, e))
		goto fail;
	for (int pass = 0; pass + 1 < s->passes; pass++) {
		n[s->order[pass]] = s->t[s->order[pass]].n_out;
		if (ct_size_mul(&count, n[0], n[1], "volume", e) ||
			ct_size_mul(&count, count, n[2], "volume", e) ||
			ct_alloc(&s->tmp[pass], count, sizeof *s->tmp[pass], e))
			goto fail;
	}
	return 0;
fail:
	ct_separable_free(s);
	return -1;
}

void ct_separable_free(struct ct_separable *s)
{
	for (int a = 0; a < 3; a++)
		ct_taps_free(&s->t[a]);
	free(s->tmp[0]);
	free(s->tmp[1]);
	free(s->scratch);
	*s = (struct ct_separable){0};
}

/* The operator, whose result is added to what out holds if `add`. */
static void run(
	const struct ct_separable *s, float *out, const float *in, bool add, struct ct_par *par)
{
	struct separable_job j = {.out = out, .in = in, .scratch = s->scratch};
	size_t n[3] = {s->t[0].n_in, s->t[1].n_in, s->t[2].n_in};

	for (size_t k = 0, plane = n[0] * n[1]; s->passes == 0 && k < n[2]; k++) {
		j.add = add;
		put(&j, out + k * plane, in + k * plane, plane);
	}
	for (int pass = 0; pass < s->passes; pass++) {
		int axis = s->order[pass];
		const bool last = pass + 1 == s->passes;

		j.out = last ? out : s->tmp[pass];
		j.t = &s->t[axis];
		j.add = add && last;
		apply(j, n, axis, par);
		n[axis] = j.t->n_out;
		j.in = j.out;
	}
}

void ct_separable_apply(
	const struct ct_separable *s, float *out, const float *in, struct ct_par *par)
{
	run(s, out, in, false, par);
}

void ct_separable_add(const struct ct_separable *s, float *out, const float *in, struct ct_par *par)
{
	run(s, out, in, true, par);
}
