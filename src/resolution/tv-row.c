/* tv-row.c: see tv-row.h. */
#include "config.h"
#include "resolution/tv-row.h"
#include "core/vec-i16.h"

#include <stdbool.h>

/* What is kept of a dual, q by: adding 1.5 2^23, 0x4b400000 as an integer, rounds it, and leaves it
 * in the low bits. */
CT_INLINE ct_f32 put(int16_t *p, ct_f32 q, ct_f32 by, size_t m)
{
	const ct_f32 magic = ct_f32_set(12582912.0f), sum = ct_f32_fma(q, by, magic);

	ct_i32_store_i16(p, (ct_i32)sum - 0x4b400000, m);
	return sum - magic;
}

/* What brings a vector of the square q back to |q| <= CT_TV_ONE. */
CT_INLINE ct_f32 shrink(ct_f32 square)
{
	const ct_f32 one = ct_f32_set(CT_TV_ONE);

	return one / ct_f32_sqrt(ct_f32_max(square, one * one));
}

/* What a row is swept with: kept apart from the row, lest a store change it. */
struct sweep {
	struct ct_tv_row r;
	float weight[3], s[3], t[3]; /* of each axis; times the steps */
};

enum { AHEAD = 512, LINE = 64 }; /* voxels; bytes */

/* Begin to fetch the dual and the volume of the voxels that follow in AHEAD: the processor does not
 * see so many streams coming by itself. */
CT_INLINE void fetch(const struct ct_tv_row *r, size_t i, const bool add)
{
	if (i % (LINE / sizeof(int16_t)) == 0) {
		__builtin_prefetch(r->p[0] + i + AHEAD, 1);
		__builtin_prefetch(r->p[1] + i + AHEAD, 1);
		__builtin_prefetch(r->p[2] + i + AHEAD, 1);
	}
	if (add && i % (LINE / sizeof(float)) == 0)
		__builtin_prefetch(r->ahead + i + AHEAD);
}

/* What is known of CT_F32_LANES voxels before the square root: x, the dual and what it moves to,
 * and what brings that back. */
struct ascent {
	ct_f32 x, p0, p1, p2, q0, q1, q2, by;
};

/* Voxels [i, i + m), m <= CT_F32_LANES, of which the last ends the row if `end`. */
CT_INLINE struct ascent ascend(const struct sweep *w, size_t i, size_t m, const bool end,
	const bool measure, const bool add)
{
	const struct ct_tv_row *r = &w->r;
	const ct_f32 x = ct_f32_load_n(r->x + i, m);
	const ct_f32 next = end ? ct_f32_load_n(r->x + i + 1, m - 1) : ct_f32_load(r->x + i + 1);
	ct_f32 xk, gi = next - x, gj, gk, square;
	struct ascent v;

	fetch(r, i, add);
	if (add) {
		xk = ct_f32_fma(ct_f32_set(r->by), ct_f32_load_n(r->plus + i, m),
			ct_f32_load_n(r->ahead + i, m));
		ct_f32_store_n(r->xk + i, xk, m);
	} else {
		xk = ct_f32_load_n(r->xk + i, m);
	}
	gj = ct_f32_load_n(r->xj + i, m) - x;
	gk = xk - x;
	if (end)
		gi = ct_f32_pick(ct_i32_first(m - 1), gi, ct_f32_set(0));
	if (measure) {
		const ct_f32 a = w->weight[0] * gi, b = w->weight[1] * gj, c = w->weight[2] * gk;

		ct_f32_store_n(r->grad + i, a * a + b * b + c * c, m);
	}
	v.x = x;
	v.p0 = ct_f32_load_i16(r->p[0] + i, m);
	v.p1 = ct_f32_load_i16(r->p[1] + i, m);
	v.p2 = ct_f32_load_i16(r->p[2] + i, m);
	v.q0 = ct_f32_fma(ct_f32_set(w->s[0]), gi, v.p0);
	v.q1 = ct_f32_fma(ct_f32_set(w->s[1]), gj, v.p1);
	v.q2 = ct_f32_fma(ct_f32_set(w->s[2]), gk, v.p2);
	square = ct_f32_fma(v.q1, v.q1, v.q0 * v.q0);
	v.by = shrink(ct_f32_fma(v.q2, v.q2, square));
	return v;
}

