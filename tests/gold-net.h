/* gold-net.h: the networks of tests/gold. Their weights are drawn, not kept: the public program was
 * given the same ones (`tests/t-unet NAME FILE` writes them), and what it made of an image is in
 * the file. SPDX-License-Identifier: Apache-2.0 */
#ifndef GOLD_NET_H
#define GOLD_NET_H
#include "core/rng.h"
#include "formats/format.h"
#include "nn/unet.h"
#include "tap.h"

#include <stdlib.h>

static void gold_read(struct ct_tensors *w, const char *name)
{
	const char *srcdir = getenv("srcdir");
	char path[4096];

	snprintf(path, sizeof path, "%s/tests/gold/%s.safetensors", srcdir ? srcdir : ".", name);
	must(ct_tensors_read(path, w, &err));
}

/* *w, zero <- the weights of a network of this architecture: PyTorch's defaults, moved, so that
 * none is zero. */
static void gold_weights(struct ct_tensors *w, const struct ct_tensors *gold)
{
	struct ct_unet_arch a;
	struct ct_unet *n = NULL;

	must(ct_unet_arch_of(&a, gold, &err));
	must(ct_unet_init(&n, &a, 1, &err));
	for (size_t i = 0; i < n->graph.count; i++)
		n->param[i] += 0.05f * ct_rng_normal(2, 0, i);
	must(ct_unet_tensors(n, n->param, w, &err));
	ct_unet_free(n);
}
#endif
