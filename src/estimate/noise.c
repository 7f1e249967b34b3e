/* noise.c: see noise.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "estimate/noise.h"
#include "core/mem.h"
#include "core/order.h"
#include "inverse/upsample.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

enum {
	BLOCK = 3, /* its side, voxels */
	MOST_BLOCKS = 1 << 16,
	LEAST_BLOCKS = 128, /* of which something is said */
	LEAST_SURE = 2000,  /* of tissue, of which something is sure; of a texture */
	FLATTEST = 50,      /* one in so many */
	TENTH = 10,
	FORTIETH = 40,
	LEAST_FLAT = 256, /* that tell how much alike noise is, or a tenth */
	REST = 15,        /* free values of a block without the parts */
};

static const double air = -850, clipped_air = -1024;      /* HU */
static const double texture = 8, in_parts = 4;            /* HU, of a block and of its parts */
static const double even = 1.4, uneven = 1.8, inside = 2; /* inside a body, of what is outside */
static const double lopsided = 0.3;                       /* skewness */
static const double widest = 7.5; /* mm between voxels of a block: beyond that bodies are busy */
static const size_t bodies = 3;   /* one in so many blocks is no bone */

/* Values that clipping and masks leave. */
struct voids {
	double lowest, highest, corner[8];
};

struct block {
	double mean, sd; /* sd: from its best linear function */
	double lowest;
	bool constant, mixed; /* all of it, and the greater part */
};

static struct voids voids_of(const struct ct_vol *v)
{
	const size_t n = ct_vol_count(v), *m = v->n;
	struct voids r = {.lowest = (double)INFINITY, .highest = -(double)INFINITY};

	for (size_t i = 0; i < n; i++) {
		r.lowest = fmin(r.lowest, (double)v->data[i]);
		r.highest = fmax(r.highest, (double)v->data[i]);
	}
	for (size_t c = 0; c < 8; c++)
		r.corner[c] = (double)v->data[(c & 1) * (m[0] - 1) +
					      m[0] * ((c >> 1 & 1) * (m[1] - 1) +
							     m[1] * ((c >> 2) * (m[2] - 1)))];
	return r;
}

static bool is_void(const struct voids *v, double value)
{
	bool is = value == v->lowest;

	for (int c = 0; c < 8; c++)
		is |= value == v->corner[c];
	return is;
}

/* Of a block of m[0] x m[1] x m[2] values that a linear function was fitted to. */
static double free_values(const size_t m[3])
{
	return (double)(m[0] * m[1] * m[2]) - 1 - (m[0] > 1) - (m[1] > 1) - (m[2] > 1);
}

/* The m[0] x m[1] x m[2] block at x. */
static struct block look(const float *x, const size_t m[3], const size_t stride[3])
{
	const double first = (double)x[0];
	double sum = 0, square = 0, slope[3] = {0}, last = first, lowest = first;
	size_t count = m[0] * m[1] * m[2], same = 0;

	for (size_t k = 0; k < m[2]; k++)
		for (size_t q = 0; q < m[1]; q++)
			for (size_t i = 0; i < m[0]; i++) {
				const size_t at[3] = {i, q, k};
				const double here =
					(double)x[i * stride[0] + q * stride[1] + k * stride[2]];
				const double d = here - first; /* keeps the squares small */

				for (int a = 0; a < 3; a++)
					slope[a] += d * (2 * (double)at[a] - (double)m[a] + 1) / 2;
				sum += d;
				square += d * d;
				same += here == last;
				last = here;
				lowest = fmin(lowest, here);
			}
	square -= sum * sum / (double)count;
	for (int a = 0; a < 3; a++) {
		const double n = (double)m[a]; /* sum of (i - (n-1)/2)^2 is n (n^2-1) / 12 */

		if (m[a] > 1)
			square -= slope[a] * slope[a] / ((double)count * (n * n - 1) / 12);
	}
	return (struct block){.mean = first + sum / (double)count,
		.sd = square > 0 ? sqrt(square / free_values(m)) : 0,
		.lowest = lowest,
		.constant = same == count,
		.mixed = 2 * same > count};
}

CT_ORDER(by_value, float)

/* Where n sorted values are densest: the half of them that is narrowest, and the half of it. */
static double densest(const float *x, size_t n)
{
	double sum = 0;

	while (n > 16) {
		const size_t half = (n + 1) / 2;
		size_t best = 0;

		for (size_t i = 1; i + half <= n; i++)
			if (x[i + half - 1] - x[i] < x[best + half - 1] - x[best])
				best = i;
		x += best;
		n = half;
	}
	for (size_t i = 0; i < n; i++)
		sum += (double)x[i];
	return sum / (double)n;
}

/* The deviation of flat tissue: the mode among the quarter of the blocks that is flattest, then the
 * mean square around it. Texture and edges only add to a block's deviation. n sorted values. */
