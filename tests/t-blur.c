/* Blur and noise found again in volumes that are known in closed form. */
#include "config.h"
#include "core/par.h"
#include "core/rng.h"
#include "resolution/degrade.h"
#include "resolution/blur.h"
#include "tap.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static const double four[3] = {4, 4, 4};

static void alloc(struct ct_vol *v, size_t x, size_t y, size_t z)
{
	struct ct_err e;

	*v = (struct ct_vol){0};
	if (ct_vol_alloc(v, (const size_t[3]){x, y, z}, &e))
		exit(99);
}

static struct ct_blur estimate(const struct ct_vol *v, const double factor[3])
{
	struct ct_blur s;
	struct ct_err e = {0};

	if (ct_blur_estimate(&s, v, factor, NULL, &e)) {
		printf("# %s\n", e.msg);
		exit(99);
	}
	return s;
}

/* A unit step at 0 after a Gaussian of sigma and the ideal low-pass at 1/2:
 * 1/2 + integral of sin(2 pi f t) / (pi f) exp(-2 pi^2 sigma^2 f^2) over f < 1/2. */
static double band_limited_step(double t, double sigma)
{
	const int n = 200;
	double sum = 0;

	for (int i = 0; i < n; i++) {
		const double f = (i + 0.5) / (2 * n);

		sum += sin(2 * M_PI * f * t) / (M_PI * f) *
		       exp(-2 * M_PI * M_PI * sigma * sigma * f * f) / (2 * n);
	}
	return 0.5 + sum;
}

/* A bar between two planes at nearly a right angle to `axis`, so that its faces pass through voxels
 * at many places. */
static void fill_bar(struct ct_vol *v, int axis, double sigma, bool sinc, double noise)
{
	const int b = (axis + 1) % 3, c = (axis + 2) % 3;
	size_t at[3], n = 0;

	for (at[2] = 0; at[2] < v->n[2]; at[2]++)
		for (at[1] = 0; at[1] < v->n[1]; at[1]++)
			for (at[0] = 0; at[0] < v->n[0]; at[0]++, n++) {
				const double t = (double)at[axis] - 0.113 * (double)at[b] -
						 0.071 * (double)at[c],
					     s = sigma * sqrt(2), lo = t - 8.2, hi = t - 20.2;
				const double f = sinc ? band_limited_step(lo, sigma) -
								 band_limited_step(hi, sigma)
						      : (erf(lo / s) - erf(hi / s)) / 2;

				v->data[n] = (float)(-100 + 1000 * f +
						     noise * (double)ct_rng_normal(5, 0, n));
			}
}

static void test_closed_form(void)
{
	static const double sigma[] = {0.25, 0.4247, 0.6};

	for (int axis = 0; axis < 3; axis++)
		for (int k = 0; k < 3; k++) {
			struct ct_vol v;
			struct ct_blur s;
			char name[80];

			alloc(&v, 30, 32, 34);
			fill_bar(&v, axis, sigma[k], true, 0);
			s = estimate(&v, four);
			snprintf(name, sizeof name, "axis %d, sigma %g", axis, sigma[k]);
			NEAR(s.axis[axis].measured, sigma[k], 0.01, name);
			OK(s.axis[axis].sigma < sigma[k] && s.axis[axis].sigma > 0.45 * sigma[k],
				"the one to assume is less");
			OK(s.axis[axis].edges > 500, "many edges");
			OK(s.axis[(axis + 1) % 3].edges == 0 &&
					s.axis[(axis + 2) % 3].sampling == CT_SAMPLING_UNKNOWN &&
					s.axis[(axis + 2) % 3].sigma == 0 &&
					isnan(s.axis[(axis + 2) % 3].measured),
				"the other axes have no edges: unknown");
			ct_vol_free(&v);
		}
}

static void test_point(void)
{
	struct ct_vol v;
	struct ct_blur s;

	alloc(&v, 30, 32, 34);
	fill_bar(&v, 0, 0.125, false, 0);
	s = estimate(&v, four);
	OK(s.axis[0].sampling == CT_SAMPLING_ALIASED && s.axis[0].sigma == 0,
		"point sampling is seen, and no blur assumed");
	OK(s.axis[0].aliasing > 0.7 && s.axis[0].aliasing <= 1, "nearly all power is there");
	fill_bar(&v, 0, 0.5, false, 0);
	s = estimate(&v, four);
	OK(s.axis[0].sampling == CT_SAMPLING_WELL, "a wide Gaussian needs no low-pass");
	NEAR(s.axis[0].measured, 0.5, 0.03, "and is measured as well");
	ct_vol_free(&v);
}

