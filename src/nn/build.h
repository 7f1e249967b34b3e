/* build.h: what makes the list of operations of a network and the list of its parameters: graph.c,
 * rdn.c, omni.c.
 *
 * After a failure the functions do nothing and return image 0; the caller looks at `failed` at the
 * end. They return the image that the new operation writes, or the number of the new parameter. One
 * thread.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_NN_BUILD_H
#define CT_NN_BUILD_H
#include "nn/graph.h"

struct ct_build {
	struct ct_graph *g;
	const struct ct_unet_arch *arch;
	size_t emb; /* the embedding of the timestep after its SiLU, of a U-Net */
	struct ct_err *e;
	bool failed;
};

size_t ct_build_image(struct ct_build *b, struct ct_image s);
/* The operation o, which writes an image of shape s. */
size_t ct_build_op(struct ct_build *b, struct ct_graph_op o, struct ct_image s);
/* One that reads x alone, and has the parameters from `param` on or CT_NONE. */
size_t ct_build_map(
	struct ct_build *b, enum ct_graph_kind kind, size_t x, size_t param, struct ct_image s);
size_t ct_build_pointwise(struct ct_build *b, enum ct_pointwise f, size_t x);
/* The parameter PREFIX.SUB.WHAT, or PREFIX.WHAT if sub is "". */
void ct_build_param(struct ct_build *b, const char *prefix, const char *sub, const char *what,
	struct ct_param p);
/* Weight [co][ci][k][k] (as many k as rank says) and bias [co]; the number of the weight. */
size_t ct_build_weights(struct ct_build *b, const char *prefix, const char *sub, size_t rank,
	size_t co, size_t ci, size_t k, bool zero);
/* The weight alone. */
size_t ct_build_weight(struct ct_build *b, const char *prefix, const char *sub, size_t rank,
	size_t co, size_t ci, size_t k);
/* Gamma [c], ones, and beta [c], zeros. */
size_t ct_build_gains(struct ct_build *b, const char *prefix, const char *sub, size_t c);
/* The convolution o, of its a, b or CT_NONE, param, k and stride, to so many channels. */
size_t ct_build_convolve(struct ct_build *b, struct ct_graph_op o, size_t channels);
/* k x k of image x with a weight and a bias of its own, plus image `add` unless that is CT_NONE. */
size_t ct_build_conv(struct ct_build *b, const char *prefix, const char *sub, size_t x, size_t add,
	size_t channels, size_t k);
/* r x r pixels of every r r channels. */
size_t ct_build_shuffle(struct ct_build *b, size_t x, size_t r);
/* Channels of x, then of y. */
size_t ct_build_concat(struct ct_build *b, size_t x, size_t y);

#endif
