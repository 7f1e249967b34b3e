/* network.c: see network.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "field/network.h"
#include "core/rng.h"
#include "nn/dense.h"

#include <math.h>

int ct_network_check(const struct ct_network *s, struct ct_err *e)
{
	if (s->width < 1 || s->width > CT_NETWORK_WIDTH || s->depth < 1 ||
		s->depth > CT_NETWORK_DEPTH)
		return ct_fail(e, CT_EINPUT,
			"no network has %zu layers of %zu: at most %d layers of %d", s->depth,
			s->width, CT_NETWORK_DEPTH, CT_NETWORK_WIDTH);
	return 0;
}

/* Inputs of layer l; l == depth: of the outputs. */
static size_t inputs(const struct ct_network *s, size_t in, size_t l)
{
	return l == 0 ? in : l == s->skip ? in + s->width : s->width;
}

/* W (part 0) or b (1) of layer l. */
static void linear(
	struct ct_network_part *p, const struct ct_network *s, size_t in, size_t l, size_t part)
{
	p->rank = part ? 1 : 2;
	p->dim[0] = l == s->depth ? s->outputs : s->width;
	p->dim[1] = inputs(s, in, l);
	p->first = 1 / sqrt((double)p->dim[1]);
	p->drawn = true;
}

static void attention(
	struct ct_network_part *p, const struct ct_network *s, enum ct_attention_part part)
{
	size_t dim[3], ahead = part;

	p->rank = ct_attention_dims(&s->attention, s->width, part, p->dim);
	p->drawn = part == CT_ATTENTION_QKV || part == CT_ATTENTION_OUT ||
		   part == CT_ATTENTION_OUT_BIAS || part >= CT_ATTENTION_WIDE;
	p->first = part == CT_ATTENTION_GAIN || part == CT_ATTENTION_GAIN2 ? 1 : 0;
	if (!p->drawn)
		return;
	if (p->rank == 1) /* a bias, behind its matrix */
		ahead--;
	ct_attention_dims(&s->attention, s->width, (enum ct_attention_part)ahead, dim);
	p->first = 1 / sqrt((double)dim[1]);
}

/* Part i without its offset. */
static bool shape_of(const struct ct_network *s, size_t in, size_t i, struct ct_network_part *p)
{
	const size_t parts = s->attention.segment ? CT_ATTENTION_PARTS : 0;

	*p = (struct ct_network_part){.count = 1};
	if (i < 2)
		linear(p, s, in, 0, i);
	else if (i < 2 + parts)
		attention(p, s, (enum ct_attention_part)(i - 2));
	else if (i < parts + 2 * (s->depth + 1))
		linear(p, s, in, (i - parts) / 2, (i - parts) % 2);
	else
		return false;
	for (size_t k = 0; k < p->rank; k++)
		p->count *= p->dim[k];
	return true;
}

bool ct_network_part(const struct ct_network *s, size_t in, size_t i, struct ct_network_part *p)
{
	size_t at = 0;
	bool there;

	for (size_t k = 0; k < i && shape_of(s, in, k, p); k++)
		at += p->count;
	there = shape_of(s, in, i, p);
	p->offset = at;
	return there;
}

size_t ct_network_count(const struct ct_network *s, size_t in)
{
	struct ct_network_part p;

	ct_network_part(s, in, 2 * (s->depth + 1) + CT_ATTENTION_PARTS, &p);
	return p.offset;
}

void ct_network_init(
	const struct ct_network *s, size_t in, float *weights, uint64_t seed, uint64_t stream)
{
	struct ct_network_part p;

	for (size_t i = 0; ct_network_part(s, in, i, &p); i++)
		for (size_t k = p.offset; k < p.offset + p.count; k++)
			weights[k] = p.drawn ? (float)(p.first *
						       (2 * ct_rng_uniform(seed, stream, k) - 1))
					     : (float)p.first;
}

/* What is kept, in rows of ld: the code; beside it what hidden layer `skip` has behind it; the
 * hidden layers; the block's y; the outputs; what the block keeps. */
static float *row(const struct ct_network_call *c, size_t r)
{
	return c->kept + r * c->ld;
}

/* The result of hidden layer l. */
static float *hidden(const struct ct_network_call *c, size_t l)
{
	const struct ct_network *s = c->shape;

	if (l + 1 == s->skip && !(l == 0 && s->attention.segment))
		return row(c, c->in);
	return row(c, c->in + (1 + l) * s->width);
}

static float *attended(const struct ct_network_call *c)
{
	const struct ct_network *s = c->shape;

	return s->skip == 1 ? row(c, c->in) : row(c, c->in + (1 + s->depth) * s->width);
}

static float *outputs(const struct ct_network_call *c)
{
	return row(c, c->in + (2 + c->shape->depth) * c->shape->width);
}

/* Is the layer before layer l the block? */
static bool behind(const struct ct_network *s, size_t l)
{
	return l == 1 && s->attention.segment;
}

static float *input(const struct ct_network_call *c, size_t l)
{
	const struct ct_network *s = c->shape;

	if (l == 0 || (l == s->skip && l < s->depth))
		return c->kept;
	return behind(s, l) ? attended(c) : hidden(c, l - 1);
}

