/* svd.h: singular value decomposition of an operator along one axis, and its pseudo-inverse.
 *
 * A table A (separable.h) of m rows and n columns is written
 *
 *   A = U^T diag(g) V      U (m,m) orthogonal, V (m,n) orthonormal rows, g >= 0
 *   A+ = V^T diag(1/g) U
 *
 * Operators of degrade.h reflect at the borders and repeat from cell to cell, so that for whole
 * factors A A^T is diagonal in the m-point DCT-II, row k of U being its k-th cosine; what is left
 * off the diagonal (fractional factors, other tables) is rotated away by Jacobi's method. Rows of
 * U and V then belong to ascending frequencies, not to falling g. The identity keeps U = V = 1.
 *
 * Frequencies that A weakens by more than CT_SVD_LIMIT against the strongest count as not
 * measured: g = 0 there and in A+, and the row of V is zero. So A+ amplifies no noise more than
 * that, A+ A A+ = A+ always, and A A+ A = A if none is lost.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_OPERATOR_SVD_H
#define CT_OPERATOR_SVD_H
#include "operator/separable.h"

#define CT_SVD_LIMIT 100.0

struct ct_svd {
	size_t m, n;
	double *u, *g, *v; /* (m,m), (m), (m,n); owned, one block at u */
	double condition;  /* largest / smallest g of those that are kept */
	size_t lost;       /* how many are not */
};

/* Factor *a, not all zero. Allocates *f, which must be zero. Costs m^2 n flops. CT_EINPUT,
 * CT_ENOMEM. */
int ct_svd_alloc(struct ct_svd *f, const struct ct_taps *a, struct ct_err *e);
/* That of the operator that all cosines make diagonal, without factoring anything: a line of n
 * samples, mirrored at its edges, blurred with a Gaussian of `sigma` of them, cut at the Nyquist
 * frequency of m cells and sampled at their centres. But for the factor 1/sqrt(n/m):
 *
 *   g[k] = sum_d G[d] cos(pi k d / n), G the Gaussian at whole samples, cut at 4 sigma, of sum 1
 *
 * n/m need not be whole. *f must be zero. CT_EINPUT, CT_ENOMEM. */
int ct_svd_cosines(struct ct_svd *f, size_t m, size_t n, double sigma, struct ct_err *e);
/* Also legal on a zeroed struct; leaves it zeroed. */
void ct_svd_free(struct ct_svd *f);
/* The table of A+, n rows of m, or of the fewer that are not zero. Allocates. */
int ct_svd_pinv(struct ct_taps *t, const struct ct_svd *f, struct ct_err *e);

#endif
