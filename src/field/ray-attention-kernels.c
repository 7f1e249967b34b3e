/* ray-attention-kernels.c: the loops of ray-attention.h, over columns. Kernels (core/simd.h).
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "field/ray-attention.h"
#include "core/vec-exp.h"

#include <math.h>

void CT_SIMD_HERE(ct_attention_kernels_norm)(size_t width, size_t cols, size_t ld, float *y,
	float *unit, float *scale, const float *x, const float *gain, const float *shift)
{
	const float share = 1.0f / (float)width;

	for (size_t i = 0; i < cols; i += CT_F32_LANES) {
		ct_f32 sum = {0}, square = {0}, mean, by;

		for (size_t r = 0; r < width; r++)
			sum += ct_f32_load(x + r * ld + i);
		mean = sum * share;
		for (size_t r = 0; r < width; r++) {
			const ct_f32 d = ct_f32_load(x + r * ld + i) - mean;

			square += d * d;
		}
		by = 1.0f / ct_f32_sqrt(square * share + 1e-5f);
		ct_f32_store(scale + i, by);
		for (size_t r = 0; r < width; r++) {
			const ct_f32 u = (ct_f32_load(x + r * ld + i) - mean) * by;

			ct_f32_store(unit + r * ld + i, u);
			ct_f32_store(y + r * ld + i, u * gain[r] + shift[r]);
		}
	}
}

void CT_SIMD_HERE(ct_attention_kernels_norm_back)(size_t width, size_t cols, size_t ld, float *dx,
	const float *dy, const float *unit, const float *scale, const float *gain)
{
	const float share = 1.0f / (float)width;

	for (size_t i = 0; i < cols; i += CT_F32_LANES) {
		const ct_f32 by = ct_f32_load(scale + i);
		ct_f32 sum = {0}, along = {0};

		for (size_t r = 0; r < width; r++) {
			const ct_f32 d = ct_f32_load(dy + r * ld + i) * gain[r];

			sum += d;
			along += d * ct_f32_load(unit + r * ld + i);
		}
		sum = sum * share;
		along = along * share;
		for (size_t r = 0; r < width; r++) {
			const size_t at = r * ld + i;
			const ct_f32 d = ct_f32_load(dy + at) * gain[r];

			ct_f32_store(
				dx + at, ct_f32_load(dx + at) +
						 by * (d - sum - ct_f32_load(unit + at) * along));
		}
	}
}

/* GELU is x s(2u), s the sigmoid, u = sqrt(2/pi) (x + 0.044715 x^3). */
#define TWICE 1.59576912f
#define CUBE 0.044715f

void CT_SIMD_HERE(ct_attention_kernels_gelu)(size_t n, float *y, const float *x)
{
	for (size_t i = 0; i < n; i += CT_F32_LANES) {
		const ct_f32 v = ct_f32_load(x + i);

		ct_f32_store(y + i, v * ct_f32_sigmoid(TWICE * v * (1.0f + CUBE * v * v)));
	}
}

void CT_SIMD_HERE(ct_attention_kernels_gelu_back)(size_t n, float *dx, const float *x)
{
	for (size_t i = 0; i < n; i += CT_F32_LANES) {
		const ct_f32 v = ct_f32_load(x + i), t = v * v;
		const ct_f32 s = ct_f32_sigmoid(TWICE * v * (1.0f + CUBE * t));
		const ct_f32 slope = s * (1.0f + v * (1.0f - s) * TWICE * (1.0f + 3.0f * CUBE * t));

		ct_f32_store(dx + i, ct_f32_load(dx + i) * slope);
	}
}

/* sum over the head's numbers of a b, at columns i and j. */
CT_INLINE ct_f32 along(const struct ct_attention_head *h, const float *a, const float *b)
{
	ct_f32 sum = {0};

	for (size_t c = 0; c < h->head; c++)
		sum = ct_f32_fma(ct_f32_load(a + c * h->ld), ct_f32_load(b + c * h->ld), sum);
	return sum;
}

