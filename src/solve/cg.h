/* cg.h: conjugate gradients (Hestenes and Stiefel 1952) for the least of a quadratic function, of
 * which only two things are asked: its curvature along a direction, and its gradient after a step
 * along that. So the normal equations of least squares can keep what they like beside x.
 */
#ifndef CT_SOLVE_CG_H
#define CT_SOLVE_CG_H
#include "core/env.h"

#include <stdbool.h>
#include <stddef.h>

struct ct_cg {
	size_t n;
	float *x, *d,
		*s;   /* [n], borrowed: the solution so far, the direction, minus the gradient */
	double gamma; /* |s|^2 */
	/* *curve = <d, H d>, H the matrix of the function. */
	int (*along)(void *ctx, double *curve, const float *d, const struct ct_env *env,
		struct ct_err *e);
	/* s = minus the gradient at x, which has moved by alpha d of the last call. */
	int (*moved)(void *ctx, float *s, double alpha, const struct ct_env *env, struct ct_err *e);
	void *ctx;
};

/* With x and s set: the first direction. */
void ct_cg_begin(struct ct_cg *c, struct ct_par *par);
/* One step; *done if there is nothing left to go down. What the functions return. */
int ct_cg_step(struct ct_cg *c, bool *done, const struct ct_env *env, struct ct_err *e);

#endif
