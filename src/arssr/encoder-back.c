/* encoder-back.c: the gradient of the encoder; see encoder.h. */
#include "config.h"
#include "arssr/arssr-kernels.h"
#include "arssr/encoder.h"
#include "unet/dense.h"

#include <string.h>

/* What the gradient of a volume needs. */
struct back {
	struct ct_encoder *c;
	struct ct_encoder_side *s;
	float *grad; /* of the weights */
	size_t rows; /* voxels */
	float *first, *sum, *carry,
		*own; /* of the features: sfe1, fusion, a block's result, input */
};

/* Gradient of the weights of a convolution, and with `data` of what it read: s->d without the
 * planes beyond the volume. */
static int conv(struct back *b, size_t layer, const float *dy, const struct ct_encoder_source *from,
	size_t parts, bool data, struct ct_err *e)
{
	const struct ct_arssr_layer *l = &b->c->net->layer[layer];
	struct ct_conv *conv = b->s->conv[layer];

	ct_encoder_gather(b->c, b->s, 0, from, parts);
	if (ct_conv_back_weights(
		    conv, b->grad + l->weight, b->grad + l->bias, b->s->in, dy, b->s->scratch, e))
		return -1;
	return data ? ct_conv_back_data(conv, b->s->d, dy, b->s->scratch, e) : 0;
}

/* The gradient of what a convolution of ci channels read, without the planes beyond. */
static const float *inner(const struct back *b, size_t ci)
{
	return b->s->d + b->c->n[0] * b->c->n[1] * ci;
}

/* dx[rows][n] += channels `first` and after of d[rows][all]. */
static void take(size_t rows, size_t n, float *dx, const float *d, size_t all, size_t first)
{
	for (size_t i = 0; i < rows; i++)
		CT_SIMD(ct_arssr_kernels_add)(n, dx + i * n, d + i * all + first);
}

/* Of y += x W^T, W of n rows and ci columns from w on, m of them: dW += dy^T x, dx (+)= dy W. */
static int product(const struct back *b, const struct ct_arssr_layer *l, size_t column, size_t m,
	float *dx, bool add, const float *dy, const float *x, struct ct_err *e)
{
	const struct ct_dense_rows s = {
		m, l->co, l->ci, b->c->net->all + l->weight + column, b->rows, m, l->co};

	return ct_dense_rows_gradient(&s, b->grad + l->weight + column, dy, x, true, e) ||
			       ct_dense_rows_back(&s, dx, dy, add, e)
		       ? -1
		       : 0;
}

static int fusion(struct back *b, const float *d, struct ct_err *e)
{
	struct ct_encoder *c = b->c;
	const size_t f = c->net->shape.features, blocks = c->net->shape.blocks;
	const struct ct_encoder_source last = {ct_encoder_x(c, blocks + 1), f}, sum = {c->sum, f};

	if (conv(b, ct_arssr_fusion(c->net, 2), d, &last, 1, true, e))
		return -1;
	memcpy(b->first, inner(b, f), b->rows * f * sizeof *b->first);
	if (conv(b, ct_arssr_fusion(c->net, 1), b->first, &sum, 1, true, e))
		return -1;
	memcpy(b->sum, inner(b, f), b->rows * f * sizeof *b->sum);
	CT_SIMD(ct_arssr_kernels_sum)
	(b->rows, f, b->grad + c->net->layer[ct_arssr_fusion(c->net, 0)].bias, b->sum);
	return 0;
}

/* b->carry, of the result of a block but for the fusion of all, becomes that of its input. */
static int block(struct back *b, size_t at, struct ct_err *e)
{
	struct ct_encoder *c = b->c;
	const struct ct_arssr_shape *s = &c->net->shape;
	const size_t f = s->features, g = s->growth, rows = b->rows;
	const struct ct_arssr_layer *all = &c->net->layer[ct_arssr_fusion(c->net, 0)];
	const struct ct_arssr_layer *l = &c->net->layer[ct_arssr_dense(c->net, at, s->layers)];
	struct ct_encoder_source from[CT_ENCODER_SOURCES];
	float *dense = b->s->dx, *spare;

	if (product(b, all, at * f, f, b->carry, true, b->sum, ct_encoder_x(c, at + 1), e))
		return -1;
	CT_SIMD(ct_arssr_kernels_sum)(rows, f, b->grad + l->bias, b->carry);
	memcpy(b->own, b->carry, rows * f * sizeof *b->own);
	if (product(b, l, 0, f, b->own, true, b->carry, ct_encoder_x(c, at), e))
		return -1;
	for (size_t j = 0; j < s->layers; j++)
		if (product(b, l, f + j * g, g, dense + j * rows * g, false, b->carry,
			    ct_encoder_o(c, at, j), e))
			return -1;
	for (size_t j = s->layers; j-- > 0;) {
		const size_t parts = ct_encoder_sources(from, c, at, j), ci = f + j * g;
		float *dy = dense + j * rows * g;

		CT_SIMD(ct_arssr_kernels_mask)(rows * g, dy, ct_encoder_o(c, at, j));
		if (conv(b, ct_arssr_dense(c->net, at, j), dy, from, parts, true, e))
			return -1;
		take(rows, f, b->own, inner(b, ci), ci, 0);
		for (size_t i = 0; i < j; i++)
			take(rows, g, dense + i * rows * g, inner(b, ci), ci, f + i * g);
	}
	spare = b->carry;
	b->carry = b->own;
	b->own = spare;
	return 0;
}

int ct_encoder_back(
	struct ct_encoder *c, float *grad, const float *d, const float *in, struct ct_err *e)
{
	const size_t f = c->net->shape.features, rows = c->n[0] * c->n[1] * c->n[2];
	const struct ct_encoder_source first = {c->first, f}, image = {in, 1};
	struct ct_encoder_side *s = c->side;
	struct back b = {.c = c, .s = s, .grad = grad, .rows = rows};
	const int was = ct_dnn_enter();
	int rc;

	b.first = s->rest;
	b.sum = b.first + rows * f;
	b.carry = b.sum + rows * f;
	b.own = b.carry + rows * f;
	memset(b.carry, 0, rows * f * sizeof *b.carry);
	rc = fusion(&b, d, e);
	for (size_t i = c->net->shape.blocks; i-- > 0 && rc == 0;)
		rc = block(&b, i, e);
	if (rc == 0)
		rc = conv(&b, CT_ARSSR_SECOND, b.carry, &first, 1, true, e);
	if (rc == 0) {
		CT_SIMD(ct_arssr_kernels_add)(rows * f, b.first, inner(&b, f));
		rc = conv(&b, CT_ARSSR_FIRST, b.first, &image, 1, false, e);
	}
	ct_dnn_leave(was);
	return rc;
}
