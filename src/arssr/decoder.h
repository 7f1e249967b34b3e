/* decoder.h: the decoder of ArSSR: features at points and their coordinates to values; and its
 * gradient. On the calling thread, between ct_dnn_enter and ct_dnn_leave.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_ARSSR_DECODER_H
#define CT_ARSSR_DECODER_H
#include "arssr/arssr.h"

#include <stdbool.h>

enum { CT_DECODER_ROWS = 512 };

/* CT_DECODER_ROWS points. */
struct ct_decoder {
	const struct ct_arssr *net; /* borrowed */
	float *row;       /* the features of one point; owned, the block of all that follows */
	float *h[10];     /* inputs of the layers [0, 8), the end of stage one, the values:
			   * row f holds feature f of CT_DECODER_ROWS points (nn/dense.h) */
	float *d[2], *in; /* gradients, with `train`; in: of the input */
	size_t at[CT_DECODER_ROWS][8]; /* eight voxels about a point, in features, and weights */
	float w[CT_DECODER_ROWS][8];
};

/* Volume of which features are there: all of it, or voxels [lo, lo + n). Along x, y, z. */
struct ct_decoder_field {
	const float *features; /* [n][out] */
	size_t whole[3], lo[3], n[3];
};

int ct_decoder_alloc(
	struct ct_decoder *d, const struct ct_arssr *net, bool train, struct ct_err *e);
void ct_decoder_free(struct ct_decoder *d);
/* Row `row` becomes the point p, x, y, z, in voxels of the whole volume, whole at centres. */
void ct_decoder_point(struct ct_decoder *d, size_t row, const struct ct_decoder_field *f,
	const double p[static 3]);
/* The values d->h[9] of the first n rows. CT_EFAIL. */
int ct_decoder_run(struct ct_decoder *d, size_t n, struct ct_err *e);
/* Adds the gradient of the weights to grad (as net->all), and that of the features to `features`,
 * from that of the values, dy[n], after ct_decoder_run. */
int ct_decoder_back(struct ct_decoder *d, size_t n, float *grad, float *features, const float *dy,
	struct ct_err *e);

#endif