static void test_noise(void)
{
	static const double sd[] = {5, 30};
	struct ct_vol v;
	struct ct_blur s;

	alloc(&v, 40, 42, 44);
	for (int k = 0; k < 2; k++) {
		fill_bar(&v, 2, 0.4247, true, sd[k]);
		s = estimate(&v, four);
		NEAR(s.noise, sd[k], 0.15 * sd[k], "noise beside edges");
		NEAR(s.axis[2].measured, 0.4247, 0.02, "blur beside noise");
	}
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = 40 + 20 * ct_rng_normal(6, 0, i);
	s = estimate(&v, four);
	NEAR(s.noise, 20, 1.5, "nothing but noise");
	NEAR(s.sure, sqrt(20 * 20 - 6 * 6), 0.5, "all of it, but for what texture may be");
	OK(s.axis[0].edges + s.axis[1].edges + s.axis[2].edges == 0, "has no edges");
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] += (float)(i % 40) * 30;
	NEAR(estimate(&v, four).noise, 20, 1.5, "a slope is not noise");
	for (size_t i = 0; i < ct_vol_count(&v); i++) /* half padding, a quarter clipped air */
		if (i % 4 < 3 && i / (40 * 42) > 10)
			v.data[i] = i / (40 * 42) > 30 ? -2000 : -1024;
	NEAR(estimate(&v, four).noise, 20, 1.5, "nor are air and padding");
	ct_vol_free(&v);
}

/* Noise is everywhere; where a part of the tissue is flat, the rest is texture. */
static void test_texture(void)
{
	struct ct_vol v;
	struct ct_blur s;

	alloc(&v, 40, 40, 40);
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = 40 + (i / (40 * 40) < 3 ? 9 : 30) * ct_rng_normal(6, 0, i);
	s = estimate(&v, four);
	NEAR(s.noise, 30, 2, "what most of it shows");
	OK(s.sure == 0, "nothing is sure where a twentieth is flatter: all may be texture");
	for (size_t i = 0; i < 3 * 40 * 40; i++)
		v.data[i] = 40 + 3 * ct_rng_normal(6, 1, i);
	OK(estimate(&v, four).sure == 0, "what texture may be is not");
	ct_vol_free(&v);
}

/* A chessboard of 0 and 1: the squares of a block of 3 x 3 x 3, 13 of one and 14 of the other, over
 * the values that are free after a mean and a slope along each axis. The slopes are 0, but across
 * two planes, of 5 ones and of 4. */
static void test_chessboard(void)
{
	static const size_t size[][3] = {{20, 24, 16}, {40, 36, 1}, {40, 1, 36}, {2, 60, 24}};
	static const double square[] = {14 * 13 / 27.0 / 23, 5 * 4 / 9.0 / 6, 5 * 4 / 9.0 / 6,
		(9 * 9 / 18.0 - 1 / 18.0) / 14};

	for (int k = 0; k < 4; k++) {
		struct ct_vol v;

		alloc(&v, size[k][0], size[k][1], size[k][2]);
		for (size_t i = 0; i < ct_vol_count(&v); i++) {
			size_t x = i % size[k][0], y = i / size[k][0];

			v.data[i] = (x + y % size[k][1] + y / size[k][1]) % 2 ? 60 : 20;
		}
		NEAR(estimate(&v, four).noise / 40, sqrt(square[k]), 1e-5, "noise of a chessboard");
		NEAR(estimate(&v, four).sure, sqrt(1600 * square[k] - 36), 1e-4,
			"sure is never more");
		ct_vol_free(&v);
	}
}

