/* difference.c: see difference.h. A task is a slice across z and goes row by row. */
#include "config.h"
#include "quality/difference.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>

struct difference_job {
	const size_t *n;
	const float *ref, *test, *mask; /* mask: NULL if all count */
	float *ones;                    /* [n[0]]: then that of a row */
	const struct ct_ssim_map *map;
	const struct ct_env *env;
	struct ct_sums *slab;         /* [n[2]] */
	struct ct_sums *row, *column; /* [n[2]][n[1]], [n[2]][n[0]], or NULL */
	unsigned char *above;         /* [n[2]][n[0] + n[1]], or NULL */
	double *scratch;              /* [worker][2][pitch]: differences of a row and the next */
	size_t pitch;
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

/* The sums of row y of slice k that need no neighbour, and its differences. */
static void sum_row(const struct difference_job *j, struct ct_difference_row *r, struct ct_sums *s,
	double *d, size_t y, size_t k)
{
	const size_t n0 = j->n[0], at = (k * j->n[1] + y) * n0;
	const size_t down = y + 1 < j->n[1] ? n0 : 0, next = k + 1 < j->n[2] ? n0 * j->n[1] : 0;
	const float *mask = j->mask ? j->mask + at : j->ones;

	*r = (struct ct_difference_row){.n = n0,
		.down = down,
		.next = next,
		.ref = j->ref + at,
		.test = j->test + at,
		.mask = {mask, j->mask ? mask + down : mask, j->mask ? mask + next : mask}};
	CT_SIMD(ct_difference_row_sum)(s, d, r, j->map);
	s->mapped *= j->map->scale * j->map->scale;
}

static double clip(float v, const struct ct_ssim_map *map)
{
	const double low = (double)v > map->lo ? (double)v : map->lo;

	return low < map->hi ? low : map->hi;
}

/* The row to the sums of its columns; d = test - ref. */
static void add_columns(struct ct_sums *c, const double *d, const struct ct_difference_row *r,
	const struct ct_ssim_map *map)
{
	for (size_t i = 0; i < r->n; i++) {
		const double m = clip(r->test[i], map) - clip(r->ref[i], map);

		if (r->mask[0][i] == 0)
			continue;
		c[i].count++;
		c[i].square += d[i] * d[i];
		c[i].abs += fabs(d[i]);
		c[i].diff += d[i];
		c[i].mapped += m * m;
		if (i + 1 == r->n || r->mask[0][i + 1] == 0)
			continue;
		c[i].pairs[0]++;
		c[i].gradient[0] += (d[i + 1] - d[i]) * (d[i + 1] - d[i]);
	}
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
	double *d[2] = {
		j->scratch + 2 * worker * j->pitch, j->scratch + (2 * worker + 1) * j->pitch};
	struct ct_difference_row r[2];
	struct ct_sums sums[2];

	if (ct_stopping(j->env))
		return;
	sum_row(j, &r[0], &sums[0], d[0], 0, k);
	for (size_t y = 0; y < n1; y++) {
		const size_t here = y % 2, next = !here;

		if (y + 1 < n1)
			sum_row(j, &r[next], &sums[next], d[next], y + 1, k);
		CT_SIMD(ct_difference_row_pairs)(&sums[here], d[here], d[next], &r[here]);
		add(&j->slab[k], &sums[here]);
		if (j->row)
			j->row[k * n1 + y] = sums[here];
		if (j->column)
			add_columns(j->column + k * n0, d[here], &r[here], j->map);
		if (above)
			above[n0 + y] = mark(n0, above, r[here].ref, (float)j->map->zero);
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
	j->pitch = CT_DIFFERENCE_PITCH(n[0]);
	if ((above && ct_alloc0(&j->above, (n[0] + n[1]) * n[2], 1, e)) ||
		ct_alloc(&j->ones, n[0], sizeof *j->ones, e) ||
		ct_alloc0(&j->scratch, 2 * j->pitch * ct_par_threads(j->env->par),
			sizeof *j->scratch, e))
		return -1;
	if (slices && (ct_alloc(&j->row, rows, sizeof *j->row, e) ||
			      ct_alloc0(&j->column, n[0] * n[2], sizeof *j->column, e)))
		return -1;
	for (size_t i = 0; i < n[0]; i++)
		j->ones[i] = 1;
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
	free(j.ones);
	free(j.scratch);
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
