/* Noise found again where it is known, and what it is to the data constraint.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "inverse/consistency.h"
#include "estimate/noise.h"
#include "tap.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N = 40 };

static struct ct_err err;

static void alloc_box(struct ct_vol *v, size_t n0, size_t n1, size_t n2)
{
	*v = (struct ct_vol){0};
	if (ct_vol_alloc(v, (const size_t[3]){n0, n1, n2}, &err))
		exit(99);
}

static void alloc(struct ct_vol *v, size_t n)
{
	alloc_box(v, n, n, n);
}

static void white(struct ct_vol *v, float sd)
{
	for (size_t i = 0; i < ct_vol_count(v); i++)
		v->data[i] = 40 + sd * ct_rng_normal(6, 0, i);
}

static struct ct_noise measure(const struct ct_vol *v)
{
	struct ct_noise n;

	if (ct_noise_measure(&n, v, &err)) {
		printf("# %s\n", err.msg);
		exit(99);
	}
	return n;
}

/* Normal noise of deviation sd about `mean` under a Gaussian of sigma voxels along each axis; its
 * correlation over one voxel. */
static double fill(struct ct_vol *v, double mean, double sd, double sigma)
{
	const size_t n = v->n[0], count = n * n * n;
	double w[9], sum[2] = {0}, square = 0;
	float *from;

	if (ct_alloc(&from, count, sizeof *from, &err))
		exit(99);
	for (int k = 0; k < 9; k++)
		w[k] = sigma > 0 ? exp(-(k - 4) * (k - 4) / (2 * sigma * sigma)) : k == 4;
	for (int k = 0; k < 9; k++)
		for (int d = 0; d < 2 && k + d < 9; d++)
			sum[d] += w[k] * w[k + d];
	for (size_t i = 0; i < count; i++)
		v->data[i] = ct_rng_normal(7, 0, i);
	for (size_t step = 1; step < count; step *= n) {
		memcpy(from, v->data, count * sizeof *from);
		for (size_t i = 0; i < count; i++) {
			const size_t at = i / step % n, line = i - at * step;
			double s = 0;

			for (size_t k = 0; k < 9; k++)
				s += w[k] * (double)from[line + (at + k + n - 4) % n * step];
			v->data[i] = (float)s;
		}
	}
	for (size_t i = 0; i < count; i++)
		square += (double)v->data[i] * (double)v->data[i];
	for (size_t i = 0; i < count; i++)
		v->data[i] = (float)(mean + sd * (double)v->data[i] / sqrt(square / (double)count));
	free(from);
	return sum[1] / sum[0];
}

static void test_correlated(void)
{
	static const double sigma[] = {0, 0.56, 0.7, 0.9};
	struct ct_vol v;

	alloc(&v, N);
	for (int k = 0; k < 4; k++) {
		const double rho = fill(&v, 40, 30, sigma[k]);
		const struct ct_noise n = measure(&v);

		OK(n.sure > (sigma[k] > 0.6 ? 15 : 25) && n.sure < 33, "sigma %g: %.3g HU for 30",
			sigma[k], n.sure);
		for (int a = 0; a < 3; a++)
			OK(n.alike[a] > 0.7 * rho - 0.01 && n.alike[a] < rho + 0.05,
				"axis %d: %.3f for %.3f", a, n.alike[a], rho);
	}
	fill(&v, 40, 30, 0); /* along one axis only */
	for (size_t i = ct_vol_count(&v) - 1; i >= (size_t)N * N; i--)
		v.data[i] = (v.data[i] + v.data[i - (size_t)N * N] - 80) * (float)M_SQRT1_2 + 40;
	OK(measure(&v).alike[2] > 0.35 && measure(&v).alike[2] < 0.6, "along z");
	OK(measure(&v).alike[0] < 0.06 && measure(&v).alike[1] < 0.06, "and no other axis");
	fill(&v, 40, 20, 0);
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] += 100 * (float)(i % N) + 50 * (float)(i / N % N);
	OK(measure(&v).alike[0] < 0.06 && measure(&v).alike[1] < 0.06, "a ramp is not alike");
	NEAR(measure(&v).sure, sqrt(20 * 20 - 4 * 4), 1, "nor noise");
	ct_vol_free(&v);
}

