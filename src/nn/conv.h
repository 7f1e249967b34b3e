/* conv.h: convolutions by oneDNN, forward and backward.
 *
 * Activations are [h][w][c] (channels last) float, one image a call; weights and their gradients
 * are plain [co][ci][k][k], cross-correlation, zero padding k/2
 * unless said. Of a volume they are [d][h][w][c]
 * and [co][ci][k][k][k]; along d there is no padding: the caller has k/2 planes more at each end,
 * zero or of the neighbours, and the result has k - 1 planes fewer. For threads see dnn.h.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_NN_CONV_H
#define CT_NN_CONV_H
#include "nn/dnn.h"

struct ct_conv;

struct ct_conv_shape {
	size_t h, w; /* of the input; the output is ceil(h/stride) x ceil(w/stride) */
	size_t ci, co;
	size_t k;      /* 1 or 3 */
	size_t stride; /* 1 or 2; of a volume 1 */
	bool add;      /* another image is added to the output */
	bool inside;   /* of an image: no padding, the output is (h - k) / stride + 1 ... */
	size_t d;      /* planes of the input of a volume, k at least; 0: an image */
};

/* `weight`, called `key` in *d, is borrowed for the life of *d if ct_dnn_refresh is to
 * be called, and else for the call; NULL stands for that of an earlier call. With `train`, the
 * backward directions too. CT_EFAIL with oneDNN's word for it. */
int ct_conv_alloc(struct ct_conv **out, struct ct_dnn *d, const struct ct_conv_shape *s, size_t key,
	const float *weight, bool train, struct ct_err *e);
void ct_conv_free(struct ct_conv *c);
/* Bytes of scratch, 64-byte aligned, that the calls below need. */
size_t ct_conv_scratch(const struct ct_conv *c);
/* y[ho][wo][co] = w * x[h][w][ci] + bias[co] (+ add[ho][wo][co] if the shape says so). */
int ct_conv_forward(struct ct_conv *c, float *y, const float *x, const float *bias,
	const float *add, void *scratch, struct ct_err *e);
/* dx = w^T dy. */
int ct_conv_back_data(
	struct ct_conv *c, float *dx, const float *dy, void *scratch, struct ct_err *e);
/* dw[co][ci][k][k] += dy x^T, db[co] += sum dy. */
int ct_conv_back_weights(struct ct_conv *c, float *dw, float *db, const float *x, const float *dy,
	void *scratch, struct ct_err *e);

#endif
