/* numbers.h: what tests of numbers share: random vectors, differences, the adjoint of an operator.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_TESTS_NUMBERS_H
#define CT_TESTS_NUMBERS_H
#include "core/linear.h"
#include "core/rng.h"
#include "tap.h"

#include <stdint.h>

/* n normal numbers of deviation sd, number i of (seed, stream); free() them. */
__attribute__((unused)) static float *normals(size_t n, uint64_t seed, uint64_t stream, double sd)
{
	float *x = malloc(n * sizeof *x);

	if (!x)
		exit(99);
	ct_rng_normals(n, x, seed, stream, 0);
	for (size_t i = 0; i < n; i++)
		x[i] *= (float)sd;
	return x;
}

__attribute__((unused)) static double dot(size_t n, const float *a, const float *b)
{
	double sum = 0;

	for (size_t i = 0; i < n; i++)
		sum += (double)a[i] * (double)b[i];
	return sum;
}

/* Largest |a - b|, b NULL being zeros; infinite if one is no number. */
__attribute__((unused)) static double maxdiff(size_t n, const float *a, const float *b)
{
	double most = 0;

	for (size_t i = 0; i < n; i++) {
		double d = fabs((double)a[i] - (b ? (double)b[i] : 0));

		most = d >= 0 ? fmax(most, d) : HUGE_VAL;
	}
	return most;
}

/* That over the largest |b|. */
__attribute__((unused)) static double apart(size_t n, const float *a, const float *b)
{
	double most = maxdiff(n, b, NULL);

	return most > 0 ? maxdiff(n, a, b) / most : maxdiff(n, a, b);
}

/* Root of the mean (a - b)^2, b NULL being zeros. */
__attribute__((unused)) static double rms(size_t n, const float *a, const float *b)
{
	double sum = 0;

	for (size_t i = 0; i < n; i++)
		sum += pow((double)a[i] - (b ? (double)b[i] : 0), 2);
	return sqrt(sum / (double)n);
}

/* |<A x, y> - <x, A' y>| / (|A x| |y|) for random x, and y random and along A x in equal parts: of
 * a y that is random alone <A x, y> is so small that a factor of 1.0001 would pass. */
__attribute__((unused)) static double adjoint_error(const struct ct_linear *a)
{
	const struct ct_env env = {0};
	size_t n = a->in, m = ct_linear_out(a);
	float *x = normals(n, 5, 1, 1), *y = normals(m, 5, 2, 1);
	float *ax = normals(m, 5, 3, 1), *aty = normals(n, 5, 4, 1);
	double off, size;

	must(ct_linear_apply(a, ax, x, &env, &err));
	size = sqrt(dot(m, y, y) / dot(m, ax, ax));
	for (size_t i = 0; i < m; i++)
		y[i] += (float)size * ax[i];
	must(ct_linear_adjoint(a, aty, y, &env, &err));
	off = fabs(dot(m, ax, y) - dot(n, x, aty));
	size = sqrt(dot(m, ax, ax) * dot(m, y, y));
	free(x);
	free(y);
	free(ax);
	free(aty);
	return size > 0 ? off / size : HUGE_VAL;
}
#endif
