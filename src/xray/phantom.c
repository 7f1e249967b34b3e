/* phantom.c: see phantom.h. Every shape is a unit ball, cube or cylinder in coordinates of its own.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "xray/phantom.h"
#include "core/vec3.h"
#include "xray/geometry.h"

#include <math.h>

/* A vector, or with at = NULL a direction, in the shape's own units. */
static void own(const struct ct_shape *s, const double *at, const double x[3], double y[3])
{
	for (int a = 0; a < 3; a++) {
		y[a] = 0;
		for (int r = 0; r < 3; r++)
			y[a] += s->axis[a][r] * (at ? x[r] - at[r] : x[r]);
		y[a] /= s->half[a];
	}
}

/* 1 on the surface, less inside; moves no faster than y. */
static double level(enum ct_shape_kind kind, const double y[3])
{
	if (kind == CT_BOX)
		return fmax(fmax(fabs(y[0]), fabs(y[1])), fabs(y[2]));
	if (kind == CT_CYLINDER)
		return fmax(sqrt(y[0] * y[0] + y[1] * y[1]), fabs(y[2]));
	return ct_vec3_length(y);
}

/* Narrow t[0..1] to where o + t d is in the unit ball of the first n axes. From the point nearest
 * to the centre, so nothing large cancels. */
static void clip_round(int n, const double o[3], const double d[3], double t[2])
{
	double dd = 0, od = 0, mm = 0, mid, half;

	for (int a = 0; a < n; a++) {
		dd += d[a] * d[a];
		od += o[a] * d[a];
	}
	mid = dd > 0 ? -od / dd : 0;
	for (int a = 0; a < n; a++)
		mm += (o[a] + mid * d[a]) * (o[a] + mid * d[a]);
	if (mm >= 1) {
		t[1] = t[0];
		return;
	}
	half = dd > 0 ? sqrt((1 - mm) / dd) : HUGE_VAL;
	t[0] = fmax(t[0], mid - half);
	t[1] = fmin(t[1], mid + half);
}

static void clip_flat(double o, double d, double t[2])
{
	if (d == 0) {
		if (fabs(o) >= 1)
			t[1] = t[0];
		return;
	}
	t[0] = fmax(t[0], fmin((-1 - o) / d, (1 - o) / d));
	t[1] = fmin(t[1], fmax((-1 - o) / d, (1 - o) / d));
}

double ct_shape_chord(const struct ct_shape *s, const double origin[static 3],
	const double dir[static 3], double t0)
{
	double o[3], d[3], t[2] = {t0, (double)INFINITY};

	own(s, s->centre, origin, o);
	own(s, NULL, dir, d);
	if (s->kind == CT_BOX)
		for (int a = 0; a < 3 && t[1] > t[0]; a++)
			clip_flat(o[a], d[a], t);
	else
		clip_round(s->kind == CT_CYLINDER ? 2 : 3, o, d, t);
	if (s->kind == CT_CYLINDER && t[1] > t[0])
		clip_flat(o[2], d[2], t);
	if (!(t[1] > t[0]))
		return 0;
	return (t[1] - t[0]) * ct_vec3_length(dir);
}

struct rows {
	const struct ct_stack *scan;
	size_t first, n;
	const struct ct_shape *shape;
	float *p;
};

static void project_row(void *arg, size_t i, size_t worker)
{
	const struct rows *f = arg;
	const struct ct_stack *s = f->scan;

	(void)worker;
	for (size_t c = 0; c < s->w; c++) {
		double o[3], d[3], sum = 0;

		ct_view_ray(s, f->first + i / s->h, i % s->h, c, o, d);
		for (size_t k = 0; k < f->n; k++)
			sum += f->shape[k].density *
			       ct_shape_chord(
				       &f->shape[k], o, d, s->beam == CT_PARALLEL ? -HUGE_VAL : 0);
		f->p[i * s->w + c] = (float)sum;
	}
}

void ct_phantom_project(const struct ct_stack *scan, size_t first, size_t count, float *p, size_t n,
	const struct ct_shape *shape, struct ct_par *par)
{
	struct rows f = {.scan = scan, .first = first, .n = n, .shape = shape, .p = p};

	ct_par_for(par, count * scan->h, project_row, &f);
}

