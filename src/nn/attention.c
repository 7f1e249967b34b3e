/* attention.c: see attention.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "nn/attention.h"
#include "nn/dnn.h"
#include "nn/layers.h"

#include <math.h>
#include <string.h>

size_t ct_attn_scratch(size_t tokens, bool back)
{
	return tokens * CT_ATTN_BLOCK * (back ? 2 : 1);
}

/* Where q, k, v of a head begin in the 3c channels. */
static void head_at(const struct ct_attn *a, size_t head, size_t at[3])
{
	const size_t c = a->heads * a->width;

	for (size_t i = 0; i < 3; i++)
		at[i] = a->legacy ? (3 * head + i) * a->width : i * c + head * a->width;
}

/* W of `rows` queries from `first`. */
static int weights(const struct ct_attn *a, const size_t at[3], size_t first, size_t rows, float *w,
	const float *qkv, struct ct_err *e)
{
	const size_t row = 3 * a->heads * a->width;

	if (ct_dnn_sgemm(false, true, rows, a->tokens, a->width, 1.0f / sqrtf((float)a->width),
		    qkv + first * row + at[0], row, qkv + at[1], row, 0, w, a->tokens, e))
		return -1;
	CT_SIMD(ct_layer_softmax)(rows, a->tokens, w);
	return 0;
}

int ct_attn_forward(
	const struct ct_attn *a, float *out, const float *qkv, float *scratch, struct ct_err *e)
{
	const size_t t = a->tokens, c = a->heads * a->width, row = 3 * c;
	size_t at[3];

	for (size_t head = 0; head < a->heads; head++) {
		head_at(a, head, at);
		for (size_t i = 0; i < t; i += CT_ATTN_BLOCK) {
			size_t n = t - i < CT_ATTN_BLOCK ? t - i : CT_ATTN_BLOCK;

			if (weights(a, at, i, n, scratch, qkv, e) ||
				ct_dnn_sgemm(false, false, n, a->width, t, 1, scratch, t,
					qkv + at[2], row, 0, out + i * c + head * a->width, c, e))
				return -1;
		}
	}
	return 0;
}

int ct_attn_back(const struct ct_attn *a, float *dqkv, const float *dout, const float *qkv,
	float *scratch, struct ct_err *e)
{
	const size_t t = a->tokens, wd = a->width, c = a->heads * wd, row = 3 * c;
	const float scale = 1.0f / sqrtf((float)wd);
	float *w = scratch, *dw = scratch + CT_ATTN_BLOCK * t;
	size_t at[3];

	memset(dqkv, 0, t * row * sizeof *dqkv);
	for (size_t head = 0; head < a->heads; head++) {
		head_at(a, head, at);
		for (size_t i = 0; i < t; i += CT_ATTN_BLOCK) {
			size_t n = t - i < CT_ATTN_BLOCK ? t - i : CT_ATTN_BLOCK;
			const float *d = dout + i * c + head * wd;

			if (weights(a, at, i, n, w, qkv, e) ||
				ct_dnn_sgemm(false, true, n, t, wd, 1, d, c, qkv + at[2], row, 0,
					dw, t, e) ||
				ct_dnn_sgemm(true, false, t, wd, n, 1, w, t, d, c, 1, dqkv + at[2],
					row, e))
				return -1;
			CT_SIMD(ct_layer_softmax_back)(n, t, dw, w);
			if (ct_dnn_sgemm(false, false, n, wd, t, scale, dw, t, qkv + at[1], row, 1,
				    dqkv + i * row + at[0], row, e) ||
				ct_dnn_sgemm(true, false, t, wd, n, scale, dw, t,
					qkv + i * row + at[0], row, 1, dqkv + at[1], row, e))
				return -1;
		}
	}
	return 0;
}
