/* padding.c: see padding.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "operator/degrade.h"
#include "operator/padding.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { LEAST = 27, VALUES = 2, KNOWN = 16, BINS = 256 };

#define LEAST_STEP 150.0 /* HU */
#define CUT 0.6
#define WINDOW (-900.0f) /* HU; a lowest value above it is the end of a window */

/* A value, and how many voxels have only its like about them. */
struct value {
	float hu;
	size_t cores;
};

struct finder {
	const float *x;
	size_t n[3], stride[3], all;
	unsigned char *is;
	unsigned char *passes; /* of a row: how many are left, one each way after each change */
	struct value value[KNOWN];
	size_t values;
};

/* Have all neighbours of the voxel its value? */
static bool is_core(const struct finder *f, const size_t at[3])
{
	const float *p = f->x + at[0] + at[1] * f->stride[1] + at[2] * f->stride[2];
	ptrdiff_t lo[3], hi[3];

	if (at[0] > 0 && p[-1] != *p)
		return false;
	for (int a = 0; a < 3; a++) {
		lo[a] = at[a] > 0 ? -1 : 0;
		hi[a] = at[a] + 1 < f->n[a] ? 1 : 0;
	}
	for (ptrdiff_t k = lo[2]; k <= hi[2]; k++)
		for (ptrdiff_t j = lo[1]; j <= hi[1]; j++)
			for (ptrdiff_t i = lo[0]; i <= hi[0]; i++)
				if (p[i + j * (ptrdiff_t)f->stride[1] +
					    k * (ptrdiff_t)f->stride[2]] != *p)
					return false;
	return true;
}

static void note(struct finder *f, float hu)
{
	size_t k = 0;

	while (k < f->values && f->value[k].hu != hu)
		k++;
	if (k == KNOWN)
		return;
	if (k == f->values)
		f->value[f->values++] = (struct value){.hu = hu};
	f->value[k].cores++;
}

static int most_first(const void *a, const void *b)
{
	const struct value *p = a, *q = b;

	return p->cores != q->cores ? (p->cores < q->cores) - (p->cores > q->cores)
				    : (p->hu > q->hu) - (p->hu < q->hu);
}

/* Marks cores. */
static void find_cores(struct finder *f)
{
	size_t at[3], i = 0;

	for (at[2] = 0; at[2] < f->n[2]; at[2]++)
		for (at[1] = 0; at[1] < f->n[1]; at[1]++)
			for (at[0] = 0; at[0] < f->n[0]; at[0]++, i++)
				if (is_core(f, at)) {
					f->is[i] = 1;
					note(f, f->x[i]);
				}
	qsort(f->value, f->values, sizeof *f->value, most_first);
}

static bool is_at_border(const struct finder *f, size_t i)
{
	for (int a = 0; a < 3; a++) {
		const size_t at = i / f->stride[a] % f->n[a];

		if (f->n[a] > 1 && (at == 0 || at + 1 == f->n[a]))
			return true;
	}
	return false;
}

/* Voxels of row j, k join the region that a neighbour along an axis is of: forwards the one before,
 * and the row from its beginning. */
static bool join_row(struct finder *f, size_t j, size_t k, float hu, bool forwards)
{
	const size_t n = f->n[0], begin = j * f->stride[1] + k * f->stride[2];
	const ptrdiff_t back = forwards ? -1 : 1;
	const bool rows = forwards ? j > 0 : j + 1 < f->n[1];
	const bool planes = forwards ? k > 0 : k + 1 < f->n[2];
	const ptrdiff_t by_row = back * (ptrdiff_t)f->stride[1];
	const ptrdiff_t by_plane = back * (ptrdiff_t)f->stride[2];
	bool joined = false;

	for (size_t m = 0; m < n; m++) {
		const size_t i = begin + (forwards ? m : n - 1 - m);
		const float *x = f->x + i;
		unsigned char *is = f->is + i;

		if (*is || *x != hu)
			continue;
		*is = (m > 0 && is[back] && x[back] == hu) ||
		      (rows && is[by_row] && x[by_row] == hu) ||
		      (planes && is[by_plane] && x[by_plane] == hu);
		joined |= *is;
	}
	return joined;
}

