/* graph.c: see graph.h. Block by block as in Dhariwal and Nichol 2021 (guided diffusion),
 * with that project's names for the parameters. */
#include "config.h"
#include "unet/graph.h"
#include "core/mem.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What the functions below share. After a failure they do nothing, and image 0 is returned. */
struct build {
	struct ct_graph *g;
	const struct ct_unet_arch *arch;
	size_t emb; /* the embedding after its SiLU */
	struct ct_err *e;
	bool failed;
};

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

static size_t image(struct build *b, size_t h, size_t w, size_t c)
{
	struct ct_graph *g = b->g;

	if (b->failed ||
		ct_grow(&g->image, &g->cap_image, g->n_image + 1, sizeof *g->image, b->e)) {
		b->failed = true;
		return 0;
	}
	g->image[g->n_image] = (struct ct_image){h, w, c};
	return g->n_image++;
}

static size_t op(struct build *b, struct ct_graph_op o, size_t h, size_t w, size_t c)
{
	struct ct_graph *g = b->g;

	o.out = image(b, h, w, c);
	if (b->failed || ct_grow(&g->op, &g->cap_op, g->n_op + 1, sizeof *g->op, b->e)) {
		b->failed = true;
		return 0;
	}
	g->op[g->n_op++] = o;
	return o.out;
}

__attribute__((format(printf, 3, 4))) static void name(char *out, size_t size, const char *fmt, ...)
{
	va_list ap;

	va_start(ap, fmt);
	vsnprintf(out, size, fmt, ap);
	va_end(ap);
}

static void param(struct build *b, const char *prefix, const char *what, struct ct_param p)
{
	struct ct_graph *g = b->g;

	if (b->failed ||
		ct_grow(&g->param, &g->cap_param, g->n_param + 1, sizeof *g->param, b->e)) {
		b->failed = true;
		return;
	}
	name(p.name, sizeof p.name, "%s.%s", prefix, what);
	p.count = 1;
	for (size_t i = 0; i < p.rank; i++)
		p.count *= p.dim[i];
	p.offset = g->count;
	g->count += p.count;
	g->param[g->n_param++] = p;
}

/* Weight [co][ci][k][k] (as many k as rank says) and bias [co]; the index of the weight. */
static size_t weights(
	struct build *b, const char *prefix, size_t rank, size_t co, size_t ci, size_t k, bool zero)
{
	size_t first = b->g->n_param, fan = ci * k * k;

	param(b, prefix, "weight",
		(struct ct_param){
			.rank = rank, .dim = {co, ci, k, k}, .fan_in = fan, .zero = zero});
	param(b, prefix, "bias",
		(struct ct_param){.rank = 1, .dim = {co}, .fan_in = fan, .zero = zero});
	return first;
}

static size_t gains(struct build *b, const char *prefix, size_t c)
{
	size_t first = b->g->n_param;

	param(b, prefix, "weight", (struct ct_param){.rank = 1, .dim = {c}, .gamma = true});
	param(b, prefix, "bias", (struct ct_param){.rank = 1, .dim = {c}});
	return first;
}

static size_t conv(
	struct build *b, size_t x, size_t add, size_t p, size_t co, size_t k, size_t stride)
{
	const struct ct_image s = b->g->image[x];

	return op(b,
		(struct ct_graph_op){.kind = CT_GRAPH_CONV,
			.a = x,
			.b = add,
			.param = p,
			.k = k,
			.stride = stride},
		(s.h + stride - 1) / stride, (s.w + stride - 1) / stride, co);
}

static size_t linear(struct build *b, const char *prefix, size_t x, size_t co)
{
	size_t p = weights(b, prefix, 2, co, b->g->image[x].c, 1, false);

	return op(b,
		(struct ct_graph_op){.kind = CT_GRAPH_LINEAR, .a = x, .b = CT_NONE, .param = p}, 1,
		1, co);
}

static size_t norm(struct build *b, size_t x, size_t emb, size_t p, bool silu)
{
	const struct ct_image s = b->g->image[x];

	return op(b,
		(struct ct_graph_op){
			.kind = CT_GRAPH_NORM, .a = x, .b = emb, .param = p, .silu = silu},
		s.h, s.w, s.c);
}

/* -1 halves, +1 doubles. */
static size_t resample(struct build *b, size_t x, int how)
{
	const struct ct_image s = b->g->image[x];

	if (how == 0)
		return x;
	return op(b,
		(struct ct_graph_op){.kind = how < 0 ? CT_GRAPH_DOWN : CT_GRAPH_UP,
			.a = x,
			.b = CT_NONE,
			.param = CT_NONE},
		how < 0 ? s.h / 2 : s.h * 2, how < 0 ? s.w / 2 : s.w * 2, s.c);
}

