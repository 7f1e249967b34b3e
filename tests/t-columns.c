/* t-columns.c: many rays at once against rays one at a time, both methods, forward and adjoint;
 * Joseph's method against sums done another way. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "xray/columns.h"
#include "xray/phantom.h"
#include "xray/project.h"
#include "xray/geometry.h"
#include "numbers.h"
#include "xray/window.h"
#include "tap.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static const char *const methods[] = {"Siddon", "Joseph"};

/* A grid about the origin whose axis a runs along world axis to[a], backwards if flip; random. */
static struct ct_vol grid(const size_t n[3], const double mm[3], const int to[3], bool flip)
{
	struct ct_vol v = {0};

	must(ct_vol_alloc(&v, n, &err));
	memset(v.affine, 0, sizeof v.affine);
	for (int a = 0; a < 3; a++) {
		double step = flip ? -mm[a] : mm[a];

		v.affine[to[a]][a] = step;
		v.affine[to[a]][3] = -step * ((double)n[a] - 1) / 2;
	}
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = (float)ct_rng_uniform(1, 2, i);
	return v;
}

static struct ct_geometry scan_of(
	enum ct_beam beam, const struct ct_vol *v, size_t views, size_t w, size_t h, double pitch)
{
	struct ct_geometry s;

	ct_geometry_default(&s, beam, v);
	s.views = views;
	s.w = w;
	s.h = h;
	s.pitch[0] = s.pitch[1] = pitch;
	return s;
}

struct result {
	double forward, adjoint, dot, least;
};

/* One scan both ways. */
static struct result compare(
	struct ct_vol *v, const struct ct_geometry *scan, enum ct_method method)
{
	struct ct_stack a = {0}, b = {0};
	struct ct_projector one, many;
	size_t n = ct_vol_count(v), m;
	float *x = calloc(n, sizeof *x), *y = calloc(n, sizeof *y);
	struct result r;

	must(ct_geometry_fill(&a, scan, &err));
	must(ct_geometry_fill(&b, scan, &err));
	m = ct_stack_count(&a);
	must(ct_projector_init(&one, v, &a, &err));
	one.method = method;
	many = one;
	must(ct_projector_reserve(&many, &err));
	if (!many.columns) {
		printf("Bail out! no columns\n");
		exit(99);
	}
	ct_projector_load(&one, v->data, NULL);
	ct_project(&one, 0, a.views, a.data, NULL);
	ct_projector_load(&many, v->data, NULL);
	ct_project(&many, 0, b.views, b.data, NULL);
	r.forward = apart(m, b.data, a.data);
	r.least = dot(m, a.data, a.data);
	for (size_t i = 0; i < m; i++)
		a.data[i] = (float)ct_rng_normal(5, 6, i) + 0.5F;
	ct_project_adjoint(&one, 0, a.views, x, a.data, NULL);
	ct_project_adjoint(&many, 0, 1, y, a.data, NULL);
	ct_project_adjoint(&many, 1, a.views - 1, y, ct_stack_view(&a, 1), NULL);
	r.adjoint = apart(n, y, x);
	r.dot = dot(m, a.data, b.data) / dot(n, v->data, y);
	ct_projector_free(&many);
	ct_stack_free(&a);
	ct_stack_free(&b);
	free(x);
	free(y);
	return r;
}

static void t_same(void)
{
	static const int to[3][3] = {{0, 1, 2}, {2, 0, 1}, {1, 2, 0}};
	static const size_t n[3] = {37, 50, 43};
	static const double mm[3] = {1.5, 0.8, 1.1};
	static const char *const beams[] = {"cone", "parallel"};

	for (int method = 0; method < 2; method++)
		for (int beam = CT_CONE; beam <= CT_PARALLEL; beam++)
			for (int o = 0; o < 6; o++) {
				struct ct_vol v = grid(n, mm, to[o / 2], o % 2);
				struct ct_geometry scan =
					scan_of((enum ct_beam)beam, &v, 7, 33, 41, 1.7);
				struct result r;

				scan.arc = 360;
				scan.offset[0] = 3.3;
				scan.offset[1] = -2.2;
				r = compare(&v, &scan, (enum ct_method)method);
				OK(r.forward < 1e-5 && r.least > 1e4,
					"%s, %s, axes %d: as one at a time (%.2g)", methods[method],
					beams[beam], o, r.forward);
				OK(r.adjoint < 1e-4, "adjoint (%.2g)", r.adjoint);
				NEAR(r.dot, 1, 1e-6, "<P x, y> = <x, P' y>");
				ct_vol_free(&v);
			}
}