/* What does not vary along all axes at once is anatomy, however flat tissue is elsewhere. */
static void test_anatomy(void)
{
	struct ct_vol v;

	alloc(&v, N);
	fill(&v, 40, 20, 0);
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] += 20 * (float)(i % 2 + i / N % 2 + i / N / N % 2);
	NEAR(measure(&v).sure, 20, 0.7, "texture that lies along the axes is not noise");
	for (int a = 0; a < 3; a++)
		OK(measure(&v).alike[a] < 0.05, "nor alike");
	fill(&v, 40, 150, 0.7);
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		if (i % N < 12 || i / N / N < 4)
			v.data[i] = (i % N < 12 ? -980 : 40) + 20 * ct_rng_normal(8, 0, i);
	NEAR(measure(&v).sure, sqrt(20 * 20 - 4 * 4), 1.5, "what is flat counts, if it is little");
	for (int a = 0; a < 3; a++)
		OK(measure(&v).alike[a] < 0.1, "and alone");
	fill(&v, 40, 30, 0.6);
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = (i / N / N < 7 ? 40 : v.data[i]) + 20 * ct_rng_normal(8, 0, i);
	OK(measure(&v).alike[0] < 0.07, "a tenth of the blocks is more than enough: %.3g",
		measure(&v).alike[0]);
	fill(&v, 40, 20, 0.7);
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = (i / N / N < 3 ? 40 : v.data[i]) + 10 * ct_rng_normal(8, 0, i);
	NEAR(measure(&v).sure, sqrt(10 * 10 - 4 * 4), 1.5, "so is a fortieth");
	ct_vol_free(&v);
}

/* Blocks of +-a, whose deviation is exactly known: the planes 0 to 2 of more than 2 % of them, all
 * others `more` times as much. Of noise less than a block shows is seen once in 50 times if chi^2
 * of 23 degrees is below 11.2926. */
static double even(double more, double *alike)
{
	const double a = 25, sd = a * sqrt((27 - 1. / 27) / 23);
	struct ct_noise got;
	struct ct_vol v;

	alloc(&v, N);
	for (size_t i = 0; i < ct_vol_count(&v); i++) {
		const size_t at[3] = {i % N, i / N % N, i / N / N};
		const double sign = (at[0] + at[1] + at[2]) % 2 ? 1 : -1;

		v.data[i] = (float)(40 + a * sign * (at[2] < 3 && at[1] > 8 ? 1 : more));
	}
	got = measure(&v);
	*alike = fmax(got.alike[0], fmax(got.alike[1], got.alike[2]));
	ct_vol_free(&v);
	return got.sure * sqrt(11.2926 / 23) / sd;
}

static void test_even(void)
{
	double alike;

	NEAR(even(1.35, &alike), 1.35 * sqrt(11.2926 / 23), 0.015, "no more than most shows");
	OK(alike == 0, "neighbours of opposite sign are not alike");
	NEAR(even(1.5, &alike), 0.75, 0.003, "three quarters of what the flattest shows");
	NEAR(even(1.7, &alike), 0.25, 0.003, "one quarter where tissue is less even");
	NEAR(even(1.85, &alike), 0, 0, "nothing where it is uneven");
}

/* `share` of the tissue of deviation few, the others of 80. */
static double common(double share, double few)
{
	struct ct_noise n;
	struct ct_vol v;

	alloc(&v, N);
	fill(&v, 0, 1, 0);
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = 40 + (float)(i / N / N < share * N ? few : 80) * v.data[i];
	n = measure(&v);
	ct_vol_free(&v);
	return n.common;
}

static void test_common(void)
{
	NEAR(common(1, 20), 20, 0.3, "all of one deviation");
	NEAR(common(0.24, 10), 10, 0.5, "a quarter of less");
	NEAR(common(0.11, 12), 80, 3, "a tenth is not most of the flattest quarter");
}

