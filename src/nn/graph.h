/* graph.h: a network as a list of operations on images, and the list of its parameters.
 *
 * Operations are in the order of the forward pass; each writes one image that is read by later
 * ones. Parameters are in the order of the authors' state dictionary, so offset[] is also
 * the order of a flat vector of weights, gradients or moments.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_NN_GRAPH_H
#define CT_NN_GRAPH_H
#include "nn/arch.h"
#include "nn/pointwise.h"

#define CT_NONE ((size_t)-1)

enum ct_graph_kind {
	CT_GRAPH_EMBED,  /* sinusoids of the timestep */
	CT_GRAPH_LINEAR, /* a: vector; param: weight, bias */
	CT_GRAPH_SILU,
	CT_GRAPH_LABEL,  /* a, plus the row of param that the class says */
	CT_GRAPH_CONV,   /* a, plus b if there is one; param: weight, bias */
	CT_GRAPH_NORM,   /* a, with the embedding b if there is one; param: gamma, beta */
	CT_GRAPH_UP,     /* nearest, twice the size */
	CT_GRAPH_DOWN,   /* mean of 2 x 2 */
	CT_GRAPH_CONCAT, /* channels of a, then of b */
	CT_GRAPH_ATTN,   /* a: qkv */
	/* those of networks of super-resolution */
	CT_GRAPH_POINTWISE, /* f of every value */
	CT_GRAPH_GATE,      /* GELU of the first half of a's channels, times the second */
	CT_GRAPH_TIMES,     /* a times b, which has one pixel or as many as a */
	CT_GRAPH_SHUFFLE,   /* r x r pixels of every r r channels */
	CT_GRAPH_DEPTH,     /* 3 x 3, every channel alone; param: weight, bias */
	CT_GRAPH_LAYER,     /* normalised over the channels of a pixel; param: gamma, beta */
	CT_GRAPH_MEAN,      /* of all pixels */
	CT_GRAPH_POOL,      /* largest of k x k, every `stride` */
	CT_GRAPH_STRETCH,   /* bilinear, to another size */
	CT_GRAPH_WINDOW,    /* attention in windows; a: qkv; param: as in window-attention.h */
};

struct ct_image {
	size_t h, w, c; /* vectors are 1 x 1 x c */
};

struct ct_graph_op {
	enum ct_graph_kind kind;
	size_t out, a, b;      /* images; CT_NONE */
	size_t param;          /* first of two, or the only one, or CT_NONE */
	size_t k, stride;      /* convolution */
	bool silu;             /* normalisation */
	bool bare;             /* convolution: no bias, and one parameter */
	bool inside;           /* convolution: no padding */
	bool channels, spread; /* attention, as in window-attention.h */
	enum ct_pointwise f;
	double eps; /* of CT_GRAPH_LAYER */
};

struct ct_param {
	char name[112];
	size_t rank, dim[4], count, offset;
	size_t fan_in; /* inputs of one output: the scale of the initialisation; 0 for gamma, beta
			*/
	bool zero;     /* initialised to zero */
	bool gamma;    /* initialised to one */
};

struct ct_graph {
	size_t n_image, cap_image, n_op, cap_op, n_param, cap_param;
	struct ct_image *image; /* 0 is the input */
	struct ct_graph_op *op;
	struct ct_param *param;
	size_t out;   /* the last image */
	size_t count; /* of all parameters, floats */
};

/* For an input of h x w pixels; *g must be zero. CT_EGEOM unless both are multiples of
 * ct_unet_arch_multiple and at least ct_unet_arch_least. */
int ct_graph_build(
	struct ct_graph *g, const struct ct_unet_arch *a, size_t h, size_t w, struct ct_err *e);
void ct_graph_free(struct ct_graph *g);
/* Floats of an image. */
size_t ct_image_count(const struct ct_image *i);

#endif