/* h = conv(SiLU(norm(x))), h = conv(SiLU(norm(h; emb))), skip(x) + h; resampled if asked between
 * the first SiLU and its convolution. */
static size_t resblock(struct build *b, const char *prefix, size_t x, size_t co, int how)
{
	const size_t ci = b->g->image[x].c;
	const bool ss = b->arch->use_scale_shift_norm;
	size_t h, e, p, second;
	char sub[64];

	name(sub, sizeof sub, "%s.in_layers.0", prefix);
	h = norm(b, x, CT_NONE, gains(b, sub, ci), true);
	h = resample(b, h, how);
	x = resample(b, x, how);
	name(sub, sizeof sub, "%s.in_layers.2", prefix);
	p = weights(b, sub, 4, co, ci, 3, false);
	h = conv(b, h, CT_NONE, p, co, 3, 1);
	name(sub, sizeof sub, "%s.emb_layers.1", prefix);
	e = linear(b, sub, b->emb, ss ? 2 * co : co);
	name(sub, sizeof sub, "%s.out_layers.0", prefix);
	h = norm(b, h, e, gains(b, sub, co), true);
	name(sub, sizeof sub, "%s.out_layers.3", prefix);
	second = weights(b, sub, 4, co, co, 3, true);
	if (ci != co) {
		name(sub, sizeof sub, "%s.skip_connection", prefix);
		p = weights(b, sub, 4, co, ci, 1, false);
		x = conv(b, x, CT_NONE, p, co, 1, 1);
	}
	return conv(b, h, x, second, co, 3, 1);
}

static size_t attention(struct build *b, const char *prefix, size_t x)
{
	const struct ct_image s = b->g->image[x];
	size_t h, p;
	char sub[64];

	name(sub, sizeof sub, "%s.norm", prefix);
	h = norm(b, x, CT_NONE, gains(b, sub, s.c), false);
	name(sub, sizeof sub, "%s.qkv", prefix);
	p = weights(b, sub, 3, 3 * s.c, s.c, 1, false);
	h = conv(b, h, CT_NONE, p, 3 * s.c, 1, 1);
	h = op(b,
		(struct ct_graph_op){.kind = CT_GRAPH_ATTN,
			.a = h,
			.b = CT_NONE,
			.param = CT_NONE,
			.heads = ct_unet_arch_heads(b->arch, s.c)},
		s.h, s.w, s.c);
	name(sub, sizeof sub, "%s.proj_out", prefix);
	p = weights(b, sub, 3, s.c, s.c, 1, true);
	return conv(b, h, x, p, s.c, 1, 1);
}

/* A change of size between levels: a residual block, or a resampling with or without a
 * convolution called `what`. */
static size_t change(struct build *b, const char *prefix, const char *what, size_t x, int how)
{
	const size_t c = b->g->image[x].c;
	char sub[64];

	if (b->arch->resblock_updown)
		return resblock(b, prefix, x, c, how);
	name(sub, sizeof sub, "%s.%s", prefix, what);
	if (!b->arch->conv_resample)
		return resample(b, x, how);
	if (how < 0)
		return conv(b, x, CT_NONE, weights(b, sub, 4, c, c, 3, false), c, 3, 2);
	x = resample(b, x, how);
	return conv(b, x, CT_NONE, weights(b, sub, 4, c, c, 3, false), c, 3, 1);
}

/* x plus the embedding of the class. */
static size_t label(struct build *b, size_t x)
{
	const size_t p = b->g->n_param, c = b->g->image[x].c;

	param(b, "label_emb", "weight",
		(struct ct_param){.rank = 2, .dim = {b->arch->num_classes, c}, .zero = true});
	return op(b, (struct ct_graph_op){.kind = CT_GRAPH_LABEL, .a = x, .b = CT_NONE, .param = p},
		1, 1, c);
}

static void time_embedding(struct build *b)
{
	const size_t d = b->arch->model_channels;
	size_t x;

	x = op(b,
		(struct ct_graph_op){
			.kind = CT_GRAPH_EMBED, .a = CT_NONE, .b = CT_NONE, .param = CT_NONE},
		1, 1, d);
	for (int i = 0; i < 2; i++) {
		x = linear(b, i ? "time_embed.2" : "time_embed.0", x, 4 * d);
		if (i && b->arch->num_classes)
			x = label(b, x);
		x = op(b,
			(struct ct_graph_op){
				.kind = CT_GRAPH_SILU, .a = x, .b = CT_NONE, .param = CT_NONE},
			1, 1, 4 * d);
	}
	b->emb = x;
}