static double common_sd(const float *sd, size_t n)
{
	const size_t quarter = n / 4 < 16 ? 16 : n / 4;
	double mode, sum = 0;
	size_t near = 0;

	if (n < LEAST_BLOCKS)
		return 0;
	mode = densest(sd, quarter);
	for (size_t i = 0; i < n; i++)
		if ((double)sd[i] > mode / 1.5 && (double)sd[i] < mode * 1.5) {
			sum += (double)sd[i] * (double)sd[i];
			near++;
		}
	return near ? sqrt(sum / (double)near) : 0;
}

/* The deviation of which blocks with so many free values show less once in 50 times, in units of
 * the noise: the root of chi^2 per value, by Wilson and Hilferty. */
static double seldom_less(double free_values)
{
	const double var = 2 / (9 * free_values), cube = 1 - var - 2.0537 * sqrt(var);

	return sqrt(cube * cube * cube);
}

/* How much tissue looks as flat as noise alone would, 0 to 1. n sorted values. */
static double evenness(const float *sd, size_t n)
{
	const double flattest = (double)sd[n / FLATTEST], more = (double)sd[n / TENTH];

	return fmin(fmax((uneven * flattest - more) / ((uneven - even) * flattest), 0), 1);
}

/* The deviation of the noise that is sure, of which texture may be a part, if it were white. Sorted
 * values of n blocks of tissue and of m of air. */
static double sure_sd(const float *sd, size_t n, const float *outside, size_t m, double free_values,
	double common)
{
	double most, same;

	if (n < LEAST_SURE || !(sd[n / FLATTEST] > 0))
		return 0;
	most = (double)sd[n / FLATTEST];
	same = evenness(sd, n);
	most = m < LEAST_BLOCKS
		       ? same * most
		       : fmin(most, (1 + same * (inside - 1)) * (double)outside[m / FLATTEST]);
	return fmin(most / seldom_less(free_values), common);
}

static size_t places(const struct ct_vol *v, const size_t m[3], size_t step)
{
	size_t n = 1;

	for (int a = 0; a < 3; a++)
		n *= (v->n[a] - m[a]) / step + 1;
	return n;
}

enum kind { NEITHER, TISSUE, AIR, HIGHEST };

/* What a block is evidence of. */
static enum kind kind_of(const struct block *b, const struct voids *v)
{
	if (b->mean < air)
		return !b->mixed && b->lowest > CT_NOISE_PADDING && b->lowest > v->lowest &&
				       b->lowest != clipped_air
			       ? AIR
			       : NEITHER;
	if (b->constant)
		return is_void(v, b->lowest) ? NEITHER : b->lowest == v->highest ? HIGHEST : TISSUE;
	return !b->mixed && b->sd > 0 ? TISSUE : NEITHER;
}

/* Of a block of tissue the squares of eight parts that see no linear function and little of
 * anatomy: 1 -2 1 (even) or 1 0 -1 (odd) along each axis, each of norm 1; the sum of all, of those
 * that are even along an axis, and of what is left of the block. In white noise one part tells
 * nothing of another. */
struct parts {
	double all, even[3], rest;
};

static struct parts parts_of(const float *x, const size_t stride[3], const struct block *b)
{
	static const double w[2][3] = {{M_SQRT1_2, 0, -M_SQRT1_2},
		{0.40824829046386302, -0.81649658092772603, 0.40824829046386302}};
	struct parts r = {0};

	for (int part = 0; part < 8; part++) {
		double sum = 0;

		for (size_t p = 0; p < 27; p++) {
			const size_t i = p % 3, j = p / 3 % 3, k = p / 9;

			sum += w[part & 1][i] * w[part >> 1 & 1][j] * w[part >> 2][k] *
			       (double)x[i + j * stride[1] + k * stride[2]];
		}
		r.all += sum * sum;
		for (int a = 0; a < 3; a++)
			r.even[a] += (part >> a & 1) * sum * sum;
	}
	r.rest = 23 * b->sd * b->sd - r.all;
	return r;
}

CT_ORDER_BY(by_rest, struct parts, rest, all)

/* Deviations of blocks of tissue from the begin of an array, of air from its end; the number of
 * those that are as constant as the highest value; and of those of tissue the parts. */
struct seen {
	float *sd, *end;
	struct parts *parts; /* NULL of blocks of fewer than 27 values */
	size_t tissue, air, highest;
};

/* Sums of the products of an axis's 3 places, of noise that is so much alike. */
static double axis_sum(double alike)
{
	return 3 + 4 * alike + 2 * pow(alike, 4);
}

static double others(const double alike[3], int a)
{
	return axis_sum(alike[(a + 1) % 3]) * axis_sum(alike[(a + 2) % 3]);
}

