/* conv.c: see conv.h. Version 3 of oneDNN dropped operation descriptors.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "nn/conv.h"
#include "core/mem.h"
#include "nn/dnn-impl.h"

#include <stdlib.h>

enum direction { FORWARD, BACK_DATA, BACK_WEIGHTS, DIRECTIONS };
enum role { SRC, DST, WEIGHTS, SCRATCH, BIAS, ADD, ROLES };

/* A primitive and its memories, of the first n roles; the pointers are set at each call. */
struct prim {
	dnnl_primitive_t p;
	int n;
	dnnl_exec_arg_t arg[ROLES];
	size_t scratch; /* bytes */
	size_t weights; /* bytes of the weights in this direction's order */
	struct ct_dnn_pack *pack;
};

struct ct_conv {
	struct ct_dnn *dnn;
	struct ct_conv_shape s;
	dnnl_stream_t stream;
	struct prim dir[DIRECTIONS];
	struct ct_dnn_order unpack; /* gradient of the weights, added to plain order */
	ct_dnn_desc src, dst, weights, plain, bias;
};

/* The primitive descriptor of one direction; `hint` is that of the forward one. */
static int conv_desc(dnnl_primitive_desc_t *pd, const struct ct_conv *c, enum direction dir,
	bool train, dnnl_primitive_desc_t hint, dnnl_primitive_attr_t attr, struct ct_err *e)
{
	const dnnl_dim_t step = (dnnl_dim_t)c->s.stride,
			 edge = c->s.inside ? 0 : (dnnl_dim_t)c->s.k / 2;
	/* with stride 2 an even image ends one pixel before the padding */
	const dnnl_dim_t endh = edge - (step == 2 && c->s.h % 2 == 0 && edge);
	const dnnl_dim_t endw = edge - (step == 2 && c->s.w % 2 == 0 && edge);
	const dnnl_dims_t image[] = {{step, step}, {edge, edge}, {endh, endw}};
	const dnnl_dims_t planes[] = {{step, step, step}, {0, edge, edge}, {0, endh, endw}};
	const dnnl_dims_t none = {0}, *by = c->s.d ? planes : image;
	const dnnl_alg_kind_t alg = dnnl_convolution_direct;
	const dnnl_prop_kind_t kind = train ? dnnl_forward_training : dnnl_forward_inference;
	dnnl_engine_t eng = c->dnn->engine;
	dnnl_status_t s;

#if DNNL_VERSION_MAJOR >= 3
	if (dir == FORWARD)
		s = dnnl_convolution_forward_primitive_desc_create(pd, eng, kind, alg, c->src,
			c->weights, c->bias, c->dst, by[0], none, by[1], by[2], attr);
	else if (dir == BACK_DATA)
		s = dnnl_convolution_backward_data_primitive_desc_create(pd, eng, alg, c->src,
			c->weights, c->dst, by[0], none, by[1], by[2], hint, attr);
	else
		s = dnnl_convolution_backward_weights_primitive_desc_create(pd, eng, alg, c->src,
			c->weights, c->bias, c->dst, by[0], none, by[1], by[2], hint, attr);
#else
	dnnl_convolution_desc_t d;

	if (dir == FORWARD)
		s = dnnl_dilated_convolution_forward_desc_init(&d, kind, alg, c->src, c->weights,
			c->bias, c->dst, by[0], none, by[1], by[2]);
	else if (dir == BACK_DATA)
		s = dnnl_dilated_convolution_backward_data_desc_init(
			&d, alg, c->src, c->weights, c->dst, by[0], none, by[1], by[2]);
	else
		s = dnnl_dilated_convolution_backward_weights_desc_init(
			&d, alg, c->src, c->weights, c->bias, c->dst, by[0], none, by[1], by[2]);
	if (s == dnnl_success)
		s = dnnl_primitive_desc_create(pd, &d, attr, eng, hint);
#endif
	return ct_dnn_check(s, "convolution", e);
}

/* The next role. */
static int prim_arg(struct prim *p, int id, ct_dnn_cdesc d, dnnl_engine_t eng, struct ct_err *e)
{
	dnnl_exec_arg_t *a = &p->arg[p->n];

	a->arg = id;
	if (ct_dnn_check(dnnl_memory_create(&a->memory, d, eng, DNNL_MEMORY_NONE), "memory", e))
		return -1;
	p->n++;
	return 0;
}

static int prim_set(struct prim *p, enum role role, const void *data, struct ct_err *e)
{
	return (int)role < p->n ? ct_dnn_set(p->arg[role].memory, data, e) : 0;
}

