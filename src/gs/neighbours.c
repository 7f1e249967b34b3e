/* neighbours.c: see neighbours.h. */
#include "config.h"
#include "gs/neighbours.h"
#include "core/mem.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

enum { CHUNK = 256 };

/* Points sorted by cell: those of cell c are item[start[c] .. start[c+1]). */
struct cells {
	size_t n[3];
	double low[3], size;
	size_t *start, *item;
	double *out;
	float *const *pos;
	size_t count;
};

static size_t cell_of(const struct cells *c, size_t i, size_t at[3])
{
	for (int a = 0; a < 3; a++) {
		double x = floor(((double)c->pos[a][i] - c->low[a]) / c->size);

		at[a] = x <= 0 ? 0 : x >= (double)c->n[a] ? c->n[a] - 1 : (size_t)x;
	}
	return (at[2] * c->n[1] + at[1]) * c->n[0] + at[0];
}

static void try_cell(const struct cells *c, size_t cell, size_t i, double best[3])
{
	for (size_t k = c->start[cell]; k < c->start[cell + 1]; k++) {
		size_t j = c->item[k];
		double d2 = 0;

		if (j == i)
			continue;
		for (int a = 0; a < 3; a++) {
			double d = (double)c->pos[a][i] - (double)c->pos[a][j];

			d2 += d * d;
		}
		if (d2 >= best[2])
			continue;
		best[2] = d2;
		for (int m = 2; m > 0 && best[m] < best[m - 1]; m--) {
			double t = best[m];

			best[m] = best[m - 1];
			best[m - 1] = t;
		}
	}
}

/* The nearest in the cells at most r from `at`; are these all? */
static bool try_cube(const struct cells *c, const size_t at[3], size_t r, size_t i, double best[3])
{
	size_t lo[3], hi[3];
	bool all = true;

	best[0] = best[1] = best[2] = INFINITY;
	for (int a = 0; a < 3; a++) {
		lo[a] = at[a] > r ? at[a] - r : 0;
		hi[a] = at[a] + r < c->n[a] ? at[a] + r : c->n[a] - 1;
		all &= lo[a] == 0 && hi[a] == c->n[a] - 1;
	}
	for (size_t z = lo[2]; z <= hi[2]; z++)
		for (size_t y = lo[1]; y <= hi[1]; y++)
			for (size_t x = lo[0]; x <= hi[0]; x++)
				try_cell(c, (z * c->n[1] + y) * c->n[0] + x, i, best);
	return all;
}

static void near_some(void *arg, size_t chunk, size_t worker)
{
	const struct cells *c = arg;
	size_t first = chunk * CHUNK, end = first + CHUNK < c->count ? first + CHUNK : c->count;

	(void)worker;
	for (size_t i = first; i < end; i++) {
		double best[3], sum = 0, sure = c->size; /* no cell beyond is nearer */
		size_t at[3], found = 0;

		cell_of(c, i, at);
		for (size_t r = 1; !try_cube(c, at, r, i, best) && best[2] > sure * sure; r *= 2)
			sure *= 2;
		for (; found < 3 && isfinite(best[found]); found++)
			sum += best[found];
		c->out[i] = found ? sum / (double)found : 0;
	}
}

/* Cells that hold two points on average, were the points spread evenly over their box. */
static void lay_out(struct cells *c)
{
	double high[3], most = 0, vol = 1;

	for (int a = 0; a < 3; a++) {
		c->low[a] = high[a] = (double)c->pos[a][0];
		for (size_t i = 1; i < c->count; i++) {
			c->low[a] = fmin(c->low[a], (double)c->pos[a][i]);
			high[a] = fmax(high[a], (double)c->pos[a][i]);
		}
		most = fmax(most, high[a] - c->low[a]);
	}
	most = most > 0 ? most : 1;
	for (int a = 0; a < 3; a++)
		vol *= fmax(high[a] - c->low[a], 1e-3 * most);
	c->size = cbrt(2 * vol / (double)c->count);
	for (int a = 0; a < 3; a++)
		c->n[a] = (size_t)((high[a] - c->low[a]) / c->size) + 1;
}

int ct_neighbours_three(
	double *out, size_t n, float *const pos[static 3], struct ct_par *par, struct ct_err *e)
{
	struct cells c = {.out = out, .pos = pos, .count = n};
	size_t cells, at[3];
	int rc = -1;

	if (n == 0)
		return 0;
	lay_out(&c);
	if (ct_size_mul(&cells, c.n[0], c.n[1], "cells", e) ||
		ct_size_mul(&cells, cells, c.n[2], "cells", e) ||
		ct_alloc0(&c.start, cells + 2, sizeof *c.start, e) ||
		ct_alloc(&c.item, n, sizeof *c.item, e))
		goto out;
	for (size_t i = 0; i < n; i++)
		c.start[cell_of(&c, i, at) + 2]++;
	for (size_t k = 2; k < cells + 2; k++)
		c.start[k] += c.start[k - 1];
	for (size_t i = 0; i < n; i++)
		c.item[c.start[cell_of(&c, i, at) + 1]++] = i;
	ct_par_for(par, (n + CHUNK - 1) / CHUNK, near_some, &c);
	rc = 0;
out:
	free(c.start);
	free(c.item);
	return rc;
}
