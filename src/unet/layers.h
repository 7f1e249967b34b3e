/* layers.h: the layers of the U-Net other than convolutions, each forward beside its backward.
 *
 * Pure functions on one image in [hw][c] order (channels last), float storage, sums in double and
 * in a fixed order. c is a multiple of 32 for the normalisation; any c elsewhere. In a backward,
 * dx is written, or added to if `acc`; gradients of parameters are always added to. No pointer
 * may overlap another unless said. Thread-safe.
 */
#ifndef CT_UNET_LAYERS_H
#define CT_UNET_LAYERS_H
#include <stdbool.h>
#include <stddef.h>

enum { CT_NORM_GROUPS = 32 };

/* Group normalisation (Wu and He 2018) of x + shift into 32 groups, eps 1e-5, biased variance, then
 * a per-channel affine map and, for a residual block of guided diffusion (Dhariwal and Nichol
 * 2021), the map of the time embedding e and SiLU:
 *
 *   xhat = (x + o_c - mean_g) / sqrt(var_g + eps)
 *   z    = (gamma_c xhat + beta_c)(1 + s_c) + t_c       y = z sigmoid(z)  or  z
 *
 * (s, t) are the halves of e if scale_shift (o = 0), else o = e; without e all are 0. */
struct ct_norm {
	size_t hw, c;
	const float *gamma, *beta; /* [c] */
	const float *e;            /* [2c] if scale_shift, [c] if not, or NULL */
	bool scale_shift, silu;
};

/* sums[2c] = per-channel sum of x and of x^2. */
void ct_norm_sums(size_t hw, size_t c, double *sums, const float *x);
/* y[hw][c] from x and its sums; ab[2c] is scratch. y may be x. */
void ct_norm_forward(
	const struct ct_norm *n, float *y, const float *x, const double *sums, float *ab);
/* Floats of scratch that the backward needs. */
size_t ct_norm_scratch(const struct ct_norm *n);
/* dx[hw][c]; dgamma, dbeta [c] added to; de as e, added to (or NULL). dy is overwritten. */
void ct_norm_back(const struct ct_norm *n, float *dx, float *dgamma, float *dbeta, float *de,
	float *dy, const float *x, const double *sums, bool acc, float *scratch);

/* y = x sigmoid(x). */
void ct_silu_forward(size_t n, float *y, const float *x);
void ct_silu_back(size_t n, float *dx, const float *dy, const float *x, bool acc);

/* y[co] = w[co][ci] x[ci] + b[co]. */
void ct_linear_forward(
	size_t ci, size_t co, float *y, const float *x, const float *w, const float *b);
void ct_linear_back(size_t ci, size_t co, float *dx, float *dw, float *db, const float *dy,
	const float *x, const float *w, bool acc);

/* Nearest neighbour: y[2h][2w][c] from x[h][w][c]. */
void ct_up_forward(size_t h, size_t w, size_t c, float *y, const float *x);
void ct_up_back(size_t h, size_t w, size_t c, float *dx, const float *dy, bool acc);
/* Mean of 2 x 2: y[h/2][w/2][c] from x[h][w][c], h and w even. */
void ct_down_forward(size_t h, size_t w, size_t c, float *y, const float *x);
void ct_down_back(size_t h, size_t w, size_t c, float *dx, const float *dy, bool acc);

/* y[hw][ca + cb] = a[hw][ca] beside b[hw][cb]. */
void ct_concat_forward(size_t hw, size_t ca, size_t cb, float *y, const float *a, const float *b);
/* dx[hw][cx] from channels [first, first + cx) of dy[hw][c]. */
void ct_concat_back(
	size_t hw, size_t c, size_t first, size_t cx, float *dx, const float *dy, bool acc);

/* y (+)= x. */
void ct_take(size_t n, float *y, const float *x, bool acc);

/* Sinusoids of a timestep: emb[i] = cos(t f_i), emb[half + i] = sin(t f_i), f_i =
 * 10000^(-i/half), half = dim/2; an odd dim ends in 0. */
void ct_embed(size_t dim, float *emb, double t);

/* [h][w][c] from [c][h][w], and back. */
void ct_to_last(size_t hw, size_t c, float *y, const float *x);
void ct_to_first(size_t hw, size_t c, float *y, const float *x);

#endif
