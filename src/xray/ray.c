/* ray.c: see ray.h. Which rays there are, and which of them meet what.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "xray/ray.h"
#include "core/vec3.h"
#include "xray/geometry.h"

#include <math.h>
#include <string.h>

#define TIE 1e-6 /* voxels: a ray nearer to a face, all along, is in the face */

/* A line o + t d, t >= t0, in voxel units (voxel i is [i, i+1]), its dominant axis first; mm for a
 * unit of t. */
struct line {
	int axis[3];
	double o[3], d[3], t0, mm;
};

bool ct_ray_narrow(double x[2], double from, double slope, double lo, double hi)
{
	double p, q;

	if (slope == 0)
		return from >= lo && from <= hi && x[0] < x[1];
	p = (lo - from) / slope;
	q = (hi - from) / slope;
	x[0] = ct_most(x[0], ct_least(p, q));
	x[1] = ct_least(x[1], ct_most(p, q));
	return x[0] < x[1];
}

/* The part of the line in the box, grown by `margin` voxels across the dominant axis, as a ray;
 * false if there is none. */
static bool clip(struct ct_ray *r, const struct line *l, const struct ct_box *box, double margin)
{
	int a = l->axis[0];
	double da = l->d[a], start = l->o[a] + da * l->t0;
	bool in = true;

	memcpy(r->axis, l->axis, sizeof r->axis);
	r->scale = l->mm / fabs(da);
	r->x[0] = ct_most((double)box->lo[a], da > 0 ? start : -HUGE_VAL);
	r->x[1] = ct_least((double)box->hi[a], da > 0 ? HUGE_VAL : start);
	for (int m = 0; m < 2; m++) {
		int b = l->axis[m + 1];

		r->slope[m] = l->d[b] / da;
		r->from[m] = l->o[b] - r->slope[m] * l->o[a];
		in = in && ct_ray_narrow(r->x, r->from[m], r->slope[m], (double)box->lo[b] - margin,
				   (double)box->hi[b] + margin);
	}
	return in;
}

bool ct_ray_in_face(double slope, double at, size_t slabs)
{
	return fabs(slope) * (double)slabs <= TIE && fabs(at - nearbyint(at)) <= TIE;
}

/* Put a line that lies in a face of axis b (of voxels, not only of the grid) into the voxels
 * on both sides of it: the first n of l become 2n of half the weight. Returns their number. */
static size_t split(struct line *l, size_t n, int b, size_t slabs)
{
	int a = l->axis[0];
	double slope = l->d[b] / l->d[a], at = l->o[b] + slope * ((double)slabs / 2 - l->o[a]);
	double face = nearbyint(at);

	if (!ct_ray_in_face(slope, at, slabs))
		return n;
	for (size_t i = 0; i < n; i++) {
		l[i].d[b] = 0;
		l[i].mm /= 2;
		l[n + i] = l[i];
		l[i].o[b] = face - 0.25;
		l[n + i].o[b] = face + 0.25;
	}
	return 2 * n;
}

void ct_ray_of(const struct ct_projector *g, size_t view, size_t row, size_t col, double o[3],
	double d[3], double mm[3])
{
	double world[3];

	ct_view_ray(g->scan, view, row, col, world, mm);
	for (int i = 0; i < 3; i++) {
		o[i] = ct_vec3_dot(g->inverse[i], world) + g->inverse[i][3];
		d[i] = ct_vec3_dot(g->inverse[i], mm);
	}
}

/* The one, two or four lines that stand for the ray of a pixel. */
static size_t lines_of(
	struct line l[static 4], const struct ct_projector *g, size_t view, size_t row, size_t col)
{
	double mm[3];
	int a = 0;
	size_t n;

	ct_ray_of(g, view, row, col, l->o, l->d, mm);
	for (int i = 1; i < 3; i++)
		a = fabs(l->d[i]) > fabs(l->d[a]) ? i : a;
	l->axis[0] = a;
	l->axis[1] = a == 0;
	l->axis[2] = a == 2 ? 1 : 2;
	l->t0 = g->scan->beam == CT_PARALLEL ? -(double)INFINITY : 0;
	l->mm = ct_vec3_length(mm);
	if (g->method == CT_JOSEPH)
		return 1;
	n = split(l, 1, l->axis[1], g->n[a]);
	return split(l, n, l->axis[2], g->n[a]);
}

/* What of them is in the box, as rays; their number. */
static size_t rays_of(struct ct_ray r[static 4], const struct ct_projector *g, size_t view,
	size_t row, size_t col, const struct ct_box *box)
{
	struct line l[4];
	size_t n = lines_of(l, g, view, row, col), in = 0;

	for (size_t k = 0; k < n; k++)
		in += clip(&r[in], &l[k], box, ct_ray_margin(g));
	return in;
}

void ct_ray_shadow(const struct ct_projector *g, size_t view, const struct ct_box *box,
	size_t row[2], size_t col[2])
{
	double x[8][3], margin = ct_ray_margin(g);

	for (unsigned k = 0; k < 8; k++)
		for (int r = 0; r < 3; r++) {
			x[k][r] = g->affine[r][3];
			for (int a = 0; a < 3; a++)
				x[k][r] += g->affine[r][a] *
					   ((k >> a & 1 ? (double)box->hi[a] + margin
							: (double)box->lo[a] - margin) -
						   0.5);
		}
	ct_view_shadow(g->scan, view, 8, (const double(*)[3])x, row, col);
}

double ct_ray_sum(const struct ct_projector *g, size_t view, size_t row, size_t col,
	const float *vol, const struct ct_box *box)
{
	struct ct_ray r[4];
	double sum = 0;
	size_t n = rays_of(r, g, view, row, col, box);

	for (size_t k = 0; k < n; k++)
		sum += g->method == CT_JOSEPH ? CT_SIMD(ct_ray_joseph)(vol, box, &r[k])
					      : CT_SIMD(ct_ray_siddon)(vol, box, &r[k]);
	return sum;
}

void ct_ray_spread(const struct ct_projector *g, size_t view, size_t row, size_t col, float *vol,
	const struct ct_box *box, double value)
{
	struct ct_ray r[4];
	size_t n = rays_of(r, g, view, row, col, box);

	for (size_t k = 0; k < n; k++)
		(g->method == CT_JOSEPH ? CT_SIMD(ct_ray_joseph_spread)
					: CT_SIMD(ct_ray_siddon_spread))(vol, box, &r[k], value);
}
