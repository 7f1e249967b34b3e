/* rdn.c: see rdn.h. */
#include "config.h"
#include "unet/rdn.h"

#include <stdio.h>

static size_t conv3(struct ct_build *b, const char *name, size_t x, size_t channels)
{
	const size_t p = ct_build_weights(b, name, "", 4, channels, b->g->image[x].c, 3, false);

	return ct_build_convolve(b, (struct ct_build_conv){.x = x,
					    .add = CT_NONE,
					    .param = p,
					    .channels = channels,
					    .k = 3,
					    .stride = 1});
}

/* 1 x 1 to the features, plus `add`. */
static size_t fuse(struct ct_build *b, const char *name, size_t x, size_t add)
{
	const size_t c = b->arch->features;
	const size_t p = ct_build_weights(b, name, "", 4, c, b->g->image[x].c, 1, false);

	return ct_build_convolve(
		b, (struct ct_build_conv){
			   .x = x, .add = add, .param = p, .channels = c, .k = 1, .stride = 1});
}

static size_t dense_block(struct ct_build *b, size_t block, size_t x)
{
	const size_t first = x;
	char name[64];

	for (size_t i = 0; i < b->arch->layers; i++) {
		size_t y;

		snprintf(name, sizeof name, "RDBs.%zu.convs.%zu.conv.0", block, i);
		y = conv3(b, name, x, b->arch->growth);
		y = ct_build_map(b, CT_GRAPH_RELU, y, b->g->image[y]);
		x = ct_build_concat(b, x, y);
	}
	snprintf(name, sizeof name, "RDBs.%zu.LFF", block);
	return fuse(b, name, x, first);
}

/* The pixel shuffles, then the picture. */
static size_t enlarge(struct ct_build *b, size_t x)
{
	size_t rest = b->arch->factor, at = 0;
	char name[32];

	for (size_t r = 2; rest > 1; r++)
		while (rest % r == 0) {
			struct ct_image s;

			snprintf(name, sizeof name, "UPNet.%zu", at);
			x = conv3(b, name, x, b->arch->growth * r * r);
			s = b->g->image[x];
			x = ct_build_op(b,
				(struct ct_graph_op){.kind = CT_GRAPH_SHUFFLE,
					.a = x,
					.b = CT_NONE,
					.param = CT_NONE,
					.k = r},
				(struct ct_image){s.h * r, s.w * r, s.c / (r * r)});
			rest /= r;
			at += 2;
		}
	snprintf(name, sizeof name, "UPNet.%zu", at);
	return conv3(b, name, x, b->arch->out_channels);
}

size_t ct_rdn_build(struct ct_build *b)
{
	const size_t c = b->arch->features, first = conv3(b, "SFENet1", 0, c);
	size_t x = conv3(b, "SFENet2", first, c), all = CT_NONE;
	size_t p;

	for (size_t i = 0; i < b->arch->blocks && !b->failed; i++) {
		x = dense_block(b, i, x);
		all = i ? ct_build_concat(b, all, x) : x;
	}
	x = fuse(b, "GFF.0", all, CT_NONE);
	p = ct_build_weights(b, "GFF.1", "", 4, c, c, 3, false);
	x = ct_build_convolve(
		b, (struct ct_build_conv){
			   .x = x, .add = first, .param = p, .channels = c, .k = 3, .stride = 1});
	return enlarge(b, x);
}

bool ct_rdn_of(struct ct_unet_arch *a, const struct ct_tensors *w)
{
	size_t at = 0, next;

	a->features = ct_tensors_dim(w, 0, "SFENet1.weight");
	a->in_channels = ct_tensors_dim(w, 1, "SFENet1.weight");
	a->growth = ct_tensors_dim(w, 0, "RDBs.0.convs.0.conv.0.weight");
	if (!a->features || !a->growth)
		return false;
	a->net = CT_NET_RDN;
	a->blocks = a->layers = 0;
	while (ct_tensors_dim(w, 0, "RDBs.%zu.LFF.weight", a->blocks))
		a->blocks++;
	while (ct_tensors_dim(w, 0, "RDBs.0.convs.%zu.conv.0.weight", a->layers))
		a->layers++;
	a->factor = 1;
	for (;; at += 2) {
		const size_t c = ct_tensors_dim(w, 0, "UPNet.%zu.weight", at);
		size_t r = 1;

		next = ct_tensors_dim(w, 0, "UPNet.%zu.weight", at + 2);
		if (!next) {
			a->out_channels = c;
			return true;
		}
		while (r <= CT_NET_FACTOR && a->growth * r * r < c)
			r++;
		a->factor *= r;
		if (a->factor > CT_NET_FACTOR)
			return true; /* ct_unet_arch_check refuses it */
	}
}
