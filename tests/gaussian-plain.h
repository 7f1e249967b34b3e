/* gaussian-plain.h: the footprint of one Gaussian on the detector (gs/splat.h) and its density in
 * voxels (gs/mixture.h), in double, with plain loops: what the fast functions are compared with.
 * The formulas are those of gs/gaussian-integral.h; cut >= 0 is free.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_TESTS_GAUSSIAN_PLAIN_H
#define CT_TESTS_GAUSSIAN_PLAIN_H
#include "gs/splat.h"
#include "gs/mixture.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

/* The projection of one Gaussian, what both directions need of it. */
struct footprint {
	double m[2];               /* centre, column and row */
	double cov[3];             /* pixel^2: column-column, column-row, row-row */
	double cond;               /* variance of the column given the row */
	double slope;              /* of the column's mean with the row */
	double mu;                 /* mm */
	double j[2][3], row[2][3]; /* J, and J A diag(s) */
	double delta[3], t[3];     /* ray, and diag(1/s) A^T ray */
	double z, dist;            /* along the normal, and from the source; cone */
};

#define NUM double
#define MASK int
#define PICK(m, a, b) ((m) ? (a) : (b))
#define SQRT sqrt
#define GAUSSIAN struct ct_gaussian
#define FOOTPRINT struct footprint
#define GRADIENT struct ct_gaussian_gradient
#define FN(name) ref_##name
#include "gs/gaussian-formulas.h"

#include "gs/gaussian-integral.h"

/* False if the Gaussian is not in front of the source or has no area. */
__attribute__((unused)) static bool plain_footprint_of(
	struct footprint *f, const struct ct_camera *c, const struct ct_gaussian *b)
{
	return ref_footprint_of(f, c, b);
}

/* Sums over pixels of g e {1, x, y, xx, xy, yy} (gs/rasterise.h) to gradients. */
__attribute__((unused)) static void plain_footprint_backward(struct ct_gaussian_gradient *g,
	const struct footprint *f, const struct ct_camera *c, const struct ct_gaussian *b,
	const double sums[static 6])
{
	ref_footprint_backward(g, f, c, b, sums);
}

/* img[h][w] += footprint where the exponent is at least -cut. */
__attribute__((unused)) static void plain_footprint_draw(
	double *img, const struct ct_camera *c, const struct footprint *f, double rho, double cut)
{
	for (size_t r = 0; r < c->h; r++)
		for (size_t k = 0; k < c->w; k++) {
			double y = (double)r - f->m[1], x = (double)k - f->m[0] - f->slope * y;
			double q = x * x / f->cond / 2 + y * y / f->cov[2] / 2;

			if (q <= cut)
				img[r * c->w + k] += rho * f->mu * exp(-q);
		}
}

/* The sums above for dL/dimg = g[h][w]. */
__attribute__((unused)) static void plain_footprint_sums(double s[static 6], const double *g,
	const struct ct_camera *c, const struct footprint *f, double cut)
{
	for (int i = 0; i < 6; i++)
		s[i] = 0;
	for (size_t r = 0; r < c->h; r++)
		for (size_t k = 0; k < c->w; k++) {
			double y = (double)r - f->m[1], x = (double)k - f->m[0] - f->slope * y;
			double q = x * x / f->cond / 2 + y * y / f->cov[2] / 2;
			double v = q <= cut ? g[r * c->w + k] * exp(-q) : 0;

			s[0] += v;
			s[1] += v * x;
			s[2] += v * y;
			s[3] += v * x * x;
			s[4] += v * x * y;
			s[5] += v * y * y;
		}
}

/* out[n2][n1][n0] += the Gaussian where the exponent is at least -cut. */
__attribute__((unused)) static void plain_mixture_draw(
	double *out, const struct ct_block *k, const struct ct_voxel_gaussian *b, double cut)
{
	size_t count = k->n[0] * k->n[1] * k->n[2];

	for (size_t at = 0; at < count; at++) {
		double z = (double)(at / k->n[0] / k->n[1]) - b->m[2];
		double y = (double)(at / k->n[0] % k->n[1]) - b->m[1] - b->s12 * z;
		double x = (double)(at % k->n[0]) - b->m[0] - b->s02 * z - b->s01 * y;
		double q = (x * x / b->var[0] + y * y / b->var[1] + z * z / b->var[2]) / 2;

		if (q <= cut)
			out[at] += b->rho * exp(-q);
	}
}

/* Moments of g e in the conditional coordinates: 1, x, y, z, xx, xy, xz, yy, yz, zz. */
__attribute__((unused)) static void plain_mixture_sums(double s[static 10], const double *g,
	const struct ct_block *k, const struct ct_voxel_gaussian *b, double cut)
{
	size_t count = k->n[0] * k->n[1] * k->n[2];

	memset(s, 0, 10 * sizeof *s);
	for (size_t at = 0; at < count; at++) {
		double z = (double)(at / k->n[0] / k->n[1]) - b->m[2];
		double y = (double)(at / k->n[0] % k->n[1]) - b->m[1] - b->s12 * z;
		double x = (double)(at % k->n[0]) - b->m[0] - b->s02 * z - b->s01 * y;
		double q = (x * x / b->var[0] + y * y / b->var[1] + z * z / b->var[2]) / 2;
		double v = q <= cut ? g[at] * exp(-q) : 0;
		const double d[10] = {1, x, y, z, x * x, x * y, x * z, y * y, y * z, z * z};

		for (int i = 0; i < 10; i++)
			s[i] += v * d[i];
	}
}

#endif
