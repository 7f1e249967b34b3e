/* norm.c: see norm.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "nn/norm.h"
#include "core/vec-exp.h"

#include <math.h>

enum { LANES = 16, ROWS = 64 };

/* s += column sums of a, q += column sums of a*b, over rows of c floats, LANES columns. */
CT_INLINE void tile_sums(size_t rows, size_t c, double *restrict s, double *restrict q,
	const float *restrict a, const float *restrict b)
{
	double ts[LANES], tq[LANES];

	for (size_t l = 0; l < LANES; l++) {
		ts[l] = s[l];
		tq[l] = q[l];
	}
	for (size_t i = 0; i < rows; i++)
		for (size_t l = 0; l < LANES; l++) {
			double v = (double)a[i * c + l];

			ts[l] += v;
			tq[l] += v * (double)b[i * c + l];
		}
	for (size_t l = 0; l < LANES; l++) {
		s[l] = ts[l];
		q[l] = tq[l];
	}
}

/* sums[c] = sum of a, sums[c..2c] = sum of a b, per channel. */
static void map_sums(size_t hw, size_t c, double *restrict sums, const float *restrict a,
	const float *restrict b)
{
	memset(sums, 0, 2 * c * sizeof *sums);
	for (size_t i = 0; i < hw; i += ROWS) {
		size_t rows = hw - i < ROWS ? hw - i : ROWS;

		for (size_t j = 0; j < c; j += LANES)
			tile_sums(rows, c, sums + j, sums + c + j, a + i * c + j, b + i * c + j);
	}
}

/* y = z = ab[0..c] x + ab[c..2c], and y = z sigmoid(z). Where y may be x, element by element, ivdep
 * says so to the compiler. */
static void map(size_t hw, size_t c, float *y, const float *x, const float *restrict ab)
{
	for (size_t i = 0; i < hw; i++)
		CT_SIMD_APART
	for (size_t j = 0; j < c; j++)
		y[i * c + j] = ab[j] * x[i * c + j] + ab[c + j];
}

static void map_silu(size_t hw, size_t c, float *y, const float *x, const float *restrict ab)
{
	for (size_t i = 0; i < hw; i++)
		for (size_t j = 0; j < c; j += CT_F32_LANES) {
			const ct_f32 z = ct_f32_load(ab + j) * ct_f32_load(x + i * c + j) +
					 ct_f32_load(ab + c + j);

			ct_f32_store(y + i * c + j, z * ct_f32_sigmoid(z));
		}
}

/* dy *= the slope of that. */
static void map_slope(
	size_t hw, size_t c, float *restrict dy, const float *restrict x, const float *restrict ab)
{
	for (size_t i = 0; i < hw; i++)
		for (size_t j = 0; j < c; j += CT_F32_LANES) {
			const ct_f32 z = ct_f32_load(ab + j) * ct_f32_load(x + i * c + j) +
					 ct_f32_load(ab + c + j);
			const ct_f32 s = ct_f32_sigmoid(z), d = ct_f32_load(dy + i * c + j);

			ct_f32_store(dy + i * c + j, d * (s * (1.0f + z * (1.0f - s))));
		}
}

/* dx (+)= p dz + q x + r, of pqr[3][c]. */
static void combine(size_t hw, size_t c, float *restrict dx, const float *restrict dz,
	const float *restrict x, const float *restrict pqr, bool acc)
{
	const float *p = pqr, *q = pqr + c, *r = pqr + 2 * c;

	for (size_t i = 0; i < hw; i++)
		if (acc)
			for (size_t j = 0; j < c; j++)
				dx[i * c + j] += p[j] * dz[i * c + j] + q[j] * x[i * c + j] + r[j];
		else
			for (size_t j = 0; j < c; j++)
				dx[i * c + j] = p[j] * dz[i * c + j] + q[j] * x[i * c + j] + r[j];
}

void CT_SIMD_HERE(ct_norm_sums)(size_t hw, size_t c, double *sums, const float *x)
{
	map_sums(hw, c, sums, x, x);
}

/* A channel: o, s of norm.h, and z = gain xhat + offset. */
struct channel {
	double o, s, gain, offset;
};

static struct channel channel_of(const struct ct_norm *n, size_t i)
{
	const double e = n->e ? (double)n->e[i] : 0.0;
	const double s = n->scale_shift ? 1.0 + e : 1.0;
	const double t = n->e && n->scale_shift ? (double)n->e[n->c + i] : 0.0;

