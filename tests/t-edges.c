/* Sharpness: edges of known blur, in any direction, and what is no edge. Surfaces: balls and planes
 * a known distance apart; noise against every triangle.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "quality/edges.h"
#include "quality/isosurface.h"
#include "quality/surface-error.h"
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
	static const double normal[][3] = {{1, 0.13, 0.07}, {0.2, -1, 0.4}, {0.1, 0.2, -1},
		{-1, 1, 1.2},
		/* along the voxels */
		{0, 0, 1}, {0, 1, 1}, {0, 1, 2}};
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
		check(&o.ref, 0.6, k < 4 ? 0.02 : 0.06, name);
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
	for (int b = 0; b < 96; b++)
		e[b] = 700 * fmin(fmax((55 - b) / 15.0, 0), 1);
	ct_edge_spread(&f, e, 96, 1);
	OK(isnan(f.rise) && isnan(f.mtf50) && isnan(f.mtf10),
		"a profile that falls has no figures");
}

/* Surfaces. Voxels of v get the value of f at their place, mm. */
static void fill(struct ct_vol *v, const size_t n[3], const double mm[3],
	double (*f)(const double p[3], double by), double by)
{
	*v = (struct ct_vol){0};
	must(ct_vol_alloc(v, n, &err));
	for (int a = 0; a < 3; a++)
		v->affine[a][a] = mm[a];
	for (size_t i = 0; i < ct_vol_count(v); i++) {
		const double p[3] = {(double)(i % n[0]) * mm[0], (double)(i / n[0] % n[1]) * mm[1],
			(double)(i / n[0] / n[1]) * mm[2]};

		v->data[i] = (float)f(p, by);
	}
}

static double in_ball(const double p[3], double r)
{
	return 100 * (r - sqrt(pow(p[0] - 15.3, 2) + pow(p[1] - 16.1, 2) + pow(p[2] - 15.8, 2)));
}

static double in_disc(const double p[3], double r)
{
	return 100 * (r - hypot(p[0] - 15.3, p[1] - 16.1));
}

static double under_plane(const double p[3], double by)
{
	return 40 * (0.6 * p[0] + 0.64 * p[1] + 0.48 * p[2] - 25 - by);
}

static double under_slice(const double p[3], double by)
{
	return 40 * (p[2] - 15 - by);
}

/* Flat, or `by` mm higher for each mm along x. */
static double under_roof(const double p[3], double by)
{
	return 40 * (p[2] - 6 - by * p[0]);
}

static double in_noise(const double p[3], double seed)
{
	return (double)ct_rng_normal((uint64_t)seed, 0, (uint64_t)(p[0] + 64 * (p[1] + 64 * p[2])));
}

static double nothing(const double p[3], double by)
{
	return by + 0 * p[0];
}

static struct ct_surface_error apart(struct ct_vol *a, struct ct_vol *b, const struct ct_vol *mask)
{
	struct ct_env one = {0}, three = {0};
	struct ct_surface_error s, t;

	must(ct_par_alloc(&three.par, 3, &err) || ct_surface_error(&s, a, b, mask, 0, &one, &err) ||
		ct_surface_error(&t, a, b, mask, 0, &three, &err));
	if (memcmp(&s, &t, sizeof s) != 0)
		OK(false, "a surface error with three threads has other bytes than with one");
	ct_par_free(three.par);
	return s;
}

static struct ct_surface_error apart_by(const size_t n[3], const double mm[3],
	double (*f)(const double p[3], double by), double from, double to)
{
	struct ct_surface_error s;
	struct ct_vol a, b;

	fill(&a, n, mm, f, from);
	fill(&b, n, mm, f, to);
	s = apart(&a, &b, NULL);
	ct_vol_free(&a);
	ct_vol_free(&b);
	return s;
}

static void all_are(const struct ct_surface_error *s, double d, double tolerance, const char *what)
{
	NEAR(s->mean, d, tolerance, what);
	NEAR(s->rms, d, tolerance, what);
	NEAR(s->p95, d, 2 * tolerance, what);
}

