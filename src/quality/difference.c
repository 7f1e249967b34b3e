/* difference.c: see difference.h.
 *
 * A task is a slice across z and goes row by row. A row is widened to double with a weight of 0 or
 * 1 a voxel, and zeros behind its end, so that the sums run over whole vectors.
 */
#include "config.h"
#include "quality/difference.h"
#include "core/mem.h"
#include "quality/lanes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { COLUMNS = 7, ROWS = 8 };

typedef ct_vd vd;

struct job {
	const size_t *n;
	const float *ref, *test, *mask;
	const struct ct_ssim_map *map;
	const struct ct_env *env;
	float threshold;
	size_t pitch;         /* n[0], a zero and more behind */
	double *scratch;      /* [worker][ROWS][pitch] */
	struct ct_sums *slab; /* [n[2]] */
	struct ct_sums *row;  /* [n[2]][n[1]], or NULL */
	double *column;       /* [n[2]][COLUMNS][pitch], or NULL */
	unsigned char *above; /* [n[2]][n[0] + n[1]] */
};

/* Rows in double: the differences here and of the next rows, and which count. */
struct rows {
	double *d, *down, *next, *w, *w_down, *w_next, *test, *ref; /* clipped */
};

CT_LANES_INLINE void subtract_some(
	double *restrict d, const float *restrict ref, const float *restrict test, size_t n)
{
	for (size_t i = 0; i < n; i++)
		d[i] = (double)test[i] - (double)ref[i];
}

CT_LANES_CLONES static void subtract(
	double *restrict d, const float *restrict ref, const float *restrict test, size_t n)
{
	size_t i = 0;

	for (; i + CT_LANES_BLOCK <= n; i += CT_LANES_BLOCK)
		subtract_some(d + i, ref + i, test + i, CT_LANES_BLOCK);
	subtract_some(d + i, ref + i, test + i, n - i);
}

static void choose(double *restrict w, const float *restrict mask, size_t n)
{
	for (size_t i = 0; i < n; i++)
		w[i] = mask[i] != 0.0f ? 1.0 : 0.0;
}

CT_LANES_INLINE unsigned mark_some(
	unsigned char *restrict flag, const float *restrict ref, size_t n, float threshold)
{
	unsigned char any = 0;

	for (size_t i = 0; i < n; i++)
		flag[i] |= ref[i] > threshold;
	for (size_t i = 0; i < n; i++)
		any |= ref[i] > threshold;
	return any;
}

/* flag[i] |= ref[i] > threshold; is any? */
CT_LANES_CLONES static bool mark(
	unsigned char *restrict flag, const float *restrict ref, size_t n, float threshold)
{
	unsigned any = 0;
	size_t i = 0;

	for (; i + CT_LANES_BLOCK <= n; i += CT_LANES_BLOCK)
		any |= mark_some(flag + i, ref + i, CT_LANES_BLOCK, threshold);
	any |= mark_some(flag + i, ref + i, n - i, threshold);
	return any != 0;
}

/* The largest w |d| of a row. */
CT_LANES_CLONES static double largest(const double *restrict w, const double *restrict d, size_t n)
{
	double max[CT_LANES_BLOCK] = {0};

	for (size_t i = 0; i < n; i += CT_LANES_BLOCK)
		for (size_t k = 0; k < CT_LANES_BLOCK; k++) {
			double a = fabs(w[i + k] * d[i + k]);

			max[k] = a > max[k] ? a : max[k];
		}
	for (size_t k = 1; k < CT_LANES_BLOCK; k++)
		max[0] = max[k] > max[0] ? max[k] : max[0];
	return max[0];
}

#define AT(p) (*(const vd *)((p) + i))

