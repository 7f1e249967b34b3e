/* tissue.c: see tissue.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "quality/tissue.h"
#include "core/mem.h"
#include "operator/degrade.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { N = CT_TISSUE_COUNT };
static const double sigma[3] = {CT_TISSUE_SIGMA, CT_TISSUE_SIGMA, CT_TISSUE_SIGMA};

struct range {
	double from, to; /* HU, from included */
};
static const struct range ranges[] = {
	[CT_TISSUE_AIR] = {-(double)INFINITY, -950},
	[CT_TISSUE_LUNG] = {-950, -500},
	[CT_TISSUE_FAT] = {-190, -30},
	[CT_TISSUE_SOFT] = {-30, 150},
	[CT_TISSUE_BRAIN] = {15, 60},
	[CT_TISSUE_BONE] = {300, (double)INFINITY},
};

enum { SHALLOW = 7 }; /* the bit of a voxel that is to be no longer deep */

static bool is(unsigned char bits, unsigned t)
{
	return bits >> t & 1;
}

static void put(unsigned char *bits, unsigned t)
{
	*bits = (unsigned char)(*bits | 1u << t);
}

static void drop(unsigned char *bits, unsigned t)
{
	*bits = (unsigned char)(*bits & ~(1u << t));
}

struct tissue_job {
	const struct ct_vol *x, *mask;
	const size_t *n;
	unsigned char *map; /* of ct_tissue_map: written */
	const unsigned char *in;
	float *hu;
	const float *error;
	size_t reach;
	size_t *since; /* [worker][longer of n[0] and n[1]] */
	int axis;
	double *sum; /* of each plane, N rows of 3; or 2 */
	double step;
};

static void sort_plane(void *arg, size_t k, size_t worker)
{
	const struct tissue_job *j = arg;
	const size_t plane = j->n[0] * j->n[1];

	(void)worker;
	for (size_t i = k * plane; i < (k + 1) * plane; i++) {
		const double v = (double)j->hu[i];

		j->map[i] = 0;
		for (unsigned t = 0; t < sizeof ranges / sizeof *ranges; t++)
			if (v >= ranges[t].from && v < ranges[t].to)
				put(&j->map[i], t);
		if (is(j->map[i], CT_TISSUE_SOFT))
			put(&j->map[i], CT_TISSUE_DEEP);
	}
}

/* Along an axis, what has a voxel that is not deep within reach, before or behind it, is deep no
 * longer: w lines, `apart` apart, of n samples, `stride` apart.
 */
static void erode_lines(unsigned char *map, size_t w, size_t apart, size_t n, size_t stride,
	size_t reach, size_t *since)
{
	for (int back = 0; back < 2; back++) {
		for (size_t l = 0; l < w; l++)
			since[l] = reach + 1;
		for (size_t i = 0; i < n; i++)
			for (size_t l = 0; l < w; l++) {
				const size_t t = back ? n - 1 - i : i;
				unsigned char *v = &map[t * stride + l * apart];

				since[l] = is(*v, CT_TISSUE_DEEP) ? since[l] + 1 : 0;
				if (since[l] <= reach)
					put(v, SHALLOW);
				if (back && is(*v, SHALLOW))
					drop(v, CT_TISSUE_DEEP);
				if (back)
					drop(v, SHALLOW);
			}
	}
}

/* A plane across z, or for that axis across y. */
static void erode(void *arg, size_t k, size_t worker)
{
	const struct tissue_job *j = arg;
	const size_t *n = j->n, stride[3] = {1, n[0], n[0] * n[1]};
	const int a = j->axis, b = a == 0 ? 1 : 0, c = a == 2 ? 1 : 2;

	erode_lines(j->map + k * stride[c], n[b], stride[b], n[a], stride[a], j->reach,
		j->since + worker * (n[0] > n[1] ? n[0] : n[1]));
}

int ct_tissue_map(unsigned char **map, const struct ct_vol *ref, size_t deep,
	const struct ct_env *env, struct ct_err *e)
{
	const size_t *n = ref->n, voxels = ct_vol_count(ref), wide = n[0] > n[1] ? n[0] : n[1];
	struct tissue_job j = {.n = n, .reach = deep};
	int rc = -1;

	if (ct_alloc(&j.hu, voxels, sizeof *j.hu, e) ||
		ct_degrade_smooth(j.hu, ref->data, n, sigma, env->par, e) ||
		ct_alloc(&j.map, voxels, 1, e) ||
		ct_alloc(&j.since, wide * ct_par_threads(env->par), sizeof *j.since, e))
		goto out;
	ct_par_for(env->par, n[2], sort_plane, &j);
	for (j.axis = 0; j.axis < 3; j.axis++)
		ct_par_for(env->par, n[j.axis == 2 ? 1 : 2], erode, &j);
	rc = 0;
out:
	free(j.hu);
	free(j.since);
	if (rc)
		free(j.map);
	*map = rc ? NULL : j.map;
	return rc;
}

