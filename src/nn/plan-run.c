/* plan-run.c: the operations of a network, forward and backward (unet.h).
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "nn/attention.h"
#include "nn/layers.h"
#include "nn/plan-impl.h"
#include "nn/spatial.h"

#include <assert.h>
#include <string.h>

/* An operation and what it works on, of that what it has. */
struct step {
	const struct ct_graph_op *op;
	const struct ct_plan_flow *flow;
	struct ct_image in, out; /* shapes of a and of the result */
	size_t hw;               /* pixels of a */
	bool one;                /* b has one pixel */
	const float *x, *b, *w, *bias;
	float *y;
	/* Backward: gradients; those of parameters NULL if they are not asked for. */
	float *dx, *db, *dy, *dw, *dbias;
	double *sum;    /* of a group normalisation */
	float *scratch; /* also doubles */
	double *doubles;
};

static bool has_two_parameters(const struct ct_graph_op *o)
{
	return o->kind == CT_GRAPH_CONV || o->kind == CT_GRAPH_LINEAR || o->kind == CT_GRAPH_NORM ||
	       o->kind == CT_GRAPH_LAYER || o->kind == CT_GRAPH_DEPTH;
}

static float *image_at(const struct ct_unet_plan *p, size_t image)
{
	return image == CT_NONE ? NULL : p->act + p->at[image];
}

static float *grad_of(const struct ct_unet_plan *p, size_t image)
{
	return image == CT_NONE ? NULL : p->grad + p->grad_at[image];
}

static struct step step_of(const struct ct_unet_plan *p, size_t i)
{
	const struct ct_graph_op *o = &p->g.op[i];
	const struct ct_image in = ct_plan_input(p, o);
	struct step s = {.op = o,
		.flow = &p->flow[i],
		.in = in,
		.out = p->g.image[o->out],
		.hw = in.h * in.w,
		.one = o->b != CT_NONE && p->g.image[o->b].h * p->g.image[o->b].w == 1,
		.x = image_at(p, o->a),
		.b = image_at(p, o->b),
		.y = image_at(p, o->out),
		.sum = p->sum + p->sum_at[i],
		.scratch = p->scratch,
		.doubles = (double *)(void *)p->scratch};

	if (o->param != CT_NONE)
		s.w = p->net->at[o->param];
	if (has_two_parameters(o))
		s.bias = o->bare ? p->none : p->net->at[o->param + 1];
	return s;
}

/* With places of the gradients, of parameters in `grads` or NULL. */
static struct step back_of(const struct ct_unet_plan *p, size_t i, float *grads)
{
	const struct ct_graph_op *o = &p->g.op[i];
	struct step s = step_of(p, i);

	s.dx = grad_of(p, o->a);
	s.db = grad_of(p, o->b);
	s.dy = grad_of(p, o->out);
	if (grads && o->param != CT_NONE)
		s.dw = grads + p->g.param[o->param].offset;
	if (grads && has_two_parameters(o))
		s.dbias = o->bare ? p->none + p->wide : grads + p->g.param[o->param + 1].offset;
	return s;
}

/* The row of the class. */
static size_t label_of(const struct ct_unet_plan *p, const struct step *s)
{
	return p->net->label * s->out.c;
}

static struct ct_norm norm_of(const struct ct_unet_plan *p, const struct step *s)
{
	return (struct ct_norm){.hw = s->hw,
		.c = s->in.c,
		.gamma = s->w,
		.beta = s->bias,
		.e = s->b,
		.scale_shift = p->net->arch.use_scale_shift_norm,
		.silu = s->op->silu};
}

static struct ct_attn attn_of(const struct ct_unet_plan *p, const struct step *s)
{
	const size_t heads = ct_unet_arch_heads(&p->net->arch, s->out.c);

	return (struct ct_attn){.tokens = s->hw,
		.heads = heads,
		.width = s->out.c / heads,
		.legacy = !p->net->arch.use_new_attention_order};
}

