/* scan-grid.c: see scan-grid.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "recon/scan-grid.h"
#include "core/vec3.h"

#include <math.h>
#include <string.h>

enum { FEW = 4 }; /* rows, times which there are columns */

/* The point nearest to all central rays: sum (1 - d d') (x - source) = 0. */
static int meeting_point(double x[3], const struct ct_stack *s, struct ct_err *e)
{
	double m[3][3] = {{0}}, y[3] = {0}, c[3], det;

	for (size_t k = 0; k < s->views; k++) {
		const struct ct_view *v = &s->view[k];
		double d[3];

		ct_vec3_minus(d, v->centre, v->source);
		ct_vec3_unit(d, d);
		for (int a = 0; a < 3; a++)
			for (int b = 0; b < 3; b++) {
				double p = (a == b ? 1 : 0) - d[a] * d[b];

				m[a][b] += p;
				y[a] += p * v->source[b];
			}
	}
	ct_vec3_cross(c, m[1], m[2]);
	det = ct_vec3_dot(m[0], c);
	if (!(det > 1e-9 * pow((double)s->views, 3)))
		return ct_fail(e, CT_EGEOM,
			"the views all have one direction, which does not show where the object "
			"is: name a volume with --grid");
	for (int a = 0; a < 3; a++) { /* m is symmetric: Cramer's rule by rows */
		double r[3][3];

		memcpy(r, m, sizeof r);
		memcpy(r[a], y, sizeof y);
		ct_vec3_cross(c, r[1], r[2]);
		x[a] = ct_vec3_dot(r[0], c) / det;
	}
	return 0;
}

/* Distance of x from the plane through the rays of the detector's edge at `edge` pixels along a
 * from the middle; `along` is the other side of the detector. */
static double to_edge(const struct ct_stack *s, const struct ct_view *v, const double x[3],
	const double a[3], const double along[3], double edge)
{
	double p[3], ray[3], n[3], d[3];

	for (int i = 0; i < 3; i++) {
		p[i] = v->centre[i] + edge * a[i];
		ray[i] = s->beam == CT_PARALLEL ? v->centre[i] - v->source[i] : p[i] - v->source[i];
		d[i] = x[i] - p[i];
	}
	ct_vec3_cross(n, ray, along);
	return fabs(ct_vec3_dot(n, d)) / ct_vec3_length(n);
}

/* The axis of the world that the rows of all views follow each other along, or -1. */
static int across_rows(const struct ct_stack *s)
{
	int axis = 0;

	for (int a = 1; a < 3; a++)
		axis = fabs(s->view[0].v[a]) > fabs(s->view[0].v[axis]) ? a : axis;
	for (size_t k = 0; k < s->views; k++)
		if (!(fabs(s->view[k].v[axis]) > 0.99 * ct_vec3_length(s->view[k].v)))
			return -1;
	return axis;
}

/* Radius of the sphere about x that every view sees, from the middle to the farther edge: an offset
 * detector sees one side now and the other half a turn later. *high: of its rows alone, if they are
 * few: the region is then as flat as they are. Size of a pixel at x: *mm. */
static double seen_radius(const struct ct_stack *s, const double x[3], double *high, double *mm)
{
	const bool flat = s->h * FEW < s->w && across_rows(s) >= 0;
	double least = HUGE_VAL;

	*mm = *high = HUGE_VAL;
	for (size_t k = 0; k < s->views; k++) {
		const struct ct_view *v = &s->view[k];
		double side = 0, top = 0, near[3], far[3], scale = 1;

		for (int sign = -1; sign <= 1; sign += 2) {
			side = fmax(side, to_edge(s, v, x, v->u, v->v, sign * (double)s->w / 2));
			top = fmax(top, to_edge(s, v, x, v->v, v->u, sign * (double)s->h / 2));
		}
		least = fmin(least, s->beam == CT_FAN || flat ? side : fmin(side, top));
		*high = flat && s->beam != CT_FAN ? fmin(*high, top) : *high;
		ct_vec3_minus(near, x, v->source);
		ct_vec3_minus(far, v->centre, v->source);
		if (s->beam != CT_PARALLEL)
			scale = sqrt(ct_vec3_dot(near, near) / ct_vec3_dot(far, far));
		*mm = fmin(
			*mm, scale * sqrt(fmin(ct_vec3_dot(v->u, v->u), ct_vec3_dot(v->v, v->v))));
	}
	return least;
}

