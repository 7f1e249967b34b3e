/* plan.c: running a network: where every image lies, and the operations forward and backward.
 *
 * Without training an image's place is used again after its last reader, and a normalisation that
 * is the last reader works in place. With training all images stay; the gradients of images live
 * from their first writer, in reverse order, to the operation that made the image.
 */
#include "config.h"
#include "unet/unet.h"
#include "core/mem.h"
#include "unet/arena.h"
#include "unet/attention.h"
#include "unet/conv.h"
#include "unet/layers.h"
#include "unet/norm.h"
#include "unet/ops.h"

#include <stdlib.h>
#include <string.h>

/* How the gradient of one operation goes to its inputs. */
struct flow {
	bool acc_a, acc_b; /* another reader has written there already: add */
	bool moved;        /* the gradient of b is the place of the gradient of out */
	size_t tmp;        /* place for a gradient that is then added */
};

struct ct_unet_plan {
	struct ct_unet *net;
	struct ct_graph g;
	bool train;
	struct ct_conv **conv; /* [n_op] */
	size_t *at, acts;      /* place of every image; floats of all */
	size_t *sum_at, sums;  /* place of a normalisation's sums; doubles of all */
	size_t *grad_at, grads;
	struct flow *flow; /* [n_op] */
	float *act, *grad, *scratch;
	double *sum;
	size_t scratch_count;
	float *none; /* [2][wide]: zeros for a bias that there is none of; its gradient */
	size_t wide;
};

/* Is it one of ops.h? */
static bool is_other(const struct ct_graph_op *o)
{
	return o->kind >= CT_GRAPH_RELU;
}

/* The first (which 0) or second parameter of an operation that has them. */
static const float *param_of(
	const struct ct_unet_plan *p, const struct ct_graph_op *o, size_t which)
{
	return which && o->bare ? p->none : p->net->at[o->param + which];
}

/* Where the row of the class begins. */
static size_t label_of(const struct ct_unet_plan *p, const struct ct_graph_op *o)
{
	return p->net->label * p->g.image[o->out].c;
}

/* What an operation reads; the embedding reads no image. */
static const struct ct_image *input_of(const struct ct_unet_plan *p, const struct ct_graph_op *o)
{
	return &p->g.image[o->a == CT_NONE ? o->out : o->a];
}

static struct ct_norm norm_of(
	const struct ct_unet_plan *p, const struct ct_graph_op *o, const float *e)
{
	const struct ct_image *s = &p->g.image[o->out];

	return (struct ct_norm){
		.hw = s->h * s->w,
		.c = s->c,
		.gamma = param_of(p, o, 0),
		.beta = param_of(p, o, 1),
		.e = e,
		.scale_shift = p->net->arch.use_scale_shift_norm,
		.silu = o->silu,
	};
}

static struct ct_attn attn_of(const struct ct_unet_plan *p, const struct ct_graph_op *o)
{
	const struct ct_image *s = &p->g.image[o->out];

	return (struct ct_attn){
		.tokens = s->h * s->w,
		.heads = o->heads,
		.width = s->c / o->heads,
		.legacy = !p->net->arch.use_new_attention_order,
	};
}

/* Places of the images in the order of the forward pass. */
static int place_images(struct ct_unet_plan *p, struct ct_err *e)
{
	const struct ct_graph *g = &p->g;
	struct ct_arena a = {0};
	size_t *last;
	int rc = -1;

	if (ct_alloc0(&last, g->n_image, sizeof *last, e))
		return -1;
	for (size_t i = 0; i < g->n_op; i++) {
		if (g->op[i].a != CT_NONE)
			last[g->op[i].a] = i;
		if (g->op[i].b != CT_NONE)
			last[g->op[i].b] = i;
	}
	if (ct_arena_take(&a, ct_image_count(&g->image[0]), &p->at[0], e))
		goto out;
	for (size_t i = 0; i < g->n_op; i++) {
		const struct ct_graph_op *o = &g->op[i];
		bool in_place = !p->train && o->kind == CT_GRAPH_NORM && last[o->a] == i;

		if (in_place)
			p->at[o->out] = p->at[o->a];
		else if (ct_arena_take(&a, ct_image_count(&g->image[o->out]), &p->at[o->out], e))
			goto out;
		if (p->train)
			continue;
		if (o->a != CT_NONE && last[o->a] == i && !in_place)
			ct_arena_give(&a, p->at[o->a]);
		if (o->b != CT_NONE && last[o->b] == i)
			ct_arena_give(&a, p->at[o->b]);
	}
	p->acts = a.top;
	rc = 0;
out:
	ct_arena_free(&a);
	free(last);
	return rc;
}

