/* graph.c: see graph.h. Block by block as in Dhariwal and Nichol 2021 (guided diffusion),
 * with that project's names for the parameters. */
#include "config.h"
#include "unet/graph.h"
#include "core/mem.h"

#include <stdio.h>
#include <stdlib.h>

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

/* Room for one more of a list; false after a failure. */
static bool room(struct build *b, void *list, size_t *cap, size_t n, size_t size)
{
	b->failed = b->failed || ct_grow(list, cap, n + 1, size, b->e);
	return !b->failed;
}

static size_t image(struct build *b, struct ct_image s)
{
	struct ct_graph *g = b->g;

	if (!room(b, &g->image, &g->cap_image, g->n_image, sizeof *g->image))
		return 0;
	g->image[g->n_image] = s;
	return g->n_image++;
}

static size_t op(struct build *b, struct ct_graph_op o, struct ct_image s)
{
	struct ct_graph *g = b->g;

	o.out = image(b, s);
	if (!room(b, &g->op, &g->cap_op, g->n_op, sizeof *g->op))
		return 0;
	g->op[g->n_op++] = o;
	return o.out;
}

/* One that reads x alone and has no parameters. */
static size_t map(struct build *b, enum ct_graph_kind kind, size_t x, struct ct_image s)
{
	return op(b, (struct ct_graph_op){.kind = kind, .a = x, .b = CT_NONE, .param = CT_NONE}, s);
}

/* The parameter PREFIX.SUB.WHAT, or PREFIX.WHAT if sub is "". */
static void param(
	struct build *b, const char *prefix, const char *sub, const char *what, struct ct_param p)
{
	struct ct_graph *g = b->g;

	if (!room(b, &g->param, &g->cap_param, g->n_param, sizeof *g->param))
		return;
	snprintf(p.name, sizeof p.name, "%s%s%s.%s", prefix, *sub ? "." : "", sub, what);
	p.count = 1;
	for (size_t i = 0; i < p.rank; i++)
		p.count *= p.dim[i];
	p.offset = g->count;
	g->count += p.count;
	g->param[g->n_param++] = p;
}

/* Weight [co][ci][k][k] (as many k as rank says) and bias [co]; the index of the weight. */
static size_t weights(struct build *b, const char *prefix, const char *sub, size_t rank, size_t co,
	size_t ci, size_t k, bool zero)
{
	const size_t first = b->g->n_param;
	struct ct_param p = {
		.rank = rank, .dim = {co, ci, k, k}, .fan_in = ci * k * k, .zero = zero};

	param(b, prefix, sub, "weight", p);
	p.rank = 1;
	param(b, prefix, sub, "bias", p);
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
		(struct ct_image){(s.h + stride - 1) / stride, (s.w + stride - 1) / stride, co});
}

static size_t linear(struct build *b, const char *prefix, const char *sub, size_t x, size_t co)
{
	const size_t p = weights(b, prefix, sub, 2, co, b->g->image[x].c, 1, false);

	return op(b,
		(struct ct_graph_op){.kind = CT_GRAPH_LINEAR, .a = x, .b = CT_NONE, .param = p},
		(struct ct_image){1, 1, co});
}

static size_t norm(
	struct build *b, const char *prefix, const char *sub, size_t x, size_t emb, bool silu)
{
	const struct ct_image s = b->g->image[x];
	const size_t p = b->g->n_param;

	param(b, prefix, sub, "weight", (struct ct_param){.rank = 1, .dim = {s.c}, .gamma = true});
	param(b, prefix, sub, "bias", (struct ct_param){.rank = 1, .dim = {s.c}});
	return op(b,
		(struct ct_graph_op){
			.kind = CT_GRAPH_NORM, .a = x, .b = emb, .param = p, .silu = silu},
		s);
}

/* -1 halves, +1 doubles. */
static size_t resample(struct build *b, size_t x, int how)
{
	const struct ct_image s = b->g->image[x];

	if (how == 0)
		return x;
	return how < 0 ? map(b, CT_GRAPH_DOWN, x, (struct ct_image){s.h / 2, s.w / 2, s.c})
		       : map(b, CT_GRAPH_UP, x, (struct ct_image){s.h * 2, s.w * 2, s.c});
}

/* h = conv(SiLU(norm(x))), h = conv(SiLU(norm(h; emb))), skip(x) + h; resampled if asked between
 * the first SiLU and its convolution. */
