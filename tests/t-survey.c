/* What a file holds in a few numbers: ranges, scans found again from their vectors, Gaussians.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "xray/geometry.h"
#include "report/report.h"
#include "tap.h"

#include <stdlib.h>
#include <string.h>

static void test_range(void)
{
	static const float x[] = {1e7f + 1, NAN, 1e7f + 3, INFINITY, -INFINITY, 1e7f + 5},
			   bad[] = {NAN, INFINITY};
	struct ct_survey_range r;

	ct_survey_range_of(&r, 6, x);
	OK(r.nan == 1 && r.inf == 2, "NaN and infinity are counted apart");
	OK(r.min == 1e7 + 1 && r.max == 1e7 + 5 && r.mean == 1e7 + 3, "range and mean");
	NEAR(r.sd, sqrt(8.0 / 3), 1e-12, "deviation, far from 0");
	ct_survey_range_of(&r, 2, bad);
	OK(isnan(r.min) && isnan(r.max) && isnan(r.mean) && isnan(r.sd), "nothing finite");
	ct_survey_range_of(&r, 0, NULL);
	OK(isnan(r.mean), "nothing at all");
}

static void fill(struct ct_stack *s, const struct ct_geometry *scan)
{
	struct ct_err e = {0};

	if (ct_geometry_fill(s, scan, &e)) {
		printf("# %s\n", e.msg);
		exit(99);
	}
}

static void test_scan(enum ct_beam beam, double arc, size_t views)
{
	const struct ct_geometry scan = {.beam = beam,
		.views = views,
		.arc = arc,
		.start = 20,
		.dso = 700,
		.dsd = 1100,
		.w = 64,
		.h = beam == CT_FAN ? 1 : 48,
		.pitch = {0.5, 0.75},
		.offset = {3, beam == CT_FAN ? 0 : -2},
		.iso = {10, -20, 30}};
	struct ct_stack s = {0};
	struct ct_survey g;
	double far = 0;

	fill(&s, &scan);
	ct_survey_of(&g, &s);
	NEAR(g.pitch[0] + g.pitch[1], 1.25, 1e-12, CT_WORD(CT_BEAM_LIST, beam));
	NEAR(g.size[0], 32, 1e-12, "detector width");
	NEAR(g.angle[0], 20, 1e-12, "first angle");
	NEAR(g.step * (double)views, arc, 1e-9, "arc");
	NEAR(fmax(fabs(g.dsd[0] - 1100), fabs(g.dsd[1] - 1100)), 0, 1e-9, "source to detector");
	if (beam != CT_PARALLEL) {
		OK(g.has_iso, "an isocentre");
		for (int a = 0; a < 3; a++)
			far = fmax(far, fabs(g.iso[a] - scan.iso[a]));
		NEAR(far, 0, 1e-8, "where it is");
		NEAR(g.miss, 0, 1e-4, "all principal rays meet it");
		NEAR(fmax(fabs(g.dso[0] - 700), fabs(g.dso[1] - 700)), 0, 1e-8,
			"source to isocentre");
		NEAR(fabs(g.offset[0][0] - 3) + fabs(g.offset[0][1] - 3), 0, 1e-9,
			"offset along u");
		NEAR(fabs(g.offset[1][0] - scan.offset[1]), 0, 1e-9, "offset along v");
		s.view[0].source[2] += 5; /* one ray off: no longer all through one point */
		s.view[0].centre[2] += 5;
		ct_survey_of(&g, &s);
		OK(g.miss > 3 && g.miss < 5, "a displaced view shows");
	} else
		OK(!g.has_iso, "parallel rays have no isocentre");
	s.views = 1;
	ct_survey_of(&g, &s);
	OK(!g.has_iso && g.step == 0, "nor has one view");
	ct_stack_free(&s);
}

/* x of a frame that is turned about every axis. */
static void turn(double x[3])
{
	static const double r[3][3] = {{0.36, 0.48, -0.8}, {-0.8, 0.6, 0}, {0.48, 0.64, 0.6}};
	const double old[3] = {x[0], x[1], x[2]};

	for (int a = 0; a < 3; a++)
		x[a] = r[a][0] * old[0] + r[a][1] * old[1] + r[a][2] * old[2];
}

