/* window.h: attention within groups of pixels, of pixels or of channels.
 *
 * qkv[h][w][3c] holds queries, keys and values of c = heads * width channels, head by head. The
 * picture is cut into groups of pixels, each on its own:
 *
 *   CT_WINDOW_BLOCK  size x size neighbours
 *   CT_WINDOW_GRID   size x size pixels, h/size and w/size apart
 *   CT_WINDOW_COMB   all pixels that are `size` apart
 *
 * Pixels (MaxViT, Tu et al., ECCV 2022), BLOCK and GRID: with n = size^2 pixels of a group
 *   W[s][t] = softmax_t(q_s . k_t / sqrt(width) + bias[place(s, t)][head]),  out_s = sum_t W v_t
 * place: (row of s - row of t + size - 1)(2 size - 1) + the same of columns.
 *
 * Channels (Restormer, Zamir et al., CVPR 2022), BLOCK and COMB: with the width channels of a head,
 * each a vector of the n pixels of the group, q and k scaled to length 1
 *   W[i][j] = softmax_j(temperature[head] q_i . k_j),  out_i = sum_j W v_j
 *
 * One picture a call, float; dqkv is written; gradients of parameters are added to, or NULL.
 * CT_EFAIL of the matrix products. Thread-safe, between ct_dnn_enter and ct_dnn_leave.
 */
#ifndef CT_UNET_WINDOW_H
#define CT_UNET_WINDOW_H
#include "core/err.h"

#include <stdbool.h>
#include <stddef.h>

enum ct_window_kind { CT_WINDOW_BLOCK, CT_WINDOW_GRID, CT_WINDOW_COMB };

struct ct_window {
	enum ct_window_kind kind;
	size_t h, w, size; /* size divides both */
	size_t heads, width;
};

/* Floats of scratch of all four. */
size_t ct_window_scratch(const struct ct_window *a);
int ct_window_forward(const struct ct_window *a, float *out, const float *qkv, const float *bias,
	float *scratch, struct ct_err *e);
int ct_window_back(const struct ct_window *a, float *dqkv, float *dbias, const float *dout,
	const float *qkv, const float *bias, float *scratch, struct ct_err *e);
int ct_window_channels_forward(const struct ct_window *a, float *out, const float *qkv,
	const float *temperature, float *scratch, struct ct_err *e);
int ct_window_channels_back(const struct ct_window *a, float *dqkv, float *dtemperature,
	const float *dout, const float *qkv, const float *temperature, float *scratch,
	struct ct_err *e);

#endif
