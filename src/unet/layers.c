/* layers.c: see layers.h. */
#pragma GCC optimize("O3") /* gcc 12 vectorises little at -O2 */
#include "config.h"
#include "unet/layers.h"
#include "unet/simd.h"

#include <math.h>
#include <string.h>

enum { LANES = 16, ROWS = 64 };

/* s += column sums of a, q += column sums of a*b, over rows of c floats, LANES columns. */
static inline void tile_sums(size_t rows, size_t c, double *restrict s, double *restrict q,
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

/* sums[c] = sum of a, sums[c..2c] = sum of a*b, per channel. */
CT_CLONES
static void column_sums(size_t hw, size_t c, double *restrict sums, const float *restrict a,
	const float *restrict b)
{
	memset(sums, 0, 2 * c * sizeof *sums);
	for (size_t i = 0; i < hw; i += ROWS) {
		size_t rows = hw - i < ROWS ? hw - i : ROWS;

		for (size_t j = 0; j < c; j += LANES)
			tile_sums(rows, c, sums + j, sums + c + j, a + i * c + j, b + i * c + j);
	}
}

void ct_norm_sums(size_t hw, size_t c, double *sums, const float *x)
{
	column_sums(hw, c, sums, x, x);
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

CT_CLONES
static void affine(size_t hw, size_t c, float *y, const float *x, const float *restrict ab)
{
	for (size_t i = 0; i < hw; i++)
		for (size_t j = 0; j < c; j++)
			y[i * c + j] = ab[j] * x[i * c + j] + ab[c + j];
}

/* Element by element, so y may be x: ivdep says so to the compiler. */
CT_CLONES
static void affine_silu(size_t hw, size_t c, float *y, const float *x, const float *restrict ab)
{
	for (size_t i = 0; i < hw; i++) {
		const float *xi = x + i * c;
		float *yi = y + i * c;

#pragma GCC ivdep
		for (size_t j = 0; j < c; j++) {
			float z = ab[j] * xi[j] + ab[c + j];

			yi[j] = z * ct_sigmoid(z);
		}
	}
}

void ct_norm_forward(
	const struct ct_norm *n, float *y, const float *x, const double *sums, float *ab)
{
	fold(n, ab, sums);
	if (n->silu)
		affine_silu(n->hw, n->c, y, x, ab);
	else
		affine(n->hw, n->c, y, x, ab);
}

size_t ct_norm_scratch(const struct ct_norm *n)
{
	return 3 * n->c + 4 * n->c; /* three float maps, two double sums */
}

/* dy *= d silu / dz. */
CT_CLONES
static void silu_slope(
	size_t hw, size_t c, float *restrict dy, const float *restrict x, const float *restrict ab)
{
	for (size_t i = 0; i < hw; i++)
		for (size_t j = 0; j < c; j++) {
			float z = ab[j] * x[i * c + j] + ab[c + j], s = ct_sigmoid(z);

			dy[i * c + j] *= s * (1.0f + z * (1.0f - s));
		}
}

/* dx (+)= p dz + q x + r. */
CT_CLONES
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
		dgamma[i] += (float)(dg * s);
		dbeta[i] += (float)(d[i] * s);
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
		silu_slope(n->hw, n->c, dy, x, pqr);
	}
	column_sums(n->hw, n->c, d, dy, x);
	for (size_t g = 0; g < CT_NORM_GROUPS; g++)
		group_back(n, g, pqr, dgamma, dbeta, de, d, sums);
	combine(n->hw, n->c, dx, dy, x, pqr, acc);
}

void ct_silu_forward(size_t n, float *y, const float *x)
{
	for (size_t i = 0; i < n; i++)
		y[i] = x[i] * ct_sigmoid(x[i]);
}

void ct_silu_back(size_t n, float *dx, const float *dy, const float *x, bool acc)
{
	for (size_t i = 0; i < n; i++) {
		float s = ct_sigmoid(x[i]), d = dy[i] * s * (1.0f + x[i] * (1.0f - s));

		dx[i] = acc ? dx[i] + d : d;
	}
}

CT_CLONES
void ct_linear_forward(size_t ci, size_t co, float *restrict y, const float *restrict x,
	const float *restrict w, const float *restrict b)
{
	for (size_t o = 0; o < co; o++) {
		const float *row = w + o * ci;
		float part[LANES] = {0};
		double sum = (double)b[o];
		size_t i = 0;

		for (; i + LANES <= ci; i += LANES)
			for (size_t l = 0; l < LANES; l++)
				part[l] += row[i + l] * x[i + l];
		for (size_t l = 0; l < LANES; l++)
			sum += (double)part[l];
		for (; i < ci; i++)
			sum += (double)(row[i] * x[i]);
		y[o] = (float)sum;
	}
}

