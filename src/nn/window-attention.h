/* window-attention.h: attention within groups of pixels, of pixels or of channels.
 *
 * qkv[h][w][3c] holds queries, keys and values of c = heads * width channels, head by head. The
 * picture is cut into groups of pixels, each on its own: size x size neighbours, or if `spread`
 * pixels that reach over the picture.
 *
 * Pixels (MaxViT, Tu et al., ECCV 2022); spread: size x size pixels, h/size and w/size apart. With
 * n = size^2 pixels of a group
 *   W[s][t] = softmax_t(q_s . k_t / sqrt(width) + param[place(s, t)][head]),  out_s = sum_t W v_t
 * place: (row of s - row of t + size - 1)(2 size - 1) + the same of columns.
 *
 * Channels (Restormer, Zamir et al., CVPR 2022); spread: all pixels that are `size` apart. With the
 * width channels of a head, each a vector of the n pixels of the group, q and k scaled to length 1
 *   W[i][j] = softmax_j(param[head] q_i . k_j),  out_i = sum_j W v_j
 *
 * One picture a call, float; dqkv is written; dparam is added to, or NULL. CT_EFAIL of the matrix
 * products. Thread-safe, between ct_dnn_enter and ct_dnn_leave.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_NN_WINDOW_ATTENTION_H
#define CT_NN_WINDOW_ATTENTION_H
#include "core/err.h"

#include <stdbool.h>
#include <stddef.h>

struct ct_window {
	bool channels, spread;
	size_t h, w, size; /* size divides both */
	size_t heads, width;
};

/* Floats of scratch. */
size_t ct_window_scratch(const struct ct_window *a);
int ct_window_forward(const struct ct_window *a, float *out, const float *qkv, const float *param,
	float *scratch, struct ct_err *e);
int ct_window_back(const struct ct_window *a, float *dqkv, float *dparam, const float *dout,
	const float *qkv, const float *param, float *scratch, struct ct_err *e);

#endif