	return (struct channel){
		n->scale_shift ? 0.0 : e, s, (double)n->gamma[i] * s, (double)n->beta[i] * s + t};
}

/* Mean of a group and 1/sqrt(var + eps), of x + o. */
static void group_moments(
	const struct ct_norm *n, size_t g, const double *sums, double *mean, double *r)
{
	const size_t per = n->c / CT_NORM_GROUPS;
	const double hw = (double)n->hw, count = hw * (double)per;
	double s = 0, q = 0;

	for (size_t i = g * per; i < (g + 1) * per; i++) {
		double o = channel_of(n, i).o;

		s += sums[i] + hw * o;
		q += sums[n->c + i] + o * (2 * sums[i] + hw * o);
	}
	*mean = s / count;
	*r = 1.0 / sqrt(fmax(q / count - *mean * *mean, 0.0) + 1e-5);
}

/* z = a x + b. */
static void fold(const struct ct_norm *n, float *ab, const double *sums)
{
	const size_t per = n->c / CT_NORM_GROUPS;

	for (size_t g = 0; g < CT_NORM_GROUPS; g++) {
		double mean, r;

		group_moments(n, g, sums, &mean, &r);
		for (size_t i = g * per; i < (g + 1) * per; i++) {
			const struct channel k = channel_of(n, i);

			ab[i] = (float)(k.gain * r);
			ab[n->c + i] = (float)(k.gain * r * (k.o - mean) + k.offset);
		}
	}
}

void CT_SIMD_HERE(ct_norm_forward)(
	const struct ct_norm *n, float *y, const float *x, const double *sums, float *ab)
{
	fold(n, ab, sums);
	if (n->silu)
		map_silu(n->hw, n->c, y, x, ab);
	else
		map(n->hw, n->c, y, x, ab);
}

/* One group of the backward. With D0 = sum dz and D1 = sum dz x of a channel, dG = sum dz xhat =
 * r (D1 + (o - mean) D0); S1 = sum gain D0 and S2 = sum gain dG over the group of m values:
 *   dx = r (gain dz - S1/m - xhat S2/m) = p dz + q x + r0. */
static void group_back(const struct ct_norm *n, size_t g, float *pqr, float *dgamma, float *dbeta,
	float *de, const double *d, const double *sums)
{
	const size_t c = n->c, per = c / CT_NORM_GROUPS, end = (g + 1) * per;
	const double hw = (double)n->hw, m = hw * (double)per;
	double mean, r, s1 = 0, s2 = 0;

	group_moments(n, g, sums, &mean, &r);
	for (size_t i = g * per; i < end; i++) {
		const struct channel k = channel_of(n, i);
		double dg = r * (d[c + i] + (k.o - mean) * d[i]);

		s1 += k.gain * d[i];
		s2 += k.gain * dg;
		if (dgamma) {
			dgamma[i] += (float)(dg * k.s);
			dbeta[i] += (float)(d[i] * k.s);
		}
		if (de && n->scale_shift) {
			de[i] += (float)(dg * (double)n->gamma[i] + d[i] * (double)n->beta[i]);
			de[c + i] += (float)d[i];
		}
	}
	for (size_t i = g * per; i < end; i++) {
		const struct channel k = channel_of(n, i);
		double p = r * k.gain, q = -r * r * s2 / m, r0 = -r * s1 / m - q * (mean - k.o);

		if (de && !n->scale_shift)
			de[i] += (float)(p * d[i] + q * sums[i] + r0 * hw);
		pqr[i] = (float)p;
		pqr[c + i] = (float)q;
		pqr[2 * c + i] = (float)r0;
	}
}

void CT_SIMD_HERE(ct_norm_back)(const struct ct_norm *n, float *dx, float *dgamma, float *dbeta,
	float *de, float *dy, const float *x, const double *sums, bool acc, float *scratch)
{
	double *d = (double *)(void *)scratch; /* first, for its alignment */
	float *pqr = scratch + 4 * n->c;

	if (n->silu) {
		fold(n, pqr, sums);
		map_slope(n->hw, n->c, dy, x, pqr);
	}
	map_sums(n->hw, n->c, d, dy, x);
	for (size_t g = 0; g < CT_NORM_GROUPS; g++)
		group_back(n, g, pqr, dgamma, dbeta, de, d, sums);
	combine(n->hw, n->c, dx, dy, x, pqr, acc);
}