static int forward_op(const struct ct_unet_plan *p, size_t i, double t, struct ct_err *e)
{
	const struct step s = step_of(p, i);
	const struct ct_image in = s.in, out = s.out;
	const size_t k = s.op->k;
	struct ct_window window;
	struct ct_norm norm;
	struct ct_attn attn;

	switch (s.op->kind) {
	case CT_GRAPH_EMBED: CT_SIMD(ct_layer_embed)(out.c, s.y, t); break;
	case CT_GRAPH_LINEAR:
		CT_SIMD(ct_layer_linear_forward)(in.c, out.c, s.y, s.x, s.w, s.bias);
		break;
	case CT_GRAPH_SILU: CT_SIMD(ct_layer_silu_forward)(s.hw * in.c, s.y, s.x); break;
	case CT_GRAPH_LABEL:
		CT_SIMD(ct_layer_take)(out.c, s.y, s.x, false);
		CT_SIMD(ct_layer_take)(out.c, s.y, s.w + label_of(p, &s), true);
		break;
	case CT_GRAPH_CONV: return ct_conv_forward(p->conv[i], s.y, s.x, s.bias, s.b, s.scratch, e);
	case CT_GRAPH_NORM:
		norm = norm_of(p, &s);
		CT_SIMD(ct_norm_sums)(norm.hw, norm.c, s.sum, s.x);
		CT_SIMD(ct_norm_forward)(&norm, s.y, s.x, s.sum, s.scratch);
		break;
	case CT_GRAPH_UP: CT_SIMD(ct_layer_up_forward)(in.h, in.w, in.c, s.y, s.x); break;
	case CT_GRAPH_DOWN: CT_SIMD(ct_layer_down_forward)(in.h, in.w, in.c, s.y, s.x); break;
	case CT_GRAPH_CONCAT:
		CT_SIMD(ct_layer_concat_forward)(s.hw, in.c, out.c - in.c, s.y, s.x, s.b);
		break;
	case CT_GRAPH_ATTN:
		attn = attn_of(p, &s);
		return ct_attn_forward(&attn, s.y, s.x, s.scratch, e);
	case CT_GRAPH_POINTWISE:
		CT_SIMD(ct_pointwise_forward)(s.op->f, s.hw * in.c, s.y, s.x);
		break;
	case CT_GRAPH_GATE: CT_SIMD(ct_pointwise_gate_forward)(s.hw, out.c, s.y, s.x); break;
	case CT_GRAPH_TIMES:
		CT_SIMD(ct_pointwise_times_forward)(s.hw, in.c, s.one, s.y, s.x, s.b);
		break;
	case CT_GRAPH_SHUFFLE:
		CT_SIMD(ct_spatial_shuffle_forward)
		(in.h, in.w, out.c, out.h / in.h, s.y, s.x);
		break;
	case CT_GRAPH_DEPTH:
		CT_SIMD(ct_spatial_depth_forward)
		(in.h, in.w, in.c, s.y, s.x, s.w, s.bias, s.scratch);
		break;
	case CT_GRAPH_LAYER:
		CT_SIMD(ct_pointwise_norm_forward)
		(s.hw, in.c, s.op->eps, s.y, s.x, s.w, s.bias);
		break;
	case CT_GRAPH_MEAN:
		CT_SIMD(ct_spatial_mean_forward)(s.hw, in.c, s.y, s.x, s.doubles);
		break;
	case CT_GRAPH_POOL:
		CT_SIMD(ct_spatial_pool_forward)(in.h, in.w, in.c, k, s.op->stride, s.y, s.x);
		break;
	case CT_GRAPH_STRETCH:
		CT_SIMD(ct_spatial_stretch_forward)(in.h, in.w, out.h, out.w, in.c, s.y, s.x);
		break;
	case CT_GRAPH_WINDOW:
		window = ct_plan_window(p, s.op);
		return ct_window_forward(&window, s.y, s.x, s.w, s.scratch, e);
	}
	return 0;
}

