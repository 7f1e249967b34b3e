/* hessian-row.h: one row of an iteration of second-order variation (hessian-tv.c). Pure kernels
 * (core/simd.h).
 *
 * The components are the second differences along i, j and k, and the mixed ones of i and j, i and
 * k, j and k, in this order, times a weight each. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_INVERSE_HESSIAN_ROW_H
#define CT_INVERSE_HESSIAN_ROW_H
#include "core/simd.h"

#include <stddef.h>
#include <stdint.h>

enum { CT_HESSIAN_PARTS = 6 };

/* The row x of a volume, and how far from it are those before and after it along j and k: 0 where
 * there is none. The weight of a component that does not exist in the row is 0. No row of q
 * overlaps another. */
struct ct_hessian_ascent {
	int16_t *q[CT_HESSIAN_PARTS]; /* the dual */
	const float *x;
	ptrdiff_t j0, j1, k0, k1;
	float weight[CT_HESSIAN_PARTS];
};

/* q <- project onto |q|_F <= CT_TV_ONE of q + s H x, in whole numbers. */
CT_SIMD_DECLARE(
	void, ct_hessian_row_ascend, (const struct ct_hessian_ascent *r, size_t n, float s));

/* Rows of the dual, zeros where there is none: of each component this one, before and after it. */
struct ct_hessian_descent {
	float *out, *step; /* x' and x' - x, or NULL */
	const float *x;
	const int16_t *ii, *jj[3], *kk[3]; /* before, this, after */
	const int16_t *ij[2], *ik[2];      /* before, this */
	const int16_t *jk[4];              /* this, before along j, along k, along both */
	float weight[CT_HESSIAN_PARTS];
};

/* out = x - t H^T q. */
CT_SIMD_DECLARE(
	void, ct_hessian_row_descend, (const struct ct_hessian_descent *r, size_t n, float t));

/* x <- next, and next <- 2 next - x, which do not overlap. */
CT_SIMD_DECLARE(void, ct_hessian_row_ahead, (size_t n, float *x, float *next));

#endif