/* What even and odd parts show of noise that is so much alike, of 1 of white noise. */
static double even_of(double alike)
{
	return (3 - 4 * alike + pow(alike, 4)) / 3;
}

static double odd_of(double alike)
{
	return 1 - pow(alike, 4);
}

/* How much alike, if even parts show so much of what odd parts do. */
static double alike_of(double ratio)
{
	double lo = 0, hi = CT_NOISE_ALIKE;

	for (int i = 0; i < 30; i++) {
		const double mid = (lo + hi) / 2;

		if (even_of(mid) > ratio * odd_of(mid))
			lo = mid;
		else
			hi = mid;
	}
	return lo;
}

/* White noise over anatomy shows as much: then it is white. */
static bool forget_little(double alike[3])
{
	const bool white = fmax(alike[0], fmax(alike[1], alike[2])) < 0.3;

	for (int a = 0; a < 3 && white; a++)
		alike[a] = 0;
	return white;
}

/* What is left of a level once so much of it may be texture. */
static double without(double level, double much)
{
	return level > much ? sqrt(level * level - much * much) : 0;
}

/* What the parts of the flattest of n blocks show: of a fortieth at most, and of those whose rest
 * shows no more than the level `most` of blocks. No more is sure than blocks show. */
static void correlate(struct ct_noise *out, struct parts *parts, size_t n, double most)
{
	const size_t few = n / FORTIETH > LEAST_FLAT ? n / FORTIETH : LEAST_FLAT;
	const size_t count = few < n / TENTH ? few : n / TENTH;
	size_t flat = 0;
	double all = 0, along[3] = {0}, product = 1, shown = 27, level;

	qsort(parts, n, sizeof *parts, by_rest);
	while (flat == 0 || (flat < count && parts[flat].rest <= REST * most * most)) {
		all += parts[flat].all;
		for (int a = 0; a < 3; a++)
			along[a] += parts[flat].even[a];
		flat++;
	}
	level = all / (double)flat;
	for (int a = 0; a < 3; a++)
		out->alike[a] = all > along[a] ? alike_of(along[a] / (all - along[a])) : 0;
	if (forget_little(out->alike)) {
		out->sure = fmin(most, without(sqrt(level / 8), in_parts));
		return;
	}
	for (int a = 0; a < 3; a++) {
		level /= even_of(out->alike[a]) + odd_of(out->alike[a]);
		product *= axis_sum(out->alike[a]);
		shown -= (1 - pow(out->alike[a], 4)) * others(out->alike, a) / 9;
	}
	shown -= product / 27;
	out->sure = fmin(without(most, texture) * sqrt(23 / shown), sqrt(level));
	for (int a = 0; a < 3 && !(out->sure > 0); a++)
		out->alike[a] = 0;
}

/* All blocks. */
static void see(struct seen *s, const struct ct_vol *v, const struct voids *voids,
	const size_t m[3], size_t step)
{
	const size_t stride[3] = {1, v->n[0], v->n[0] * v->n[1]};

	for (size_t k = 0; k + m[2] <= v->n[2]; k += step)
		for (size_t q = 0; q + m[1] <= v->n[1]; q += step)
			for (size_t i = 0; i + m[0] <= v->n[0]; i += step) {
				const float *x = &v->data[i + q * stride[1] + k * stride[2]];
				const struct block b = look(x, m, stride);
				const enum kind kind = kind_of(&b, voids);

				if (kind == TISSUE && s->parts)
					s->parts[s->tissue] = parts_of(x, stride, &b);
				if (kind == TISSUE)
					s->sd[s->tissue++] = (float)b.sd;
				else if (kind == AIR)
					s->end[-1 - (ptrdiff_t)s->air++] = (float)b.sd;
				else if (kind == HIGHEST)
					s->highest++;
			}
}

/* Texture throughout: its values are no Gaussian, as those of noise alone are. */
static bool is_texture(const struct ct_vol *v, double busy)
{
	const double n = (double)ct_vol_count(v), sd = ct_upsample_spread(v);
	double mean = 0, cube = 0;

	for (size_t i = 0; i < ct_vol_count(v); i++)
		mean += (double)v->data[i] / n;
	for (size_t i = 0; i < ct_vol_count(v) && sd > 0; i++)
		cube += pow(((double)v->data[i] - mean) / sd, 3) / n;
	return busy > CT_NOISE_BUSY && fabs(cube) > lopsided;
}

/* The median of the deviations of blocks that begin in the box from lo to hi, every step of them.
 */
static double median_sd(float *sd, const struct ct_vol *v, const size_t lo[3], const size_t hi[3],
	const size_t m[3], const size_t stride[3], size_t step)
{
	size_t n = 0;

	for (size_t k = lo[2]; k < hi[2]; k += step)
		for (size_t q = lo[1]; q < hi[1]; q += step)
			for (size_t i = lo[0]; i < hi[0]; i += step)
				sd[n++] = (float)look(
					&v->data[i + v->n[0] * (q + v->n[1] * k)], m, stride)
						  .sd;
	if (n == 0)
		return 0;
	qsort(sd, n, sizeof *sd, by_value);
	return (double)sd[n / 2];
}

