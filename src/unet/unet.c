/* unet.c: the weights of the network, by name and flat; see unet.h. */
#include "config.h"
#include "unet/unet.h"
#include "core/mem.h"
#include "core/rng.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The smallest image that the network takes: enough to list its parameters. */
static int list_parameters(struct ct_graph *g, const struct ct_unet_arch *a, struct ct_err *e)
{
	size_t least;

	if (ct_unet_arch_check(a, e))
		return -1;
	least = ct_unet_arch_least(a);
	return ct_graph_build(g, a, least, least, e);
}

int ct_unet_param_count(const struct ct_unet_arch *a, size_t *n, struct ct_err *e)
{
	struct ct_graph g = {0};

	if (list_parameters(&g, a, e))
		return -1;
	*n = g.count;
	ct_graph_free(&g);
	return 0;
}

int ct_unet_flops(const struct ct_unet_arch *a, size_t h, size_t w, double *flops, struct ct_err *e)
{
	struct ct_graph g = {0};

	if (ct_graph_build(&g, a, h, w, e))
		return -1;
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

static void shape_text(char *text, size_t size, size_t rank, const size_t *dim)
{
	size_t used = (size_t)snprintf(text, size, "[");

	for (size_t i = 0; i < rank && used < size; i++)
		used += (size_t)snprintf(text + used, size - used, "%s%zu", i ? "," : "", dim[i]);
	if (used < size)
		snprintf(text + used, size - used, "]");
}

static int check_tensor(const struct ct_param *p, const struct ct_tensor *t, struct ct_err *e)
{
	char want[100], got[100];

	shape_text(want, sizeof want, p->rank, p->dim);
	if (!t)
		return ct_fail(e, CT_EINPUT, "no tensor %s %s: a prior of another architecture",
			p->name, want);
	if (t->rank == p->rank && memcmp(t->dim, p->dim, p->rank * sizeof *p->dim) == 0)
		return 0;
	shape_text(got, sizeof got, t->rank, t->dim);
	return ct_fail(e, CT_EINPUT,
		"tensor %s is %s where the architecture of the metadata has %s", p->name, got,
		want);
}

/* The tensor of a parameter: its shape and its numbers are right. CT_EINPUT, CT_ENUMERIC. */
static int find_tensor(struct ct_tensor **t, const struct ct_param *p, const struct ct_tensors *w,
	struct ct_err *e)
{
	*t = ct_tensors_find(w, p->name);
	if (check_tensor(p, *t, e))
		return -1;
	for (size_t k = 0; k < p->count; k++)
		if (!isfinite((*t)->data[k]))
			return ct_fail(e, CT_ENUMERIC, "tensor %s: value %zu is %g", p->name, k,
				(double)(*t)->data[k]);
	return 0;
}

/* Without weights. */
static int unet_new(struct ct_unet **out, const struct ct_unet_arch *a, struct ct_err *e)
{
	struct ct_unet *n;

	if (ct_alloc0(&n, 1, sizeof *n, e))
		return -1;
	n->arch = *a;
	if (list_parameters(&n->graph, a, e) || ct_dnn_alloc(&n->dnn, e) ||
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
	for (size_t i = 0; i < n->graph.n_param; i++)
		if (find_tensor(&t, &n->graph.param[i], w, e)) {
			ct_unet_free(n);
			return -1;
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

int ct_unet_changed(struct ct_unet *n, struct ct_par *par, struct ct_err *e)
{
	assert(n->param);
	return ct_dnn_refresh(n->dnn, par, e);
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