/* Of one slice less is said; of a line nothing. */
static void test_thin(void)
{
	struct ct_vol v;
	struct ct_noise n;

	alloc_box(&v, 90, 90, 3); /* the others are not to be looked at */
	white(&v, 20);
	for (size_t i = 3 * 90 * 90 - 1; i >= 90 * 90; i--)
		v.data[i] = 40;
	v.n[2] = 1;
	n = measure(&v);
	OK(n.sure > 15 && n.sure < 19.5, "one slice: %.3g HU for 18.3", n.sure);
	for (size_t i = 90 * 90 - 1; i > 0; i--)
		v.data[i] = (v.data[i] + v.data[i - 1] - 80) * (float)M_SQRT1_2 + 40;
	for (size_t i = 0; i < 2 * 90 * 90; i++)
		v.data[90 * 90 + i] = v.data[i];
	n = measure(&v);
	OK(n.sure > 10 && n.alike[0] == 0 && n.alike[1] == 0 && n.alike[2] == 0,
		"nothing of neighbours");
	ct_vol_free(&v);
	alloc_box(&v, 1, 2, 2000);
	white(&v, 20);
	n = measure(&v);
	OK(n.common == 0 && n.sure == 0, "a line");
	ct_vol_free(&v);
}

static void ball(struct ct_vol *v, double value, bool inside)
{
	for (size_t i = 0; i < ct_vol_count(v); i++) {
		const double x = (double)(i % N) - 19.5, y = (double)(i / N % N) - 19.5,
			     z = (double)(i / N / N) - 19.5;

		if ((x * x + y * y + z * z < 17 * 17) == inside)
			v->data[i] = (float)value;
	}
}

