/* ray-attention.c: see ray-attention.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "field/ray-attention.h"
#include "nn/dense.h"

#include <string.h>

size_t ct_attention_dims(const struct ct_attention *s, size_t width, enum ct_attention_part part,
	size_t dim[static 3])
{
	const size_t c = s->heads * s->head, w = width;
	const size_t all[CT_ATTENTION_PARTS][3] = {{w, 0, 0}, {w, 0, 0}, {3 * c, w, 0},
		{s->heads, s->segment, s->segment}, {w, c, 0}, {w, 0, 0}, {w, 0, 0}, {w, 0, 0},
		{4 * w, w, 0}, {4 * w, 0, 0}, {w, 4 * w, 0}, {w, 0, 0}};

	memcpy(dim, all[part], sizeof all[part]);
	return dim[2] ? 3 : dim[1] ? 2 : 1;
}

size_t ct_attention_offset(const struct ct_attention *s, size_t width, enum ct_attention_part part)
{
	size_t at = 0;

	for (enum ct_attention_part p = 0; p < part; p++) {
		size_t dim[3], rank = ct_attention_dims(s, width, p, dim), n = dim[0];

		for (size_t k = 1; k < rank; k++)
			n *= dim[k];
		at += n;
	}
	return at;
}

/* Rows of ld floats that are kept, one after the other: unit and y of N, qkv, A's result, u, unit
 * and y of N', W1's result and its GELU, factors of both norms, softmax's weights. */
struct rows {
	float *unit, *norm, *qkv, *mixed, *u, *unit2, *norm2, *wide, *gelu, *scale, *scale2, *w;
	size_t all;
};

static struct rows rows_of(const struct ct_attention *s, size_t width, size_t ld, float *kept)
{
	const size_t c = s->heads * s->head;
	size_t at = 0;
	struct rows r;

#define TAKE(name, n) (r.name = kept ? kept + at * ld : NULL, at += (n))
	TAKE(unit, width);
	TAKE(norm, width);
	TAKE(qkv, 3 * c);
	TAKE(mixed, c);
	TAKE(u, width);
	TAKE(unit2, width);
	TAKE(norm2, width);
	TAKE(wide, 4 * width);
	TAKE(gelu, 4 * width);
	TAKE(scale, 1);
	TAKE(scale2, 1);
	TAKE(w, s->heads * s->segment);
#undef TAKE
	r.all = at * ld;
	return r;
}

size_t ct_attention_kept(const struct ct_attention *s, size_t width, size_t ld)
{
	return rows_of(s, width, ld, NULL).all;
}

size_t ct_attention_scratch(const struct ct_attention *s, size_t width, size_t ld)
{
	return ld * (5 * width + 4 * s->heads * s->head);
}

/* The layer whose weights are `part` and, if bias, `bias`. */
static struct ct_dense layer(
	const struct ct_attention_call *c, enum ct_attention_part part, enum ct_attention_part bias)
{
	size_t dim[3];

	ct_attention_dims(c->shape, c->width, part, dim);
	return (struct ct_dense){.in = dim[1],
		.out = dim[0],
		.stride = dim[1],
		.w = c->weights + ct_attention_offset(c->shape, c->width, part),
		.b = bias ? c->weights + ct_attention_offset(c->shape, c->width, bias) : NULL,
		.cols = c->cols,
		.ld = c->ld};
}

static const float *weights(const struct ct_attention_call *c, enum ct_attention_part part)
{
	return c->weights + ct_attention_offset(c->shape, c->width, part);
}

static struct ct_attention_head head_of(
	const struct ct_attention_call *c, const struct rows *r, size_t h)
{
	const struct ct_attention *s = c->shape;
	const size_t one = s->head * c->ld, all = s->heads * one, n = s->segment;

	return (struct ct_attention_head){.segment = n,
		.head = s->head,
		.segments = c->cols / n,
		.ld = c->ld,
		.q = r->qkv + h * one,
		.k = r->qkv + all + h * one,
		.v = r->qkv + 2 * all + h * one,
		.p = weights(c, CT_ATTENTION_PLACE) + h * n * n,
		.w = r->w + h * n * c->ld};
}

static void norm(const struct ct_attention_call *c, float *y, float *unit, float *scale,
	const float *x, enum ct_attention_part gain, enum ct_attention_part shift)
{
	CT_SIMD(ct_attention_kernels_norm)
	(c->width, c->cols, c->ld, y, unit, scale, x, weights(c, gain), weights(c, shift));
}

/* y += x, rows [width]. */
static void plus(const struct ct_attention_call *c, float *y, const float *x)
{
	for (size_t r = 0; r < c->width; r++)
		for (size_t i = r * c->ld; i < r * c->ld + c->cols; i++)
			y[i] += x[i];
}

