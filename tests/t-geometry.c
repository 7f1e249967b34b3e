/* t-geometry.c: the scans that are made and which pixels see what, by the formulas of geometry.h in
 * double: vectors of views, defaults, what is no scan, sources within the volume, shadows.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "xray/geometry.h"
#include "tap.h"

#include <stdbool.h>
#include <string.h>

static uint64_t drawn;

static double uniform(double lo, double hi)
{
	return lo + (hi - lo) * ct_rng_uniform(4, 6, drawn++);
}

/* Voxels of 2 x 1 x 3 mm, 30 x 20 x 8, about (5, -7, 11): 60 x 20 x 24 mm. */
static struct ct_vol grid(void)
{
	struct ct_vol v = {0};

	must(ct_vol_alloc(&v, (const size_t[]){30, 20, 8}, &err));
	for (int a = 0; a < 3; a++) {
		v.affine[a][a] = a == 0 ? 2 : a == 1 ? 1 : 3;
		v.affine[a][3] = (a == 0          ? 5
					 : a == 1 ? -7
						  : 11) -
				 v.affine[a][a] * ((double)v.n[a] - 1) / 2;
	}
	return v;
}

/* Every vector of every view; angles of whole quarters are exact. */
static void t_views(void)
{
	for (int beam = CT_CONE; beam <= CT_FAN; beam++) {
		struct ct_geometry scan = {.beam = (enum ct_beam)beam,
			.views = 24,
			.arc = -360,
			.start = 405,
			.dso = 310,
			.dsd = 520,
			.w = 7,
			.h = beam == CT_FAN ? 1 : 4,
			.pitch = {1.5, 2.5},
			.offset = {3.5, -4.5},
			.iso = {5, -7, 11}};
		struct ct_stack s = {0};
		double worst = 0, exact = 0;

		must(ct_geometry_fill(&s, &scan, &err));
		for (size_t k = 0; k < 24; k++) {
			const struct ct_view *v = &s.view[k];
			double a = (405 - 15 * (double)k) * M_PI / 180;
			const double out[3] = {cos(a), sin(a)}, u[3] = {-sin(a), cos(a)};
			const double down[3] = {0, 0, -1};

			worst = fmax(worst, fabs(v->angle - 405 + 15 * (double)k));
			for (int r = 0; r < 3; r++) {
				double shift = 3.5 * u[r] - 4.5 * down[r],
				       at = scan.iso[r] + 310 * out[r];

				at += beam == CT_PARALLEL ? shift : 0;
				worst = fmax(worst, fabs(v->source[r] - at));
				at = scan.iso[r] - 210 * out[r] + shift;
				worst = fmax(worst, fabs(v->centre[r] - at));
				worst = fmax(worst, fabs(v->u[r] - 1.5 * u[r]));
				worst = fmax(worst, fabs(v->v[r] - 2.5 * down[r]));
			}
			if (k % 6 == 3) /* at 360, 270, 180, 90 degrees */
				exact += fabs(v->u[k % 12 == 3 ? 0 : 1]) +
					 fabs(fabs(v->u[k % 12 == 3 ? 1 : 0]) - 1.5);
		}
		NEAR(worst, 0, 1e-11, CT_WORD(CT_BEAM_LIST, beam));
		OK(exact == 0, "quarter turns are exact");
		ct_stack_free(&s);
	}
}

static void number_is(const struct ct_stack *s, const char *key, const char *want)
{
	const char *text = ct_meta_get(&s->meta, key);

	OK(text && strcmp(text, want) == 0, "%s %s", key, text ? text : "is missing");
}

static void t_defaults(void)
{
	struct ct_vol v = grid();
	struct ct_stack s = {0};
	struct ct_geometry scan;

	ct_geometry_default(&scan, CT_CONE, &v);
	OK(scan.views == 100 && scan.w == 30 && scan.h == 30, "a square detector");
	OK(scan.dso == 234.375 && scan.dsd == 351.5625 && scan.arc == 180, "scaled to 60 mm");
	OK(scan.pitch[0] == 4 && scan.pitch[1] == 4, "twice as wide");
	OK(scan.iso[0] == 5 && scan.iso[1] == -7 && scan.iso[2] == 11, "about the centre");
	must(ct_geometry_fill(&s, &scan, &err));
	number_is(&s, CT_META_SCAN_DSO, "234.375");
	number_is(&s, CT_META_SCAN_DSD, "351.5625");
	number_is(&s, CT_META_SCAN_ARC, "180");
	number_is(&s, CT_META_SCAN_START, "0");
	number_is(&s, CT_META_SCAN_ISO, "5,-7,11");
	ct_stack_free(&s);
	ct_geometry_default(&scan, CT_FAN, &v);
	OK(scan.h == 1 && scan.w == 30 && scan.pitch[0] == 4, "a fan has one row");
	ct_geometry_default(&scan, CT_PARALLEL, &v);
	NEAR(scan.pitch[0] * 30, hypot(60, 20), 1e-9, "parallel: as wide as the shadow");
	ct_geometry_paper(&scan, CT_CONE, &v);
	OK(scan.dso == 1000 && scan.dsd == 1500 && fabs(scan.pitch[0] * 30 - 512) < 1e-9,
		"the paper's");
	v.n[0] = v.n[1] = v.n[2] = 1;
	v.affine[2][2] = 0.1;
	v.affine[0][0] = v.affine[1][1] = 0.3;
	ct_geometry_default(&scan, CT_PARALLEL, &v);
	OK(scan.w == 1 && fabs(scan.pitch[0] - 0.3 * sqrt(2)) < 1e-12, "one small voxel");
	v.n[0] = v.n[1] = v.n[2] = 8;
	v.affine[2][2] = 30; /* tall: 240 mm */
	ct_geometry_default(&scan, CT_PARALLEL, &v);
	NEAR(scan.pitch[1] * 8, 240, 1e-9, "or as high");
	ct_vol_free(&v);
}

