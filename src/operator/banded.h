/* banded.h: a table along one axis (separable.h) and its transpose, in float, for planes that are
 * in the cache: a few weights a row, whatever the length of the axis.
 *
 * D (m,n) makes m samples of n. D D^T has few numbers a row as well: it is solved by elimination.
 * Kernels allocate nothing.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_OPERATOR_BANDED_H
#define CT_OPERATOR_BANDED_H
#include "core/simd.h"
#include "operator/separable.h"

struct ct_banded {
	struct ct_banded_rows {
		size_t n, taps; /* rows, and weights of each, which apply from first[] on */
		size_t *first;
		float *w; /* (n,taps) */
	} down, up;       /* D, D^T */
	/* D D^T = L diag(d) L^T, L of ones and `half` numbers below them */
	size_t half;
	float *lower, *upper; /* (m,half): -L[i][i - half + q], -L[i + 1 + q][i], 0 outside */
	float *inverse;       /* (m): 1/d */
	bool plain;           /* it is inverse[0] of the identity */
};

/* From the table of D, whose rows are independent. Allocates *b, which must be zero. CT_ENOMEM. */
int ct_banded_alloc(struct ct_banded *b, const struct ct_taps *d, struct ct_err *e);
/* Also legal on a zeroed struct; leaves it zeroed. */
void ct_banded_free(struct ct_banded *b);
/* Floats of scratch of the kernels that turn. */
size_t ct_banded_scratch(const struct ct_banded *b);

/* out (t->n,w; ldo) = add (alike; NULL is 0) + t in (.,w; ldi); out may be add, but not in. */
CT_SIMD_DECLARE(void, ct_banded_across,
	(const struct ct_banded_rows *t, float *out, size_t ldo, const float *add, const float *in,
		size_t ldi, size_t w));
/* out (m,w; ldo) = D in, whose w rows (ldi) of n samples are the columns. */
CT_SIMD_DECLARE(void, ct_banded_down,
	(const struct ct_banded *b, float *out, size_t ldo, const float *in, size_t ldi, size_t w,
		float *scratch));
/* out, w rows (ldo) of n samples, = D^T in (m,w; ldi), turned. */
CT_SIMD_DECLARE(void, ct_banded_up,
	(const struct ct_banded *b, float *out, size_t ldo, const float *in, size_t ldi, size_t w,
		float *scratch));
/* x (m,w; ld) <- (D D^T)^-1 x; turned: along the rows of x (w,m; ld). */
CT_SIMD_DECLARE(void, ct_banded_solve, (const struct ct_banded *b, float *x, size_t ld, size_t w));
CT_SIMD_DECLARE(void, ct_banded_solve_turned,
	(const struct ct_banded *b, float *x, size_t ld, size_t w, float *scratch));
/* out (n) = sum of w[p] part[p] (n), p < parts, of which there is one at least; out may be one of
 * them. */
CT_SIMD_DECLARE(void, ct_banded_blend,
	(float *out, size_t parts, const float *const *part, const float *w, size_t n));

#endif