static struct ct_dense layer(const struct ct_network_call *c, size_t l, size_t *offset)
{
	const struct ct_network *s = c->shape;
	const size_t from = inputs(s, c->in, l);
	struct ct_network_part p;

	ct_network_part(s, c->in, 2 * l + (l && s->attention.segment ? CT_ATTENTION_PARTS : 0), &p);
	*offset = p.offset;
	return (struct ct_dense){.in = from,
		.out = p.dim[0],
		.stride = from,
		.w = c->weights + p.offset,
		.b = c->weights + p.offset + p.count,
		.cols = c->cols,
		.ld = c->ld};
}

static struct ct_attention_call block(const struct ct_network_call *c, size_t *offset)
{
	const struct ct_network *s = c->shape;
	struct ct_network_part p;

	ct_network_part(s, c->in, 2, &p);
	*offset = p.offset;
	return (struct ct_attention_call){.shape = &s->attention,
		.width = s->width,
		.cols = c->cols,
		.ld = c->ld,
		.weights = c->weights + p.offset,
		.kept = outputs(c) + s->outputs * c->ld,
		.scratch = c->scratch + 3 * s->width * c->ld};
}

size_t ct_network_kept(const struct ct_network *s, size_t in, size_t ld)
{
	return (in + (2 + s->depth) * s->width + s->outputs) * ld +
	       (s->attention.segment ? ct_attention_kept(&s->attention, s->width, ld) : 0);
}

size_t ct_network_scratch(const struct ct_network *s, size_t ld)
{
	return 2 * s->width * ld +
	       (s->attention.segment
			       ? s->width * ld + ct_attention_scratch(&s->attention, s->width, ld)
			       : 0);
}

int ct_network_forward(const struct ct_network_call *c, float **y, struct ct_err *e)
{
	const struct ct_network *s = c->shape;
	size_t offset;

	*y = outputs(c);
	for (size_t l = 0; l <= s->depth; l++) {
		const struct ct_dense d = layer(c, l, &offset);
		const bool last = l == s->depth;

		if (behind(s, l)) {
			const struct ct_attention_call b = block(c, &offset);

			if (ct_attention_forward(&b, attended(c), hidden(c, 0), e))
				return -1;
		}
		if (ct_dense_forward(&d, last ? *y : hidden(c, l), input(c, l),
			    last ? 1.0f : (float)s->slope, e))
			return -1;
	}
	if (s->last == CT_NETWORK_SIGMOID)
		CT_SIMD(ct_dense_kernels_sigmoid)(c->cols, *y + (s->outputs - 1) * c->ld);
	return 0;
}

/* d, of layer l before its activation, to that of what is before it, or through the block and to
 * hidden layer 0. */
static int before(const struct ct_network_call *c, const struct ct_dense *own, size_t l, float *to,
	const float *d, float *grad, struct ct_err *e)
{
	const struct ct_network *s = c->shape;
	const bool from_block = behind(s, l);
	const struct ct_dense_product mask = {.rows = s->width,
		.cols = c->cols,
		.ld = c->ld,
		.y = to,
		.mask = hidden(c, 0),
		.slope = (float)s->slope};
	struct ct_attention_call b;
	size_t offset;
	float *through = c->scratch + 2 * s->width * c->ld;

	if (!from_block)
		return ct_dense_back(own, to, d, hidden(c, l - 1), (float)s->slope, false, e);
	b = block(c, &offset);
	if (ct_dense_back(own, through, d, NULL, 1, false, e) ||
		ct_attention_back(&b, to, through, grad + offset, e))
		return -1;
	CT_SIMD(ct_dense_kernels_finish)(&mask);
	return 0;
}

int ct_network_back(
	const struct ct_network_call *c, float *dy, float *dcode, float *grad, struct ct_err *e)
{
	const struct ct_network *s = c->shape;
	float *d = dy, *spare[2] = {c->scratch, c->scratch + s->width * c->ld};
	size_t offset;

	if (s->last == CT_NETWORK_SIGMOID) {
		const float *y = outputs(c) + (s->outputs - 1) * c->ld;
		float *last = dy + (s->outputs - 1) * c->ld;

		for (size_t i = 0; i < c->cols; i++)
			last[i] *= y[i] * (1 - y[i]);
	}
	for (size_t l = s->depth + 1; l-- > 0;) {
		struct ct_dense own = layer(c, l, &offset);
		float *to = spare[l % 2], *dw = grad + offset;

		if (ct_dense_gradient(&own, dw, dw + own.in * own.out, d, input(c, l), e))
			return -1;
		if (l == 0 || (l == s->skip && l < s->depth)) { /* the code's own columns */
			own.in = c->in;
			if (dcode && ct_dense_back(&own, dcode, d, NULL, 1, l == 0 && s->skip, e))
				return -1;
			own.w += c->in;
			own.in = s->width;
		}
		if (l > 0 && before(c, &own, l, to, d, grad, e))
			return -1;
		d = to;
	}
	return 0;
}
