/* encoder.c: see encoder.h; the gradient is at the end. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "arssr/encoder.h"
#include "nn/dense.h"
#include "arssr/arssr-kernels.h"
#include "nn/layers.h"
#include "core/mem.h"

#include <stdlib.h>
#include <string.h>

enum { SOURCES = 17 };

/* Where a layer reads: parts of its channels. */
struct source {
	const float *x;
	size_t c;
};

struct ct_encoder_side {
	struct ct_conv **conv; /* of each layer with k = 3, else NULL; owned */
	float *in;             /* planes and their neighbours; owned with what follows */
	float *d, *dx, *rest;  /* gradients; without training d is a plane */
	void *scratch;
};

static size_t most(size_t a, size_t b)
{
	return a > b ? a : b;
}

static size_t voxels(const size_t n[3])
{
	return n[0] * n[1] * n[2];
}

/* Features of a voxel: those of blocks and dense layers are kept for the gradient only. */
struct parts {
	size_t x, o, all;
};

static struct parts parts_of(const struct ct_arssr_shape *s, bool train)
{
	const size_t dense = (train ? s->blocks : 1) * s->layers * s->growth;
	struct parts p = {.x = (train ? s->blocks + 2 : 1) * s->features,
		.o = train ? dense : most(dense, s->out)};

	p.all = 2 * s->features + p.x + p.o + (train ? s->out : 0);
	return p;
}

/* Floats of a thread: channels of the input of a call, of its gradient, and of what it makes. */
static size_t side_floats(const struct ct_arssr_shape *s, const size_t n[3], bool train)
{
	const size_t plane = n[0] * n[1], deep = train ? n[2] : 1;
	const size_t c = most(s->features + s->layers * s->growth, s->out);

	return plane *
	       (train ? (deep + 2) * 2 * c + deep * (c + 4 * s->features) : 3 * c + s->features);
}

double ct_encoder_bytes(const struct ct_arssr_shape *s, const size_t n[static 3], size_t sides)
{
	return 4.0 * ((double)parts_of(s, false).all * (double)voxels(n) +
			     (double)sides * (double)side_floats(s, n, false));
}

static int side_alloc(
	struct ct_encoder_side *s, const struct ct_encoder *c, struct ct_dnn *dnn, struct ct_err *e)
{
	const struct ct_arssr *a = c->net;
	const size_t wide =
		most(a->shape.features + a->shape.layers * a->shape.growth, a->shape.out);
	const size_t plane = c->n[0] * c->n[1];
	size_t scratch = 0;

	if (ct_alloc0(&s->conv, ct_arssr_stage(a, 0), sizeof(struct ct_conv *), e) ||
		ct_alloc0(&s->in, side_floats(&a->shape, c->n, c->train), sizeof *s->in, e))
		return -1;
	s->d = s->in + plane * (c->planes + 2) * wide;
	s->dx = s->d + plane * (c->planes + 2) * wide;
	s->rest = s->dx + plane * c->planes * wide;
	for (size_t l = 0; l < ct_arssr_stage(a, 0); l++) {
		const struct ct_arssr_layer *it = &a->layer[l];
		const struct ct_conv_shape shape = {.h = c->n[1],
			.w = c->n[0],
			.d = c->planes + 2,
			.ci = it->ci,
			.co = it->co,
			.k = 3,
			.stride = 1};

		if (it->k != 3)
			continue;
		if (ct_conv_alloc(&s->conv[l], dnn, &shape, l, a->all + it->weight, c->train, e))
			return -1;
		scratch = most(scratch, ct_conv_scratch(s->conv[l]));
	}
	return ct_alloc(&s->scratch, scratch, 1, e);
}

int ct_encoder_alloc(struct ct_encoder *c, struct ct_dnn *dnn, const struct ct_arssr *net,
	const size_t n[static 3], size_t sides, bool train, struct ct_err *e)
{
	const size_t f = net->shape.features, count = voxels(n);
	const struct parts p = parts_of(&net->shape, train);

	*c = (struct ct_encoder){.net = net,
		.n = {n[0], n[1], n[2]},
		.planes = train ? n[2] : 1,
		.train = train,
		.sides = sides};
	if (ct_alloc0(&c->side, sides, sizeof *c->side, e) ||
		ct_alloc(&c->block, p.all * count, sizeof *c->block, e))
		return -1;
	c->first = c->block;
	c->sum = c->first + f * count;
	c->x = c->sum + f * count;
	c->o = c->x + p.x * count;
	c->to = train ? c->o + p.o * count : c->o; /* the dense layers are done with by then */
	for (size_t t = 0; t < sides; t++)
		if (side_alloc(&c->side[t], c, dnn, e))
			return -1;
	return 0;
}