/* Place of the gradient of an input, and whether it is added to. */
static int place_input(
	struct ct_unet_plan *p, struct ct_arena *a, size_t image, bool *acc, struct ct_err *e)
{
	*acc = p->grad_at[image] != CT_NONE;
	if (*acc)
		return 0;
	return ct_arena_take(a, ct_image_count(&p->g.image[image]), &p->grad_at[image], e);
}

/* Places of the gradients in the order of the backward pass. */
static int place_gradients(struct ct_unet_plan *p, struct ct_err *e)
{
	const struct ct_graph *g = &p->g;
	struct ct_arena a = {0};
	int rc = -1;

	for (size_t i = 0; i < g->n_image; i++)
		p->grad_at[i] = CT_NONE;
	if (ct_arena_take(&a, ct_image_count(&g->image[g->out]), &p->grad_at[g->out], e))
		goto out;
	for (size_t i = g->n_op; i-- > 0;) {
		const struct ct_graph_op *o = &g->op[i];
		struct flow *f = &p->flow[i];

		if (o->a != CT_NONE && place_input(p, &a, o->a, &f->acc_a, e))
			goto out;
		if (o->kind == CT_GRAPH_CONV && f->acc_a) {
			if (ct_arena_take(&a, ct_image_count(&g->image[o->a]), &f->tmp, e))
				goto out;
			ct_arena_give(&a, f->tmp);
		}
		f->moved =
			o->kind == CT_GRAPH_CONV && o->b != CT_NONE && p->grad_at[o->b] == CT_NONE;
		if (f->moved)
			p->grad_at[o->b] = p->grad_at[o->out];
		else if (o->b != CT_NONE && place_input(p, &a, o->b, &f->acc_b, e))
			goto out;
		if (!f->moved)
			ct_arena_give(&a, p->grad_at[o->out]);
	}
	p->grads = a.top;
	rc = 0;
out:
	ct_arena_free(&a);
	return rc;
}

static size_t scratch_of(const struct ct_unet_plan *p, size_t i)
{
	const struct ct_graph_op *o = &p->g.op[i];
	const struct ct_image *out = &p->g.image[o->out];

	switch ((int)o->kind) {
	case CT_GRAPH_CONV: return ct_conv_scratch(p->conv[i]) / sizeof(float) + 1;
	case CT_GRAPH_NORM: return ct_norm_scratch(out->c);
	case CT_GRAPH_ATTN: return ct_attn_scratch(out->h * out->w, p->train);
	default: return is_other(o) ? ct_ops_scratch(o, *input_of(p, o), *out) : 0;
	}
}