/* A ball, reduced by the operators themselves. */
static void test_protocols(void)
{
	static const enum ct_sampling want[] = {
		CT_SAMPLING_WELL, CT_SAMPLING_SHARP, CT_SAMPLING_ALIASED};
	static const double factor[2][3] = {{4, 4, 4}, {1, 1, 4}};
	struct ct_vol hi, lo;
	struct ct_err e;
	size_t i = 0;

	alloc(&hi, 96, 96, 96);
	for (int z = 0; z < 96; z++)
		for (int y = 0; y < 96; y++)
			for (int x = 0; x < 96; x++, i++) {
				const double r = hypot(hypot(x - 47.2, y - 46.9), z - 47.6);

				hi.data[i] =
					(float)(-1000 + 530 * erfc((r - 38) / (0.6 * sqrt(2))));
			}
	for (int f = 0; f < 2; f++)
		for (int p = 1; p <= 3; p++) {
			struct ct_degrade d = {.decimate = CT_DECIMATE_SINC};
			struct ct_separable s;
			struct ct_blur g;

			memcpy(d.factor, factor[f], sizeof d.factor);
			ct_degrade_protocol(&d, p);
			alloc(&lo, f ? 96 : 24, f ? 96 : 24, 24);
			if (ct_degrade_plan(&s, &d, hi.n, NULL, &e))
				exit(99);
			ct_separable_apply(&s, lo.data, hi.data, NULL);
			ct_separable_free(&s);
			g = estimate(&lo, factor[f]);
			for (int a = f ? 2 : 0; a < 3; a++)
				OK(g.axis[a].sampling == want[p - 1] &&
						g.axis[a].sigma * 4 <= 1.1 * d.sigma[a],
					"P%d %s, axis %d: %s, %.3f for %.3f", p, f ? "1x1x4" : "4x",
					a, CT_WORD(CT_SAMPLING_LIST, g.axis[a].sampling),
					g.axis[a].sigma * 4, d.sigma[a]);
			ct_vol_free(&lo);
		}
	ct_vol_free(&hi);
}

static void test_degenerate(void)
{
	static const size_t size[][3] = {{1, 1, 1}, {50, 1, 1}, {1, 1, 50}, {2, 2, 2}, {1, 40, 40},
		{7, 7, 7}, {8, 8, 8}, {3, 100, 2}};
	struct ct_vol v;
	struct ct_blur s;
	struct ct_err e;

	for (size_t k = 0; k < sizeof size / sizeof *size; k++) {
		bool none = true;

		alloc(&v, size[k][0], size[k][1], size[k][2]);
		for (size_t i = 0; i < ct_vol_count(&v); i++)
			v.data[i] = -1000;
		s = estimate(&v, four);
		for (int a = 0; a < 3; a++)
			none &= s.axis[a].edges == 0 && s.axis[a].sigma == 0 &&
				s.axis[a].sampling == CT_SAMPLING_UNKNOWN;
		OK(none && s.noise == 0, "constant %zux%zux%zu", size[k][0], size[k][1],
			size[k][2]);
		ct_vol_free(&v);
	}
	alloc(&v, 30, 32, 1); /* one slice is enough for the axes in it */
	fill_bar(&v, 0, 0.4247, true, 3);
	s = estimate(&v, four);
	OK(s.axis[2].sampling == CT_SAMPLING_UNKNOWN, "one slice: nothing across it");
	NEAR(s.axis[0].measured, 0.4247, 0.03, "the blur in it");
	OK(s.noise > 2.4 && s.noise < 5, "and its noise, few blocks of which are flat");
	OK(ct_blur_estimate(&s, &v, (const double[3]){4, 0.5, 4}, NULL, &e) < 0 &&
			e.code == CT_EINPUT,
		"a factor below 1");
	v.data[100] = NAN;
	OK(ct_blur_estimate(&s, &v, four, NULL, &e) < 0 && e.code == CT_ENUMERIC, "NaN");
	ct_vol_free(&v);
}

static void test_padding(void)
{
	struct ct_vol v;
	struct ct_blur s;

	alloc(&v, 30, 32, 34);
	fill_bar(&v, 0, 0.4247, true, 0);
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		if (i / 30 % 32 > 20)
			v.data[i] = -2000;
	s = estimate(&v, four);
	OK(s.axis[1].edges == 0, "the border of padding is not an edge");
	NEAR(s.axis[0].measured, 0.4247, 0.01, "and beside it nothing changes");
	ct_vol_free(&v);
}

static void test_threads(void)
{
	struct ct_vol v;
	struct ct_blur one, many;
	struct ct_par *par;
	struct ct_err e;

	alloc(&v, 30, 32, 34);
	fill_bar(&v, 1, 0.3, true, 15);
	one = estimate(&v, four);
	if (ct_par_alloc(&par, 3, &e) || ct_blur_estimate(&many, &v, four, par, &e))
		exit(99);
	OK(memcmp(&one.axis[1], &many.axis[1], sizeof one.axis[1]) == 0 && one.noise == many.noise,
		"three threads, the same bytes");
	ct_par_free(par);
	ct_vol_free(&v);
}

/* Lines along `axis` that all hold the differences d[0..count) around their middle, from `base` on,
 * scaled by 1000; of every second line, `other` if there is one. */
static void fill_lines(
	struct ct_vol *v, int axis, const double *d, const double *other, int count, double base)
{
	size_t at[3], i = 0;

