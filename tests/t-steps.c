/* Plain steps: what would soften one is left out of an expectation, and nothing else.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "restore/steps.h"
#include "tests/tap.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { X = 26, Y = 24, Z = 30, ALL = X * Y * Z };

/* Of a distance from a plane, voxels. */
typedef double shape_fn(double d);

static double sharp(double d)
{
	return 1000 * fmin(fmax(d + 0.5, 0), 1);
}

static double blurred(double d)
{
	return (sharp(d - 1) + 2 * sharp(d) + sharp(d + 1)) / 4;
}

static double sharper(double d)
{
	return 2 * sharp(d) - blurred(d);
}

static double beyond(double d)
{
	return sharp(d + 0.3);
}

static double bar(double d)
{
	return sharp(d + 1) - sharp(d - 1);
}

static double bar_blurred(double d)
{
	return blurred(d + 1) - blurred(d - 1);
}

/* The distance of voxel i from an oblique plane through the middle. */
static double distance(size_t i, double dx, double dy, double dz)
{
	const double length = sqrt(dx * dx + dy * dy + dz * dz);

	return (((double)(i % X) - X / 2.0) * dx + ((double)(i / X % Y) - Y / 2.0) * dy +
		       ((double)(i / X / Y) - Z / 2.0) * dz) /
	       length;
}

/* How much of h = is - was, of planes, is left: of its sum of squares. */
static double left(const double plane[3], shape_fn *was, shape_fn *is, double limit, double noise)
{
	float *x = malloc(2 * ALL * sizeof *x), *h = x + ALL;
	struct ct_steps s = {h, x, {X, Y, Z}, 4, limit};
	double before = 0, after = 0;

	if (!x)
		exit(99);
	for (size_t i = 0; i < ALL; i++) {
		const double d = distance(i, plane[0], plane[1], plane[2]);

		x[i] = (float)(was(d) + noise * (double)ct_rng_normal(1, 0, i));
		h[i] = (float)(is(d) - was(d));
		before += (double)h[i] * (double)h[i];
	}
	ct_steps_keep(&s, NULL);
	for (size_t i = 0; i < ALL; i++)
		after += (double)h[i] * (double)h[i];
	free(x);
	return after / before;
}

static void kinds(void)
{
	static const double planes[][3] = {{1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {1, 2, -1}, {3, 1, 2}};

	for (size_t k = 0; k < sizeof planes / sizeof *planes; k++) {
		const double *p = planes[k];
		double soft = left(p, sharp, blurred, 0.05, 0);
		double back = left(p, sharp, sharper, 0.05, 0);
		double moved = left(p, sharp, beyond, 0.05, 0);
		double thin = left(p, bar, bar_blurred, 0.05, 0);
		double rough = left(p, sharp, blurred, 0.05, 300);

		OK(soft < 0.15, "plane %zu: what softens a step is left out (%.3f is left)", k,
			soft);
		OK(back > 0.999, "what sharpens it stays (%.3f)", back);
		OK(moved > 0.6, "most of what moves it stays (%.3f)", moved);
		OK(thin > 0.85, "a bar is no step (%.3f)", thin);
		OK(rough > 0.8, "nor is one between no plateaus (%.3f)", rough);
	}
	OK(left(planes[3], sharp, blurred, 0.01, 20) >
			left(planes[3], sharp, blurred, 0.1, 20) + 0.3,
		"the limit says what a plateau is");
}

static void threads(void)
{
	static const size_t cells[] = {2, 3, 4, 8};
	float *x = malloc(3 * ALL * sizeof *x), *a = x + ALL, *b = a + ALL;
	struct ct_par *par = NULL;

	if (!x || ct_par_alloc(&par, 3, &err))
		exit(99);
	for (size_t i = 0; i < ALL; i++) {
		x[i] = (float)sharp(distance(i, 1, 1, -2));
		a[i] = b[i] = (float)(100 * (double)ct_rng_normal(2, 0, i));
	}
	for (size_t k = 0; k < 4; k++) {
		struct ct_steps s[] = {
			{a, x, {X, Y, Z}, cells[k], 0.05}, {b, x, {X, Y, Z}, cells[k], 0.05}};

		ct_steps_keep(&s[0], NULL);
		ct_steps_keep(&s[1], par);
		OK(memcmp(a, b, ALL * sizeof *a) == 0,
			"blocks of %zu: any number of threads, the same bytes", cells[k]);
	}
	ct_par_free(par);
	free(x);
}

int main(void)
{
	kinds();
	threads();
	return tap_done();
}
