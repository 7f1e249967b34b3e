/* ddnm.h: the moves of DDNM and DDNM+ (sampler.h).
 *
 * From timestep t to j < t, with a, sig, x0, z, eps of sampler.h:
 *   x0h = x0 - V^T diag(lam) V (x0 - A+ y)
 *   x   = a x0h + noise
 * lam is the Sigma_t of the CT super-resolution paper, Lambda_t in the DDNM paper; with lam = 1 x0h
 * is their A+ y + (I - A+ A) x0, the range-null step.
 * eta is the fraction of the noise that is fresh (z), q = sqrt(1 - eta^2) the rest; eta 0 is
 * the deterministic DDIM, and eta is not DDIM's own.
 *
 * DDNM    lam = 1, noise = sig (eta z + q eps). The last x agrees with y exactly.
 * PLUS    y has noise of standard deviation sy = 2 sigma_y. For a component of singular value s:
 *           lam = 1 if sig >= a sy / s, else sig q s / (a sy)
 *           noise = d z there, d = sqrt(sig^2 - (a sy / s)^2) if sig > a sy / s, else sig eta
 *         and sig (eta z + q eps) where nothing is measured. So the last step, sig = 0, leaves the
 *         network's own estimate. sy = 0 is DDNM.
 * SIMPLE  with sig' = sqrt(1 - abar_j^2), lam = min(1, sig' / (abar_j sy)), gam = sqrt(max(0,
 *         sig'^2 - (abar_j sy)^2)), noise = gam sig (eta z + q eps), the same everywhere.
 */
#ifndef CT_DIFFUSION_DDNM_H
#define CT_DIFFUSION_DDNM_H
#include "diffusion/draw.h"

/* x becomes the state at the end of move k, of w->x0, eps and z. */
void ct_ddnm_step(const struct ct_draw *w, size_t k, float *x);

#endif
