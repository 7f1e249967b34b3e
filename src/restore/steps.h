/* steps.h: plain steps, which an expectation is not to soften, and vessels in the lung, which it is
 * not to make brighter than tissue.
 *
 * Where nothing aliases, least variation finds a step between two plateaus as sharp as it was. The
 * mean over all that such a place may hold is a blurred one, for other scans were blurred there. Of
 * an expectation h about a volume x, in each block of s^3 voxels, stays
 *
 *   h - c p u,   u = the Laplacian of x, p = how plain a step is there,
 *   c = max(0, sum p h u / sum (p u^2 + HU^2 of rounding))
 *
 * along u a step diffuses: c < 0 sharpens it, and stays, as does what moves it, which is at right
 * angles to u. p = (1 - 5^2 HU^2 / g^2) d^2 / (d^2 + (v + 5^2 HU^2) / limit^2): g is the slope of
 * x, a voxel, no less than 5 HU; d how much higher x is 3/4 s to 3/2 s up the slope than as far
 * below, v the variance of the two plateaus. A small change of x makes a small one.
 *
 * Where there is lung and neither bone nor air, x + h is no higher than the highest x about it, or
 * 50 HU: of vessels of 100 HU the expectation made specks of up to 460 HU, as dense as bone. That
 * is where in a block and its neighbours the highest x is below 250 HU and the least below -500,
 * and above -985; or, for single voxels of x ring lower, where no block up to two away has a mean
 * below that, or lies beyond the border. Beside air there may be thin bone, as in a nose.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_RESTORE_STEPS_H
#define CT_RESTORE_STEPS_H
#include "core/err.h"
#include "core/par.h"

struct ct_steps {
	float *h; /* n voxels */
	const float *x;
	size_t n[3], s; /* s: at most CT_PATCH_CELL */
	double limit;
};

/* h of the lung, as it will be added, becomes no more than what is left to that. CT_ENOMEM. */
int ct_steps_dim(struct ct_steps *of, struct ct_par *par, struct ct_err *e);
/* h becomes h - c p u. The same bytes for any number of threads. */
void ct_steps_keep(struct ct_steps *of, struct ct_par *par);

#endif