/* What is constant because it was cut away is not quiet, but tissue that is constant is. */
static void test_constant(void)
{
	static const double masks[] = {-2000, -1024, -1000, -512, 0};
	struct ct_vol v;
	size_t i = 0;

	alloc(&v, N);
	for (size_t k = 0; k < sizeof masks / sizeof *masks; k++) {
		fill(&v, 40, 20, 0);
		ball(&v, masks[k], false);
		NEAR(measure(&v).sure, sqrt(20 * 20 - 8 * 8), 2, "masked to a constant");
	}
	for (int lowest = 0; lowest < 2; lowest++) {
		fill(&v, 40, 20, 0); /* clipped within: holes, or bone */
		for (i = 0; i < ct_vol_count(&v); i++)
			if (i % N > 10 && i % N < 24 && i / N % N > 1 && i / N % N < 38 &&
				i / N / N > 1 && i / N / N < 38)
				v.data[i] = lowest ? -500 : 3071;
		NEAR(measure(&v).sure, sqrt(20 * 20 - 8 * 8), 2, "clipped at an end");
	}
	for (i = 0; i < ct_vol_count(&v); i++) /* bone that is most of it */
		v.data[i] = i % N < 22 ? 40 + 20 * ct_rng_normal(4, 0, i) : 3071;
	v.data[N - 1] = v.data[N * N - 1] = v.data[N * N * N - 1] = 0; /* corners */
	v.data[N * N * N - N * N + N - 1] = 0;
	OK(measure(&v).sure == 0, "two fifths of the highest value are no clipping");
	fill(&v, 40, 20, 0);
	for (i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = 8 * rintf(v.data[i] / 8);
	NEAR(measure(&v).sure, sqrt(20 * 20 + 64. / 12 - 8 * 8), 1.5, "rounded, not constant");
	for (i = 0; i < ct_vol_count(&v); i++) { /* bodies of two values, edges that jitter */
		const size_t x = i % N, y = i / N % N;

		v.data[i] = x < 8 ? -1000 : x < 20 ? 100 : x < 32 ? 50 : -1000;
		if (x == 8 || x == 20 || y % 8 == 0)
			v.data[i] += 400 * fabsf(ct_rng_normal(3, 0, i));
	}
	OK(measure(&v).sure == 0, "constant tissue: none");
	for (i = 0; i < ct_vol_count(&v); i++) { /* one body, of the highest value */
		const size_t x = i % N;

		v.data[i] = x < 8 || x > 30 ? -1000 : 100;
		if (x == 8 || x == 30)
			v.data[i] -= 100 * fabsf(ct_rng_normal(3, 0, i));
	}
	OK(measure(&v).sure == 0 && measure(&v).common == 0, "also at the highest value");
	ct_vol_free(&v);
}

/* Tissue that is nowhere flat: air tells. */
static void test_air(void)
{
	struct ct_vol v;

	alloc(&v, N);
	for (int k = 0; k < 7; k++) {
		/* clipped at the lowest value, at -1024, and padding, which are no air */
		static const double level[] = {-1000, -1000, -1000, 0, -997, -1020, -1500};
		const double noise = k == 1 || k > 3 ? 12 : 1;

		for (size_t i = 0; i < ct_vol_count(&v); i++) {
			const double texture = i / N / N < 4 ? 25 : 90; /* of some, of most */
			const bool out = i % N < 16 && k != 3;

			v.data[i] =
				(float)((out ? level[k] : 40) +
					(out ? noise : texture) * (double)ct_rng_normal(8, 0, i));
			if (out && (k == 2 || k == 4))
				v.data[i] = fmaxf(v.data[i], -1000);
			if (out && k == 5)
				v.data[i] = fmaxf(v.data[i], -1024);
		}
		if (k == 5)
			v.data[N * N + 20] = -1050; /* something below */
		if (k == 1)
			NEAR(measure(&v).sure, 12, 1.5, "that of air");
		else if (k == 0)
			NEAR(measure(&v).sure, 1, 0.1, "of quiet air, too");
		else
			OK(measure(&v).sure == 0, "no air is seen: %.3g", measure(&v).sure);
	}
	for (int lung = 0; lung < 2; lung++) {
		for (size_t i = 0; i < ct_vol_count(&v); i++)
			v.data[i] = (i % N > 15    ? 40
					    : lung ? -820
						   : -880) +
				    (i % N < 16 ? 8 : 20) * ct_rng_normal(9, 0, i);
		NEAR(measure(&v).sure, lung ? sqrt(8 * 8 - 4 * 4) : 16, 1.5,
			lung ? "lung is tissue" : "of flat tissue at most twice that of air");
	}
	ct_vol_free(&v);
}

static void test_few(void)
{
	struct ct_vol v;

	alloc_box(&v, 12, 13, 20); /* 1980 blocks */
	white(&v, 20);
	OK(measure(&v).sure == 0 && measure(&v).common > 15, "few blocks: nothing is sure");
	ct_vol_free(&v);
	alloc_box(&v, 12, 14, 19); /* 2040 */
	white(&v, 20);
	OK(measure(&v).sure > 15, "of more something is");
	v.data[70] = NAN;
	OK(ct_noise_measure(&(struct ct_noise){0}, &v, &err) < 0 && err.code == CT_ENUMERIC, "NaN");
	ct_vol_free(&v);
}

static void test_powers(void)
{
	double p[16], sum = 0;

	ct_consistency_powers(p, 16, 0);
	for (int k = 0; k < 16; k++)
		sum += fabs(p[k] - 1);
	NEAR(sum, 0, 1e-12, "white");
	ct_consistency_powers(p, 16, 0.5);
	sum = 0;
	for (int k = 0; k < 16; k++)
		sum += p[k] / 16;
	NEAR(sum, 1, 1e-12, "of mean 1");
	NEAR(p[8] / p[0],
		(1 - 2 * pow(.5, 4) + 2 * pow(.5, 16) + .03) /
			(1 + 1 + 2 * pow(.5, 4) + 2 * pow(.5, 9) + 2 * pow(.5, 16) + .03),
		1e-7, "a quarter of a cycle");
}

/* |S^-1 (D x - y)|^2 by cosines, as slow as they are. */
static double weighted(const float *r, size_t m, const double power[3][8])
{
	double sum = 0;

	for (size_t f = 0; f < m * m * m; f++) {
		const size_t k[3] = {f % m, f / m % m, f / m / m};
		double c = 0, w = 1;

		for (size_t i = 0; i < m * m * m; i++) {
			const size_t at[3] = {i % m, i / m % m, i / m / m};
			double u = (double)r[i];

			for (int a = 0; a < 3; a++)
				u *= cos(M_PI * (double)k[a] * ((double)at[a] + .5) / (double)m) *
				     sqrt((k[a] ? 2.0 : 1.0) / (double)m);
			c += u;
		}
		for (int a = 0; a < 3; a++)
			w *= power[a][k[a]];
		sum += c * c / w;
	}
	return sum;
}

static void test_constraint(void)
{
	static const struct ct_degrade by[] = {{{2, 2, 2}, {1, 1, 1}, CT_DECIMATE_SINC, {0}},
		{{2, 2, 2}, {0}, CT_DECIMATE_MEAN, {0}}};
	static const double alike[3] = {0.6, 0.3, 0}, noise = 15;
	static const size_t n[3] = {16, 16, 16}, m = 8;
	double power[3][8];

	for (int a = 0; a < 3; a++)
		ct_consistency_powers(power[a], m, alike[a]);
	for (int c = 0; c < 2; c++) {
		struct ct_consistency dc = {0};
		struct ct_separable d;
		float x[16 * 16 * 16], y[8 * 8 * 8], r[8 * 8 * 8];

		for (size_t i = 0; i < m * m * m; i++)
			y[i] = 100 * ct_rng_normal(4, 0, i);
		for (size_t i = 0; i < 16 * 16 * 16; i++)
			x[i] = 100 * ct_rng_normal(5, 0, i);
		if (ct_consistency_alloc(&dc, &by[c], n, y, noise, NULL, &err) ||
			ct_consistency_colour(&dc, alike, &err) ||
			ct_degrade_plan(&d, &by[c], n, NULL, &err))
			exit(99);
		ct_consistency_apply(&dc, x, NULL);
		ct_separable_apply(&d, r, x, NULL);
		for (size_t i = 0; i < m * m * m; i++)
			r[i] -= y[i];
		NEAR(weighted(r, m, power) / (noise * noise * (double)(m * m * m)), 1, 1e-3,
			"misfit by its spectrum is that of the noise");
		ct_separable_free(&d);
		ct_consistency_free(&dc);
	}
}

static void test_slope(void)
{
	struct ct_vol v;
	struct ct_noise n;

	alloc_box(&v, 40, 42, 44);
	white(&v, 20);
	n = measure(&v);
	NEAR(n.common, 20, 1.5, "nothing but noise");
	NEAR(n.sure, sqrt(20 * 20 - 4 * 4), 0.5, "all of it, but for what texture may be");
	white(&v, 6);
	NEAR(measure(&v).sure, sqrt(6 * 6 - 4 * 4), 0.5, "of little noise, too");
	white(&v, 3.75);
	OK(measure(&v).sure == 0, "of less nothing is left");
	white(&v, 20);
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] += (float)(i % 40) * 30;
	NEAR(measure(&v).common, 20, 1.5, "a slope is not noise");
	for (size_t i = 0; i < ct_vol_count(&v); i++) /* half padding, a quarter clipped air */
		if (i % 4 < 3 && i / (40 * 42) > 10)
			v.data[i] = i / (40 * 42) > 30 ? -2000 : -1024;
	NEAR(measure(&v).common, 20, 1.5, "nor are air and padding");
	v.data[100] = NAN;
	OK(ct_noise_measure(&n, &v, &err) < 0 && err.code == CT_ENUMERIC, "NaN");
	ct_vol_free(&v);
}

