/* parker.h: how much a ray of a short scan counts (Parker, Med Phys 9, 254, 1982).
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_RECON_PARKER_H
#define CT_RECON_PARKER_H

/* beta: angle of the view from where the arc begins, 0 to pi + 2 delta, rad; g: that of the ray in
 * the fan, -delta to delta, so that (beta + pi + 2 g, -g) is the same line. The weights of the two,
 * each 0 to 1, have the sum 1. */
double ct_parker_weight(double beta, double g, double delta);

#endif
