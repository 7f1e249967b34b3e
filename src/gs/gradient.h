/* gradient.h: the gradient of a loss with respect to a set of Gaussians. */
#ifndef CT_GS_GRADIENT_H
#define CT_GS_GRADIENT_H
#include "core/err.h"
#include "gs/gaussian.h"

/* d[k][i] of raw parameter k (gaussian.h) of Gaussian i, dL/drho in place of the raw density;
 * screen[i] = |(w/2 dL/dcolumn, h/2 dL/drow)|, negative if nothing was drawn. */
struct ct_gradient {
	size_t cap;
	float *d[CT_GS_FIELDS];
	float *screen;
};

/* Room for n. CT_ENOMEM. */
int ct_gradient_reserve(struct ct_gradient *g, size_t n, struct ct_err *e);
/* Also legal on a zeroed struct. */
void ct_gradient_free(struct ct_gradient *g);

#endif