static void test_surfaces_apart(void)
{
	static const size_t n[3] = {40, 34, 14}, cube[3] = {32, 33, 31}, flat[3] = {40, 41, 1},
			    lying[3] = {9, 1, 31};
	static const double mm[3] = {0.8, 1, 2.5}, unit[3] = {1, 1, 1};
	struct ct_surface_error s;

	s = apart_by(n, mm, in_ball, 11, 11.4);
	all_are(&s, 0.4, 0.015, "balls in voxels of unequal sides are 0.4 mm apart");
	OK(s.points[1] > s.points[0] && s.points[0] > 1000,
		"the larger ball has more points (%zu, %zu)", s.points[0], s.points[1]);
	s = apart_by(cube, unit, in_ball, 12, 5);
	all_are(&s, 7, 0.03, "balls that are 7 voxels apart have that distance");
	s = apart_by(cube, unit, in_ball, 12, 12);
	all_are(&s, 0, 1e-6, "a ball is at no distance from itself");
	s = apart_by(n, mm, under_slice, 0, 0.3);
	all_are(&s, 0.3, 1e-5, "a plane across thick slices is shifted by 0.3 mm");
	OK(s.points[0] == n[0] * n[1], "the plane has a point on each line that it crosses");
	s = apart_by(cube, unit, under_roof, 0, 0.2);
	NEAR(s.mean, 0.1 * 31, 0.04, "a tilted plane is half as far off as at its end in the mean");
	NEAR(s.rms, 0.2 / sqrt(3) * 31, 0.04, "and by 1 / sqrt(3) of that, root mean square");
	NEAR(s.p95, 0.2 * 0.95 * 31, 0.15,
		"of a tilted plane 95 % are nearer than 0.95 of its end");
	s = apart_by(flat, mm, in_disc, 8, 8.25);
	all_are(&s, 0.25, 0.01, "contours of a single slice are 0.25 mm apart");
	s = apart_by(lying, unit, under_slice, 0, 3.7);
	all_are(&s, 3.7, 1e-5, "an axis of one voxel that is not the last has its contours");
	s = apart_by(cube, unit, in_ball, 12, -1);
	OK(s.points[0] > 0 && s.points[1] == 0 && isnan(s.mean) && isnan(s.rms) && isnan(s.p95),
		"a surface that one volume does not have gives no number");
	s = apart_by((const size_t[3]){1, 1, 1}, unit, nothing, -5, 5);
	OK(s.points[0] + s.points[1] == 0 && isnan(s.mean), "one voxel has no surface");
	s = apart_by(cube, unit, nothing, 0, 7);
	OK(s.points[0] + s.points[1] == 0 && isnan(s.mean), "constant volumes have no surface");
}

/* Beside the faces of the volume a slanted plane ends, and what is nearest to it is its end. */
static void test_surface_mask(void)
{
	static const size_t n[3] = {40, 34, 30};
	static const double mm[3] = {0.8, 1, 1.1};
	struct ct_vol a, b, mask;
	struct ct_surface_error all, s;

	fill(&a, n, mm, under_plane, 0);
	fill(&b, n, mm, under_plane, 1.25);
	fill(&mask, n, mm, nothing, 0);
	for (size_t i = 0; i < ct_vol_count(&mask); i++) {
		const size_t at[3] = {i % n[0], i / n[0] % n[1], i / n[0] / n[1]};

		mask.data[i] = 1;
		for (int d = 0; d < 3; d++)
			if (at[d] < 3 || at[d] + 3 >= n[d])
				mask.data[i] = 0;
	}
	all = apart(&a, &b, NULL);
	s = apart(&a, &b, &mask);
	OK(all.rms > 1.26 && all.points[0] > s.points[0],
		"without a mask the ends of planes count");
	all_are(&s, 1.25, 1e-5, "with a mask a slanted plane is shifted by 1.25 mm");
	for (size_t i = 0; i < ct_vol_count(&a); i++) {
		a.data[i] = b.data[i] = i / n[0] / n[1] < 12 ? 1 : -1;
		mask.data[i] = i / n[0] / n[1] < 12;
	}
	s = apart(&a, &b, &mask);
	OK(s.points[0] + s.points[1] == 0, "points at the rim of the mask do not count");
	memset(mask.data, 0, ct_vol_count(&mask) * sizeof *mask.data);
	s = apart(&a, &b, &mask);
	OK(s.points[0] == 0 && isnan(s.mean), "an empty mask leaves no number");
	ct_vol_free(&a);
	ct_vol_free(&b);
	ct_vol_free(&mask);
}

