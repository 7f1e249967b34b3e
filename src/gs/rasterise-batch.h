/* rasterise-batch.h: what both directions of rasterise.h share: pieces of Gaussians, their boxes,
 * and the recurrence along the rows. For kernels (core/simd.h).
 *
 * The exponent is a quadratic in the row, so e goes from row to row by two multiplications:
 *   e *= step,   step *= bend,   bend = exp(-2 (kx slope^2 + ky))
 * in up to PANEL vectors of columns at once, which hides the latency of the chain. That holds its
 * precision over CT_RASTERISE_ROWS rows as long as nothing in the box around the ellipse is below
 * e^-60: for correlations up to 0.8. Beyond, every pixel has its exponential.
 *
 * Every column is computed on its own, so vectors of any width give the same bits.
 */
#ifndef CT_GS_RASTERISE_BATCH_H
#define CT_GS_RASTERISE_BATCH_H
#include "core/vec-exp.h"
#include "gs/rasterise.h"

#include <math.h>
#include <stdbool.h>

enum { L = CT_F32_LANES, PANEL = 4, AHEAD = 16, BATCH = 64 };

CT_INLINE ct_f32 ramp(void)
{
	static const float x[] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};

	return ct_f32_load(x);
}

CT_INLINE ct_f32 where(ct_i32 mask, ct_f32 x)
{
	return (ct_f32)(mask & (ct_i32)x);
}

CT_INLINE bool gentle(const struct ct_pixel_gaussian *d)
{
	return d->slope * d->slope * d->kx <= 0.64f / 0.36f * d->ky;
}

/* Up to CT_RASTERISE_ROWS rows of Gaussians, many at a time, so that their boxes are found in
 * vectors and well before they are needed: row r of the image, `count` of them, y of the first, and
 * the columns [lo, hi] around the ellipse there, relative to the centre's column; hi < lo: none. */
struct batch {
	size_t n;
	const struct ct_pixel_gaussian *d[BATCH];
	int32_t r[BATCH], count[BATCH], lo[BATCH], hi[BATCH], col[BATCH];
	float y[BATCH], fx[BATCH], kx[BATCH], ky[BATCH], slope[BATCH], cut[BATCH], y_right[BATCH];
};

CT_INLINE void push(struct batch *o, int32_t r, int32_t count, const struct ct_pixel_gaussian *d)
{
	size_t i = o->n++;

	o->d[i] = d;
	o->r[i] = r;
	o->count[i] = count;
	o->col[i] = d->col;
	o->y[i] = (float)(r - d->row) - d->fy;
	o->fx[i] = d->fx;
	o->kx[i] = d->kx;
	o->ky[i] = d->ky;
	o->slope[i] = d->slope;
	o->cut[i] = d->cut;
	o->y_right[i] = d->y_right;
}

CT_INLINE ct_f32 within(ct_f32 x, ct_f32 low, ct_f32 high)
{
	return ct_f32_min(high, ct_f32_max(low, x));
}

CT_INLINE ct_f32 whole(const int32_t *p)
{
	ct_i32 v;

	memcpy(&v, p, sizeof v);
	return __builtin_convertvector(v, ct_f32);
}

/* The largest whole number <= x, as such, for |x| < 2^31. */
CT_INLINE ct_i32 floor_int(ct_f32 x)
{
	const ct_i32 r = __builtin_convertvector(x, ct_i32);

	return r + (ct_i32)(__builtin_convertvector(r, ct_f32) > x);
}

/* L of them from i on: the ellipse reaches x = slope y -+ sqrt((cut - ky y^2) / kx), the leftmost
 * at y = -y_right, the rightmost at y = y_right, or as near as its rows go. */
