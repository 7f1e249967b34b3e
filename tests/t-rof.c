/* The denoiser of Rudin, Osher and Fatemi against its formulas in double, and at its optimum.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/par.h"
#include "numbers.h"
#include "recon/rof.h"

#include <string.h>

enum { A = 21, B = 5, C = 4, N = A * B * C };

static const size_t dim[3] = {A, B, C}, stride[3] = {1, A, A *B};

static bool last(size_t at, int a)
{
	return at / stride[a] % dim[a] == dim[a] - 1;
}

/* x = v + mu div p. */
static void primal(double *x, const float *v, double p[3][N], double mu, bool nonnegative)
{
	for (size_t i = 0; i < N; i++) {
		double div = 0;

		for (int a = 0; a < 3; a++)
			div += p[a][i] - (i / stride[a] % dim[a] ? p[a][i - stride[a]] : 0);
		x[i] = (double)v[i] + mu * div;
		if (nonnegative && !(x[i] > 0))
			x[i] = 0;
	}
}

static void dual(double p[3][N], const double *x, double step)
{
	for (size_t i = 0; i < N; i++) {
		double q[3], length = 0;

		for (int a = 0; a < 3; a++) {
			q[a] = p[a][i] + (last(i, a) ? 0 : step * (x[i + stride[a]] - x[i]));
			length += q[a] * q[a];
		}
		length = length > 1 ? sqrt(length) : 1;
		for (int a = 0; a < 3; a++)
			p[a][i] = q[a] / length;
	}
}

static double energy(const float *x, const float *v, double mu)
{
	double e = 0;

	for (size_t i = 0; i < N; i++) {
		double g = 0;

		e += pow((double)x[i] - (double)v[i], 2) / (2 * mu);
		for (int a = 0; a < 3; a++)
			g += last(i, a) ? 0 : pow((double)x[i + stride[a]] - (double)x[i], 2);
		e += sqrt(g);
	}
	return e;
}

static void steps(bool nonnegative)
{
	static double p[3][N], x[N];
	static float pf[3 * N], got[N], again[N];
	const double mu = 0.7;
	struct ct_rof r = {{A, B, C}, pf, (float)mu, nonnegative};
	float *v = normals(N, 5, nonnegative, 1);
	struct ct_err e = {0};
	struct ct_par *par = NULL;
	double worst = 0;

	memset(p, 0, sizeof p);
	memset(pf, 0, sizeof pf);
	for (int k = 0; k < 5; k++) {
		primal(x, v, p, mu, nonnegative);
		dual(p, x, 1 / (12 * mu));
	}
	primal(x, v, p, mu, nonnegative);
	ct_rof_solve(&r, got, v, 2, NULL);
	ct_rof_solve(&r, got, v, 3, NULL);
	for (size_t i = 0; i < N; i++)
		worst = fmax(worst, fabs((double)got[i] - x[i]));
	OK(worst < 1e-5, "five steps, two and then three, %snegative (%.1g)",
		nonnegative ? "not " : "", worst);
	memset(pf, 0, sizeof pf);
	if (ct_par_alloc(&par, 3, &e))
		exit(99);
	ct_rof_solve(&r, again, v, 5, par);
	ct_par_free(par);
	OK(memcmp(got, again, sizeof got) == 0, "the same bytes with three threads");
	free(v);
}

static void optimum(void)
{
	static float p[3 * N], x[N], y[N];
	struct ct_rof r = {{A, B, C}, p, 0.4F, false};
	float *v = normals(N, 6, 0, 1), *d = normals(N, 6, 1, 1e-3);
	double least, most = HUGE_VAL;

	ct_rof_solve(&r, x, v, 3000, NULL);
	least = energy(x, v, 0.4);
	for (int k = -3; k <= 3; k++) {
		for (size_t i = 0; i < N; i++)
			y[i] = x[i] + (float)k * d[i];
		if (k)
			most = fmin(most, energy(y, v, 0.4));
	}
	OK(most > least, "nothing near the solution is better (%.7g, %.7g)", most, least);
	free(v);
	free(d);
}

int main(void)
{
	steps(false);
	steps(true);
	optimum();
	return tap_done();
}
