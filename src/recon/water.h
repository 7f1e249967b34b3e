/* water.h: beam hardening of water, undone in the line integrals.
 *
 * A tube sends many energies, of which matter takes the soft ones first. So -log(I/I0) grows slower
 * than the path, and a homogeneous body is darker in its middle (cupping). Of water, and of what
 * attenuates like it, a polynomial of the line integral mends that:
 *
 *   p <- c1 p + c2 p^2 + c3 p^3 + c4 p^4
 *
 * The coefficients are found in the scan itself, of a body that is homogeneous (Kachelriess,
 * Sourbelle, Kalender, Med. Phys. 33, 2006, empirical cupping correction): reconstruction is
 * linear, so the middle plane is reconstructed of p, p^2 and p^3, and the sum that is nearest to
 * flat, within the body and outside, is a linear least-squares problem. No coefficient is negative:
 * hardening only lowers p, and else streaks are fitted too. The body keeps its mean. Voxels near
 * its edge do not count.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_RECON_WATER_H
#define CT_RECON_WATER_H
#include "core/env.h"
#include "core/stack.h"

enum { CT_WATER_TERMS = 4 };

/* The fourth is 0. CT_EGEOM if filtered back-projection does not take the scan, CT_EINPUT if no
 * body is seen in its middle plane; CT_ENOMEM, CT_ESTOP. */
int ct_water_find(double c[static CT_WATER_TERMS], const struct ct_stack *scan,
	const struct ct_env *env, struct ct_err *e);
/* In place; deviations by the slope. Below 0, which is noise, it goes on straight. CT_EINPUT naming
 * the first line integral at which the polynomial does not rise. */
int ct_water_apply(struct ct_stack *s, const double c[static CT_WATER_TERMS], struct ct_err *e);

#endif
