/* t-project.c: scans, the Siddon projector and its adjoint, against sums done another way.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "xray/phantom.h"
#include "xray/project.h"
#include "xray/geometry.h"
#include "numbers.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* A grid about the origin, its voxels random. */
static struct ct_vol grid(size_t a, size_t b, size_t c, double x, double y, double z)
{
	const size_t n[3] = {a, b, c};
	const double mm[3] = {x, y, z};
	struct ct_vol v = {0};

	must(ct_vol_alloc(&v, n, &err));
	for (int i = 0; i < 3; i++) {
		v.affine[i][i] = mm[i];
		v.affine[i][3] = -mm[i] * ((double)n[i] - 1) / 2;
	}
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = (float)ct_rng_uniform(1, 2, i);
	return v;
}

static void constant(struct ct_vol *v, float x)
{
	for (size_t i = 0; i < ct_vol_count(v); i++)
		v->data[i] = x;
}

static struct ct_stack fill(const struct ct_geometry *scan)
{
	struct ct_stack s = {0};

	must(ct_geometry_fill(&s, scan, &err));
	return s;
}

/* Views of a grid: `edge` detector pixels of `pitch` mm. */
static struct ct_geometry scan_of(
	enum ct_beam beam, const struct ct_vol *v, size_t views, size_t edge, double pitch)
{
	struct ct_geometry s;

	ct_geometry_default(&s, beam, v);
	s.views = views;
	s.w = edge;
	s.h = beam == CT_FAN ? 1 : edge;
	s.pitch[0] = s.pitch[1] = pitch;
	return s;
}

static void project(struct ct_stack *s, const struct ct_vol *v, struct ct_par *par)
{
	struct ct_projector g;

	must(ct_projector_init(&g, v, s, &err));
	ct_projector_load(&g, v->data, par);
	ct_project(&g, 0, s->views, s->data, par);
}

static double largest(const struct ct_stack *a, const struct ct_stack *b, double scale)
{
	double worst = 0, most = 0;

	for (size_t i = 0; i < ct_stack_count(a); i++) {
		worst = fmax(worst, fabs((double)a->data[i] * scale - (double)b->data[i]));
		most = fmax(most, fabs((double)b->data[i]));
	}
	return worst / most;
}

static int by_value(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;

	return (x > y) - (x < y);
}

/* All crossings of a ray with all planes, sorted; the voxel of each piece from its middle. */
static double sum_by_sorting(
	const struct ct_vol *v, const double o[3], const double d[3], double t0)
{
	double t[512], sum = 0, len = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), oi[3], di[3];
	size_t n = 0;

	for (int a = 0; a < 3; a++) { /* orthogonal axes: the inverse is the scaled transpose */
		double mm = 0;

		oi[a] = di[a] = 0;
		for (int r = 0; r < 3; r++) {
			mm += v->affine[r][a] * v->affine[r][a];
			oi[a] += v->affine[r][a] * (o[r] - v->affine[r][3]);
			di[a] += v->affine[r][a] * d[r];
		}
		oi[a] = oi[a] / mm + 0.5;
		di[a] /= mm;
		for (size_t k = 0; k <= v->n[a]; k++)
			if (di[a] != 0 && ((double)k - oi[a]) / di[a] > t0)
				t[n++] = ((double)k - oi[a]) / di[a];
	}
	qsort(t, n, sizeof *t, by_value);
	for (size_t i = 0; i + 1 < n; i++) {
		double mid = (t[i] + t[i + 1]) / 2;
		size_t at[3];
		bool in = true;

		for (int a = 0; a < 3; a++) {
			double x = floor(oi[a] + mid * di[a]);

			in = in && x >= 0 && x < (double)v->n[a];
			at[a] = in ? (size_t)x : 0;
		}
		if (in)
			sum += (t[i + 1] - t[i]) * len *
			       (double)v->data[(at[2] * v->n[1] + at[1]) * v->n[0] + at[0]];
	}
	return sum;
}

