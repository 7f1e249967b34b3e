/* difference-row.c: see difference-row.h. */
#include "config.h"
#include "quality/difference-row.h"
#include "core/vec.h"

enum { LANES = CT_F64_LANES };

/* Where the voxels of a vector, and the neighbours of each, are; `below` and `behind` are 0 where
 * there are none, else 1. */
struct place {
	const float *ref, *test, *mask;
	size_t down, next;
	double below, behind;
};

struct sums {
	struct ct_sum8 count, square, abs, diff, mapped, pairs[3], gradient[3];
	ct_f64 max;
	ct_f64 top;
};

/* d = test - ref of the voxels that are `at` voxels on. */
CT_INLINE ct_f64 difference(const struct place *p, size_t at)
{
	return ct_f64_widen(p->test + at) - ct_f64_widen(p->ref + at);
}

/* 1 where they count, else 0. */
CT_INLINE ct_f64 weight(const struct place *p, size_t at)
{
	const ct_i64 counts = ct_f64_widen(p->mask + at) != 0.0;

	return (ct_f64)(counts & (ct_i64)ct_f64_set(1));
}

CT_INLINE ct_f64 clip(ct_f64 v, const struct ct_ssim_map *map)
{
	const ct_f64 x = ct_f64_max(v, ct_f64_set(map->lo));

	return ct_f64_min(x, ct_f64_set(map->hi)) - map->zero;
}

/* The terms of LANES voxels, to part q of the sums. Without a mask count and pairs are not added
 * up. */
CT_INLINE void add_some(struct sums *s, const size_t q, const struct place *p,
	const struct ct_ssim_map *map, const bool masked)
{
	const ct_f64 ref = ct_f64_widen(p->ref), test = ct_f64_widen(p->test), d = test - ref;
	const ct_f64 m = clip(test, map) - clip(ref, map);
	const ct_f64 gi = difference(p, 1) - d, gj = difference(p, p->down) - d;
	const ct_f64 gk = difference(p, p->next) - d;
	ct_f64 wd = d, a;

	if (masked) {
		const ct_f64 w = weight(p, 0), pi = w * weight(p, 1);
		const ct_f64 pj = w * (weight(p, p->down) * p->below);
		const ct_f64 pk = w * (weight(p, p->next) * p->behind);

		wd = w * d;
		s->count.part[q] += w;
		s->pairs[0].part[q] += pi;
		s->pairs[1].part[q] += pj;
		s->pairs[2].part[q] += pk;
		s->mapped.part[q] += w * m * m;
		s->gradient[0].part[q] += pi * gi * gi;
		s->gradient[1].part[q] += pj * gj * gj;
		s->gradient[2].part[q] += pk * gk * gk;
	} else {
		s->mapped.part[q] += m * m;
		s->gradient[0].part[q] += gi * gi;
		s->gradient[1].part[q] += gj * gj;
		s->gradient[2].part[q] += gk * gk;
	}
	a = ct_f64_abs(wd);
	s->square.part[q] += wd * d;
	s->abs.part[q] += a;
	s->diff.part[q] += wd;
	s->max = ct_f64_max(a, s->max);
	s->top = ct_f64_max(ct_f64_max(ct_f64_abs(ref), ct_f64_abs(test)), s->top);
}

CT_INLINE void add_eight(
	struct sums *s, const struct place *at, const struct ct_ssim_map *map, const bool masked)
{
	struct place p = *at;

#pragma GCC unroll 4
	for (size_t q = 0; q < CT_SUM_PARTS; q++) {
		add_some(s, q, &p, map, masked);
		p.ref += LANES;
		p.test += LANES;
		p.mask += masked ? LANES : 0;
	}
}

/* The last n <= CT_SUM_LANES voxels of a row, from a copy that ends in voxels that do not count. */
static void add_last(
	struct sums *s, const struct place *at, size_t n, const struct ct_ssim_map *map)
{
	enum { ROW = 2 * CT_SUM_LANES };
	float ref[3 * ROW] = {0}, test[3 * ROW] = {0}, mask[3 * ROW] = {0};
	const size_t from[3] = {0, at->down, at->next};
	struct place p = *at;

	for (size_t k = 0; k < 3; k++)
		for (size_t i = 0; i < n; i++) {
			ref[k * ROW + i] = at->ref[from[k] + i];
			test[k * ROW + i] = at->test[from[k] + i];
			mask[k * ROW + i] = at->mask ? at->mask[from[k] + i] : 1;
		}
	p.ref = ref;
	p.test = test;
	p.mask = mask;
	p.down = ROW;
	p.next = 2 * ROW;
	add_eight(s, &p, map, true);
}

