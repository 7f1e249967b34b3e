/* ellipse.h: where a plane cuts a Gaussian. Pure.
 *
 * Of a Gaussian with centre p and covariance S, the plane n.X = h (n a unit vector) at the distance
 * d = h - n.p, with s = n.S n: what it shows on the plane is again a Gaussian (the conditional
 * one), with centre p + (d / s) S n and covariance C = S - S n (S n)^T / s. Its ellipsoid of one
 * standard deviation, (X - p)^T S^-1 (X - p) = 1, is cut in the ellipse of C with the radius sqrt(1
 * - d^2 / s), if d^2 < s.
 */
#ifndef CT_TOOLS_ELLIPSE_H
#define CT_TOOLS_ELLIPSE_H
#include "gs/gaussian.h"

#include <stdbool.h>

/* The places centre + cos(t) half[0] + sin(t) half[1]. */
struct ellipse {
	double centre[3], half[2][3];
};

/* The cut through the ellipsoid by the plane of the unit vectors e[1] and e[2], across which e[0]
 * runs, at e[0].X = h. False if it misses it. */
bool ellipse_cut(struct ellipse *out, const struct ct_gaussian *g, double e[3][3], double h);
/* The place at t. */
void ellipse_place(double x[static 3], const struct ellipse *c, double t);

#endif
