/* rasterise.c: Gaussians into pixels, and the sums over pixels that their gradients need; see
 * rasterise.h. Kernels (core/simd.h).
 *
 * The exponent is a quadratic in the row, so e goes from row to row by two multiplications:
 *   e *= step,   step *= bend,   bend = exp(-2 (kx slope^2 + ky))
 * in up to PANEL vectors of columns at once, which hides the latency of the chain. That holds its
 * precision over CT_RASTERISE_ROWS rows as long as nothing in the box around the ellipse is below
 * e^-60: for correlations up to 0.8. Beyond, every pixel has its exponential.
 *
 * Every column is computed on its own, so vectors of any width give the same bits. Sums are added
 * in SPAN lanes, of columns SPAN apart, and then by a tree. What both directions share takes `add`,
 * a constant where it is inlined: true draws, false sums.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "core/vec-exp.h"
#include "gs/rasterise.h"

#include <stdbool.h>

enum { L = CT_F32_LANES, PANEL = 4, AHEAD = 16, BATCH = 64, SPAN = 16, PARTS = SPAN / L };

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
	uint32_t of[BATCH]; /* the Gaussian it is of, where sums are made */
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

typedef float four __attribute__((vector_size(16)));

struct sums {
	ct_f32 of[6][PARTS];
};

/* Four sums of the 16 lanes, 4 apart. */
CT_INLINE four fold(const ct_f32 part[PARTS])
{
	four q[4];

	memcpy(q, part, sizeof q);
	return (q[0] + q[2]) + (q[1] + q[3]);
}

/* a0 + a2, a1 + a3, b0 + b2, b1 + b3, and then neighbours. */
CT_INLINE four halve(four a, four b)
{
	return __builtin_shufflevector(a, b, 0, 1, 4, 5) +
	       __builtin_shufflevector(a, b, 2, 3, 6, 7);
}

CT_INLINE four pairs(four a, four b)
{
	return __builtin_shufflevector(a, b, 0, 2, 4, 6) +
	       __builtin_shufflevector(a, b, 1, 3, 5, 7);
}

/* out[i] = sum of the lanes of s->of[i]; out[6] and out[7] are no sums. */
CT_INLINE void across(float out[8], const struct sums *s)
{
	const four a = halve(fold(s->of[0]), fold(s->of[1]));
	const four b = halve(fold(s->of[2]), fold(s->of[3]));
	const four c = halve(fold(s->of[4]), fold(s->of[5]));
	const four low = pairs(a, b), high = pairs(c, c);

	memcpy(out, &low, sizeof low);
	memcpy(out + 4, &high, sizeof high);
}

/* Where pixels are: drawn to img, or read from g. */
struct frame {
	float *img;
	const float *g;
	size_t pitch, w;
};

/* Adds to the pixels from `at` on, or acc += sums of v {1, x, x^2, j, j x, j (j + 1) / 2} with x
 * from the centre's column and j = count to 1 from the first row to the last: running sums of
 * running sums. */
CT_INLINE void panel(bool add, struct sums *acc, const struct frame *f, size_t at, int nb,
	int32_t c, int32_t count, const struct piece *o, const struct ct_pixel_gaussian *d)
{
	const ct_f32 bend = ct_f32_set(d->bend), least = ct_f32_set(d->least);
	const ct_f32 amp = ct_f32_set(d->amp);
	const size_t pitch = f->pitch;
	float *to = add ? f->img + at : NULL;
	const float *from = add ? to : f->g + at;
	ct_f32 s[PANEL] = {{0}}, sj[PANEL] = {{0}}, sjj[PANEL] = {{0}};
	struct walk k;

	walk_from(&k, nb, c, o, d);
	for (int32_t m = 0; m < count; m++, from += pitch)
#pragma GCC unroll 4
		for (int b = 0; b < nb; b++) {
			const ct_f32 e = where(k.e[b] >= least, k.e[b]);
			const ct_f32 v = ct_f32_load(from + b * L);

			if (add) {
				ct_f32_store(to + (size_t)m * pitch + b * L, v + amp * e);
			} else {
				s[b] += v * e;
				sj[b] += s[b];
				sjj[b] += sj[b];
			}
			k.e[b] *= k.step[b];
			k.step[b] *= bend;
		}
	if (add)
		return;
#pragma GCC unroll 4
	for (int b = 0; b < nb; b++) {
		const ct_f32 x = columns(c + b * L, d), sx = s[b] * x;

		acc->of[0][b % PARTS] += s[b];
		acc->of[1][b % PARTS] += sx;
		acc->of[2][b % PARTS] += sx * x;
		acc->of[3][b % PARTS] += sj[b];
		acc->of[4][b % PARTS] += sj[b] * x;
		acc->of[5][b % PARTS] += sjj[b];
	}
}

