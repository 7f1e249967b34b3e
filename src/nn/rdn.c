/* rdn.c: see rdn.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "nn/rdn.h"

#include <stdio.h>

static size_t dense_block(struct ct_build *b, size_t block, size_t x)
{
	const size_t first = x;
	char name[64];

	for (size_t i = 0; i < b->arch->layers; i++) {
		size_t y;

		snprintf(name, sizeof name, "RDBs.%zu.convs.%zu.conv.0", block, i);
		y = ct_build_conv(b, name, "", x, CT_NONE, b->arch->growth, 3);
		y = ct_build_pointwise(b, CT_POINTWISE_RELU, y);
		x = ct_build_concat(b, x, y);
	}
	snprintf(name, sizeof name, "RDBs.%zu.LFF", block);
	return ct_build_conv(b, name, "", x, first, b->arch->features, 1);
}

/* The pixel shuffles, then the picture. */
static size_t enlarge(struct ct_build *b, size_t x)
{
	size_t rest = b->arch->factor, at = 0;
	char name[32];

	for (size_t r = 2; rest > 1; r++)
		for (; rest % r == 0; rest /= r, at += 2) {
			snprintf(name, sizeof name, "UPNet.%zu", at);
			x = ct_build_conv(b, name, "", x, CT_NONE, b->arch->growth * r * r, 3);
			x = ct_build_shuffle(b, x, r);
		}
	snprintf(name, sizeof name, "UPNet.%zu", at);
	return ct_build_conv(b, name, "", x, CT_NONE, b->arch->out_channels, 3);
}

size_t ct_rdn_build(struct ct_build *b)
{
	const size_t c = b->arch->features;
	const size_t first = ct_build_conv(b, "SFENet1", "", 0, CT_NONE, c, 3);
	size_t x = ct_build_conv(b, "SFENet2", "", first, CT_NONE, c, 3), all = CT_NONE;

	for (size_t i = 0; i < b->arch->blocks && !b->failed; i++) {
		x = dense_block(b, i, x);
		all = i ? ct_build_concat(b, all, x) : x;
	}
	x = ct_build_conv(b, "GFF.0", "", all, CT_NONE, c, 1);
	return enlarge(b, ct_build_conv(b, "GFF.1", "", x, first, c, 3));
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