/* The convolutions, the places of the sums, and the largest scratch. */
static int prepare(struct ct_unet_plan *p, struct ct_err *e)
{
	for (size_t i = 0; i < p->g.n_op; i++) {
		const struct ct_graph_op *o = &p->g.op[i];
		const struct ct_image *in = input_of(p, o);
		size_t n;

		if (o->kind == CT_GRAPH_CONV) {
			const struct ct_conv_shape s = {in->h, in->w, in->c, p->g.image[o->out].c,
				o->k, o->stride, o->b != CT_NONE, o->inside, 0};

			if (ct_conv_alloc(&p->conv[i], p->net->dnn, &s, o->param, param_of(p, o, 0),
				    p->train, e))
				return -1;
			if (!p->net->param) { /* it is held in the order of the plan */
				free(p->net->at[o->param]);
				p->net->at[o->param] = NULL;
			}
		}
		if (o->kind == CT_GRAPH_NORM) {
			p->sum_at[i] = p->sums;
			p->sums += 2 * in->c;
		}
		n = p->g.image[o->out].c;
		p->wide = o->bare && n > p->wide ? n : p->wide;
		n = scratch_of(p, i);
		p->scratch_count = n > p->scratch_count ? n : p->scratch_count;
	}
	return 0;
}

int ct_unet_plan_alloc(struct ct_unet_plan **out, struct ct_unet *net, size_t h, size_t w,
	bool train, struct ct_err *e)
{
	struct ct_unet_plan *p;

	if (ct_alloc0(&p, 1, sizeof *p, e))
		return -1;
	p->net = net;
	p->train = train;
	if (ct_graph_build(&p->g, &net->arch, h, w, e) ||
		ct_alloc0(&p->conv, p->g.n_op, sizeof(struct ct_conv *), e) ||
		ct_alloc0(&p->flow, p->g.n_op, sizeof *p->flow, e) ||
		ct_alloc0(&p->sum_at, p->g.n_op, sizeof *p->sum_at, e) ||
		ct_alloc0(&p->at, p->g.n_image, sizeof *p->at, e) ||
		ct_alloc0(&p->grad_at, p->g.n_image, sizeof *p->grad_at, e) || prepare(p, e) ||
		place_images(p, e) || (train && place_gradients(p, e)) ||
		ct_alloc(&p->act, p->acts, sizeof *p->act, e) ||
		ct_alloc(&p->sum, p->sums, sizeof *p->sum, e) ||
		ct_alloc(&p->grad, p->grads, sizeof *p->grad, e) ||
		ct_alloc(&p->scratch, p->scratch_count, sizeof *p->scratch, e) ||
		ct_alloc0(&p->none, p->wide, 2 * sizeof *p->none, e)) {
		ct_unet_plan_free(p);
		return -1;
	}
	*out = p;
	return 0;
}

void ct_unet_plan_free(struct ct_unet_plan *p)
{
	if (!p)
		return;
	for (size_t i = 0; p->conv && i < p->g.n_op; i++)
		ct_conv_free(p->conv[i]);
	free(p->conv);
	free(p->flow);
	free(p->sum_at);
	free(p->at);
	free(p->grad_at);
	free(p->act);
	free(p->sum);
	free(p->grad);
	free(p->scratch);
	free(p->none);
	ct_graph_free(&p->g);
	free(p);
}

size_t ct_unet_plan_bytes(const struct ct_unet_plan *p)
{
	return (p->acts + p->grads + p->scratch_count) * sizeof(float) + p->sums * sizeof(double);
}

static float *image_at(const struct ct_unet_plan *p, size_t image)
{
	return image == CT_NONE ? NULL : p->act + p->at[image];
}

/* Of an operation of ops.h; its parameters and gradients are set apart. */
static struct ct_ops other_of(const struct ct_unet_plan *p, const struct ct_graph_op *o)
{
	const bool norm = o->kind == CT_GRAPH_LAYER || o->kind == CT_GRAPH_DEPTH;

	return (struct ct_ops){.op = o,
		.in = *input_of(p, o),
		.out = p->g.image[o->out],
		.one = o->b != CT_NONE && p->g.image[o->b].h * p->g.image[o->b].w == 1,
		.x = image_at(p, o->a),
		.b = image_at(p, o->b),
		.param = {o->param == CT_NONE ? NULL : param_of(p, o, 0),
			norm ? param_of(p, o, 1) : NULL},
		.y = image_at(p, o->out),
		.scratch = p->scratch};
}

