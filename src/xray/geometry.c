/* geometry.c: see geometry.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "xray/geometry.h"
#include "core/vec3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define DEGREE 0.017453292519943295
#define FARTHEST 1e5 /* DSD: source and detector may be moved by so many */
#define MOST_DEGREES 1e6

/* Exact at whole quarter turns, and periodic to the last bit. */
static void sincos_degrees(double degrees, double *s, double *c)
{
	double r = fmod(degrees, 360.0), q = nearbyint(r / 90.0);
	double x = (r - 90.0 * q) * DEGREE, sx = sin(x), cx = cos(x);

	const double turned[4] = {sx, cx, -sx, -cx};

	*s = turned[(int)q & 3];
	*c = turned[((int)q + 1) & 3];
}

/* Side of the square that holds the parallel shadow of the grid at every angle. */
static double shadow_side(const struct ct_vol *g, const double iso[3])
{
	double side = 0;

	for (unsigned k = 0; k < 8; k++) {
		double x[3];

		ct_vol_corner(g, k, x);
		side = fmax(side, 2 * hypot(x[0] - iso[0], x[1] - iso[1]));
		side = fmax(side, 2 * fabs(x[2] - iso[2]));
	}
	return side;
}

static void scan_of(struct ct_geometry *s, enum ct_beam beam, const struct ct_vol *g, double fov)
{
	size_t most = 1;
	double side = 2 * fov;

	*s = (struct ct_geometry){.beam = beam,
		.views = 100,
		.arc = 180,
		.dso = 1000 * fov / 256,
		.dsd = 1500 * fov / 256};
	ct_vol_centre(g, s->iso);
	for (int a = 0; a < 3; a++)
		most = g->n[a] > most ? g->n[a] : most;
	if (beam == CT_PARALLEL)
		side = shadow_side(g, s->iso);
	s->w = most;
	s->h = beam == CT_FAN ? 1 : most;
	s->pitch[0] = s->pitch[1] = side / (double)most;
}

void ct_geometry_default(struct ct_geometry *s, enum ct_beam beam, const struct ct_vol *grid)
{
	double mm[3], fov = 0;

	ct_vol_spacing(grid, mm);
	for (int a = 0; a < 3; a++)
		fov = fmax(fov, mm[a] * (double)grid->n[a]);
	scan_of(s, beam, grid, fov);
}

void ct_geometry_paper(struct ct_geometry *s, enum ct_beam beam, const struct ct_vol *grid)
{
	scan_of(s, beam, grid, 256);
}

void ct_geometry_free(struct ct_geometry *s)
{
	free(s->angle);
	free(s->view);
	*s = (struct ct_geometry){0};
}

static int check(const struct ct_geometry *s, struct ct_err *e)
{
	static const char *const name[] = {"source to isocentre", "source to detector",
		"pixel pitch along u", "pixel pitch along v"};
	const double positive[] = {s->dso, s->dsd, s->pitch[0], s->pitch[1]};

	for (int i = 0; i < 4; i++)
		if (!(positive[i] > 1e-9 && positive[i] < 1e9))
			return ct_fail(e, CT_EGEOM, "%s of %g mm", name[i], positive[i]);
	if (s->beam != CT_PARALLEL && s->dsd < s->dso)
		return ct_fail(e, CT_EGEOM,
			"source to detector of %g mm is less than source to isocentre of %g mm: the "
			"detector would stand before the axis; are they exchanged, or is one missing?",
			s->dsd, s->dso);
	if (!isfinite(s->arc + s->start + s->offset[0] + s->offset[1] + s->iso[0] + s->iso[1] +
		      s->iso[2] + s->tilt + s->source[0] + s->source[1]))
		return ct_fail(e, CT_EGEOM, "scan geometry is not finite");
	for (size_t i = 0; i < (s->angle ? s->views : 2); i++) {
		const double angle = s->angle ? s->angle[i] : i ? s->arc : s->start;

		if (!(fabs(angle) <= MOST_DEGREES))
			return ct_fail(e, CT_EGEOM, "an angle of %g degrees", angle);
	}
	for (int a = 0; a < 2; a++) {
		const double moved = fmax(fabs(s->offset[a]), fabs(s->source[a]));

		if (moved > FARTHEST * s->dsd)
			return ct_fail(e, CT_EGEOM,
				"the detector or the source is moved by %g mm along %s, too far for a "
				"detector %g mm away",
				moved, a == 0 ? "u" : "v", s->dsd);
	}
	if (s->beam == CT_FAN && s->h != 1)
		return ct_fail(
			e, CT_EGEOM, "a fan has one detector row, not %zu: use a cone", s->h);
	return 0;
}

