/* arssr.h: the network of ArSSR (Wu et al. 2022): a low-resolution volume becomes features on its
 * grid, and a voxel of any finer grid is read from these.
 *
 *   encoder   a residual dense network (RDN): two convolutions, B blocks of L dense layers, the
 *             fusion of the blocks, two convolutions; 3 x 3 x 3 and 1 x 1 x 1, zero padding
 *   sample    the features at a point: trilinear, 0 beyond the outermost voxel centres
 *   decoder   the features and the coordinates of the point, -1 to 1 from face to face of the
 *             volume, through two stages of four linear layers with a ReLU after each; the input is
 *             added to what the first stage made
 *
 * Values are in [0, 1]: HU of the window, clipped to it. Tensor axes are z, y, x, and so are the
 * coordinates. Tensors have the names of the authors' program, from memory: no published file was
 * read. The weights lie in one block, layer after layer, matrix and then bias.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_ARSSR_ARSSR_H
#define CT_ARSSR_ARSSR_H
#include "core/tensors.h"

#include <stddef.h>
#include <stdint.h>

struct ct_arssr_shape {
	size_t features, blocks, layers, growth; /* of the encoder */
	size_t out;                              /* features of a voxel */
	size_t width;                            /* of the decoder's hidden layers */
};
/* Those of the paper. */
#define CT_ARSSR_PUBLISHED                                                                         \
	{                                                                                          \
		64, 8, 3, 64, 128, 256                                                             \
	}

struct ct_arssr_layer {
	char name[96];
	size_t k;            /* 3: convolution, 1: of one voxel, 0: of a point */
	size_t ci, co;       /* channels */
	size_t weight, bias; /* where they begin */
};

struct ct_arssr {
	struct ct_arssr_shape shape;
	double window[2];             /* HU of 0 and 1 */
	size_t n, layers;             /* weights, layers */
	struct ct_arssr_layer *layer; /* owned */
	float *all;                   /* owned */
};

/* Layers of the encoder in their order; those of the decoder follow ct_arssr_stage(a, 0). */
enum { CT_ARSSR_FIRST, CT_ARSSR_SECOND, CT_ARSSR_BLOCKS, CT_ARSSR_DECODER = 8 };
size_t ct_arssr_dense(const struct ct_arssr *a, size_t block, size_t layer); /* L: the fusion */
size_t ct_arssr_fusion(const struct ct_arssr *a, size_t i); /* 0, 1; 2: the last convolution */
size_t ct_arssr_stage(const struct ct_arssr *a, size_t i);  /* 0 to 7 */

/* A word of the shape: 0; 1 if there is no such word; -1 with CT_EUSAGE for its value. */
int ct_arssr_shape_set(
	struct ct_arssr_shape *s, const char *key, const char *value, struct ct_err *e);
/* shape and window are set; weights of zero. CT_EINPUT for a shape that is none, CT_ENOMEM. */
int ct_arssr_alloc(struct ct_arssr *a, struct ct_err *e);
void ct_arssr_free(struct ct_arssr *a);
/* Weights at random, uniform within 1/sqrt(inputs); the last bias is that of water, so that the
 * last ReLU is open. */
void ct_arssr_begin(struct ct_arssr *a, uint64_t seed);
/* LR voxels beyond a voxel that its features are made of. */
size_t ct_arssr_reach(const struct ct_arssr_shape *s);
/* Multiply-adds of a LR voxel, and of a voxel of the result. */
void ct_arssr_work(const struct ct_arssr *a, double *encoder, double *decoder);

/* The metadata of a network, and shape and window of it. CT_EINPUT. */
int ct_arssr_describe(const struct ct_arssr *a, struct ct_meta *m, struct ct_err *e);
int ct_arssr_described(struct ct_arssr *a, const struct ct_meta *m, struct ct_err *e);
/* The tensors and the metadata of the network `a` with these weights. */
int ct_arssr_put(
	const struct ct_arssr *a, const float *all, struct ct_tensors *w, struct ct_err *e);
/* *a (zeroed struct) from those. CT_EINPUT for another kind of file or a wrong tensor, CT_ENUMERIC
 * for a value that is not finite. */
int ct_arssr_get(struct ct_arssr *a, const struct ct_tensors *w, struct ct_err *e);

#endif
