/* rof.h: the volume x of least |x - v|^2 / (2 mu) + TV(x), nearly, with x >= 0 if asked: TV
 * isotropic, forward differences, per voxel (Rudin, Osher and Fatemi, Physica D 60, 1992), by
 * projected gradients on its dual p, |p| <= 1:
 *
 *   x = v + mu div p,   p <- p + grad x / (12 mu), shortened to length 1
 *
 * The same bytes for any number of threads.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_RECON_ROF_H
#define CT_RECON_ROF_H
#include "core/par.h"
#include "core/simd.h"

#include <stdbool.h>
#include <stddef.h>

struct ct_rof {
	size_t dim[3]; /* first the fastest */
	float *p;      /* [3][n], kept from call to call; zeros to begin with; borrowed */
	float mu;      /* in the unit of the values; 0: x = v */
	bool nonnegative;
};

/* x from v after so many steps on the dual; they must not overlap. */
void ct_rof_solve(const struct ct_rof *r, float *x, const float *v, int steps, struct ct_par *par);
/* Its kernel: plane k of x from v and p, or `dual` of p from x. */
CT_SIMD_DECLARE(void, ct_rof_plane,
	(const struct ct_rof *r, float *x, const float *v, bool dual, size_t k));

#endif