/* Fine and coarse pixels, thin and tall grids, steep rays, rays in faces, a source above the
 * middle. */
static void t_extremes(void)
{
	static const int to[3] = {0, 1, 2};
	static const struct {
		const char *name;
		size_t n[3];
		double mm[3], pitch, offset[2];
		size_t h;
		enum ct_beam beam;
	} c[] = {{"pixels of a tenth", {20, 22, 24}, {1, 1, 1}, 0.11, {0, 0}, 300, CT_CONE},
		{"pixels of ten voxels", {90, 80, 200}, {1, 1, 1}, 15, {2, 1}, 24, CT_CONE},
		{"one slice", {40, 40, 1}, {1, 1, 1}, 0.9, {0, 0.2}, 20, CT_CONE},
		{"one column", {1, 1, 60}, {1, 1, 1}, 0.9, {0.2, 0}, 64, CT_CONE},
		{"thin slices, steep rays", {30, 30, 160}, {2, 2, 0.15}, 1.1, {0, 9}, 60, CT_CONE},
		{"steeper ones, to both sides", {9, 8, 60}, {2, 2, 0.1}, 0.9, {0, 0}, 60, CT_CONE},
		{"rays in faces", {16, 16, 16}, {1, 1, 1}, 1, {0, 0}, 17, CT_PARALLEL},
		{"rays through centres", {16, 16, 16}, {1, 1, 1}, 1, {0, 0}, 16, CT_PARALLEL},
		{"beside the volume", {16, 16, 16}, {1, 1, 1}, 1, {0, 400}, 16, CT_CONE}};

	for (int method = 0; method < 2; method++)
		for (size_t i = 0; i < sizeof c / sizeof *c; i++) {
			struct ct_vol v = grid(c[i].n, c[i].mm, to, false);
			struct ct_geometry scan = scan_of(c[i].beam, &v, 4, 17, c[i].h, c[i].pitch);
			struct result r;

			scan.arc = 360;
			memcpy(scan.offset, c[i].offset, sizeof scan.offset);
			r = compare(&v, &scan, (enum ct_method)method);
			OK(r.forward < 1e-5 && r.adjoint < 1e-4, "%s, %s (%.2g, %.2g)",
				methods[method], c[i].name, r.forward, r.adjoint);
			if (r.least > 0)
				NEAR(r.dot, 1, 1e-6, "<P x, y> = <x, P' y>");
			ct_vol_free(&v);
		}
}