	for (at[2] = 0; at[2] < v->n[2]; at[2]++)
		for (at[1] = 0; at[1] < v->n[1]; at[1]++)
			for (at[0] = 0; at[0] < v->n[0]; at[0]++) {
				const size_t block = (at[(axis + 1) % 3] + at[(axis + 2) % 3]) % 2;
				const double *use = other && block ? other : d;
				double value = base;

				for (int k = 0; k < count; k++)
					value += at[axis] > v->n[axis] / 2 - (size_t)count / 2 +
									 (size_t)k
							 ? 1000 * use[k]
							 : 0;
				v->data[i++] = (float)value;
			}
}

/* How many lines have an edge, of 12 x 13. */
static size_t lines(int axis, const double *d, int count, double base)
{
	size_t n[3], edges;
	struct ct_vol v;

	n[axis] = 16;
	n[(axis + 1) % 3] = 14;
	n[(axis + 2) % 3] = 15;
	alloc(&v, n[0], n[1], n[2]);
	fill_lines(&v, axis, d, NULL, count, base);
	edges = estimate(&v, four).axis[axis].edges;
	ct_vol_free(&v);
	return edges;
}

static void test_conditions(void)
{
	static const double rim[] = {0.01, 0, 0, 1};
	static const double noisy[][1] = {{0.401}, {0.399}};
	static const double large[] = {0.151}, small[] = {0.149}, back[] = {0, 1, 0, -0.13},
			    away[] = {-0.155, 0, 1, 0, 0}, down[] = {-0.3, -1, -0.2},
			    even[] = {0.5, 0.6, 0.4};

	for (int axis = 0; axis < 3; axis++) {
		if (axis > 0) /* along the first a block that holds the step counts as noise */
			OK(lines(axis, large, 1, 0) == 156 && lines(axis, small, 1, 0) == 0,
				"axis %d: steps of 150 HU", axis);
		OK(lines(0, noisy[0], 1, 0) == 156 && lines(0, noisy[1], 1, 0) == 0,
			"of 400 HU where there is noise");
		OK(lines(axis, back, 4, 0) == 156 && lines(axis, away, 5, 0) == 0,
			"that go one way");
		OK(lines(axis, down, 3, 500) == 156 && lines(axis, even, 3, 0) == 156,
			"down or up");
		OK(lines(axis, large, 1, -1099) == 156 && lines(axis, large, 1, -1101) == 0 &&
				lines(axis, down, 3, 401) == 156 && lines(axis, down, 3, 399) == 0,
			"not from padding, or to it");
		OK(lines(axis, rim, 4, -1099) == 156 && lines(axis, rim, 4, -1105) == 0,
			"nor where the window begins in it");
	}
}

/* A plane that leans: across it there is more change than along an axis, or less. */
static void test_lean(void)
{
	for (int k = 0; k < 4; k++) {
		const double lean = k % 2 ? 1.15 : 0.85;
		struct ct_blur s;
		struct ct_vol v;
		size_t i = 0;

		alloc(&v, 40, 20, 20);
		for (int z = 0; z < 20; z++)
			for (int y = 0; y < 20; y++)
				for (int x = 0; x < 40; x++)
					v.data[i++] =
						(float)(500 *
							erf((x - 20.3 -
								    lean * ((k / 2 ? z : y) - 10)) /
								0.7));
		s = estimate(&v, four);
		OK((s.axis[0].edges > 100) == (k % 2 == 0) &&
				(s.axis[k / 2 ? 2 : 1].edges > 100) == (k % 2) &&
				s.axis[k / 2 ? 1 : 2].edges == 0,
			"an edge belongs to the axis along which it is steepest (%zu, %zu)",
			s.axis[0].edges, s.axis[k / 2 ? 2 : 1].edges);
		ct_vol_free(&v);
	}
}

/* r(1)/r(0) of an edge that is blurred by sigma, by many more points. */
static double ratio(double sigma)
{
	double sum[2] = {0};

	for (int i = 0; i < 4000; i++) {
		const double t = M_PI * (i + 0.5) / 8000,
			     s = pow(sin(t) / t, 2) * exp(-4 * t * t * sigma * sigma);

		sum[0] += s;
		sum[1] += s * cos(2 * t);
	}
	return sum[1] / sum[0];
}

static double sigma_of(double r)
{
	double lo = 0, hi = 1;

	for (int k = 0; k < 30; k++)
		*(ratio((lo + hi) / 2) < r ? &lo : &hi) = (lo + hi) / 2;
	return lo;
}

