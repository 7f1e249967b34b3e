/* draw.h: a picture being drawn: the loop of every sampler, and what its rules work with. */
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
/* Channel c: x <- x + by A+ (y - A x0), ct_range_null_pull of range-null.h; x may be x0. */
void ct_draw_pull(const struct ct_draw *w, size_t c, double by, float *x, const float *x0);

#endif
