/* fista.h: min f(x) + h(x), f smooth and h with a proximal point that can be had, by accelerated
 * gradient steps (Beck and Teboulle, SIAM J. Imaging Sci. 2, 2009):
 *
 *   x' = the proximal point, for h / L, of  ahead - grad f(ahead) / L
 *   ahead' = x' + (t - 1) / t' (x' - x),   t' = (1 + sqrt(1 + 4 t^2)) / 2
 *
 * L at least the largest curvature of f. What is borrowed and `at` are all the state there is: a
 * run that is stopped between two steps, or within one, and continued from them gives the same
 * bytes.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_SOLVE_FISTA_H
#define CT_SOLVE_FISTA_H
#include "core/env.h"

#include <stddef.h>

struct ct_fista_at {
	double norm;     /* L */
	double momentum; /* t; 1 to begin with */
	double misfit;   /* before the last step; 0: there was none */
	double next; /* t' while x' is looked for: g is what it is near to, ahead is x; else 0 */
};

struct ct_fista {
	size_t n;
	float *x, *ahead, *g; /* [n], borrowed; x and ahead the same to begin with; g is work */
	double patience; /* > 0: L grows by half, t is 1 again when the misfit grows more times */
	/* g = grad f(x), *misfit: of x, in any unit. */
	int (*gradient)(void *ctx, float *g, double *misfit, const float *x,
		const struct ct_env *env, struct ct_err *e);
	/* x, the solution before, becomes the proximal point of `to`; if it was left off there, it
	 * goes on with what x is. */
	int (*near)(
		void *ctx, float *x, const float *to, const struct ct_env *env, struct ct_err *e);
	void *ctx;
};

/* One step, of 1 / (stretch L), or the rest of it. moved: RMS of x. What the functions return; x,
 * ahead and at are as they were if the gradient fails. */
int ct_fista_step(const struct ct_fista *f, struct ct_fista_at *at, double stretch, double *moved,
	const struct ct_env *env, struct ct_err *e);

#endif
