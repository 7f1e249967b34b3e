/* centre.h: where on the detector the axis really is, found in the projections themselves.
 *
 * A detector that is off by half a pixel doubles every edge. A full turn sees each line twice, from
 * its two ends: the offset at which both agree best is the one. A shorter arc is reconstructed in
 * its middle plane: about an object in air the integral of |density| is least where the slice is
 * sharpest, since what a wrong axis adds is positive here and negative there (Donath, Beckmann,
 * Schreyer, J. Opt. Soc. Am. A 23, 2006).
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_RECON_CENTRE_H
#define CT_RECON_CENTRE_H
#include "core/env.h"
#include "core/stack.h"

/* By how many columns the detector is to be moved along u, within an eighth of its width. CT_EGEOM
 * if filtered back-projection does not take the scan, or the best is at the end of that range;
 * CT_ENOMEM, CT_ESTOP. */
int ct_centre_find(
	double *columns, const struct ct_stack *scan, const struct ct_env *env, struct ct_err *e);
/* The plane of the source: *out (zeroed) <- a fan, or parallel rays, of one row each; `mean`: of
 * parallel rays the mean of all rows. CT_EGEOM, CT_ENOMEM. */
int ct_centre_plane(struct ct_stack *out, const struct ct_stack *scan, bool mean, struct ct_err *e);
/* Move the detector of every view along u, and parallel rays with it. */
void ct_centre_shift(struct ct_stack *scan, double columns);

#endif
