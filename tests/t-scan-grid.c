/* The grid that ct-fdk chooses: that of the metadata, the cube that all views see, a part of it,
 * the slice of a fan; against a twin that goes by points and planes.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "numbers.h"
#include "recon/scan-grid.h"
#include "xray/geometry.h"

#include <stdlib.h>
#include <string.h>

static double dot3(const double a[3], const double b[3])
{
	return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double length(const double a[3])
{
	return sqrt(dot3(a, a));
}

static void cross3(double out[3], const double a[3], const double b[3])
{
	out[0] = a[1] * b[2] - a[2] * b[1];
	out[1] = a[2] * b[0] - a[0] * b[2];
	out[2] = a[0] * b[1] - a[1] * b[0];
}

/* Scans with nothing regular about them: every vector of every view is moved a little. Lengths are
 * times size. */
static void make(struct ct_stack *s, enum ct_beam beam, size_t views, double size)
{
	const struct ct_geometry scan = {.beam = beam,
		.views = views,
		.arc = 300,
		.start = 20,
		.dso = 700 * size,
		.dsd = 1100 * size,
		.w = 64,
		.h = beam == CT_FAN ? 1
		     : views % 2    ? 20
				    : 48, /* low, or high */
		.pitch = {0.5 * size, 0.75 * size},
		.offset = {3 * size, beam == CT_FAN ? 0 : -2 * size},
		.iso = {10 * size, -20 * size, 30 * size}};
	float *by = normals(12 * views, 3, (uint64_t)beam, size);

	must(ct_geometry_fill(s, &scan, &err));
	for (size_t k = 0; k < views && beam != CT_FAN; k++)
		for (int a = 0; a < 3; a++) {
			s->view[k].source[a] += (double)by[12 * k + (size_t)a];
			s->view[k].centre[a] += (double)by[12 * k + 3 + (size_t)a];
			s->view[k].u[a] += 0.03 * (double)by[12 * k + 6 + (size_t)a];
			s->view[k].v[a] += 0.03 * (double)by[12 * k + 9 + (size_t)a];
		}
	free(by);
}

/* Sum of the squared distances of x from the central rays. */
static double apart_from(const double x[3], const struct ct_stack *s)
{
	double sum = 0;

	for (size_t k = 0; k < s->views; k++) {
		double ray[3], to[3], c[3];

		for (int a = 0; a < 3; a++) {
			ray[a] = s->view[k].centre[a] - s->view[k].source[a];
			to[a] = x[a] - s->view[k].source[a];
		}
		cross3(c, ray, to);
		sum += dot3(c, c) / dot3(ray, ray);
	}
	return sum;
}

/* A corner of the detector, in half sides. */
static void corner(double p[3], const struct ct_stack *s, size_t k, int along_u, int along_v)
{
	const struct ct_view *v = &s->view[k];

	for (int a = 0; a < 3; a++)
		p[a] = v->centre[a] + along_u * 0.5 * (double)s->w * v->u[a] +
		       along_v * 0.5 * (double)s->h * v->v[a];
}

/* Distance of x from the plane of the rays to two corners. */
static double from_plane(
	const double x[3], const struct ct_stack *s, size_t k, const double p[3], const double q[3])
{
	double side[3], ray[3], to[3], n[3];

	for (int a = 0; a < 3; a++) {
		side[a] = q[a] - p[a];
		ray[a] = s->view[k].source[a] -
			 (s->beam == CT_PARALLEL ? s->view[k].centre[a] : p[a]);
		to[a] = x[a] - p[a];
	}
	cross3(n, side, ray);
	return fabs(dot3(n, to)) / length(n);
}

/* What every view sees about x, to the farther edge along u, and along v but for a fan. */
static double seen(const double x[3], const struct ct_stack *s)
{
	double least = HUGE_VAL;

	for (size_t k = 0; k < s->views; k++) {
		double c[4][3], most[2];

		corner(c[0], s, k, -1, -1);
		corner(c[1], s, k, 1, -1);
		corner(c[2], s, k, 1, 1);
		corner(c[3], s, k, -1, 1);
		most[0] = fmax(from_plane(x, s, k, c[0], c[3]), from_plane(x, s, k, c[1], c[2]));
		most[1] = fmax(from_plane(x, s, k, c[0], c[1]), from_plane(x, s, k, c[2], c[3]));
		least = fmin(least, s->beam == CT_FAN ? most[0] : fmin(most[0], most[1]));
	}
	return least;
}

