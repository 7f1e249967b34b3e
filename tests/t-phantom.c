/* t-phantom.c: shapes against what they are: chords by bisection, voxels point by point; and the
 * sets of them, which a name and a seed stand for. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "xray/phantom.h"
#include "xray/geometry.h"
#include "tap.h"
#include "xray/photons.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static uint64_t drawn;

static double uniform(double lo, double hi)
{
	return lo + (hi - lo) * ct_rng_uniform(3, 9, drawn++);
}

/* Three axes at right angles: two steps of Gram and Schmidt, and a cross product. */
static void turn(double axis[3][3])
{
	for (int a = 0; a < 2; a++) {
		double along = 0, len = 0;

		for (int r = 0; r < 3; r++)
			axis[a][r] = uniform(-1, 1);
		for (int r = 0; r < 3; r++)
			along += a ? axis[0][r] * axis[1][r] : 0;
		for (int r = 0; r < 3; r++) {
			axis[a][r] -= a ? along * axis[0][r] : 0;
			len += axis[a][r] * axis[a][r];
		}
		for (int r = 0; r < 3; r++)
			axis[a][r] /= sqrt(len);
	}
	for (int r = 0; r < 3; r++)
		axis[2][r] = axis[0][(r + 1) % 3] * axis[1][(r + 2) % 3] -
			     axis[0][(r + 2) % 3] * axis[1][(r + 1) % 3];
}

static struct ct_shape shape_of(enum ct_shape_kind kind, bool turned)
{
	struct ct_shape s = {
		.kind = kind, .density = uniform(-1, 1), .axis = {{1}, {0, 1}, {0, 0, 1}}};

	for (int a = 0; a < 3; a++) {
		s.centre[a] = uniform(-4, 4);
		s.half[a] = uniform(1, 5);
	}
	if (turned)
		turn(s.axis);
	return s;
}

/* How far out x is: below 1 inside; convex. */
static double level(const struct ct_shape *s, const double x[3])
{
	double y[3] = {0};

	for (int a = 0; a < 3; a++)
		for (int r = 0; r < 3; r++)
			y[a] += s->axis[a][r] * (x[r] - s->centre[r]) / s->half[a];
	if (s->kind == CT_BOX)
		return fmax(fmax(fabs(y[0]), fabs(y[1])), fabs(y[2]));
	if (s->kind == CT_CYLINDER)
		return fmax(hypot(y[0], y[1]), fabs(y[2]));
	return hypot(hypot(y[0], y[1]), y[2]);
}

static double level_at(const struct ct_shape *s, const double o[3], const double d[3], double t)
{
	const double x[3] = {o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]};

	return level(s, x);
}

/* The end of the chord between `in` the shape and `out` of it. */
static double end(
	const struct ct_shape *s, const double o[3], const double d[3], double in, double out)
{
	for (int k = 0; k < 80; k++) {
		double mid = (in + out) / 2;

		if (level_at(s, o, d, mid) < 1)
			in = mid;
		else
			out = mid;
	}
	return in;
}

/* Where the line is deepest, by thirds; from there both ends. */
static double chord(const struct ct_shape *s, const double o[3], const double d[3], double t0)
{
	double lo = -100, hi = 100, mid;

	for (int k = 0; k < 200; k++) {
		double a = lo + (hi - lo) / 3, b = hi - (hi - lo) / 3;

		if (level_at(s, o, d, a) < level_at(s, o, d, b))
			hi = b;
		else
			lo = a;
	}
	mid = (lo + hi) / 2;
	if (level_at(s, o, d, mid) >= 1)
		return 0;
	lo = fmax(end(s, o, d, mid, -100), t0);
	hi = end(s, o, d, mid, 100);
	return hi > lo ? (hi - lo) * hypot(hypot(d[0], d[1]), d[2]) : 0;
}

/* Rays of any direction, and along an axis of the shape; from anywhere, and half lines. */
static void t_chords(void)
{
	static const char *const name[] = {"ellipsoids", "boxes", "cylinders"};

	for (int kind = 0; kind < 3; kind++) {
		double worst = 0;
		size_t hit = 0, missed = 0;

		for (int k = 0; k < 1500; k++) {
			struct ct_shape s = shape_of((enum ct_shape_kind)kind, k % 5 > 0);
			double o[3], d[3], t0 = k % 3 ? -HUGE_VAL : uniform(-2, 2), want;

			for (int a = 0; a < 3; a++) {
				o[a] = uniform(-6, 6);
				d[a] = k % 5 ? uniform(-3, 3) : a == k / 5 % 3 ? 2 : 0;
			}
			want = chord(&s, o, d, t0);
			worst = fmax(worst, fabs(ct_shape_chord(&s, o, d, t0) - want));
			hit += want > 0;
			missed += want <= 0;
		}
		OK(worst < 1e-6 && hit > 200 && missed > 200,
			"chords of %s: %zu as by bisection, %zu of nothing (%.2g)", name[kind], hit,
			missed, worst);
	}
}

