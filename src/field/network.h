/* network.h: the network of a neural field: layers from the code of a point to its outputs.
 *
 * `depth` hidden layers h = a(W h + b) of `width`, a the leaky ReLU of `slope`, then a linear layer
 * to `outputs` numbers. Hidden layers count from 0. The input of hidden layer `skip` (0: of none)
 * is the code and then the layer before, as in NeRF. With attention (ray-attention.h) its block
 * stands between hidden layers 0 and 1. So
 *
 *   NAF       width 32, depth 3, skip 2, slope .01, 1 output, sigmoid
 *   NeRF      width 256, depth 8, skip 5, slope 0 (its "skips = [4]": after layer 4)
 *   SAX-NeRF  width 32, depth 2, skip 1, slope .01, 1 output, sigmoid, attention 2 x 8 x 4
 *
 * Weights are one vector: W (out,in) and b (out) of hidden layer 0, the block's (ray-attention.h),
 * W and b of the other hidden layers, W and b of the outputs.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FIELD_NETWORK_H
#define CT_FIELD_NETWORK_H
#include "core/err.h"
#include "field/ray-attention.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum ct_network_last { CT_NETWORK_LINEAR, CT_NETWORK_SIGMOID };
enum { CT_NETWORK_WIDTH = 1024, CT_NETWORK_DEPTH = 64 }; /* at most */

struct ct_network {
	size_t width, depth, skip, outputs;
	double slope;
	enum ct_network_last last; /* of the last output; the one before it is linear */
	struct ct_attention attention;
};

/* CT_EINPUT for layers that are none or too many. */
int ct_network_check(const struct ct_network *s, struct ct_err *e);
/* Of its weights, with codes of `in` features. */
size_t ct_network_count(const struct ct_network *s, size_t in);
/* As PyTorch's nn.Linear begins: U(-1/sqrt(in), 1/sqrt(in)), biases too. Layer norms 1 and 0, the
 * position bias 0. */
void ct_network_init(
	const struct ct_network *s, size_t in, float *weights, uint64_t seed, uint64_t stream);

/* A part of the weights. */
struct ct_network_part {
	size_t rank, dim[3], offset, count;
	double first; /* a weight begins as this, or within +- that */
	bool drawn;
};
/* Part i; false beyond the last, of which offset is then the end. */
bool ct_network_part(const struct ct_network *s, size_t in, size_t i, struct ct_network_part *p);

/* On columns of feature-major codes (dense.h). `kept` holds the code in its first in * ld floats,
 * and what a forward keeps: ct_network_kept floats; scratch is for back. */
struct ct_network_call {
	const struct ct_network *shape;
	size_t in, cols, ld;
	const float *weights;
	float *kept, *scratch;
};
size_t ct_network_kept(const struct ct_network *s, size_t in, size_t ld);
size_t ct_network_scratch(const struct ct_network *s, size_t ld);
/* *y = rows [outputs][ld], among what is kept. CT_EFAIL of oneDNN. */
int ct_network_forward(const struct ct_network_call *c, float **y, struct ct_err *e);
/* After that forward: grad (of all weights) += theirs, dcode[in][ld] = d loss / d code (NULL: not),
 * from dy[outputs][ld], which is written over, and is 0 in columns that do not count. */
int ct_network_back(
	const struct ct_network_call *c, float *dy, float *dcode, float *grad, struct ct_err *e);

#endif
