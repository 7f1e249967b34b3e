/* gaussian-integral-ref.h: the footprint of one Gaussian on the detector (splat.h), in double, with
 * plain loops over pixels: what the fast functions are tested against. The formulas are those of
 * gaussian-integral.h. Pure.
 */
#ifndef CT_GS_GAUSSIAN_INTEGRAL_REF_H
#define CT_GS_GAUSSIAN_INTEGRAL_REF_H
#include "gs/camera.h"
#include "gs/gaussian.h"

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

/* False if the Gaussian is not in front of the source or has no area. */
bool ct_footprint_ref_of(
	struct ct_footprint *f, const struct ct_camera *c, const struct ct_gaussian *b);
/* Sums over pixels of g e {1, x, y, xx, xy, yy} (rasterise.h) to gradients. */
void ct_footprint_ref_backward(struct ct_gaussian_gradient *g, const struct ct_footprint *f,
	const struct ct_camera *c, const struct ct_gaussian *b, const double sums[static 6]);
/* img[h][w] += footprint where the exponent is at least -cut. */
void ct_footprint_ref_draw(double *img, const struct ct_camera *c, const struct ct_footprint *f,
	double rho, double cut);
/* The sums above for dL/dimg = g[h][w]. */
void ct_footprint_ref_sums(double s[static 6], const double *g, const struct ct_camera *c,
	const struct ct_footprint *f, double cut);

#endif
