/* field.h: a neural field: position in [0,1]^3 -> 1 output (density) or 2 (density, colour). Its
 * encoding (encoding.h), its network (network.h), all weights in one vector, values and gradients.
 *
 * Threads: a field is read by any number of threads at once; each has a ct_field_work of its own.
 * Results of a call do not depend on other calls. The matrices of wide networks are oneDNN's
 * (nn/dnn.h), on the calling thread.
 *
 * One step of a fit: for all pieces of a batch forward, loss, backward, with gradients of the
 * network in accumulators of the caller's and d loss / d code of the whole batch kept; then
 * ct_encoding_back of all levels in parallel over the whole batch; then ct_adamw_step
 * (solve/adam.h) on the weights.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FIELD_FIELD_H
#define CT_FIELD_FIELD_H
#include "field/encoding.h"
#include "field/network.h"

struct ct_field_shape {
	struct ct_encoding encoding;
	struct ct_network network;
};

struct ct_field {
	struct ct_field_shape shape;
	size_t segment;      /* points come in whole segments of so many: 1 without attention */
	size_t width;        /* rows of a code */
	size_t count;        /* of all weights, */
	size_t encoded, net; /* first the encoding's (0 of frequencies), then the network's */
	float *weights;      /* owned */
};

/* Weights drawn from seed: streams CT_FIELD_STREAM (encoding) and CT_FIELD_STREAM + 1 (network).
 * CT_EINPUT, CT_ENOMEM. */
enum { CT_FIELD_STREAM = 0x66690000 };
int ct_field_alloc(
	struct ct_field **out, const struct ct_field_shape *s, uint64_t seed, struct ct_err *e);
void ct_field_free(struct ct_field *f);

/* Room for up to n points, whose activations are kept from forward to backward. Some hundreds serve
 * best. */
struct ct_field_work;
int ct_field_work_alloc(
	struct ct_field_work **out, const struct ct_field *f, size_t n, struct ct_err *e);
void ct_field_work_free(struct ct_field_work *w);

/* y[n][outputs] of points x[n][3], n a multiple of the segment. CT_ENUMERIC for a value that is not
 * finite, CT_EFAIL of oneDNN. */
int ct_field_forward(const struct ct_field *f, struct ct_field_work *w, size_t n, const float *x,
	float *y, struct ct_err *e);
/* After that forward, from dy[n][outputs] = d loss / d y: dnet[net] += d loss / d weights of
 * the network; dcode[width][ld], columns [0, n), = d loss / d code, for
 * ct_encoding_back; NULL if not wanted. CT_EFAIL. */
int ct_field_backward(const struct ct_field *f, struct ct_field_work *w, size_t n, const float *dy,
	float *dnet, float *dcode, size_t ld, struct ct_err *e);

#endif