/* Sum over shapes of density times the share of n^3 points of a voxel that are inside. */
static double mean_of(const struct ct_vol *v, size_t shapes, const struct ct_shape *s, size_t n,
	const size_t at[3])
{
	double sum = 0, m = (double)n;

	for (size_t q = 0; q < n * n * n; q++) {
		const double ijk[3] = {(double)at[0] - 0.5 + ((double)(q % n) + 0.5) / m,
			(double)at[1] - 0.5 + ((double)(q / n % n) + 0.5) / m,
			(double)at[2] - 0.5 + ((double)(q / n / n) + 0.5) / m};
		double x[3];

		for (int r = 0; r < 3; r++)
			x[r] = v->affine[r][0] * ijk[0] + v->affine[r][1] * ijk[1] +
			       v->affine[r][2] * ijk[2] + v->affine[r][3];
		for (size_t k = 0; k < shapes; k++)
			sum += level(&s[k], x) < 1 ? s[k].density : 0;
	}
	return sum / (m * m * m);
}

/* A slanted grid of flat voxels, shapes larger and smaller than one. */
static void t_voxels(void)
{
	static const double mm[3] = {0.9, 1.4, 0.5};
	struct ct_shape s[9];
	struct ct_vol v = {0};
	double axis[3][3];

	must(ct_vol_alloc(&v, (const size_t[]){17, 11, 14}, &err));
	turn(axis);
	for (int r = 0; r < 3; r++) {
		v.affine[r][3] = 0.3 * r;
		for (int a = 0; a < 3; a++) {
			v.affine[r][a] = axis[a][r] * mm[a];
			v.affine[r][3] -= v.affine[r][a] * ((double)v.n[a] - 1) / 2;
		}
	}
	for (int k = 0; k < 9; k++) {
		s[k] = shape_of((enum ct_shape_kind)(k % 3), true);
		for (int a = 0; a < 3; a++)
			s[k].half[a] *= k < 3 ? 0.1 : 1;
	}
	for (size_t n = 1; n < 5; n++) {
		double worst = 0, most = 0;

		ct_phantom_voxels(&v, 9, s, n, NULL);
		for (size_t i = 0; i < ct_vol_count(&v); i++) {
			double want = mean_of(
				&v, 9, s, n, (const size_t[]){i % 17, i / 17 % 11, i / 17 / 11});

			worst = fmax(worst, fabs((double)v.data[i] - want));
			most = fmax(most, fabs(want));
		}
		OK(worst < 1e-6 && most > 0.2, "%zu^3 points a voxel: their mean (%.2g)", n, worst);
	}
	ct_vol_free(&v);
}

/* The rays of ct_view_ray; those of a cone begin at the source, which is in a shape here. */
static void t_projections(void)
{
	struct ct_shape s[4];

	for (int k = 0; k < 4; k++)
		s[k] = shape_of((enum ct_shape_kind)(k % 3), true);
	for (int beam = CT_CONE; beam <= CT_PARALLEL; beam++) {
		struct ct_geometry scan = {.beam = (enum ct_beam)beam,
			.views = 5,
			.arc = 360,
			.dso = 5,
			.dsd = 9,
			.w = 7,
			.h = 6,
			.pitch = {1.1, 0.8}};
		struct ct_stack p = {0};
		double worst = 0, most = 0;

		must(ct_geometry_fill(&p, &scan, &err));
		memset(p.data, 0, ct_stack_count(&p) * sizeof *p.data);
		ct_phantom_project(&p, 2, 3, ct_stack_view(&p, 2), 4, s, NULL);
		for (size_t i = 0; i < ct_stack_count(&p); i++) {
			double o[3], d[3], sum = 0;

			ct_view_ray(&p, i / 42, i / 7 % 6, i % 7, o, d);
			for (int k = 0; k < 4 && i >= 84; k++)
				sum += s[k].density *
				       chord(&s[k], o, d, beam == CT_CONE ? 0 : -HUGE_VAL);
			worst = fmax(worst, fabs((double)p.data[i] - sum));
			most = fmax(most, fabs(sum));
		}
		OK(worst < 1e-5 && most > 1, "%s: the sum of the chords, of these views (%.2g)",
			CT_WORD(CT_BEAM_LIST, beam), worst);
		ct_stack_free(&p);
	}
}