/* Voxels, sum of squares and sum of the error of each tissue. */
static void add_plane(void *arg, size_t k, size_t worker)
{
	const struct tissue_job *j = arg;
	const size_t plane = j->n[0] * j->n[1];
	double(*sum)[3] = (double(*)[3])(j->sum + 3 * N * k);

	(void)worker;
	memset(sum, 0, N * sizeof *sum);
	for (size_t i = k * plane; i < (k + 1) * plane; i++) {
		const double d = (double)j->error[i];

		if (j->in[i] == 0 || (j->mask && j->mask->data[i] == 0))
			continue;
		for (unsigned t = 0; t < N; t++)
			if (is(j->in[i], t)) {
				sum[t][0] += 1;
				sum[t][1] += d * d;
				sum[t][2] += d;
			}
	}
}

static void gather(struct ct_tissue_row row[N], const struct tissue_job *j)
{
	for (size_t t = 0; t < N; t++) {
		double sum[3] = {0};

		for (size_t k = 0; k < j->n[2]; k++)
			for (size_t q = 0; q < 3; q++)
				sum[q] += j->sum[3 * (N * k + t) + q];
		row[t].voxels = (size_t)sum[0];
		row[t].rmse = sqrt(sum[1] / sum[0]);
		row[t].bias = sum[2] / sum[0];
	}
}

int ct_tissue_errors(struct ct_tissue_errors *o, const unsigned char *map, const struct ct_vol *ref,
	const struct ct_vol *test, const struct ct_vol *mask, const struct ct_env *env,
	struct ct_err *e)
{
	const size_t n = ct_vol_count(ref);
	struct tissue_job j = {.mask = mask, .n = ref->n, .in = map};
	struct ct_tissue_row smooth[N];
	float *error = NULL;
	int rc = -1;

	*o = (struct ct_tissue_errors){0};
	if (ct_alloc(&j.sum, 3 * N * ref->n[2], sizeof *j.sum, e) ||
		ct_alloc(&error, 2 * n, sizeof *error, e))
		goto out;
	for (size_t i = 0; i < n; i++)
		error[i] = test->data[i] - ref->data[i];
	j.error = error;
	ct_par_for(env->par, ref->n[2], add_plane, &j);
	gather(o->row, &j);
	if (ct_check_stop(env, e) ||
		ct_degrade_smooth(error + n, error, ref->n, sigma, env->par, e))
		goto out;
	j.error = error + n;
	ct_par_for(env->par, ref->n[2], add_plane, &j);
	gather(smooth, &j);
	o->smooth = smooth[CT_TISSUE_DEEP].rmse;
	rc = ct_check_stop(env, e);
out:
	free(error);
	free(j.sum);
	return rc;
}

static void flat_plane(void *arg, size_t k, size_t worker)
{
	const struct tissue_job *j = arg;
	const size_t *n = j->n;
	double *sum = j->sum + 2 * k;
	ptrdiff_t next[3];
	const ptrdiff_t first = (ptrdiff_t)ct_vol_steps(j->x, next) + (ptrdiff_t)k * next[2];

	(void)worker;
	sum[0] = sum[1] = 0;
	if (k + 1 == n[2] && n[2] > 1)
		return;
	for (size_t y = 0; y < n[1] - (n[1] > 1); y++)
		for (size_t x = 0; x < n[0] - (n[0] > 1); x++) {
			const ptrdiff_t i = first + (ptrdiff_t)y * next[1] + (ptrdiff_t)x * next[0];
			const float *v = j->x->data;
			bool flat = true;

			if (!is(j->in[i], CT_TISSUE_SOFT) || (j->mask && j->mask->data[i] == 0))
				continue;
			for (int a = 0; a < 3; a++)
				if (n[a] > 1)
					flat = flat && fabs((double)v[i + next[a]] - (double)v[i]) <
							       j->step;
			sum[0] += 1;
			sum[1] += flat;
		}
}

int ct_tissue_flat(double *share, size_t *voxels, const unsigned char *map, const struct ct_vol *x,
	const struct ct_vol *mask, double step, const struct ct_env *env, struct ct_err *e)
{
	struct tissue_job j = {.x = x, .mask = mask, .n = x->n, .in = map, .step = step};
	double sum[2] = {0};

	if (ct_alloc(&j.sum, 2 * x->n[2], sizeof *j.sum, e))
		return -1;
	ct_par_for(env->par, x->n[2], flat_plane, &j);
	for (size_t k = 0; k < x->n[2]; k++)
		for (size_t q = 0; q < 2; q++)
			sum[q] += j.sum[2 * k + q];
	free(j.sum);
	*voxels = (size_t)sum[0];
	*share = sum[1] / sum[0];
	return ct_check_stop(env, e);
}