int ct_noise_busy(double *busy, const struct ct_vol *v, const double factor[static 3], double noise,
	struct ct_err *e)
{
	const double coarsest = fmax(factor[0], fmax(factor[1], factor[2]));
	const size_t m[3] = {BLOCK, BLOCK, BLOCK}, row[3] = {1, v->n[0], v->n[0] * v->n[1]};
	const double spread = ct_upsample_spread(v);
	double mm[3], least = (double)INFINITY, second = (double)INFINITY;
	size_t stride[3], half[3], all[3], step = 1;
	float *sd;

	*busy = 0;
	ct_vol_spacing(v, mm);
	for (int a = 0; a < 3; a++) {
		const size_t far = factor[a] > 1 ? 1 : (size_t)fmax(nearbyint(coarsest), 1);

		if (v->n[a] < (BLOCK - 1) * far + 2 * BLOCK || (double)far * mm[a] > widest)
			return 0;
		stride[a] = far * row[a];
		all[a] = v->n[a] - (BLOCK - 1) * far;
		half[a] = all[a] / 2;
	}
	if (!(spread > 0) || all[0] * all[1] * all[2] < LEAST_SURE)
		return 0;
	while (all[0] / step * (all[1] / step) * (all[2] / step) > MOST_BLOCKS)
		step++;
	if (ct_alloc(&sd, (all[0] / step + 2) * (all[1] / step + 2) * (all[2] / step + 2),
		    sizeof *sd, e))
		return -1;
	for (int c = 0; c < 8; c++) {
		size_t lo[3], hi[3];
		double its;

		for (int a = 0; a < 3; a++) {
			lo[a] = c >> a & 1 ? half[a] : 0;
			hi[a] = c >> a & 1 ? all[a] : half[a];
		}
		its = median_sd(sd, v, lo, hi, m, stride, step);
		second = fmin(second, fmax(least, its));
		least = fmin(least, its);
	}
	*busy = without(second, noise) / spread;
	free(sd);
	return 0;
}

int ct_noise_measure(struct ct_noise *out, const struct ct_vol *v, struct ct_err *e)
{
	size_t m[3], step = 1, all, tissue;
	struct seen s = {0};
	struct voids voids;
	const double voxel[3] = {2, 2, 2}; /* blocks of neighbours */
	double level, busy;
	int rc = -1;

	*out = (struct ct_noise){0};
	if (ct_vol_check_finite(v, e))
		return -1;
	for (int a = 0; a < 3; a++)
		m[a] = v->n[a] < BLOCK ? v->n[a] : BLOCK;
	if (m[0] * m[1] * m[2] < BLOCK * BLOCK) /* a line */
		return 0;
	while (places(v, m, step) > MOST_BLOCKS)
		step++;
	all = places(v, m, step);
	if (ct_alloc(&s.sd, all, sizeof *s.sd, e) ||
		(m[0] * m[1] * m[2] == BLOCK * BLOCK * BLOCK &&
			ct_alloc(&s.parts, all, sizeof *s.parts, e)))
		goto out;
	s.end = s.sd + all;
	voids = voids_of(v);
	see(&s, v, &voids, m, step);
	tissue = s.tissue;
	if (bodies * s.highest > s.highest + s.tissue)
		while (s.highest-- > 0)
			s.sd[s.tissue++] = 0;
	qsort(s.sd, s.tissue, sizeof *s.sd, by_value);
	qsort(s.end - s.air, s.air, sizeof *s.sd, by_value);
	out->common = common_sd(s.sd, s.tissue);
	if (ct_noise_busy(&busy, v, voxel, 0, e))
		goto out;
	level = is_texture(v, busy) ? 0
				    : sure_sd(s.sd, s.tissue, s.end - s.air, s.air, free_values(m),
					      out->common);
	out->sure = without(level, texture);
	if (level > 0 && s.parts)
		correlate(out, s.parts, tissue, level);
	rc = 0;
out:
	free(s.sd);
	free(s.parts);
	return rc;
}

void ct_noise_words(char to[static CT_NOISE_WORDS], const struct ct_noise *is)
{
	const size_t n = CT_NOISE_WORDS;

	if (is->sure > 0)
		snprintf(to, n, "%.3g HU or texture; %.3g HU is taken for noise", is->common,
			is->sure);
	else if (is->common < in_parts)
		snprintf(to, n, "%.3g HU or texture; below %g HU none is taken for noise",
			is->common, in_parts);
	else
		snprintf(to, n, "%.3g HU or texture; none is taken for noise", is->common);
}
