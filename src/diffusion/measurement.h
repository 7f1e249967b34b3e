/* measurement.h: a measurement operator A, fine picture x (high, wide) -> coarse picture y (h, w),
 * given by its singular value decomposition A = U^T S V: what a diffusion sampler needs of A.
 *
 *   CT_MEASUREMENT_MEAN     s-by-s block mean: U = I, S = 1/s, V = the blocks of constant 1/s; A+
 *                           replicates, A A+ = I, A^T = A+ / s^2
 *   CT_MEASUREMENT_MATCHED  Gaussian and sinc decimation of both axes: S[i,j] = g_i g_j / s
 *
 * A line of N pixels of the latter, mirrored at its edges (half-sample symmetry), is blurred with a
 * Gaussian of `sigma` fine pixels, cut at the Nyquist frequency of the coarse grid, and sampled at
 * the centres of the n coarse pixels, N = s n; s need not be whole. All three are diagonal in the
 * cosine bases of the two grids, which are cell-centred as our grids are:
 *
 *   A = U^T diag(g / sqrt(s)) V,   A+ = V^T diag(sqrt(s) / g) U
 *   U[k][j] = sqrt(c_k / n) cos(pi k (j + 1/2) / n)     (n, n) orthogonal; c_0 = 1, else 2
 *   V[k][i] = sqrt(c_k / N) cos(pi k (i + 1/2) / N)     (n, N) orthonormal rows
 *   g[k]    of ct_svd_cosines: for sigma of a pixel or more exp(-2 pi^2 sigma^2 f^2) within 1e-3,
 *           f = k / (2 N) cycles a fine pixel
 *
 * Frequencies that the blur weakens by more than CT_SVD_LIMIT count as not measured: g = 0 in A and
 * in A+, so A A+ A = A always holds. For sigma up to 0.9 s none is lost (A A+ = I). It is the axis
 * operator of degrade.h with its sinc decimation.
 *
 * Functions do not change the operator and are thread-safe; t is scratch of
 * ct_measurement_scratch() values. Sums are in double and in a fixed order.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_DIFFUSION_MEASUREMENT_H
#define CT_DIFFUSION_MEASUREMENT_H
#include "core/err.h"
#include "core/words.h"
#include "operator/svd.h"

#include <stddef.h>

#define CT_MEASUREMENT_LIST(X)                                                                     \
	X(CT_MEASUREMENT_MEAN, "mean")                                                             \
	X(CT_MEASUREMENT_MATCHED, "matched")
enum ct_measurement_kind { CT_MEASUREMENT_LIST(CT_WORD_VALUE) };

/* What a coarse pixel is of the fine ones under it: a ray through its centre, which is no function
 * of them, their mean, or they cut at its Nyquist frequency. */
#define CT_PIXEL_LIST(X)                                                                           \
	X(CT_PIXEL_POINT, "point")                                                                 \
	X(CT_PIXEL_MEAN, "mean")                                                                   \
	X(CT_PIXEL_SINC, "sinc")
enum ct_pixel { CT_PIXEL_LIST(CT_WORD_VALUE) };

/* The operator that makes such pixels; of a ray the mean, which is taken for it. */
static inline enum ct_measurement_kind ct_pixel_measures(enum ct_pixel pixel)
{
	return pixel == CT_PIXEL_SINC ? CT_MEASUREMENT_MATCHED : CT_MEASUREMENT_MEAN;
}

enum { CT_AXIS_MAX = 1024 }; /* largest n: the bases are stored */

struct ct_measurement {
	enum ct_measurement_kind kind;
	size_t h, w, s, high, wide;
	struct ct_svd rows, cols; /* matched only */
};

/* sigma: Gaussian of the matched kind, fine pixels in [0, 1e4], else CT_EUSAGE. CT_EGEOM if a
 * matched h or w is above CT_AXIS_MAX. *op zero. */
int ct_measurement_alloc(struct ct_measurement *op, enum ct_measurement_kind kind, size_t h,
	size_t w, size_t s, double sigma, struct ct_err *e);
void ct_measurement_free(struct ct_measurement *op);
size_t ct_measurement_scratch(const struct ct_measurement *op);
/* Mean of s x s pixels from x on, in rows of `wide`. */
double ct_measurement_mean(const float *x, size_t wide, size_t s);
/* Singular value of coefficient k of h w; 0 where nothing is measured. */
double ct_measurement_singular(const struct ct_measurement *op, size_t k);
/* c = V x, c (h, w) */
void ct_measurement_analyse(const struct ct_measurement *op, double *restrict c,
	const float *restrict x, double *restrict t);
/* x <- x + V^T c */
void ct_measurement_synth_add(const struct ct_measurement *op, float *restrict x,
	const double *restrict c, double *restrict t);
/* c = S+ U y: the coefficients of A+ y */
void ct_measurement_data(const struct ct_measurement *op, double *restrict c,
	const float *restrict y, double *restrict t);
/* y = A x */
void ct_measurement_forward(const struct ct_measurement *op, float *restrict y,
	const float *restrict x, double *restrict t);
/* x = A^T y */
void ct_measurement_adjoint(const struct ct_measurement *op, float *restrict x,
	const float *restrict y, double *restrict t);
/* x <- x + by A+ (y - A x0), cy[h w] the coefficients of A+ y; x may be x0. With by = 1 and x = x0
 * it is the range-null step of DDNM (Wang, Yu, Zhang, ICLR 2023), A+ y + (I - A+ A) x0: the range
 * of A+ from the data, the null space of A from the picture. c[h w] is scratch too. */
void ct_measurement_pull(const struct ct_measurement *op, double by, float *x, const float *x0,
	const double *cy, double *c, double *t);

/* x[s h][s w] from y[h][w], linear along both axes between the centres of pixels that are cells (s
 * x s fine ones in a coarse one), constant beyond the outermost. */
void ct_measurement_bilinear(
	size_t h, size_t w, size_t s, float *restrict x, const float *restrict y);

#endif
