/* scales.c: see scales.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/order.h"
#include "series/scales.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_SAMPLES = 12288, FEW_SAMPLES = 96 }; /* pixels of a pair */

struct sample {
	double sum, own, same;
};

static bool one_scale(const struct ct_slice *a, const struct ct_slice *b)
{
	return a->slope == b->slope && a->intercept == b->intercept;
}

int ct_scales_begin(struct ct_scales *c, const struct ct_slice *s, size_t n, struct ct_err *e)
{
	const size_t area = n ? s->columns * s->rows : 0;

	memset(c, 0, sizeof *c);
	c->s = s;
	c->n = c->last = n;
	c->least = (double)INFINITY;
	c->most = -(double)INFINITY;
	for (size_t k = 0; k < n; k++) {
		if (!s[k].scaled) {
			c->n = 0; /* nothing is asked */
			return 0;
		}
		c->differ |= !one_scale(&s[k], s);
	}
	if (!c->differ)
		return 0;
	return ct_err_any(
		ct_alloc(&c->before, area, sizeof *c->before, e) ||
		ct_alloc(&c->sample, MOST_SAMPLES, sizeof *c->sample, e) ||
		ct_alloc(&c->work, n > MOST_SAMPLES ? n : MOST_SAMPLES, sizeof *c->work, e) ||
		ct_alloc0(&c->pair, n, sizeof *c->pair, e));
}

void ct_scales_free(struct ct_scales *c)
{
	free(c->before);
	free(c->sample);
	free(c->work);
	free(c->pair);
	memset(c, 0, sizeof *c);
}

static int by_sum(const void *p, const void *q)
{
	const struct sample *a = p, *b = q;

	return (a->sum > b->sum) - (a->sum < b->sum);
}

CT_ORDER(by_value, double)

static double median(double *x, size_t n)
{
	qsort(x, n, sizeof *x, by_value);
	return n % 2 ? x[n / 2] : (x[n / 2 - 1] + x[n / 2]) / 2;
}

/* Least and largest stored value: what is clipped there keeps its number whatever the scale. */
static void ends(double end[2], const float *x, size_t n)
{
	float lo = x[0], hi = x[0];

	for (size_t i = 1; i < n; i++) {
		lo = x[i] < lo ? x[i] : lo;
		hi = x[i] > hi ? x[i] : hi;
	}
	end[0] = (double)lo;
	end[1] = (double)hi;
}

static bool is_padding(const struct ct_slice *s, double stored)
{
	return s->padded && stored >= fmin(s->padding[0], s->padding[1]) &&
	       stored <= fmax(s->padding[0], s->padding[1]);
}

/* Pixels of slices a and b, some of all: how many. `inner`: without the ends of either. */
static size_t sample(struct ct_scales *c, size_t a, size_t b, const float *now, bool inner)
{
	const struct ct_slice *s = &c->s[a], *t = &c->s[b];
	const size_t area = s->columns * s->rows, step = (area / MOST_SAMPLES + 1) | 1;
	const double base[2] = {ct_slice_base(s), ct_slice_base(t)};
	const double slope = fmax(fabs(s->slope), fabs(t->slope));
	double low[2], high[2];
	size_t n = 0;

	ends(low, c->before, area);
	ends(high, now, area);
	for (size_t i = 0; i < area && n < MOST_SAMPLES; i += step) {
		const double v = (double)c->before[i], w = (double)now[i];
		const double x = s->slope * (v + base[0]) + s->intercept,
			     y = t->slope * (w + base[1]) + t->intercept;

		if ((inner && (v == low[0] || v == low[1] || w == high[0] || w == high[1])) ||
			is_padding(s, v + base[0]) || is_padding(t, w + base[1]))
			continue;
		c->sample[n++] = (struct sample){x + y, y - x, slope * (w + base[1] - v - base[0])};
	}
	return n;
}

static void compare(struct ct_scales *c, size_t a, size_t b, const float *now)
{
	struct ct_scales_pair *p = &c->pair[c->pairs];
	size_t n = sample(c, a, b, now, true);

	if (n < FEW_SAMPLES)
		n = sample(c, a, b, now, false);
	if (n < CT_SCALES_CLASSES)
		return;
	qsort(c->sample, n, sizeof *c->sample, by_sum);
	*p = (struct ct_scales_pair){.a = a, .b = b, .one = one_scale(&c->s[a], &c->s[b])};
	for (size_t k = 0; k < CT_SCALES_CLASSES; k++) {
		const size_t from = k * n / CT_SCALES_CLASSES,
			     count = (k + 1) * n / CT_SCALES_CLASSES - from;

		for (size_t i = 0; i < count; i++)
			c->work[i] = c->sample[from + i].own;
		p->own[k] = median(c->work, count);
		for (size_t i = 0; i < count; i++)
			c->work[i] = c->sample[from + i].same;
		p->same[k] = median(c->work, count);
	}
	c->pairs++;
}