/* Noise is everywhere; where a part of the tissue is flat, the rest is texture. */
static void test_texture(void)
{
	struct ct_vol v;
	struct ct_noise n;

	alloc(&v, 40);
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = 40 + (i / (40 * 40) < 3 ? 9 : 30) * ct_rng_normal(6, 0, i);
	n = measure(&v);
	NEAR(n.common, 30, 2, "what most of it shows");
	OK(n.sure == 0, "nothing is sure where a twentieth is flatter: all may be texture");
	for (size_t i = 0; i < 3 * 40 * 40; i++)
		v.data[i] = 40 + 3 * ct_rng_normal(6, 1, i);
	OK(measure(&v).sure == 0, "what texture may be is not");
	ct_vol_free(&v);
}

/* Rods of 1000 HU, 2 voxels wide and some 4 apart, with little noise. */
static void test_spongy(void)
{
	const double factor[3] = {4, 4, 4};
	struct ct_vol v;
	double busy, less;

	alloc(&v, 40);
	for (size_t i = 0; i < ct_vol_count(&v); i++) {
		const double x = (double)(i % 40), y = (double)(i / 40 % 40);
		const double z = (double)(i / (40 * 40));
		const double wave = sin(1.1 * x + .7 * z) + sin(1.3 * y - .5 * x) +
				    sin(.9 * z + .8 * y + .3 * x);

		v.data[i] = (float)(1000 / (1 + exp(-3 * (wave - 1)))) + 5 * ct_rng_normal(6, 2, i);
	}
	must(ct_noise_busy(&busy, &v, factor, 0, &err));
	OK(busy > CT_NOISE_BUSY, "spongy bone is busy throughout (%.3g)", busy);
	OK(measure(&v).common > 50 && measure(&v).sure == 0,
		"none of spongy bone is taken for noise");
	must(ct_noise_busy(&less, &v, factor, 100, &err));
	OK(less < busy, "noise that is known is no texture (%.3g)", less);
	for (int i = 0; i < 3; i++)
		v.affine[i][i] = 8;
	must(ct_noise_busy(&less, &v, factor, 0, &err));
	OK(less == 0, "blocks of voxels 8 mm apart tell nothing of texture");
	for (size_t i = 0; i < ct_vol_count(&v) / 2; i++)
		v.data[i] = 40 + 5 * ct_rng_normal(6, 3, i);
	must(ct_noise_busy(&busy, &v, factor, 0, &err));
	OK(busy < CT_NOISE_BUSY / 2, "a scan that is flat in one half is not busy (%.3g)", busy);
	ct_vol_free(&v);
}