/* One pass over the rows that it may change; are there more? */
static bool pass(struct finder *f, float hu, bool forwards)
{
	const size_t *n = f->n, rows = n[1] * n[2];
	bool more = false;

	for (size_t m = 0; m < rows; m++) {
		const size_t r = forwards ? m : rows - 1 - m, j = r % n[1], k = r / n[1];

		if (!f->passes[r])
			continue;
		more |= --f->passes[r] > 0;
		if (!join_row(f, j, k, hu, forwards))
			continue;
		more = true;
		f->passes[r] = 2;
		f->passes[j > 0 ? r - 1 : r] = f->passes[j + 1 < n[1] ? r + 1 : r] = 2;
		f->passes[k > 0 ? r - n[1] : r] = f->passes[k + 1 < n[2] ? r + n[1] : r] = 2;
	}
	return more;
}

/* All of a value that touches its cores; false if these do not reach the border. */
static bool grow(struct finder *f, float hu)
{
	bool reaches = false, forwards = true;

	memset(f->passes, 2, f->n[1] * f->n[2]);
	while (pass(f, hu, forwards))
		forwards = !forwards;
	for (size_t i = 0; i < f->all && !reaches; i++)
		reaches = f->is[i] && f->x[i] == hu && is_at_border(f, i);
	return reaches;
}

/* The ratio of an edge that leaves the region of p for q and r; negative if it is too low. */
static double ratio_of(const struct finder *f, size_t p, size_t q, size_t r)
{
	const double hu = (double)f->x[p];
	const double step = fabs((double)f->x[r] - hu);

	if (f->x[q] == f->x[p] || f->x[r] == f->x[p] || step < LEAST_STEP)
		return -1;
	return fmin(fabs((double)f->x[q] - hu) / step, 1);
}

/* Does the region of a value cut off what it meets? */
static bool cuts(const struct finder *f, float hu)
{
	size_t bin[BINS] = {0}, all = 0, sum = 0, b = BINS;

	for (size_t i = 0; i < f->all; i++)
		for (int a = 0; a < 3 && f->is[i] && f->x[i] == hu; a++) {
			const size_t at = i / f->stride[a] % f->n[a], s = f->stride[a];
			const double up = at + 2 < f->n[a] ? ratio_of(f, i, i + s, i + 2 * s) : -1;
			const double down = at > 1 ? ratio_of(f, i, i - s, i - 2 * s) : -1;

			if (up >= 0)
				bin[(size_t)(up * (BINS - 1))]++;
			if (down >= 0)
				bin[(size_t)(down * (BINS - 1))]++;
			all += (up >= 0) + (down >= 0);
		}
	while (b > 0 && 2 * sum < all)
		sum += bin[--b];
	return all > 0 && (double)b > CUT * (BINS - 1);
}

/* What is marked and has none of the first values is not marked any more; the number of those that
 * stay. */
static size_t keep(struct finder *f, size_t values)
{
	size_t kept = 0;

	for (size_t i = 0; i < f->all; i++) {
		bool is = false;

		for (size_t k = 0; k < values; k++)
			is |= f->x[i] == f->value[k].hu;
		f->is[i] = f->is[i] && is;
		kept += f->is[i];
	}
	return kept;
}

static bool is_window(const struct finder *f, float hu)
{
	bool lowest = hu > WINDOW;

	for (size_t i = 0; i < f->all && lowest; i++)
		lowest = f->x[i] >= hu;
	return lowest;
}

/* Has a voxel the value of both its neighbours along an axis? */
static bool is_on_line(const struct finder *f, size_t i)
{
	for (int a = 0; a < 3; a++) {
		const size_t at = i / f->stride[a] % f->n[a], s = f->stride[a];

		if (at > 0 && at + 1 < f->n[a] && f->x[i - s] == f->x[i] && f->x[i + s] == f->x[i])
			return true;
	}
	return false;
}

