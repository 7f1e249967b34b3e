/* build.c: see build.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "nn/build.h"
#include "core/mem.h"

#include <stdio.h>

/* Room for one more of a list; false after a failure. */
static bool room(struct ct_build *b, void *list, size_t *cap, size_t n, size_t size)
{
	b->failed = b->failed || ct_grow(list, cap, n + 1, size, b->e);
	return !b->failed;
}

size_t ct_build_image(struct ct_build *b, struct ct_image s)
{
	struct ct_graph *g = b->g;

	if (!room(b, &g->image, &g->cap_image, g->n_image, sizeof *g->image))
		return 0;
	g->image[g->n_image] = s;
	return g->n_image++;
}

size_t ct_build_op(struct ct_build *b, struct ct_graph_op o, struct ct_image s)
{
	struct ct_graph *g = b->g;

	o.out = ct_build_image(b, s);
	if (!room(b, &g->op, &g->cap_op, g->n_op, sizeof *g->op))
		return 0;
	g->op[g->n_op++] = o;
	return o.out;
}

size_t ct_build_map(
	struct ct_build *b, enum ct_graph_kind kind, size_t x, size_t param, struct ct_image s)
{
	return ct_build_op(
		b, (struct ct_graph_op){.kind = kind, .a = x, .b = CT_NONE, .param = param}, s);
}

size_t ct_build_pointwise(struct ct_build *b, enum ct_pointwise f, size_t x)
{
	const struct ct_graph_op o = {
		.kind = CT_GRAPH_POINTWISE, .a = x, .b = CT_NONE, .param = CT_NONE, .f = f};

	return ct_build_op(b, o, b->g->image[x]);
}

void ct_build_param(struct ct_build *b, const char *prefix, const char *sub, const char *what,
	struct ct_param p)
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

size_t ct_build_weights(struct ct_build *b, const char *prefix, const char *sub, size_t rank,
	size_t co, size_t ci, size_t k, bool zero)
{
	const size_t first = b->g->n_param;
	struct ct_param p = {
		.rank = rank, .dim = {co, ci, k, k}, .fan_in = ci * k * k, .zero = zero};

	ct_build_param(b, prefix, sub, "weight", p);
	p.rank = 1;
	ct_build_param(b, prefix, sub, "bias", p);
	return first;
}

size_t ct_build_weight(struct ct_build *b, const char *prefix, const char *sub, size_t rank,
	size_t co, size_t ci, size_t k)
{
	ct_build_param(b, prefix, sub, "weight",
		(struct ct_param){.rank = rank, .dim = {co, ci, k, k}, .fan_in = ci * k * k});
	return b->g->n_param - 1;
}

size_t ct_build_gains(struct ct_build *b, const char *prefix, const char *sub, size_t c)
{
	const size_t first = b->g->n_param;

	ct_build_param(
		b, prefix, sub, "weight", (struct ct_param){.rank = 1, .dim = {c}, .gamma = true});
	ct_build_param(b, prefix, sub, "bias", (struct ct_param){.rank = 1, .dim = {c}});
	return first;
}

/* Pixels of a line of n after the convolution. */
static size_t line(const struct ct_graph_op *o, size_t n)
{
	return o->inside ? (n - o->k) / o->stride + 1 : (n + o->stride - 1) / o->stride;
}

size_t ct_build_convolve(struct ct_build *b, struct ct_graph_op o, size_t channels)
{
	const struct ct_image s = b->g->image[o.a];

	o.kind = CT_GRAPH_CONV;
	return ct_build_op(b, o, (struct ct_image){line(&o, s.h), line(&o, s.w), channels});
}

size_t ct_build_conv(struct ct_build *b, const char *prefix, const char *sub, size_t x, size_t add,
	size_t channels, size_t k)
{
	const size_t ci = b->g->image[x].c;
	const size_t p = ct_build_weights(b, prefix, sub, 4, channels, ci, k, false);

	return ct_build_convolve(b,
		(struct ct_graph_op){.a = x, .b = add, .param = p, .k = k, .stride = 1}, channels);
}

size_t ct_build_shuffle(struct ct_build *b, size_t x, size_t r)
{
	const struct ct_image s = b->g->image[x];

	return ct_build_map(b, CT_GRAPH_SHUFFLE, x, CT_NONE,
		(struct ct_image){s.h * r, s.w * r, s.c / (r * r)});
}

size_t ct_build_concat(struct ct_build *b, size_t x, size_t y)
{
	struct ct_image s = b->g->image[x];

	s.c += b->g->image[y].c;
	return ct_build_op(b,
		(struct ct_graph_op){.kind = CT_GRAPH_CONCAT, .a = x, .b = y, .param = CT_NONE}, s);
}