/* Of lines whose differences are known all figures are sums of a few terms. */
static void test_figures(void)
{
	static const double kinds[][3] = {{0.1, 0.8, 0.1}, {0.17, 0.66, 0.17}, {0.125, 0.75, 0.125},
		{0.15, 0.6, 0.25}, {0.126, 0.748, 0.126}, {0.1715, 0.657, 0.1715},
		{0.1735, 0.653, 0.1735}};
	static const double factor[] = {4, 1.5, 2, 8, 1, 4, 4};

	for (int k = 0; k < 14; k++) {
		const double *d[2] = {kinds[k % 7], kinds[k < 7 ? k : (k + 3) % 7]},
			     f = factor[k % 7];
		double r0[2] = {0}, r1[2] = {0}, re, im, power = 0, rho, error, measured, sharp;
		struct ct_blur s;
		struct ct_vol v;

		for (int h = 0; h < 2; h++) {
			re = im = 0;
			for (int q = 0; q < 3; q++) {
				r0[h] += d[h][q] * d[h][q];
				r1[h] += q ? d[h][q] * d[h][q - 1] : 0;
				re += d[h][q] * cos(0.8 * M_PI * q);
				im += d[h][q] * sin(0.8 * M_PI * q);
			}
			power += (re * re + im * im) / 2;
		}
		rho = (r1[0] + r1[1]) / (r0[0] + r0[1]);
		error = sqrt((pow(r1[0] - rho * r0[0], 2) + pow(r1[1] - rho * r0[1], 2)) * 60) /
			(60 * (r0[0] + r0[1]));
		measured = sigma_of(rho);
		sharp = sigma_of(rho - 2 * error);
		alloc(&v, 14, 12, 14); /* 120 lines inside */
		fill_lines(&v, 0, d[0], d[1], 3, 0);
		s = estimate(&v, (const double[3]){f, f, f});
		OK(s.axis[0].edges == 120 && fabs(s.axis[0].measured - measured) < 1e-3,
			"lines %d: blur %.4f", k, s.axis[0].measured);
		NEAR(s.axis[0].sigma, 0.64 * sqrt(fmax(0, sharp * sharp - pow(0.6 / f, 2))), 2e-3,
			"to assume");
		NEAR(s.axis[0].aliasing, power, 1e-5, "power");
		OK(s.axis[0].sampling == (power < 0.141          ? CT_SAMPLING_WELL
						 : power < 0.292 ? CT_SAMPLING_SHARP
								 : CT_SAMPLING_ALIASED),
			"sampling");
		ct_vol_free(&v);
	}
}

/* An edge wider than any that is told apart. */
static void test_wide(void)
{
	static const double d[] = {0.13, 0.14, 0.15, 0.16, 0.15, 0.14, 0.13};
	struct ct_blur s;
	struct ct_vol v;

	alloc(&v, 20, 12, 14);
	fill_lines(&v, 0, d, NULL, 7, 0);
	s = estimate(&v, four);
	OK(s.axis[0].edges == 120, "wide edges: %zu", s.axis[0].edges);
	NEAR(s.axis[0].measured, 1, 1e-9, "a sample at most");
	ct_vol_free(&v);
}

/* Eleven edges tell nothing, twelve do. */
static void test_few(void)
{
	static const double d[] = {0.1, 0.8, 0.1};
	struct ct_blur s;
	struct ct_vol v;

	alloc(&v, 14, 13, 3);
	fill_lines(&v, 0, d, NULL, 3, 0);
	s = estimate(&v, four);
	OK(s.axis[0].edges == 11 && isnan(s.axis[0].measured) &&
			s.axis[0].sampling == CT_SAMPLING_UNKNOWN,
		"eleven edges");
	ct_vol_free(&v);
	alloc(&v, 14, 12, 1);
	fill_lines(&v, 0, d, NULL, 3, 0);
	s = estimate(&v, four);
	OK(s.axis[0].edges == 10, "ten in a slice of twelve lines");
	ct_vol_free(&v);
	alloc(&v, 9, 6, 5); /* the shortest lines */
	fill_lines(&v, 0, d, NULL, 3, 0);
	s = estimate(&v, four);
	OK(s.axis[0].edges == 12 && s.axis[0].measured > 0, "twelve");
	ct_vol_free(&v);
	alloc(&v, 7, 9, 9);
	fill_lines(&v, 0, d, NULL, 3, 0);
	OK(estimate(&v, four).axis[0].edges == 0, "of a line too short none");
	ct_vol_free(&v);
}

int main(void)
{
	test_conditions();
	test_lean();
	test_figures();
	test_wide();
	test_few();
	test_closed_form();
	test_point();
	test_noise();
	test_texture();
	test_chessboard();
	test_protocols();
	test_degenerate();
	test_padding();
	test_threads();
	return tap_done();
}