/* Is there but one value? */
static bool is_flat(const float *x, size_t n)
{
	size_t i = 1;

	while (i < n && x[i] == x[0])
		i++;
	return i == n;
}

/* Slice k may be lost: it has one value, and those on either side have more. */
static void note_flat(struct ct_scales *c, size_t k, bool flat)
{
	if (flat && c->varied && !c->flat)
		c->flat = k + 1;
	if (flat)
		return;
	if (c->flat && !c->lost)
		c->lost = c->flat;
	c->varied = true;
	c->flat = 0;
}

enum { NOTHING = -4096, METAL = 16000 }; /* HU: between them all that CTs have */

/* Of a slice without padding: the range of its values, if that is one that CTs have. */
static bool quick_range(double range[2], const struct ct_slice *s, const float *stored)
{
	enum { LANES = 8 };
	const double zero = s->slope * ct_slice_base(s) + s->intercept;
	const size_t n = s->columns * s->rows;
	float lo[LANES], hi[LANES]; /* of every LANES-th value: a vector to a compiler */
	double a, b;

	if (s->padded)
		return false;
	for (size_t l = 0; l < LANES; l++)
		lo[l] = hi[l] = stored[l < n ? l : 0];
	for (size_t i = 0; i + LANES <= n; i += LANES)
		for (size_t l = 0; l < LANES; l++) {
			lo[l] = stored[i + l] < lo[l] ? stored[i + l] : lo[l];
			hi[l] = stored[i + l] > hi[l] ? stored[i + l] : hi[l];
		}
	for (size_t i = n - n % LANES; i < n; i++) {
		lo[0] = stored[i] < lo[0] ? stored[i] : lo[0];
		hi[0] = stored[i] > hi[0] ? stored[i] : hi[0];
	}
	for (size_t l = 1; l < LANES; l++) {
		lo[0] = lo[l] < lo[0] ? lo[l] : lo[0];
		hi[0] = hi[l] > hi[0] ? hi[l] : hi[0];
	}
	a = s->slope * (double)lo[0] + zero;
	b = s->slope * (double)hi[0] + zero;
	range[0] = fmin(a, b);
	range[1] = fmax(a, b);
	return range[0] >= NOTHING && range[1] <= METAL;
}

/* The range of the values of slice k, and how many are none. */
static void note_range(struct ct_scales *c, size_t k, const float *stored)
{
	enum { PART = 50 }; /* of a slice that may lie beyond */
	const struct ct_slice *s = &c->s[k];
	const size_t area = s->columns * s->rows;
	const double zero = s->slope * ct_slice_base(s) + s->intercept;
	double lo = (double)INFINITY, hi = -lo;
	size_t high = 0, none = 0;
	double range[2];

	if (quick_range(range, s, stored)) {
		c->least = fmin(c->least, range[0]);
		c->most = fmax(c->most, range[1]);
		return;
	}
	for (size_t i = 0; i < area; i++) {
		const double x = s->slope * (double)stored[i] + zero;
		const bool no = s->padded && is_padding(s, (double)stored[i] + ct_slice_base(s));

		lo = no || lo < x ? lo : x;
		hi = no || hi > x ? hi : x;
		high += !no && x > METAL;
		none += no;
	}
	for (size_t i = 0; i < area && lo < NOTHING; i++) { /* but for a value that is padding */
		const double x = s->slope * (double)stored[i] + zero;

		high += x < NOTHING && x > lo;
	}
	c->least = fmin(c->least, lo);
	c->most = fmax(c->most, hi);
	c->padded += none;
	if (high * PART > area && !c->high)
		c->high = k + 1;
}

void ct_scales_take(struct ct_scales *c, size_t k, const float *stored)
{
	const size_t area = c->n ? c->s[k].columns * c->s[k].rows : 0;

	if (area == 0)
		return;
	note_flat(c, k, is_flat(stored, area));
	note_range(c, k, stored);
	if (!c->differ)
		return;
	if (c->last != c->n)
		compare(c, c->last, k, stored);
	memcpy(c->before, stored, area * sizeof *stored);
	c->last = k;
}

static double sum(const double x[CT_SCALES_CLASSES])
{
	double all = 0;

	for (int k = 0; k < CT_SCALES_CLASSES; k++)
		all += fabs(x[k]);
	return all;
}

/* How much slices of one scale differ, or, if there are hardly any, most of all. */
static double usual(const struct ct_scales *c)
{
	enum { SOME = 2, MANY = 6 };
	size_t n = 0;

	for (size_t i = 0; i < c->pairs; i++)
		if (c->pair[i].one)
			c->work[n++] = sum(c->pair[i].own);
	if (n >= SOME)
		return median(c->work, n);
	if (c->pairs < MANY)
		return 0;
	for (size_t i = 0; i < c->pairs; i++)
		c->work[i] = sum(c->pair[i].own);
	return median(c->work, c->pairs);
}