CT_INLINE void measure(struct batch *o, size_t i, size_t w)
{
	const ct_f32 zero = {0}, kx = ct_f32_load(o->kx + i), ky = ct_f32_load(o->ky + i);
	const ct_f32 y = ct_f32_load(o->y + i), slope = ct_f32_load(o->slope + i);
	const ct_f32 cut = ct_f32_load(o->cut + i), right_y = ct_f32_load(o->y_right + i);
	const ct_f32 col = whole(o->col + i), fx = ct_f32_load(o->fx + i);
	const ct_f32 last = y + (whole(o->count + i) - 1.0f);
	const ct_f32 ya = within(-right_y, y, last), yb = within(right_y, y, last);
	const ct_f32 ra = cut - ky * ya * ya, rb = cut - ky * yb * yb;
	const ct_f32 left = zero - col, right = (float)((int32_t)w - 1) - col;
	const float hair = 1e-3f;
	const ct_f32 a = fx + slope * ya - ct_f32_sqrt(where(ra > zero, ra) / kx) - hair;
	const ct_f32 b = fx + slope * yb + ct_f32_sqrt(where(rb > zero, rb) / kx) + hair;
	const ct_i32 lo = -floor_int(-within(a, left, right + 1.0f));
	const ct_i32 hi = floor_int(within(b, left - 1.0f, right));

	memcpy(o->lo + i, &lo, sizeof lo);
	memcpy(o->hi + i, &hi, sizeof hi);
}

CT_INLINE void close_batch(struct batch *o, size_t w)
{
	for (size_t i = o->n; i % L; i++) { /* lanes that do not count */
		o->y[i] = o->fx[i] = o->slope[i] = o->cut[i] = o->y_right[i] = 0;
		o->kx[i] = o->ky[i] = 1;
		o->col[i] = o->count[i] = 0;
	}
	for (size_t i = 0; i < o->n; i += L)
		measure(o, i, w);
}

struct piece {
	float y;
	int32_t lo, hi;
};

/* Columns c to c + L - 1, from the centre. */
CT_INLINE ct_f32 columns(int32_t c, const struct ct_pixel_gaussian *d)
{
	return ramp() + (float)c - d->fx;
}

/* Between the last column and the next, from the centre. */
CT_INLINE float beyond(const struct piece *o, const struct ct_pixel_gaussian *d)
{
	return (float)o->hi + 0.5f - d->fx;
}

/* e of nb vectors of columns in a row, and what takes it to the next. */
struct walk {
	ct_f32 e[PANEL], step[PANEL];
};

/* Columns from c. Those outside the piece are zero and stay zero. */
CT_INLINE void walk_from(
	struct walk *k, int nb, int32_t c, const struct piece *o, const struct ct_pixel_gaussian *d)
{
	const float y = o->y, high = beyond(o, d);
	const float kxs = d->kx * d->slope, fall = kxs * d->slope + d->ky * (2 * y + 1);
	const float sy = d->slope * y, kyy = d->ky * y * y;

#pragma GCC unroll 4
	for (int b = 0; b < nb; b++) {
		const ct_f32 at = columns(c + b * L, d);
		const ct_f32 x = ct_f32_min(ct_f32_set(high), at) - sy;

		k->e[b] = where(at < high, ct_f32_exp(-(d->kx * x * x + kyy)));
		k->step[b] = ct_f32_exp(2 * kxs * x - fall);
	}
}

/* Long, thin and oblique: rows one by one. */
CT_INLINE void rows_of(
	struct batch *o, size_t w, int32_t r, int32_t count, const struct ct_pixel_gaussian *d)
{
	o->n = 0;
	for (int32_t m = 0; m < count; m++)
		push(o, r + m, 1, d);
	close_batch(o, w);
}

/* e of the columns from c of row m of the batch. */
CT_INLINE ct_f32 row_of(
	ct_f32 *x, const struct batch *o, size_t m, int32_t c, const struct ct_pixel_gaussian *d)
{
	const struct piece p = {o->y[m], o->lo[m], o->hi[m]};
	const ct_f32 at = columns(c, d);
	ct_f32 e;

	*x = at - d->slope * p.y;
	e = ct_f32_exp(-(d->kx * *x * *x + d->ky * p.y * p.y));
	return where((e >= d->least) & (at < beyond(&p, d)), e);
}

CT_INLINE int32_t next_block(int32_t r, int32_t end)
{
	const int32_t next = (r / CT_RASTERISE_ROWS + 1) * CT_RASTERISE_ROWS;

	return next < end ? next : end;
}

#endif