/* A volume that is mostly zero, loaded once and projected view by view, by one and four threads. */
static void t_empty(void)
{
	static const size_t n[3] = {40, 44, 48};
	static const double mm[3] = {1, 1, 1};
	static const int to[3] = {0, 1, 2};
	struct ct_vol v = grid(n, mm, to, false);
	struct ct_geometry scan = scan_of(CT_CONE, &v, 3, 40, 50, 2);
	struct ct_stack a = {0}, b = {0}, c = {0};
	struct ct_projector g;
	struct ct_par *par;
	float *x = calloc(ct_vol_count(&v), sizeof *x), *y = calloc(ct_vol_count(&v), sizeof *y);
	size_t m;

	for (size_t i = 0; i < ct_vol_count(&v); i++)
		if (i % 40 < 9 || i % 40 > 22 || i / 40 % 44 < 20 || i / 1760 % 8 < 6)
			v.data[i] = 0;
	must(ct_geometry_fill(&a, &scan, &err));
	must(ct_geometry_fill(&b, &scan, &err));
	must(ct_geometry_fill(&c, &scan, &err));
	m = ct_stack_count(&a);
	must(ct_par_alloc(&par, 4, &err));
	must(ct_projector_init(&g, &v, &a, &err));
	ct_projector_load(&g, v.data, NULL);
	ct_project(&g, 0, 3, a.data, NULL);
	must(ct_projector_reserve(&g, &err));
	ct_projector_load(&g, v.data, par);
	for (size_t k = 0; k < 3; k++)
		ct_project(&g, k, 1, ct_stack_view(&b, k), NULL);
	ct_project(&g, 0, 3, c.data, par);
	OK(apart(m, b.data, a.data) < 1e-5 && dot(m, a.data, a.data) > 100,
		"empty columns are passed over (%.2g)", apart(m, b.data, a.data));
	OK(memcmp(b.data, c.data, m * sizeof *b.data) == 0, "four threads, the same bytes");
	ct_project_adjoint(&g, 0, 3, x, a.data, NULL);
	ct_project_adjoint(&g, 0, 3, y, a.data, par);
	OK(memcmp(x, y, ct_vol_count(&v) * sizeof *x) == 0 && dot(m, x, y) > 0, "adjoint too");
	memset(v.data, 0, ct_vol_count(&v) * sizeof *v.data);
	ct_projector_load(&g, v.data, NULL);
	ct_project(&g, 0, 3, b.data, NULL);
	OK(dot(m, b.data, b.data) == 0, "a volume of zeros: zeros");
	v.data[(24 * 44 + 22) * 40 + 20] = 1;
	ct_projector_load(&g, v.data, NULL);
	ct_project(&g, 0, 3, b.data, NULL);
	ct_projector_free(&g);
	must(ct_projector_init(&g, &v, &a, &err));
	ct_projector_load(&g, v.data, NULL);
	ct_project(&g, 0, 3, a.data, NULL);
	OK(apart(m, b.data, a.data) < 3e-6 && dot(m, b.data, b.data) > 0, "a single voxel");
	ct_par_free(par);
	ct_stack_free(&a);
	ct_stack_free(&b);
	ct_stack_free(&c);
	ct_vol_free(&v);
	free(x);
	free(y);
}

/* Turn a grid and its views about the origin. */
static void turn(struct ct_vol *v, struct ct_stack *s)
{
	static const double to[3][3] = {{0.36, -0.8, 0.48}, {0.48, 0.6, 0.64}, {-0.8, 0, 0.6}};

	for (size_t k = 0; k < 4 + 4 * s->views; k++) {
		struct ct_view *w = k < 4 ? NULL : &s->view[k / 4 - 1];
		double *at = !w           ? NULL
			     : k % 4 == 0 ? w->source
			     : k % 4 == 1 ? w->centre
			     : k % 4 == 2 ? w->u
					  : w->v;
		double was[3];

		for (int r = 0; r < 3; r++)
			was[r] = at ? at[r] : v->affine[r][k];
		for (int r = 0; r < 3; r++)
			*(at ? &at[r] : &v->affine[r][k]) =
				to[r][0] * was[0] + to[r][1] * was[1] + to[r][2] * was[2];
	}
}

/* Along which axis of the grid the detector columns run, in all views; a detector of few rows is
 * not worth it. Columns that lean by 1e-7 voxels over the detector still do. */