int ct_attention_forward(
	const struct ct_attention_call *c, float *y, const float *x, struct ct_err *e)
{
	const struct rows r = rows_of(c->shape, c->width, c->ld, c->kept);
	const struct ct_dense qkv = layer(c, CT_ATTENTION_QKV, 0),
			      out = layer(c, CT_ATTENTION_OUT, CT_ATTENTION_OUT_BIAS),
			      wide = layer(c, CT_ATTENTION_WIDE, CT_ATTENTION_WIDE_BIAS),
			      back = layer(c, CT_ATTENTION_BACK, CT_ATTENTION_BACK_BIAS);

	norm(c, r.norm, r.unit, r.scale, x, CT_ATTENTION_GAIN, CT_ATTENTION_SHIFT);
	if (ct_dense_forward(&qkv, r.qkv, r.norm, 1, e))
		return -1;
	for (size_t h = 0; h < c->shape->heads; h++) {
		const struct ct_attention_head head = head_of(c, &r, h);

		CT_SIMD(ct_attention_kernels_head)(&head, r.mixed + h * head.head * c->ld);
	}
	if (ct_dense_forward(&out, r.u, r.mixed, 1, e))
		return -1;
	plus(c, r.u, x);
	norm(c, r.norm2, r.unit2, r.scale2, r.u, CT_ATTENTION_GAIN2, CT_ATTENTION_SHIFT2);
	if (ct_dense_forward(&wide, r.wide, r.norm2, 1, e))
		return -1;
	for (size_t k = 0; k < 4 * c->width; k++)
		CT_SIMD(ct_attention_kernels_gelu)
	(c->cols, r.gelu + k * c->ld, r.wide + k * c->ld);
	if (ct_dense_forward(&back, y, r.gelu, 1, e))
		return -1;
	plus(c, y, r.u);
	return 0;
}

/* dx += what goes through a norm from dy; its gain and shift. */
static void norm_back(const struct ct_attention_call *c, float *dx, const float *dy,
	const float *unit, const float *scale, float *grad, enum ct_attention_part gain,
	enum ct_attention_part shift)
{
	const struct ct_attention *s = c->shape;

	CT_SIMD(ct_dense_kernels_sums)
	(c->width, c->cols, c->ld, grad + ct_attention_offset(s, c->width, gain), dy, unit);
	CT_SIMD(ct_dense_kernels_sums)
	(c->width, c->cols, c->ld, grad + ct_attention_offset(s, c->width, shift), dy, NULL);
	CT_SIMD(ct_attention_kernels_norm_back)
	(c->width, c->cols, c->ld, dx, dy, unit, scale, weights(c, gain));
}

/* The gradient of the weights of a layer, and dx = W^T d. */
static int layer_back(const struct ct_attention_call *c, enum ct_attention_part part,
	enum ct_attention_part bias, float *dx, const float *d, const float *x, float *grad,
	struct ct_err *e)
{
	const struct ct_dense s = layer(c, part, bias);
	float *dw = grad + ct_attention_offset(c->shape, c->width, part);
	float *db = bias ? grad + ct_attention_offset(c->shape, c->width, bias) : NULL;

	if (ct_dense_gradient(&s, dw, db, d, x, e))
		return -1;
	return ct_dense_back(&s, dx, d, NULL, 1, false, e);
}

static void heads_back(const struct ct_attention_call *c, const struct rows *r, float *dqkv,
	const float *dmixed, float *grad)
{
	const struct ct_attention *s = c->shape;
	const size_t one = s->head * c->ld, all = s->heads * one, n = s->segment;

	for (size_t h = 0; h < s->heads; h++) {
		const struct ct_attention_head head = head_of(c, r, h);

		CT_SIMD(ct_attention_kernels_head_back)
		(&head, dqkv + h * one, dqkv + all + h * one, dqkv + 2 * all + h * one,
			dmixed + h * one);
		CT_SIMD(ct_dense_kernels_sums)
		(n * n, head.segments, head.segments,
			grad + ct_attention_offset(s, c->width, CT_ATTENTION_PLACE) + h * n * n,
			head.w, NULL);
	}
}

int ct_attention_back(
	const struct ct_attention_call *c, float *dx, float *dy, float *grad, struct ct_err *e)
{
	const struct rows r = rows_of(c->shape, c->width, c->ld, c->kept);
	const size_t inner = c->shape->heads * c->shape->head;
	float *dwide = c->scratch, *dnorm = dwide + 4 * c->width * c->ld,
	      *dmixed = dnorm + c->width * c->ld, *dqkv = dmixed + inner * c->ld;

	if (layer_back(c, CT_ATTENTION_BACK, CT_ATTENTION_BACK_BIAS, dwide, dy, r.gelu, grad, e))
		return -1;
	for (size_t k = 0; k < 4 * c->width; k++)
		CT_SIMD(ct_attention_kernels_gelu_back)
	(c->cols, dwide + k * c->ld, r.wide + k * c->ld);
	if (layer_back(
		    c, CT_ATTENTION_WIDE, CT_ATTENTION_WIDE_BIAS, dnorm, dwide, r.norm2, grad, e))
		return -1;
	/* dy becomes d loss / d u */
	norm_back(c, dy, dnorm, r.unit2, r.scale2, grad, CT_ATTENTION_GAIN2, CT_ATTENTION_SHIFT2);
	if (layer_back(c, CT_ATTENTION_OUT, CT_ATTENTION_OUT_BIAS, dmixed, dy, r.mixed, grad, e))
		return -1;
	heads_back(c, &r, dqkv, dmixed, grad);
	if (layer_back(c, CT_ATTENTION_QKV, 0, dnorm, dqkv, r.norm, grad, e))
		return -1;
	for (size_t k = 0; k < c->width; k++)
		memcpy(dx + k * c->ld, dy + k * c->ld, c->cols * sizeof *dx);
	norm_back(c, dx, dnorm, r.unit, r.scale, grad, CT_ATTENTION_GAIN, CT_ATTENTION_SHIFT);
	return 0;
}
