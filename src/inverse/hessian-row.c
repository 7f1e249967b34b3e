/* hessian-row.c: see hessian-row.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "inverse/hessian-row.h"
#include "core/vec-i16.h"
#include "inverse/tv-row.h"

#include <stdbool.h>

enum { II, JJ, KK, IJ, IK, JK, PARTS = CT_HESSIAN_PARTS };

/* Voxels [i, i + m), m <= CT_F32_LANES; before them stands `left`. */
CT_INLINE void ascend(const struct ct_hessian_ascent *r, size_t i, size_t m, ct_f32 *left, float s,
	bool begin, const bool end)
{
	const ct_f32 zero = ct_f32_set(0), one = ct_f32_set(CT_TV_ONE);
	const float *at = r->x + i;
	const ct_f32 x = ct_f32_load_n(at, m);
	const ct_f32 j1 = ct_f32_load_n(at + r->j1, m), k1 = ct_f32_load_n(at + r->k1, m);
	const size_t more = end ? m - 1 : m; /* that have a voxel after them */
	const ct_f32 next = ct_f32_load_n(at + 1, more), ahead = next - x;
	const float *w = r->weight;
	ct_f32 h[PARTS], q[PARTS], norm = zero;

	h[II] = w[II] * (ct_f32_slide(*left, x) + next - 2.0f * x);
	h[JJ] = w[JJ] * (ct_f32_load_n(at + r->j0, m) + j1 - 2.0f * x);
	h[KK] = w[KK] * (ct_f32_load_n(at + r->k0, m) + k1 - 2.0f * x);
	h[IJ] = w[IJ] * ((ct_f32_load_n(at + r->j1 + 1, more) - j1) - ahead);
	h[IK] = w[IK] * ((ct_f32_load_n(at + r->k1 + 1, more) - k1) - ahead);
	h[JK] = w[JK] * (ct_f32_load_n(at + r->j1 + r->k1, m) - j1 - k1 + x);
	if (begin)
		h[II] = ct_f32_pick(ct_i32_first(1), zero, h[II]);
	if (end) {
		const ct_i32 inside = ct_i32_first(m - 1);

		h[II] = ct_f32_pick(inside, h[II], zero);
		h[IJ] = ct_f32_pick(inside, h[IJ], zero);
		h[IK] = ct_f32_pick(inside, h[IK], zero);
	}
#pragma GCC unroll 6
	for (int c = 0; c < PARTS; c++) {
		q[c] = ct_f32_fma(ct_f32_set(s), h[c], ct_f32_load_i16(r->q[c] + i, m));
		norm = ct_f32_fma(q[c], q[c], norm);
	}
	norm = one / ct_f32_sqrt(ct_f32_max(norm, one * one));
#pragma GCC unroll 6
	for (int c = 0; c < PARTS; c++)
		ct_i32_store_i16(r->q[c] + i, ct_i32_round(q[c] * norm), m);
	*left = x;
}

void CT_SIMD_HERE(ct_hessian_row_ascend)(const struct ct_hessian_ascent *row, size_t n, float s)
{
	const struct ct_hessian_ascent r = *row; /* so that no store can change it */
	ct_f32 left = ct_f32_set(0);
	size_t i = 0;

	for (; i + CT_F32_LANES < n; i += CT_F32_LANES)
		ascend(&r, i, CT_F32_LANES, &left, s, i == 0, false);
	ascend(&r, i, n - i, &left, s, i == 0, true);
}

/* Components ii, ij and ik of the voxels before. */
struct before {
	ct_f32 ii, ij, ik;
};

CT_INLINE void descend(const struct ct_hessian_descent *r, size_t i, size_t m, struct before *b,
	float t, const bool end)
{
#define AT(row) ct_i32_load_i16((row) + i, m)
	const ct_f32 x = ct_f32_load_n(r->x + i, m), ii = ct_f32_from(AT(r->ii));
	const ct_f32 ij = ct_f32_from(AT(r->ij[1]) - AT(r->ij[0]));
	const ct_f32 ik = ct_f32_from(AT(r->ik[1]) - AT(r->ik[0]));
	const float *w = r->weight;
	ct_f32 g =
		w[JJ] * ct_f32_from(AT(r->jj[0]) + AT(r->jj[2]) - 2 * AT(r->jj[1])) +
		w[KK] * ct_f32_from(AT(r->kk[0]) + AT(r->kk[2]) - 2 * AT(r->kk[1])) +
		w[JK] * ct_f32_from((AT(r->jk[3]) - AT(r->jk[1])) - (AT(r->jk[2]) - AT(r->jk[0])));
	ct_f32 out;

	g += w[IJ] * ij + w[IK] * ik - 2.0f * w[II] * ii;
	out = x - t * g;
	out -= t * (w[II] * ct_f32_slide(b->ii, ii) - w[IJ] * ct_f32_slide(b->ij, ij) -
			   w[IK] * ct_f32_slide(b->ik, ik));
	out -= t * w[II] * ct_f32_load_i16(r->ii + i + 1, end ? m - 1 : m);
	ct_f32_store_n(r->out + i, out, m);
	if (r->step)
		ct_f32_store_n(r->step + i, out - x, m);
	*b = (struct before){ii, ij, ik};
#undef AT
}

void CT_SIMD_HERE(ct_hessian_row_descend)(const struct ct_hessian_descent *row, size_t n, float t)
{
	const struct ct_hessian_descent r = *row;
	struct before b = {ct_f32_set(0), ct_f32_set(0), ct_f32_set(0)};
	size_t i = 0;

	for (; i + CT_F32_LANES < n; i += CT_F32_LANES)
		descend(&r, i, CT_F32_LANES, &b, t, false);
	descend(&r, i, n - i, &b, t, true);
}

void CT_SIMD_HERE(ct_hessian_row_ahead)(size_t n, float *x, float *next)
{
	CT_SIMD_APART
	for (size_t i = 0; i < n; i++) {
		const float now = next[i];

		next[i] = 2.0f * now - x[i];
		x[i] = now;
	}
}