void ct_encoder_free(struct ct_encoder *c)
{
	for (size_t t = 0; c->side && t < c->sides; t++) {
		struct ct_encoder_side *s = &c->side[t];

		for (size_t l = 0; s->conv && l < ct_arssr_stage(c->net, 0); l++)
			ct_conv_free(s->conv[l]);
		free(s->conv);
		free(s->in);
		free(s->scratch);
	}
	free(c->side);
	free(c->block);
	*c = (struct ct_encoder){0};
}

/* The input of a block; of the last and one more: the result, and the last convolution's input. */
static float *x_of(const struct ct_encoder *c, size_t block)
{
	return c->x + (c->train ? block * c->net->shape.features * voxels(c->n) : 0);
}

/* What a dense layer of a block makes. */
static float *o_of(const struct ct_encoder *c, size_t block, size_t layer)
{
	const struct ct_arssr_shape *s = &c->net->shape;

	return c->o + ((c->train ? block * s->layers : 0) + layer) * s->growth * voxels(c->n);
}

/* The sources of a layer of a block: its input, and the layers before. */
static size_t sources_of(
	struct source *from, const struct ct_encoder *c, size_t block, size_t layers)
{
	from[0] = (struct source){x_of(c, block), c->net->shape.features};
	for (size_t j = 0; j < layers; j++)
		from[1 + j] = (struct source){o_of(c, block, j), c->net->shape.growth};
	return 1 + layers;
}

/* The input of planes z and after: side->in, 0 beyond the volume. */
static void gather(const struct ct_encoder *c, struct ct_encoder_side *s, size_t z,
	const struct source *from, size_t parts)
{
	const size_t plane = c->n[0] * c->n[1];
	size_t all = 0;

	for (size_t k = 0; k < parts; k++)
		all += from[k].c;
	for (size_t p = 0; p < c->planes + 2; p++) {
		float *to = s->in + p * plane * all;

		if (z + p < 1 || z + p > c->n[2]) {
			memset(to, 0, plane * all * sizeof *to);
			continue;
		}
		for (size_t k = 0; k < parts; to += from[k++].c) {
			const size_t n = from[k].c;
			const float *x = from[k].x + (z + p - 1) * plane * n;

			for (size_t i = 0; i < plane; i++)
				memcpy(to + i * all, x + i * n, n * sizeof *x);
		}
	}
}

/* A layer of all planes. */
struct pass {
	struct ct_encoder *c;
	size_t layer, block;
	const struct source *from;
	size_t parts;
	float *to;
	bool relu;
	const float *add; /* or NULL */
	struct ct_err *e; /* of each thread */
};

static void conv_planes(void *arg, size_t i, size_t worker)
{
	const struct pass *p = arg;
	struct ct_encoder *c = p->c;
	struct ct_encoder_side *s = &c->side[worker];
	const struct ct_arssr_layer *l = &c->net->layer[p->layer];
	const float *bias = c->net->all + l->bias;
	const size_t rows = c->n[0] * c->n[1] * c->planes;
	float *to = p->to + i * rows * l->co;
	const int was = ct_dnn_enter();

	gather(c, s, i * c->planes, p->from, p->parts);
	if (ct_conv_forward(s->conv[p->layer], to, s->in, bias, NULL, s->scratch, &p->e[worker]) ==
		0) {
		if (p->relu)
			CT_SIMD(ct_arssr_kernels_mask)(rows * l->co, to, to);
		if (p->add)
			CT_SIMD(ct_layer_take)(rows * l->co, to, p->add + i * rows * l->co, true);
	}
	ct_dnn_leave(was);
}

/* y[rows][n] = b. */
static void fill(size_t rows, size_t n, float *y, const float *b)
{
	for (size_t r = 0; r < rows; r++)
		memcpy(y + r * n, b, n * sizeof *y);
}