/* The result of the primitive is added to another image. */
static int attr_add(dnnl_primitive_attr_t attr, ct_dnn_cdesc add, struct ct_err *e)
{
	dnnl_post_ops_t ops;
	int rc;

	if (ct_dnn_check(dnnl_post_ops_create(&ops), "sum", e))
		return -1;
	rc = ct_dnn_check(dnnl_post_ops_append_binary(ops, dnnl_binary_add, add), "sum", e);
	if (!rc)
		rc = ct_dnn_check(dnnl_primitive_attr_set_post_ops(attr, ops), "sum", e);
	dnnl_post_ops_destroy(ops);
	return rc;
}

static const int arg_id[DIRECTIONS][BIAS + 1] = {
	[FORWARD] = {DNNL_ARG_SRC, DNNL_ARG_DST, DNNL_ARG_WEIGHTS, DNNL_ARG_SCRATCHPAD,
		DNNL_ARG_BIAS},
	[BACK_DATA] = {DNNL_ARG_DIFF_SRC, DNNL_ARG_DIFF_DST, DNNL_ARG_WEIGHTS, DNNL_ARG_SCRATCHPAD,
		0},
	[BACK_WEIGHTS] = {DNNL_ARG_SRC, DNNL_ARG_DIFF_DST, DNNL_ARG_DIFF_WEIGHTS,
		DNNL_ARG_SCRATCHPAD, DNNL_ARG_DIFF_BIAS},
};

/* The primitive of one direction from its descriptor, and its weights if it reads any. */
static int prim_new(struct ct_conv *c, enum direction dir, dnnl_primitive_desc_t pd, size_t key,
	const float *weight, struct ct_err *e)
{
	struct prim *p = &c->dir[dir];
	dnnl_engine_t eng = c->dnn->engine;
	ct_dnn_cdesc w = dnnl_primitive_desc_query_md(
		pd, dir == BACK_WEIGHTS ? dnnl_query_diff_weights_md : dnnl_query_weights_md, 0);
	ct_dnn_cdesc scratch = dnnl_primitive_desc_query_md(pd, dnnl_query_scratchpad_md, 0);
	const ct_dnn_cdesc desc[BIAS + 1] = {c->src, c->dst, w, scratch, c->bias};
	const int *id = arg_id[dir], add = DNNL_ARG_ATTR_MULTIPLE_POST_OP(0) | DNNL_ARG_SRC_1;

	if (ct_dnn_primitive(&p->p, pd, "convolution", e))
		return -1;
	for (int role = SRC; role <= BIAS && id[role]; role++)
		if (prim_arg(p, id[role], desc[role], eng, e))
			return -1;
	if (dir == FORWARD && c->s.add && prim_arg(p, add, c->dst, eng, e))
		return -1;
	p->scratch = dnnl_memory_desc_get_size(scratch);
	p->weights = dnnl_memory_desc_get_size(w);
	if (dir != BACK_WEIGHTS)
		return ct_dnn_pack_get(c->dnn, key, weight, c->plain, w, &p->pack, e) ||
		       prim_set(p, WEIGHTS, p->pack->data, e);
	return ct_dnn_order_new(&c->unpack, w, c->plain, e);
}

static int conv_build(
	struct ct_conv *c, size_t key, const float *weight, bool train, struct ct_err *e)
{
	dnnl_primitive_attr_t attr = NULL, plain = NULL;
	dnnl_primitive_desc_t pd[DIRECTIONS] = {NULL};
	int rc = -1;

	if (ct_dnn_attr_new(&plain, e) || ct_dnn_attr_new(&attr, e) ||
		(c->s.add && attr_add(attr, c->dst, e)) ||
		ct_dnn_stream_new(&c->stream, c->dnn->engine, e))
		goto out;
	for (int d = FORWARD; d < (train ? DIRECTIONS : BACK_DATA); d++)
		if (conv_desc(&pd[d], c, (enum direction)d, train, pd[FORWARD],
			    d == FORWARD ? attr : plain, e) ||
			prim_new(c, (enum direction)d, pd[d], key, weight, e))
			goto out;
	rc = 0;
out:
	for (int d = 0; d < DIRECTIONS; d++)
		if (pd[d])
			dnnl_primitive_desc_destroy(pd[d]);
	if (attr)
		dnnl_primitive_attr_destroy(attr);
	if (plain)
		dnnl_primitive_attr_destroy(plain);
	return rc;
}

