/* encoder.h: the encoder of ArSSR: features of each voxel of a volume; and its gradient.
 *
 * Channels last, [z][y][x][c]. A convolution is run plane by plane, planes in parallel, each from
 * its own planes and those beside it; so what is in memory is one set of the features of a block.
 * In training a whole small volume is one call on one thread, and everything is kept. Each voxel is
 * summed on one thread: the same bytes with any number of them.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_ARSSR_ENCODER_H
#define CT_ARSSR_ENCODER_H
#include "arssr/arssr.h"
#include "core/env.h"
#include "nn/conv.h"

struct ct_encoder_side; /* of a thread */
struct ct_encoder {
	const struct ct_arssr *net; /* borrowed */
	size_t n[3];                /* voxels along x, y, z */
	size_t planes;              /* of a call */
	bool train;
	size_t sides;
	struct ct_encoder_side *side;
	float *block;                    /* all features, owned */
	float *first, *x, *o, *sum, *to; /* of sfe1, blocks, dense layers, fusion; the result */
};

/* For volumes of n voxels, with convolutions of *dnn, which is borrowed. With `train` for one
 * thread and ct_encoder_back. CT_EFAIL, CT_ENOMEM. */
int ct_encoder_alloc(struct ct_encoder *c, struct ct_dnn *dnn, const struct ct_arssr *net,
	const size_t n[static 3], size_t sides, bool train, struct ct_err *e);
void ct_encoder_free(struct ct_encoder *c);
/* Bytes that it holds, without training. */
double ct_encoder_bytes(const struct ct_arssr_shape *s, const size_t n[static 3], size_t sides);
/* The features c->to[n][out] of in[n]. CT_EFAIL, CT_ESTOP. */
int ct_encoder_run(
	struct ct_encoder *c, const float *in, const struct ct_env *env, struct ct_err *e);
/* Adds the gradient of the weights to grad (as net->all), from that of the features, d[n][out],
 * after ct_encoder_run of the same volume `in`. */
int ct_encoder_back(
	struct ct_encoder *c, float *grad, const float *d, const float *in, struct ct_err *e);

#endif