/* The fusion of a block, added to its input; and what that adds to the fusion of all. */
static void fuse_planes(void *arg, size_t i, size_t worker)
{
	const struct pass *p = arg;
	struct ct_encoder *c = p->c;
	const size_t f = c->net->shape.features, rows = c->n[0] * c->n[1] * c->planes;
	const struct ct_arssr_layer *l = &c->net->layer[p->layer];
	const struct ct_arssr_layer *g = &c->net->layer[ct_arssr_fusion(c->net, 0)];
	const float *w = c->net->all + l->weight;
	float *y = c->train ? p->to + i * rows * f : c->side[worker].d;
	float *sum = c->sum + i * rows * f;
	const struct ct_dense_rows fused = {
		f, f, g->ci, c->net->all + g->weight + p->block * f, rows, f, f};
	struct ct_err *e = &p->e[worker];
	const int was = ct_dnn_enter();
	int rc = 0;

	fill(rows, f, y, c->net->all + l->bias);
	for (size_t k = 0; k < p->parts && rc == 0; w += p->from[k++].c) {
		const size_t m = p->from[k].c;
		const struct ct_dense_rows s = {m, f, l->ci, w, rows, m, f};

		rc = ct_dense_rows_forward(&s, y, p->from[k].x + i * rows * m, true, e);
	}
	CT_SIMD(ct_layer_take)(rows * f, y, p->from[0].x + i * rows * f, true);
	if (p->block == 0)
		fill(rows, f, sum, c->net->all + g->bias);
	if (rc == 0)
		(void)ct_dense_rows_forward(&fused, sum, y, true, e);
	if (!c->train)
		memcpy(p->to + i * rows * f, y, rows * f * sizeof *y);
	ct_dnn_leave(was);
}

static int go(struct pass *p, ct_par_fn *fn, const struct ct_env *env, struct ct_err *e)
{
	struct ct_encoder *c = p->c;

	memset(p->e, 0, c->sides * sizeof *p->e);
	ct_par_for(c->sides > 1 ? env->par : NULL, c->n[2] / c->planes, fn, p);
	return ct_err_any(ct_err_first(e, c->sides, p->e, sizeof *p->e) || ct_check_stop(env, e));
}

/* A convolution of one source. */
static int plain(struct pass *p, size_t layer, float *to, const float *from, const float *add,
	const struct ct_env *env, struct ct_err *e)
{
	const struct source one = {from, p->c->net->layer[layer].ci};

	*p = (struct pass){.c = p->c,
		.layer = layer,
		.from = &one,
		.parts = 1,
		.to = to,
		.add = add,
		.e = p->e};
	return go(p, conv_planes, env, e);
}

static int block(struct pass *p, size_t b, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_encoder *c = p->c;
	const size_t layers = c->net->shape.layers;
	struct source from[SOURCES];

	*p = (struct pass){.c = p->c, .block = b, .from = from, .relu = true, .e = p->e};
	for (size_t j = 0; j <= layers; j++) {
		const bool last = j == layers;

		p->parts = sources_of(from, c, b, j);
		p->layer = ct_arssr_dense(c->net, b, j);
		p->to = last ? x_of(c, b + 1) : o_of(c, b, j);
		if (go(p, last ? fuse_planes : conv_planes, env, e))
			return -1;
	}
	return 0;
}

int ct_encoder_run(
	struct ct_encoder *c, const float *in, const struct ct_env *env, struct ct_err *e)
{
	const size_t blocks = c->net->shape.blocks;
	float *last = x_of(c, blocks + 1);
	struct pass p = {.c = c};
	int rc = -1;

