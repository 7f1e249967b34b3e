/* layers.h: the layers of the U-Net other than convolutions, normalisation and attention, each
 * forward beside its backward. Kernels (core/simd.h).
 *
 * Pure functions on one image in [hw][c] order (channels last), any c, float storage, sums in a
 * fixed order. In a backward, dx is written, or added to if `acc`; gradients of parameters are
 * always added to. No pointer may overlap another. Thread-safe.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_NN_LAYERS_H
#define CT_NN_LAYERS_H
#include "core/simd.h"

#include <stdbool.h>
#include <stddef.h>

/* y = x sigmoid(x). */
CT_SIMD_DECLARE(void, ct_layer_silu_forward, (size_t n, float *y, const float *x));
CT_SIMD_DECLARE(
	void, ct_layer_silu_back, (size_t n, float *dx, const float *dy, const float *x, bool acc));

/* y[co] = w[co][ci] x[ci] + b[co]. */
CT_SIMD_DECLARE(void, ct_layer_linear_forward,
	(size_t ci, size_t co, float *y, const float *x, const float *w, const float *b));
CT_SIMD_DECLARE(void, ct_layer_linear_back,
	(size_t ci, size_t co, float *dx, float *dw, float *db, const float *dy, const float *x,
		const float *w, bool acc));

/* Nearest neighbour: y[2h][2w][c] from x[h][w][c]. */
CT_SIMD_DECLARE(
	void, ct_layer_up_forward, (size_t h, size_t w, size_t c, float *y, const float *x));
CT_SIMD_DECLARE(void, ct_layer_up_back,
	(size_t h, size_t w, size_t c, float *dx, const float *dy, bool acc));
/* Mean of 2 x 2: y[h/2][w/2][c] from x[h][w][c], h and w even. */
CT_SIMD_DECLARE(
	void, ct_layer_down_forward, (size_t h, size_t w, size_t c, float *y, const float *x));
CT_SIMD_DECLARE(void, ct_layer_down_back,
	(size_t h, size_t w, size_t c, float *dx, const float *dy, bool acc));

/* y[hw][ca + cb] = a[hw][ca] beside b[hw][cb]. */
CT_SIMD_DECLARE(void, ct_layer_concat_forward,
	(size_t hw, size_t ca, size_t cb, float *y, const float *a, const float *b));
/* dx[hw][cx] from channels [first, first + cx) of dy[hw][c]. */
CT_SIMD_DECLARE(void, ct_layer_concat_back,
	(size_t hw, size_t c, size_t first, size_t cx, float *dx, const float *dy, bool acc));

/* y (+)= x. */
CT_SIMD_DECLARE(void, ct_layer_take, (size_t n, float *y, const float *x, bool acc));

/* [h][w][c] from [c][h][w], and back. */
CT_SIMD_DECLARE(void, ct_layer_to_last, (size_t hw, size_t c, float *y, const float *x));
CT_SIMD_DECLARE(void, ct_layer_to_first, (size_t hw, size_t c, float *y, const float *x));

/* Rows of n floats in place: exp(x) / sum exp(x). */
CT_SIMD_DECLARE(void, ct_layer_softmax, (size_t rows, size_t n, float *w));
/* dw = w (dw - sum w dw). */
CT_SIMD_DECLARE(void, ct_layer_softmax_back, (size_t rows, size_t n, float *dw, const float *w));

/* Sinusoids of a timestep: emb[i] = cos(t f_i), emb[half + i] = sin(t f_i), f_i =
 * 10000^(-i/half), half = dim/2; an odd dim ends in 0. */
CT_SIMD_DECLARE(void, ct_layer_embed, (size_t dim, float *emb, double t));

#endif