/* Numbers in a row, each with a weight of its own, to one. */
struct mark {
	double sum, at;
};

static void add(struct mark *m, double x)
{
	m->at += 1;
	m->sum += cos(m->at) * x;
}

/* The most that the axes of a shape are off those at right angles, of length 1. */
static double skew_of(const struct ct_shape *s)
{
	double most = 0;

	for (int k = 0; k < 9; k++) {
		double unit = 0;

		for (int r = 0; r < 3; r++)
			unit += s->axis[k / 3][r] * s->axis[k % 3][r];
		most = fmax(most, fabs(unit - (k % 4 == 0)));
	}
	return most;
}

static double mark_of(enum ct_phantom kind, uint64_t seed, double *skew)
{
	const double extent[3] = {120, 100, 140};
	struct ct_shape s[CT_PH_MAX_SHAPES];
	size_t n = ct_phantom_make(kind, extent, 0.75, seed, s);
	struct mark m = {0};

	for (size_t k = 0; k < n; k++) {
		add(&m, (double)s[k].kind);
		add(&m, s[k].density);
		for (int a = 0; a < 3; a++) {
			add(&m, s[k].centre[a]);
			add(&m, s[k].half[a]);
			for (int r = 0; r < 3; r++)
				add(&m, s[k].axis[a][r]);
		}
		*skew = fmax(*skew, skew_of(&s[k]));
	}
	return m.sum;
}

/* Published figures name a phantom and its seed: the shapes stay what they were. */
static void t_sets(void)
{
	static const struct {
		const char *name;
		enum ct_phantom kind;
		uint64_t seed;
		double mark;
	} set[] = {{"chest", CT_PH_ELLIPSOIDS, 1, -18.2640166405},
		{"chest, seed 2", CT_PH_ELLIPSOIDS, 2, -88.50544884251},
		{"head", CT_PH_SHEPP_LOGAN, 0, -12.73380053283},
		{"sphere", CT_PH_SPHERE, 0, -36.00010219552},
		{"cube", CT_PH_CUBE, 0, -35.45979988965},
		{"cylinder", CT_PH_CYLINDER, 0, -34.23581149275},
		{"shells", CT_PH_SHELLS, 1, 250.139709236715},
		{"marks", CT_PH_MARKS, 0, -100.2381210627},
		{"constant", CT_PH_CONSTANT, 0, -74.96240834764}};
	double skew = 0;

	for (size_t i = 0; i < sizeof set / sizeof *set; i++)
		NEAR(mark_of(set[i].kind, set[i].seed, &skew), set[i].mark, 1e-8, set[i].name);
	OK(skew < 1e-12, "axes at right angles, of length 1 (%.2g)", skew);
}

/* counting noise against its distribution. */

enum { N = 100000 };

static void t_moments(void)
{
	static const double mean[] = {0.2, 3, 29.9, 30.1, 200, 1e4, 1e9};

	for (size_t i = 0; i < sizeof mean / sizeof *mean; i++) {
		double m = mean[i], sum = 0, square = 0, var, sd;

		for (uint64_t k = 0; k < N; k++) {
			double d = ct_photons_poisson(m, 7, k) - m;

			sum += d;
			square += d * d;
		}
		sum /= N;
		var = square / N;
		sd = sqrt((m + 2 * m * m) / N); /* of the sample variance */
		OK(fabs(sum) < 4.5 * sqrt(m / N), "mean %g: mean (off by %.3g)", m, sum);
		OK(fabs(var - m) < 4.5 * sd, "mean %g: variance (off by %.3g)", m, var - m);
	}
}

/* Frequencies of each count against exp(-m) m^k/k!. */
static void t_distribution(void)
{
	static const double mean[] = {4, 40};

	for (size_t i = 0; i < 2; i++) {
		double m = mean[i], p = exp(-m), chi = 0;
		size_t seen[120] = {0}, cells = 0;

		for (uint64_t k = 0; k < N; k++) {
			double c = ct_photons_poisson(m, 11, k);

			seen[c < 119 ? (size_t)c : 119]++;
		}
		for (size_t k = 0; k < 119; k++) {
			double want = p * N, d = (double)seen[k] - want;

			if (want >= 5) {
				chi += d * d / want;
				cells++;
			}
			p *= m / (double)(k + 1);
		}
		OK(cells > 10 && chi < (double)cells + 4.5 * sqrt(2 * (double)cells),
			"mean %g: the counts are distributed so (chi2 %.1f of %zu)", m, chi, cells);
	}
}