	if (ct_alloc0(&p.e, c->sides, sizeof *p.e, e))
		return -1;
	if (plain(&p, CT_ARSSR_FIRST, c->first, in, NULL, env, e) ||
		plain(&p, CT_ARSSR_SECOND, x_of(c, 0), c->first, NULL, env, e))
		goto out;
	for (size_t b = 0; b < blocks; b++)
		if (block(&p, b, env, e))
			goto out;
	rc = ct_err_any(plain(&p, ct_arssr_fusion(c->net, 1), last, c->sum, c->first, env, e) ||
			plain(&p, ct_arssr_fusion(c->net, 2), c->to, last, NULL, env, e));
out:
	free(p.e);
	return rc;
}

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
static int conv_back(struct back *b, size_t layer, const float *dy, const struct source *from,
	size_t parts, bool data, struct ct_err *e)
{
	const struct ct_arssr_layer *l = &b->c->net->layer[layer];
	struct ct_conv *conv = b->s->conv[layer];

	gather(b->c, b->s, 0, from, parts);
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

/* dx[rows][n] += channels `first` and after of d[rows][all]; dx has rows of `step` floats, or with
 * 0 one, the sum. */
static void take(
	size_t rows, size_t n, float *dx, size_t step, const float *d, size_t all, size_t first)
{
	for (size_t i = 0; i < rows; i++)
		CT_SIMD(ct_layer_take)(n, dx + i * step, d + i * all + first, true);
}

/* Of y += x W^T, W of n rows and ci columns from w on, m of them: dW += dy^T x, dx (+)= dy W. */
static int product(const struct back *b, const struct ct_arssr_layer *l, size_t column, size_t m,
	float *dx, bool add, const float *dy, const float *x, struct ct_err *e)
{
	const struct ct_dense_rows s = {
		m, l->co, l->ci, b->c->net->all + l->weight + column, b->rows, m, l->co};

	return ct_err_any(
		ct_dense_rows_gradient(&s, b->grad + l->weight + column, dy, x, true, e) ||
		ct_dense_rows_back(&s, dx, dy, add, e));
}

static int fusion_back(struct back *b, const float *d, struct ct_err *e)
{
	struct ct_encoder *c = b->c;
	const size_t f = c->net->shape.features, blocks = c->net->shape.blocks;
	const struct source last = {x_of(c, blocks + 1), f}, sum = {c->sum, f};

	if (conv_back(b, ct_arssr_fusion(c->net, 2), d, &last, 1, true, e))
		return -1;
	memcpy(b->first, inner(b, f), b->rows * f * sizeof *b->first);
	if (conv_back(b, ct_arssr_fusion(c->net, 1), b->first, &sum, 1, true, e))
		return -1;
	memcpy(b->sum, inner(b, f), b->rows * f * sizeof *b->sum);
	take(b->rows, f, b->grad + c->net->layer[ct_arssr_fusion(c->net, 0)].bias, 0, b->sum, f, 0);
	return 0;
}

/* b->carry, of the result of a block but for the fusion of all, becomes that of its input. */
static int block_back(struct back *b, size_t at, struct ct_err *e)
{
	struct ct_encoder *c = b->c;
	const struct ct_arssr_shape *s = &c->net->shape;
	const size_t f = s->features, g = s->growth, rows = b->rows;
	const struct ct_arssr_layer *all = &c->net->layer[ct_arssr_fusion(c->net, 0)];
	const struct ct_arssr_layer *l = &c->net->layer[ct_arssr_dense(c->net, at, s->layers)];
	struct source from[SOURCES];
	float *dense = b->s->dx, *spare;

	if (product(b, all, at * f, f, b->carry, true, b->sum, x_of(c, at + 1), e))
		return -1;
	take(rows, f, b->grad + l->bias, 0, b->carry, f, 0);
	memcpy(b->own, b->carry, rows * f * sizeof *b->own);
	if (product(b, l, 0, f, b->own, true, b->carry, x_of(c, at), e))
		return -1;
	for (size_t j = 0; j < s->layers; j++)
		if (product(b, l, f + j * g, g, dense + j * rows * g, false, b->carry,
			    o_of(c, at, j), e))
			return -1;
	for (size_t j = s->layers; j-- > 0;) {
		const size_t parts = sources_of(from, c, at, j), ci = f + j * g;
		float *dy = dense + j * rows * g;

		CT_SIMD(ct_arssr_kernels_mask)(rows * g, dy, o_of(c, at, j));
		if (conv_back(b, ct_arssr_dense(c->net, at, j), dy, from, parts, true, e))
			return -1;
		take(rows, f, b->own, f, inner(b, ci), ci, 0);
		for (size_t i = 0; i < j; i++)
			take(rows, g, dense + i * rows * g, g, inner(b, ci), ci, f + i * g);
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
	const struct source first = {c->first, f}, image = {in, 1};
	struct ct_encoder_side *s = c->side;
	struct back b = {.c = c, .s = s, .grad = grad, .rows = rows};
	const int was = ct_dnn_enter();
	int rc;

	b.first = s->rest;
	b.sum = b.first + rows * f;
	b.carry = b.sum + rows * f;
	b.own = b.carry + rows * f;
	memset(b.carry, 0, rows * f * sizeof *b.carry);
	rc = fusion_back(&b, d, e);
	for (size_t i = c->net->shape.blocks; i-- > 0 && rc == 0;)
		rc = block_back(&b, i, e);
	if (rc == 0)
		rc = conv_back(&b, CT_ARSSR_SECOND, b.carry, &first, 1, true, e);
	if (rc == 0) {
		CT_SIMD(ct_layer_take)(rows * f, b.first, inner(&b, f), true);
		rc = conv_back(&b, CT_ARSSR_FIRST, b.first, &image, 1, false, e);
	}
	ct_dnn_leave(was);
	return rc;
}
