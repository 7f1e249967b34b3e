/* difference.c: see difference.h. A task is a slice across z and goes row by row.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "quality/difference.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>

enum { LANES = 8 }; /* sums of a row, which are added up in the end: for speed */

struct difference_job {
	const size_t *n;
	const float *ref, *test, *mask; /* mask: NULL if all count */
	const struct ct_ssim_map *map;
	const struct ct_env *env;
	struct ct_sums *slab;         /* [n[2]] */
	struct ct_sums *row, *column; /* [n[2]][n[1]], [n[2]][n[0]], or NULL */
	unsigned char *above;         /* [n[2]][n[0] + n[1]], or NULL */
};

static void add(struct ct_sums *t, const struct ct_sums *s)
{
	t->count += s->count;
	t->square += s->square;
	t->abs += s->abs;
	t->diff += s->diff;
	t->mapped += s->mapped;
	t->max = s->max > t->max ? s->max : t->max;
	t->top = s->top > t->top ? s->top : t->top;
	for (int a = 0; a < 3; a++) {
		t->pairs[a] += s->pairs[a];
		t->gradient[a] += s->gradient[a];
	}
}

static double clip(double v, const struct ct_ssim_map *map)
{
	const double low = v > map->lo ? v : map->lo;

	return low < map->hi ? low : map->hi;
}

static double weight(const struct difference_job *j, size_t i)
{
	return !j->mask || j->mask[i] != 0;
}

static double difference(const struct difference_job *j, size_t i)
{
	return (double)j->test[i] - (double)j->ref[i];
}

/* Voxel i, whose next neighbours along the axes are at `next`, 0 where there is none. `mapped`
 * lacks the factor map->scale^2. */
static void add_voxel(
	struct ct_sums *t, const struct difference_job *j, size_t i, const size_t next[3])
{
	const double a = (double)j->ref[i], b = (double)j->test[i], d = b - a;
	const double w = weight(j, i), m = clip(b, j->map) - clip(a, j->map);
	const double top = fabs(a) > fabs(b) ? fabs(a) : fabs(b);

	t->count += w;
	t->square += w * d * d;
	t->abs += fabs(w * d);
	t->diff += w * d;
	t->mapped += w * m * m;
	t->max = fabs(w * d) > t->max ? fabs(w * d) : t->max;
	t->top = top > t->top ? top : t->top;
	for (int k = 0; k < 3; k++)
		if (next[k]) {
			const double pair = w * weight(j, next[k]), g = difference(j, next[k]) - d;

			t->pairs[k] += pair;
			t->gradient[k] += pair * g * g;
		}
}

/* Of row y of slice k; and to the sums of its columns, or NULL. */
static struct ct_sums sum_row(
	const struct difference_job *j, size_t y, size_t k, struct ct_sums *column)
{
	const size_t n0 = j->n[0], at = (k * j->n[1] + y) * n0, plane = n0 * j->n[1];
	struct ct_sums lane[LANES] = {{0}}, sum = {0};
	size_t next[3];

	for (size_t v = at; v < at + n0; v++) {
		next[0] = v + 1 < at + n0 ? v + 1 : 0;
		next[1] = y + 1 < j->n[1] ? v + n0 : 0;
		next[2] = k + 1 < j->n[2] ? v + plane : 0;
		add_voxel(&lane[(v - at) % LANES], j, v, next);
		if (column)
			add_voxel(&column[v - at], j, v, next);
	}
	for (int l = 0; l < LANES; l++)
		add(&sum, &lane[l]);
	sum.mapped *= j->map->scale * j->map->scale;
	return sum;
}

/* flag[i] |= v[i] > zero; is any of them? */
static unsigned char mark(
	size_t n, unsigned char *restrict flag, const float *restrict v, float zero)
{
	unsigned char any = 0;

	for (size_t i = 0; i < n; i++) {
		const unsigned char is = v[i] > zero;

		flag[i] |= is;
		any |= is;
	}
	return any;
}

static void slab(void *arg, size_t k, size_t worker)
{
	const struct difference_job *j = arg;
	const size_t n0 = j->n[0], n1 = j->n[1];
	unsigned char *above = j->above ? j->above + k * (n0 + n1) : NULL;

	(void)worker;
	if (ct_stopping(j->env))
		return;
	for (size_t y = 0; y < n1; y++) {
		const struct ct_sums s = sum_row(j, y, k, j->column ? j->column + k * n0 : NULL);

		add(&j->slab[k], &s);
		if (j->row)
			j->row[k * n1 + y] = s;
		if (above)
			above[n0 + y] =
				mark(n0, above, j->ref + (k * n1 + y) * n0, (float)j->map->zero);
	}
}

static void gather_above(struct ct_difference *d, const struct difference_job *j)
{
	for (size_t k = 0; k < j->n[2]; k++) {
		const unsigned char *flag = j->above + k * (j->n[0] + j->n[1]);

		for (size_t i = 0; i < j->n[0]; i++)
			d->above[0][i] = d->above[0][i] || flag[i];
		for (size_t i = 0; i < j->n[1]; i++) {
			d->above[1][i] = d->above[1][i] || flag[j->n[0] + i];
			d->above[2][k] = d->above[2][k] || flag[j->n[0] + i];
		}
	}
}

static void gather(struct ct_difference *d, const struct difference_job *j)
{
	const double square = j->map->scale * j->map->scale;

	for (size_t k = 0; k < j->n[2]; k++) {
		add(&d->total, &j->slab[k]);
		for (size_t y = 0; y < j->n[1] && j->row; y++)
			add(&d->slice[1][y], &j->row[k * j->n[1] + y]);
		for (size_t i = 0; i < j->n[0] && j->column; i++) {
			struct ct_sums *s = &j->column[k * j->n[0] + i];

			s->mapped *= square;
			add(&d->slice[0][i], s);
		}
	}
	if (j->above)
		gather_above(d, j);
}

static int set_up(struct difference_job *j, struct ct_difference *d, bool slices, bool above,
	struct ct_err *e)
{
	const size_t *n = j->n;
	size_t rows = n[1] * n[2];

	for (int a = 0; a < 3; a++)
		if ((above && ct_alloc0(&d->above[a], n[a], sizeof **d->above, e)) ||
			((a == 2 || slices) && ct_alloc0(&d->slice[a], n[a], sizeof **d->slice, e)))
			return -1;
	if (above && ct_alloc0(&j->above, (n[0] + n[1]) * n[2], 1, e))
		return -1;
	if (slices && (ct_alloc(&j->row, rows, sizeof *j->row, e) ||
			      ct_alloc0(&j->column, n[0] * n[2], sizeof *j->column, e)))
		return -1;
	j->slab = d->slice[2];
	return 0;
}

int ct_difference(struct ct_difference *d, const size_t n[static 3], const float *ref,
	const float *test, const float *mask, const struct ct_ssim_map *map, bool slices,
	bool above, const struct ct_env *env, struct ct_err *e)
{
	struct difference_job j = {
		.n = n, .ref = ref, .test = test, .mask = mask, .map = map, .env = env};
	int rc = -1;

	*d = (struct ct_difference){0};
	if (set_up(&j, d, slices, above, e))
		goto out;
	ct_par_for(env->par, n[2], slab, &j);
	if (ct_check_stop(env, e))
		goto out;
	gather(d, &j);
	rc = 0;
out:
	free(j.above);
	free(j.row);
	free(j.column);
	return rc;
}

void ct_difference_free(struct ct_difference *d)
{
	for (int a = 0; a < 3; a++) {
		free(d->slice[a]);
		free(d->above[a]);
	}
	*d = (struct ct_difference){0};
}
