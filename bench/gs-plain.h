/* gs-plain.h: an iteration of the fit as one would write it first: scalar, in double, with the
 * functions of libm, on one thread. What b-gs measures the library against.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_BENCH_GS_PLAIN_H
#define CT_BENCH_GS_PLAIN_H
#include "tests/gaussian-plain.h"
#include "gs/rasterise.h"
#include "gs/mixture.h"

struct plain {
	struct ct_camera cam;
	struct ct_block block;
	size_t n;
	struct ct_gaussian *b;
	double *x, *grad, *m, *v;  /* n x 11: parameters, gradient, moments */
	double *img, *dimg;        /* h x w */
	double *base, *y, *map[8]; /* h x w */
	double *vox, *dvox;        /* of the block */
	double scale, rate;
	double pixels; /* within ellipses, of the last plain_forward */
	size_t steps;
};

/* base and y are h x w, density x mm; scale that of the loss. Exits without memory. */
void plain_init(struct plain *p, const struct ct_gauss *g, const struct ct_camera *c,
	const struct ct_block *k, const float *base, const float *y, double scale);
void plain_free(struct plain *p);
/* Each takes a struct plain: parameters to Gaussians and image; image to loss and dimg; dimg to the
 * gradient; a block with its TV, added to the gradient; a step of Adam; all of them. */
void plain_forward(void *arg);
void plain_loss(void *arg);
void plain_backward(void *arg);
void plain_tv(void *arg);
void plain_step(void *arg);
void plain_iteration(void *arg);

#endif