/* The smallest side of a pixel, at x. */
static double finest(const double x[3], const struct ct_stack *s)
{
	double least = HUGE_VAL;

	for (size_t k = 0; k < s->views; k++) {
		const struct ct_view *v = &s->view[k];
		double near[3], far[3], mm = fmin(length(v->u), length(v->v));

		for (int a = 0; a < 3; a++) {
			near[a] = x[a] - v->source[a];
			far[a] = v->centre[a] - v->source[a];
		}
		least = fmin(least, s->beam == CT_PARALLEL ? mm : mm * length(near) / length(far));
	}
	return least;
}

static void test_cube(enum ct_beam beam, size_t views, double size)
{
	struct ct_stack s = {0};
	struct ct_vol g = {0};
	double x[3], r, n;
	size_t uphill = 0, bad = 0;

	make(&s, beam, views, size);
	must(ct_scan_grid(&g, 0, &s, &err));
	for (int a = 0; a < 3; a++) /* a fan's slice is cut from the cube */
		x[a] = g.affine[a][3] + g.affine[a][a] * ((double)g.n[a] - 1) / 2;
	for (int a = 0; a < 3 && beam != CT_FAN; a++)
		for (int sign = -1; sign <= 1; sign += 2) {
			double y[3] = {x[0], x[1], x[2]};

			y[a] += sign * 1e-3 * size;
			uphill += apart_from(y, &s) > apart_from(x, &s);
		}
	OK(beam == CT_FAN || uphill == 6, "%s: where the central rays meet",
		CT_WORD(CT_BEAM_LIST, beam));
	r = seen(x, &s);
	n = ceil(2 * r / finest(x, &s));
	NEAR((double)g.n[0], n, 0.5, "as many voxels as pixels there");
	for (int a = 0; a < 3; a++)
		for (int b = 0; b < 3; b++)
			bad += fabs(g.affine[a][b] - (a == b ? 2 * r / n : 0)) > 1e-9 * size;
	OK(bad == 0, "of the size that the views see: %g mm", 2 * r);
	OK(g.n[1] == g.n[0] && g.n[2] == (beam == CT_FAN ? 1 : g.n[0]), "a cube, or its slice");
	NEAR(g.affine[0][3], x[0] - r + r / n, 1e-9 * size, "its first voxel");
	if (beam == CT_FAN)
		NEAR(x[2], 30 * size, 1e-9, "the slice is where the fan is");
	ct_stack_free(&s);
}

static void fails(enum ct_code code, const struct ct_stack *s, const char *name)
{
	struct ct_vol g = {0};
	int rc = ct_scan_grid(&g, 0, s, &err);

	OK(rc == -1 && err.code == code, "%s: %s", name, rc ? err.msg : "taken");
}

static void say(struct ct_stack *s, const char *size, const char *affine)
{
	must(ct_meta_set(&s->meta, CT_META_VOLUME_SIZE, size, &err) ||
		ct_meta_set(&s->meta, CT_META_VOLUME_AFFINE, affine, &err));
}

#define TURNED "0,-2,0,5,1,0,0,-7,0,0,3,11"

