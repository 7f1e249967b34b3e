/* unet.c: the weights of the network, by name and flat; see unet.h.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "nn/unet.h"
#include "core/mem.h"
#include "core/rng.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

int ct_unet_size(const struct ct_unet_arch *a, size_t h, size_t w, size_t *parameters,
	double *flops, struct ct_err *e)
{
	struct ct_graph g = {0};

	if (ct_graph_build(&g, a, h, w, e))
		return -1;
	*parameters = g.count;
	*flops = 0;
	for (size_t i = 0; i < g.n_op; i++) {
		const struct ct_graph_op *o = &g.op[i];
		const struct ct_image *out = &g.image[o->out];
		double n = (double)out->h * (double)out->w;

		if (o->kind == CT_GRAPH_CONV || o->kind == CT_GRAPH_LINEAR ||
			o->kind == CT_GRAPH_DEPTH)
			*flops += 2 * n * (double)g.param[o->param].count;
		if (o->kind == CT_GRAPH_ATTN)
			*flops += 4 * n * n * (double)out->c;
		if (o->kind == CT_GRAPH_WINDOW) {
			const size_t of =
				o->channels ? out->c / a->num_heads : a->window * a->window;

			*flops += 4 * n * (double)(of * out->c);
		}
	}
	ct_graph_free(&g);
	return 0;
}

/* Without weights. */
static int unet_new(struct ct_unet **out, const struct ct_unet_arch *a, struct ct_err *e)
{
	struct ct_unet *n;
	size_t least;

	if (ct_unet_arch_check(a, e) || ct_alloc0(&n, 1, sizeof *n, e))
		return -1;
	n->arch = *a;
	least = ct_unet_arch_least(a); /* any image tells the parameters */
	if (ct_graph_build(&n->graph, a, least, least, e) || ct_dnn_alloc(&n->dnn, e) ||
		ct_alloc0(&n->at, n->graph.n_param, sizeof(float *), e)) {
		ct_unet_free(n);
		return -1;
	}
	*out = n;
	return 0;
}

int ct_unet_alloc(struct ct_unet **out, struct ct_tensors *w, struct ct_err *e)
{
	struct ct_unet_arch a;
	struct ct_tensor *t;
	struct ct_unet *n;

	if (ct_unet_arch_of(&a, w, e))
		return -1;
	if (a.net == CT_NET_UNET && a.num_classes == 0 && ct_tensors_find(w, "label_emb.weight"))
		return ct_fail(e, CT_EINPUT,
			"tensor label_emb.weight: the architecture of the metadata has no classes");
	if (unet_new(&n, &a, e))
		return -1;
	for (size_t i = 0; i < n->graph.n_param; i++) {
		const struct ct_param *p = &n->graph.param[i];

		if (!ct_tensors_need(w, p->name, p->rank, p->dim, e)) {
			ct_unet_free(n);
			return -1;
		}
	}
	for (size_t i = 0; i < n->graph.n_param; i++) {
		t = ct_tensors_find(w, n->graph.param[i].name);
		n->at[i] = t->data;
		t->data = NULL;
	}
	*out = n;
	return 0;
}

int ct_unet_init(
	struct ct_unet **out, const struct ct_unet_arch *a, uint64_t seed, struct ct_err *e)
{
	struct ct_unet *n;

	if (unet_new(&n, a, e))
		return -1;
	if (ct_alloc(&n->param, n->graph.count, sizeof *n->param, e)) {
		ct_unet_free(n);
		return -1;
	}
	for (size_t i = 0; i < n->graph.n_param; i++) {
		const struct ct_param *p = &n->graph.param[i];
		double bound = p->fan_in && !p->zero ? 1.0 / sqrt((double)p->fan_in) : 0.0;

		n->at[i] = n->param + p->offset;
		for (size_t k = 0; k < p->count; k++)
			n->at[i][k] =
				p->gamma ? 1.0f
				: bound == 0.0
					? 0.0f
					: (float)(bound * (2 * ct_rng_uniform(seed, i, k) - 1));
	}
	*out = n;
	return 0;
}

void ct_unet_free(struct ct_unet *n)
{
	if (!n)
		return;
	for (size_t i = 0; n->at && !n->param && i < n->graph.n_param; i++)
		free(n->at[i]);
	ct_dnn_free(n->dnn);
	ct_graph_free(&n->graph);
	free(n->at);
	free(n->param);
	free(n);
}

void ct_unet_changed(struct ct_unet *n, struct ct_par *par)
{
	assert(n->param);
	ct_dnn_refresh(n->dnn, par);
}

int ct_unet_tensors(
	const struct ct_unet *n, const float *flat, struct ct_tensors *w, struct ct_err *e)
{
	if (ct_unet_arch_to_meta(&n->arch, &w->meta, e))
		return -1;
	for (size_t i = 0; i < n->graph.n_param; i++) {
		const struct ct_param *p = &n->graph.param[i];

		if (ct_tensors_put(w, p->name, p->rank, p->dim, flat + p->offset, e))
			return -1;
	}
	return 0;
}
