/* Sharpness: edges of known blur, in any direction, and what is no edge.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "quality/edges.h"
#include "tap.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 48 };

static double step(double d, double sigma)
{
	return -1000 + 550 * (1 + erf(d / sqrt(2.0) / sigma));
}

/* A ball of radius 15 mm if n is NULL, else a plane with that normal; spacing 0.7 mm. */
static void make(struct ct_vol *v, const double *n, double sigma, double noise)
{
	const size_t size[3] = {SIDE, SIDE, SIDE};
	struct ct_err e;

	*v = (struct ct_vol){0};
	if (ct_vol_alloc(v, size, &e))
		exit(1);
	for (int a = 0; a < 3; a++)
		v->affine[a][a] = 0.7;
	for (size_t i = 0; i < ct_vol_count(v); i++) {
		const double p[3] = {(double)(i % SIDE) * 0.7 - 16.3,
			(double)(i / SIDE % SIDE) * 0.7 - 16.6,
			(double)(i / (SIDE * SIDE)) * 0.7 - 16.4};
		double d = n ? (p[0] * n[0] + p[1] * n[1] + p[2] * n[2]) /
					   sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
			     : 9 - sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);

		v->data[i] = (float)(step(d, sigma) + noise * (double)ct_rng_normal(1, 0, i));
	}
}

static void check(const struct ct_edge_figures *f, double sigma, double tolerance, const char *what)
{
	const double pi = acos(-1.0);

	OK(fabs(f->rise / (2.5631 * sigma) - 1) < tolerance, "%s: rise %.4f mm", what, f->rise);
	OK(fabs(f->mtf50 / (sqrt(log(2.0) / 2) / (pi * sigma)) - 1) < tolerance,
		"%s: MTF 50 %% at %.4f", what, f->mtf50);
	OK(fabs(f->mtf10 / (sqrt(log(10.0) / 2) / (pi * sigma)) - 1) < 2 * tolerance,
		"%s: MTF 10 %% at %.4f", what, f->mtf10);
}

static void test_planes(void)
{
	static const double normal[][3] = {
		{1, 0.13, 0.07}, {0.2, -1, 0.4}, {0.1, 0.2, -1}, {-1, 1, 1.2}};
	struct ct_env env = {0};
	struct ct_err e;

	for (size_t k = 0; k < sizeof normal / sizeof *normal; k++) {
		struct ct_vol a, b;
		struct ct_edges o;
		char name[40];

		make(&a, normal[k], 0.6, 0);
		make(&b, normal[k], 1.1, 0);
		OK(ct_edges(&o, &a, &b, NULL, &env, &e) == 0 && o.count > 100, "plane %zu", k);
		snprintf(name, sizeof name, "plane %zu, ref", k);
		check(&o.ref, 0.6, 0.02, name);
		snprintf(name, sizeof name, "plane %zu, test", k);
		check(&o.test, 1.1, 0.02, name);
		ct_vol_free(&a);
		ct_vol_free(&b);
	}
}

static void test_ball(void)
{
	struct ct_vol a, b, mask;
	struct ct_env env = {0}, four = {0};
	struct ct_edges o, p;
	struct ct_err e;

	make(&a, NULL, 0.5, 20);
	make(&b, NULL, 0.9, 20);
	make(&mask, NULL, 0.5, 0);
	ct_edges(&o, &a, &b, NULL, &env, &e);
	OK(o.count > 100, "a ball, with noise: %zu edges", o.count);
	check(&o.ref, 0.5, 0.06, "ref"); /* of radius 9 mm: what is behind the edge narrows */
	check(&o.test, 0.9, 0.06, "test");
	if (ct_par_alloc(&four.par, 4, &e))
		exit(1);
	ct_edges(&p, &a, &b, NULL, &four, &e);
	OK(memcmp(&o, &p, sizeof o) == 0, "1 and 4 threads, same bits");
	ct_par_free(four.par);
	for (size_t i = 0; i < ct_vol_count(&mask); i++)
		mask.data[i] = i % SIDE < SIDE / 2;
	ct_edges(&p, &a, &b, &mask, &env, &e);
	OK(p.count > o.count / 3 && p.count < 2 * o.count / 3, "a mask of one half: %zu", p.count);
	for (size_t i = 0; i < ct_vol_count(&a); i++)
		a.data[i] = 100 * ct_rng_normal(5, 0, i);
	ct_edges(&o, &a, &b, NULL, &env, &e);
	OK(o.count < 12 && isnan(o.ref.rise) && isnan(o.test.mtf50),
		"noise has no edges, and no figures: %zu", o.count);
	a.n[2] = b.n[2] = 17;
	OK(ct_edges(&o, &a, &b, NULL, &env, &e) < 0 && e.code == CT_EGEOM,
		"too few slices are refused");
	ct_vol_free(&a);
	ct_vol_free(&b);
	ct_vol_free(&mask);
}