/* The way down; every entry's output goes on the stack. */
static size_t down(struct build *b, size_t *stack, size_t *depth)
{
	const struct ct_unet_arch *a = b->arch;
	size_t entry = 0, x, p, c = ct_unet_arch_channels(a, 0);
	char prefix[48];

	p = weights(b, "input_blocks.0.0", 4, c, a->in_channels, 3, false);
	x = conv(b, 0, CT_NONE, p, c, 3, 1);
	stack[entry++] = x;
	for (size_t level = 0; level < a->levels; level++) {
		c = ct_unet_arch_channels(a, level);
		for (size_t i = 0; i < a->num_res_blocks; i++) {
			name(prefix, sizeof prefix, "input_blocks.%zu.0", entry);
			x = resblock(b, prefix, x, c, 0);
			if (ct_unet_arch_attends(a, level)) {
				name(prefix, sizeof prefix, "input_blocks.%zu.1", entry);
				x = attention(b, prefix, x);
			}
			stack[entry++] = x;
		}
		if (level + 1 < a->levels) {
			name(prefix, sizeof prefix, "input_blocks.%zu.0", entry);
			x = change(b, prefix, "op", x, -1);
			stack[entry++] = x;
		}
	}
	*depth = entry;
	return x;
}

static size_t concat(struct build *b, size_t x, size_t skip)
{
	const struct ct_image s = b->g->image[x];

	return op(b,
		(struct ct_graph_op){.kind = CT_GRAPH_CONCAT, .a = x, .b = skip, .param = CT_NONE},
		s.h, s.w, s.c + b->g->image[skip].c);
}

static size_t up(struct build *b, size_t x, const size_t *stack, size_t depth)
{
	const struct ct_unet_arch *a = b->arch;
	size_t entry = 0;
	char prefix[48];

	for (size_t level = a->levels; level-- > 0;)
		for (size_t i = 0; i <= a->num_res_blocks; i++, entry++) {
			size_t sub = 0;

			x = concat(b, x, stack[--depth]);
			name(prefix, sizeof prefix, "output_blocks.%zu.%zu", entry, sub++);
			x = resblock(b, prefix, x, ct_unet_arch_channels(a, level), 0);
			if (ct_unet_arch_attends(a, level)) {
				name(prefix, sizeof prefix, "output_blocks.%zu.%zu", entry, sub++);
				x = attention(b, prefix, x);
			}
			if (level > 0 && i == a->num_res_blocks) {
				name(prefix, sizeof prefix, "output_blocks.%zu.%zu", entry, sub);
				x = change(b, prefix, "conv", x, +1);
			}
		}
	return x;
}

int ct_graph_build(
	struct ct_graph *g, const struct ct_unet_arch *a, size_t h, size_t w, struct ct_err *e)
{
	/* one entry, num_res_blocks a level and the changes between levels: within these bounds */
	size_t stack[1 + CT_UNET_LEVELS * 17] = {0}, depth = 0, x, c;
	struct build b = {.g = g, .arch = a, .e = e};
	const size_t unit = (size_t)1 << (a->levels - 1);

	if (ct_unet_arch_check(a, e))
		return -1;
	if (h == 0 || w == 0 || h % unit || w % unit)
		return ct_fail(e, CT_EGEOM,
			"the network halves its image %zu times: %zu x %zu is not a multiple of "
			"%zu",
			a->levels - 1, w, h, unit);
	if (h > 65536 || w > 65536)
		return ct_fail(e, CT_EGEOM, "an image of %zu x %zu is too large", w, h);
	image(&b, h, w, a->in_channels);
	if (b.failed)
		return -1;
	time_embedding(&b);
	x = down(&b, stack, &depth);
	x = resblock(&b, "middle_block.0", x, b.g->image[x].c, 0);
	x = attention(&b, "middle_block.1", x);
	x = resblock(&b, "middle_block.2", x, b.g->image[x].c, 0);
	x = up(&b, x, stack, depth);
	c = b.g->image[x].c;
	x = norm(&b, x, CT_NONE, gains(&b, "out.0", c), true);
	g->out = conv(&b, x, CT_NONE, weights(&b, "out.2", 4, a->out_channels, c, 3, true),
		a->out_channels, 3, 1);
	if (b.failed)
		ct_graph_free(g);
	return b.failed ? -1 : 0;
}