CT_INLINE void walk_piece(bool add, struct sums *acc, const struct frame *f, size_t row,
	int32_t count, const struct piece *o, const struct ct_pixel_gaussian *d)
{
	for (int32_t c = o->lo; c <= o->hi; c += PANEL * L) {
		const size_t at = row + (size_t)(d->col + c);
		const int32_t left = o->hi - c;

		if (left < L)
			panel(add, acc, f, at, 1, c, count, o, d);
		else if (left < 2 * L)
			panel(add, acc, f, at, 2, c, count, o, d);
		else if (left < 3 * L)
			panel(add, acc, f, at, 3, c, count, o, d);
		else
			panel(add, acc, f, at, 4, c, count, o, d);
	}
}

/* Long, thin and oblique: every pixel of `count` rows from r on, of which the first is at `row`;
 * acc then has the sums of v {1, x, y, x^2, x y, y^2}. */
CT_INLINE void steep_piece(bool add, struct sums *acc, const struct frame *f, size_t row, int32_t r,
	int32_t count, const struct ct_pixel_gaussian *d)
{
	struct batch o;

	o.n = 0;
	for (int32_t m = 0; m < count; m++)
		push(&o, r + m, 1, d);
	close_batch(&o, f->w);
	for (size_t m = 0; m < o.n; m++, row += f->pitch)
		for (int32_t c = o.lo[m]; c <= o.hi[m]; c += L) {
			const size_t part = (size_t)(c - o.lo[m]) / L % PARTS;
			const size_t at = row + (size_t)(d->col + c);
			const struct piece p = {o.y[m], o.lo[m], o.hi[m]};
			const ct_f32 dx = columns(c, d), x = dx - d->slope * p.y;
			ct_f32 e = ct_f32_exp(-(d->kx * x * x + d->ky * p.y * p.y)), v;

			e = where((e >= d->least) & (dx < beyond(&p, d)), e);
			if (add) {
				ct_f32_store(f->img + at, d->amp * e + ct_f32_load(f->img + at));
				continue;
			}
			v = e * ct_f32_load(f->g + at);
			acc->of[0][part] += v;
			acc->of[1][part] += v * x;
			acc->of[2][part] += v * p.y;
			acc->of[3][part] += v * x * x;
			acc->of[4][part] += v * x * p.y;
			acc->of[5][part] += v * p.y * p.y;
		}
}

/* Piece i of a batch. */
CT_INLINE void any_piece(bool add, struct sums *acc, const struct frame *f, size_t row,
	const struct batch *o, size_t i)
{
	const struct piece p = {o->y[i], o->lo[i], o->hi[i]};

	if (gentle(o->d[i]))
		walk_piece(add, acc, f, row, o->count[i], &p, o->d[i]);
	else
		steep_piece(add, acc, f, row, o->r[i], o->count[i], o->d[i]);
}

/* The last row of the block that r is in, and the next. */
CT_INLINE int32_t next_block(int32_t r, int32_t end)
{
	const int32_t next = (r / CT_RASTERISE_ROWS + 1) * CT_RASTERISE_ROWS;

	return next < end ? next : end;
}

CT_INLINE void add_batch(const struct frame *f, size_t r0, struct batch *o)
{
	close_batch(o, f->w);
	for (size_t i = 0; i < o->n; i++)
		any_piece(true, NULL, f, ((size_t)o->r[i] - r0) * f->pitch, o, i);
	o->n = 0;
}

void CT_SIMD_HERE(ct_rasterise_add)(float *img, size_t pitch, size_t w, size_t r0, size_t r1,
	size_t n, const uint32_t *item, const struct ct_pixel_gaussian *all)
{
	const struct frame f = {.img = img, .pitch = pitch, .w = w};
	struct batch o;

	o.n = 0;
	for (size_t i = 0; i < n; i++) {
		const struct ct_pixel_gaussian *d = all + (item ? item[i] : i);
		int32_t r = d->first > (int32_t)r0 ? d->first : (int32_t)r0;
		int32_t end = d->end < (int32_t)r1 ? d->end : (int32_t)r1;

		while (r < end) {
			int32_t next = next_block(r, end);

			push(&o, r, next - r, d);
			r = next;
			if (o.n == BATCH)
				add_batch(&f, r0, &o);
		}
		if (item && i + AHEAD < n)
			__builtin_prefetch(all + item[i + AHEAD]);
	}
	add_batch(&f, r0, &o);
}