CT_INLINE void descend(const struct sweep *w, const struct ascent v, size_t i, size_t m,
	ct_f32 *left, const bool draw, const bool measure)
{
	const struct ct_tv_row *r = &w->r;
	const ct_f32 two = ct_f32_set(2);
	const ct_f32 q0 = ct_f32_fma(two, put(r->p[0] + i, v.q0, v.by, m), -v.p0);
	const ct_f32 q1 = ct_f32_fma(two, put(r->p[1] + i, v.q1, v.by, m), -v.p1);
	const ct_f32 q2 = ct_f32_fma(two, put(r->p[2] + i, v.q2, v.by, m), -v.p2);
	ct_f32 step = ct_f32_set(w->t[0]) * (q0 - ct_f32_slide(*left, q0));

	step = ct_f32_fma(ct_f32_set(w->t[1]), q1 - ct_f32_load_n(r->before + i, m), step);
	step = ct_f32_fma(ct_f32_set(w->t[2]), q2 - ct_f32_load_n(r->below + i, m), step);
	if (draw)
		step = ct_f32_fma(ct_f32_set(r->pull), ct_f32_load_n(r->to + i, m) - v.x, step);
	*left = q0;
	ct_f32_store_n(r->after + i, q1, m);
	ct_f32_store_n(r->below + i, q2, m);
	ct_f32_store_n(r->out + i, v.x + step, m);
	if (measure)
		ct_f32_store_n(r->step + i, step, m);
}

/* The ascent is a step ahead of the descent, which so finds its root made. */
CT_INLINE void row(
	const struct sweep *w, size_t n, const bool draw, const bool measure, const bool add)
{
	ct_f32 left = ct_f32_set(0);
	struct ascent now;
	size_t i = 0;

	if (n > CT_F32_LANES) {
		now = ascend(w, 0, CT_F32_LANES, false, measure, add);
		for (; i + 2 * CT_F32_LANES < n; i += CT_F32_LANES) {
			const struct ascent next =
				ascend(w, i + CT_F32_LANES, CT_F32_LANES, false, measure, add);

			descend(w, now, i, CT_F32_LANES, &left, draw, measure);
			now = next;
		}
		descend(w, now, i, CT_F32_LANES, &left, draw, measure);
		i += CT_F32_LANES;
	}
	now = ascend(w, i, n - i, true, measure, add);
	descend(w, now, i, n - i, &left, draw, measure);
}

CT_INLINE void choose(const struct sweep *w, size_t n, const bool add)
{
	if (w->r.grad && w->r.to)
		row(w, n, true, true, add);
	else if (w->r.grad)
		row(w, n, false, true, add);
	else if (w->r.to)
		row(w, n, true, false, add);
	else
		row(w, n, false, false, add);
}

void CT_SIMD_HERE(ct_tv_row_sweep)(
	const struct ct_tv_row *r, size_t n, const float weight[3], float s, float t)
{
	struct sweep w = {.r = *r};

	for (int a = 0; a < 3; a++) {
		w.weight[a] = weight[a];
		w.s[a] = s * weight[a];
		w.t[a] = t * weight[a];
	}
	if (r->ahead)
		choose(&w, n, true);
	else
		choose(&w, n, false);
}

enum { LANES = 16 }; /* partial sums, in a fixed order */

static double total(const double part[LANES])
{
	double s = 0;

	for (size_t l = 0; l < LANES; l++)
		s += part[l];
	return s;
}

double CT_SIMD_HERE(ct_tv_row_roots)(float *v, size_t n)
{
	double part[LANES] = {0};

#pragma GCC ivdep
	for (size_t i = 0; i < n; i++)
		v[i] = __builtin_sqrtf(v[i]);
	for (size_t i = 0; i < n; i += LANES)
		for (size_t l = 0; l < (n - i < LANES ? n - i : LANES); l++)
			part[l] += (double)v[i + l];
	return total(part);
}

double CT_SIMD_HERE(ct_tv_row_mend)(float *restrict x, const float *restrict before,
	const float *restrict below, float t, size_t n)
{
	double part[LANES] = {0};

	for (size_t i = 0; i < n; i++)
		x[i] -= t * below[i];
	for (size_t i = 0; before && i < n; i += LANES)
		for (size_t l = 0; l < (n - i < LANES ? n - i : LANES); l++) {
			const double step = (double)x[i + l] - (double)before[i + l];

			part[l] += step * step;
		}
	return total(part);
}