static void refused(const struct ct_geometry *scan, const char *words)
{
	struct ct_stack s = {0};

	OK(ct_geometry_fill(&s, scan, &err) == -1 && err.code == CT_EGEOM && strstr(err.msg, words),
		"refused: %s", err.msg);
	ct_stack_free(&s);
}

static void t_refused(void)
{
	static const char *const names[] = {"source to isocentre", "source to detector",
		"pixel pitch along u", "pixel pitch along v"};
	struct ct_vol v = grid();
	struct ct_geometry good;

	ct_geometry_default(&good, CT_CONE, &v);
	for (int i = 0; i < 4; i++)
		for (int k = 0; k < 4; k++) {
			struct ct_geometry bad = good;
			double *x[4] = {&bad.dso, &bad.dsd, &bad.pitch[0], &bad.pitch[1]};

			*x[i] = k == 0 ? 0 : k == 1 ? -1 : k == 2 ? 1.01e9 : (double)NAN;
			refused(&bad, names[i]);
		}
	for (int i = 0; i < 7; i++) {
		struct ct_geometry bad = good;
		double *x[7] = {&bad.arc, &bad.start, &bad.offset[0], &bad.offset[1], &bad.iso[0],
			&bad.iso[1], &bad.iso[2]};

		*x[i] = i % 2 ? (double)INFINITY : -(double)INFINITY;
		refused(&bad, "scan geometry is not finite");
	}
	for (int i = 0; i < 8; i++) {
		struct ct_geometry bad = good;
		double *x[4] = {&bad.offset[0], &bad.source[0], &bad.offset[1], &bad.source[1]};
		struct ct_stack s = {0};

		*x[i / 2] = (i % 2 ? -1.01e5 : 1.01e5) * bad.dsd;
		refused(&bad, i < 4 ? "mm along u, too far" : "mm along v, too far");
		*x[i / 2] *= 0.98;
		OK(ct_geometry_fill(&s, &bad, &err) == 0, "less far is taken");
		ct_stack_free(&s);
	}
	for (int i = 0; i < 3; i++) {
		struct ct_geometry bad = good;
		struct ct_stack s = {0};

		bad.beam = i == 0 ? CT_CONE : i == 1 ? CT_FAN : CT_PARALLEL;
		bad.h = i == 1 ? 1 : bad.h;
		bad.dsd = bad.dso;
		OK(ct_geometry_fill(&s, &bad, &err) == 0, "a detector on the axis is taken");
		ct_stack_free(&s);
		bad.dsd = nextafter(bad.dso, 0);
		if (i < 2)
			refused(&bad, "the detector would stand before the axis");
		else
			OK(ct_geometry_fill(&s, &bad, &err) == 0,
				"parallel rays have a detector anywhere");
		ct_stack_free(&s);
	}
	good.beam = CT_FAN;
	refused(&good, "one detector row, not 30");
	ct_vol_free(&v);
}

