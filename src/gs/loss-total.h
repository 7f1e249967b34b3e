/* loss-total.h: the total loss of a fit (loss.h): its terms, each with its gradient.
 *
 * The gradients with respect to what is drawn go back through splat.h and mixture.h to the
 * parameters of the Gaussians, and that of the density through the activation to the raw density.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_GS_LOSS_TOTAL_H
#define CT_GS_LOSS_TOTAL_H
#include "gs/fit.h"
#include "gs/loss-lowres.h"

/* Scratch of an iteration. */
struct ct_loss_total {
	const struct ct_fit *f;
	const struct ct_fit_data *d;
	const struct ct_env *env;
	struct ct_gaussian *gaussian; /* of the Gaussians as they are */
	size_t gaussians;
	struct ct_splat splat;
	struct ct_mixture vox;
	struct ct_gradient grad;
	struct ct_loss_image loss;
	struct ct_loss_lowres low; /* want is NULL without a low-resolution CT */
	float *img, *dimg;         /* h x pitch; one block at img, with */
	float *block, *dblock;     /* those of a block of voxels */
	double *dgamma;            /* of every chunk */
	double *tv;                /* of every slice of a block */
	size_t dgammas;
};

/* For this fit and its data, which it borrows. *w must be zero; free it also after a failure. Codes
 * of ct_loss_lowres_alloc. */
int ct_loss_total_alloc(struct ct_loss_total *w, const struct ct_fit *f,
	const struct ct_fit_data *d, const struct ct_env *env, struct ct_err *e);
void ct_loss_total_free(struct ct_loss_total *w);
/* Room for n Gaussians. */
int ct_loss_total_grow(struct ct_loss_total *w, size_t n, struct ct_err *e);
/* View k: t->l1, t->dssim, and w->grad set. */
int ct_loss_total_view(
	struct ct_loss_total *w, struct ct_loss_terms *t, size_t k, struct ct_err *e);
/* TV of a random block of the iteration, t->tv; added to w->grad. */
int ct_loss_total_tv(
	struct ct_loss_total *w, struct ct_loss_terms *t, size_t iteration, struct ct_err *e);
/* The low-resolution CT, a random block of it; t->lr; added to w->grad. */
int ct_loss_total_lowres(
	struct ct_loss_total *w, struct ct_loss_terms *t, size_t iteration, struct ct_err *e);
/* dL/drho of w->grad to dL/draw; returns dL/dgamma. */
double ct_loss_total_chain(struct ct_loss_total *w);

#endif