static void t_axis(void)
{
	static const int to[3][3] = {{0, 1, 2}, {2, 0, 1}, {1, 2, 0}};
	static const size_t n[3] = {6, 9, 12};
	static const double mm[3] = {1, 2, 0.5};
	static const int want[3] = {2, 0, 1};

	for (int o = 0; o < 3; o++)
		for (size_t h = 7; h < 9; h++) {
			struct ct_vol v = grid(n, mm, to[o], o == 1);
			struct ct_geometry scan = scan_of(CT_CONE, &v, 4, 5, h, 1);
			struct ct_stack s = {0};
			struct ct_projector g;

			must(ct_geometry_fill(&s, &scan, &err));
			turn(&v, &s);
			must(ct_projector_init(&g, &v, &s, &err));
			OK(ct_columns_axis(&g) == (h < 8 ? -1 : want[o]), "%zu rows along axis %d",
				h, want[o]);
			for (size_t k = 0; k < 4 && h == 8; k += 3)
				for (int lean = 0; lean < 4; lean++) {
					struct ct_view was = s.view[k];
					double mine = 0.9e-7 / 8, *f = s.view[k].v;

					mine = lean % 2 ? 1.1e-7 / 8 : mine;
					for (int r = 0; r < 3;
						r++) /* of the thickest voxels, 2 mm */
						f[r] += mine *
							(lean < 2 ? v.affine[r][o]
								  : v.affine[r][(o + 1) % 3]);
					OK(ct_columns_axis(&g) == (lean % 2 ? -1 : want[o]),
						"view %zu leans by %.3g", k, mine);
					s.view[k] = was;
				}
			if (h == 8) { /* a view that lies on its side */
				memcpy(s.view[0].v, s.view[0].u, sizeof s.view[0].v);
				OK(ct_columns_axis(&g) == -1, "one on its side");
			}
			must(ct_projector_reserve(&g, &err));
			OK(ct_projector_bytes(&g) == 0 && !g.columns, "nothing is reserved");
			ct_stack_free(&s);
			ct_vol_free(&v);
		}
}

/* Room for columns of [n] voxels with 32 zeros behind, and two numbers for each. */
static void t_room(void)
{
	static const int to[3] = {0, 1, 2};
	struct ct_vol v = grid((const size_t[]){6, 9, 12}, (const double[]){1, 1, 1}, to, false);
	struct ct_geometry scan = scan_of(CT_CONE, &v, 4, 5, 8, 1);
	struct ct_stack s = {0};
	struct ct_projector g;

	must(ct_geometry_fill(&s, &scan, &err) || ct_projector_init(&g, &v, &s, &err) ||
		ct_projector_reserve(&g, &err));
	OK(ct_projector_bytes(&g) == 54 * (44 * 4 + 8), "%zu bytes", ct_projector_bytes(&g));
	ct_projector_free(&g);
	must(ct_projector_init(&g, &v, &s, &err));
	g.n[0] = 1525190; /* offsets within a row of columns are 32 bits: 44 x 2^26 / 44 */
	OK(ct_columns_axis(&g) == 2, "a row of 2^26 numbers");
	g.n[0] = 1525202;
	OK(ct_columns_axis(&g) == -1, "and no more");
	ct_stack_free(&s);
	ct_vol_free(&v);
}

/* A source that shines away from the volume sees nothing of it, from all sides; one that shines at
 * it does. */