/* Sources on the sphere through the corners of a grid of any shape. */
static void t_inside(void)
{
	struct ct_vol v = grid();
	double radius = sqrt(30 * 30 + 10 * 10 + 12 * 12);

	for (int k = 0; k < 12; k++) {
		double d[3] = {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
		double len = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
		struct ct_stack s = {0};
		struct ct_geometry scan;

		ct_geometry_default(&scan, k % 3 ? CT_CONE : CT_FAN, &v);
		scan.views = 4;
		must(ct_geometry_fill(&s, &scan, &err));
		for (int over = -1; over <= 1; over += 2) {
			const double mid[3] = {5, -7, 11};

			for (int a = 0; a < 3; a++)
				s.view[k % 4].source[a] =
					mid[a] + d[a] / len * radius * (1 + 1e-3 * over);
			OK((ct_geometry_check(&s, &v, &err) == 0) == (over > 0) &&
					(over > 0 || err.code == CT_EGEOM),
				"a source %s", over > 0 ? "just outside" : "just inside");
		}
		s.beam = CT_PARALLEL;
		for (int a = 0; a < 3; a++)
			s.view[k % 4].source[a] = 5;
		OK(ct_geometry_check(&s, &v, &err) == 0, "parallel ones may be anywhere");
		ct_stack_free(&s);
	}
	ct_vol_free(&v);
}

/* Column and row where the ray through x meets the detector, u and v at any angle: two equations
 * for p = alpha u + beta v. */
static void meets(double at[2], const struct ct_stack *s, const double x[3])
{
	const struct ct_view *v = &s->view[0];
	double m[3][4], ray[3];

	for (int r = 0; r < 3; r++) {
		ray[r] = s->beam == CT_PARALLEL ? v->centre[r] - v->source[r] : x[r] - v->source[r];
		m[r][0] = v->u[r];
		m[r][1] = v->v[r];
		m[r][2] = -ray[r];
		m[r][3] = x[r] - v->centre[r];
	}
	for (int c = 0; c < 3; c++) /* elimination; the largest of the rest first */
		for (int r = 0; r < 3; r++) {
			int best = c;

			for (int k = c; k < 3 && r == 0; k++)
				best = fabs(m[k][c]) > fabs(m[best][c]) ? k : best;
			for (int k = 0; k < 4 && r == 0; k++) {
				double t = m[c][k];

				m[c][k] = m[best][k];
				m[best][k] = t;
			}
			if (r != c) {
				double f = m[r][c] / m[c][c];

				for (int k = 0; k < 4; k++)
					m[r][k] -= f * m[c][k];
			}
		}
	at[0] = m[0][3] / m[0][0] + ((double)s->w - 1) / 2;
	at[1] = m[1][3] / m[1][1] + ((double)s->h - 1) / 2;
}

/* Of n pixels those about lo to hi, with one more on each side. */
static void wanted(double n, double lo, double hi, size_t range[2])
{
	range[0] = (size_t)fmin(fmax(floor(lo) - 1, 0), n);
	range[1] = (size_t)fmin(fmax(ceil(hi) + 2, 0), n);
}

/* Detectors of any slant, three points, in view or to a side of it. */
static void t_shadow(void)
{
	size_t right = 0, empty = 0, whole = 0;

	for (int k = 0; k < 400; k++) {
		struct ct_stack s = {0};
		double x[3][3], lo[2] = {1e9, 1e9}, hi[2] = {-1e9, -1e9};
		size_t row[2], col[2], want[2][2];

		must(ct_stack_alloc(&s, 1, 30, 40, &err));
		s.beam = k % 2 ? CT_CONE : CT_PARALLEL;
		s.view[0] = (struct ct_view){.source = {500, uniform(-50, 50), uniform(-50, 50)},
			.centre = {-300, uniform(-50, 50), uniform(-50, 50)},
			.u = {uniform(-0.5, 0.5), 2, uniform(-0.5, 0.5)},
			.v = {uniform(-0.5, 0.5), uniform(-0.8, 0.8), 1.5}};
		for (int i = 0; i < 3; i++) {
			double at[2];

			for (int r = 0; r < 3; r++)
				x[i][r] = (k % 7 == r ? 60 : 0) + uniform(-9, 9);
			meets(at, &s, x[i]);
			for (int a = 0; a < 2; a++) {
				lo[a] = fmin(lo[a], at[a]);
				hi[a] = fmax(hi[a], at[a]);
			}
		}
		wanted(40, lo[0], hi[0], want[0]);
		wanted(30, lo[1], hi[1], want[1]);
		ct_view_shadow(&s, 0, 3, (const double(*)[3])x, row, col);
		right += !memcmp(col, want[0], sizeof col) && !memcmp(row, want[1], sizeof row);
		empty += row[0] == row[1] || col[0] == col[1];
		x[k % 3][0] = k % 2 ? 700 : 400; /* behind the source */
		ct_view_shadow(&s, 0, 3, (const double(*)[3])x, row, col);
		whole += k % 2 && row[0] == 0 && row[1] == 30 && col[0] == 0 && col[1] == 40;
		ct_stack_free(&s);
	}
	OK(right == 400 && empty > 50 && empty < 350, "shadows: %zu of 400 right, %zu empty", right,
		empty);
	OK(whole == 200, "of a point behind the source: everywhere (%zu of 200)", whole);
}

/* A third of the views must see the volume. */
static void t_seen(void)
{
	struct ct_vol v = grid();
	struct ct_geometry scan;

	ct_geometry_default(&scan, CT_CONE, &v);
	scan.views = 12;
	for (size_t see = 3; see < 5; see++) {
		struct ct_stack s = {0};
		struct ct_err e = {0};

		must(ct_geometry_fill(&s, &scan, &err));
		for (size_t k = see; k < s.views; k++)
			for (int a = 0; a < 3; a++)
				s.view[k].centre[a] += 1e4 * s.view[k].u[a];
		OK((ct_geometry_seen(&s, &v, &e) == 0) == (see == 4), "%zu of 12 views see it",
			see);
		OK(see == 4 || (e.code == CT_EGEOM && strstr(e.msg, "3 of 12 views see it")),
			"which is %s", see == 4 ? "enough" : "said");
		ct_stack_free(&s);
	}
	ct_vol_free(&v);
}

int main(void)
{
	t_views();
	t_defaults();
	t_refused();
	t_inside();
	t_shadow();
	t_seen();
	return tap_done();
}
