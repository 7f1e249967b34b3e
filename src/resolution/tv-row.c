/* tv-row.c: see tv-row.h. */
#include "config.h"
#include "resolution/tv-row.h"
#include "core/vec-i16.h"

#include <stdbool.h>

/* What is kept of a dual. */
CT_INLINE ct_f32 put(int16_t *p, ct_f32 q, size_t m)
{
	const ct_i32 whole = ct_i32_round(q);

	ct_i32_store_i16(p, whole, m);
	return ct_f32_from(whole);
}

/* Voxels [i, i + m), m <= CT_F32_LANES, of which the last ends the row if `end`. */
CT_INLINE void sweep(const struct ct_tv_row *r, size_t i, size_t m, ct_f32 *left,
	const float weight[3], float s, float t, const bool end, const bool measure)
{
	const ct_f32 x = ct_f32_load_n(r->x + i, m), one = ct_f32_set(CT_TV_ONE);
	const ct_f32 next = end ? ct_f32_load_n(r->x + i + 1, m - 1) : ct_f32_load(r->x + i + 1);
	const ct_f32 p0 = ct_f32_load_i16(r->p[0] + i, m), p1 = ct_f32_load_i16(r->p[1] + i, m);
	const ct_f32 p2 = ct_f32_load_i16(r->p[2] + i, m);
	ct_f32 gi = weight[0] * (next - x), gj = weight[1] * (ct_f32_load_n(r->xj + i, m) - x);
	ct_f32 gk = weight[2] * (ct_f32_load_n(r->xk + i, m) - x), qi, qj, qk, step;

	if (end)
		gi = ct_f32_pick(ct_i32_first(m - 1), gi, ct_f32_set(0));
	qi = p0 + s * gi;
	qj = p1 + s * gj;
	qk = p2 + s * gk;
	if (measure)
		ct_f32_store_n(r->grad + i, gi * gi + gj * gj + gk * gk, m);
	step = one / ct_f32_sqrt(ct_f32_max(qi * qi + qj * qj + qk * qk, one * one));
	qi = put(r->p[0] + i, qi * step, m);
	qj = put(r->p[1] + i, qj * step, m);
	qk = put(r->p[2] + i, qk * step, m);
	qi = weight[0] * (2.0f * qi - p0);
	qj = weight[1] * (2.0f * qj - p1);
	qk = weight[2] * (2.0f * qk - p2);
	step = t * ((qi - ct_f32_slide(*left, qi)) + (qj - ct_f32_load_n(r->before + i, m)) +
			   (qk - ct_f32_load_n(r->below + i, m))) +
	       r->pull * (ct_f32_load_n(r->to + i, m) - x);
	*left = qi;
	ct_f32_store_n(r->after + i, qj, m);
	ct_f32_store_n(r->below + i, qk, m);
	ct_f32_store_n(r->out + i, x + step, m);
	if (measure)
		ct_f32_store_n(r->step + i, step, m);
}

CT_INLINE void row(const struct ct_tv_row *r, size_t n, const float weight[3], float s, float t,
	const bool measure)
{
	ct_f32 left = ct_f32_set(0);
	size_t i = 0;

	for (; i + CT_F32_LANES < n; i += CT_F32_LANES)
		sweep(r, i, CT_F32_LANES, &left, weight, s, t, false, measure);
	sweep(r, i, n - i, &left, weight, s, t, true, measure);
}

void CT_SIMD_HERE(ct_tv_row_sweep)(
	const struct ct_tv_row *r, size_t n, const float weight[3], float s, float t)
{
	const struct ct_tv_row here = *r; /* so that no store can change it */
	const float w[3] = {weight[0], weight[1], weight[2]};

	if (r->grad)
		row(&here, n, w, s, t, true);
	else
		row(&here, n, w, s, t, false);
}

enum { LANES = 16 }; /* partial sums, in a fixed order */

static double total(const double part[LANES])
{
	double s = 0;

	for (size_t l = 0; l < LANES; l++)
		s += part[l];
	return s;
}

/* Sum of the square roots of v, which it leaves there. */
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

double CT_SIMD_HERE(ct_tv_row_squares)(const float *v, size_t n)
{
	double part[LANES] = {0};

	for (size_t i = 0; i < n; i += LANES)
		for (size_t l = 0; l < (n - i < LANES ? n - i : LANES); l++)
			part[l] += (double)v[i + l] * (double)v[i + l];
	return total(part);
}
