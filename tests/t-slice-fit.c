/* The slice profile from thick and thin slices of a phantom whose profile is known; the spread and
 * the sampling of a phantom's profiles are found again.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "estimate/edge-lines.h"
#include "estimate/profile.h"
#include "estimate/slice-fit.h"
#include "operator/degrade.h"
#include "operator/padding.h"
#include "numbers.h"
#include "tap.h"

#include <stdbool.h>
#include <string.h>

enum { SIDE = 96 };

/* Balls of many sizes and densities in air, with soft edges of `soft` voxels. */
static void phantom(struct ct_vol *v, double soft)
{
	must(ct_vol_alloc(v, (const size_t[3]){SIDE, SIDE, SIDE}, &err));
	for (size_t i = 0; i < ct_vol_count(v); i++)
		v->data[i] = -1000;
	for (uint64_t b = 0; b < 60; b++) {
		const double r = 4 + 10 * ct_rng_uniform(1, b, 0);
		const double hu = 100 + 900 * ct_rng_uniform(1, b, 1);
		double c[3];

		for (int a = 0; a < 3; a++)
			c[a] = SIDE * ct_rng_uniform(1, b, 2 + (uint64_t)a);
		for (size_t i = 0; i < ct_vol_count(v); i++) {
			const double d = sqrt(pow((double)(i % SIDE) - c[0], 2) +
					      pow((double)(i / SIDE % SIDE) - c[1], 2) +
					      pow((double)(i / SIDE / SIDE) - c[2], 2));
			const double in = 0.5 * erfc((d - r) / (sqrt(2) * soft));

			v->data[i] = (float)((1 - in) * (double)v->data[i] + in * hu);
		}
	}
	for (int a = 0; a < 3; a++)
		v->affine[a][a] = 1;
}

static struct ct_vol reduced(const struct ct_vol *v, const struct ct_degrade *d, double noise)
{
	struct ct_vol lo = {0};

	must(ct_degrade_volume(&lo, v, d, noise, 3, NULL, &err));
	for (size_t i = 0; i < ct_vol_count(&lo); i++)
		lo.data[i] = rintf(lo.data[i]);
	return lo;
}

static void found(const struct ct_vol *v)
{
	static const struct {
		struct ct_degrade d;
		double spread; /* LR voxels */
	} cases[] = {{{{4, 4, 4}, {1.7, 1.7, 1.7}, CT_DECIMATE_SINC, {0}}, 0.425},
		{{{3, 3, 3}, {0.4, 0.4, 0.4}, CT_DECIMATE_POINT, {0}}, 0.133},
		{{{1, 1, 4}, {0}, CT_DECIMATE_MEAN, {0}}, 0.289},
		{{{1, 1, 5}, {0, 0, 1.86}, CT_DECIMATE_POINT, {0}}, 0.372}};

	for (size_t k = 0; k < 8; k++) {
		const struct ct_degrade *d = &cases[k / 2].d;
		struct ct_vol lo = reduced(v, d, k % 2 ? 15 : 0);
		struct ct_profile got[3];

		must(ct_profile_measure(got, &lo, d->factor, NULL, &err));
		for (int a = 0; a < 3; a++) {
			if (d->factor[a] > 1)
				OK(fabs(got[a].spread - cases[k / 2].spread) < 0.07 &&
						got[a].edges > 100 && got[a].deviation > 0 &&
						got[a].deviation < 1,
					"case %zu, axis %d: %.3f for %.3f", k, a, got[a].spread,
					cases[k / 2].spread);
			else
				OK(isnan(got[a].spread), "an axis that stays");
		}
		OK((got[2].aliases > 0.5) == (d->decimate != CT_DECIMATE_SINC),
			"case %zu aliases with %.2f", k, got[2].aliases);
		ct_vol_free(&lo);
	}
}

/* What is soft along another axis too is soft by itself. */
static void soft(void)
{
	const struct ct_degrade d = {{1, 1, 4}, {0}, CT_DECIMATE_MEAN, {0}};
	struct ct_profile got[3];
	struct ct_vol v = {0}, lo;

	phantom(&v, 1.5);
	lo = reduced(&v, &d, 0);
	must(ct_profile_measure(got, &lo, d.factor, NULL, &err));
	OK(got[2].spread < 0.48, "soft edges count less: %.3f for .289", got[2].spread);
	ct_vol_free(&lo);
	ct_vol_free(&v);
}

