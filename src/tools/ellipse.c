/* ellipse.c: see ellipse.h. */
#include "config.h"
#include "tools/ellipse.h"

#include <math.h>

/* a.S b, S = A diag(s^2) A^T */
static double product(const struct ct_gaussian *g, const double a[3], const double b[3])
{
	double sum = 0;

	for (int k = 0; k < 3; k++) {
		double x = 0, y = 0;

		for (int i = 0; i < 3; i++) {
			x += a[i] * g->a[i][k];
			y += b[i] * g->a[i][k];
		}
		sum += x * y * g->s[k] * g->s[k];
	}
	return sum;
}

bool ellipse_cut(struct ellipse *out, const struct ct_gaussian *g, double e[3][3], double h)
{
	const double s = product(g, e[0], e[0]), s1 = product(g, e[0], e[1]),
		     s2 = product(g, e[0], e[2]),
		     d = h - (e[0][0] * g->p[0] + e[0][1] * g->p[1] + e[0][2] * g->p[2]);
	double c11, c12, c22, radius, low[3];

	if (!(d * d < s))
		return false;
	radius = sqrt(1 - d * d / s);
	c11 = product(g, e[1], e[1]) - s1 * s1 / s;
	c12 = product(g, e[1], e[2]) - s1 * s2 / s;
	c22 = product(g, e[2], e[2]) - s2 * s2 / s;
	low[0] = sqrt(fmax(c11, 0)); /* Cholesky's factor of C */
	low[1] = low[0] > 0 ? c12 / low[0] : 0;
	low[2] = sqrt(fmax(c22 - low[1] * low[1], 0));
	for (int i = 0; i < 3; i++) {
		out->centre[i] = g->p[i] + d * (e[0][i] + (s1 * e[1][i] + s2 * e[2][i]) / s);
		out->half[0][i] = radius * (low[0] * e[1][i] + low[1] * e[2][i]);
		out->half[1][i] = radius * low[2] * e[2][i];
	}
	return true;
}

void ellipse_place(double x[static 3], const struct ellipse *c, double t)
{
	for (int i = 0; i < 3; i++)
		x[i] = c->centre[i] + cos(t) * c->half[0][i] + sin(t) * c->half[1][i];
}