static void t_behind(void)
{
	static const int to[3] = {0, 1, 2};
	struct ct_vol v = grid((const size_t[]){6, 9, 12}, (const double[]){1, 1, 1}, to, false);
	struct ct_geometry scan = scan_of(CT_CONE, &v, 8, 12, 14, 1);
	struct ct_stack s = {0}, t = {0};

	scan.arc = 360;
	must(ct_geometry_fill(&s, &scan, &err) || ct_geometry_fill(&t, &scan, &err));
	for (size_t k = 0; k < 8; k++)
		for (int a = 0; a < 3; a++) {
			t.view[k].source[a] *= -1;
			t.view[k].centre[a] = t.view[k].source[a] * 1.7;
		}
	for (int how = 0; how < 4; how++) {
		struct ct_projector g, away;
		float *x = calloc(ct_vol_count(&v), sizeof *x);

		must(ct_projector_init(&g, &v, &s, &err) || ct_projector_init(&away, &v, &t, &err));
		g.method = away.method = how % 2 ? CT_JOSEPH : CT_SIDDON;
		if (how > 1)
			must(ct_projector_reserve(&g, &err) || ct_projector_reserve(&away, &err));
		ct_projector_load(&g, v.data, NULL);
		ct_project(&g, 0, 8, s.data, NULL);
		ct_projector_load(&away, v.data, NULL);
		ct_project(&away, 0, 8, t.data, NULL);
		ct_project_adjoint(&away, 0, 8, x, s.data, NULL);
		OK(maxdiff(ct_stack_count(&s), s.data, NULL) > 1, "in front of the source");
		OK(maxdiff(ct_stack_count(&t), t.data, NULL) == 0 &&
				maxdiff(ct_vol_count(&v), x, NULL) == 0,
			"%s, %s: nothing behind it", methods[how % 2],
			how > 1 ? "many at once" : "one at a time");
		ct_projector_free(&g);
		ct_projector_free(&away);
		free(x);
	}
	ct_stack_free(&s);
	ct_stack_free(&t);
	ct_vol_free(&v);
}

/* Interpolate a grid with unit axes at a world point, two axes only; 0 beyond it. */
static double sample(const struct ct_vol *v, const double at[3])
{
	double sum = 0;

	for (int k = 0; k < 8; k++) {
		double w = 1;
		size_t index = 0, stride = 1;

		for (int a = 0; a < 3; a++) {
			double x = at[a], f = floor(x), i = k >> a & 1 ? f + 1 : f;

			w *= k >> a & 1 ? x - f : 1 - (x - f);
			if (i < 0 || i >= (double)v->n[a])
				w = 0;
			else
				index += (size_t)i * stride;
			stride *= v->n[a];
		}
		sum += w != 0 ? w * (double)v->data[index] : 0;
	}
	return sum;
}

/* Joseph's sum by its definition: the ray's points in the planes of voxel centres across its main
 * axis. */
static void t_joseph(void)
{
	static const size_t n[3] = {21, 18, 25};
	static const double mm[3] = {1.3, 1, 0.9};
	static const int to[3] = {0, 1, 2};
	struct ct_vol v = grid(n, mm, to, false);
	struct ct_geometry scan = scan_of(CT_CONE, &v, 6, 20, 22, 2.3);
	struct ct_stack s = {0};
	struct ct_projector g;
	double worst = 0, most = 0;

	scan.start = 7;
	scan.arc = 360;
	must(ct_geometry_fill(&s, &scan, &err));
	must(ct_projector_init(&g, &v, &s, &err));
	g.method = CT_JOSEPH;
	ct_projector_load(&g, v.data, NULL);
	ct_project(&g, 0, s.views, s.data, NULL);
	for (size_t i = 0; i < ct_stack_count(&s); i++) {
		double o[3], d[3], want = 0, length;
		int a = 0;

		ct_view_ray(&s, i / s.w / s.h, i / s.w % s.h, i % s.w, o, d);
		length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
		for (int k = 0; k < 3; k++)
			a = fabs(d[k] / mm[k]) > fabs(d[a] / mm[a]) ? k : a;
		for (size_t k = 0; k < n[a]; k++) {
			double t = (v.affine[a][a] * (double)k + v.affine[a][3] - o[a]) / d[a],
			       at[3];

			for (int b = 0; b < 3; b++)
				at[b] = b == a ? (double)k
					       : (o[b] + t * d[b] - v.affine[b][3]) / mm[b];
			want += sample(&v, at) * length / fabs(d[a] / mm[a]);
		}
		worst = fmax(worst, fabs(want - (double)s.data[i]));
		most = fmax(most, want);
	}
	NEAR(worst / most, 0, 1e-6, "Joseph: linear interpolation, slice by slice");
	OK(most > 5, "of rays that meet the grid");
	ct_stack_free(&s);
	ct_vol_free(&v);
}

