/* omni.c: see omni.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "nn/omni.h"

#include <stdio.h>

enum { NAME = 80 };

/* A matrix for every pixel, of so many dimensions in the file, without a bias, plus `add`. */
static size_t matrix(struct ct_build *b, const char *name, const char *sub, size_t rank, size_t x,
	size_t add, size_t channels)
{
	const size_t p = ct_build_weight(b, name, sub, rank, channels, b->g->image[x].c, 1);

	return ct_build_convolve(b,
		(struct ct_graph_op){
			.a = x, .b = add, .param = p, .k = 1, .stride = 1, .bare = true},
		channels);
}

/* 3 x 3 of every channel alone. */
static size_t depthwise(struct ct_build *b, const char *name, const char *sub, size_t x, bool bare)
{
	const struct ct_image s = b->g->image[x];
	const size_t p = bare ? ct_build_weight(b, name, sub, 4, s.c, 1, 3)
			      : ct_build_weights(b, name, sub, 4, s.c, 1, 3, false);

	return ct_build_op(b,
		(struct ct_graph_op){
			.kind = CT_GRAPH_DEPTH, .a = x, .b = CT_NONE, .param = p, .bare = bare},
		s);
}

static size_t times(struct ct_build *b, size_t x, size_t by)
{
	return ct_build_op(b,
		(struct ct_graph_op){.kind = CT_GRAPH_TIMES, .a = x, .b = by, .param = CT_NONE},
		b->g->image[x]);
}

static size_t norm(struct ct_build *b, const char *name, size_t x, double eps)
{
	const struct ct_image s = b->g->image[x];
	const size_t p = ct_build_gains(b, name, "norm", s.c);

	return ct_build_op(b,
		(struct ct_graph_op){
			.kind = CT_GRAPH_LAYER, .a = x, .b = CT_NONE, .param = p, .eps = eps},
		s);
}

static size_t local_conv(struct ct_build *b, const char *name, size_t x)
{
	const size_t c = b->g->image[x].c;
	size_t h, s;

	h = ct_build_pointwise(
		b, CT_POINTWISE_GELU, ct_build_conv(b, name, "fn.0", x, CT_NONE, c, 1));
	h = ct_build_pointwise(b, CT_POINTWISE_GELU, depthwise(b, name, "fn.2", h, false));
	s = ct_build_map(b, CT_GRAPH_MEAN, h, CT_NONE, (struct ct_image){1, 1, c});
	s = matrix(b, name, "fn.4.gate.1", 2, s, CT_NONE, c / 4);
	s = ct_build_map(b, CT_GRAPH_SILU, s, CT_NONE, b->g->image[s]);
	s = matrix(b, name, "fn.4.gate.3", 2, s, CT_NONE, c);
	s = ct_build_pointwise(b, CT_POINTWISE_SIGMOID, s);
	return ct_build_conv(b, name, "fn.5", times(b, h, s), x, c, 1);
}

static size_t gated_conv(struct ct_build *b, const char *name, size_t x)
{
	const struct ct_image s = b->g->image[x];
	size_t h = norm(b, name, x, 1e-6);

	h = matrix(b, name, "fn.project_in", 4, h, CT_NONE, 2 * s.c);
	h = depthwise(b, name, "fn.dwconv", h, true);
	h = ct_build_map(b, CT_GRAPH_GATE, h, CT_NONE, s);
	return matrix(b, name, "fn.project_out", 4, h, x, s.c);
}

/* Attention in windows, or over pixels far apart, with the parameter p. */
static size_t attend(struct ct_build *b, size_t x, size_t p, bool channels, bool spread)
{
	const struct ct_image s = b->g->image[x];

	return ct_build_op(b,
		(struct ct_graph_op){.kind = CT_GRAPH_WINDOW,
			.a = x,
			.b = CT_NONE,
			.param = p,
			.channels = channels,
			.spread = spread},
		(struct ct_image){s.h, s.w, s.c / 3});
}

static size_t pixels(struct ct_build *b, const char *name, size_t x, bool spread)
{
	const size_t c = b->g->image[x].c, edge = 2 * b->arch->window - 1;
	size_t h = norm(b, name, x, 1e-5);

	h = matrix(b, name, "fn.to_qkv", 2, h, CT_NONE, 3 * c);
	ct_build_param(b, name, "fn.rel_pos_bias", "weight",
		(struct ct_param){
			.rank = 2, .dim = {edge * edge, b->arch->num_heads}, .zero = true});
	h = attend(b, h, b->g->n_param - 1, false, spread);
	return matrix(b, name, "fn.to_out.0", 2, h, x, c);
}

static size_t channels(struct ct_build *b, const char *name, size_t x, bool spread)
{
	const size_t c = b->g->image[x].c;
	size_t h = norm(b, name, x, 1e-6), p;

	ct_build_param(b, name, "fn", "temperature",
		(struct ct_param){.rank = 3, .dim = {b->arch->num_heads, 1, 1}, .gamma = true});
	p = b->g->n_param - 1;
	h = matrix(b, name, "fn.qkv", 4, h, CT_NONE, 3 * c);
	h = depthwise(b, name, "fn.qkv_dwconv", h, true);
	h = attend(b, h, p, true, spread);
	return matrix(b, name, "fn.project_out", 4, h, x, c);
}