struct slices {
	struct ct_vol *v;
	size_t n, over;
	const struct ct_shape *shape;
};

/* Share of the sample points of the voxel at index (i,j,k) that lie in the shape. */
static double share(const struct slices *f, const struct ct_shape *s, const double ijk[3])
{
	size_t m = f->over, in = 0;

	for (size_t q = 0; q < m * m * m; q++) {
		const size_t sub[3] = {q % m, q / m % m, q / m / m};
		double at[3], x[3], y[3];

		for (int a = 0; a < 3; a++)
			at[a] = ijk[a] + ((double)sub[a] + 0.5) / (double)m - 0.5;
		ct_vol_world(f->v, at, x);
		own(s, s->centre, x, y);
		in += level(s->kind, y) < 1;
	}
	return (double)in / (double)(m * m * m);
}

/* Radius of a voxel about its centre, in the shape's units. */
static double reach(const struct ct_vol *v, const struct ct_shape *s)
{
	double mm[3];

	ct_vol_spacing(v, mm);
	return 0.5 * ct_vec3_length(mm) * 1.001 / fmin(fmin(s->half[0], s->half[1]), s->half[2]);
}

/* A shape that a row of voxels may touch, from index `from` to `to`. */
struct touch {
	const struct ct_shape *shape;
	double from, to, near;
};

/* Shapes near the row from world point x in steps of `step` mm; their number. */
static size_t touched(const struct slices *f, const double x[3], const double step[3],
	struct touch t[static CT_PH_MAX_SHAPES])
{
	static const double radius[] = {1, 1.7320508075688774, 1.4142135623730951};
	size_t n = 0;

	for (size_t k = 0; k < f->n; k++) {
		const struct ct_shape *s = &f->shape[k];
		double near = reach(f->v, s), r = radius[s->kind] + near, o[3], d[3], at[2];

		own(s, s->centre, x, o);
		own(s, NULL, step, d);
		for (int a = 0; a < 3; a++) { /* the ball of radius r to the unit ball */
			o[a] /= r;
			d[a] /= r;
		}
		at[0] = -HUGE_VAL;
		at[1] = HUGE_VAL;
		clip_round(3, o, d, at);
		if (at[1] > at[0])
			t[n++] = (struct touch){s, at[0], at[1], near};
	}
	return n;
}

static double voxel(const struct slices *f, size_t n, const struct touch *t, const double ijk[3])
{
	double x[3], y[3], sum = 0;

	ct_vol_world(f->v, ijk, x);
	for (size_t k = 0; k < n; k++) {
		const struct ct_shape *s = t[k].shape;
		double l;

		if (ijk[0] < t[k].from || ijk[0] > t[k].to)
			continue;
		own(s, s->centre, x, y);
		l = level(s->kind, y);
		if (fabs(l - 1) > t[k].near) /* no surface in this voxel */
			sum += l < 1 ? s->density : 0;
		else
			sum += s->density * share(f, s, ijk);
	}
	return sum;
}

static void fill_slice(void *arg, size_t k, size_t worker)
{
	const struct slices *f = arg;
	const size_t *n = f->v->n;
	const double(*m)[4] = (const double(*)[4])f->v->affine;
	const double step[3] = {m[0][0], m[1][0], m[2][0]};

	(void)worker;
	for (size_t j = 0; j < n[1]; j++) {
		float *row = f->v->data + (k * n[1] + j) * n[0];
		double ijk[3] = {0, (double)j, (double)k}, x[3];
		struct touch t[CT_PH_MAX_SHAPES];
		size_t touches;

		ct_vol_world(f->v, ijk, x);
		touches = touched(f, x, step, t);
		for (size_t i = 0; i < n[0]; i++) {
			ijk[0] = (double)i;
			row[i] = (float)voxel(f, touches, t, ijk);
		}
	}
}

void ct_phantom_voxels(struct ct_vol *v, size_t n, const struct ct_shape *shape, size_t oversample,
	struct ct_par *par)
{
	struct slices f = {.v = v, .n = n, .over = oversample, .shape = shape};

	ct_par_for(par, v->n[2], fill_slice, &f);
}
