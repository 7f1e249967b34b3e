/* flat.c: see flat.h. Cell (i,j,k) lies between points i and i + 1, j and j + 1, k and k + 1.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "inverse/flat.h"
#include "core/mem.h"
#include "core/order.h"

#include <math.h>
#include <stdlib.h>

enum { MOST_CELLS = 1 << 16, LEAST_CELLS = 16, FLATTEST = 50 /* one in so many */ };

static const double air = -850; /* HU */

static void cells_of(size_t cells[3], const struct ct_vol *lo)
{
	for (int a = 0; a < 3; a++)
		cells[a] = lo->n[a] > 1 ? lo->n[a] - 1 : 1;
}

/* Of the eight points; *least: the lowest. */
static double variance(const struct ct_vol *lo, size_t i, size_t j, size_t k, double *least)
{
	const size_t *m = lo->n;
	double first = 0, sum = 0, square = 0;

	for (int c = 0; c < 8; c++) {
		const size_t p = i + (m[0] > 1 && c & 1), q = j + (m[1] > 1 && c & 2),
			     r = k + (m[2] > 1 && c & 4);
		const double y = (double)lo->data[(r * m[1] + q) * m[0] + p];

		if (c == 0)
			*least = first = y; /* keeps the squares small */
		*least = fmin(*least, y);
		sum += y - first;
		square += (y - first) * (y - first);
	}
	return fmax(square - sum * sum / 8, 0) / 7;
}

CT_ORDER(by_value, float)

static size_t steps(const size_t cells[3], size_t step)
{
	size_t n = 1;

	for (int a = 0; a < 3; a++)
		n *= (cells[a] - 1) / step + 1;
	return n;
}

int ct_flat_texture(double *texture, const struct ct_vol *lo, struct ct_err *e)
{
	size_t cells[3], step = 1, n = 0;
	double lowest = (double)INFINITY, least;
	float *all;

	*texture = 0;
	cells_of(cells, lo);
	while (steps(cells, step) > MOST_CELLS)
		step++;
	if (ct_alloc(&all, steps(cells, step), sizeof *all, e))
		return -1;
	for (size_t i = 0; i < ct_vol_count(lo); i++)
		lowest = fmin(lowest, (double)lo->data[i]);
	for (size_t k = 0; k < cells[2]; k += step) {
		for (size_t j = 0; j < cells[1]; j += step)
			for (size_t i = 0; i < cells[0]; i += step) {
				const double var = variance(lo, i, j, k, &least);

				if (least > air && least > lowest)
					all[n++] = (float)var;
			}
	}
	qsort(all, n, sizeof *all, by_value);
	if (n >= LEAST_CELLS)
		*texture = sqrt((double)all[n / FLATTEST]);
	free(all);
	return 0;
}

/* Where a voxel lies between two samples of a coarser row, those beyond the last being like it. */
struct place {
	size_t at, next;
	double part;
};

struct flat_job {
	const struct ct_vol *lo;
	struct ct_vol *x;
	float *w;           /* of the cells */
	struct place *p[3]; /* of each axis, of the voxels: among points, and then among cells */
	size_t cells[3];
	double edge; /* HU^2 */
};

static int places(struct flat_job *v, int a, double factor, struct ct_err *e)
{
	const size_t n = v->x->n[a], m[2] = {v->lo->n[a], v->cells[a]};
	const double gap = (double)n - (double)m[0] * factor;

	if (ct_alloc(&v->p[a], 2 * n, sizeof *v->p[a], e))
		return -1;
	for (size_t i = 0; i < 2 * n; i++) {
		const size_t c = i >= n, last = m[c] - 1;
		const double centre = (ct_cell_centre((double)(i % n)) - 0.5 * gap) / factor;
		const double at =
			fmin(fmax(ct_cell_index(centre) - 0.5 * (double)c, 0), (double)last);
		const size_t low = (size_t)at;

		v->p[a][i] = (struct place){low, low < last ? low + 1 : last, at - (double)low};
	}
	return 0;
}

static void weigh(void *arg, size_t k, size_t worker)
{
	const struct flat_job *v = arg;
	float *w = v->w + k * v->cells[1] * v->cells[0];
	double least;

	(void)worker;
	for (size_t j = 0; j < v->cells[1]; j++)
		for (size_t i = 0; i < v->cells[0]; i++) {
			const double part = variance(v->lo, i, j, k, &least) / v->edge;

			*w++ = (float)(1 / (1 + part * part));
		}
}

/* Along i, between the four rows about (y, z) of n samples. */
static double between(const float *g, const size_t n[3], const struct place *x,
	const struct place *y, const struct place *z)
{
	double sum = 0;

	for (int c = 0; c < 4; c++) {
		const size_t j = c & 1 ? y->next : y->at, k = c & 2 ? z->next : z->at;
		const float *row = g + (k * n[1] + j) * n[0];
		const double a = (double)row[x->at], b = (double)row[x->next];

		sum += (c & 1 ? y->part : 1 - y->part) * (c & 2 ? z->part : 1 - z->part) *
		       (a + x->part * (b - a));
	}
	return sum;
}

static void mix(void *arg, size_t k, size_t worker)
{
	const struct flat_job *v = arg;
	const size_t *n = v->x->n;
	float *x = v->x->data + k * n[0] * n[1];

	(void)worker;
	for (size_t j = 0; j < n[1]; j++)
		for (size_t i = 0; i < n[0]; i++, x++) {
			const double w = between(v->w, v->cells, &v->p[0][n[0] + i],
				&v->p[1][n[1] + j], &v->p[2][n[2] + k]);
			const double l = between(
				v->lo->data, v->lo->n, &v->p[0][i], &v->p[1][j], &v->p[2][k]);

			*x = (float)((double)*x + w * (l - (double)*x));
		}
}

int ct_flat_mix(struct ct_vol *x, const struct ct_vol *lo, const double factor[static 3],
	double texture, const struct ct_env *env, struct ct_err *e)
{
	const double level = CT_FLAT_EDGE * texture;
	struct flat_job v = {.lo = lo, .x = x, .edge = level * level};
	int rc = -1;

	if (!(v.edge > 0))
		return 0;
	cells_of(v.cells, lo);
	if (places(&v, 0, factor[0], e) || places(&v, 1, factor[1], e) ||
		places(&v, 2, factor[2], e) ||
		ct_alloc(&v.w, v.cells[0] * v.cells[1] * v.cells[2], sizeof *v.w, e))
		goto out;
	ct_par_for(env->par, v.cells[2], weigh, &v);
	ct_par_for(env->par, x->n[2], mix, &v);
	rc = 0;
out:
	free(v.w);
	for (int a = 0; a < 3; a++)
		free(v.p[a]);
	return rc;
}
