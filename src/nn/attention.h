/* attention.h: scaled dot-product attention over the pixels of one feature map.
 *
 * qkv[t][3c] is the output of the 1x1 convolution, channels last, c = heads * width. Legacy order
 * (guided diffusion's default): the channels are, head by head, q, k, v of that head; new order:
 * all q, all k, all v. With W[t][s] = softmax_s(q_t . k_s / sqrt(width)), out_t = sum_s W v_s. Rows
 * are taken CT_ATTN_BLOCK at a time, so memory grows with the number of pixels, not its square.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_NN_ATTENTION_H
#define CT_NN_ATTENTION_H
#include "core/err.h"

#include <stdbool.h>
#include <stddef.h>

enum { CT_ATTN_BLOCK = 64 };

struct ct_attn {
	size_t tokens, heads, width;
	bool legacy;
};

/* Floats of scratch for forward (back: twice that). */
size_t ct_attn_scratch(size_t tokens, bool back);
/* out[t][c]. */
int ct_attn_forward(
	const struct ct_attn *a, float *out, const float *qkv, float *scratch, struct ct_err *e);
/* dqkv[t][3c], written; W is computed again. */
int ct_attn_back(const struct ct_attn *a, float *dqkv, const float *dout, const float *qkv,
	float *scratch, struct ct_err *e);

#endif
