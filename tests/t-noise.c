/* Noise found again where it is known, and what it is to the data constraint. */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "resolution/consistency.h"
#include "resolution/noise.h"
#include "tap.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N = 40 };

static struct ct_err err;

static void alloc(struct ct_vol *v, size_t n)
{
	*v = (struct ct_vol){0};
	if (ct_vol_alloc(v, (const size_t[3]){n, n, n}, &err))
		exit(99);
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
	static const double sigma[] = {0, 0.5, 0.7, 0.9};
	struct ct_vol v;

	alloc(&v, N);
	for (int k = 0; k < 4; k++) {
		const double rho = fill(&v, 40, 30, sigma[k]);
		const struct ct_noise n = measure(&v);

		OK(n.sure > (sigma[k] > 0.5 ? 15 : 25) && n.sure < 33, "sigma %g: %.3g HU for 30",
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
		NEAR(measure(&v).sure, sqrt(20 * 20 - 6 * 6), 2, "masked to a constant");
	}
	fill(&v, 40, 20, 0);
	for (i = 0; i < ct_vol_count(&v); i++) /* clipped bone */
		if (i % N > 30)
			v.data[i] = 3071;
	NEAR(measure(&v).sure, sqrt(20 * 20 - 6 * 6), 2, "clipped at the highest value");
	fill(&v, -1000, 0, 0);
	ball(&v, 40, true);
	for (i = 0; i < ct_vol_count(&v); i++) /* partly filled voxels at the border */
		v.data[i] += i / 3 % 7 == 0 && v.data[i] > 0 && i % N > 25 ? 300 : 0;
	ct_vol_free(&v);

	alloc(&v, N);
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
	for (int k = 0; k < 4; k++) {
		const double noise = k == 1 ? 12 : 1;

		for (size_t i = 0; i < ct_vol_count(&v); i++) {
			const double texture = i / N / N < 4 ? 25 : 90; /* of some, of most */
			const bool out = i % N < 16 && k < 3;

			v.data[i] =
				(float)((out ? -1000 : 40) +
					(out ? noise : texture) * (double)ct_rng_normal(8, 0, i));
			if (k == 2 && out)
				v.data[i] = fmaxf(v.data[i], -1000); /* clipped, half of it */
		}
		if (k == 1)
			NEAR(measure(&v).sure, sqrt(12 * 12 - 6 * 6), 1.5, "that of air");
		else
			OK(measure(&v).sure == 0, "no more than air shows, or none seen: %.3g",
				measure(&v).sure);
	}
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] =
			(i % N < 16 ? -950 : 40) + (i % N < 16 ? 8 : 20) * ct_rng_normal(9, 0, i);
	NEAR(measure(&v).sure, sqrt(16 * 16 - 6 * 6), 1.5,
		"of flat tissue at most twice that of air");
	ct_vol_free(&v);
}

static void test_few(void)
{
	struct ct_vol v;

	alloc(&v, 13); /* 216 blocks */
	fill(&v, 40, 20, 0);
	OK(measure(&v).sure == 0 && measure(&v).common > 15, "few blocks: nothing is sure");
	ct_vol_free(&v);
	alloc(&v, 15); /* 343 */
	fill(&v, 40, 20, 0);
	OK(measure(&v).sure > 15, "of more something is");
	v.data[70] = NAN;
	OK(ct_noise_measure(&(struct ct_noise){0}, &v, &err) < 0 && err.code == CT_ENUMERIC, "NaN");
	ct_vol_free(&v);
}

static void test_powers(void)
{
	double p[16], sum = 0;

	ct_noise_powers(p, 16, 0);
	for (int k = 0; k < 16; k++)
		sum += fabs(p[k] - 1);
	NEAR(sum, 0, 1e-12, "white");
	ct_noise_powers(p, 16, 0.5);
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
	static const struct ct_degrade by[] = {
		{{2, 2, 2}, {1, 1, 1}, CT_DECIMATE_SINC}, {{2, 2, 2}, {0}, CT_DECIMATE_MEAN}};
	static const double alike[3] = {0.6, 0.3, 0}, noise = 15;
	static const size_t n[3] = {16, 16, 16}, m = 8;
	double power[3][8];

	for (int a = 0; a < 3; a++)
		ct_noise_powers(power[a], m, alike[a]);
	for (int c = 0; c < 2; c++) {
		struct ct_consistency dc = {0};
		struct ct_separable d;
		float x[16 * 16 * 16], y[8 * 8 * 8], r[8 * 8 * 8], *scratch;

		for (size_t i = 0; i < m * m * m; i++)
			y[i] = 100 * ct_rng_normal(4, 0, i);
		for (size_t i = 0; i < 16 * 16 * 16; i++)
			x[i] = 100 * ct_rng_normal(5, 0, i);
		if (ct_consistency_alloc(&dc, &by[c], n, y, noise, NULL, &err) ||
			ct_consistency_colour(&dc, alike, &err) ||
			ct_alloc(&scratch, ct_consistency_scratch(&dc), sizeof *scratch, &err) ||
			ct_degrade_plan(&d, &by[c], n, NULL, &err))
			exit(99);
		ct_consistency_apply(&dc, x, scratch, NULL);
		ct_separable_apply(&d, r, x, NULL);
		for (size_t i = 0; i < m * m * m; i++)
			r[i] -= y[i];
		NEAR(weighted(r, m, power) / (noise * noise * (double)(m * m * m)), 1, 1e-3,
			"misfit by its spectrum is that of the noise");
		free(scratch);
		ct_separable_free(&d);
		ct_consistency_free(&dc);
	}
}

int main(void)
{
	test_correlated();
	test_constant();
	test_air();
	test_few();
	test_powers();
	test_constraint();
	return tap_done();
}
