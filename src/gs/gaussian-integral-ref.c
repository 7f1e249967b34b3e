/* gaussian-integral-ref.c: see gaussian-integral-ref.h. */
#include "config.h"
#include "gs/gaussian-integral-ref.h"

#include <math.h>

#define NUM double
#define MASK int
#define PICK(m, a, b) ((m) ? (a) : (b))
#define SQRT sqrt
#define GAUSSIAN struct ct_gaussian
#define FOOTPRINT struct ct_footprint
#define GRADIENT struct ct_gaussian_gradient
#define FN(name) ref_##name
#include "gs/gaussian-formulas.h"

#include "gs/gaussian-integral.h"

bool ct_footprint_ref_of(
	struct ct_footprint *f, const struct ct_camera *c, const struct ct_gaussian *b)
{
	return ref_footprint_of(f, c, b);
}

void ct_footprint_ref_backward(struct ct_gaussian_gradient *g, const struct ct_footprint *f,
	const struct ct_camera *c, const struct ct_gaussian *b, const double sums[static 6])
{
	ref_footprint_backward(g, f, c, b, sums);
}

void ct_footprint_ref_draw(double *img, const struct ct_camera *c, const struct ct_footprint *f,
	double rho, double cut)
{
	for (size_t r = 0; r < c->h; r++)
		for (size_t k = 0; k < c->w; k++) {
			double y = (double)r - f->m[1], x = (double)k - f->m[0] - f->slope * y;
			double q = x * x / f->cond / 2 + y * y / f->cov[2] / 2;

			if (q <= cut)
				img[r * c->w + k] += rho * f->mu * exp(-q);
		}
}

void ct_footprint_ref_sums(double s[static 6], const double *g, const struct ct_camera *c,
	const struct ct_footprint *f, double cut)
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