CT_CLONES
void ct_linear_back(size_t ci, size_t co, float *restrict dx, float *restrict dw,
	float *restrict db, const float *restrict dy, const float *restrict x,
	const float *restrict w, bool acc)
{
	if (!acc)
		memset(dx, 0, ci * sizeof *dx);
	for (size_t o = 0; o < co; o++) {
		const float g = dy[o];

		db[o] += g;
		for (size_t i = 0; i < ci; i++) {
			dw[o * ci + i] += g * x[i];
			dx[i] += g * w[o * ci + i];
		}
	}
}

void ct_up_forward(size_t h, size_t w, size_t c, float *restrict y, const float *restrict x)
{
	for (size_t i = 0; i < h; i++) {
		float *row = y + 2 * i * 2 * w * c;

		for (size_t j = 0; j < w; j++) {
			memcpy(row + 2 * j * c, x + (i * w + j) * c, c * sizeof *y);
			memcpy(row + (2 * j + 1) * c, x + (i * w + j) * c, c * sizeof *y);
		}
		memcpy(row + 2 * w * c, row, 2 * w * c * sizeof *y);
	}
}

/* y[c] (+)= gain (a + b + p + q). */
static inline void sum4(size_t c, float *restrict y, float gain, const float *restrict a,
	const float *restrict b, const float *restrict p, const float *restrict q, bool acc)
{
	if (acc)
		for (size_t k = 0; k < c; k++)
			y[k] += gain * ((a[k] + b[k]) + (p[k] + q[k]));
	else
		for (size_t k = 0; k < c; k++)
			y[k] = gain * ((a[k] + b[k]) + (p[k] + q[k]));
}

/* y[h][w][c] (+)= gain times the sum of 2 x 2 of x[2h][2w][c]. */
CT_CLONES
static void gather(size_t h, size_t w, size_t c, float *restrict y, float gain,
	const float *restrict x, bool acc)
{
	for (size_t i = 0; i < h; i++)
		for (size_t j = 0; j < w; j++) {
			const float *a = x + (2 * i * 2 * w + 2 * j) * c, *p = a + 2 * w * c;

			sum4(c, y + (i * w + j) * c, gain, a, a + c, p, p + c, acc);
		}
}

void ct_up_back(size_t h, size_t w, size_t c, float *dx, const float *dy, bool acc)
{
	gather(h, w, c, dx, 1.0f, dy, acc);
}

void ct_down_forward(size_t h, size_t w, size_t c, float *y, const float *x)
{
	gather(h / 2, w / 2, c, y, 0.25f, x, false);
}

CT_CLONES
void ct_down_back(
	size_t h, size_t w, size_t c, float *restrict dx, const float *restrict dy, bool acc)
{
	for (size_t i = 0; i < h; i++)
		for (size_t j = 0; j < w; j++) {
			const float *g = dy + (i / 2 * (w / 2) + j / 2) * c;
			float *d = dx + (i * w + j) * c;

			for (size_t k = 0; k < c; k++)
				d[k] = (acc ? d[k] : 0.0f) + 0.25f * g[k];
		}
}

void ct_concat_forward(size_t hw, size_t ca, size_t cb, float *restrict y, const float *restrict a,
	const float *restrict b)
{
	for (size_t i = 0; i < hw; i++) {
		memcpy(y + i * (ca + cb), a + i * ca, ca * sizeof *y);
		memcpy(y + i * (ca + cb) + ca, b + i * cb, cb * sizeof *y);
	}
}

void ct_concat_back(size_t hw, size_t c, size_t first, size_t cx, float *restrict dx,
	const float *restrict dy, bool acc)
{
	for (size_t i = 0; i < hw; i++)
		ct_take(cx, dx + i * cx, dy + i * c + first, acc);
}

void ct_take(size_t n, float *restrict y, const float *restrict x, bool acc)
{
	if (!acc) {
		memcpy(y, x, n * sizeof *y);
		return;
	}
	for (size_t i = 0; i < n; i++)
		y[i] += x[i];
}

void ct_embed(size_t dim, float *emb, double t)
{
	const size_t half = dim / 2;

	for (size_t i = 0; i < half; i++) {
		double f = exp(-log(10000.0) * (double)i / (double)half);

		emb[i] = (float)cos(t * f);
		emb[half + i] = (float)sin(t * f);
	}
	if (dim % 2)
		emb[dim - 1] = 0.0f;
}

void ct_to_last(size_t hw, size_t c, float *restrict y, const float *restrict x)
{
	for (size_t i = 0; i < hw; i++)
		for (size_t k = 0; k < c; k++)
			y[i * c + k] = x[k * hw + i];
}

void ct_to_first(size_t hw, size_t c, float *restrict y, const float *restrict x)
{
	for (size_t k = 0; k < c; k++)
		for (size_t i = 0; i < hw; i++)
			y[k * hw + i] = x[i * c + k];
}
