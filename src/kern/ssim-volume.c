/* ssim-volume.c: see ssim-volume.h.
 *
 * A task is a block of slices along z. It walks tiles of columns along x, and in each chunks of
 * rows along y. Of every row the products x, y, x^2 + y^2, xy of the slices of the block and
 * their neighbours are filtered along z, then along x, and put behind the 2 radius rows that the
 * chunk before has left; then the chunk of each slice is filtered along y. Axes that the
 * definition does not filter have radius 0. Outside the volume all products are zero.
 */
#include "config.h"
#include "kern/ssim-volume.h"
#include "core/mem.h"
#include "kern/lanes.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { MAPS = 4, R = CT_SSIM_TAPS / 2 };
enum { TX = 128, PX = TX + 16, TZ = 8, CY = 16 }; /* PX >= TX + 2 R, CY >= 2 R */
enum {
	PRODUCTS = MAPS * (TZ + 2 * R) * PX,
	ROWS = MAPS * TZ * PX,
	LAYER = (CY + 2 * R) * TX,
	CHUNK = TZ * MAPS * LAYER,
	TILE = CY * TX,
	SCRATCH = PRODUCTS + ROWS + CHUNK + (MAPS + 1) * TILE + TX
};

typedef ct_vd vd;

struct job {
	const struct ct_ssim_rule *rule;
	const struct ct_ssim_map *map;
	const struct ct_env *env;
	int axis;
	size_t n[3], radius[3], crop[3], block;
	const float *ref, *test, *mask;
	double *scratch;
	double *part; /* [task][2][n[axis]]; for slices across z the result itself */
};

/* The scratch of one worker. */
struct work {
	double *products; /* [MAPS][TZ + 2 R][pitch] */
	double *rows;	  /* [MAPS][TZ][pitch] */
	double *chunk;	  /* [TZ][MAPS][CY + 2 R][TX] */
	double *mean;	  /* [MAPS][CY][TX] */
	double *s;	  /* [CY][TX] */
	double *weight;	  /* [TX] */
	size_t pitch;	  /* PX, or TX if x is not filtered */
};

struct place {
	size_t x0, y0, z0, slices, rows;
};

CT_LANES_INLINE void weigh(double *restrict out, const double *restrict in, size_t step, size_t n,
	size_t radius, const double *restrict tap)
{
	const double *at[CT_SSIM_TAPS];
	double w[R + 1];

	for (size_t k = 0; k <= 2 * radius; k++)
		at[k] = in + k * step;
	for (size_t k = 0; k <= radius; k++)
		w[k] = tap[k];
	for (size_t j = 0; j < n; j += CT_LANES) {
		vd acc = w[radius] * *(const vd *)(at[radius] + j);

#pragma GCC unroll 5
		for (size_t k = 0; k < radius; k++)
			acc += w[k] *
			       (*(const vd *)(at[k] + j) + *(const vd *)(at[2 * radius - k] + j));
		*(vd *)(out + j) = acc;
	}
}

/* out[j] = sum_k tap[k] in[j + k step], j < n rounded up to CT_LANES; taps are symmetric. With the
 * length of a row as step and many rows as n it filters across rows. */
CT_LANES_CLONES static void filter(double *restrict out, const double *restrict in, size_t step,
	size_t n, size_t radius, const double *restrict tap)
{
	if (radius == 5) /* constants, so that the compiler unrolls */
		weigh(out, in, step, n, 5, tap);
	else
		weigh(out, in, step, n, 3, tap);
}

CT_LANES_INLINE void map_some(
	double *restrict out, const float *restrict v, size_t n, const struct ct_ssim_map m)
{
	for (size_t i = 0; i < n; i++) {
		double a = (double)v[i];

		a = a > m.lo ? a : m.lo;
		a = a < m.hi ? a : m.hi;
		out[i] = (a - m.zero) * m.scale;
	}
}

CT_LANES_CLONES static void map_row(
	double *restrict out, const float *restrict v, size_t n, const struct ct_ssim_map *map)
{
	size_t i = 0;

	for (; i + CT_LANES_BLOCK <= n; i += CT_LANES_BLOCK)
		map_some(out + i, v + i, CT_LANES_BLOCK, *map);
	map_some(out + i, v + i, n - i, *map);
}

void ct_ssim_map_row(double *out, const float *v, size_t n, const struct ct_ssim_map *map)
{
	map_row(out, v, n, map);
}

/* Behind the rows x and y, `apart`, put x^2 + y^2 and xy. */
CT_LANES_CLONES static void multiply(double *restrict out, size_t apart, size_t n)
{
	for (size_t j = 0; j < n; j += CT_LANES) {
		vd a = *(const vd *)(out + j), b = *(const vd *)(out + apart + j);

		*(vd *)(out + 2 * apart + j) = a * a + b * b;
		*(vd *)(out + 3 * apart + j) = a * b;
	}
}