/* Values that each block shows alike, as those of noise, but that lie to one side. */
static void test_lopsided(void)
{
	struct ct_vol v;

	alloc(&v, 40);
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = 40 + (ct_rng_uniform(6, 4, i) < 0.25 ? 400.F : 0);
	OK(measure(&v).common > 100 && measure(&v).sure == 0,
		"values that lie to one side are texture, not noise");
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = 40 + (ct_rng_uniform(6, 4, i) < 0.5 ? 400.F : 0);
	OK(measure(&v).sure > 100, "values on both sides may be noise");
	ct_vol_free(&v);
}

/* A chessboard of 0 and 1: the squares of a block of 3 x 3 x 3, 13 of one and 14 of the other, over
 * the values that are free after a mean and a slope along each axis. The slopes are 0, but across
 * two planes, of 5 ones and of 4. */
static void test_chessboard(void)
{
	static const size_t size[][3] = {{20, 24, 16}, {60, 56, 1}, {60, 1, 56}, {2, 70, 44}};
	static const double square[] = {14 * 13 / 27.0 / 23, 5 * 4 / 9.0 / 6, 5 * 4 / 9.0 / 6,
		(9 * 9 / 18.0 - 1 / 18.0) / 14};

	for (int k = 0; k < 4; k++) {
		struct ct_vol v;

		alloc_box(&v, size[k][0], size[k][1], size[k][2]);
		for (size_t i = 0; i < ct_vol_count(&v); i++) {
			size_t x = i % size[k][0], y = i / size[k][0];

			v.data[i] = (x + y % size[k][1] + y / size[k][1]) % 2 ? 60 : 20;
		}
		NEAR(measure(&v).common / 40, sqrt(square[k]), 1e-5, "noise of a chessboard");
		NEAR(measure(&v).sure, sqrt(1600 * square[k] - (k > 0 ? 8 * 8 : 0)), 1e-4,
			"sure is never more");
		ct_vol_free(&v);
	}
}

int main(void)
{
	test_slope();
	test_texture();
	test_spongy();
	test_lopsided();
	test_chessboard();
	test_correlated();
	test_anatomy();
	test_even();
	test_common();
	test_thin();
	test_constant();
	test_air();
	test_few();
	test_powers();
	test_constraint();
	return tap_done();
}