/* Of place s, of segments from i on: w[t] = softmax_t of the logits. */
CT_INLINE void weigh(const struct ct_attention_head *h, size_t s, size_t i)
{
	const float by = 1.0f / sqrtf((float)h->head);
	float *w = h->w + s * h->segment * h->segments + i;
	ct_f32 top = ct_f32_set(-3e38f), sum = {0};

	for (size_t t = 0; t < h->segment; t++) {
		const ct_f32 logit =
			along(h, h->q + s * h->segments + i, h->k + t * h->segments + i) * by +
			h->p[s * h->segment + t];

		ct_f32_store(w + t * h->segments, logit);
		top = ct_f32_max(top, logit);
	}
	for (size_t t = 0; t < h->segment; t++) {
		const ct_f32 v = ct_f32_exp(ct_f32_load(w + t * h->segments) - top);

		ct_f32_store(w + t * h->segments, v);
		sum += v;
	}
	sum = 1.0f / sum;
	for (size_t t = 0; t < h->segment; t++)
		ct_f32_store(w + t * h->segments, ct_f32_load(w + t * h->segments) * sum);
}

void CT_SIMD_HERE(ct_attention_kernels_head)(const struct ct_attention_head *h, float *out)
{
	const size_t m = h->segments;

	for (size_t s = 0; s < h->segment; s++)
		for (size_t i = 0; i < m; i += CT_F32_LANES) {
			weigh(h, s, i);
			for (size_t c = 0; c < h->head; c++) {
				ct_f32 sum = {0};

				for (size_t t = 0; t < h->segment; t++)
					sum = ct_f32_fma(
						ct_f32_load(h->w + (s * h->segment + t) * m + i),
						ct_f32_load(h->v + c * h->ld + t * m + i), sum);
				ct_f32_store(out + c * h->ld + s * m + i, sum);
			}
		}
}

/* w of place s becomes d loss / d logits. */
CT_INLINE void slopes(const struct ct_attention_head *h, size_t s, size_t i, const float *dout)
{
	const size_t m = h->segments;
	float *w = h->w + s * h->segment * m + i;
	ct_f32 mean = {0};

	for (size_t t = 0; t < h->segment; t++)
		mean = ct_f32_fma(
			ct_f32_load(w + t * m), along(h, dout + s * m + i, h->v + t * m + i), mean);
	for (size_t t = 0; t < h->segment; t++)
		ct_f32_store(
			w + t * m, ct_f32_load(w + t * m) *
					   (along(h, dout + s * m + i, h->v + t * m + i) - mean));
}

/* to[s] = by * sum over t of w[s][t] from[t], or w[t][s] if `turned`. */
CT_INLINE void mix(const struct ct_attention_head *h, size_t i, float *to, const float *from,
	float by, const int turned)
{
	const size_t m = h->segments, n = h->segment;

	for (size_t s = 0; s < n; s++)
		for (size_t c = 0; c < h->head; c++) {
			ct_f32 sum = {0};

			for (size_t t = 0; t < n; t++)
				sum = ct_f32_fma(
					ct_f32_load(
						h->w + (turned ? t * n + s : s * n + t) * m + i),
					ct_f32_load(from + c * h->ld + t * m + i), sum);
			ct_f32_store(to + c * h->ld + s * m + i, sum * by);
		}
}

void CT_SIMD_HERE(ct_attention_kernels_head_back)(
	const struct ct_attention_head *h, float *dq, float *dk, float *dv, const float *dout)
{
	const float by = 1.0f / sqrtf((float)h->head);

	for (size_t i = 0; i < h->segments; i += CT_F32_LANES) {
		mix(h, i, dv, dout, 1.0f, 1);
		for (size_t s = 0; s < h->segment; s++)
			slopes(h, s, i, dout);
		mix(h, i, dq, h->k, by, 0);
		mix(h, i, dk, h->q, by, 1);
	}
}
