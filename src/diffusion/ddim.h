/* ddim.h: the moves of the samplers whose step is a sum of what it knows: DDIM, DDPM,
 * DPM-Solver++(2M), GDP and the chain of BIRD (sampler.h).
 *
 * With a, sig of the timestep that a move goes to, a', sig' of that it leaves:
 *   DDIM   a x0 + sqrt(sig^2 - d^2) (x - a' x0) / sig' + d z,
 *          d = eta (sig / sig') sqrt(1 - a'^2 / a^2)
 *   GDP    the mean of DDIM with eta 1, and sqrt(1 - a'^2 / a^2) z, unless it is the last move
 *   DPM    (sig / sig') x + a (1 - exp(-h)) ((1 + 1/(2 r)) x0 - 1/(2 r) before),
 *          h the growth of log(a / sig) and r h that of the move before; x0 alone in the brackets
 *          where nothing is known from before, and in the last move, whose h is infinite
 */
#ifndef CT_DIFFUSION_DDIM_H
#define CT_DIFFUSION_DDIM_H
#include "diffusion/draw.h"

/* The next x is the sum of these times x, x0, the x0 of the move before, and z. */
struct ct_ddim {
	double x, x0, before, z;
};

/* Of move k; known: the move before it went forward. */
struct ct_ddim ct_ddim_weights(const struct ct_sampler *s, size_t k, bool known);
/* x becomes the state at the end of move k, w->x0 what it is held to. */
void ct_ddim_step(struct ct_draw *w, size_t k, float *x);

#endif
