/* refit.h: the densities of a fit solved for by least squares, positions and shapes as they are.
 *
 * Projections and low-resolution voxels are linear in the densities rho:
 *
 *   min  mean w (c (P rho - y))^2  +  k mean (D rho - l)^2
 *
 * with c the scale of loss.h and k = lr / l1, over all views and all coarse voxels, by
 * conjugate gradients on the normal equations from the densities that are there. Unknowns are rho_i
 * s_i^2 (s the geometric mean of the standard deviations): a projection's norm grows with s^2, so
 * their columns are about alike. Few steps do most, and stop before noise is fitted.
 */
#ifndef CT_GS_REFIT_H
#define CT_GS_REFIT_H
#include "gs/fit.h"
#include "gs/loss-total.h"

/* f->opt.refit steps on the Gaussians of f, and f->error anew; w is of ct_loss_total_alloc. Codes
 * of the terms; CT_ESTOP, f then is as it was. */
int ct_refit_densities(struct ct_fit *f, const struct ct_fit_data *d, struct ct_loss_total *w,
	const struct ct_env *env, struct ct_err *e);

#endif