/* A plane through the middle: what is at distance d, in voxels of 1 mm, along its normal. */
static void profile(struct ct_vol *v, const size_t n[3], const double normal[3],
	double f(double d, double how), double how)
{
	struct ct_err e;
	size_t i = 0;

	*v = (struct ct_vol){0};
	if (ct_vol_alloc(v, n, &e))
		exit(1);
	for (size_t z = 0; z < n[2]; z++)
		for (size_t y = 0; y < n[1]; y++)
			for (size_t x = 0; x < n[0]; x++)
				v->data[i++] = (float)f(
					((double)x - (double)n[0] / 2) * normal[0] +
						((double)y - (double)n[1] / 2) * normal[1] +
						((double)z - (double)n[2] / 2) * normal[2],
					how);
}

static double rise(double d, double how)
{
	(void)how;
	return 1000 * (1 + erf(d / sqrt(2.0)));
}

/* A bump behind the edge, or a dent in front of it. */
static double overshoot(double d, double how)
{
	const double at = fabs(d) - 2.6;

	return rise(d, 0) + (d * how > 0 ? 2000 * how * exp(-at * at / 0.3) : 0);
}

/* Plateaus that go up and down. */
static double ripple(double d, double how)
{
	return rise(d, 0) + (d * how > 4 * fabs(how) ? 2000 * how * (sin(3 * d) > 0 ? 1 : -1) : 0);
}

/* A steep third, and then a ramp of four voxels: half way lies beyond the steepest place. */
static double crooked(double d, double how)
{
	const double jump = erf(d / 0.6) / 2 + 0.5;

	return 2000 * (how * jump + (1 - how) * fmin(fmax(d / 4, 0), 1));
}

static double lower(double d, double how)
{
	return how * rise(d, 0) / 2000;
}

/* 360 HU, from plateau to plateau 300. */
static double gentle(double d, double how)
{
	return 180 * (1 + erf(d / sqrt(2.0) / how));
}

/* Of the 64 columns of a slanted plane, or an upright one. */
static size_t edges(double f(double d, double how), double how, bool upright)
{
	const double slanted[3] = {0.15, 0.05, 0.9874208829}, up[3] = {0, 0, 1};
	const double *normal = upright ? up : slanted;
	const size_t n[3] = {26, 26, 40};
	const struct ct_env env = {0};
	struct ct_edges o;
	struct ct_vol v;
	struct ct_err e;

	profile(&v, n, normal, f, how);
	if (ct_edges(&o, &v, &v, NULL, &env, &e))
		exit(1);
	ct_vol_free(&v);
	return o.count;
}

static void test_what_is_none(void)
{
	OK(edges(rise, 0, false) == 64, "every column has an edge: %zu", edges(rise, 0, false));
	OK(edges(lower, 305, false) == 64 && edges(lower, 295, false) == 0,
		"of the step asked for");
	for (int sign = -1; sign <= 1; sign += 2) {
		OK(edges(overshoot, sign * 0.16, false) > 50 &&
				edges(overshoot, sign * 0.26, false) == 0,
			"what overshoots by a fifth is none, side %d", sign);
		OK(edges(ripple, sign * 0.085, false) > 50 &&
				edges(ripple, sign * 0.115, false) < 10,
			"nor what has no plateau, side %d (%zu, %zu)", sign,
			edges(ripple, sign * 0.085, false), edges(ripple, sign * 0.115, false));
	}
	OK(edges(crooked, 0.53, true) == 64 && edges(crooked, 0.46, true) == 0 &&
			edges(crooked, 0.4, true) == 0,
		"nor what is not half way near where it is steepest");
	OK(edges(gentle, 3.7, false) == 64 && edges(gentle, 3.95, false) == 0,
		"nor what does not take an eighth of the step a voxel");
}

/* More candidates than are looked at; and as few as tell nothing. */
static void test_many(void)
{
	static const double up[3] = {0, 0, 1};
	const size_t n[3] = {170, 160, 20};
	const struct ct_env env = {0};
	struct ct_vol v, mask;
	struct ct_edges o;
	struct ct_err e;

	profile(&v, n, up, rise, 0);
	profile(&mask, n, up, lower, 0);
	must(ct_edges(&o, &v, &v, NULL, &env, &err));
	OK(o.count == 152 * 142 / 2, "every second: %zu", o.count);
	for (size_t k = 0; k < 13; k++) {
		const size_t i = 40 + 3 * k, j = 30 + 5 * k;

		if (k > 10 && (ct_edges(&o, &v, &v, &mask, &env, &e) || o.count != k ||
				      isnan(o.ref.rise) != (k < 12)))
			OK(0, "%zu edges", k);
		for (size_t z = 0; z < 20; z++)
			mask.data[(z * n[1] + j) * n[0] + i] = k % 2 ? 1 : -1;
	}
	OK(1, "eleven edges tell nothing, twelve do");
	v.n[0] = mask.n[0] = 18;
	OK(ct_edges(&o, &v, &v, NULL, &env, &e) < 0 && strstr(e.msg, "need 19"),
		"room for a cylinder");
	ct_vol_free(&v);
	ct_vol_free(&mask);
}