/* Sums of one row; the buffers end in zeros. */
CT_LANES_CLONES static void sum_row(struct ct_sums *s, const struct rows *r, size_t pitch)
{
	vd count = {0}, square = {0}, abs = {0}, diff = {0}, mapped = {0};
	vd pairs[3] = {{0}}, gradient[3] = {{0}};

	for (size_t i = 0; i + CT_LANES < pitch; i += CT_LANES) {
		vd w = AT(r->w), d = AT(r->d), m = AT(r->test) - AT(r->ref), wd = w * d;
		vd pi = w * AT(r->w + 1), pj = w * AT(r->w_down), pk = w * AT(r->w_next);
		vd gi = AT(r->d + 1) - d, gj = AT(r->down) - d, gk = AT(r->next) - d;
		vd a = ct_lanes_abs(wd);

		count += w;
		square += wd * d;
		abs += a;
		diff += wd;
		mapped += w * m * m;
		pairs[0] += pi;
		pairs[1] += pj;
		pairs[2] += pk;
		gradient[0] += pi * gi * gi;
		gradient[1] += pj * gj * gj;
		gradient[2] += pk * gk * gk;
	}
	s->count = ct_lanes_sum(&count);
	s->square = ct_lanes_sum(&square);
	s->abs = ct_lanes_sum(&abs);
	s->diff = ct_lanes_sum(&diff);
	s->mapped = ct_lanes_sum(&mapped);
	s->max = largest(r->w, r->d, pitch);
	for (int a = 0; a < 3; a++) {
		s->pairs[a] = ct_lanes_sum(&pairs[a]);
		s->gradient[a] = ct_lanes_sum(&gradient[a]);
	}
}

/* Add a row to the sums of its columns: count, square, abs, diff, mapped, pairs, gradient along x,
 * each `pitch` long. The largest |d| of a slice across x is not kept. */
CT_LANES_CLONES static void sum_columns(double *restrict c, const struct rows *r, size_t pitch)
{
	const double *restrict w = r->w, *restrict d = r->d, *restrict t = r->test;
	const double *restrict f = r->ref;

	for (size_t i = 0; i + CT_LANES < pitch; i++) {
		double wd = w[i] * d[i], p = w[i] * w[i + 1], g = d[i + 1] - d[i];

		c[i] += w[i];
		c[pitch + i] += wd * d[i];
		c[2 * pitch + i] += fabs(wd);
		c[3 * pitch + i] += wd;
		c[4 * pitch + i] += w[i] * (t[i] - f[i]) * (t[i] - f[i]);
		c[5 * pitch + i] += p;
		c[6 * pitch + i] += p * g * g;
	}
}

static void add(struct ct_sums *t, const struct ct_sums *s)
{
	t->count += s->count;
	t->square += s->square;
	t->abs += s->abs;
	t->diff += s->diff;
	t->mapped += s->mapped;
	t->max = s->max > t->max ? s->max : t->max;
	for (int a = 0; a < 3; a++) {
		t->pairs[a] += s->pairs[a];
		t->gradient[a] += s->gradient[a];
	}
}

/* Row `at` of the volume into d and w; outside, when `there` is not, nothing counts. */
static void widen(const struct job *j, double *d, double *w, size_t at, bool there)
{
	size_t n = j->n[0];

	if (!there) {
		memset(d, 0, n * sizeof *d);
		memset(w, 0, n * sizeof *w);
		return;
	}
	subtract(d, j->ref + at * n, j->test + at * n, n);
	if (j->mask)
		choose(w, j->mask + at * n, n);
	else
		for (size_t i = 0; i < n; i++)
			w[i] = 1;
}

