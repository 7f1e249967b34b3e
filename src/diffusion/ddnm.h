/* ddnm.h: the moves of DDNM and DDNM+ (sampler.h).
 *
 * From timestep t to j < t, with a, sig, x0, z, eps of sampler.h:
 *   x0h = x0 - V^T Lambda_t V (x0 - A+ y),   Lambda_t = diag(lambda_t)
 *   x   = a x0h + noise
 * The DDNM paper calls it Lambda_t, the CT super-resolution paper Sigma_t. With Lambda_t = I, x0h
 * is A+ y + (I - A+ A) x0, the range-null step (range-null.h).
 * eta is the fraction of the noise that is fresh (z), q = sqrt(1 - eta^2) the rest. eta = 0 is
 * the deterministic DDIM. It is not the eta of DDIM.
 *
 * DDNM    Lambda_t = I, noise = sig (eta z + q eps). The last x agrees with y exactly.
 * PLUS    DDNM+: y has noise of standard deviation sy = 2 sigma_y. For a component of singular
 *         value s:
 *           lambda_t = 1 if sig >= a sy / s, else sig q s / (a sy)
 *           noise = phi_t z, phi_t = sqrt(sig^2 - (a sy / s)^2) if sig > a sy / s, else sig eta
 *         Where nothing is measured, noise = sig (eta z + q eps). So the last step, sig = 0,
 *         leaves the network's own estimate. sy = 0 is DDNM.
 * SIMPLE  with sig' = sqrt(1 - abar_j^2), the same for all components:
 *           lambda_t = min(1, sig' / (abar_j sy))
 *           noise = gamma_t sig (eta z + q eps), gamma_t = sqrt(max(0, sig'^2 - (abar_j sy)^2))
 */
#ifndef CT_DIFFUSION_DDNM_H
#define CT_DIFFUSION_DDNM_H
#include "diffusion/draw.h"

/* x becomes the state at the end of move k, of w->x0, eps and z. */
void ct_ddnm_step(const struct ct_draw *w, size_t k, float *x);

#endif
