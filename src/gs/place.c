/* place.c: see place.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "gs/place.h"
#include "core/mem.h"
#include "core/rng.h"
#include "core/gauss.h"
#include "gs/gaussian.h"
#include "recon/fdk.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static double all_of(const struct ct_vol *field)
{
	double sum = 0;

	for (size_t i = 0, n = ct_vol_count(field); i < n; i++)
		sum += fabs((double)field->data[i]);
	return sum;
}

/* One more Gaussian, `off` voxels from voxel i, with gain times its density. */
static void put(struct ct_gauss *g, const struct ct_vol *v, size_t i, const double off[static 3],
	double gain)
{
	const double x[3] = {(double)(i % v->n[0]) + off[0],
		(double)(i / v->n[0] % v->n[1]) + off[1], (double)(i / v->n[0] / v->n[1]) + off[2]};
	double mm[3];

	ct_vol_world(v, x, mm);
	for (int a = 0; a < 3; a++)
		g->pos[a][g->n] = (float)mm[a];
	for (int a = 0; a < 4; a++)
		g->rot[a][g->n] = a == 0;
	g->raw[g->n] =
		(float)ct_activation_inverse(g->activation, g->gamma, gain * (double)v->data[i]);
	g->n++;
}

/* n of the `left` voxels that qualify, in the order of the grid, each with its chance (selection
 * sampling). */
static void choose(struct ct_gauss *g, const struct ct_vol *base, float least, size_t n,
	size_t left, double gain, double shift, uint64_t seed)
{
	size_t count = ct_vol_count(base), ordinal = 0;

	g->n = 0;
	for (size_t i = 0; i < count && g->n < n; i++) {
		double u;

		if (!(base->data[i] > least))
			continue;
		u = ct_rng_uniform(seed, CT_STREAM_PLACE, ordinal++);
		if (u * (double)left-- >= (double)(n - g->n))
			continue;
		put(g, base, i, (const double[]){shift, shift, shift}, gain);
	}
}

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

	best[0] = best[1] = best[2] = (double)INFINITY;
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

int ct_place_neighbours(
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

/* Standard deviations from the neighbours; the grid. */
static int finish(struct ct_gauss *g, const struct ct_vol *grid, const double ln_s[static 2],
	const struct ct_env *env, struct ct_err *e)
{
	double *d2 = NULL, mm[3];

	if (ct_alloc(&d2, g->n, sizeof *d2, e) ||
		ct_place_neighbours(d2, g->n, g->pos, env->par, e)) {
		free(d2);
		return -1;
	}
	ct_vol_spacing(grid, mm);
	for (size_t i = 0; i < g->n; i++) {
		double s = log(d2[i] > 0 ? sqrt(d2[i]) : mm[0]);

		for (int a = 0; a < 3; a++)
			g->scale[a][i] = (float)fmax(ln_s[0], fmin(ln_s[1], s));
	}
	memcpy(g->grid, grid->n, sizeof g->grid);
	memcpy(g->affine, grid->affine, sizeof g->affine);
	free(d2);
	return 0;
}

int ct_place_base(struct ct_gauss *g, const struct ct_vol *base, double least, size_t n,
	double gain, double shift, const double ln_s[static 2], const struct ct_env *env,
	struct ct_err *e)
{
	const size_t count = ct_vol_count(base);
	size_t found = 0;

	for (size_t i = 0; i < count; i++)
		found += base->data[i] > (float)least;
	if (found == 0)
		return ct_fail(e, CT_EINPUT,
			"no voxel has a density above %g, where Gaussians could begin", least);
	if (n > found) {
		ct_log(env, CT_INFO,
			"%zu Gaussians, not %zu: there are no more voxels of density "
			"above %g",
			found, n, least);
		n = found;
	}
	if (ct_gauss_reserve(g, n, e))
		return -1;
	choose(g, base, (float)least, n, found, gain, shift, env->seed);
	return finish(g, base, ln_s, env, e);
}

/* Equal steps along the running sum of |field|, so that their number follows it everywhere; each
 * anywhere in its voxel. */
static void follow(struct ct_gauss *g, const struct ct_vol *field, size_t n, double all,
	double gain, uint64_t seed)
{
	size_t count = ct_vol_count(field);
	double step = all / (double)n, next = step * ct_rng_uniform(seed, CT_STREAM_PLACE, 0);
	double sum = 0;

	g->n = 0;
	for (size_t i = 0; i < count; i++) {
		sum += fabs((double)field->data[i]);
		for (; g->n < n && next < sum; next += step) {
			double off[3];

			for (size_t a = 0; a < 3; a++)
				off[a] = ct_rng_uniform(seed, CT_STREAM_JITTER + a, g->n) - 0.5;
			put(g, field, i, off, gain);
		}
	}
}

double ct_place_typical(const struct ct_vol *field)
{
	double sum = all_of(field), squares = 0;

	for (size_t i = 0, n = ct_vol_count(field); i < n; i++)
		squares += (double)field->data[i] * (double)field->data[i];
	return sum > 0 ? fmin(squares / sum, 1) : 1;
}

double ct_place_cover(const struct ct_gauss *g, const struct ct_vol *field)
{
	double all = 0, mass = 0, mm[3];

	ct_vol_spacing(field, mm);
	for (size_t i = 0, n = ct_vol_count(field); i < n; i++)
		all += fabs((double)field->data[i]) * mm[0] * mm[1] * mm[2];
	for (size_t i = 0; i < g->n; i++)
		mass += pow(2 * M_PI, 1.5) * exp((double)g->scale[0][i] + (double)g->scale[1][i] +
						     (double)g->scale[2][i]);
	return all > 0 ? mass / all : 0;
}

int ct_place_residual(struct ct_gauss *g, const struct ct_vol *field, size_t n, double gain,
	const double ln_s[static 2], const struct ct_env *env, struct ct_err *e)
{
	double all = all_of(field);

	if (!(all > 0) || !isfinite(all))
		return ct_fail(e, CT_EINPUT, "there is no residual to follow");
	if (ct_gauss_reserve(g, n, e))
		return -1;
	follow(g, field, n, all, gain, env->seed);
	return finish(g, field, ln_s, env, e);
}

int ct_place_field(struct ct_vol *field, const struct ct_vol *grid, const struct ct_stack *y,
	const struct ct_stack *base, const struct ct_env *env, struct ct_err *e)
{
	struct ct_stack left = {0};
	const struct ct_env quiet = {.par = env->par, .stop = env->stop};
	struct ct_fdk f = {0};
	size_t count = ct_stack_count(y);
	int rc = -1;

	if (ct_stack_like(&left, y, 1, e) || ct_vol_like(field, grid, e))
		goto out;
	memset(field->data, 0, ct_vol_count(field) * sizeof *field->data);
	for (size_t i = 0; i < count; i++)
		left.data[i] = y->data[i] - (base ? base->data[i] : 0);
	if (ct_fdk_alloc(&f, field, &left, base ? CT_RAMP_HANN : CT_RAMP_RAM_LAK, !base, false,
		    env->par, e))
		goto out;
	rc = ct_fdk_all(&f, field->data, &quiet, e);
out:
	ct_fdk_free(&f);
	ct_stack_free(&left);
	if (rc)
		ct_vol_free(field);
	return rc;
}