static void fill_view(struct ct_view *v, const struct ct_geometry *s, size_t i)
{
	const bool parallel = s->beam == CT_PARALLEL;
	double sa, ca, st, ct;

	v->angle = s->angle ? s->angle[i] : s->start + (double)i * s->arc / (double)s->views;
	sincos_degrees(v->angle, &sa, &ca);
	sincos_degrees(s->tilt, &st, &ct);

	const double out[3] = {ca, sa, 0}, u[3] = {0 - sa, ca, 0}, down[3] = {0, 0, -1};

	for (int a = 0; a < 3; a++) {
		double shift = s->offset[0] * u[a] + s->offset[1] * down[a];

		v->source[a] = s->iso[a] + s->dso * out[a];
		v->centre[a] = s->iso[a] - (s->dsd - s->dso) * out[a] + shift;
		v->source[a] += parallel ? shift : s->source[0] * u[a] + s->source[1] * down[a];
		v->u[a] = s->pitch[0] * (ct * u[a] + st * down[a]);
		v->v[a] = s->pitch[1] * (ct * down[a] - st * u[a]);
	}
}

/* The scan in a few numbers, if it is one. */
static int note(struct ct_meta *m, const struct ct_geometry *s, struct ct_err *e)
{
	double arc = s->arc, start = s->start;

	if (s->view)
		return 0;
	if (s->angle) {
		start = s->angle[0];
		arc = s->angle[s->views - 1] - start;
		arc *= s->views > 1 ? (double)s->views / ((double)s->views - 1) : 1;
	}
	return ct_err_any(ct_meta_setf(m, e, CT_META_SCAN_DSO, "%.17g", s->dso) ||
			  ct_meta_setf(m, e, CT_META_SCAN_DSD, "%.17g", s->dsd) ||
			  ct_meta_setf(m, e, CT_META_SCAN_ARC, "%.17g", arc) ||
			  ct_meta_setf(m, e, CT_META_SCAN_START, "%.17g", start) ||
			  ct_meta_setf(m, e, CT_META_SCAN_ISO, "%.17g,%.17g,%.17g", s->iso[0],
				  s->iso[1], s->iso[2]));
}

int ct_geometry_fill(struct ct_stack *out, const struct ct_geometry *s, struct ct_err *e)
{
	if ((!s->view && check(s, e)) || ct_stack_alloc(out, s->views, s->h, s->w, e))
		return -1;
	out->beam = s->beam;
	for (size_t i = 0; i < s->views && !s->view; i++)
		fill_view(&out->view[i], s, i);
	if (s->view)
		memcpy(out->view, s->view, s->views * sizeof *s->view);
	if (ct_stack_check(out, e) || note(&out->meta, s, e)) {
		ct_stack_free(out);
		return -1;
	}
	return 0;
}

int ct_geometry_check(const struct ct_stack *s, const struct ct_vol *grid, struct ct_err *e)
{
	double mid[3], radius = 0;

	if (s->beam == CT_PARALLEL)
		return 0;
	ct_vol_centre(grid, mid);
	for (unsigned k = 0; k < 8; k++) {
		double x[3];

		ct_vol_corner(grid, k, x);
		radius = fmax(radius, hypot(hypot(x[0] - mid[0], x[1] - mid[1]), x[2] - mid[2]));
	}
	for (size_t k = 0; k < s->views; k++) {
		const double *p = s->view[k].source;
		double far = hypot(hypot(p[0] - mid[0], p[1] - mid[1]), p[2] - mid[2]);

		if (!(far > radius))
			return ct_fail(e, CT_EGEOM,
				"view %zu: the source is %g mm from the centre of the volume, "
				"inside its "
				"bounding sphere of radius %g mm",
				k, far, radius);
	}
	return 0;
}

