/* encoder.c: see encoder.h. */
#include "config.h"
#include "arssr/encoder.h"
#include "unet/dense.h"
#include "arssr/arssr-kernels.h"
#include "core/mem.h"

#include <stdlib.h>
#include <string.h>

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
	const size_t kept = train ? s->blocks : 1, dense = kept * s->layers * s->growth;
	const struct parts p = {
		(train ? s->blocks + 2 : 1) * s->features, train ? dense : most(dense, s->out), 0};

	return (struct parts){p.x, p.o, 2 * s->features + p.x + p.o + (train ? s->out : 0)};
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

float *ct_encoder_x(const struct ct_encoder *c, size_t block)
{
	return c->x + (c->train ? block * c->net->shape.features * voxels(c->n) : 0);
}

float *ct_encoder_o(const struct ct_encoder *c, size_t block, size_t layer)
{
	const struct ct_arssr_shape *s = &c->net->shape;

	return c->o + ((c->train ? block * s->layers : 0) + layer) * s->growth * voxels(c->n);
}

size_t ct_encoder_sources(
	struct ct_encoder_source *from, const struct ct_encoder *c, size_t block, size_t layers)
{
	from[0] = (struct ct_encoder_source){ct_encoder_x(c, block), c->net->shape.features};
	for (size_t j = 0; j < layers; j++)
		from[1 + j] =
			(struct ct_encoder_source){ct_encoder_o(c, block, j), c->net->shape.growth};
	return 1 + layers;
}

void ct_encoder_gather(const struct ct_encoder *c, struct ct_encoder_side *s, size_t z,
	const struct ct_encoder_source *from, size_t parts)
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
	const struct ct_encoder_source *from;
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

	ct_encoder_gather(c, s, i * c->planes, p->from, p->parts);
	if (ct_conv_forward(s->conv[p->layer], to, s->in, bias, NULL, s->scratch, &p->e[worker]) ==
		0) {
		if (p->relu)
			CT_SIMD(ct_arssr_kernels_mask)(rows * l->co, to, to);
		if (p->add)
			CT_SIMD(ct_arssr_kernels_add)
		(rows * l->co, to, p->add + i * rows * l->co);
	}
	ct_dnn_leave(was);
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

	CT_SIMD(ct_arssr_kernels_fill)(rows, f, y, c->net->all + l->bias);
	for (size_t k = 0; k < p->parts && rc == 0; w += p->from[k++].c) {
		const size_t m = p->from[k].c;
		const struct ct_dense_rows s = {m, f, l->ci, w, rows, m, f};

		rc = ct_dense_rows_forward(&s, y, p->from[k].x + i * rows * m, true, e);
	}
	CT_SIMD(ct_arssr_kernels_add)(rows * f, y, p->from[0].x + i * rows * f);
	if (p->block == 0)
		CT_SIMD(ct_arssr_kernels_fill)(rows, f, sum, c->net->all + g->bias);
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
	for (size_t t = 0; t < c->sides; t++)
		if (p->e[t].code) {
			*e = p->e[t];
			return -1;
		}
	return ct_check_stop(env, e);
}

/* A convolution of one source. */
static int plain(struct pass *p, size_t layer, float *to, const float *from, const float *add,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_encoder_source one = {from, p->c->net->layer[layer].ci};

	p->layer = layer;
	p->from = &one;
	p->parts = 1;
	p->to = to;
	p->relu = false;
	p->add = add;
	return go(p, conv_planes, env, e);
}

static int block(struct pass *p, size_t b, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_arssr_shape *s = &p->c->net->shape;
	struct ct_encoder_source from[CT_ENCODER_SOURCES];

	p->from = from;
	p->add = NULL;
	p->relu = true;
	p->block = b;
	for (size_t j = 0; j < s->layers; j++) {
		p->parts = ct_encoder_sources(from, p->c, b, j);
		p->layer = ct_arssr_dense(p->c->net, b, j);
		p->to = ct_encoder_o(p->c, b, j);
		if (go(p, conv_planes, env, e))
			return -1;
	}
	p->parts = ct_encoder_sources(from, p->c, b, s->layers);
	p->layer = ct_arssr_dense(p->c->net, b, s->layers);
	p->to = ct_encoder_x(p->c, b + 1);
	return go(p, fuse_planes, env, e);
}

int ct_encoder_run(
	struct ct_encoder *c, const float *in, const struct ct_env *env, struct ct_err *e)
{
	const size_t blocks = c->net->shape.blocks;
	float *last = ct_encoder_x(c, blocks + 1);
	struct pass p = {.c = c};
	int rc = -1;

	if (ct_alloc0(&p.e, c->sides, sizeof *p.e, e))
		return -1;
	if (plain(&p, CT_ARSSR_FIRST, c->first, in, NULL, env, e) ||
		plain(&p, CT_ARSSR_SECOND, ct_encoder_x(c, 0), c->first, NULL, env, e))
		goto out;
	for (size_t b = 0; b < blocks; b++)
		if (block(&p, b, env, e))
			goto out;
	rc = plain(&p, ct_arssr_fusion(c->net, 1), last, c->sum, c->first, env, e) ||
			     plain(&p, ct_arssr_fusion(c->net, 2), c->to, last, NULL, env, e)
		     ? -1
		     : 0;
out:
	free(p.e);
	return rc;
}
