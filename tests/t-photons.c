/* t-photons.c: counting noise against its distribution. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "xray/photons.h"
#include "tap.h"

#include <stdlib.h>
#include <string.h>

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

int main(void)
{
	t_moments();
	t_distribution();
	t_attenuation();
	t_draws();
	t_least();
	t_mu();
	return tap_done();
}
