/* Where a plane cuts a Gaussian: every place of the ellipse is on the plane and on the ellipsoid.
 */
#include "config.h"
#include "tools/ellipse.h"
#include "tap.h"

#include <math.h>

static double dot(const double a[3], const double b[3])
{
	return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* (X - p)^T S^-1 (X - p) */
static double distance2(const struct ct_gaussian *g, const double x[3])
{
	double sum = 0;

	for (int k = 0; k < 3; k++) {
		double t = 0;

		for (int i = 0; i < 3; i++)
			t += g->a[i][k] * (x[i] - g->p[i]) / g->s[k];
		sum += t * t;
	}
	return sum;
}

static double next(unsigned *state)
{
	*state = *state * 1664525u + 1013904223u;
	return *state / 4294967296.0 * 2 - 1;
}

static void make(struct ct_gaussian *g, unsigned *state)
{
	double p[3], ln_s[3], q[4];

	for (int k = 0; k < 3; k++) {
		p[k] = 20 * next(state);
		ln_s[k] = 1.5 * next(state);
	}
	for (int k = 0; k < 4; k++)
		q[k] = next(state);
	ct_gaussian_make(g, p, ln_s, q, 1);
}

/* Three unit vectors at right angles: the axes of another Gaussian. */
static void axes(double e[3][3], unsigned *state)
{
	struct ct_gaussian g;

	make(&g, state);
	for (int k = 0; k < 3; k++)
		for (int i = 0; i < 3; i++)
			e[k][i] = g.a[i][k];
}

int main(void)
{
	double off = 0, around = 0, e[3][3], x[3], sphere = 0;
	struct ct_gaussian g;
	struct ellipse c;
	unsigned state = 7;
	int wrong = 0, cut = 0;

	for (int n = 0; n < 500; n++) {
		double s = 0, d = 1.5 * next(&state), turn = 0;

		make(&g, &state);
		axes(e, &state);
		for (int k = 0; k < 3; k++) {
			double t = 0;

			for (int i = 0; i < 3; i++)
				t += e[0][i] * g.a[i][k] * g.s[k];
			s += t * t;
		}
		if (ellipse_cut(&c, &g, e, dot(e[0], g.p) + d * sqrt(s)) != (fabs(d) < 1)) {
			wrong++;
			continue;
		}
		if (fabs(d) >= 1)
			continue;
		cut++;
		for (int k = 0; k < 24; k++) {
			ellipse_place(x, &c, k * atan(1) / 3);
			off = fmax(off, fabs(dot(e[0], x) - dot(e[0], g.p) - d * sqrt(s)));
			around = fmax(around, fabs(distance2(&g, x) - 1));
		}
		for (int i = 0; i < 3; i++) /* half axes that are one are no ellipse */
			turn += fabs(c.half[1][i]);
		wrong += turn == 0;
	}
	OK(wrong == 0 && cut > 200,
		"cut where the plane is nearer than the ellipsoid reaches: %d of 500", cut);
	OK(off < 1e-9, "on the plane: %g mm off", off);
	OK(around < 1e-9, "on the ellipsoid: %g off", around);
	ct_gaussian_make(&g, (const double[3]){1, 2, 3}, (const double[3]){log(5), log(5), log(5)},
		(const double[4]){1, 2, 3, 4}, -1);
	axes(e, &state);
	OK(ellipse_cut(&c, &g, e, dot(e[0], g.p) + 3), "a sphere of 5 mm, 3 mm from its middle");
	for (int k = 0; k < 8; k++) {
		double r = 0;

		ellipse_place(x, &c, k);
		for (int i = 0; i < 3; i++)
			r += pow(x[i] - c.centre[i], 2);
		sphere = fmax(sphere, fabs(sqrt(r) - 4));
	}
	OK(sphere < 1e-12, "is a circle of 4 mm: %g off", sphere);
	return tap_done();
}
