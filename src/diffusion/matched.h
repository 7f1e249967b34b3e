/* matched.h: Gaussian blur and centred sinc decimation of one axis, with its pseudo-inverse,
 * through the singular value decomposition that this operator has in closed form.
 *
 * A line of N pixels, mirrored at its edges (half-sample symmetry), is blurred with a
 * Gaussian of `sigma` fine pixels, cut at the Nyquist frequency of the coarse grid, and sampled at
 * the centres of the n coarse pixels, N = s n; s need not be whole. All three are diagonal in the
 * cosine bases of the two grids, which are cell-centred as our grids are:
 *
 *   A = U^T diag(g / sqrt(s)) V,   A+ = V^T diag(sqrt(s) / g) U
 *   U[k][j] = sqrt(c_k / n) cos(pi k (j + 1/2) / n)     (n, n) orthogonal; c_0 = 1, else 2
 *   V[k][i] = sqrt(c_k / N) cos(pi k (i + 1/2) / N)     (n, N) orthonormal rows
 *   g[k]    = sum_d G[d] cos(pi k d / N), G the Gaussian sampled at whole pixels, cut at 4 sigma
 *             and normalised: for sigma of a pixel or more exp(-2 pi^2 sigma^2 f^2) within 1e-3,
 *             f = k / (2 N) cycles a fine pixel
 *
 * Frequencies that the blur weakens by more than CT_MATCHED_LIMIT count as not measured: g = 0 in
 * A and in A+, so A A+ A = A always holds. For sigma up to 0.9 s none is lost (A A+ = I).
 * It is the axis operator of degrade.h with its sinc decimation.
 * A picture takes one axis for its rows and one for its columns.
 */
#ifndef CT_DIFFUSION_MATCHED_H
#define CT_DIFFUSION_MATCHED_H
#include "core/err.h"

#include <stddef.h>

#define CT_MATCHED_LIMIT 100.0
enum { CT_MATCHED_MAX = 1024 }; /* largest n: the bases are stored */

struct ct_axis {
	size_t n, fine;    /* coarse and fine pixels, n <= fine */
	double *u, *v, *g; /* (n, n), (n, fine), (n); owned, one block at u */
};

/* sigma in [0, 1e4], else CT_EUSAGE. CT_EGEOM if n > CT_MATCHED_MAX. *a must be zero. */
int ct_axis_alloc(struct ct_axis *a, size_t n, size_t fine, double sigma, struct ct_err *e);
void ct_axis_free(struct ct_axis *a);

/* For pictures x (rows->fine, cols->fine), y (h, w), coefficients c (h, w), h = rows->n, w =
 * cols->n; t is scratch of h cols->fine values. Pure, thread-safe. */
/* c = V_rows x V_cols^T */
void ct_matched_analyse(const struct ct_axis *rows, const struct ct_axis *cols, double *restrict c,
	const float *restrict x, double *restrict t);
/* x <- x + V_rows^T c V_cols, the adjoint of analysis, added */
void ct_matched_synth_add(const struct ct_axis *rows, const struct ct_axis *cols, float *restrict x,
	const double *restrict c, double *restrict t);
/* c = U_rows y U_cols^T */
void ct_matched_data(const struct ct_axis *rows, const struct ct_axis *cols, double *restrict c,
	const float *restrict y, double *restrict t);
/* y = U_rows^T c U_cols, the inverse of ct_matched_data */
void ct_matched_undata(const struct ct_axis *rows, const struct ct_axis *cols, float *restrict y,
	const double *restrict c, double *restrict t);

#endif