static size_t resblock(struct build *b, const char *prefix, size_t x, size_t co, int how)
{
	const size_t ci = b->g->image[x].c;
	const bool ss = b->arch->use_scale_shift_norm;
	size_t h, e, p, second;

	h = norm(b, prefix, "in_layers.0", x, CT_NONE, true);
	h = resample(b, h, how);
	x = resample(b, x, how);
	p = weights(b, prefix, "in_layers.2", 4, co, ci, 3, false);
	h = conv(b, h, CT_NONE, p, co, 3, 1);
	e = linear(b, prefix, "emb_layers.1", b->emb, ss ? 2 * co : co);
	h = norm(b, prefix, "out_layers.0", h, e, true);
	second = weights(b, prefix, "out_layers.3", 4, co, co, 3, true);
	if (ci != co) {
		p = weights(b, prefix, "skip_connection", 4, co, ci, 1, false);
		x = conv(b, x, CT_NONE, p, co, 1, 1);
	}
	return conv(b, h, x, second, co, 3, 1);
}

static size_t attention(struct build *b, const char *prefix, size_t x)
{
	const struct ct_image s = b->g->image[x];
	const size_t heads = ct_unet_arch_heads(b->arch, s.c);
	size_t h, p;

	h = norm(b, prefix, "norm", x, CT_NONE, false);
	p = weights(b, prefix, "qkv", 3, 3 * s.c, s.c, 1, false);
	h = conv(b, h, CT_NONE, p, 3 * s.c, 1, 1);
	h = op(b,
		(struct ct_graph_op){.kind = CT_GRAPH_ATTN,
			.a = h,
			.b = CT_NONE,
			.param = CT_NONE,
			.heads = heads},
		s);
	p = weights(b, prefix, "proj_out", 3, s.c, s.c, 1, true);
	return conv(b, h, x, p, s.c, 1, 1);
}

/* A change of size between levels: a residual block, or a resampling with or without a
 * convolution called `what`. */
static size_t change(struct build *b, const char *prefix, const char *what, size_t x, int how)
{
	const size_t c = b->g->image[x].c;

	if (b->arch->resblock_updown)
		return resblock(b, prefix, x, c, how);
	if (how > 0 || !b->arch->conv_resample)
		x = resample(b, x, how);
	if (!b->arch->conv_resample)
		return x;
	return conv(
		b, x, CT_NONE, weights(b, prefix, what, 4, c, c, 3, false), c, 3, how < 0 ? 2 : 1);
}

/* x plus the embedding of the class. */
static size_t label(struct build *b, size_t x)
{
	const struct ct_image s = b->g->image[x];
	const size_t p = b->g->n_param;

	param(b, "label_emb", "", "weight",
		(struct ct_param){.rank = 2, .dim = {b->arch->num_classes, s.c}, .zero = true});
	return op(b, (struct ct_graph_op){.kind = CT_GRAPH_LABEL, .a = x, .b = CT_NONE, .param = p},
		s);
}

static void time_embedding(struct build *b)
{
	const size_t d = b->arch->model_channels;
	const struct ct_image s = {1, 1, 4 * d};
	size_t x = map(b, CT_GRAPH_EMBED, CT_NONE, (struct ct_image){1, 1, d});

	x = map(b, CT_GRAPH_SILU, linear(b, "time_embed.0", "", x, 4 * d), s);
	x = linear(b, "time_embed.2", "", x, 4 * d);
	if (b->arch->num_classes)
		x = label(b, x);
	b->emb = map(b, CT_GRAPH_SILU, x, s);
}

/* The way down; every entry's output goes on the stack. */
static size_t down(struct build *b, size_t *stack, size_t *depth)
{
	const struct ct_unet_arch *a = b->arch;
	size_t entry = 0, x, p, c = ct_unet_arch_channels(a, 0);
	char prefix[48];

	p = weights(b, "input_blocks.0.0", "", 4, c, a->in_channels, 3, false);
	x = conv(b, 0, CT_NONE, p, c, 3, 1);
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

static size_t concat(struct build *b, size_t x, size_t skip)
{
	struct ct_image s = b->g->image[x];

	s.c += b->g->image[skip].c;
	return op(b,
		(struct ct_graph_op){.kind = CT_GRAPH_CONCAT, .a = x, .b = skip, .param = CT_NONE},
		s);
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
	image(&b, (struct ct_image){h, w, a->in_channels});
	if (b.failed)
		return -1;
	time_embedding(&b);
	x = down(&b, stack, &depth);
	x = resblock(&b, "middle_block.0", x, b.g->image[x].c, 0);
	x = attention(&b, "middle_block.1", x);
	x = resblock(&b, "middle_block.2", x, b.g->image[x].c, 0);
	x = up(&b, x, stack, depth);
	c = b.g->image[x].c;
	x = norm(&b, "out.0", "", x, CT_NONE, true);
	g->out = conv(&b, x, CT_NONE, weights(&b, "out.2", "", 4, a->out_channels, c, 3, true),
		a->out_channels, 3, 1);
	if (b.failed)
		ct_graph_free(g);
	return b.failed ? -1 : 0;
}