void ct_view_ray(const struct ct_stack *s, size_t view, size_t row, size_t col, double origin[3],
	double dir[3])
{
	const struct ct_view *v = &s->view[view];
	double cu = (double)col - ((double)s->w - 1) / 2, cv = (double)row - ((double)s->h - 1) / 2;

	for (int a = 0; a < 3; a++) {
		double side = cu * v->u[a] + cv * v->v[a], along = v->centre[a] - v->source[a];

		dir[a] = s->beam == CT_PARALLEL ? along : along + side;
		origin[a] = s->beam == CT_PARALLEL ? v->source[a] + side : v->source[a];
	}
}

bool ct_view_map(
	double map[3][4], const struct ct_stack *s, size_t view, const double unit[static 3])
{
	const struct ct_view *v = &s->view[view];
	const bool parallel = s->beam == CT_PARALLEL;
	const double *from = parallel ? v->centre : v->source;
	double m[3][3], along[3], det, size = 0, scale = 1;

	ct_vec3_minus(along, v->centre, v->source);
	det = ct_vec3_dual(m, v->u, v->v, along);
	for (int a = 0; a < 3; a++)
		size += fabs(v->u[a] * m[0][a]);
	if (!(fabs(det) > 1e-12 * size))
		return false;
	for (int r = 0; r < 3; r++) {
		map[r][3] = 0;
		for (int a = 0; a < 3; a++) {
			map[r][a] = m[r][a] / det;
			map[r][3] -= map[r][a] * from[a];
		}
	}
	if (parallel) {
		memcpy(map[2], (const double[4]){0, 0, 0, 1}, sizeof map[2]);
	} else {
		scale = map[2][3];
		for (int a = 0; a < 3; a++)
			scale += map[2][a] * unit[a];
	}
	for (int k = 0; k < 4; k++) {
		map[2][k] /= scale;
		map[0][k] = map[0][k] / scale + ((double)s->w - 1) / 2 * map[2][k];
		map[1][k] = map[1][k] / scale + ((double)s->h - 1) / 2 * map[2][k];
	}
	return isfinite(1 / scale);
}

/* Pixels of n about those from lo to hi. */
static void pixels_of(size_t n, double lo, double hi, size_t range[2])
{
	double most = (double)n;

	range[0] = (size_t)fmin(fmax(floor(lo) - 1, 0), most);
	range[1] = (size_t)fmin(fmax(ceil(hi) + 2, 0), most);
	if (range[1] < range[0])
		range[1] = range[0];
}

void ct_view_shadow(const struct ct_stack *s, size_t view, size_t n, const double (*x)[3],
	size_t row[2], size_t col[2])
{
	double map[3][4], lo[2] = {(double)INFINITY, (double)INFINITY},
			  hi[2] = {-(double)INFINITY, -(double)INFINITY};
	bool seen = ct_view_map(map, s, view, s->view[view].centre);

	for (size_t k = 0; k < n && seen; k++) {
		double depth = ct_vec3_dot(map[2], x[k]) + map[2][3];

		seen = depth > 0;
		for (int a = 0; a < 2; a++) {
			double at = (ct_vec3_dot(map[a], x[k]) + map[a][3]) / depth;

			lo[a] = fmin(lo[a], at);
			hi[a] = fmax(hi[a], at);
		}
	}
	pixels_of(s->w, seen ? lo[0] : 0, seen ? hi[0] : (double)s->w, col);
	pixels_of(s->h, seen ? lo[1] : 0, seen ? hi[1] : (double)s->h, row);
}

int ct_geometry_seen(const struct ct_stack *s, const struct ct_vol *grid, struct ct_err *e)
{
	size_t row[2], col[2], seen = 0;
	double x[8][3], map[3][4];

	for (unsigned k = 0; k < 8; k++)
		ct_vol_corner(grid, k, x[k]);
	for (size_t k = 0; k < s->views; k++) {
		unsigned front = 0;

		if (!ct_view_map(map, s, k, s->view[k].centre))
			continue;
		for (unsigned c = 0; c < 8; c++)
			front += ct_vec3_dot(map[2], x[c]) + map[2][3] > 0;
		ct_view_shadow(s, k, 8, (const double(*)[3])x, row, col);
		seen += front && row[0] < row[1] && col[0] < col[1];
	}
	return seen * 3 >= s->views
		       ? 0
		       : ct_fail(e, CT_EGEOM,
				 "lies beside the scan: %zu of %zu views see it; expected both "
				 "of one patient, in one place",
				 seen, s->views);
}
