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
 * Weights: N's gain (w) and shift (w), Wqkv (3c,w), p (heads,segment,segment), Wo (w,c), bo (w), N'
 * gain and shift, W1 (4w,w), b1 (4w), W2 (w,4w), b2 (w).
 */
#ifndef CT_FIELD_ATTENTION_H
#define CT_FIELD_ATTENTION_H
#include <stddef.h>

enum { CT_ATTENTION_SEGMENT = 16, CT_ATTENTION_HEADS = 64 }; /* at most; of a head's numbers too */

struct ct_attention {
	size_t segment, heads, head; /* segment 0: no attention */
};

#endif
