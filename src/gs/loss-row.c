/* loss-row.c: rows of the L1 and TV terms (loss.h). Kernels (core/simd.h): SPAN numbers at a time,
 * of which each has its own sum. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "gs/loss.h"
#include "core/vec.h"

enum { SPAN = 16, PARTS = SPAN / CT_F32_LANES };

struct sums {
	ct_f32 part[PARTS];
};

/* Of the first to the last lane. */
CT_INLINE double total(const struct sums *s)
{
	float all[SPAN];
	double sum = 0;

	memcpy(all, s->part, sizeof all);
	for (int l = 0; l < SPAN; l++)
		sum += (double)all[l];
	return sum;
}

/* Elements that vector k has of the n of a span. */
CT_INLINE size_t share(size_t n, size_t k)
{
	return n <= k * CT_F32_LANES ? 0 : n - k * CT_F32_LANES;
}

CT_INLINE ct_f32 sign(ct_f32 x, ct_f32 by)
{
	const ct_f32 zero = {0};

	return ct_f32_pick((ct_i32)(x > zero), by, ct_f32_pick((ct_i32)(x < zero), -by, zero));
}

/* The n <= SPAN pixels from i on. */
CT_INLINE void pixels(
	const struct ct_loss_row *r, size_t i, size_t n, ct_f32 scale, ct_f32 step, struct sums *s)
{
#pragma GCC unroll 4
	for (size_t k = 0; k < PARTS; k++) {
		const size_t at = i + k * CT_F32_LANES, m = share(n, k);
		const ct_f32 zero = {0};
		ct_f32 x, y, g = step, size;

		if (m == 0)
			continue;
		x = ct_f32_load_n(r->img + at, m) +
		    (r->base ? ct_f32_load_n(r->base + at, m) : zero);
		x *= scale;
		y = ct_f32_load_n(r->want + at, m) * scale;
		size = ct_f32_abs(x - y);
		if (r->weight) {
			const ct_f32 weight = ct_f32_load_n(r->weight + at, m);

			size *= weight;
			g *= weight;
		}
		s->part[k] += size;
		ct_f32_store_n(r->x + at, x, m);
		ct_f32_store_n(r->y + at, y, m);
		ct_f32_store_n(r->g + at, sign(x - y, g), m);
	}
}

double CT_SIMD_HERE(ct_loss_row_l1)(const struct ct_loss_row *r, size_t n, float scale, float step)
{
	const ct_f32 by = ct_f32_set(scale), g = ct_f32_set(step);
	struct sums s = {{{0}}};
	size_t i = 0;

	for (; i + SPAN <= n; i += SPAN)
		pixels(r, i, SPAN, by, g, &s);
	if (i < n)
		pixels(r, i, n - i, by, g, &s);
	return total(&s);
}

/* The n <= SPAN differences from i on. */
CT_INLINE void differ(float *da, float *db, const float *a, const float *b, const float *ab,
	const float *bb, size_t i, size_t n, ct_f32 w, struct sums *s)
{
	ct_f32 g[PARTS] = {{0}};

#pragma GCC unroll 4
	for (size_t k = 0; k < PARTS; k++) {
		const size_t at = i + k * CT_F32_LANES, m = share(n, k);
		ct_f32 d;

		if (m == 0)
			continue;
		d = ct_f32_load_n(b + at, m) - ct_f32_load_n(a + at, m);
		if (ab)
			d += ct_f32_load_n(bb + at, m) - ct_f32_load_n(ab + at, m);
		s->part[k] += ct_f32_abs(d);
		g[k] = sign(d, w);
		if (da)
			ct_f32_store_n(da + at, ct_f32_load_n(da + at, m) - g[k], m);
	}
#pragma GCC unroll 4
	for (size_t k = 0; k < PARTS; k++) { /* after all of da, which may overlap */
		const size_t at = i + k * CT_F32_LANES, m = share(n, k);

		if (db && m > 0)
			ct_f32_store_n(db + at, ct_f32_load_n(db + at, m) + g[k], m);
	}
}

double CT_SIMD_HERE(ct_loss_row_tv)(float *da, float *db, const float *a, const float *b,
	const float *ab, const float *bb, size_t n, float w)
{
	const ct_f32 by = ct_f32_set(w);
	struct sums s = {{{0}}};
	size_t i = 0;

	for (; i + SPAN <= n; i += SPAN)
		differ(da, db, a, b, ab, bb, i, SPAN, by, &s);
	if (i < n)
		differ(da, db, a, b, ab, bb, i, n - i, by, &s);
	return total(&s);
}