/* Is much of what is not marked without noise? */
static bool is_synthetic(const struct finder *f)
{
	size_t rest = 0, smooth = 0;

	for (size_t i = 0; i < f->all; i++)
		if (!f->is[i]) {
			rest++;
			smooth += is_on_line(f, i);
		}
	return 5 * smooth >= rest;
}

/* Values of constant regions that reach the border become the first; their number. */
static size_t regions(struct finder *f)
{
	size_t values = 0;

	for (size_t k = 0; k < f->values && values < VALUES; k++)
		if (f->value[k].cores >= LEAST && !is_window(f, f->value[k].hu) &&
			grow(f, f->value[k].hu))
			f->value[values++] = f->value[k];
	return values;
}

/* ... and of padding. */
static size_t paddings(struct finder *f, size_t values)
{
	size_t cut = 0;

	for (size_t k = 0; k < values; k++)
		if (cuts(f, f->value[k].hu))
			f->value[cut++] = f->value[k];
	return cut;
}

int ct_padding_find(
	struct ct_padding *p, const float *x, const size_t n[static 3], struct ct_err *e)
{
	const size_t all = n[0] * n[1] * n[2];
	struct finder f = {
		.x = x, .n = {n[0], n[1], n[2]}, .stride = {1, n[0], n[0] * n[1]}, .all = all};
	size_t values;

	*p = (struct ct_padding){0};
	if (ct_alloc0(&f.is, all + n[1] * n[2], sizeof *f.is, e))
		return -1;
	f.passes = f.is + all;
	find_cores(&f);
	values = regions(&f);
	keep(&f, values);
	if (is_synthetic(&f))
		values = 0;
	*p = (struct ct_padding){.is = f.is, .count = keep(&f, paddings(&f, values))};
	p->hu = (double)f.value[0].hu;
	if (p->count == 0 || p->count == all)
		ct_padding_free(p);
	return 0;
}

void ct_padding_free(struct ct_padding *p)
{
	free(p->is);
	*p = (struct ct_padding){0};
}

/* What is marked within `by` before and behind on a line becomes so. */
static void widen_line(unsigned char *is, unsigned char *line, size_t n, size_t stride, size_t by)
{
	for (size_t i = 0; i < n; i++) {
		const size_t lo = i > by ? i - by : 0, hi = i + by < n ? i + by : n - 1;

		line[i] = 0;
		for (size_t k = lo; k <= hi; k++)
			line[i] |= is[k * stride];
	}
	for (size_t i = 0; i < n; i++)
		is[i * stride] = line[i];
}

int ct_padding_widen(struct ct_padding *p, const size_t n[static 3], size_t by, struct ct_err *e)
{
	const size_t stride[3] = {1, n[0], n[0] * n[1]}, all = n[0] * n[1] * n[2];
	size_t longest = n[0] > n[1] ? n[0] : n[1];
	unsigned char *line;

	if (!p->is)
		return 0;
	longest = longest > n[2] ? longest : n[2];
	if (ct_alloc(&line, longest, 1, e)) {
		ct_padding_free(p);
		return -1;
	}
	for (int a = 0; a < 3; a++)
		for (size_t i = 0; i < all; i++)
			if (i / stride[a] % n[a] == 0)
				widen_line(p->is + i, line, n[a], stride[a], by);
	free(line);
	p->count = 0;
	for (size_t i = 0; i < all; i++)
		p->count += p->is[i];
	return 0;
}

/* States of voxels while padding is filled. */
enum { FILLED, LEFT, QUEUED };

struct fill {
	float *x;
	unsigned char *state;
	const size_t *n;
	size_t *queue, end;
};

/* The voxel beside i, d of 27, or i itself if there is none. */
static size_t beside(const struct fill *f, size_t i, int d)
{
	const size_t *n = f->n;
	const size_t x = i % n[0] + (size_t)(d % 3) - 1,
		     y = i / n[0] % n[1] + (size_t)(d / 3 % 3) - 1,
		     z = i / n[0] / n[1] + (size_t)(d / 9) - 1;

	return x < n[0] && y < n[1] && z < n[2] ? (z * n[1] + y) * n[0] + x : i;
}

