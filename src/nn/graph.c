/* graph.c: see graph.h. Block by block as in Dhariwal and Nichol 2021 (guided diffusion),
 * with that project's names for the parameters. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "nn/graph.h"
#include "nn/build.h"
#include "nn/omni.h"
#include "nn/rdn.h"

#include <stdio.h>
#include <stdlib.h>

size_t ct_image_count(const struct ct_image *i)
{
	return i->h * i->w * i->c;
}

void ct_graph_free(struct ct_graph *g)
{
	free(g->image);
	free(g->op);
	free(g->param);
	*g = (struct ct_graph){0};
}

static size_t conv(
	struct ct_build *b, size_t x, size_t add, size_t p, size_t co, size_t k, size_t stride)
{
	return ct_build_convolve(b,
		(struct ct_graph_op){.a = x, .b = add, .param = p, .k = k, .stride = stride}, co);
}

static size_t linear(struct ct_build *b, const char *prefix, const char *sub, size_t x, size_t co)
{
	const size_t p = ct_build_weights(b, prefix, sub, 2, co, b->g->image[x].c, 1, false);

	return ct_build_map(b, CT_GRAPH_LINEAR, x, p, (struct ct_image){1, 1, co});
}

static size_t norm(
	struct ct_build *b, const char *prefix, const char *sub, size_t x, size_t emb, bool silu)
{
	const struct ct_image s = b->g->image[x];
	const size_t p = ct_build_gains(b, prefix, sub, s.c);

	return ct_build_op(b,
		(struct ct_graph_op){
			.kind = CT_GRAPH_NORM, .a = x, .b = emb, .param = p, .silu = silu},
		s);
}

/* -1 halves, +1 doubles. */
static size_t resample(struct ct_build *b, size_t x, int how)
{
	const struct ct_image s = b->g->image[x];

	if (how == 0)
		return x;
	if (how < 0)
		return ct_build_map(
			b, CT_GRAPH_DOWN, x, CT_NONE, (struct ct_image){s.h / 2, s.w / 2, s.c});
	return ct_build_map(b, CT_GRAPH_UP, x, CT_NONE, (struct ct_image){s.h * 2, s.w * 2, s.c});
}

/* h = conv(SiLU(norm(x))), h = conv(SiLU(norm(h; emb))), skip(x) + h; resampled if asked between
 * the first SiLU and its convolution. */
static size_t resblock(struct ct_build *b, const char *prefix, size_t x, size_t co, int how)
{
	const size_t ci = b->g->image[x].c;
	const bool ss = b->arch->use_scale_shift_norm;
	size_t h, e, second;

	h = norm(b, prefix, "in_layers.0", x, CT_NONE, true);
	h = resample(b, h, how);
	x = resample(b, x, how);
	h = ct_build_conv(b, prefix, "in_layers.2", h, CT_NONE, co, 3);
	e = linear(b, prefix, "emb_layers.1", b->emb, ss ? 2 * co : co);
	h = norm(b, prefix, "out_layers.0", h, e, true);
	second = ct_build_weights(b, prefix, "out_layers.3", 4, co, co, 3, true);
	if (ci != co)
		x = ct_build_conv(b, prefix, "skip_connection", x, CT_NONE, co, 1);
	return conv(b, h, x, second, co, 3, 1);
}

static size_t attention(struct ct_build *b, const char *prefix, size_t x)
{
	const struct ct_image s = b->g->image[x];
	size_t h, p;

	h = norm(b, prefix, "norm", x, CT_NONE, false);
	p = ct_build_weights(b, prefix, "qkv", 3, 3 * s.c, s.c, 1, false);
	h = conv(b, h, CT_NONE, p, 3 * s.c, 1, 1);
	h = ct_build_map(b, CT_GRAPH_ATTN, h, CT_NONE, s);
	p = ct_build_weights(b, prefix, "proj_out", 3, s.c, s.c, 1, true);
	return conv(b, h, x, p, s.c, 1, 1);
}

/* A change of size between levels: a residual block, or a resampling with or without a
 * convolution called `what`. */
static size_t change(struct ct_build *b, const char *prefix, const char *what, size_t x, int how)
{
	const size_t c = b->g->image[x].c;

	if (b->arch->resblock_updown)
		return resblock(b, prefix, x, c, how);
	if (how > 0 || !b->arch->conv_resample)
		x = resample(b, x, how);
	if (!b->arch->conv_resample)
		return x;
	return conv(b, x, CT_NONE, ct_build_weights(b, prefix, what, 4, c, c, 3, false), c, 3,
		how < 0 ? 2 : 1);
}

/* x plus the embedding of the class. */
static size_t label(struct ct_build *b, size_t x)
{
	const struct ct_image s = b->g->image[x];
	const size_t p = b->g->n_param;

	ct_build_param(b, "label_emb", "", "weight",
		(struct ct_param){.rank = 2, .dim = {b->arch->num_classes, s.c}, .zero = true});
	return ct_build_map(b, CT_GRAPH_LABEL, x, p, s);
}

