/* splat.h: X-ray projections of Gaussians and their gradients.
 *
 * A Gaussian projects to  rho mu exp(-1/2 d^T K d),  d = pixel - projected centre,  K^-1 = J Sigma
 * J^T with J the Jacobian of the projection at the centre (2x3, pixels per mm), and
 *
 *   mu = sqrt(2 pi / (delta^T Sigma^-1 delta)),  delta = unit ray through the centre,
 *
 * its exact integral along the ray through the centre: mm, so that a pixel is density x mm as
 * in ct_project. This is the rectified splat of R2-Gaussian (Zha et al., NeurIPS 2024) in a form
 * that is positive by construction. There is no dilation and, as densities are signed, no
 * threshold on the contribution: a Gaussian ends on the ellipse of CT_GS_CUT (rasterise.h),
 * whatever its sign. Off its centre a Gaussian is exact in parallel beam and to first order in cone
 * beam.
 *
 * The image is a plain sum in order of index, by groups of 4096 so that a million in one place lose
 * no digits: the same bytes for any number of threads. Gradients
 * belong to one Gaussian each and are summed by one task.
 */
#ifndef CT_GS_SPLAT_H
#define CT_GS_SPLAT_H
#include "core/err.h"
#include "core/par.h"
#include "core/stack.h"
#include "gs/gaussian.h"
#include "gs/rasterise.h"

#include <stdbool.h>

/* A view as two functions of the world:  z = n.d,  (column, row) = c + map d / z (parallel: z = 1),
 * d = p - origin. Oblique and shifted detectors included. */
struct ct_camera {
	bool cone;
	size_t h, w;
	double origin[3];
	double n[3]; /* cone: unit normal of the detector; parallel: unit ray */
	double map[2][3];
	double c[2];
	double near; /* cone: nothing is drawn at smaller z */
};

/* The projection of one Gaussian, what both directions need of it. */
struct ct_footprint {
	double m[2];               /* centre, column and row */
	double cov[3];             /* pixel^2: column-column, column-row, row-row */
	double cond;               /* variance of the column given the row */
	double slope;              /* of the column's mean with the row */
	double mu;                 /* mm */
	double j[2][3], row[2][3]; /* J, and J A diag(s) */
	double delta[3], t[3];     /* ray, and diag(1/s) A^T ray */
	double z, dist;            /* along the normal, and from the source; cone */
};

/* CT_EGEOM for fan beam, which is no projection of a volume. The view must pass ct_stack_check. */
int ct_camera_init(struct ct_camera *c, const struct ct_view *v, enum ct_beam beam, size_t h,
	size_t w, struct ct_err *e);
/* False if the Gaussian is not in front of the source or has no area. */
bool ct_footprint_ref_of(
	struct ct_footprint *f, const struct ct_camera *c, const struct ct_gaussian *b);
/* Sums over pixels of g e {1, x, y, xx, xy, yy} (rasterise.h) to gradients: density, position,
 * shape (the N of ct_gaussian_backward), centre (columns, rows). */
struct ct_gaussian_gradient {
	double rho, p[3], shape[6], m[2];
};
void ct_footprint_ref_backward(struct ct_gaussian_gradient *g, const struct ct_footprint *f,
	const struct ct_camera *c, const struct ct_gaussian *b, const double sums[static 6]);

/* In double and without an end: what the fast functions are tested against.
 * img[h][w] += foot; sums as above for dL/dimg = g[h][w]. */
void ct_footprint_ref_draw(double *img, const struct ct_camera *c, const struct ct_footprint *f,
	double rho, double cut);
void ct_footprint_ref_sums(double s[static 6], const double *g, const struct ct_camera *c,
	const struct ct_footprint *f, double cut);

/* Gradient of a set: d[k][i] of raw parameter k (gaussian.h) of Gaussian i, dL/drho in place of
 * the raw density; screen[i] = |(w/2 dL/dcolumn, h/2 dL/drow)|, negative if nothing was drawn. */
struct ct_gradient {
	size_t cap;
	float *d[CT_GS_FIELDS];
	float *screen;
};
int ct_gradient_reserve(struct ct_gradient *g, size_t n, struct ct_err *e);
void ct_gradient_free(struct ct_gradient *g);

/* Scratch of one view; grows with the set. Dabs are listed by the bands of CT_RASTERISE_ROWS rows
 * that they touch: those of band k, in order of index, are item[start[k] .. start[k + 1]). */
struct ct_splat {
	size_t n, cap;
	struct ct_camera cam;
	struct ct_pixel_gaussian *dab; /* rows [first, end) of each; empty if it is not seen */
	size_t bands, items, starts, firsts;
	uint32_t *item;
	size_t *start;
	size_t *place; /* of chunk c in band k: place[c (bands) + k] */
	size_t sums, threads;
	float *sum; /* a band of each thread */
};
void ct_splat_free(struct ct_splat *s);
/* Project all Gaussians, and make room to draw them with as many threads as `par` has. */
int ct_splat_plan(struct ct_splat *s, const struct ct_camera *c, size_t n,
	const struct ct_gaussian *b, struct ct_par *par, struct ct_err *e);
/* After a plan: what contributes less than `least` (density mm) to a pixel is left out there, in
 * both directions, as in R2-Gaussian. */
void ct_splat_gate(struct ct_splat *s, double least);
/* img[h][pitch] = sum of all, pitch = ct_rasterise_pitch(w), what is beyond w arbitrary but finite.
 */
void ct_splat_draw(float *img, const struct ct_splat *s, struct ct_par *par);
/* grad = (set, not added) gradient for dL/dimg = dimg[h][pitch]. `set` lends the quaternions. */
void ct_splat_backward(struct ct_gradient *grad, const struct ct_splat *s,
	const struct ct_gaussian *b, const struct ct_gauss *set, const float *dimg,
	struct ct_par *par);

#endif