static size_t of_scale(const struct ct_scales *c, const struct ct_slice *s)
{
	size_t count = 0;

	for (size_t k = 0; k < c->n; k++)
		count += one_scale(&c->s[k], s);
	return count;
}

static int fail(const struct ct_scales *c, const struct ct_scales_pair *p, struct ct_err *e)
{
	const bool second = of_scale(c, &c->s[p->b]) <= of_scale(c, &c->s[p->a]);
	const struct ct_slice *s = &c->s[second ? p->b : p->a], *t = &c->s[second ? p->a : p->b];
	char a[CT_SLICE_NAME], b[CT_SLICE_NAME];

	return ct_fail(e, CT_EINPUT,
		"%s: RescaleSlope %g and RescaleIntercept %g, and %g and %g in %s beside it: the values "
		"jump by %.4g HU, and by %.4g if both had one scale (but see --units)",
		ct_slice_name(a, s), s->slope, s->intercept, t->slope, t->intercept,
		ct_slice_name(b, t), sum(p->own) / CT_SCALES_CLASSES,
		sum(p->same) / CT_SCALES_CLASSES);
}

static void warn_range(const struct ct_scales *c, const struct ct_env *env)
{
	const double range = c->most - c->least;
	double slope = 0;
	bool little;

	for (size_t k = 0; k < c->n; k++)
		slope = fmax(slope, fabs(c->s[k].slope));
	/* of how many numbers they are */
	little = (range < 400 && range >= 1000 * slope) || (range < 50 && range >= 50 * slope);
	if (slope < 1 && little)
		ct_log(env, CT_WARN,
			"RescaleSlope is %g: all values lie within %.4g HU, and air and water are 1000 "
			"apart",
			slope, range);
}

/* Tissue that is taken for padding. */
static void warn_padding(const struct ct_scales *c, const struct ct_env *env)
{
	const double air = -850, bone = 2000; /* what lies between is no padding */

	for (size_t k = 0; k < c->n && c->padded; k++) {
		const struct ct_slice *s = &c->s[k];
		const double a = s->slope * s->padding[0] + s->intercept,
			     b = s->slope * s->padding[1] + s->intercept;

		if (!s->padded || fmax(a, b) < air || fmin(a, b) > bone)
			continue;
		ct_log(env, CT_WARN,
			"PixelPaddingValue %g to %g is %g to %g HU, which tissue has: %zu pixels are "
			"taken for padding",
			fmin(s->padding[0], s->padding[1]), fmax(s->padding[0], s->padding[1]),
			fmin(a, b), fmax(a, b), c->padded);
		return;
	}
}

/* What a warning calls slice k. */
static const char *name_of(char out[CT_SLICE_NAME], const struct ct_scales *c, size_t k)
{
	if (!c->nameless)
		return ct_slice_name(out, &c->s[k]);
	snprintf(out, CT_SLICE_NAME, "slice %zu of %zu", k + 1, c->n);
	return out;
}

static void warn_values(const struct ct_scales *c, const struct ct_env *env)
{
	const double air = -1000, water = 0;
	const struct ct_slice *s = c->s;
	char name[CT_SLICE_NAME];
	bool lost = true; /* the intercept */

	for (size_t k = 0; k < c->n; k++)
		lost = lost && s[k].intercept >= 0;
	if (lost && c->least >= water && c->most > c->least)
		ct_log(env, CT_WARN,
			"no value lies below %g HU, but a CT shows air and fat: is RescaleIntercept (%g) "
			"right?",
			c->least, s->intercept);
	if (c->most < air && c->most > c->least)
		ct_log(env, CT_WARN,
			"no value lies above %g HU, but a CT shows water: is RescaleIntercept (%g) right?",
			c->most, s->intercept);
	if (c->high)
		ct_log(env, CT_WARN,
			"%s: a part of its values lies below -4096 or above 16000 HU: are its bytes "
			"or its scale wrong?",
			name_of(name, c, c->high - 1));
	if (c->lost)
		ct_log(env, CT_WARN,
			"%s: all its values are the same, and those of the slices beside it are not: it "
			"may be lost",
			name_of(name, c, c->lost - 1));
}

int ct_scales_check(const struct ct_scales *c, const struct ct_env *env, struct ct_err *e)
{
	const double least = 9, times = 3, like = c->differ ? 2 * usual(c) : 0;

	for (size_t i = 0; i < c->pairs; i++) {
		const struct ct_scales_pair *p = &c->pair[i];

		if (!p->one && sum(p->own) > times * sum(p->same) + like + least)
			return fail(c, p, e);
	}
	if (c->n == 0 || !(c->least <= c->most))
		return 0;
	warn_range(c, env);
	warn_padding(c, env);
	warn_values(c, env);
	return 0;
}