int ct_unet_forward(struct ct_unet_plan *p, float *y, const float *x, double t, struct ct_err *e)
{
	const struct ct_image *in = &p->g.image[0], *out = &p->g.image[p->g.out];
	int was = ct_dnn_enter(), rc = 0;

	CT_SIMD(ct_layer_to_last)(in->h * in->w, in->c, image_at(p, 0), x);
	for (size_t i = 0; i < p->g.n_op && !rc; i++)
		rc = forward_op(p, i, t, e);
	CT_SIMD(ct_layer_to_first)(out->h * out->w, out->c, y, image_at(p, p->g.out));
	ct_dnn_leave(was);
	return rc;
}

/* Weights first: afterwards dy may become the gradient of what was added. */
static int conv_back(
	const struct ct_unet_plan *p, struct ct_conv *conv, const struct step *s, struct ct_err *e)
{
	const struct ct_plan_flow *f = s->flow;
	float *to = f->acc_a ? p->grad + f->tmp : s->dx;

	if (s->dw && ct_conv_back_weights(conv, s->dw, s->dbias, s->x, s->dy, s->scratch, e))
		return -1;
	if (ct_conv_back_data(conv, to, s->dy, s->scratch, e))
		return -1;
	if (f->acc_a)
		CT_SIMD(ct_layer_take)(ct_image_count(&s->in), s->dx, to, true);
	if (s->db && !f->moved)
		CT_SIMD(ct_layer_take)(ct_image_count(&s->out), s->db, s->dy, f->acc_b);
	return 0;
}

static void norm_back(const struct ct_unet_plan *p, const struct step *s)
{
	const struct ct_norm n = norm_of(p, s);
	float *de = s->dw ? s->db : NULL;

	if (de && !s->flow->acc_b)
		memset(de, 0, p->g.image[s->op->b].c * sizeof *de);
	CT_SIMD(ct_norm_back)
	(&n, s->dx, s->dw, s->dbias, de, s->dy, s->x, s->sum, s->flow->acc_a, s->scratch);
}

static void times_back(const struct step *s)
{
	const size_t hw = s->hw, c = s->in.c;

	CT_SIMD(ct_pointwise_times_back)(hw, c, s->one, s->dx, s->dy, s->b, s->flow->acc_a);
	if (s->one)
		CT_SIMD(ct_pointwise_times_sum)
	(hw, c, s->db, s->dy, s->x, s->flow->acc_b, s->doubles);
	else CT_SIMD(ct_pointwise_times_back)(hw, c, false, s->db, s->dy, s->x, s->flow->acc_b);
}