/* All voxels but the last ones; returns how many. */
CT_INLINE size_t add_most(struct sums *s, const struct place *at, size_t n,
	const struct ct_ssim_map *map, const bool masked)
{
	struct sums sum = *s; /* in registers */
	struct place p = *at;
	size_t i = 0;

	for (; i + CT_SUM_LANES < n; i += CT_SUM_LANES) { /* each has a neighbour */
		add_eight(&sum, &p, map, masked);
		p.ref += CT_SUM_LANES;
		p.test += CT_SUM_LANES;
		p.mask += masked ? CT_SUM_LANES : 0;
	}
	*s = sum;
	return i;
}

CT_INLINE double largest(ct_f64 v)
{
	double most = 0;

	for (size_t l = 0; l < LANES; l++)
		most = v[l] > most ? v[l] : most;
	return most;
}

void CT_SIMD_HERE(ct_difference_row_sum)(
	struct ct_sums *o, const struct ct_difference_row *r, const struct ct_ssim_map *map)
{
	const struct ct_difference_row row = *r;
	const struct ct_ssim_map m = *map;
	struct place p = {row.ref, row.test, row.mask, row.down, row.next, row.down ? 1 : 0,
		row.next ? 1 : 0};
	struct sums s = {0};
	size_t done =
		row.mask ? add_most(&s, &p, row.n, &m, true) : add_most(&s, &p, row.n, &m, false);
	const double most = row.mask ? 0 : (double)done;

	p.ref += done;
	p.test += done;
	p.mask += row.mask ? done : 0;
	add_last(&s, &p, row.n - done, &m);
	o->count = ct_sum8_total(&s.count) + most;
	o->square = ct_sum8_total(&s.square);
	o->abs = ct_sum8_total(&s.abs);
	o->diff = ct_sum8_total(&s.diff);
	o->mapped = ct_sum8_total(&s.mapped);
	o->max = largest(s.max);
	o->top = largest(s.top);
	o->pairs[0] = ct_sum8_total(&s.pairs[0]) + most;
	o->pairs[1] = ct_sum8_total(&s.pairs[1]) + most * p.below;
	o->pairs[2] = ct_sum8_total(&s.pairs[2]) + most * p.behind;
	for (size_t a = 0; a < 3; a++)
		o->gradient[a] = ct_sum8_total(&s.gradient[a]);
}

CT_INLINE double clipped(double v, const struct ct_ssim_map *map)
{
	v = v > map->lo ? v : map->lo;
	v = v < map->hi ? v : map->hi;
	return v - map->zero;
}

/* Columns [first, end); the last column of a row has no neighbour. */
CT_INLINE void add_columns(double *restrict c, size_t pitch, const struct ct_difference_row *r,
	const struct ct_ssim_map *map, size_t first, size_t end, const bool masked, const size_t on)
{
	const float *restrict ref = r->ref, *restrict test = r->test, *restrict mask = r->mask;
	const struct ct_ssim_map to = *map;

#pragma GCC ivdep
	for (size_t i = first; i < end; i++) {
		double w = masked && !(mask[i] != 0.0f) ? 0 : 1;
		double d = (double)test[i] - (double)ref[i], wd = w * d;
		double m = clipped((double)test[i], &to) - clipped((double)ref[i], &to);
		double p = on ? (masked && !(mask[i + on] != 0.0f) ? 0 : w) : 0;
		double g = (double)test[i + on] - (double)ref[i + on] - d;

		c[i] += w;
		c[pitch + i] += wd * d;
		c[2 * pitch + i] += __builtin_fabs(wd);
		c[3 * pitch + i] += wd;
		c[4 * pitch + i] += w * m * m;
		c[5 * pitch + i] += p;
		c[6 * pitch + i] += p * g * g;
	}
}

void CT_SIMD_HERE(ct_difference_row_columns)(double *column, size_t pitch,
	const struct ct_difference_row *r, const struct ct_ssim_map *map)
{
	if (r->mask)
		add_columns(column, pitch, r, map, 0, r->n - 1, true, 1);
	else
		add_columns(column, pitch, r, map, 0, r->n - 1, false, 1);
	add_columns(column, pitch, r, map, r->n - 1, r->n, r->mask != NULL, 0);
}

bool CT_SIMD_HERE(ct_difference_row_mark)(
	unsigned char *restrict flag, const float *restrict v, size_t n, float threshold)
{
	unsigned char any = 0;

	for (size_t i = 0; i < n; i++)
		flag[i] |= v[i] > threshold;
	for (size_t i = 0; i < n; i++)
		any |= v[i] > threshold;
	return any != 0;
}