/* A number of the two ends of a side, the same in both orders. */
static uint64_t side_number(const double a[3], const double b[3])
{
	uint64_t sum = 0;

	for (int k = 0; k < 2; k++) {
		uint64_t h = 14695981039346656037u, word;

		for (int d = 0; d < 3; d++) {
			memcpy(&word, (k ? b : a) + d, sizeof word);
			h = (h ^ word) * 1099511628211u;
			h ^= h >> 29;
		}
		sum += h;
	}
	return sum;
}

/* Not by blocks, but in every cell: the nearest triangle by samples of it. */
static void test_surface_of_noise(void)
{
	static const size_t n[3] = {11, 9, 7};
	static const double unit[3] = {1, 1, 1};
	double triangle[CT_ISOSURFACE_TRIANGLES][3][3], worst = 0, least[20];
	struct ct_isosurface s;
	struct ct_env env = {0};
	struct ct_vol v;
	uint64_t open = 0;

	fill(&v, n, unit, in_noise, 7);
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		if (i % 11 % 10 == 0 || i / 11 % 9 % 8 == 0 || i / 99 % 6 == 0)
			v.data[i] = -3;
	must(ct_isosurface_alloc(&s, &v, 0.2, &env, &err));
	for (size_t q = 0; q < 20; q++)
		least[q] = INFINITY;
	for (size_t c = 0; c < 10 * 8 * 6; c++) {
		const size_t at[3] = {c % 10, c / 10 % 8, c / 80},
			     found = ct_isosurface_cell(triangle, &s, at);

		for (size_t t = 0; t < found; t++) {
			for (int k = 0; k < 3; k++)
				open ^= side_number(triangle[t][k], triangle[t][(k + 1) % 3]);
			for (size_t q = 0; q < 20; q++)
				for (int i = 0; i <= 40; i++)
					for (int j = 0; j + i <= 40; j++) {
						double sum = 0;

						for (int d = 0; d < 3; d++)
							sum += pow(
								triangle[t][0][d] * (40 - i - j) /
										40 +
									triangle[t][1][d] * i / 40 +
									triangle[t][2][d] * j / 40 -
									15 * (double)ct_rng_normal(
										     3, q,
										     (uint64_t)d),
								2);
						least[q] = fmin(least[q], sqrt(sum));
					}
		}
	}
	OK(open == 0, "the surface of noise is closed: each side has two triangles");
	for (size_t q = 0; q < 20; q++) {
		const double p[3] = {15 * (double)ct_rng_normal(3, q, 0),
			15 * (double)ct_rng_normal(3, q, 1), 15 * (double)ct_rng_normal(3, q, 2)};

		worst = fmax(worst, fabs(ct_isosurface_distance(&s, p) - least[q]));
	}
	OK(worst < 0.02, "the nearest place is that of all triangles (%.2g)", worst);
	ct_isosurface_free(&s);
	ct_vol_free(&v);
}

/* One voxel in a corner is found from all of a large surface without a look at every cell. */
static void test_surface_far(void)
{
	static const size_t n[3] = {130, 129, 127};
	static const double unit[3] = {1, 1, 1};
	struct ct_surface_error s;
	struct ct_vol a, b;

	fill(&a, n, unit, in_ball, 14);
	fill(&b, n, unit, nothing, -1);
	b.data[ct_vol_count(&b) - 1] = 1;
	s = apart(&a, &b, NULL);
	OK(s.points[1] == 3 && s.mean > 170 && s.mean < 200 && s.rms >= s.mean,
		"a voxel in the far corner is %.1f mm away", s.mean);
	ct_vol_free(&a);
	ct_vol_free(&b);
}

int main(void)
{
	test_surfaces_apart();
	test_surface_mask();
	test_surface_of_noise();
	test_surface_far();
	test_what_is_none();
	test_many();
	test_sizes();
	test_spread();
	test_planes();
	test_ball();
	return tap_done();
}
