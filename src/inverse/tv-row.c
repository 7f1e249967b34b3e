/* tv-row.c: see tv-row.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "inverse/tv-row.h"
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

enum { AHEAD = 512, LINE = 64 }; /* voxels; bytes */

/* Begin to fetch the dual and the volume of the voxels that follow in AHEAD: the processor does not
 * see so many streams coming by itself. */
CT_INLINE void fetch(const struct ct_tv_row *r, size_t i)
{
	if (i % (LINE / sizeof(int16_t)) == 0) {
		__builtin_prefetch(r->p[0] + i + AHEAD, 1);
		__builtin_prefetch(r->p[1] + i + AHEAD, 1);
		__builtin_prefetch(r->p[2] + i + AHEAD, 1);
	}
	if (r->ahead && i % (LINE / sizeof(float)) == 0)
		__builtin_prefetch(r->ahead + i + AHEAD);
}

/* Voxels [i, i + m), m <= CT_F32_LANES, of which the last ends the row if `end`; left: the
 * i-components of the dual before them. */
CT_INLINE void move(const struct ct_tv_row *r, size_t i, size_t m, ct_f32 *left, const bool end)
{
	const ct_f32 x = ct_f32_load_n(r->x + i, m), two = ct_f32_set(2);
	const ct_f32 next = end ? ct_f32_load_n(r->x + i + 1, m - 1) : ct_f32_load(r->x + i + 1);
	ct_f32 g[3], p[3], q[3], by, xk, step;

	fetch(r, i);
	if (r->ahead) {
		xk = ct_f32_fma(ct_f32_set(r->by), ct_f32_load_n(r->plus + i, m),
			ct_f32_load_n(r->ahead + i, m));
		ct_f32_store_n(r->xk + i, xk, m);
	} else {
		xk = ct_f32_load_n(r->xk + i, m);
	}
	g[0] = end ? ct_f32_pick(ct_i32_first(m - 1), next - x, ct_f32_set(0)) : next - x;
	g[1] = ct_f32_load_n(r->xj + i, m) - x;
	g[2] = xk - x;
#pragma GCC unroll 3
	for (int a = 0; a < 3; a++) {
		p[a] = ct_f32_load_i16(r->p[a] + i, m);
		q[a] = ct_f32_fma(ct_f32_set(r->s[a]), g[a], p[a]);
	}
	by = shrink(ct_f32_fma(q[2], q[2], ct_f32_fma(q[1], q[1], q[0] * q[0])));
#pragma GCC unroll 3
	for (int a = 0; a < 3; a++)
		q[a] = ct_f32_fma(two, put(r->p[a] + i, q[a], by, m), -p[a]);
	step = ct_f32_set(r->t[0]) * (q[0] - ct_f32_slide(*left, q[0]));
	step = ct_f32_fma(ct_f32_set(r->t[1]), q[1] - ct_f32_load_n(r->before + i, m), step);
	step = ct_f32_fma(ct_f32_set(r->t[2]), q[2] - ct_f32_load_n(r->below + i, m), step);
	if (r->to)
		step = ct_f32_fma(ct_f32_set(r->pull), ct_f32_load_n(r->to + i, m) - x, step);
	*left = q[0];
	ct_f32_store_n(r->after + i, q[1], m);
	ct_f32_store_n(r->below + i, q[2], m);
	ct_f32_store_n(r->out + i, x + step, m);
	if (r->step)
		ct_f32_store_n(r->step + i, step, m);
}

void CT_SIMD_HERE(ct_tv_row_sweep)(const struct ct_tv_row *row, size_t n)
{
	const struct ct_tv_row r = *row; /* so that no store can change it */
	ct_f32 left = ct_f32_set(0);
	size_t i = 0;

	for (; i + CT_F32_LANES < n; i += CT_F32_LANES)
		move(&r, i, CT_F32_LANES, &left, false);
	move(&r, i, n - i, &left, true);
}

enum { LANES = 16 }; /* partial sums, in a fixed order */

double CT_SIMD_HERE(ct_tv_row_mend)(float *restrict x, const float *restrict before,
	const float *restrict below, float t, size_t n)
{
	double part[LANES] = {0}, sum = 0;

	for (size_t i = 0; i < n; i++)
		x[i] -= t * below[i];
	for (size_t i = 0; before && i < n; i += LANES)
		for (size_t l = 0; l < (n - i < LANES ? n - i : LANES); l++) {
			const double step = (double)x[i + l] - (double)before[i + l];

			part[l] += step * step;
		}
	for (size_t l = 0; l < LANES; l++)
		sum += part[l];
	return sum;
}