/* S of n pixels; the maps of the means are TILE apart. */
CT_LANES_CLONES static void similarity(
	double *restrict s, const double *restrict mean, size_t n, const struct ct_ssim_rule *r)
{
	const double c1 = r->c1, c2 = r->c2, unbias = r->unbias;

	for (size_t j = 0; j < n; j += CT_LANES) {
		vd mx = *(const vd *)(mean + j), my = *(const vd *)(mean + TILE + j);
		vd e2 = *(const vd *)(mean + 2 * TILE + j);
		vd exy = *(const vd *)(mean + 3 * TILE + j);
		vd xy = mx * my, m2 = mx * mx + my * my;

		*(vd *)(s + j) = (2 * xy + c1) * (2 * unbias * (exy - xy) + c2) /
				 ((m2 + c1) * (unbias * (e2 - m2) + c2));
	}
}

/* sum of weight s and of weight, lane by lane and then across. */
CT_LANES_CLONES static void add_up(double total[2], const double *s, const double *weight)
{
	vd sum = {0}, count = {0};

	for (size_t j = 0; j < TX; j += CT_LANES) {
		sum += *(const vd *)(weight + j) * *(const vd *)(s + j);
		count += *(const vd *)(weight + j);
	}
	total[0] = ct_lanes_sum(&sum);
	total[1] = ct_lanes_sum(&count);
}

static void lay_out(struct work *w, const struct job *j, size_t worker)
{
	w->products = j->scratch + worker * SCRATCH;
	w->rows = w->products + PRODUCTS;
	w->chunk = w->rows + ROWS;
	w->mean = w->chunk + CHUNK;
	w->s = w->mean + MAPS * TILE;
	w->weight = w->s + TILE;
	w->pitch = j->radius[0] ? PX : TX;
}

/* Products of row y of slice z, columns from x0 - radius on; the maps are `apart`. */
static void load(
	const struct job *j, double *out, size_t apart, size_t pitch, size_t x0, size_t y, size_t z)
{
	size_t r = j->radius[0], from = x0 < r ? r - x0 : 0, to = j->n[0] + r - x0;
	size_t at = (z * j->n[1] + y) * j->n[0] + x0 + from - r;

	to = to < pitch ? to : pitch;
	for (size_t m = 0; m < 2; m++) {
		memset(out + m * apart, 0, from * sizeof *out);
		memset(out + m * apart + to, 0, (pitch - to) * sizeof *out);
	}
	if (y + 1 < j->n[1]) /* the row that comes next is not where the machine expects it */
		for (size_t i = 0; i < to - from; i += 16) {
			__builtin_prefetch(j->ref + at + j->n[0] + i);
			__builtin_prefetch(j->test + at + j->n[0] + i);
		}
	map_row(out + from, j->ref + at, to - from, j->map);
	map_row(out + apart + from, j->test + at, to - from, j->map);
	multiply(out, apart, pitch);
}

/* Row y of the slices of the block, filtered along z and x, as row b of their chunks. */
static void fill(const struct job *j, struct work *w, const struct place *p, size_t b, size_t y)
{
	size_t rx = j->radius[0], rz = j->radius[2], deep = p->slices + 2 * rz;
	size_t apart = deep * w->pitch, layer = w->pitch;
	const double *rows = w->products;

	for (size_t k = 0; k < deep; k++) {
		size_t z = p->z0 + k - rz;

		if (p->z0 + k >= rz && z < j->n[2])
			load(j, w->products + k * layer, apart, w->pitch, p->x0, y, z);
		else
			for (size_t m = 0; m < MAPS; m++)
				memset(w->products + m * apart + k * layer, 0,
					layer * sizeof *w->products);
	}
	for (size_t m = 0; m < MAPS && rz > 0; m++)
		filter(w->rows + m * p->slices * layer, w->products + m * apart, layer,
			p->slices * layer, rz, j->rule->tap);
	if (rz > 0) {
		rows = w->rows;
		apart = p->slices * layer;
	}
	for (size_t z = 0; z < p->slices; z++)
		for (size_t m = 0; m < MAPS; m++) {
			double *out = w->chunk + (z * MAPS + m) * LAYER + b * TX;
			const double *in = rows + m * apart + z * layer;

			if (rx > 0)
				filter(out, in, 1, TX, rx, j->rule->tap);
			else
				memcpy(out, in, TX * sizeof *out);
		}
}

/* Rows b .. end of the chunks, row b being y0 + b - radius. */
static void fill_rows(
	const struct job *j, struct work *w, const struct place *p, size_t b, size_t end)
{
	size_t ry = j->radius[1];

	for (; b < end; b++) {
		if (p->y0 + b >= ry && p->y0 + b - ry < j->n[1]) {
			fill(j, w, p, b, p->y0 + b - ry);
			continue;
		}
		for (size_t k = 0; k < p->slices * MAPS; k++)
			memset(w->chunk + k * LAYER + b * TX, 0, TX * sizeof *w->chunk);
	}
}

