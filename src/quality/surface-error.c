/* surface-error.c: see surface-error.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "quality/surface-error.h"
#include "core/mem.h"
#include "quality/data-residual.h"
#include "quality/isosurface.h"

#include <math.h>
#include <stdlib.h>

/* The points of one slice: how many, where their distances begin, and their sums. */
struct slice_points {
	size_t count, first;
	double sum, square;
};

/* The points of `from`, measured to `to`. */
struct points_job {
	const struct ct_isosurface *from, *to;
	const struct ct_vol *mask;
	struct slice_points *slice;
	float *distance; /* NULL: count the points */
};

static bool is_in(const struct ct_vol *mask, size_t voxel)
{
	return !mask || mask->data[voxel] != 0;
}

static void add_point(struct points_job *j, struct slice_points *s, const double p[3])
{
	if (j->distance) {
		const double d = ct_isosurface_distance(j->to, p);

		j->distance[s->first + s->count] = (float)d;
		s->sum += d;
		s->square += d * d;
	}
	s->count++;
}

/* Points on the links of slice k, and of it with the next. */
static void run_slice(void *arg, size_t k, size_t worker)
{
	struct points_job *j = arg;
	struct slice_points *s = &j->slice[k];
	const struct ct_isosurface *from = j->from;
	double p[3];

	(void)worker;
	s->count = 0;
	for (size_t y = 0; y < from->n[1]; y++)
		for (size_t x = 0; x < from->n[0]; x++) {
			const size_t at[3] = {x, y, k},
				     voxel = x + from->n[0] * (y + from->n[1] * k);

			if (!is_in(j->mask, voxel))
				continue;
			for (int a = 0; a < 3; a++)
				if (ct_isosurface_crossing(p, from, at, a) &&
					is_in(j->mask, voxel + from->stride[a]))
					add_point(j, s, p);
		}
}

/* How many there are; their places follow each other from `first` on. */
static size_t count_points(struct points_job *j, size_t first, struct ct_par *par)
{
	size_t n = 0;

	ct_par_for(par, j->from->n[2], run_slice, j);
	for (size_t k = 0; k < j->from->n[2]; k++) {
		j->slice[k].first = first + n;
		n += j->slice[k].count;
	}
	return n;
}

static int measure(struct ct_surface_error *to, struct points_job j[2], const struct ct_env *env,
	struct ct_err *e)
{
	const size_t all = to->points[0] + to->points[1], slices = j->from->n[2];
	double sum = 0, square = 0;
	float *distance;
	int rc = -1;

	if (ct_alloc(&distance, all, sizeof *distance, e))
		return -1;
	for (int i = 0; i < 2; i++) {
		j[i].distance = distance;
		ct_par_for(env->par, slices, run_slice, &j[i]);
		if (ct_check_stop(env, e))
			goto out;
		for (size_t k = 0; k < slices; k++) {
			sum += j[i].slice[k].sum;
			square += j[i].slice[k].square;
		}
	}
	to->mean = sum / (double)all;
	to->rms = sqrt(square / (double)all);
	rc = ct_data_residual_quantile(&to->p95, distance, all, 0.95, e);
out:
	free(distance);
	return rc;
}

int ct_surface_error(struct ct_surface_error *to, const struct ct_vol *ref,
	const struct ct_vol *test, const struct ct_vol *mask, double level,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_isosurface of_ref = {0}, of_test = {0};
	struct points_job j[2] = {{.from = &of_ref, .to = &of_test, .mask = mask},
		{.from = &of_test, .to = &of_ref, .mask = mask}};
	struct slice_points *slice = NULL;
	int rc = -1;

	*to = (struct ct_surface_error){
		.mean = (double)NAN, .rms = (double)NAN, .p95 = (double)NAN};
	if (ct_isosurface_alloc(&of_ref, ref, level, env, e) ||
		ct_isosurface_alloc(&of_test, test, level, env, e) ||
		ct_alloc0(&slice, 2 * ref->n[2], sizeof *slice, e))
		goto out;
	j[0].slice = slice;
	j[1].slice = slice + ref->n[2];
	to->points[0] = count_points(&j[0], 0, env->par);
	to->points[1] = count_points(&j[1], to->points[0], env->par);
	if (ct_check_stop(env, e))
		goto out;
	rc = to->points[0] && to->points[1] ? measure(to, j, env, e) : 0;
out:
	free(slice);
	ct_isosurface_free(&of_ref);
	ct_isosurface_free(&of_test);
	return rc;
}
