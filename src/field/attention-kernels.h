/* attention-kernels.h: the loops of attention.h, over columns. Kernels (core/simd.h). */
#ifndef CT_FIELD_ATTENTION_KERNELS_H
#define CT_FIELD_ATTENTION_KERNELS_H
#include "core/simd.h"

#include <stddef.h>

/* unit = (x - mean) / sqrt(variance + 1e-5) of each column, y = gain unit + shift; scale[ld], the
 * factor. */
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