/* What the TX voxels from column x0 on count: 0 or 1. */
static void weights(const struct job *j, double *weight, size_t x0, const float *mask)
{
	size_t c = j->crop[0], from = x0 < c ? c - x0 : 0, to = j->n[0] - x0;

	to = to > c ? to - c : 0;
	to = to < TX ? to : TX;
	memset(weight, 0, TX * sizeof *weight);
	for (size_t i = from; i < to; i++)
		weight[i] = mask && mask[i] == 0.0f ? 0 : 1;
}

/* S of the rows of one slice, from its chunk. */
static void compare(const struct job *j, struct work *w, const struct place *p, size_t slice)
{
	size_t n = p->rows * TX, ry = j->radius[1];

	for (size_t m = 0; m < MAPS; m++) {
		const double *in = w->chunk + (slice * MAPS + m) * LAYER;

		if (ry > 0)
			filter(w->mean + m * TILE, in, TX, n, ry, j->rule->tap);
		else
			memcpy(w->mean + m * TILE, in, n * sizeof *in);
	}
	similarity(w->s, w->mean, n, j->rule);
}

/* Add the S of one row to the sums of its slice, or slices. */
static void collect(const struct job *j, struct work *w, const struct place *p, size_t row,
	size_t slice, double *part)
{
	size_t y = p->y0 + row, z = p->z0 + slice, len = j->n[j->axis];
	const double *s = w->s + row * TX;
	double total[2];

	if (y < j->crop[1] || y + j->crop[1] >= j->n[1])
		return;
	if (j->mask)
		weights(j, w->weight, p->x0, j->mask + (z * j->n[1] + y) * j->n[0] + p->x0);
	if (j->axis == 0) {
		for (size_t i = 0; i < TX && p->x0 + i < len; i++) {
			part[p->x0 + i] += w->weight[i] * s[i];
			part[len + p->x0 + i] += w->weight[i];
		}
		return;
	}
	add_up(total, s, w->weight);
	part[j->axis == 1 ? y : z] += total[0];
	part[len + (j->axis == 1 ? y : z)] += total[1];
}

static void block(void *arg, size_t task, size_t worker)
{
	const struct job *j = arg;
	size_t carry = 2 * j->radius[1];
	double *part = j->part + (j->axis == 2 ? 0 : task * 2 * j->n[j->axis]);
	struct place p = {.z0 = task * j->block};
	struct work w;

	if (ct_stopping(j->env))
		return;
	lay_out(&w, j, worker);
	p.slices = j->n[2] - p.z0 < j->block ? j->n[2] - p.z0 : j->block;
	for (p.x0 = 0; p.x0 < j->n[0]; p.x0 += TX) {
		weights(j, w.weight, p.x0, NULL);
		for (p.y0 = 0; p.y0 < j->n[1]; p.y0 += CY) {
			p.rows = j->n[1] - p.y0 < CY ? j->n[1] - p.y0 : CY;
			for (size_t k = 0; k < p.slices * MAPS && p.y0 > 0; k++)
				memcpy(w.chunk + k * LAYER, w.chunk + k * LAYER + CY * TX,
					carry * TX * sizeof *w.chunk);
			fill_rows(j, &w, &p, p.y0 > 0 ? carry : 0, p.rows + carry);
			for (size_t z = 0; z < p.slices; z++) {
				if (p.z0 + z < j->crop[2] || p.z0 + z + j->crop[2] >= j->n[2])
					continue;
				compare(j, &w, &p, z);
				for (size_t y = 0; y < p.rows; y++)
					collect(j, &w, &p, y, z, part);
			}
		}
	}
}

int ct_ssim_volume(double *sum, double *count, const struct ct_ssim_rule *rule, int axis,
	const size_t n[static 3], const float *ref, const float *test, const float *mask,
	const struct ct_ssim_map *map, const struct ct_env *env, struct ct_err *e)
{
	struct job j = {.rule = rule,
		.map = map,
		.env = env,
		.axis = axis,
		.ref = ref,
		.test = test,
		.mask = mask};
	size_t tasks, len = n[axis], parts;
	int rc = -1;

	for (int a = 0; a < 3; a++) {
		j.n[a] = n[a];
		j.radius[a] = a == axis && rule->dims == 2 ? 0 : rule->radius;
		j.crop[a] = a == axis && rule->dims == 2 ? 0 : rule->crop;
	}
	j.block = j.radius[2] ? TZ : 1;
	tasks = (n[2] + j.block - 1) / j.block;
	parts = axis == 2 ? 1 : tasks;
	if (ct_alloc0(&j.part, parts * 2 * len, sizeof *j.part, e) ||
		ct_alloc(&j.scratch, SCRATCH * ct_par_threads(env->par), sizeof *j.scratch, e))
		goto out;
	ct_par_for(env->par, tasks, block, &j);
	for (size_t k = 0; k < len; k++)
		sum[k] = count[k] = 0;
	for (size_t t = 0; t < parts; t++)
		for (size_t k = 0; k < len; k++) {
			sum[k] += j.part[t * 2 * len + k];
			count[k] += j.part[t * 2 * len + len + k];
		}
	rc = ct_check_stop(env, e);
out:
	free(j.part);
	free(j.scratch);
	return rc;
}