int ct_conv_alloc(struct ct_conv **out, struct ct_dnn *d, const struct ct_conv_shape *s, size_t key,
	const float *weight, bool train, struct ct_err *e)
{
	const dnnl_dim_t h = (dnnl_dim_t)s->h, w = (dnnl_dim_t)s->w, step = (dnnl_dim_t)s->stride;
	const dnnl_dim_t ci = (dnnl_dim_t)s->ci, co = (dnnl_dim_t)s->co, k = (dnnl_dim_t)s->k;
	const dnnl_dim_t d3 = (dnnl_dim_t)s->d, lost = s->inside ? k - 1 : 0; /* pixels of a line */
	const dnnl_dim_t ho = (h - lost + step - 1) / step, wo = (w - lost + step - 1) / step;
	const dnnl_dims_t image[] = {{1, ci, h, w}, {1, co, ho, wo}, {co, ci, k, k}};
	const dnnl_dims_t planes[] = {
		{1, ci, d3, h, w}, {1, co, d3 - k + 1, ho, wo}, {co, ci, k, k, k}};
	const dnnl_dims_t *of = s->d ? planes : image, bd = {co};
	const dnnl_format_tag_t last = s->d ? dnnl_ndhwc : dnnl_nhwc;
	const int rank = s->d ? 5 : 4;
	struct ct_conv *c;
	int was = ct_dnn_enter(), rc = -1;

	if (ct_alloc0(&c, 1, sizeof *c, e))
		goto out;
	c->dnn = d;
	c->s = *s;
	rc = ct_dnn_desc_new(&c->src, rank, of[0], dnnl_f32, last, e) ||
	     ct_dnn_desc_new(&c->dst, rank, of[1], dnnl_f32, last, e) ||
	     ct_dnn_desc_new(&c->weights, rank, of[2], dnnl_f32, dnnl_format_tag_any, e) ||
	     ct_dnn_desc_new(&c->plain, rank, of[2], dnnl_f32, s->d ? dnnl_oidhw : dnnl_oihw, e) ||
	     ct_dnn_desc_new(&c->bias, 1, bd, dnnl_f32, dnnl_a, e) ||
	     conv_build(c, key, weight, train, e);
	if (rc) {
		ct_conv_free(c);
		rc = -1;
	} else {
		*out = c;
	}
out:
	ct_dnn_leave(was);
	return rc;
}

void ct_conv_free(struct ct_conv *c)
{
	if (!c)
		return;
	for (int d = 0; d < DIRECTIONS; d++) {
		ct_dnn_args_free(c->dir[d].n, c->dir[d].arg);
		if (c->dir[d].p)
			dnnl_primitive_destroy(c->dir[d].p);
	}
	ct_dnn_order_free(&c->unpack);
	if (c->stream)
		dnnl_stream_destroy(c->stream);
	ct_dnn_desc_free(c->src);
	ct_dnn_desc_free(c->dst);
	ct_dnn_desc_free(c->weights);
	ct_dnn_desc_free(c->plain);
	ct_dnn_desc_free(c->bias);
	free(c);
}

static size_t align(size_t n)
{
	return (n + 63) / 64 * 64;
}

size_t ct_conv_scratch(const struct ct_conv *c)
{
	const struct prim *w = &c->dir[BACK_WEIGHTS];
	size_t n = align(w->scratch) + align(w->weights) + align(c->s.co * sizeof(float));

	for (int d = 0; d < DIRECTIONS; d++)
		if (c->dir[d].scratch > n)
			n = align(c->dir[d].scratch);
	return n;
}

int ct_conv_forward(struct ct_conv *c, float *y, const float *x, const float *bias,
	const float *add, void *scratch, struct ct_err *e)
{
	struct prim *p = &c->dir[FORWARD];

	if (prim_set(p, SRC, x, e) || prim_set(p, DST, y, e) || prim_set(p, BIAS, bias, e) ||
		prim_set(p, ADD, add, e) || prim_set(p, SCRATCH, scratch, e))
		return -1;
	return ct_dnn_run(p->p, c->stream, p->n, p->arg, "run", e);
}

int ct_conv_back_data(
	struct ct_conv *c, float *dx, const float *dy, void *scratch, struct ct_err *e)
{
	struct prim *p = &c->dir[BACK_DATA];

	if (prim_set(p, SRC, dx, e) || prim_set(p, DST, dy, e) || prim_set(p, SCRATCH, scratch, e))
		return -1;
	return ct_dnn_run(p->p, c->stream, p->n, p->arg, "run", e);
}

int ct_conv_back_weights(struct ct_conv *c, float *dw, float *db, const float *x, const float *dy,
	void *scratch, struct ct_err *e)
{
	struct prim *p = &c->dir[BACK_WEIGHTS];
	char *s = scratch;
	void *packed = s + align(p->scratch), *bias = s + align(p->scratch) + align(p->weights);
	const float *b = bias;

	if (prim_set(p, SRC, x, e) || prim_set(p, DST, dy, e) || prim_set(p, WEIGHTS, packed, e) ||
		prim_set(p, BIAS, bias, e) || prim_set(p, SCRATCH, scratch, e) ||
		ct_dnn_run(p->p, c->stream, p->n, p->arg, "run", e))
		return -1;
	for (size_t i = 0; i < c->s.co; i++)
		db[i] += b[i];
	ct_dnn_order_run(&c->unpack, packed, dw, true);
	return 0;
}
