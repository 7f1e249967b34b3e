/* plan-impl.h: what plan.c, which places the images of a plan, and plan-run.c, which runs it,
 * share.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_NN_PLAN_IMPL_H
#define CT_NN_PLAN_IMPL_H
#include "nn/conv.h"
#include "nn/norm.h"
#include "nn/unet.h"
#include "nn/window-attention.h"

/* How the gradient of one operation goes to its inputs. */
struct ct_plan_flow {
	bool acc_a, acc_b; /* another reader has written there already: add */
	bool moved;        /* the gradient of b is the place of the gradient of out */
	size_t tmp;        /* place for a gradient that is then added */
};

struct ct_unet_plan {
	struct ct_unet *net;
	struct ct_graph g;
	bool train;
	struct ct_conv **conv; /* [n_op] */
	size_t *at, acts;      /* place of every image; floats of all */
	size_t *sum_at, sums;  /* place of a normalisation's sums; doubles of all */
	size_t *grad_at, grads;
	struct ct_plan_flow *flow; /* [n_op] */
	float *act, *grad, *scratch;
	double *sum;
	size_t scratch_count;
	float *none; /* [2][wide]: zeros for a bias that there is none of; its gradient */
	size_t wide;
};

/* What an operation reads; the embedding reads no image. */
static inline struct ct_image ct_plan_input(
	const struct ct_unet_plan *p, const struct ct_graph_op *o)
{
	return p->g.image[o->a == CT_NONE ? o->out : o->a];
}

static inline struct ct_window ct_plan_window(
	const struct ct_unet_plan *p, const struct ct_graph_op *o)
{
	const struct ct_image s = p->g.image[o->out];
	const struct ct_unet_arch *a = &p->net->arch;

	return (struct ct_window){
		o->channels, o->spread, s.h, s.w, a->window, a->num_heads, s.c / a->num_heads};
}

#endif