static void time_embedding(struct ct_build *b)
{
	const size_t d = b->arch->model_channels;
	const struct ct_image s = {1, 1, 4 * d};
	size_t x = ct_build_map(b, CT_GRAPH_EMBED, CT_NONE, CT_NONE, (struct ct_image){1, 1, d});

	x = ct_build_map(b, CT_GRAPH_SILU, linear(b, "time_embed.0", "", x, 4 * d), CT_NONE, s);
	x = linear(b, "time_embed.2", "", x, 4 * d);
	if (b->arch->num_classes)
		x = label(b, x);
	b->emb = ct_build_map(b, CT_GRAPH_SILU, x, CT_NONE, s);
}

/* The way down; every entry's output goes on the stack. */
static size_t down(struct ct_build *b, size_t *stack, size_t *depth)
{
	const struct ct_unet_arch *a = b->arch;
	size_t entry = 0, x, c = ct_unet_arch_channels(a, 0);
	char prefix[48];

	x = ct_build_conv(b, "input_blocks.0.0", "", 0, CT_NONE, c, 3);
	stack[entry++] = x;
	for (size_t level = 0; level < a->levels; level++) {
		c = ct_unet_arch_channels(a, level);
		for (size_t i = 0; i < a->num_res_blocks; i++) {
			snprintf(prefix, sizeof prefix, "input_blocks.%zu.0", entry);
			x = resblock(b, prefix, x, c, 0);
			if (ct_unet_arch_attends(a, level)) {
				snprintf(prefix, sizeof prefix, "input_blocks.%zu.1", entry);
				x = attention(b, prefix, x);
			}
			stack[entry++] = x;
		}
		if (level + 1 < a->levels) {
			snprintf(prefix, sizeof prefix, "input_blocks.%zu.0", entry);
			x = change(b, prefix, "op", x, -1);
			stack[entry++] = x;
		}
	}
	*depth = entry;
	return x;
}

static size_t up(struct ct_build *b, size_t x, const size_t *stack, size_t depth)
{
	const struct ct_unet_arch *a = b->arch;
	size_t entry = 0;
	char prefix[48];

	for (size_t level = a->levels; level-- > 0;)
		for (size_t i = 0; i <= a->num_res_blocks; i++, entry++) {
			size_t sub = 0;

			x = ct_build_concat(b, x, stack[--depth]);
			snprintf(prefix, sizeof prefix, "output_blocks.%zu.%zu", entry, sub++);
			x = resblock(b, prefix, x, ct_unet_arch_channels(a, level), 0);
			if (ct_unet_arch_attends(a, level)) {
				snprintf(prefix, sizeof prefix, "output_blocks.%zu.%zu", entry,
					sub++);
				x = attention(b, prefix, x);
			}
			if (level > 0 && i == a->num_res_blocks) {
				snprintf(
					prefix, sizeof prefix, "output_blocks.%zu.%zu", entry, sub);
				x = change(b, prefix, "conv", x, +1);
			}
		}
	return x;
}

static size_t unet(struct ct_build *b)
{
	/* one entry, num_res_blocks a level and the changes between levels: within these bounds */
	size_t stack[1 + CT_UNET_LEVELS * 17] = {0}, depth = 0, x, c;
	const size_t out = b->arch->out_channels;

	time_embedding(b);
	x = down(b, stack, &depth);
	c = b->g->image[x].c;
	x = resblock(b, "middle_block.0", x, c, 0);
	x = attention(b, "middle_block.1", x);
	x = resblock(b, "middle_block.2", x, c, 0);
	x = up(b, x, stack, depth);
	c = b->g->image[x].c;
	x = norm(b, "out.0", "", x, CT_NONE, true);
	return conv(b, x, CT_NONE, ct_build_weights(b, "out.2", "", 4, out, c, 3, true), out, 3, 1);
}

int ct_graph_build(
	struct ct_graph *g, const struct ct_unet_arch *a, size_t h, size_t w, struct ct_err *e)
{
	struct ct_build b = {.g = g, .arch = a, .e = e};
	size_t unit, least;

	if (ct_unet_arch_check(a, e))
		return -1;
	unit = ct_unet_arch_multiple(a);
	least = ct_unet_arch_least(a);
	if (h % unit || w % unit || h < least || w < least || h > 65536 || w > 65536)
		return ct_fail(e, CT_EGEOM,
			"%zu x %zu: the network takes multiples of %zu from %zu to 65536", w, h,
			unit, least);
	ct_build_image(&b, (struct ct_image){h, w, a->in_channels});
	if (!b.failed)
		g->out = a->net == CT_NET_RDN    ? ct_rdn_build(&b)
			 : a->net == CT_NET_OMNI ? ct_omni_build(&b)
						 : unet(&b);
	if (b.failed)
		ct_graph_free(g);
	return b.failed ? -1 : 0;
}