static void slab(void *arg, size_t k, size_t worker)
{
	const struct job *j = arg;
	size_t n0 = j->n[0], n1 = j->n[1];
	double *s = j->scratch + worker * ROWS * j->pitch, *swap;
	unsigned char *above = j->above + k * (n0 + n1);
	struct rows r = {s, s + j->pitch, s + 2 * j->pitch, s + 3 * j->pitch, s + 4 * j->pitch,
		s + 5 * j->pitch, s + 6 * j->pitch, s + 7 * j->pitch};
	struct ct_sums row;

	if (ct_stopping(j->env))
		return;
	widen(j, r.d, r.w, k * n1, true);
	for (size_t y = 0; y < n1; y++) {
		size_t at = k * n1 + y;

		widen(j, r.down, r.w_down, at + 1, y + 1 < n1);
		widen(j, r.next, r.w_next, at + n1, k + 1 < j->n[2]);
		ct_ssim_clip_row(r.test, j->test + at * n0, n0, j->map);
		ct_ssim_clip_row(r.ref, j->ref + at * n0, n0, j->map);
		sum_row(&row, &r, j->pitch);
		row.mapped *= j->map->scale * j->map->scale;
		add(&j->slab[k], &row);
		if (j->row)
			j->row[at] = row;
		if (j->column)
			sum_columns(j->column + k * COLUMNS * j->pitch, &r, j->pitch);
		above[n0 + y] = mark(above, j->ref + at * n0, n0, j->threshold);
		swap = r.d, r.d = r.down, r.down = swap;
		swap = r.w, r.w = r.w_down, r.w_down = swap;
	}
}

static void gather_above(struct ct_difference *d, const struct job *j)
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

static void gather(struct ct_difference *d, const struct job *j)
{
	const double square = j->map->scale * j->map->scale;

	for (size_t k = 0; k < j->n[2]; k++) {
		const double *c = j->column ? j->column + k * COLUMNS * j->pitch : NULL;

		add(&d->total, &j->slab[k]);
		for (size_t y = 0; y < j->n[1] && j->row; y++)
			add(&d->slice[1][y], &j->row[k * j->n[1] + y]);
		for (size_t i = 0; i < j->n[0] && c; i++) {
			const struct ct_sums s = {c[i], c[j->pitch + i], c[2 * j->pitch + i],
				c[3 * j->pitch + i], 0, c[4 * j->pitch + i] * square,
				{c[5 * j->pitch + i]}, {c[6 * j->pitch + i]}};

			add(&d->slice[0][i], &s);
		}
	}
	gather_above(d, j);
}

static int set_up(struct job *j, struct ct_difference *d, bool slices, struct ct_err *e)
{
	const size_t *n = j->n;
	size_t rows = n[1] * n[2], threads = ct_par_threads(j->env->par);

	j->pitch = (n[0] / CT_LANES_BLOCK + 2) * CT_LANES_BLOCK; /* a zero behind the last vector */
	for (int a = 0; a < 3; a++)
		if (ct_alloc0(&d->above[a], n[a], sizeof **d->above, e) ||
			((a == 2 || slices) && ct_alloc0(&d->slice[a], n[a], sizeof **d->slice, e)))
			return -1;
	if (ct_alloc0(&j->scratch, ROWS * j->pitch * threads, sizeof *j->scratch, e) ||
		ct_alloc0(&j->above, (n[0] + n[1]) * n[2], 1, e))
		return -1;
	if (slices &&
		(ct_alloc(&j->row, rows, sizeof *j->row, e) ||
			ct_alloc0(&j->column, COLUMNS * j->pitch * n[2], sizeof *j->column, e)))
		return -1;
	j->slab = d->slice[2];
	return 0;
}

int ct_difference(struct ct_difference *d, const size_t n[static 3], const float *ref,
	const float *test, const float *mask, const struct ct_ssim_map *map, double threshold,
	bool slices, const struct ct_env *env, struct ct_err *e)
{
	struct job j = {.n = n,
		.ref = ref,
		.test = test,
		.mask = mask,
		.map = map,
		.env = env,
		.threshold = (float)threshold};
	int rc = -1;

	*d = (struct ct_difference){0};
	if (set_up(&j, d, slices, e))
		goto out;
	ct_par_for(env->par, n[2], slab, &j);
	if (ct_check_stop(env, e))
		goto out;
	gather(d, &j);
	rc = 0;
out:
	free(j.scratch);
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
