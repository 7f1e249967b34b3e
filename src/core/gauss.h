/* gauss.h: a set of signed 3-D Gaussians.
 *
 *   f(X) = sum_i rho_i exp(-1/2 (X - p_i)^T Sigma_i^-1 (X - p_i)),  Sigma = R diag(s^2) R^T
 *
 * Structure of arrays, raw (pre-activation) values: rho_i = phi(raw_i) (activation.h), in density
 * of the metadata "window". Positions and standard deviations in world mm, RAS+; scale stores
 * ln(s/mm); the quaternion is (w,x,y,z), normalised on use.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CORE_GAUSS_H
#define CT_CORE_GAUSS_H
#include "core/activation.h"
#include "core/err.h"
#include "core/meta.h"

#include <stddef.h>

enum { CT_GAUSS_COLUMNS = 11 };

struct ct_gauss {
	size_t n, cap;
	union {
		struct {
			float *pos[3];   /* mm */
			float *scale[3]; /* ln of standard deviation in mm */
			float *rot[4];   /* quaternion w x y z, need not be normalised */
			float *raw;      /* raw density z */
		};
		float *column[CT_GAUSS_COLUMNS]; /* these, in this order */
	};
	enum ct_activation activation;
	double gamma;   /* PReLU slope, > 0 */
	size_t grid[3]; /* grid the set was made for; 0 if none */
	double affine[3][4];
	size_t step; /* optimiser step of the checkpoint */
	struct ct_meta meta;
};

/* Room for n more than none: capacity >= n, contents and n kept. */
int ct_gauss_reserve(struct ct_gauss *g, size_t n, struct ct_err *e);
void ct_gauss_free(struct ct_gauss *g);
/* Room for n in each of `count` columns that have room for *cap, contents kept; and none. */
int ct_gauss_grow(float **column, size_t count, size_t *cap, size_t n, struct ct_err *e);
void ct_gauss_drop(float **column, size_t count);
/* CT_ENUMERIC naming the first Gaussian that is not finite. */
int ct_gauss_check_finite(const struct ct_gauss *g, struct ct_err *e);

#endif
