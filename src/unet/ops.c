/* ops.c: see ops.h. */
#include "config.h"
#include "unet/ops.h"
#include "unet/pointwise.h"
#include "unet/spatial.h"
#include "unet/window.h"

#include <assert.h>

static struct ct_window window_of(const struct ct_graph_op *o, struct ct_image s)
{
	const enum ct_window_kind far =
		o->kind == CT_GRAPH_WINDOW ? CT_WINDOW_GRID : CT_WINDOW_COMB;

	return (struct ct_window){.kind = o->spread ? far : CT_WINDOW_BLOCK,
		.h = s.h,
		.w = s.w,
		.size = o->window,
		.heads = o->heads,
		.width = s.c / o->heads};
}

static enum ct_pointwise function_of(const struct ct_graph_op *o)
{
	return o->kind == CT_GRAPH_RELU   ? CT_POINTWISE_RELU
	       : o->kind == CT_GRAPH_GELU ? CT_POINTWISE_GELU
					  : CT_POINTWISE_SIGMOID;
}

size_t ct_ops_scratch(const struct ct_graph_op *o, struct ct_image in, struct ct_image out)
{
	struct ct_window w;

	if (o->kind == CT_GRAPH_DEPTH)
		return ct_spatial_depth_scratch(out.c);
	if (o->kind == CT_GRAPH_LAYER || o->kind == CT_GRAPH_MEAN || o->kind == CT_GRAPH_TIMES)
		return 4 * in.c;
	if (o->kind != CT_GRAPH_WINDOW && o->kind != CT_GRAPH_CHANNELS)
		return 0;
	w = window_of(o, out);
	return ct_window_scratch(&w);
}

static void simple_forward(const struct ct_ops *o)
{
	const struct ct_image in = o->in, out = o->out;
	const size_t hw = in.h * in.w, k = o->op->k;
	double *sum = (double *)(void *)o->scratch;

	switch ((int)o->op->kind) {
	case CT_GRAPH_GATE: CT_SIMD(ct_pointwise_gate_forward)(hw, out.c, o->y, o->x); break;
	case CT_GRAPH_TIMES:
		CT_SIMD(ct_pointwise_times_forward)(hw, in.c, o->one, o->y, o->x, o->b);
		break;
	case CT_GRAPH_SHUFFLE:
		CT_SIMD(ct_spatial_shuffle_forward)(in.h, in.w, out.c, k, o->y, o->x);
		break;
	case CT_GRAPH_DEPTH:
		CT_SIMD(ct_spatial_depth_forward)
		(in.h, in.w, in.c, o->y, o->x, o->param[0], o->param[1], o->scratch);
		break;
	case CT_GRAPH_LAYER:
		CT_SIMD(ct_pointwise_norm_forward)
		(hw, in.c, o->op->eps, o->y, o->x, o->param[0], o->param[1]);
		break;
	case CT_GRAPH_MEAN: CT_SIMD(ct_spatial_mean_forward)(hw, in.c, o->y, o->x, sum); break;
	case CT_GRAPH_POOL:
		CT_SIMD(ct_spatial_pool_forward)(in.h, in.w, in.c, k, o->op->stride, o->y, o->x);
		break;
	case CT_GRAPH_STRETCH:
		CT_SIMD(ct_spatial_stretch_forward)
		(in.h, in.w, out.h, out.w, in.c, o->y, o->x);
		break;
	default: CT_SIMD(ct_pointwise_forward)(function_of(o->op), hw * in.c, o->y, o->x); break;
	}
}

int ct_ops_forward(const struct ct_ops *o, struct ct_err *e)
{
	struct ct_window w;

	if (o->op->kind != CT_GRAPH_WINDOW && o->op->kind != CT_GRAPH_CHANNELS) {
		simple_forward(o);
		return 0;
	}
	w = window_of(o->op, o->out);
	return (o->op->kind == CT_GRAPH_WINDOW ? ct_window_forward : ct_window_channels_forward)(
		&w, o->y, o->x, o->param[0], o->scratch, e);
}

static void times_back(const struct ct_ops *o)
{
	const size_t hw = o->in.h * o->in.w, c = o->in.c;

	CT_SIMD(ct_pointwise_times_back)(hw, c, o->one, o->dx, o->dy, o->b, o->acc);
	if (o->one)
		CT_SIMD(ct_pointwise_times_sum)
	(hw, c, o->db, o->dy, o->x, o->acc_b, (double *)(void *)o->scratch);
	else CT_SIMD(ct_pointwise_times_back)(hw, c, false, o->db, o->dy, o->x, o->acc_b);
}

static void simple_back(const struct ct_ops *o)
{
	const struct ct_image in = o->in, out = o->out;
	const size_t hw = in.h * in.w, k = o->op->k;

	switch ((int)o->op->kind) {
	case CT_GRAPH_GATE:
		CT_SIMD(ct_pointwise_gate_back)(hw, out.c, o->dx, o->dy, o->x, o->acc);
		break;
	case CT_GRAPH_TIMES: times_back(o); break;
	case CT_GRAPH_SHUFFLE:
		CT_SIMD(ct_spatial_shuffle_back)(in.h, in.w, out.c, k, o->dx, o->dy, o->acc);
		break;
	case CT_GRAPH_DEPTH:
		CT_SIMD(ct_spatial_depth_back)
		(in.h, in.w, in.c, o->dx, o->dparam[0], o->dparam[1], o->dy, o->x, o->param[0],
			o->acc, o->scratch);
		break;
	case CT_GRAPH_LAYER:
		CT_SIMD(ct_pointwise_norm_back)
		(hw, in.c, o->op->eps, o->dx, o->dparam[0], o->dparam[1], o->dy, o->x, o->param[0],
			o->acc, (double *)(void *)o->scratch);
		break;
	case CT_GRAPH_MEAN: CT_SIMD(ct_spatial_mean_back)(hw, in.c, o->dx, o->dy, o->acc); break;
	case CT_GRAPH_POOL:
		CT_SIMD(ct_spatial_pool_back)
		(in.h, in.w, in.c, k, o->op->stride, o->dx, o->dy, o->x, o->acc);
		break;
	case CT_GRAPH_STRETCH:
		CT_SIMD(ct_spatial_stretch_back)
		(in.h, in.w, out.h, out.w, in.c, o->dx, o->dy, o->acc);
		break;
	default:
		CT_SIMD(ct_pointwise_back)
		(function_of(o->op), hw * in.c, o->dx, o->dy, o->x, o->acc);
		break;
	}
}

int ct_ops_back(const struct ct_ops *o, struct ct_err *e)
{
	struct ct_window w;

	if (o->op->kind != CT_GRAPH_WINDOW && o->op->kind != CT_GRAPH_CHANNELS) {
		simple_back(o);
		return 0;
	}
	assert(!o->acc); /* nothing else reads queries, keys and values */
	w = window_of(o->op, o->out);
	return (o->op->kind == CT_GRAPH_WINDOW ? ct_window_back : ct_window_channels_back)(
		&w, o->dx, o->dparam[0], o->dy, o->x, o->param[0], o->scratch, e);
}