/* Padding is no edge, and neither is too small a scan one. */
static void nothing(const struct ct_vol *v)
{
	const size_t few[3] = {12, 12, 12};
	static float rows[CT_EDGE_PLACES][CT_EDGE_ROW];
	struct ct_vol half = {0};
	struct ct_padding p;
	size_t n;

	must(ct_vol_alloc(&half, v->n, &err));
	for (size_t i = 0; i < ct_vol_count(v); i++)
		half.data[i] = i % SIDE < SIDE / 2 ? -1024 : 500 + 2 * ct_rng_normal(1, 0, i);
	must(ct_padding_find(&p, half.data, half.n, &err));
	must(ct_edge_lines_draw(rows, CT_EDGE_PLACES, &n, NULL, half.data, p.is, half.n, 0, &err));
	OK(n == 0, "the border of padding is no edge");
	ct_padding_free(&p);
	for (size_t i = 0; i < ct_vol_count(v); i++)
		half.data[i] = (i % SIDE < SIDE / 2 ? 40 : 4000) + 2 * ct_rng_normal(1, 0, i);
	must(ct_edge_lines_draw(rows, CT_EDGE_PLACES, &n, NULL, half.data, NULL, half.n, 0, &err));
	OK(n == 0, "metal is no edge");
	must(ct_edge_lines_draw(rows, CT_EDGE_PLACES, &n, NULL, v->data, NULL, few, 2, &err));
	OK(n == 0, "12 voxels are too few");
	must(ct_edge_lines_draw(rows, CT_EDGE_PLACES, &n, NULL, v->data, NULL, v->n, 2, &err));
	OK(n == CT_EDGE_PLACES && fabsf(rows[0][5] + 0.5f) < 1e-5f &&
			fabsf(rows[0][6] - 0.5f) < 1e-5f,
		"a row goes up by one step in its middle");
	ct_vol_free(&half);
}

/* In a synthetic CT air is constant, and so are all shapes of the highest value: what such lines
 * show counts if there is nothing else, and little. */
static void clipped_edges(void)
{
	const struct ct_degrade d = {{4, 4, 4}, {1.2, 1.2, 1.2}, CT_DECIMATE_POINT, {0}};
	static float rows[CT_EDGE_PLACES][CT_EDGE_ROW];
	struct ct_vol v = {0}, lo;
	struct ct_profile got[3];
	bool is = false;
	size_t n;

	must(ct_vol_alloc(&v, (const size_t[3]){SIDE, SIDE, SIDE}, &err));
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = i % SIDE + i / SIDE % SIDE < SIDE + 10 ? -1000 : 400;
	lo = reduced(&v, &d, 0);
	must(ct_edge_lines_draw(rows, CT_EDGE_PLACES, &n, NULL, lo.data, NULL, lo.n, 0, &err));
	OK(n == 0, "clipped lines do not count");
	must(ct_edge_lines_draw(rows, CT_EDGE_PLACES, &n, &is, lo.data, NULL, lo.n, 0, &err));
	OK(n > 0 && is, "but if there are no others: %zu", n);
	must(ct_profile_measure(got, &lo, d.factor, NULL, &err));
	OK(got[0].deviation == 1 && got[0].spread > 0.15 && got[0].spread < 0.55 &&
			isnan(got[2].spread),
		"and then they show a spread that is not sure: %.3f for .325", got[0].spread);
	must(ct_edge_lines_draw(rows, CT_EDGE_PLACES, &n, &is, v.data, NULL, v.n, 2, &err));
	OK(n == 0, "no edge: nothing");
	ct_vol_free(&lo);
	ct_vol_free(&v);
}

static void t_profile(void)
{
	struct ct_vol v = {0};

	phantom(&v, 0.5);
	found(&v);
	nothing(&v);
	clipped_edges();
	soft();
	ct_vol_free(&v);
}

enum { N = 24, THIN = 160 };
static const double h = 1.25; /* mm */
/* Not symmetric, sum 1. */
static const double known[9] = {0.02, 0.06, 0.12, 0.18, 0.2, 0.18, 0.13, 0.07, 0.04};

/* Thick slices, `spacing` thin ones apart, the first at thin slice `at`. */
struct scene {
	int axis;
	size_t slices, cover;                     /* thick; thin ones from slice `begin` on */
	double spacing, at, texture, noise, told; /* told: mm too much in its header */
	size_t begin;
	bool reversed, smooth;
};
static const struct scene plain = {
	.axis = 2, .slices = 26, .cover = THIN, .spacing = 5, .at = 12, .texture = 200};
static struct scene now;
#define SCENE(...) (now = plain, __VA_ARGS__, &now)

static struct ct_vol thick, thin;
static struct ct_env env;
static struct ct_slice_fit s;

static double normal(uint64_t stream, size_t i)
{
	return (double)ct_rng_normal(7, stream, i);
}

static void grid(struct ct_vol *v, int axis, size_t slices, double mm, double from)
{
	static const double plane[3] = {0.9, 0.8, 0.7};
	size_t n[3] = {N, N - 2, N - 3};

	n[axis] = slices;
	ct_vol_free(v);
	must(ct_vol_alloc(v, n, &err));
	memset(v->affine, 0, sizeof v->affine);
	for (int a = 0; a < 3; a++) {
		v->affine[a][a] = a == axis ? mm : plane[a];
		v->affine[a][3] = a == axis ? from : -30;
	}
}

