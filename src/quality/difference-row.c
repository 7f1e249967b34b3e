/* difference-row.c: see difference.h. */
#include "config.h"
#include "quality/difference.h"
#include "core/vec.h"

enum { LANES = CT_F64_LANES };

/* d = test - ref. */
CT_INLINE ct_f64 difference(const float *ref, const float *test)
{
	return ct_f64_widen(test) - ct_f64_widen(ref);
}

/* 1 where the mask is not 0, else 0. */
CT_INLINE ct_f64 weight(const float *mask)
{
	const ct_i64 counts = ct_f64_widen(mask) != 0.0;

	return (ct_f64)(counts & (ct_i64)ct_f64_set(1));
}

CT_INLINE ct_f64 clip(ct_f64 v, const struct ct_ssim_map *map)
{
	return ct_f64_min(ct_f64_max(v, ct_f64_set(map->lo)), ct_f64_set(map->hi));
}

CT_INLINE double largest(ct_f64 v)
{
	double most = 0;

	for (size_t l = 0; l < LANES; l++)
		most = v[l] > most ? v[l] : most;
	return most;
}

struct sums {
	struct ct_sum8 count, square, abs, diff, mapped;
	ct_f64 max, top;
};

/* CT_SUM_LANES voxels. */
CT_INLINE void sum_eight(struct sums *s, double *d, const float *ref, const float *test,
	const float *mask, const struct ct_ssim_map *map)
{
#pragma GCC unroll 4
	for (size_t q = 0; q < CT_SUM_PARTS; q++) {
		const ct_f64 a = ct_f64_widen(ref + q * LANES), b = ct_f64_widen(test + q * LANES);
		const ct_f64 w = weight(mask + q * LANES), delta = b - a, counted = w * delta;
		const ct_f64 m = clip(b, map) - clip(a, map);

		ct_f64_store(d + q * LANES, delta);
		s->count.part[q] += w;
		s->square.part[q] += counted * delta;
		s->abs.part[q] += ct_f64_abs(counted);
		s->diff.part[q] += counted;
		s->mapped.part[q] += w * m * m;
		s->max = ct_f64_max(ct_f64_abs(counted), s->max);
		s->top = ct_f64_max(ct_f64_max(ct_f64_abs(a), ct_f64_abs(b)), s->top);
	}
}

void CT_SIMD_HERE(ct_difference_row_sum)(struct ct_sums *o, double *d,
	const struct ct_difference_row *r, const struct ct_ssim_map *map)
{
	const size_t most = r->n / CT_SUM_LANES * CT_SUM_LANES, rest = r->n - most;
	const struct ct_ssim_map m = *map;
	float ref[CT_SUM_LANES] = {0}, test[CT_SUM_LANES] = {0}, mask[CT_SUM_LANES] = {0};
	struct sums s = {0};

	for (size_t i = 0; i < most; i += CT_SUM_LANES)
		sum_eight(&s, d + i, r->ref + i, r->test + i, r->mask[0] + i, &m);
	memcpy(ref, r->ref + most, rest * sizeof *ref);
	memcpy(test, r->test + most, rest * sizeof *test);
	memcpy(mask, r->mask[0] + most, rest * sizeof *mask);
	sum_eight(&s, d + most, ref, test, mask, &m);
	o->count = ct_sum8_total(&s.count);
	o->square = ct_sum8_total(&s.square);
	o->abs = ct_sum8_total(&s.abs);
	o->diff = ct_sum8_total(&s.diff);
	o->mapped = ct_sum8_total(&s.mapped);
	o->max = largest(s.max);
	o->top = largest(s.top);
}

/* Where the voxels of a vector, and the neighbours of each, are. */
struct place {
	const double *d, *down;  /* of this row and the next */
	const float *ref, *test; /* of the next slice */
	const float *mask[3];
	double under, behind; /* 0 if there is no next row, no next slice; else 1 */
};

struct pairs {
	struct ct_sum8 pairs[3], gradient[3];
};

CT_INLINE void pair_eight(struct pairs *s, const struct place *p, size_t at)
{
#pragma GCC unroll 4
	for (size_t q = 0; q < CT_SUM_PARTS; q++) {
		const size_t i = at + q * LANES;
		const ct_f64 d = ct_f64_load(p->d + i), gi = ct_f64_load(p->d + i + 1) - d;
		const ct_f64 gj = ct_f64_load(p->down + i) - d;
		const ct_f64 gk = difference(p->ref + i, p->test + i) - d;
		const ct_f64 w = weight(p->mask[0] + i), pi = w * weight(p->mask[0] + i + 1);
		const ct_f64 pj = w * (weight(p->mask[1] + i) * p->under);
		const ct_f64 pk = w * (weight(p->mask[2] + i) * p->behind);

		s->pairs[0].part[q] += pi;
		s->pairs[1].part[q] += pj;
		s->pairs[2].part[q] += pk;
		s->gradient[0].part[q] += pi * gi * gi;
		s->gradient[1].part[q] += pj * gj * gj;
		s->gradient[2].part[q] += pk * gk * gk;
	}
}

/* The last voxels, from a copy that ends in voxels that do not count. */
static void pair_last(struct pairs *s, const struct place *at, size_t done, size_t n)
{
	enum { ROW = 2 * CT_SUM_LANES };
	float ref[ROW] = {0}, test[ROW] = {0}, mask[3][ROW] = {{0}};
	const size_t bytes = (n - done) * sizeof *ref;
	struct place p = {at->d + done, at->down + done, ref, test, {mask[0], mask[1], mask[2]},
		at->under, at->behind};

	memcpy(ref, at->ref + done, bytes);
	memcpy(test, at->test + done, bytes);
	for (size_t k = 0; k < 3; k++)
		memcpy(mask[k], at->mask[k] + done, bytes);
	pair_eight(s, &p, 0);
}

void CT_SIMD_HERE(ct_difference_row_pairs)(
	struct ct_sums *o, const double *d, const double *down, const struct ct_difference_row *r)
{
	const struct place p = {.d = d,
		.down = r->down ? down : d,
		.ref = r->ref + r->next,
		.test = r->test + r->next,
		.mask = {r->mask[0], r->mask[1], r->mask[2]},
		.under = r->down ? 1 : 0,
		.behind = r->next ? 1 : 0};
	const size_t most = (r->n - 1) / CT_SUM_LANES * CT_SUM_LANES; /* each has a neighbour */
	struct pairs s = {0};

	for (size_t i = 0; i < most; i += CT_SUM_LANES)
		pair_eight(&s, &p, i);
	pair_last(&s, &p, most, r->n);
	for (size_t a = 0; a < 3; a++) {
		o->pairs[a] = ct_sum8_total(&s.pairs[a]);
		o->gradient[a] = ct_sum8_total(&s.gradient[a]);
	}
}
