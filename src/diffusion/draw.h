/* draw.h: a picture being drawn: the loop of every sampler, and what its rules work with.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_DIFFUSION_DRAW_H
#define CT_DIFFUSION_DRAW_H
#include "diffusion/sampler.h"

/* One channel is n values, the fine pixels of the operator, and m = h w coefficients. */
struct ct_draw {
	const struct ct_sampler *s;
	size_t n, m, all;             /* all = channels * n */
	float *x0, *before, *eps, *z; /* before: the x0 of the move before */
	bool known;                   /* it was a move forward: before is of t[k - 1] */
	double *data;                 /* coefficients of A+ y, every channel */
	double *c0, *cz, *ce;         /* scratch: coefficients of x0, z, eps, one channel */
	double *t;                    /* scratch of the operator */
	float *floats;                /* owns */
};

/* *w zero; free it in any case. */
int ct_draw_alloc(struct ct_draw *w, const struct ct_sampler *s, const float *y, struct ct_err *e);
void ct_draw_free(struct ct_draw *w);
/* x is what a chain begins with where w->z is its noise: that, or init with it. */
void ct_draw_begin(const struct ct_draw *w, float *x, const float *init);
/* All moves. trail[nt - 1][all], unless NULL: the x before each. */
int ct_draw_run(struct ct_draw *w, float *x, float *trail, struct ct_err *e);
/* x becomes the state at the end of move k, of w->x0, eps and z: DDNM and DDNM+ (ddnm.c). */
void ct_draw_ddnm(const struct ct_draw *w, size_t k, float *x);
/* The same of the other rules (ddim.c); w->x0 becomes what it is held to. */
void ct_draw_ddim(struct ct_draw *w, size_t k, float *x);
/* Their next x is the sum of these times x, x0, the x0 of the move before, and z. */
struct ct_ddim {
	double x, x0, before, z;
};
/* Of move k; known: the move before it went forward. */
struct ct_ddim ct_ddim_weights(const struct ct_sampler *s, size_t k, bool known);
/* x from y, w->z the noise to begin with, which is fitted to y (bird.c); codes of ct_sampler_draw.
 */
int ct_draw_bird(struct ct_draw *w, float *x, const float *y, const float *init, struct ct_err *e);
/* g[all]: gradient to the end of the chain that left this trail, becomes that to w->z at its
 * beginning, with or without init. scratch[2][all]; w->eps is written over. What back returns. */
int ct_draw_gradient(struct ct_draw *w, const float *trail, bool init, float *g, float *scratch,
	struct ct_err *e);
/* x <- x + by A+ (y - A x0), ct_measurement_pull of measurement.h; x may be x0. */
void ct_draw_pull(const struct ct_draw *w, double by, float *x, const float *x0);

#endif