static float *voxel(const struct ct_vol *v, int axis, size_t line, size_t k)
{
	const size_t *n = v->n, b = axis == 0 ? 1 : 0, c = axis == 2 ? 1 : 2;
	size_t at[3] = {0};

	at[axis] = k;
	at[b] = line % n[b];
	at[c] = line / n[b];
	return &v->data[(at[2] * n[1] + at[1]) * n[0] + at[0]];
}

/* An object of THIN slices: what it is at slice k of a line. */
static double object(const struct scene *c, size_t line, size_t k)
{
	double sum = 0;

	if (!c->smooth)
		return c->texture * normal(0, line * THIN + k);
	for (int q = -8; q <= 8; q++)
		sum += exp(-q * q / 8.0) * normal(0, line * THIN + k + 8 + (size_t)q);
	return c->texture * sum / 3;
}

static double between(const struct scene *c, size_t line, double k)
{
	const double low = floor(k), part = k - low;

	return (1 - part) * object(c, line, (size_t)low) +
	       (part > 0 ? part * object(c, line, (size_t)low + 1) : 0);
}

static void make(const struct scene *c)
{
	size_t lines;

	grid(&thick, c->axis, c->slices, c->spacing * h, c->at * h + c->told);
	grid(&thin, c->axis, c->cover, h, (double)c->begin * h);
	lines = ct_vol_count(&thin) / c->cover;
	for (size_t l = 0; l < lines; l++) {
		for (size_t k = 0; k < c->cover; k++)
			*voxel(&thin, c->axis, l, c->reversed ? c->cover - 1 - k : k) =
				(float)object(c, l, c->begin + k);
		for (size_t k = 0; k < c->slices; k++) {
			double sum = 20 + c->noise * normal(1, l * c->slices + k);

			for (int q = -4; q <= 4; q++)
				sum += known[q + 4] *
				       between(c, l, c->at + c->spacing * (double)k + q);
			*voxel(&thick, c->axis, l, k) = (float)sum;
		}
	}
	if (c->reversed) {
		thin.affine[c->axis][3] += h * (double)(c->cover - 1);
		thin.affine[c->axis][c->axis] = -h;
	}
}

/* The known profile at z thin slices from the middle. */
static double at(double z)
{
	double sum = 0;

	for (int q = -4; q <= 4; q++)
		sum += known[q + 4] * fmax(1 - fabs(z - q), 0);
	return sum;
}

/* The largest error of a weight, and in *score in its standard errors. */
static double worst(double *score)
{
	double most = 0;

	*score = 0;
	for (size_t i = 0; i < s.profile.n; i++) {
		const double z = s.profile.first + (double)i * s.profile.step;
		const double off = fabs(s.profile.w[i] - at(z / h));

		most = fmax(most, off);
		*score = fmax(*score, off / s.error[i]);
	}
	return most;
}

static void finds(const char *what, const struct scene *c, double tol)
{
	double score, sum = 0, mean = 0;

	make(c);
	must(ct_slice_fit(&s, &thick, &thin, &env, &err));
	NEAR(worst(&score), 0, tol, what);
	for (int q = -4; q <= 4; q++) {
		sum += known[q + 4];
		mean += known[q + 4] * q;
	}
	NEAR(s.sum, sum, 2 * tol, "its sum");
	NEAR(s.centre + s.shift, mean * h - c->told, 5 * tol, "its centre");
	OK(s.axis == c->axis && fabs(s.thick - c->spacing * h) < 1e-9 && fabs(s.thin - h) < 1e-9,
		"axis and spacings");
}