/* A scan in any frame is the same scan. */
static void test_turned(void)
{
	const struct ct_geometry scan = {.beam = CT_CONE,
		.views = 33,
		.arc = 200,
		.dso = 700,
		.dsd = 1100,
		.w = 64,
		.h = 48,
		.pitch = {0.5, 0.75},
		.offset = {3, -2},
		.iso = {10, -20, 30}};
	double iso[3] = {10, -20, 30}, far = 0;
	struct ct_stack s = {0};
	struct ct_survey g;

	fill(&s, &scan);
	for (size_t k = 0; k < s.views; k++) {
		turn(s.view[k].source);
		turn(s.view[k].centre);
		turn(s.view[k].u);
		turn(s.view[k].v);
	}
	turn(iso);
	ct_survey_of(&g, &s);
	OK(g.has_iso, "an isocentre in any frame");
	for (int a = 0; a < 3; a++)
		far = fmax(far, fabs(g.iso[a] - iso[a]));
	NEAR(far, 0, 1e-8, "where it is");
	NEAR(fmax(fabs(g.dso[0] - 700), fabs(g.dso[1] - 700)), 0, 1e-8, "source to isocentre");
	NEAR(fmax(fabs(g.dsd[0] - 1100), fabs(g.dsd[1] - 1100)), 0, 1e-8, "source to detector");
	NEAR(fmax(fabs(g.offset[0][0] - 3), fabs(g.offset[1][1] + 2)), 0, 1e-8, "offsets");
	for (size_t k = 0; k < s.views; k++)
		for (int a = 0; a < 3; a++)
			s.view[k].u[a] = -s.view[k].u[a];
	ct_survey_of(&g, &s);
	NEAR(g.dsd[0], 1100, 1e-8, "seen from behind, too");
	ct_stack_free(&s);
}

static void test_orientation(void)
{
	static const int order[6][3] = {
		{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
	static const char letters[3][3] = {"LR", "PA", "IS"};
	size_t bad = 0;
	char code[4];

	for (int p = 0; p < 6; p++)
		for (int signs = 0; signs < 8; signs++) {
			double m[3][4] = {{0}};

			for (int j = 0; j < 3; j++)
				for (int a = 0; a < 3; a++)
					m[a][j] = a == order[p][j] ? signs >> j & 1 ? 2 : -2 : 0.3;
			ct_survey_orientation(code, m);
			for (int j = 0; j < 3; j++)
				bad += code[j] != letters[order[p][j]][signs >> j & 1];
		}
	OK(bad == 0, "48 orientations have their letters");
	ct_survey_orientation(code, (const double[3][4]){{1, 1, 0}, {0, 0.5, 0}, {0, 0, 1}});
	OK(strcmp(code, "R?S") == 0, "two columns that share an axis");
}

static void test_gauss(void)
{
	struct ct_gauss g = {.activation = CT_PRELU, .gamma = 0.1};
	struct ct_survey_gauss r;
	struct ct_err e;

	if (ct_gauss_reserve(&g, 4, &e))
		exit(99);
	for (g.n = 0; g.n < 4; g.n++) {
		for (int a = 0; a < 3; a++) {
			g.pos[a][g.n] = (float)g.n * (a == 1 ? -1.0f : 1.0f);
			g.scale[a][g.n] = logf(a == 0 ? 0.5f : 2.0f);
		}
		for (int a = 0; a < 4; a++)
			g.rot[a][g.n] = 1;
		g.raw[g.n] = (float)g.n - 1;
	}
	ct_survey_gauss_of(&r, &g);
	OK(r.positive == 2 && r.negative == 1 && r.bad == 0, "signs");
	OK(r.raw[0] == -1 && r.raw[1] == 2 && r.lo[1] == -3 && r.hi[0] == 3, "ranges");
	NEAR(r.sigma[0], 0.5, 1e-6, "least deviation");
	NEAR(r.sigma[1], 2, 1e-6, "largest");
	NEAR(r.mean_sigma, cbrt(2), 1e-6, "geometric mean");
	g.activation = CT_SOFTPLUS;
	g.rot[2][3] = NAN;
	ct_survey_gauss_of(&r, &g);
	OK(r.positive == 3 && r.negative == 0 && r.bad == 1 && r.hi[0] == 2,
		"softplus is positive, NaN is set apart");
	for (int a = 0; a < 3; a++) {
		float *const x[] = {&g.pos[a][0], &g.scale[a][1], &g.rot[a + 1][2], &g.raw[a]};

		for (int k = 0; k < 4; k++) {
			const float was = *x[k];

			g.rot[2][3] = 1;
			*x[k] = NAN;
			ct_survey_gauss_of(&r, &g);
			OK(r.bad == 1, "NaN %d along axis %d", k, a);
			*x[k] = was;
		}
	}
	g.n = 0;
	ct_survey_gauss_of(&r, &g);
	OK(isnan(r.mean_sigma) && isnan(r.lo[0]), "an empty set");
	g.n = 4;
	ct_gauss_free(&g);
}

int main(void)
{
	test_range();
	test_scan(CT_CONE, 360, 90);
	test_scan(CT_CONE, 180, 100);
	test_scan(CT_FAN, 200, 40);
	test_scan(CT_PARALLEL, 180, 10);
	test_turned();
	test_orientation();
	test_gauss();
	return tap_done();
}