/* Figures are of mm: the same voxels, four times as large; and voxels that are no cubes. */
static void test_sizes(void)
{
	static const double normal[3] = {0.3, -0.2, 0.9327379053}, mm[3] = {0.6, 0.8, 1};
	const size_t n[3] = {40, 34, 34};
	const struct ct_env env = {0};
	struct ct_vol v, w, other;
	struct ct_edges o, p;
	struct ct_err e;
	double skew[3];

	profile(&v, n, normal, rise, 0);
	profile(&w, n, normal, rise, 0);
	for (size_t i = 0; i < ct_vol_count(&w); i++)
		w.data[i] = v.data[i] - 0.1f * v.data[i > 2 ? i - 3 : 0];
	for (int a = 0; a < 3; a++)
		v.affine[a][a] = w.affine[a][a] = 0.5;
	ct_edges(&o, &v, &w, NULL, &env, &e);
	for (int a = 0; a < 3; a++)
		v.affine[a][a] = w.affine[a][a] = 2;
	ct_edges(&p, &v, &w, NULL, &env, &e);
	OK(o.count > 100 && p.count == o.count && p.ref.rise == 4 * o.ref.rise &&
			p.test.rise == 4 * o.test.rise && p.ref.mtf50 == o.ref.mtf50 / 4 &&
			p.test.mtf10 == o.test.mtf10 / 4,
		"voxels four times as large: %zu edges, %g mm", p.count, p.ref.rise);
	for (int a = 0; a < 3; a++)
		skew[a] = normal[a] * mm[a];
	profile(&other, n, skew, rise, 0);
	for (int a = 0; a < 3; a++)
		other.affine[a][a] = mm[a];
	OK(ct_edges(&o, &other, &other, NULL, &env, &e) == 0 && o.count > 100,
		"voxels that are no cubes: %zu", o.count);
	check(&o.ref, 1, 0.02, "no cubes");
	ct_vol_free(&v);
	ct_vol_free(&w);
	ct_vol_free(&other);
}

/* Where the transfer of a box of L bins, over that of two bins, is `level`. */
static double box_falls(double L, double level)
{
	const double pi = acos(-1.0);
	double lo = 1e-6, hi = fmin(1 / L, 0.25);

	for (int k = 0; k < 60; k++) {
		const double f = (lo + hi) / 2, sinc = sin(pi * f) / (pi * f);

		if (sin(pi * f * L) / (L * sin(pi * f)) / (sinc * sinc) > level)
			lo = f;
		else
			hi = f;
	}
	return lo;
}

/* Ramps of any length, place, height and bin. */
static void test_spread(void)
{
	double worst = 0, e[96];
	struct ct_edge_figures f;

	for (int L = 6; L < 22; L++)
		for (int k = 0; k < 8; k++) {
			const double width = k % 2 ? 0.3 : 7, low = k / 2 % 2 ? -400 : 30;
			const int n = k / 4 ? 96 : 65, from = n / 2 - L / 3;

			for (int b = 0; b < n; b++)
				e[b] = low + 700 * fmin(fmax((double)(b - from) / L, 0), 1);
			ct_edge_spread(&f, e, (size_t)n, width);
			worst = fmax(worst, fabs(f.rise / width / (0.8 * L) - 1));
			worst = fmax(worst, fabs(f.mtf50 * width / box_falls(L, 0.5) - 1));
			worst = fmax(worst, fabs(f.mtf10 * width / box_falls(L, 0.1) - 1));
		}
	OK(worst < 2e-4, "a ramp: rise and transfer in closed form (%.2g)", worst);
	worst = 0;
	for (int at = 30; at < 70; at++) {
		for (int b = 0; b < 96; b++)
			e[b] = b < at ? 3 : 5;
		ct_edge_spread(&f, e, 96, 2);
		worst = fmax(worst, fabs(f.rise - 1.6));
		worst = isnan(f.mtf50) && isnan(f.mtf10) ? worst : 1;
	}
	OK(worst < 1e-12, "a step, wherever, never falls (%.2g)", worst);
	for (int b = 0; b < 96; b++) /* of plateaus that are not flat, the outer quarters count */
		e[b] = b < 24   ? b % 2
		       : b < 40 ? 0.5
		       : b < 50 ? 0.5 + (b - 40)
		       : b < 72 ? 10.5
				: 10 + b % 2;
	ct_edge_spread(&f, e, 96, 1);
	NEAR(f.rise, 8, 1e-9, "plateaus are the outer quarters");
}

int main(void)
{
	test_what_is_none();
	test_many();
	test_sizes();
	test_spread();
	test_planes();
	test_ball();
	return tap_done();
}
