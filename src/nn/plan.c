/* plan.c: where every image of a network lies while it runs; plan-run.c runs it.
 *
 * Without training an image's place is used again after its last reader, and a normalisation that
 * is the last reader works in place. With training all images stay; the gradients of images live
 * from their first writer, in reverse order, to the operation that made the image.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "core/mem.h"
#include "nn/arena.h"
#include "nn/attention.h"
#include "nn/plan-impl.h"
#include "nn/spatial.h"

#include <stdlib.h>

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
		struct ct_plan_flow *f = &p->flow[i];

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
	const struct ct_image out = p->g.image[o->out];
	struct ct_window w;

	switch ((int)o->kind) {
	case CT_GRAPH_CONV: return ct_conv_scratch(p->conv[i]) / sizeof(float) + 1;
	case CT_GRAPH_NORM: return ct_norm_scratch(out.c);
	case CT_GRAPH_ATTN: return ct_attn_scratch(out.h * out.w, p->train);
	case CT_GRAPH_DEPTH: return ct_spatial_depth_scratch(out.c);
	case CT_GRAPH_LAYER:
	case CT_GRAPH_MEAN:
	case CT_GRAPH_TIMES: return 4 * ct_plan_input(p, o).c;
	case CT_GRAPH_WINDOW: w = ct_plan_window(p, o); return ct_window_scratch(&w);
	default: return 0;
	}
}

/* The convolutions, the places of the sums, and the largest scratch. */
static int prepare(struct ct_unet_plan *p, struct ct_err *e)
{
	for (size_t i = 0; i < p->g.n_op; i++) {
		const struct ct_graph_op *o = &p->g.op[i];
		const struct ct_image in = ct_plan_input(p, o);
		size_t n;

		if (o->kind == CT_GRAPH_CONV) {
			const struct ct_conv_shape s = {in.h, in.w, in.c, p->g.image[o->out].c,
				o->k, o->stride, o->b != CT_NONE, o->inside, 0};

			if (ct_conv_alloc(&p->conv[i], p->net->dnn, &s, o->param,
				    p->net->at[o->param], p->train, e))
				return -1;
			if (!p->net->param) { /* it is held in the order of the plan */
				free(p->net->at[o->param]);
				p->net->at[o->param] = NULL;
			}
		}
		if (o->kind == CT_GRAPH_NORM) {
			p->sum_at[i] = p->sums;
			p->sums += 2 * in.c;
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