/* Voxels beside i that are left get into the queue. */
static void queue_beside(struct fill *f, size_t i)
{
	for (int d = 0; d < 27; d++) {
		const size_t j = beside(f, i, d);

		if (f->state[j] == LEFT) {
			f->state[j] = QUEUED;
			f->queue[f->end++] = j;
		}
	}
}

/* The nearer the more: weights of 1, 1/4 and 1/9 by faces, edges and corners. */
static float mean_beside(const struct fill *f, size_t i)
{
	double sum = 0, weights = 0;

	for (int d = 0; d < 27; d++) {
		const size_t j = beside(f, i, d);
		const int away = (d % 3 != 1) + (d / 3 % 3 != 1) + (d / 9 != 1);

		if (f->state[j] == FILLED) {
			const double w = 1. / (away * away);

			sum += w * (double)f->x[j];
			weights += w;
		}
	}
	return (float)(sum / weights);
}

int ct_padding_fill(
	float *x, const struct ct_padding *p, const size_t n[static 3], struct ct_err *e)
{
	const size_t all = n[0] * n[1] * n[2];
	struct fill f = {.x = x, .n = n};
	int rc = -1;

	if (!p->is)
		return 0;
	if (ct_alloc0(&f.state, all, sizeof *f.state, e) ||
		ct_alloc(&f.queue, p->count, sizeof *f.queue, e))
		goto out;
	for (size_t i = 0; i < all; i++)
		f.state[i] = p->is[i] ? LEFT : FILLED;
	for (size_t i = 0; i < all; i++)
		if (f.state[i] == FILLED)
			queue_beside(&f, i);
	for (size_t from = 0, to = f.end; from < to; from = to, to = f.end) {
		for (size_t k = from; k < to; k++)
			x[f.queue[k]] = mean_beside(&f, f.queue[k]);
		for (size_t k = from; k < to; k++)
			f.state[f.queue[k]] = FILLED;
		for (size_t k = from; k < to; k++)
			queue_beside(&f, f.queue[k]);
	}
	rc = 0;
out:
	free(f.state);
	free(f.queue);
	return rc;
}

/* The coarse voxel of an axis that holds voxel i of n. */
static size_t cell_of(size_t i, size_t n, size_t m, double factor)
{
	const double gap = (double)n - (double)m * factor;

	return (size_t)fmin(fmax((ct_cell_centre((double)i) - gap / 2) / factor, 0), (double)m - 1);
}

int ct_padding_reduce(struct ct_padding *coarse, const struct ct_padding *p,
	const size_t n[static 3], int axis, double factor, struct ct_err *e)
{
	const size_t stride[3] = {1, n[0], n[0] * n[1]};
	size_t m[3] = {n[0], n[1], n[2]};

	m[axis] = ct_degrade_size(n[axis], factor);
	if (!p->is)
		return 0;
	if (ct_alloc0(&coarse->is, m[0] * m[1] * m[2], 1, e))
		return -1;
	for (size_t i = 0; i < n[0] * n[1] * n[2]; i++) {
		size_t to[3];
		unsigned char *is;

		if (!p->is[i])
			continue;
		for (int a = 0; a < 3; a++)
			to[a] = i / stride[a] % n[a];
		to[axis] = cell_of(to[axis], n[axis], m[axis], factor);
		is = &coarse->is[(to[2] * m[1] + to[1]) * m[0] + to[0]];
		coarse->count += !*is;
		*is = 1;
	}
	return 0;
}

void ct_padding_put(float *x, const size_t m[static 3], const struct ct_padding *p,
	const size_t n[static 3], const double factor[static 3], float value)
{
	if (!p->is)
		return;
	for (size_t k = 0; k < m[2]; k++) {
		const size_t z = cell_of(k, m[2], n[2], factor[2]);

		for (size_t j = 0; j < m[1]; j++) {
			const size_t y = cell_of(j, m[1], n[1], factor[1]);
			const unsigned char *is = p->is + (z * n[1] + y) * n[0];

			for (size_t i = 0; i < m[0]; i++, x++)
				if (is[cell_of(i, m[0], n[0], factor[0])])
					*x = value;
		}
	}
}