static void test_projected(void)
{
	static const double want[3][4] = {{0, -2, 0, 5}, {1, 0, 0, -7}, {0, 0, 3, 11}};
	static const struct {
		const char *size, *affine;
		enum ct_code code;
	} wrong[] = {{"40,0,20", TURNED, CT_EINPUT}, {"40,30.5,20", TURNED, CT_EINPUT},
		{"40,30,1048577", TURNED, CT_EINPUT}, {"40,30", TURNED, CT_EINPUT},
		{"40,30,20", "0,-2,0,5", CT_EINPUT},
		{"40,30,20", "0,0,0,5,1,0,0,-7,0,0,3,11", CT_EGEOM}};
	struct ct_stack s = {0};
	struct ct_vol g = {0};

	make(&s, CT_CONE, 30, 1);
	say(&s, "40,30,20", TURNED);
	must(ct_scan_grid(&g, 0, &s, &err));
	OK(g.n[0] == 40 && g.n[1] == 30 && g.n[2] == 20 && memcmp(g.affine, want, sizeof want) == 0,
		"the grid that was projected");
	say(&s, "1,1,1048576", TURNED);
	OK(ct_scan_grid(&g, 0, &s, &err) == 0 && g.n[2] == 1048576, "as long as 2^20");
	for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
		say(&s, wrong[k].size, wrong[k].affine);
		fails(wrong[k].code, &s, "a wrong grid in the metadata");
	}
	ct_stack_free(&s);
}

/* 40 x 60 x 60 mm. */
static void test_number(void)
{
	static const size_t most[] = {24, 90, 1},
			    want[][3] = {{16, 24, 24}, {60, 90, 90}, {1, 1, 1}};
	struct ct_stack s = {0};
	struct ct_vol old = {0};

	make(&s, CT_CONE, 30, 1);
	say(&s, "40,30,20", TURNED);
	must(ct_scan_grid(&old, 0, &s, &err));
	for (size_t k = 0; k < sizeof most / sizeof *most; k++) {
		struct ct_vol g = {0};
		double far = 0;

		must(ct_scan_grid(&g, most[k], &s, &err));
		OK(memcmp(g.n, want[k], sizeof g.n) == 0, "%zu voxels along the longest side",
			most[k]);
		for (int c = 0; c < 8; c++) { /* the corners of the box */
			double i[3], j[3], p[3], q[3];

			for (int a = 0; a < 3; a++) {
				i[a] = c >> a & 1 ? (double)old.n[a] - 0.5 : -0.5;
				j[a] = c >> a & 1 ? (double)g.n[a] - 0.5 : -0.5;
			}
			ct_vol_world(&old, i, p);
			ct_vol_world(&g, j, q);
			for (int a = 0; a < 3; a++)
				far = fmax(far, fabs(p[a] - q[a]));
		}
		NEAR(far, 0, 1e-9, "of the same box");
	}
	OK(ct_scan_grid(&old, 65536, &s, &err) == 0, "the most there may be");
	ct_stack_free(&s);
}

static void test_one_direction(void)
{
	struct ct_stack s = {0};
	struct ct_vol g = {0};

	make(&s, CT_CONE, 2, 1);
	s.view[1] = s.view[0];
	fails(CT_EGEOM, &s, "two views of one direction");
	for (int a = 0; a < 3; a++) { /* the same from the other side */
		s.view[1].source[a] = 2 * s.view[0].centre[a] - s.view[0].source[a];
		s.view[1].u[a] = -s.view[0].u[a];
	}
	fails(CT_EGEOM, &s, "and of the opposite one");
	s.view[1] = s.view[0];
	s.view[1].source[0] += 0.01;
	fails(CT_EGEOM, &s, "and nearly so");
	s.view[1] = s.view[0];
	s.view[1].source[0] += 20;
	OK(ct_scan_grid(&g, 0, &s, &err) == 0, "a degree apart will do");
	s.view[1] = s.view[0];
	say(&s, "40,30,20", TURNED);
	OK(ct_scan_grid(&g, 0, &s, &err) == 0, "a grid that is named needs no meeting point");
	ct_stack_free(&s);
}

static void test_pixel(void)
{
	const struct ct_geometry scan = {.beam = CT_CONE,
		.views = 30,
		.arc = 360,
		.dso = 700,
		.dsd = 1100,
		.w = 1,
		.h = 1,
		.pitch = {5, 5}};
	struct ct_stack s = {0};
	struct ct_vol g = {0};

	must(ct_geometry_fill(&s, &scan, &err));
	must(ct_scan_grid(&g, 0, &s, &err));
	OK(g.n[0] == 1 && g.n[1] == 1 && g.n[2] == 1, "one pixel sees one voxel");
	NEAR(g.affine[0][0], 5 * 700.0 / 1100, 0.01, "of its size");
	NEAR(fabs(g.affine[0][3]) + fabs(g.affine[1][3]) + fabs(g.affine[2][3]), 0, 1e-9,
		"in the middle");
	ct_stack_free(&s);
}

