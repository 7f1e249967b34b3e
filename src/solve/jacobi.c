/* jacobi.c: see jacobi.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "solve/jacobi.h"

#include <math.h>
#include <stdbool.h>

#define LEAST_COSINE 1e-13 /* of the lengths: nothing to rotate away */
enum { SWEEPS = 60 };

double ct_jacobi_dot(size_t n, const double *a, const double *b)
{
	double sum = 0;

	for (size_t i = 0; i < n; i++)
		sum += a[i] * b[i];
	return sum;
}

static void turn(size_t n, double *a, double *b, double c, double s)
{
	for (size_t i = 0; i < n; i++) {
		double x = a[i], y = b[i];

		a[i] = c * x - s * y;
		b[i] = s * x + c * y;
	}
}

/* Rotate rows x and y of n, and a and b of m with them, until x and y are at right angles. True if
 * they were not. */
static bool straighten(size_t n, double *x, double *y, size_t m, double *a, double *b)
{
	double xx = ct_jacobi_dot(n, x, x), yy = ct_jacobi_dot(n, y, y),
	       xy = ct_jacobi_dot(n, x, y);
	double zeta, t, c;

	if (fabs(xy) <= LEAST_COSINE * sqrt(xx * yy) || xy == 0.0)
		return false;
	zeta = (yy - xx) / (2 * xy);
	t = copysign(1.0, zeta) / (fabs(zeta) + sqrt(1 + zeta * zeta));
	c = 1 / sqrt(1 + t * t);
	turn(n, x, y, c, c * t);
	turn(m, a, b, c, c * t);
	return true;
}

int ct_jacobi(size_t m, size_t n, double *v, double *u, struct ct_err *e)
{
	for (int sweep = 0; sweep < SWEEPS; sweep++) {
		bool more = false;

		for (size_t p = 0; p + 1 < m; p++)
			for (size_t q = p + 1; q < m; q++)
				more |= straighten(
					n, v + p * n, v + q * n, m, u + p * m, u + q * m);
		if (!more)
			return 0;
	}
	return ct_fail(e, CT_ENUMERIC, "an operator of %zu rows cannot be factored", m);
}