/* Turn a grid, and what is in it, by the unit quaternion (w,x,y,z). */
static void turn(struct ct_vol *v, double w, double x, double y, double z)
{
	const double r[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
		{2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
		{2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
	double m[3][4] = {{0}};

	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 4; j++)
			for (int k = 0; k < 3; k++)
				m[i][j] += r[i][k] * v->affine[k][j];
	memcpy(v->affine, m, sizeof m);
}

static void t_rays(void)
{
	static const char *const names[] = {"cone", "parallel", "fan"};
	struct ct_vol v = grid(37, 50, 23, 1.5, 0.8, 2.2);
	double worst[3] = {0};

	turn(&v, 0.8, 0.36, -0.48, 0);
	for (int b = 0; b < 3; b++) {
		struct ct_geometry scan = scan_of((enum ct_beam)b, &v, 7, 33, 2.1);
		struct ct_stack s;
		char name[80];
		double most = 0;

		scan.arc = 360;
		scan.offset[0] = 3.3;
		scan.offset[1] = -2.2;
		s = fill(&scan);
		project(&s, &v, NULL);
		for (size_t i = 0; i < ct_stack_count(&s); i++) {
			double o[3], d[3], want;

			ct_view_ray(&s, i / s.w / s.h, i / s.w % s.h, i % s.w, o, d);
			want = sum_by_sorting(&v, o, d, b == CT_PARALLEL ? -HUGE_VAL : 0);
			worst[b] = fmax(worst[b], fabs((double)s.data[i] - want));
			most = fmax(most, want);
		}
		snprintf(name, sizeof name, "%s: as sorting all crossings, turned grid", names[b]);
		NEAR(worst[b] / most, 0, 1e-6, name);
		OK(most > 10, "%s: rays meet the volume", names[b]);
		ct_stack_free(&s);
	}
	ct_vol_free(&v);
}

static void t_axis_aligned(void)
{
	struct ct_vol v = grid(8, 8, 6, 2, 2, 2);
	struct ct_geometry scan = scan_of(CT_PARALLEL, &v, 4, 8, 2);
	struct ct_stack s;
	double worst = 0;

	scan.arc = 360;
	scan.h = 6;
	s = fill(&scan);
	project(&s, &v, NULL);
	for (size_t q = 0; q < 4; q++)
		for (size_t row = 0; row < 6; row++)
			for (size_t col = 0; col < 8; col++) {
				double want = 0;

				for (size_t k = 0; k < 8; k++) { /* u = +y, -x, -y, +x */
					const size_t x[4] = {k, 7 - col, k, col},
						     y[4] = {col, k, 7 - col, k};

					want += 2 *
						(double)v.data[((5 - row) * 8 + y[q]) * 8 + x[q]];
				}
				worst = fmax(worst,
					fabs(want - (double)ct_stack_view(&s, q)[row * 8 + col]) /
						want);
			}
	NEAR(worst, 0, 1.2e-7,
		"rays along axes, four quarter turns: sums of columns to the last bit");
	ct_stack_free(&s);
	ct_vol_free(&v);
}

static void t_exact(void)
{
	struct ct_vol v = grid(4, 4, 4, 0.25, 0.25, 0.25), one = grid(1, 1, 1, 3, 5, 7);
	struct ct_geometry scan = scan_of(CT_CONE, &v, 4, 1, 0.01);
	struct ct_stack s;

	constant(&v, 1);
	constant(&one, 2);
	scan.arc = 360;
	s = fill(&scan);
	project(&s, &v, NULL);
	OK(s.data[0] == 1 && s.data[1] == 1 && s.data[2] == 1 && s.data[3] == 1,
		"middle ray of a unit cube, along the edges of its voxels: 1 exactly");
	ct_stack_free(&s);
	scan.start = 45;
	s = fill(&scan);
	project(&s, &v, NULL);
	NEAR((double)s.data[0], sqrt(2), 1e-7, "and through its edges: sqrt 2");
	ct_stack_free(&s);
	scan = scan_of(CT_PARALLEL, &one, 2, 1, 1);
	s = fill(&scan);
	project(&s, &one, NULL);
	OK(s.data[0] == 6 && s.data[1] == 10, "one voxel");
	ct_stack_free(&s);
	ct_vol_free(&v);
	ct_vol_free(&one);
}

/* A face ray takes the mean of its sides, outside being zero. */
static void t_faces(void)
{
	struct ct_vol v = grid(4, 4, 4, 1, 1, 1);
	struct ct_geometry scan = scan_of(CT_PARALLEL, &v, 1, 5, 1);
	struct ct_stack s = fill(&scan);
	double worst = 0;

	project(&s, &v, NULL);
	for (size_t row = 0; row < 5; row++)
		for (size_t col = 0; col < 5; col++) { /* on the lattice edges; u = +y, v = -z */
			double want = 0;

			for (size_t k = 0; k < 4; k++)
				for (size_t m = 0; m < 4; m++) {
					size_t y = col + m % 2 - 1, z = 4 - row + m / 2 - 1;

					if (y < 4 && z < 4)
						want += 0.25 * (double)v.data[(z * 4 + y) * 4 + k];
				}
			worst = fmax(worst, fabs(want - (double)s.data[row * 5 + col]));
		}
	NEAR(worst, 0, 1e-6, "rays along edges: the mean of four columns");
	ct_stack_free(&s);
	ct_vol_free(&v);
}

/* Every order and direction of the axes of one object. */
static void t_orientations(void)
{
	static const int perm[6][3] = {
		{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
	struct ct_vol v = grid(7, 4, 6, 1, 1.7, 1.2);
	struct ct_geometry scan = scan_of(CT_CONE, &v, 5, 9, 1.3);
	struct ct_stack want = fill(&scan), got = fill(&scan);
	double worst = 0;

	project(&want, &v, NULL);
	for (int c = 0; c < 48; c++) {
		const int *p = perm[c / 8];
		size_t n[3] = {v.n[p[0]], v.n[p[1]], v.n[p[2]]};
		struct ct_vol w = {0};

		must(ct_vol_alloc(&w, n, &err));
		for (int r = 0; r < 3; r++) {
			w.affine[r][3] = v.affine[r][3];
			for (int a = 0; a < 3; a++) {
				double sign = c >> a & 1 ? -1 : 1;

				w.affine[r][a] = sign * v.affine[r][p[a]];
				if (sign < 0)
					w.affine[r][3] += v.affine[r][p[a]] * ((double)n[a] - 1);
			}
		}
		for (size_t i = 0; i < ct_vol_count(&w); i++) {
			size_t at[3] = {i % n[0], i / n[0] % n[1], i / n[0] / n[1]}, from[3];

			for (int a = 0; a < 3; a++)
				from[p[a]] = c >> a & 1 ? n[a] - 1 - at[a] : at[a];
			w.data[i] = v.data[(from[2] * v.n[1] + from[1]) * v.n[0] + from[0]];
		}
		project(&got, &w, NULL);
		worst = fmax(worst, largest(&got, &want, 1));
		ct_vol_free(&w);
	}
	NEAR(worst, 0, 1e-6, "48 orders and directions of the axes: one projection");
	ct_stack_free(&want);
	ct_stack_free(&got);
	ct_vol_free(&v);
}

static void t_invariance(void)
{
	struct ct_vol v = grid(9, 12, 7, 1, 0.7, 1.4);
	struct ct_geometry scan = scan_of(CT_CONE, &v, 6, 16, 1.3), other = scan;
	struct ct_stack a, b;

	a = fill(&scan);
	project(&a, &v, NULL);
	other.start += 360 * 7;
	b = fill(&other);
	project(&b, &v, NULL);
	OK(memcmp(a.data, b.data, ct_stack_count(&a) * sizeof *a.data) == 0,
		"seven turns further: the same bytes");
	ct_stack_free(&b);

	other = scan;
	other.start += 33;
	b = fill(&other);
	turn(&v, cos(33 * M_PI / 360), 0, 0, sin(33 * M_PI / 360));
	project(&b, &v, NULL);
	turn(&v, cos(33 * M_PI / 360), 0, 0, -sin(33 * M_PI / 360));
	NEAR(largest(&b, &a, 1), 0, 2e-6, "scanner and volume turned together");
	ct_stack_free(&b);

	for (int r = 0; r < 3; r++)
		for (int c = 0; c < 4; c++)
			v.affine[r][c] *= 1000;
	other = scan_of(CT_CONE, &v, 6, 16, 1300);
	b = fill(&other);
	project(&b, &v, NULL);
	NEAR(largest(&a, &b, 1000), 0, 1e-6, "all lengths a thousand times larger");
	ct_stack_free(&a);
	ct_stack_free(&b);
	ct_vol_free(&v);
}

static void t_crop(void)
{
	struct ct_vol v = grid(10, 10, 10, 1, 1, 1);
	double worst = 0;

	for (int beam = CT_CONE; beam <= CT_PARALLEL; beam++) {
		struct ct_geometry scan = scan_of((enum ct_beam)beam, &v, 3, 17, 1.1), part = scan;
		struct ct_stack a = fill(&scan), b;

		part.w = 5;
		part.h = 4;
		part.offset[0] = 1.1 * (3 + 2 - 8);   /* columns 3..7 */
		part.offset[1] = 1.1 * (9 + 1.5 - 8); /* rows 9..12 */
		b = fill(&part);
		project(&a, &v, NULL);
		project(&b, &v, NULL);
		for (size_t i = 0; i < ct_stack_count(&b); i++)
			worst = fmax(
				worst, fabs((double)b.data[i] -
					       (double)ct_stack_view(&a,
						       i / 20)[(9 + i / 5 % 4) * 17 + 3 + i % 5]));
		ct_stack_free(&a);
		ct_stack_free(&b);
	}
	NEAR(worst, 0, 1e-5, "a part of the detector sees a part of the picture");
	ct_vol_free(&v);
}

/* Ray by ray and, if the volume's axes allow it, in packets. */
static void check_adjoint(const struct ct_vol *v, const struct ct_stack *s, const char *name)
{
	for (int packets = 0; packets < 2; packets++) {
		struct ct_projector g;
		struct ct_linear a;

		must(ct_projector_init(&g, v, s, &err));
		if (packets)
			must(ct_projector_reserve(&g, &err));
		if (packets && !g.columns)
			return;
		a = ct_project_linear(&g);
		OK(adjoint_error(&a) < 1e-6, "%s, %s: <P x, y> = <x, P' y>", name,
			packets ? "in packets" : "ray by ray");
		ct_projector_free(&g);
	}
}

static void t_adjoint(void)
{
	static const char *const names[] = {"cone", "parallel", "fan"};
	struct ct_vol v = grid(21, 34, 47, 1.1, 0.9, 1);
	struct ct_geometry scan;
	struct ct_stack s;

	for (int b = 0; b < 3; b++) {
		scan = scan_of((enum ct_beam)b, &v, 8, 31, 1.9);
		s = fill(&scan);
		check_adjoint(&v, &s, names[b]);
		ct_stack_free(&s);
	}
	turn(&v, 0.6, 0, 0.64, 0.48);
	scan = scan_of(CT_CONE, &v, 8, 31, 1.9);
	s = fill(&scan);
	for (size_t k = 6; k < 8; k++) /* two views along the axis */
		s.view[k] = (struct ct_view){.source = {5, 0, 300},
			.centre = {0, 0, -99},
			.u = {1.9, 0, 0.1},
			.v = {0, 1.9, 0}};
	check_adjoint(&v, &s, "turned");
	ct_stack_free(&s);
	ct_vol_free(&v);
}

/* The whole matrix, column by column and row by row. */
static void t_transpose(void)
{
	enum { N = 3 * 4 * 17, M = 2 * 5 * 5 };
	struct ct_vol v = grid(3, 4, 17, 1, 1, 0.4);
	struct ct_geometry scan = scan_of(CT_CONE, &v, 2, 5, 2);
	struct ct_stack s = fill(&scan);
	struct ct_projector g;
	float *matrix = malloc(N * M * sizeof *matrix), row[N], pixels[M] = {0};
	double worst = 0, most = 0;

	must(ct_projector_init(&g, &v, &s, &err));
	constant(&v, 0);
	for (size_t i = 0; i < N; i++) {
		v.data[i] = 1;
		ct_projector_load(&g, v.data, NULL);
		ct_project(&g, 0, 2, matrix + i * M, NULL);
		v.data[i] = 0;
	}
	for (size_t j = 0; j < M; j++) {
		memset(row, 0, sizeof row);
		pixels[j] = 1;
		ct_project_adjoint(&g, 0, 2, row, pixels, NULL);
		pixels[j] = 0;
		for (size_t i = 0; i < N; i++) {
			worst = fmax(worst, fabs((double)row[i] - (double)matrix[i * M + j]));
			most = fmax(most, (double)row[i]);
		}
	}
	NEAR(worst, 0, 4e-6, "the adjoint is the transpose, element by element");
	OK(most > 0.4, "of a matrix that is not zero");
	free(matrix);
	ct_stack_free(&s);
	ct_vol_free(&v);
}

static void t_threads(void)
{
	struct ct_vol v = grid(40, 33, 50, 1, 1, 1), a = grid(40, 33, 50, 1, 1, 1),
		      b = grid(40, 33, 50, 1, 1, 1);
	struct ct_geometry scan = scan_of(CT_CONE, &v, 5, 29, 2.2);
	struct ct_stack s = fill(&scan), q = fill(&scan);
	struct ct_projector g;
	struct ct_par *par;

	must(ct_par_alloc(&par, 4, &err));
	project(&s, &v, NULL);
	project(&q, &v, par);
	OK(memcmp(s.data, q.data, ct_stack_count(&s) * sizeof *s.data) == 0,
		"projection: four threads, the same bytes");
	must(ct_projector_init(&g, &v, &s, &err));
	ct_project_adjoint(&g, 0, 5, a.data, s.data, NULL);
	ct_project_adjoint(&g, 0, 5, b.data, s.data, par);
	OK(memcmp(a.data, b.data, ct_vol_count(&a) * sizeof *a.data) == 0,
		"adjoint: four threads, the same bytes");
	OK(memcmp(a.data, v.data, ct_vol_count(&a) * sizeof *a.data) != 0,
		"which are not its input");
	ct_par_free(par);
	ct_stack_free(&s);
	ct_stack_free(&q);
	ct_vol_free(&v);
	ct_vol_free(&a);
	ct_vol_free(&b);
}

static void t_mass(void)
{
	struct ct_vol v = grid(24, 20, 16, 1.3, 1.1, 0.9);
	double mass = 0, least = HUGE_VAL, most = 0;
	struct ct_geometry scan = scan_of(CT_PARALLEL, &v, 12, 150, 0.3);
	struct ct_stack s = fill(&scan);

	for (size_t i = 0; i < ct_vol_count(&v); i++)
		mass += (double)v.data[i] * 1.3 * 1.1 * 0.9;
	project(&s, &v, NULL);
	for (size_t k = 0; k < s.views; k++) {
		double sum = 0;

		for (size_t i = 0; i < s.w * s.h; i++)
			sum += (double)ct_stack_view(&s, k)[i] * 0.09;
		least = fmin(least, sum / mass);
		most = fmax(most, sum / mass);
	}
	NEAR(least, 1, 0.015, "parallel: every view has the mass of the volume (least)");
	NEAR(most, 1, 0.015, "parallel: every view has the mass of the volume (most)");
	ct_stack_free(&s);
	ct_vol_free(&v);
}

/* Largest deviation from the closed form, relative to its norm, of a phantom in n^3 voxels. */
static double deviation(enum ct_beam beam, enum ct_phantom kind, size_t n)
{
	struct ct_vol v = grid(n, n, n, 128.0 / (double)n, 128.0 / (double)n, 128.0 / (double)n);
	const double extent[3] = {128, 128, 128};
	struct ct_shape shape[CT_PH_MAX_SHAPES];
	size_t shapes = ct_phantom_make(kind, extent, 0.5, 3, shape);
	struct ct_geometry scan = scan_of(beam, &v, 5, 50, 4.1);
	struct ct_stack a = fill(&scan), b = fill(&scan);
	double sum = 0, norm = 0;

	ct_phantom_voxels(&v, shapes, shape, 4, NULL);
	ct_phantom_project(&b, 0, b.views, b.data, shapes, shape, NULL);
	project(&a, &v, NULL);
	for (size_t i = 0; i < ct_stack_count(&a); i++) {
		double d = (double)a.data[i] - (double)b.data[i];

		sum += d * d;
		norm += (double)b.data[i] * (double)b.data[i];
	}
	ct_stack_free(&a);
	ct_stack_free(&b);
	ct_vol_free(&v);
	return sqrt(sum / norm);
}

static void t_closed_form(void)
{
	static const enum ct_phantom kinds[] = {CT_PH_SPHERE, CT_PH_CYLINDER, CT_PH_MARKS,
		CT_PH_SHEPP_LOGAN, CT_PH_ELLIPSOIDS, CT_PH_SHELLS};
	static const char *const names[] = {
		"sphere", "cylinder", "marks", "head", "chest", "shells"};
	/* smooth shapes: error as the voxel; flat faces along rays: as its root */
	static const double limit[] = {0.04, 0.09, 0.22, 0.09, 0.03, 0.09},
			    ratio[] = {0.3, 0.4, 0.6, 0.4, 0.3, 0.4};

	for (int beam = CT_CONE; beam <= CT_PARALLEL; beam++)
		for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
			double e0 = deviation((enum ct_beam)beam, kinds[k], 16);
			double e1 = deviation((enum ct_beam)beam, kinds[k], 64);

			OK(e1 < ratio[k] * e0 && e1 < limit[k],
				"%s, %s: nears the closed form as voxels shrink (%.4f, %.4f)",
				names[k], beam == CT_CONE ? "cone" : "parallel", e0, e1);
		}
	NEAR(deviation(CT_CONE, CT_PH_CUBE, 8), 0, 1e-6, "a cube on voxel faces is exact (cone)");
	NEAR(deviation(CT_PARALLEL, CT_PH_CONSTANT, 8), 0, 1e-6, "and the whole grid (parallel)");
}

static void t_phantoms(void)
{
	const double extent[3] = {64, 64, 64};
	struct ct_shape shape[CT_PH_MAX_SHAPES], again[CT_PH_MAX_SHAPES];
	struct ct_vol v = grid(64, 64, 64, 1, 1, 1);
	double sum = 0;
	size_t n = 0;
	bool in = true;

	for (uint64_t seed = 0; seed < 12; seed++) {
		n = ct_phantom_make(CT_PH_ELLIPSOIDS, extent, 1, seed, shape);
		ct_phantom_voxels(&v, n, shape, 1, NULL);
		for (size_t i = 0; i < ct_vol_count(&v); i++)
			in = in && v.data[i] >= 0 && v.data[i] <= 1;
	}
	OK(in && n <= CT_PH_MAX_SHAPES, "chests of twelve seeds: density within [0, 1]");
	in = true;
	for (uint64_t seed = 0; seed < 12; seed++) {
		n = ct_phantom_make(CT_PH_SHELLS, extent, 1, seed, shape);
		ct_phantom_voxels(&v, n, shape, 1, NULL);
		for (size_t i = 0; i < ct_vol_count(&v); i++)
			in = in && v.data[i] > -1e-6F && v.data[i] < 1.000001F;
	}
	OK(in && n == 40, "and shells of twelve seeds");
	n = ct_phantom_make(CT_PH_ELLIPSOIDS, extent, 1, 0, shape);
	OK(ct_phantom_make(CT_PH_ELLIPSOIDS, extent, 1, 0, again) == n &&
			memcmp(shape, again, n * sizeof *shape) == 0,
		"a seed gives one chest");
	ct_phantom_make(CT_PH_ELLIPSOIDS, extent, 1, 1, again);
	OK(memcmp(shape, again, n * sizeof *shape) != 0, "another seed another");
	n = ct_phantom_make(CT_PH_SHEPP_LOGAN, extent, 1, 0, shape);
	ct_phantom_voxels(&v, n, shape, 1, NULL);
	in = true;
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		in = in && v.data[i] > -1e-6F && v.data[i] < 1.000001F;
	OK(in, "the head too");
	n = ct_phantom_make(CT_PH_CONSTANT, extent, 0.5, 0, shape);
	ct_phantom_voxels(&v, n, shape, 2, NULL);
	OK(v.data[0] == 0.5F && v.data[64 * 64 * 64 - 1] == 0.5F, "constant fills the grid");
	n = ct_phantom_make(CT_PH_SPHERE, extent, 1, 0, shape);
	ct_phantom_voxels(&v, n, shape, 4, NULL);
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		sum += (double)v.data[i];
	NEAR(sum / (4.0 / 3 * M_PI * 16 * 16 * 16), 1, 1e-3, "volume of a ball");
	ct_vol_free(&v);
}

static void t_refused(void)
{
	struct ct_vol v = grid(10, 10, 10, 1, 1, 1);
	struct ct_geometry scan = scan_of(CT_CONE, &v, 4, 4, 1);
	struct ct_projector g;
	struct ct_stack s;

	scan.dso = 8.6; /* the sphere has radius 8.66 */
	s = fill(&scan);
	OK(ct_projector_init(&g, &v, &s, &err) == -1 && err.code == CT_EGEOM &&
			strstr(err.msg, "8.6") && strstr(err.msg, "8.66"),
		"a source within the volume's sphere is refused: %s", err.msg);
	ct_stack_free(&s);
	scan.dso = 8.7;
	s = fill(&scan);
	OK(ct_projector_init(&g, &v, &s, &err) == 0, "and just outside it is not");
	ct_stack_free(&s);
	scan.dsd = -1;
	OK(ct_geometry_fill(&s, &scan, &err) == -1 && err.code == CT_EGEOM, "negative distance");
	scan = scan_of(CT_FAN, &v, 4, 4, 1);
	scan.h = 2;
	OK(ct_geometry_fill(&s, &scan, &err) == -1 && err.code == CT_EGEOM, "fan of two rows");
	ct_vol_free(&v);
}

int main(void)
{
	t_rays();
	t_axis_aligned();
	t_exact();
	t_faces();
	t_orientations();
	t_invariance();
	t_crop();
	t_adjoint();
	t_transpose();
	t_threads();
	t_mass();
	t_closed_form();
	t_phantoms();
	t_refused();
	return tap_done();
}
