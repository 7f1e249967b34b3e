/* ray.c: see ray.h. Which rays there are, and which of them meet what. */
#include "config.h"
#include "xray/ray.h"
#include "core/vec3.h"
#include "xray/geometry.h"
#include "xray/voxel-integral.h"

#include <math.h>
#include <string.h>

#define TIE 1e-6 /* voxels: a ray nearer to a face, all along, is in the face */

bool ct_ray_clip(struct ct_ray *r, const struct ct_line *l, const struct ct_box *box, double margin)
{
	int a = l->axis[0];
	double da = l->d[a], start = l->o[a] + da * l->t0;

	r->x0 = (double)box->lo[a];
	r->x1 = (double)box->hi[a];
	if (da > 0)
		r->x0 = ct_most(r->x0, start);
	else
		r->x1 = ct_least(r->x1, start);
	for (int m = 0; m < 2; m++) {
		int b = l->axis[m + 1];
		double lo = (double)box->lo[b] - margin, hi = (double)box->hi[b] + margin, p, q;

		r->slope[m] = l->d[b] / da;
		r->from[m] = l->o[b] - r->slope[m] * l->o[a];
		if (r->slope[m] == 0) {
			if (r->from[m] < lo || r->from[m] > hi)
				return false;
			continue;
		}
		p = (lo - r->from[m]) / r->slope[m];
		q = (hi - r->from[m]) / r->slope[m];
		r->x0 = ct_most(r->x0, ct_least(p, q));
		r->x1 = ct_least(r->x1, ct_most(p, q));
	}
	memcpy(r->axis, l->axis, sizeof r->axis);
	r->scale = l->mm / fabs(da);
	return r->x0 < r->x1;
}

bool ct_ray_in_face(double slope, double at, size_t slabs)
{
	return fabs(slope) * (double)slabs <= TIE && fabs(at - nearbyint(at)) <= TIE;
}

/* Put a line that lies in a face of axis b (of voxels, not only of the grid) into the voxels
 * on both sides of it: the first n of l become 2n of half the weight. Returns their number. */
static size_t split(struct ct_line *l, size_t n, int b, size_t slabs)
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

size_t ct_ray_lines(struct ct_line l[static 4], const struct ct_projector *g, size_t view,
	size_t row, size_t col)
{
	double o[3], d[3];
	int a = 0;
	size_t n;

	ct_view_ray(g->scan, view, row, col, o, d);
	for (int i = 0; i < 3; i++) {
		l->o[i] = ct_vec3_dot(g->inverse[i], o) + g->inverse[i][3];
		l->d[i] = ct_vec3_dot(g->inverse[i], d);
		if (fabs(l->d[i]) > fabs(l->d[a]))
			a = i;
	}
	l->axis[0] = a;
	l->axis[1] = a == 0;
	l->axis[2] = a == 2 ? 1 : 2;
	l->t0 = g->scan->beam == CT_PARALLEL ? -INFINITY : 0;
	l->mm = ct_vec3_length(d);
	if (g->method == CT_JOSEPH)
		return 1;
	n = split(l, 1, l->axis[1], g->n[a]);
	return split(l, n, l->axis[2], g->n[a]);
}

void ct_ray_shadow(const struct ct_projector *g, size_t view, const struct ct_box *box,
	size_t row[2], size_t col[2])
{
	double x[8][3], margin = g->method == CT_JOSEPH ? 0.5 : 0;

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
	bool joseph = g->method == CT_JOSEPH;
	struct ct_line l[4];
	struct ct_ray r;
	double sum = 0;
	size_t n = ct_ray_lines(l, g, view, row, col);

	for (size_t k = 0; k < n; k++)
		if (ct_ray_clip(&r, &l[k], box, joseph ? 0.5 : 0))
			sum += (joseph ? CT_SIMD(ct_voxel_integral_joseph)
				       : CT_SIMD(ct_voxel_integral_siddon))(vol, box, &r);
	return sum;
}

void ct_ray_spread(const struct ct_projector *g, size_t view, size_t row, size_t col, float *vol,
	const struct ct_box *box, double value)
{
	bool joseph = g->method == CT_JOSEPH;
	struct ct_line l[4];
	struct ct_ray r;
	size_t n = ct_ray_lines(l, g, view, row, col);

	for (size_t k = 0; k < n; k++)
		if (ct_ray_clip(&r, &l[k], box, joseph ? 0.5 : 0))
			(joseph ? CT_SIMD(ct_voxel_integral_joseph_spread)
				: CT_SIMD(ct_voxel_integral_siddon_spread))(vol, box, &r, value);
}
