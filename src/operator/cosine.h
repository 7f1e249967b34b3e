/* cosine.h: products with a basis of even and odd functions, at a third of the cost of a dense
 * product, and with cosines at an eighth.
 *
 * The rows of V (m,n), n samples long, are alternately symmetric and antisymmetric about the
 * middle, as cosines are: V[k][n-1-j] = (-1)^k V[k][j]. So V x needs only the sums and the
 * differences of the two halves of x: x is folded. If the even functions are again even and odd
 * about a quarter, as cosines are too, the sums are folded once more, and so on.
 *
 * A folded column of x has its sums of sums first, and last the differences of its first fold: that
 * of rows j and s-1-j of the s folded stands in row s-1-j. Coefficients are kept in the same order:
 * first the functions that are even at every fold, last the odd ones. Float; thread-safe.
 *
 * If the functions are a_k cos(pi k (j + 1/2)/n), the differences d_j too make a cosine transform
 * of half the length (Lee, IEEE Trans. ASSP 32, 1984): with 2 cos(u) cos(2 k u) = cos((2k+1) u) +
 * cos((2k-1) u),
 *   C_k = sum_j d_j 2 cos(pi (j + 1/2)/n) cos(pi k (j + 1/2)/(n/2)) = X_{2k+1} + X_{2k-1},
 * so X_1 = C_0/2 and X_{2k+1} = C_k - X_{2k-1}. `levels` such steps leave 2^levels transforms with
 * one basis of n/2^levels samples, the leaf, which is folded as above.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_OPERATOR_COSINE_H
#define CT_OPERATOR_COSINE_H
#include "core/err.h"
#include "core/simd.h"

#include <stdbool.h>
#include <stddef.h>

enum { CT_COSINE_PARTS = 4, CT_COSINE_STRIP = 32 };

struct ct_cosine {
	size_t n, m, levels;
	float *twist;                  /* 2 cos(pi (j + 1/2)/s), j < s/2, for s = n, n/2, ... */
	size_t *order;                 /* places of 0, 1, ... in a half of each level */
	size_t parts;                  /* of the leaf: one more than there are folds */
	size_t rows[CT_COSINE_PARTS];  /* of a folded column, and */
	size_t count[CT_COSINE_PARTS]; /* functions of each part, the even one first */
	float *v[CT_COSINE_PARTS];     /* (count, rows) of each part */
	float *vt[CT_COSINE_PARTS];    /* (rows, count); all one block at v[0] */
};

/* cos(pi k (j + 1/2) / n), the phase reduced exactly. */
double ct_cosine_at(size_t k, size_t j, size_t n);
/* The first m rows of the orthonormal DCT-II of n points: v (m,n). */
void ct_cosine_rows(double *v, size_t m, size_t n);
/* From v (m,n). Allocates *b, which must be zero. CT_ENOMEM, CT_EINPUT for absurd sizes. */
int ct_cosine_alloc(struct ct_cosine *b, const double *v, size_t m, size_t n, struct ct_err *e);
/* Also legal on a zeroed struct; leaves it zeroed. */
void ct_cosine_free(struct ct_cosine *b);
/* Place of coefficient k among the m. */
size_t ct_cosine_place(const struct ct_cosine *b, size_t k);
/* Floats of scratch of the products. */
size_t ct_cosine_scratch(const struct ct_cosine *b);

/* c (m,w; ldc) = V x (n,w; ldx); x is (w,n; ldx) if `turned`. */
CT_SIMD_DECLARE(void, ct_cosine_analyse,
	(const struct ct_cosine *b, float *c, size_t ldc, const float *x, size_t ldx, size_t w,
		bool turned, float *scratch));
/* out (n,w; ldo) = add (n,w; ldo; NULL is 0) + V^T c (m,w; ldc); out may be add. If `turned` out
 * (w,n; ldo) = V^T c. */
CT_SIMD_DECLARE(void, ct_cosine_synthesise,
	(const struct ct_cosine *b, float *out, size_t ldo, const float *add, const float *c,
		size_t ldc, size_t w, bool turned, float *scratch));

#endif
