/* attention.h: attention among neighbouring samples of a ray, the block of SAX-NeRF (Cai et al.,
 * CVPR 2024): "Lineformer".
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
 */
#ifndef CT_FIELD_ATTENTION_H
#define CT_FIELD_ATTENTION_H
#include "core/err.h"
#include "core/words.h"

#include <stddef.h>
#include <stdint.h>

enum { CT_ATTENTION_SEGMENT = 16, CT_ATTENTION_HEADS = 64 }; /* at most; of a head's numbers too */

struct ct_attention {
	size_t segment, heads, head; /* segment 0: no attention */
};

/* What its weights are, in their order: (w), (w), (3c,w), (heads,segment,segment), (w,c), (w), (w),
 * (w), (4w,w), (4w), (w,4w), (w). */
#define CT_ATTENTION_LIST(X)                                                                       \
	X(CT_ATTENTION_GAIN, "norm1.weight")                                                       \
	X(CT_ATTENTION_SHIFT, "norm1.bias")                                                        \
	X(CT_ATTENTION_QKV, "qkv.weight")                                                          \
	X(CT_ATTENTION_PLACE, "position")                                                          \
	X(CT_ATTENTION_OUT, "out.weight")                                                          \
	X(CT_ATTENTION_OUT_BIAS, "out.bias")                                                       \
	X(CT_ATTENTION_GAIN2, "norm2.weight")                                                      \
	X(CT_ATTENTION_SHIFT2, "norm2.bias")                                                       \
	X(CT_ATTENTION_WIDE, "ffn1.weight")                                                        \
	X(CT_ATTENTION_WIDE_BIAS, "ffn1.bias")                                                     \
	X(CT_ATTENTION_BACK, "ffn2.weight")                                                        \
	X(CT_ATTENTION_BACK_BIAS, "ffn2.bias")
enum ct_attention_part { CT_ATTENTION_LIST(CT_WORD_VALUE) CT_ATTENTION_PARTS };

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

#endif