/* Relative error of the projection of a smooth ball in n^3 voxels. */
static double deviation(enum ct_beam beam, enum ct_method method, size_t edge)
{
	const size_t n[3] = {edge, edge, edge};
	const double h = 128.0 / (double)edge, mm[3] = {h, h, h}, extent[3] = {128, 128, 128};
	static const int to[3] = {0, 1, 2};
	struct ct_vol v = grid(n, mm, to, false);
	struct ct_geometry scan = scan_of(beam, &v, 3, 50, 50, 4.1);
	struct ct_shape shape[CT_PH_MAX_SHAPES];
	size_t shapes = ct_phantom_make(CT_PH_SPHERE, extent, 0.5, 3, shape);
	struct ct_stack a = {0}, b = {0};
	struct ct_projector g;
	double sum = 0, norm;

	must(ct_geometry_fill(&a, &scan, &err));
	must(ct_geometry_fill(&b, &scan, &err));
	ct_phantom_voxels(&v, shapes, shape, 4, NULL);
	ct_phantom_project(&b, 0, b.views, b.data, shapes, shape, NULL);
	must(ct_projector_init(&g, &v, &a, &err));
	g.method = method;
	must(ct_projector_reserve(&g, &err));
	ct_projector_load(&g, v.data, NULL);
	ct_project(&g, 0, a.views, a.data, NULL);
	norm = dot(ct_stack_count(&b), b.data, b.data);
	for (size_t i = 0; i < ct_stack_count(&a); i++) {
		double d = (double)a.data[i] - (double)b.data[i];

		sum += d * d;
	}
	ct_projector_free(&g);
	ct_stack_free(&a);
	ct_stack_free(&b);
	ct_vol_free(&v);
	return sqrt(sum / norm);
}

static void t_order(void)
{
	for (int method = 0; method < 2; method++)
		for (int beam = CT_CONE; beam <= CT_PARALLEL; beam++) {
			double e0 = deviation((enum ct_beam)beam, (enum ct_method)method, 20);
			double e1 = deviation((enum ct_beam)beam, (enum ct_method)method, 80);

			OK(e1 < 0.3 * e0 && e1 < 0.05,
				"%s, %s: the error falls at least as the voxel (%.4f, %.4f)",
				methods[method], beam == CT_CONE ? "cone" : "parallel", e0, e1);
		}
}

/* line integrals by interpolation against the formula, through the volume, along its
 * faces and beside it; the window of densities. */

enum { NX = 7, NY = 5, NZ = 6, H = 29, W = 37 };

/* Linear between voxel centres, 0 from one voxel beyond the outermost on. */
static double value(const struct ct_vol *v, const double x[3])
{
	double sum = 0, w[3];

	for (size_t i = 0; i < ct_vol_count(v); i++) {
		const size_t at[3] = {i % NX, i / NX % NY, i / NX / NY};

		for (int a = 0; a < 3; a++)
			w[a] = fmax(0, 1 - fabs(x[a] - (double)at[a]));
		sum += w[0] * w[1] * w[2] * (double)v->data[i];
	}
	return sum;
}

/* The sum over the slices across the dominant axis, by the definition; voxels of 1, 2 and 3 mm with
 * the first centre at the origin. */
static double by_hand(
	const struct ct_vol *v, const struct ct_view *view, size_t row, size_t col, bool cone)
{
	double from[3], dir[3], mm = 0, sum = 0;
	int a = 0;

	for (int k = 0; k < 3; k++) {
		double off = view->u[k] * ((double)col - (W - 1) / 2.0) +
			     view->v[k] * ((double)row - (H - 1) / 2.0);

		from[k] = view->source[k] + (cone ? 0 : off);
		dir[k] = view->centre[k] + off - from[k];
		mm += dir[k] * dir[k];
		from[k] /= k + 1; /* in voxels */
		dir[k] /= k + 1;
	}
	for (int k = 1; k < 3; k++)
		if (fabs(dir[k]) > fabs(dir[a]))
			a = k;
	for (size_t k = 0; k < v->n[a]; k++) {
		double t = ((double)k - from[a]) / dir[a], x[3];

		for (int b = 0; b < 3; b++)
			x[b] = from[b] + t * dir[b];
		x[a] = (double)k;
		sum += value(v, x);
	}
	return sum * sqrt(mm) / fabs(dir[a]);
}

