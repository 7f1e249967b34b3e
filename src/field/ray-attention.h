/* ray-attention.h: attention among neighbouring samples of a ray, the block of SAX-NeRF (Cai et
 * al., CVPR 2024): "Lineformer".
 *
 * Points come in segments of `segment` consecutive ones, which see each other and nothing else. Of
 * columns x of `width` w, with c = heads * head:
 *
 *   u = x + Wo A(Wqkv N(x)) + bo,   y = u + W2 g(W1 N'(u) + b1) + b2
 *
 * N is the layer norm (eps 1e-5), A of each head sum_t softmax_t(q_s . k_t / sqrt(head) + p_st)
 * v_t, W1 has 4 w rows. The paper is silent on these, which are decided here: p is a learnt number
 * for each head and pair of places in the segment, added to the logits; no bias in Wqkv; g is GELU
 * by its tanh formula; no activation after the block.
 *
 * Activations are feature-major (dense.h). The columns of place s of all segments stand together:
 * place s of segment i is column s * cols / segment + i, and cols / segment is a multiple of
 * CT_DENSE_LANES. Thread-safe.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FIELD_RAY_ATTENTION_H
#define CT_FIELD_RAY_ATTENTION_H
#include "core/err.h"
#include "core/simd.h"

#include <stddef.h>

struct ct_attention {
	size_t segment, heads, head; /* segment 0: no attention */
};

/* What its weights are, in their order: (w), (w), (3c,w), (heads,segment,segment), (w,c), (w), (w),
 * (w), (4w,w), (4w), (w,4w), (w). */
enum ct_attention_part {
	CT_ATTENTION_GAIN,
	CT_ATTENTION_SHIFT,
	CT_ATTENTION_QKV,
	CT_ATTENTION_PLACE,
	CT_ATTENTION_OUT,
	CT_ATTENTION_OUT_BIAS,
	CT_ATTENTION_GAIN2,
	CT_ATTENTION_SHIFT2,
	CT_ATTENTION_WIDE,
	CT_ATTENTION_WIDE_BIAS,
	CT_ATTENTION_BACK,
	CT_ATTENTION_BACK_BIAS,
	CT_ATTENTION_PARTS
};

/* Shape of a part for columns of `width`; its rank. */
size_t ct_attention_dims(const struct ct_attention *s, size_t width, enum ct_attention_part part,
	size_t dim[static 3]);
/* Where it begins in the weights; CT_ATTENTION_PARTS: how many all are. */
size_t ct_attention_offset(const struct ct_attention *s, size_t width, enum ct_attention_part part);

/* Floats that a forward keeps and that a backward needs besides, for columns of ld floats. */
size_t ct_attention_kept(const struct ct_attention *s, size_t width, size_t ld);
size_t ct_attention_scratch(const struct ct_attention *s, size_t width, size_t ld);

struct ct_attention_call {
	const struct ct_attention *shape;
	size_t width, cols, ld;
	const float *weights;
	float *kept, *scratch;
};
/* y[width][ld] of x[width][ld]. CT_EFAIL of oneDNN. */
int ct_attention_forward(
	const struct ct_attention_call *c, float *y, const float *x, struct ct_err *e);
/* After that forward: dx[width][ld] = d loss / d x from dy, which is written over; grad (of the
 * weights) += theirs. */
int ct_attention_back(
	const struct ct_attention_call *c, float *dx, float *dy, float *grad, struct ct_err *e);

/* The loops (ray-attention-kernels.c). unit = (x - mean) / sqrt(variance + 1e-5) of each column, y
 * = gain unit + shift; scale[ld], the factor. */
CT_SIMD_DECLARE(void, ct_attention_kernels_norm,
	(size_t width, size_t cols, size_t ld, float *y, float *unit, float *scale, const float *x,
		const float *gain, const float *shift));
/* dx += d loss / d x; dy is left as it is. */
CT_SIMD_DECLARE(void, ct_attention_kernels_norm_back,
	(size_t width, size_t cols, size_t ld, float *dx, const float *dy, const float *unit,
		const float *scale, const float *gain));
/* y = GELU(x); dx = dx times its slope at x. */
CT_SIMD_DECLARE(void, ct_attention_kernels_gelu, (size_t n, float *y, const float *x));
CT_SIMD_DECLARE(void, ct_attention_kernels_gelu_back, (size_t n, float *dx, const float *x));

/* Of one head: q, k, v [head][ld], `segments` columns a place; p[segment][segment]; weights
 * w[segment][segment][segments], out[head][ld]. */
struct ct_attention_head {
	size_t segment, head, segments, ld;
	const float *q, *k, *v, *p;
	float *w;
};
CT_SIMD_DECLARE(void, ct_attention_kernels_head, (const struct ct_attention_head *h, float *out));
/* dq, dk, dv written; w becomes d loss / d logits. */
CT_SIMD_DECLARE(void, ct_attention_kernels_head_back,
	(const struct ct_attention_head *h, float *dq, float *dk, float *dv, const float *dout));

#endif