/* Two views that look along x and y; the stack holds no pixels. */
static void test_size(void)
{
	struct ct_stack s = {0};
	struct ct_vol g = {0};

	must(ct_stack_alloc(&s, 2, 1, 1, &err));
	s.beam = CT_PARALLEL;
	for (int k = 0; k < 2; k++) {
		s.view[k].source[k] = -500;
		s.view[k].centre[k] = 500;
		s.view[k].u[1 - k] = s.view[k].v[2] = 1;
	}
	s.w = s.h = 1 << 20;
	OK(ct_scan_grid(&g, 0, &s, &err) == 0 && g.n[1] == 1 << 20, "as large as 2^20");
	s.w = s.h = (1 << 20) + 1;
	fails(CT_EGEOM, &s, "and no larger");
	s.w = s.h = 0;
	fails(CT_EGEOM, &s, "nor nothing");
	ct_stack_free(&s);
}

/* A grid of voxels of these sizes, of which one axis is nearly z; the fan is at z = 30. */
static void test_fan(const double mm[3], int across, double sign)
{
	const double c = cos(0.05), d = sin(0.05);
	const int x = (across + 1) % 3, y = (across + 2) % 3;
	struct ct_stack s = {0};
	struct ct_vol whole = {.n = {9, 9, 9}};
	double axes[3][3] = {{0}}, off = 0;

	axes[0][across] = -sign * d * mm[across];
	axes[2][across] = sign * c * mm[across];
	axes[0][x] = c * mm[x];
	axes[2][x] = d * mm[x];
	axes[1][y] = mm[y];
	make(&s, CT_FAN, 40, 1);
	for (int r = 0; r < 3; r++)
		memcpy(whole.affine[r], axes[r], sizeof axes[r]);
	for (double k = -2.3; k < 11; k += 0.37) { /* the source is k voxels from the first */
		struct ct_vol g = {0};
		char text[400];

		for (int r = 0; r < 3; r++)
			whole.affine[r][3] = s.view[0].source[r] - k * axes[r][across];
		ct_meta_free(&s.meta);
		must(ct_scan_grid_put(&s.meta, &whole, &err));
		snprintf(text, sizeof text, "a fan at %g of 9 slices", k);
		if (k < -0.5 || k > 8.5) {
			fails(CT_EGEOM, &s, text);
			continue;
		}
		must(ct_scan_grid(&g, 0, &s, &err));
		for (int a = 0; a < 3; a++) {
			off = fmax(off, g.n[a] == (a == across ? 1 : 9) ? 0 : 1);
			off = fmax(off, fabs(g.affine[a][3] - s.view[0].source[a]));
			off = fmax(off, memcmp(g.affine[a], axes[a], sizeof axes[a]) ? 1 : 0);
		}
	}
	NEAR(off, 0, 1e-9, "the slice in the plane of the fan, across the axis that it cuts");
	ct_stack_free(&s);
}

int main(void)
{
	test_cube(CT_CONE, 37, 1);
	test_cube(CT_CONE, 36, 1);
	test_cube(CT_CONE, 36, 0.01); /* a fifth of a mm */
	test_cube(CT_PARALLEL, 23, 1);
	test_cube(CT_PARALLEL, 23, 0.01);
	test_cube(CT_FAN, 41, 1);
	test_cube(CT_FAN, 41, 0.01);
	test_projected();
	test_number();
	test_one_direction();
	test_pixel();
	test_size();
	test_fan((const double[3]){4, 2, 3}, 0, 1);
	test_fan((const double[3]){0.5, 4, 0.5}, 1, -1);
	test_fan((const double[3]){20, 20, 2}, 2, 1);
	test_fan((const double[3]){20, 2, 20}, 1, 1);
	return tap_done();
}
