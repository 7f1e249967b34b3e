/* photons.c: see photons.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "xray/photons.h"
#include "core/rng.h"

#include <math.h>

/* Of draws; the k-th number of a draw is stream + k. */
#define STREAM ((uint64_t)0x70680000 << 32)
#define ELECTRONIC ((uint64_t)0x70680001 << 32)

/* log k! by Stirling's series: within 2e-8 from k = 8 on, 3e-3 at 0, where the means that need it
 * never draw. */
static double log_factorial(double k)
{
	double x = k + 1;

	return (x - 0.5) * log(x) - x + 0.91893853320467274178 +
	       (1.0 / 12 - 1.0 / 360 / (x * x)) / x;
}

static double by_inversion(double mean, uint64_t seed, uint64_t index)
{
	double u = ct_rng_uniform(seed, STREAM, index), p = exp(-mean), k = 0;

	while (u >= p && k < 1000) {
		u -= p;
		p *= mean / ++k;
	}
	return k;
}

static double by_rejection(double mean, uint64_t seed, uint64_t index)
{
	double root = sqrt(mean), b = 0.931 + 2.53 * root, a = -0.059 + 0.02483 * b;
	double inverse = 1.1239 + 1.1328 / (b - 3.4), squeeze = 0.9277 - 3.6224 / (b - 2);

	for (uint64_t draw = 0;; draw += 2) {
		double u = ct_rng_uniform(seed, STREAM + draw, index) - 0.5;
		double v = 1 - ct_rng_uniform(seed, STREAM + draw + 1, index);
		double us = 0.5 - fabs(u), k = floor((2 * a / us + b) * u + mean + 0.43);

		if (us >= 0.07 && v <= squeeze)
			return k;
		if (k < 0 || us <= 0 || (us < 0.013 && v > us))
			continue;
		if (log(v * inverse / (a / (us * us) + b)) <=
			k * log(mean) - mean - log_factorial(k))
			return k;
	}
}

double ct_photons_poisson(double mean, uint64_t seed, uint64_t index)
{
	return mean < 30 ? by_inversion(mean, seed, index) : by_rejection(mean, seed, index);
}

void ct_photons_mu(size_t n, float *dst, const float *hu, double water)
{
	for (size_t i = 0; i < n; i++) {
		double mu = water * (1 + (double)hu[i] / 1000);

		dst[i] = (float)(mu > 0 ? mu : 0);
	}
}

void ct_photons_add(size_t n, float *restrict p, const float *restrict a, double unit,
	const struct ct_photons *how, uint64_t first)
{
	for (size_t k = 0; k < n; k++) {
		double clean = (double)a[k];
		double count = ct_photons_poisson(how->i0 * exp(-clean), how->seed, first + k);

		if (how->electronic > 0)
			count += how->electronic *
				 (double)ct_rng_normal(how->seed, ELECTRONIC, first + k);
		count = count > 1 ? count : 1;
		p[k] += (float)((log(how->i0 / count) - clean) / unit);
	}
}