/* Rays a quarter of a voxel apart, from outside on one side to outside on the other. */
static void rays(enum ct_beam beam, double turn, double tilt)
{
	struct ct_vol v = {0};
	struct ct_stack s = {0};
	struct ct_projector g;
	const double mid[3] = {(NX - 1) / 2.0, NY - 1, (NZ - 1) * 1.5};
	const double out[3] = {cos(turn) * cos(tilt), sin(turn) * cos(tilt), sin(tilt)};
	const double u[3] = {-sin(turn), cos(turn), 0};
	double worst = 0, most = 0;
	size_t lit = 0;

	must(ct_vol_alloc(&v, (const size_t[]){NX, NY, NZ}, &err) ||
		ct_stack_alloc(&s, 1, H, W, &err));
	for (int a = 0; a < 3; a++)
		v.affine[a][a] = a + 1;
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = (float)(1 + ct_rng_uniform(1, 1, i));
	s.beam = beam;
	for (int a = 0; a < 3; a++) {
		int b = (a + 1) % 3, c = (a + 2) % 3;

		s.view[0].source[a] = mid[a] + 60 * out[a];
		s.view[0].centre[a] = mid[a] - 20 * out[a];
		s.view[0].u[a] = 0.5 * u[a];
		s.view[0].v[a] = 0.8 * (out[b] * u[c] - out[c] * u[b]);
	}
	must(ct_projector_init(&g, &v, &s, &err));
	g.method = CT_JOSEPH;
	ct_projector_load(&g, v.data, NULL);
	ct_project(&g, 0, 1, s.data, NULL);
	for (size_t i = 0; i < H * W; i++) {
		double want = by_hand(&v, s.view, i / W, i % W, beam == CT_CONE);

		worst = fmax(worst, fabs((double)s.data[i] - want));
		most = fmax(most, want);
		lit += want > 0;
	}
	if (!OK(worst < 2e-5 * most && lit > 100 && lit < H * W,
		    "%s from %.3g, %.3g: %zu of %d rays", CT_WORD(CT_BEAM_LIST, beam), turn, tilt,
		    lit, H * W))
		printf("# %g of %g off\n", worst, most);
	ct_vol_free(&v);
	ct_stack_free(&s);
}

static void window(void)
{
	static const float hu[] = {-2000, -1024, -1023.5f, 0, 3070.5f, 3071, 9000};
	const double limits[2] = {-1024, 3071};
	float density[7], back[7];
	double worst = 0;

	ct_window_density(7, density, hu, limits);
	for (int i = 0; i < 7; i++)
		worst = fmax(worst,
			fabs((double)density[i] - fmin(1, fmax(0, ((double)hu[i] + 1024) / 4095))));
	NEAR(worst, 0, 1e-7, "a window is clipped at both ends");
	OK(density[2] > 0 && density[4] < 1, "and at no other place");
	ct_window_hu(7, back, density, limits);
	OK(fabsf(back[3]) < 1e-3f && back[0] == -1024 && back[6] == 3071, "and back");
}

static void t_by_hand(void)
{
	for (int k = 0; k < 12; k++) {
		rays(CT_PARALLEL, 0.6 * k, 0.04 * k);
		rays(CT_CONE, 0.55 * k + 0.1, 0.1 - 0.03 * k);
	}
	rays(CT_PARALLEL, 0, 0);
	rays(CT_PARALLEL, 1.7, 1.3);
	rays(CT_CONE, 2.9, -1.4);
	window();
}

int main(void)
{
	t_same();
	t_extremes();
	t_empty();
	t_axis();
	t_room();
	t_behind();
	t_joseph();
	t_order();
	t_by_hand();
	return tap_done();
}