/* Errors of the logarithm: bias and spread of A' for A, to first order 1/(2 N) and 1/N + s^2/N^2.
 */
static void t_attenuation(void)
{
	static const double electronic[] = {0, 30};
	float *p = malloc(N * sizeof *p), *a = malloc(N * sizeof *a), *q = malloc(N * sizeof *q);
	struct ct_photons how = {.i0 = 1e5, .water = 0.02, .seed = 3};

	for (size_t i = 0; i < N; i++)
		a[i] = 3;
	for (int e = 0; e < 2; e++) {
		double count = 1e5 * exp(-3.0), s = electronic[e], sum = 0, square = 0, var;

		how.electronic = s;
		memset(p, 0, N * sizeof *p);
		ct_photons_add(N, p, a, 0.1, &how, 0);
		for (size_t i = 0; i < N; i++) {
			sum += 0.1 * (double)p[i];
			square += 0.01 * (double)p[i] * (double)p[i];
		}
		sum /= N;
		square = square / N - sum * sum;
		var = 1 / count + s * s / (count * count);
		NEAR(sum, var / 2, 4.5 * sqrt(var / N), "mean of the noise in attenuation");
		NEAR(square / var, 1, 0.025, "variance: of photons, and of the electronics");
	}
	memset(q, 0, N * sizeof *q);
	ct_photons_add(N / 2, q, a, 0.1, &how, 0);
	ct_photons_add(N / 2, q + N / 2, a, 0.1, &how, N / 2);
	OK(memcmp(p, q, N * sizeof *p) == 0, "in two parts: the same bytes");
	how.seed = 4;
	memset(q, 0, N * sizeof *q);
	ct_photons_add(N, q, a, 0.1, &how, 0);
	OK(memcmp(p, q, N * sizeof *p) != 0, "another seed: others");
	a[0] = 1e4F;
	p[0] = 0;
	how.electronic = 0;
	ct_photons_add(1, p, a, 1, &how, 0);
	NEAR((double)p[0] + 1e4, log(1e5), 1e-3, "no photon at all reads as one");
	free(p);
	free(q);
	free(a);
}

/* Published figures name a seed: its counts stay what they were. */
static void t_draws(void)
{
	static const struct {
		double mean, sum;
	} draws[] = {{0.3, -2371.5}, {5, -9402}, {29.5, -16871.5}, {30.5, -684.5},
		{30.25, 137312.25}, {75, -5944}, {3e3, -53704}, {1e7, -769687}};

	for (size_t i = 0; i < sizeof draws / sizeof *draws; i++) {
		uint64_t n = i == 4 ? 1000000 : 3000; /* the series is seldom asked */
		double sum = 0;

		for (uint64_t k = 0; k < n; k++)
			sum += (double)(k % 97 + 1) *
			       (ct_photons_poisson(draws[i].mean, 5, k) - draws[i].mean);
		NEAR(sum, draws[i].sum, 1e-6, "what a seed draws");
	}
}

/* Fewer than one photon counts as one, from where the electronics make it less, too. */
static void t_least(void)
{
	struct ct_photons how = {.i0 = 20, .water = 0.02, .seed = 2, .electronic = 10};
	size_t one = 0, less = 0;

	for (uint64_t k = 0; k < 2000; k++) {
		float a = 3, p = 0;

		ct_photons_add(1, &p, &a, 1, &how, k);
		one += fabs((double)p + 3 - log(20)) < 1e-5;
		less += (double)p + 3 > log(20) + 1e-5;
	}
	OK(one > 500 && one < 1500 && less == 0, "%zu of 2000 read as one photon", one);
}

static void t_mu(void)
{
	float hu[] = {0, -1000, 1000, -1024, 500}, mu[5];

	ct_photons_mu(5, mu, hu, 0.02);
	NEAR((double)mu[0], 0.02, 1e-9, "water");
	OK(mu[1] == 0 && mu[3] == 0, "air and less: nothing");
	NEAR((double)mu[2], 0.04, 1e-9, "bone of 1000 HU");
	NEAR((double)mu[4], 0.03, 1e-9, "and of 500");
}

static void t_photons(void)
{
	t_moments();
	t_distribution();
	t_attenuation();
	t_draws();
	t_least();
	t_mu();
}

int main(void)
{
	t_chords();
	t_voxels();
	t_projections();
	t_sets();
	t_photons();
	return tap_done();
}