static int seen_cube(struct ct_vol *grid, const struct ct_stack *scan, struct ct_err *e)
{
	double x[3], mm, r, high, n, size[3];

	if (meeting_point(x, scan, e))
		return -1;
	r = seen_radius(scan, x, &high, &mm);
	n = ceil(2 * r / mm);
	if (!(n >= 1 && n <= 1 << 20))
		return ct_fail(e, CT_EGEOM,
			"the views do not show how large the object is: name a volume with --grid");
	for (int a = 0; a < 3; a++) {
		const double half = high < r && a == across_rows(scan) ? high : r;

		size[a] = half == r ? n : fmax(1, nearbyint(n * half / r));
		grid->n[a] = (size_t)size[a];
		grid->affine[a][a] = 2 * half / size[a];
		grid->affine[a][3] = x[a] - half + half / size[a];
	}
	return 0;
}

/* The grid of the volume that was projected, if the metadata tell: 0, else 1; -1 if they are wrong.
 */
static int projected_grid(struct ct_vol *grid, const struct ct_meta *m, struct ct_err *e)
{
	double n[3], a[12];
	int rc = ct_meta_numbers(m, CT_META_VOLUME_SIZE, 3, n, e);

	if (rc == 0)
		rc = ct_meta_numbers(m, CT_META_VOLUME_AFFINE, 12, a, e);
	if (rc)
		return rc;
	for (int i = 0; i < 3; i++) {
		if (!(n[i] >= 1 && n[i] <= 1 << 20) || n[i] != floor(n[i]))
			return ct_fail(e, CT_EINPUT, CT_META_VOLUME_SIZE ": %g voxels", n[i]);
		grid->n[i] = (size_t)n[i];
		memcpy(grid->affine[i], a + 4 * i, sizeof grid->affine[i]);
	}
	return ct_vol_check_grid(grid, e) ? ct_blame(e, CT_META_VOLUME_AFFINE) : 0;
}

/* The same region in `most` voxels along its longest side. */
static void refine(struct ct_vol *grid, double most)
{
	double mm[3], factor[3], longest = 0;

	ct_vol_spacing(grid, mm);
	for (int a = 0; a < 3; a++)
		longest = fmax(longest, mm[a] * (double)grid->n[a]);
	for (int a = 0; a < 3; a++) {
		double n = fmax(1, nearbyint(most * mm[a] * (double)grid->n[a] / longest));

		factor[a] = n / (double)grid->n[a];
		grid->n[a] = (size_t)n;
	}
	ct_vol_rescale_affine(grid->affine, (const double(*)[4])grid->affine, factor);
}

/* Keep the slice in the plane of the fan: through the source, along the row of pixels. */
static int cut_fan(struct ct_vol *grid, const struct ct_stack *scan, struct ct_err *e)
{
	const struct ct_view *v = &scan->view[0];
	double along[3], normal[3], from[3], across = 0, k, len;
	int axis = 0;

	ct_vec3_minus(along, v->centre, v->source);
	ct_vec3_cross(normal, v->u, along);
	len = ct_vec3_length(normal);
	for (int a = 0; a < 3; a++) {
		double x = 0, mm = 0;

		for (int r = 0; r < 3; r++) {
			x += normal[r] * grid->affine[r][a] / len;
			mm += grid->affine[r][a] * grid->affine[r][a];
		}
		if (fabs(x) / sqrt(mm) > fabs(across)) {
			across = x / sqrt(mm);
			axis = a;
		}
		from[a] = v->source[a] - grid->affine[a][3];
	}
	across = 0;
	for (int r = 0; r < 3; r++)
		across += normal[r] * grid->affine[r][axis];
	k = ct_vec3_dot(normal, from) / across;
	if (!(k >= -0.5 - 1e-6 && k <= (double)grid->n[axis] - 0.5 + 1e-6))
		return ct_fail(e, CT_EGEOM, "the plane of the fan does not meet the volume");
	for (int r = 0; r < 3; r++)
		grid->affine[r][3] += k * grid->affine[r][axis];
	grid->n[axis] = 1;
	return 0;
}

int ct_scan_grid(struct ct_vol *grid, size_t voxels, const struct ct_stack *scan, struct ct_err *e)
{
	const int rc = projected_grid(grid, &scan->meta, e);

	if (rc < 0 || (rc > 0 && seen_cube(grid, scan, e)))
		return -1;
	if (voxels)
		refine(grid, (double)voxels);
	return scan->beam == CT_FAN ? cut_fan(grid, scan, e) : 0;
}

int ct_scan_grid_put(struct ct_meta *m, const struct ct_vol *v, struct ct_err *e)
{
	const double(*a)[4] = v->affine;

	if (ct_meta_setf(m, e, CT_META_VOLUME_SIZE, "%zu,%zu,%zu", v->n[0], v->n[1], v->n[2]))
		return -1;
	return ct_meta_setf(m, e, CT_META_VOLUME_AFFINE,
		"%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g", a[0][0],
		a[0][1], a[0][2], a[0][3], a[1][0], a[1][1], a[1][2], a[1][3], a[2][0], a[2][1],
		a[2][2], a[2][3]);
}