static int forward_op(const struct ct_unet_plan *p, size_t i, double t, struct ct_err *e)
{
	const struct ct_graph_op *o = &p->g.op[i];
	const struct ct_image *in = input_of(p, o);
	const struct ct_image *s = &p->g.image[o->out];
	const float *x = image_at(p, o->a), *b = image_at(p, o->b);
	float *y = image_at(p, o->out);
	struct ct_norm norm;
	struct ct_attn attn;
	struct ct_ops other;

	switch ((int)o->kind) {
	case CT_GRAPH_EMBED: CT_SIMD(ct_layer_embed)(s->c, y, t); break;
	case CT_GRAPH_LINEAR:
		CT_SIMD(ct_layer_linear_forward)
		(in->c, s->c, y, x, param_of(p, o, 0), param_of(p, o, 1));
		break;
	case CT_GRAPH_SILU: CT_SIMD(ct_layer_silu_forward)(s->c, y, x); break;
	case CT_GRAPH_LABEL:
		CT_SIMD(ct_layer_take)(s->c, y, x, false);
		CT_SIMD(ct_layer_take)(s->c, y, param_of(p, o, 0) + label_of(p, o), true);
		break;
	case CT_GRAPH_CONV:
		return ct_conv_forward(p->conv[i], y, x, param_of(p, o, 1), b, p->scratch, e);
	case CT_GRAPH_NORM:
		norm = norm_of(p, o, b);
		CT_SIMD(ct_norm_sums)(norm.hw, norm.c, p->sum + p->sum_at[i], x);
		CT_SIMD(ct_norm_forward)(&norm, y, x, p->sum + p->sum_at[i], p->scratch);
		break;
	case CT_GRAPH_UP: CT_SIMD(ct_layer_up_forward)(in->h, in->w, in->c, y, x); break;
	case CT_GRAPH_DOWN: CT_SIMD(ct_layer_down_forward)(in->h, in->w, in->c, y, x); break;
	case CT_GRAPH_CONCAT:
		CT_SIMD(ct_layer_concat_forward)(s->h * s->w, in->c, s->c - in->c, y, x, b);
		break;
	case CT_GRAPH_ATTN:
		attn = attn_of(p, o);
		return ct_attn_forward(&attn, y, x, p->scratch, e);
	default: other = other_of(p, o); return ct_ops_forward(&other, e);
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

static float *grad_of(const struct ct_unet_plan *p, size_t image)
{
	return image == CT_NONE ? NULL : p->grad + p->grad_at[image];
}

/* Gradient in `grads` of the first (which 0) or second parameter, NULL where it is not asked for.
 */
static float *param_grad(
	const struct ct_unet_plan *p, float *grads, const struct ct_graph_op *o, size_t which)
{
	if (grads && which && o->bare)
		return p->none + p->wide;
	return grads ? grads + p->g.param[o->param + which].offset : NULL;
}

static int other_back(
	const struct ct_unet_plan *p, const struct ct_graph_op *o, float *grads, struct ct_err *e)
{
	const struct flow *f = &p->flow[o - p->g.op];
	struct ct_ops other = other_of(p, o);

	for (size_t k = 0; k < 2; k++)
		other.dparam[k] = other.param[k] ? param_grad(p, grads, o, k) : NULL;
	other.dx = grad_of(p, o->a);
	other.db = grad_of(p, o->b);
	other.dy = grad_of(p, o->out);
	other.acc = f->acc_a;
	other.acc_b = f->acc_b;
	return ct_ops_back(&other, e);
}

/* Weights first: afterwards dy may become the gradient of what was added. */
static int conv_back(const struct ct_unet_plan *p, size_t i, float *grads, struct ct_err *e)
{
	const struct ct_graph_op *o = &p->g.op[i];
	const struct flow *f = &p->flow[i];
	float *da = grad_of(p, o->a), *dy = grad_of(p, o->out);
	float *to = f->acc_a ? p->grad + f->tmp : da;

	if (grads && ct_conv_back_weights(p->conv[i], param_grad(p, grads, o, 0),
			     param_grad(p, grads, o, 1), image_at(p, o->a), dy, p->scratch, e))
		return -1;
	if (ct_conv_back_data(p->conv[i], to, dy, p->scratch, e))
		return -1;
	if (f->acc_a)
		CT_SIMD(ct_layer_take)(ct_image_count(&p->g.image[o->a]), da, to, true);
	if (o->b != CT_NONE && !f->moved)
		CT_SIMD(ct_layer_take)
	(ct_image_count(&p->g.image[o->b]), grad_of(p, o->b), dy, f->acc_b);
	return 0;
}

static void norm_back(const struct ct_unet_plan *p, size_t i, float *grads)
{
	const struct ct_graph_op *o = &p->g.op[i];
	struct ct_norm n = norm_of(p, o, image_at(p, o->b));
	float *de = grads ? grad_of(p, o->b) : NULL;

	if (de && !p->flow[i].acc_b)
		memset(de, 0, p->g.image[o->b].c * sizeof *de);
	CT_SIMD(ct_norm_back)
	(&n, grad_of(p, o->a), param_grad(p, grads, o, 0), param_grad(p, grads, o, 1), de,
		grad_of(p, o->out), image_at(p, o->a), p->sum + p->sum_at[i], p->flow[i].acc_a,
		p->scratch);
}

static int backward_op(const struct ct_unet_plan *p, size_t i, float *grads, struct ct_err *e)
{
	const struct ct_graph_op *o = &p->g.op[i];
	const struct flow *f = &p->flow[i];
	const struct ct_image *in = input_of(p, o);
	const struct ct_image *s = &p->g.image[o->out];
	const float *x = image_at(p, o->a);
	float *dx = grad_of(p, o->a), *dy = grad_of(p, o->out);
	struct ct_attn attn;

	/* the path of the timestep has no part in the gradient to the picture */
	if (!grads && p->net->arch.net == CT_NET_UNET &&
		(o->kind == CT_GRAPH_LINEAR || o->kind == CT_GRAPH_SILU))
		return 0;
	switch ((int)o->kind) {
	case CT_GRAPH_EMBED: break;
	case CT_GRAPH_LINEAR:
		CT_SIMD(ct_layer_linear_back)
		(in->c, s->c, dx, param_grad(p, grads, o, 0), param_grad(p, grads, o, 1), dy, x,
			param_of(p, o, 0), f->acc_a);
		break;
	case CT_GRAPH_SILU: CT_SIMD(ct_layer_silu_back)(s->c, dx, dy, x, f->acc_a); break;
	case CT_GRAPH_LABEL:
		CT_SIMD(ct_layer_take)(s->c, dx, dy, f->acc_a);
		if (grads)
			CT_SIMD(ct_layer_take)
		(s->c, param_grad(p, grads, o, 0) + label_of(p, o), dy, true);
		break;
	case CT_GRAPH_CONV: return conv_back(p, i, grads, e);
	case CT_GRAPH_NORM: norm_back(p, i, grads); break;
	case CT_GRAPH_UP: CT_SIMD(ct_layer_up_back)(in->h, in->w, in->c, dx, dy, f->acc_a); break;
	case CT_GRAPH_DOWN:
		CT_SIMD(ct_layer_down_back)(in->h, in->w, in->c, dx, dy, f->acc_a);
		break;
	case CT_GRAPH_CONCAT:
		CT_SIMD(ct_layer_concat_back)(s->h * s->w, s->c, 0, in->c, dx, dy, f->acc_a);
		CT_SIMD(ct_layer_concat_back)
		(s->h * s->w, s->c, in->c, s->c - in->c, grad_of(p, o->b), dy, f->acc_b);
		break;
	case CT_GRAPH_ATTN:
		attn = attn_of(p, o);
		return ct_attn_back(&attn, dx, dy, x, p->scratch, e);
	default: return other_back(p, o, grads, e);
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
