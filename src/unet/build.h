/* build.h: what makes the list of operations of a network and the list of its parameters: graph.c,
 * rdn.c, omni.c.
 *
 * After a failure the functions do nothing and return image 0; the caller looks at `failed` at the
 * end. They return the image that the new operation writes, or the number of the new parameter. One
 * thread.
 */
#ifndef CT_UNET_BUILD_H
#define CT_UNET_BUILD_H
#include "unet/graph.h"

struct ct_build {
	struct ct_graph *g;
	const struct ct_unet_arch *arch;
	size_t emb; /* the embedding of the timestep after its SiLU, of a U-Net */
	struct ct_err *e;
	bool failed;
};

/* A convolution of image x, plus image `add` unless that is CT_NONE. */
struct ct_build_conv {
	size_t x, add, param, channels, k, stride;
	bool bare;   /* without a bias */
	bool inside; /* without padding */
};

size_t ct_build_image(struct ct_build *b, struct ct_image s);
/* The operation o, which writes an image of shape s. */
size_t ct_build_op(struct ct_build *b, struct ct_graph_op o, struct ct_image s);
/* One that reads x alone and has no parameters. */
size_t ct_build_map(struct ct_build *b, enum ct_graph_kind kind, size_t x, struct ct_image s);
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
size_t ct_build_convolve(struct ct_build *b, struct ct_build_conv c);
/* Channels of x, then of y. */
size_t ct_build_concat(struct ct_build *b, size_t x, size_t y);

#endif