static size_t block(struct ct_build *b, const char *prefix, size_t x)
{
	size_t (*const attention[2])(struct ct_build *, const char *, size_t, bool) = {
		pixels, channels};
	/* the numbers between are changes of shape in the program */
	static const size_t at[2][2][2] = {{{2, 4}, {5, 6}}, {{8, 10}, {11, 12}}};
	char name[NAME];

	snprintf(name, sizeof name, "%.60s.layer.0", prefix);
	x = local_conv(b, name, x);
	for (size_t spread = 0; spread < 2; spread++)
		for (size_t k = 0; k < 2; k++) {
			snprintf(name, sizeof name, "%.60s.layer.%zu", prefix, at[spread][k][0]);
			x = attention[k](b, name, x, spread == 1);
			snprintf(name, sizeof name, "%.60s.layer.%zu", prefix, at[spread][k][1]);
			x = gated_conv(b, name, x);
		}
	return x;
}

/* Enhanced spatial attention (Liu, Zhang, Tang, Wu: Residual feature aggregation network, 2020). */
static size_t spatial(struct ct_build *b, const char *prefix, size_t x)
{
	const struct ct_image s = b->g->image[x];
	const size_t c = s.c / 4 > 16 ? s.c / 4 : 16;
	size_t first, h, p, wide;
	struct ct_image m;
	char name[NAME];

	snprintf(name, sizeof name, "%.60s.esa", prefix);
	first = ct_build_conv(b, name, "conv1", x, CT_NONE, c, 1);
	wide = ct_build_weights(b, name, "conv_f", 4, c, c, 1, false);
	p = ct_build_weights(b, name, "conv2", 4, c, c, 3, false);
	h = ct_build_convolve(b,
		(struct ct_graph_op){
			.a = first, .b = CT_NONE, .param = p, .k = 3, .stride = 2, .inside = true},
		c);
	m = b->g->image[h];
	h = ct_build_op(b,
		(struct ct_graph_op){.kind = CT_GRAPH_POOL,
			.a = h,
			.b = CT_NONE,
			.param = CT_NONE,
			.k = 7,
			.stride = 3},
		(struct ct_image){(m.h - 7) / 3 + 1, (m.w - 7) / 3 + 1, c});
	h = ct_build_conv(b, name, "conv3", h, CT_NONE, c, 3);
	h = ct_build_map(b, CT_GRAPH_STRETCH, h, CT_NONE, (struct ct_image){s.h, s.w, c});
	h = ct_build_convolve(
		b, (struct ct_graph_op){.a = first, .b = h, .param = wide, .k = 1, .stride = 1}, c);
	h = ct_build_pointwise(
		b, CT_POINTWISE_SIGMOID, ct_build_conv(b, name, "conv4", h, CT_NONE, s.c, 1));
	return times(b, x, h);
}

static size_t group(struct ct_build *b, size_t i, size_t x)
{
	const size_t first = x, layers = b->arch->layers;
	char outer[NAME], name[NAME];

	snprintf(outer, sizeof outer, "residual_layer.%zu", i);
	for (size_t k = 0; k < layers; k++) {
		snprintf(name, sizeof name, "residual_layer.%zu.residual_layer.%zu", i, k);
		x = block(b, name, x);
	}
	snprintf(name, sizeof name, "residual_layer.%zu.residual_layer.%zu", i, layers);
	x = ct_build_conv(b, name, "", x, first, b->arch->features, 1);
	return spatial(b, outer, x);
}

size_t ct_omni_build(struct ct_build *b)
{
	const struct ct_unet_arch *a = b->arch;
	const size_t r = a->factor,
		     first = ct_build_conv(b, "input", "", 0, CT_NONE, a->features, 3);
	size_t x = first;

	for (size_t i = 0; i < a->blocks && !b->failed; i++)
		x = group(b, i, x);
	x = ct_build_conv(b, "output", "", x, first, a->features, 3);
	x = ct_build_conv(b, "up.0", "", x, CT_NONE, a->out_channels * r * r, 3);
	return ct_build_shuffle(b, x, r);
}

bool ct_omni_of(struct ct_unet_arch *a, const struct ct_tensors *w)
{
	static const char bias[] =
		"residual_layer.0.residual_layer.0.layer.2.fn.rel_pos_bias.weight";
	size_t places, up;

	a->features = ct_tensors_dim(w, 0, "input.weight");
	a->in_channels = a->out_channels = ct_tensors_dim(w, 1, "input.weight");
	places = ct_tensors_dim(w, 0, "%s", bias);
	if (!a->in_channels || !places)
		return false;
	a->net = CT_NET_OMNI;
	a->num_heads = ct_tensors_dim(w, 1, "%s", bias);
	a->blocks = a->layers = a->window = a->factor = 1;
	while (ct_tensors_dim(w, 0, "residual_layer.%zu.esa.conv1.weight", a->blocks))
		a->blocks++;
	while (ct_tensors_dim(
		w, 0, "residual_layer.0.residual_layer.%zu.layer.0.fn.0.weight", a->layers))
		a->layers++;
	while (a->window <= CT_NET_WINDOW && (2 * a->window - 1) * (2 * a->window - 1) < places)
		a->window++;
	up = ct_tensors_dim(w, 0, "up.0.weight");
	while (a->factor <= CT_NET_FACTOR && a->out_channels * a->factor * a->factor < up)
		a->factor++;
	return true; /* ct_unet_arch_check refuses what is too large */
}