static void cases(void)
{
	double score;

	finds("every fifth slice", &plain, 1e-3);
	OK(s.profile.n == 9 && fabs(s.profile.first + 4 * h) < 1e-9,
		"only its nine samples are left");
	NEAR(s.residual, 0, 0.05, "no residual");
	OK(s.condition < 3, "white texture is well conditioned: %g", s.condition);
	OK(s.explained > 1 - 1e-6 && s.box_residual > 10 && s.gaussian_residual > 1 &&
			s.gaussian_residual < s.box_residual,
		"a Gaussian fits less, a box least");
	NEAR(s.sigma / h, sqrt(3.4731 + 1.0 / 6), 1e-2, "sigma");
	OK(s.slices == 26, "all slices");
	finds("an axis of rows", SCENE(now.axis = 0), 1e-3);
	finds("an axis of columns, thin slices the other way",
		SCENE(now.axis = 1, now.reversed = true), 1e-3);
	finds("between two thin slices", SCENE(now.at = 12.5), 1e-3);
	NEAR(fmod(fabs(s.profile.first) / h, 1), 0.5, 1e-9, "the samples lie on thin slices");
	finds("3.7 thin slices apart", SCENE(now.spacing = 3.7, now.slices = 36), 1e-3);
	finds("they overlap", SCENE(now.spacing = 2, now.slices = 60), 1e-3);
	finds("with gaps", SCENE(now.spacing = 12, now.slices = 11), 1e-3);
	finds("as many thick slices as thin ones", SCENE(now.spacing = 1, now.slices = 120), 1e-3);
	finds("thin slices begin elsewhere, cover a part", SCENE(now.begin = 37, now.cover = 60),
		1e-3);
	OK(s.slices == 8, "of which fewer count: %zu", s.slices);
	finds("thin slices cover little", SCENE(now.begin = 37, now.cover = 32), 1e-3);
	finds("the header is three slices off", SCENE(now.told = 3 * h), 1e-3);
	NEAR(s.shift, -3 * h, 1e-9, "and that is said");
	NEAR(s.profile.first, -4 * h, 1e-9, "but not in the samples");
	finds("noise", SCENE(now.noise = 20), 1e-2);
	worst(&score);
	OK(score > 0.5 && score < 5, "standard errors are as large as errors: %g of them", score);
	NEAR(s.residual, 20, 0.5, "the residual is the noise");
	make(SCENE(now.smooth = true, now.noise = 2));
	must(ct_slice_fit(&s, &thick, &thin, &env, &err));
	NEAR(s.sigma / h, sqrt(3.4731 + 1.0 / 6), 0.05, "smooth thin slices: its sigma");
	OK(s.condition > 1e4, "though ill-conditioned: %g", s.condition);
}

static void refuses(const char *what, int code, const char *words)
{
	struct ct_err e = {0};

	OK(ct_slice_fit(&s, &thick, &thin, &env, &e) != 0 && (int)e.code == code &&
			strstr(e.msg, words),
		"%s: %s", what, e.msg);
}

static void refusals(void)
{
	make(&plain);
	thin.affine[1][1] = 0.85;
	refuses("voxels", CT_EGEOM,
		"along axis j the thick slices have voxels of 0.8 mm, the thin ones of 0.85 mm");
	make(&plain);
	thin.affine[0][3] += 0.5;
	refuses("place", CT_EGEOM,
		"along axis i the thick slices begin -0.5 mm from the thin ones");
	make(&plain);
	thin.affine[1][1] *= -1;
	refuses("direction", CT_EGEOM, "axis j");
	make(&plain);
	thin.n[1]--;
	refuses("size", CT_EGEOM,
		"along axis j the thick slices have 22 voxels of 0.8 mm, the thin ones 21");
	make(SCENE(now.spacing = 0.5, now.slices = 200));
	refuses("thin ones first", CT_EGEOM, "give the thick ones first");
	make(SCENE(now.begin = 20, now.cover = 14));
	refuses("cover", CT_EGEOM, "along axis k the thin slices cover");
	make(SCENE(now.texture = 10));
	refuses("texture", CT_EINPUT, "0 slices have 50 lines or more");
	make(&plain);
	for (size_t l = 0; l < N * (N - 2); l++)
		for (size_t k = 0; k < THIN; k++)
			*voxel(&thin, 2, l, k) = (float)(10 * k);
	refuses("ramps", CT_EINPUT, "the thin slices do not determine the profile");
	make(&plain);
	thin.data[7] = (float)NAN;
	refuses("NaN", CT_ENUMERIC, "the thin slices");
	make(&plain);
	thick.data[7] = (float)INFINITY;
	refuses("infinity", CT_ENUMERIC, "the thick slices");
}

static void clipped(void)
{
	double score;

	make(SCENE(now.texture = 550));
	for (size_t i = 0; i < ct_vol_count(&thin); i++)
		thin.data[i] = fminf(fmaxf(thin.data[i], -1024), 3071);
	must(ct_slice_fit(&s, &thick, &thin, &env, &err));
	NEAR(worst(&score), 0, 1e-3, "clipped voxels do not count");
}

static void threads(void)
{
	struct ct_slice_fit one;

	make(SCENE(now.noise = 3));
	must(ct_slice_fit(&one, &thick, &thin, &env, &err));
	must(ct_par_alloc(&env.par, 3, &err));
	must(ct_slice_fit(&s, &thick, &thin, &env, &err));
	OK(memcmp(&one, &s, sizeof s) == 0, "the same bytes with three threads");
	ct_par_free(env.par);
}

int main(void)
{
	cases();
	refusals();
	clipped();
	threads();
	ct_vol_free(&thick);
	ct_vol_free(&thin);
	t_profile();
	return tap_done();
}
