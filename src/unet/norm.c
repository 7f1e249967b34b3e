/* norm.c: see norm.h. */
#include "config.h"
#include "unet/norm.h"
#include "unet/norm-map.h"

#include <math.h>

void ct_norm_sums(size_t hw, size_t c, double *sums, const float *x)
{
	CT_SIMD(ct_norm_map_sums)(hw, c, sums, x, x);
}

/* Mean of a group and 1/sqrt(var + eps), of x + o. */
static void group_moments(
	const struct ct_norm *n, size_t g, const double *sums, double *mean, double *r)
{
	const size_t per = n->c / CT_NORM_GROUPS;
	const double hw = (double)n->hw, count = hw * (double)per;
	double s = 0, q = 0;

	for (size_t i = g * per; i < (g + 1) * per; i++) {
		double o = n->e && !n->scale_shift ? (double)n->e[i] : 0.0;

		s += sums[i] + hw * o;
		q += sums[n->c + i] + o * (2 * sums[i] + hw * o);
	}
	*mean = s / count;
	*r = 1.0 / sqrt(fmax(q / count - *mean * *mean, 0.0) + 1e-5);
}

/* Gain and offset of a channel after the normalisation, z = gain xhat + offset. */
static void channel_map(const struct ct_norm *n, size_t i, double *gain, double *offset)
{
	double s = n->e && n->scale_shift ? 1.0 + (double)n->e[i] : 1.0;
	double t = n->e && n->scale_shift ? (double)n->e[n->c + i] : 0.0;

	*gain = (double)n->gamma[i] * s;
	*offset = (double)n->beta[i] * s + t;
}

/* z = a x + b. */
static void fold(const struct ct_norm *n, float *ab, const double *sums)
{
	const size_t per = n->c / CT_NORM_GROUPS;

	for (size_t g = 0; g < CT_NORM_GROUPS; g++) {
		double mean, r, gain, offset;

		group_moments(n, g, sums, &mean, &r);
		for (size_t i = g * per; i < (g + 1) * per; i++) {
			double o = n->e && !n->scale_shift ? (double)n->e[i] : 0.0;

			channel_map(n, i, &gain, &offset);
			ab[i] = (float)(gain * r);
			ab[n->c + i] = (float)(gain * r * (o - mean) + offset);
		}
	}
}

void ct_norm_forward(
	const struct ct_norm *n, float *y, const float *x, const double *sums, float *ab)
{
	fold(n, ab, sums);
	if (n->silu)
		CT_SIMD(ct_norm_map_silu)(n->hw, n->c, y, x, ab);
	else
		CT_SIMD(ct_norm_map)(n->hw, n->c, y, x, ab);
}

size_t ct_norm_scratch(const struct ct_norm *n)
{
	return 3 * n->c + 4 * n->c; /* three float maps, two double sums */
}

/* One group of the backward. With D0 = sum dz and D1 = sum dz x of a channel, dG = sum dz xhat =
 * r (D1 + (o - mean) D0); S1 = sum gain D0 and S2 = sum gain dG over the group of m values:
 *   dx = r (gain dz - S1/m - xhat S2/m) = p dz + q x + r0. */
static void group_back(const struct ct_norm *n, size_t g, float *pqr, float *dgamma, float *dbeta,
	float *de, const double *d, const double *sums)
{
	const size_t c = n->c, per = c / CT_NORM_GROUPS, end = (g + 1) * per;
	const double hw = (double)n->hw, m = hw * (double)per;
	double mean, r, gain, offset, s1 = 0, s2 = 0;

	group_moments(n, g, sums, &mean, &r);
	for (size_t i = g * per; i < end; i++) {
		double o = n->e && !n->scale_shift ? (double)n->e[i] : 0.0;
		double s = n->e && n->scale_shift ? 1.0 + (double)n->e[i] : 1.0;
		double dg = r * (d[c + i] + (o - mean) * d[i]);

		channel_map(n, i, &gain, &offset);
		s1 += gain * d[i];
		s2 += gain * dg;
		if (dgamma) {
			dgamma[i] += (float)(dg * s);
			dbeta[i] += (float)(d[i] * s);
		}
		if (de && n->scale_shift) {
			de[i] += (float)(dg * (double)n->gamma[i] + d[i] * (double)n->beta[i]);
			de[c + i] += (float)d[i];
		}
	}
	for (size_t i = g * per; i < end; i++) {
		double o = n->e && !n->scale_shift ? (double)n->e[i] : 0.0;
		double p, q = -r * r * s2 / m, r0 = -r * s1 / m - q * (mean - o);

		channel_map(n, i, &gain, &offset);
		p = r * gain;
		if (de && !n->scale_shift)
			de[i] += (float)(p * d[i] + q * sums[i] + r0 * hw);
		pqr[i] = (float)p;
		pqr[c + i] = (float)q;
		pqr[2 * c + i] = (float)r0;
	}
}

void ct_norm_back(const struct ct_norm *n, float *dx, float *dgamma, float *dbeta, float *de,
	float *dy, const float *x, const double *sums, bool acc, float *scratch)
{
	double *d = (double *)(void *)scratch; /* first, for its alignment */
	float *pqr = scratch + 4 * n->c;

	if (n->silu) {
		fold(n, pqr, sums);
		CT_SIMD(ct_norm_map_slope)(n->hw, n->c, dy, x, pqr);
	}
	CT_SIMD(ct_norm_map_sums)(n->hw, n->c, d, dy, x);
	for (size_t g = 0; g < CT_NORM_GROUPS; g++)
		group_back(n, g, pqr, dgamma, dbeta, de, d, sums);
	CT_SIMD(ct_norm_map_combine)(n->hw, n->c, dx, dy, x, pqr, acc);
}