static int backward_op(const struct ct_unet_plan *p, size_t i, float *grads, struct ct_err *e)
{
	const struct step s = back_of(p, i, grads);
	const struct ct_image in = s.in, out = s.out;
	const size_t k = s.op->k;
	const bool acc = s.flow->acc_a;
	struct ct_window window;
	struct ct_attn attn;

	/* the path of the timestep has no part in the gradient to the picture */
	if (!grads && p->net->arch.net == CT_NET_UNET &&
		(s.op->kind == CT_GRAPH_LINEAR || s.op->kind == CT_GRAPH_SILU))
		return 0;
	switch (s.op->kind) {
	case CT_GRAPH_EMBED: break;
	case CT_GRAPH_LINEAR:
		CT_SIMD(ct_layer_linear_back)
		(in.c, out.c, s.dx, s.dw, s.dbias, s.dy, s.x, s.w, acc);
		break;
	case CT_GRAPH_SILU: CT_SIMD(ct_layer_silu_back)(s.hw * in.c, s.dx, s.dy, s.x, acc); break;
	case CT_GRAPH_LABEL:
		CT_SIMD(ct_layer_take)(out.c, s.dx, s.dy, acc);
		if (s.dw)
			CT_SIMD(ct_layer_take)(out.c, s.dw + label_of(p, &s), s.dy, true);
		break;
	case CT_GRAPH_CONV: return conv_back(p, p->conv[i], &s, e);
	case CT_GRAPH_NORM: norm_back(p, &s); break;
	case CT_GRAPH_UP: CT_SIMD(ct_layer_up_back)(in.h, in.w, in.c, s.dx, s.dy, acc); break;
	case CT_GRAPH_DOWN: CT_SIMD(ct_layer_down_back)(in.h, in.w, in.c, s.dx, s.dy, acc); break;
	case CT_GRAPH_CONCAT:
		CT_SIMD(ct_layer_concat_back)(s.hw, out.c, 0, in.c, s.dx, s.dy, acc);
		CT_SIMD(ct_layer_concat_back)
		(s.hw, out.c, in.c, out.c - in.c, s.db, s.dy, s.flow->acc_b);
		break;
	case CT_GRAPH_ATTN:
		attn = attn_of(p, &s);
		return ct_attn_back(&attn, s.dx, s.dy, s.x, s.scratch, e);
	case CT_GRAPH_POINTWISE:
		CT_SIMD(ct_pointwise_back)(s.op->f, s.hw * in.c, s.dx, s.dy, s.x, acc);
		break;
	case CT_GRAPH_GATE:
		CT_SIMD(ct_pointwise_gate_back)(s.hw, out.c, s.dx, s.dy, s.x, acc);
		break;
	case CT_GRAPH_TIMES: times_back(&s); break;
	case CT_GRAPH_SHUFFLE:
		CT_SIMD(ct_spatial_shuffle_back)
		(in.h, in.w, out.c, out.h / in.h, s.dx, s.dy, acc);
		break;
	case CT_GRAPH_DEPTH:
		CT_SIMD(ct_spatial_depth_back)
		(in.h, in.w, in.c, s.dx, s.dw, s.dbias, s.dy, s.x, s.w, acc, s.scratch);
		break;
	case CT_GRAPH_LAYER:
		CT_SIMD(ct_pointwise_norm_back)
		(s.hw, in.c, s.op->eps, s.dx, s.dw, s.dbias, s.dy, s.x, s.w, acc, s.doubles);
		break;
	case CT_GRAPH_MEAN: CT_SIMD(ct_spatial_mean_back)(s.hw, in.c, s.dx, s.dy, acc); break;
	case CT_GRAPH_POOL:
		CT_SIMD(ct_spatial_pool_back)
		(in.h, in.w, in.c, k, s.op->stride, s.dx, s.dy, s.x, acc);
		break;
	case CT_GRAPH_STRETCH:
		CT_SIMD(ct_spatial_stretch_back)
		(in.h, in.w, out.h, out.w, in.c, s.dx, s.dy, acc);
		break;
	case CT_GRAPH_WINDOW:
		assert(!acc); /* nothing else reads queries, keys and values */
		window = ct_plan_window(p, s.op);
		return ct_window_back(&window, s.dx, s.dw, s.dy, s.x, s.w, s.scratch, e);
	}
	return 0;
}

int ct_unet_backward(
	struct ct_unet_plan *p, float *grads, float *dx, const float *dy, struct ct_err *e)
{
	const struct ct_image *in = &p->g.image[0], *out = &p->g.image[p->g.out];
	int was = ct_dnn_enter(), rc = 0;

	CT_SIMD(ct_layer_to_last)(out->h * out->w, out->c, grad_of(p, p->g.out), dy);
	for (size_t i = p->g.n_op; i-- > 0 && !rc;)
		rc = backward_op(p, i, grads, e);
	if (dx)
		CT_SIMD(ct_layer_to_first)(in->h * in->w, in->c, dx, grad_of(p, 0));
	ct_dnn_leave(was);
	return rc;
}
