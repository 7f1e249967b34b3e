/* bird.h: the noise that a chain begins with, fitted to y (sampler.h, CT_SAMPLER_BIRD).
 *
 * x(z) is the result of the deterministic DDIM that begins with noise z; a step of Adam on z
 * against the mean (A x(z) - y)^2, then z is put back on the sphere of radius sqrt(values). The
 * gradient goes through every move of the chain, also back in time, and through the network unless
 * it is frozen.
 */
#ifndef CT_DIFFUSION_BIRD_H
#define CT_DIFFUSION_BIRD_H
#include "diffusion/draw.h"

/* g[all]: gradient to the end of the chain that left this trail (draw.h), becomes that to w->z
 * at its beginning, with or without init. scratch[2][all]; w->eps is written over. What back
 * returns. */
int ct_bird_gradient(struct ct_draw *w, const float *trail, bool init, float *g, float *scratch,
	struct ct_err *e);
/* x from y, w->z the noise to begin with; codes of ct_sampler_draw. */
int ct_bird(struct ct_draw *w, float *x, const float *y, const float *init, struct ct_err *e);

#endif