/* Sums of the pieces of a batch, raw: as a walk has them; done: by x and y. */
struct tally {
	float raw[6][BATCH], done[6][BATCH];
};

CT_INLINE ct_f64 widen_int(const int32_t *p)
{
	ct_i32h v;

	memcpy(&v, p, sizeof v);
	return __builtin_convertvector(v, ct_f64);
}

/* CT_F64_LANES pieces from i on: y = past - j with y of the row after the last, and x less slope
 * y. */
CT_INLINE void moments(ct_f64 s[6], const struct tally *t, const struct batch *o, size_t i)
{
	const ct_f64 s0 = ct_f64_widen(t->raw[0] + i), u = ct_f64_widen(t->raw[1] + i);
	const ct_f64 uu = ct_f64_widen(t->raw[2] + i), j = ct_f64_widen(t->raw[3] + i);
	const ct_f64 slope = ct_f64_widen(o->slope + i);
	const ct_f64 past = ct_f64_widen(o->y + i) + widen_int(o->count + i);
	const ct_f64 y = past * s0 - j, uy = past * u - ct_f64_widen(t->raw[4] + i);
	const ct_f64 yy = past * past * s0 - 2 * past * j + (2 * ct_f64_widen(t->raw[5] + i) - j);

	s[0] = s0 + ct_f64_widen(t->done[0] + i);
	s[1] = u - slope * y + ct_f64_widen(t->done[1] + i);
	s[2] = y + ct_f64_widen(t->done[2] + i);
	s[3] = uu - slope * (2 * uy - slope * yy) + ct_f64_widen(t->done[3] + i);
	s[4] = uy - slope * yy + ct_f64_widen(t->done[4] + i);
	s[5] = yy + ct_f64_widen(t->done[5] + i);
}

/* out[k] of each piece's Gaussian += its sums. */
CT_INLINE void sums_batch(
	double *out, size_t stride, const struct frame *f, size_t skip, struct batch *o)
{
	struct tally t;

	close_batch(o, f->w);
	for (size_t i = 0; i < o->n; i++) {
		const bool walks = gentle(o->d[i]);
		struct sums acc = {{{{0}}}};
		float a[8];

		any_piece(false, &acc, f, o->of[i] * skip + (size_t)o->r[i] * f->pitch, o, i);
		across(a, &acc);
		for (size_t k = 0; k < 6; k++) {
			t.raw[k][i] = walks ? a[k] : 0;
			t.done[k][i] = walks ? 0 : a[k];
		}
	}
	for (size_t i = o->n; i % L; i++) /* lanes that do not count */
		for (size_t k = 0; k < 6; k++)
			t.raw[k][i] = t.done[k][i] = 0;
	for (size_t i = 0; i < o->n; i += CT_F64_LANES) {
		ct_f64 s[6];

		moments(s, &t, o, i);
		for (size_t l = 0; l < CT_F64_LANES && i + l < o->n; l++)
			for (size_t k = 0; k < 6; k++)
				out[k * stride + o->of[i + l]] += s[k][l];
	}
	o->n = 0;
}

void CT_SIMD_HERE(ct_rasterise_sums)(double *out, size_t stride, const float *g, size_t skip,
	size_t pitch, size_t w, size_t n, const struct ct_pixel_gaussian *all)
{
	const struct frame f = {.g = g, .pitch = pitch, .w = w};
	struct batch o;

	o.n = 0;
	for (size_t i = 0; i < n; i++) {
		for (size_t k = 0; k < 6; k++)
			out[k * stride + i] = 0;
		for (int32_t r = all[i].first; r < all[i].end;) {
			int32_t next = next_block(r, all[i].end);

			o.of[o.n] = (uint32_t)i;
			push(&o, r, next - r, all + i);
			r = next;
			if (o.n == BATCH)
				sums_batch(out, stride, &f, skip, &o);
		}
	}
	sums_batch(out, stride, &f, skip, &o);
}
