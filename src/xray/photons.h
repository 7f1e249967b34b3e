/* photons.h: the noise of a detector that counts photons.
 *
 * Matter attenuates by mu = mu_water max(0, 1 + HU/1000) a mm; outside the volume there is nothing.
 * Of I0 photons sent towards a pixel behind the attenuation A = integral of mu
 *
 *   N ~ Poisson(I0 exp(-A)) + Normal(0, s)        s of the electronics, in photons
 *   A' = -log(max(N, 1) / I0)
 *
 * are counted and computed back: a pixel that gets no photon reads log I0. A projection
 * in other units p receives the same noise in its own: p += (A' - A)/mu_p, mu_p the
 * attenuation of a unit of p; density over a window of W HU has mu_p = mu_water W/1000.
 *
 * Pure; thread-safe; a pixel's number depends on seed and index alone.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_XRAY_PHOTONS_H
#define CT_XRAY_PHOTONS_H
#include <stddef.h>
#include <stdint.h>

struct ct_photons {
	double i0;         /* photons a pixel, > 0 */
	double electronic; /* standard deviation, photons */
	double water;      /* attenuation of water, 1/mm */
	uint64_t seed;
};

/* mu of n voxels in HU, 1/mm. dst may be src. */
void ct_photons_mu(size_t n, float *dst, const float *hu, double water);
/* p[k] += (A' - a[k])/unit for pixels first + k. */
void ct_photons_add(size_t n, float *restrict p, const float *restrict a, double unit,
	const struct ct_photons *how, uint64_t first);
/* A draw of the Poisson distribution of this mean, 0 <= mean <= 1e15: by inversion below 30,
 * above by transformed rejection (Hoermann, Insurance: Mathematics and Economics 12, 1993). */
double ct_photons_poisson(double mean, uint64_t seed, uint64_t index);

#endif
