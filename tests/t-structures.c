/* Structures that one volume shows and the other does not: Gaussian blobs, whose contrast after the
 * difference of Gaussians is known in closed form. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/par.h"
#include "quality/structures.h"
#include "tap.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { N = 60, COUNT = N * N * N };
#define SIGMA 1.5
#define SIGMAS ((const double[3]){SIGMA, SIGMA, SIGMA})
#define SIZE 2.0 /* of a blob */
#define STEP ((double)CT_STRUCTURES_LEAST)

static struct ct_vol ref, test, mask;
static struct ct_structures s;
static struct ct_env env;
static struct ct_err err;

/* Contrast of a blob of 1 HU. */
static double contrast(void)
{
	const double a = SIZE * SIZE, outer = SIGMA * 10 / 3;

	return pow(a / (a + SIGMA * SIGMA), 1.5) - pow(a / (a + outer * outer), 1.5);
}

/* Add a blob of such a contrast, HU. */
static void blob(struct ct_vol *v, double x, double y, double z, double step)
{
	const double at[3] = {x, y, z};

	for (size_t i = 0; i < COUNT; i++) {
		const size_t p[3] = {i % N, i / N % N, i / N / N};
		double r = 0;

		for (int a = 0; a < 3; a++)
			r += pow((double)p[a] - at[a], 2);
		v->data[i] += (float)(step / contrast() * exp(-r / (2 * SIZE * SIZE)));
	}
}

static void flat(float level)
{
	for (size_t i = 0; i < COUNT; i++) {
		ref.data[i] = test.data[i] = level;
		mask.data[i] = 1;
	}
}

static bool counts(size_t bright, size_t dark, size_t missed_bright, size_t missed_dark)
{
	if (ct_structures(&s, &ref, &test, &mask, SIGMAS, &env, &err))
		return false;
	return s.falsely[0] == bright && s.falsely[1] == dark && s.missed[0] == missed_bright &&
	       s.missed[1] == missed_dark;
}

static void blobs(void)
{
	flat(40);
	OK(counts(0, 0, 0, 0) && s.soft == COUNT, "nothing in nothing, all of it soft");
	blob(&test, 15, 15, 15, 1.05 * STEP);
	OK(counts(1, 0, 0, 0), "one that the truth does not have");
	blob(&test, 40, 15, 15, -1.05 * STEP);
	blob(&test, 40, 40, 15, -1.05 * STEP);
	OK(counts(1, 2, 0, 0), "and two dark ones");
	blob(&test, 15, 40, 40, 0.95 * STEP);
	OK(counts(1, 2, 0, 0), "but not a faint one");
	blob(&ref, 15, 15, 15, 0.45 * STEP);
	OK(counts(1, 2, 0, 0), "still false if the truth has less than half of it");
	blob(&ref, 15, 15, 15, 0.1 * STEP);
	OK(counts(0, 2, 0, 0), "not if it has more");
	blob(&ref, 41, 15, 15, -1.05 * STEP);
	OK(counts(0, 1, 0, 0) && s.is[1] == 1 && s.is[0] == 0, "a voxel beside it is there");
	blob(&ref, 40, 40, 40, 1.05 * STEP);
	blob(&ref, 20, 40, 20, -1.05 * STEP);
	OK(counts(0, 1, 1, 1) && s.is[0] == 1 && s.is[1] == 2,
		"what the truth alone has is missed");
	for (size_t i = 0; i < COUNT; i++)
		mask.data[i] = i % N < 30;
	OK(counts(0, 0, 0, 1) && s.soft == COUNT / 2, "where the mask is");
}

static void tissue(void)
{
	flat(200);
	blob(&test, 30, 30, 30, 2 * STEP);
	OK(counts(0, 0, 0, 0) && s.soft == 0, "harder than soft tissue nothing counts");
	flat(-200);
	blob(&test, 30, 30, 30, 2 * STEP);
	OK(counts(0, 0, 0, 0) && s.soft == 0, "nor in fat and air");
	flat(0);
	blob(&ref, 30, 30, 30,
		450 * contrast()); /* 230 HU after the first Gaussian, 23 after the other */
	must(ct_structures(&s, &ref, &test, &mask, SIGMAS, &env, &err));
	OK(s.soft < COUNT && s.soft > COUNT - 2000, "its middle is not soft (%zu voxels)",
		(size_t)COUNT - s.soft);
	flat(0);
	for (size_t i = 0; i < COUNT; i++)
		ref.data[i] = i % N < 30 ? 0 : 1000;
	OK(counts(0, 0, 0, 0) && s.soft > COUNT / 4 && s.soft < COUNT / 2,
		"nor beside an edge (%zu)", s.soft);
}

int main(void)
{
	static const size_t n[3] = {N, N, N};

	if (ct_vol_alloc(&ref, n, &err) || ct_vol_alloc(&test, n, &err) ||
		ct_vol_alloc(&mask, n, &err) || ct_par_alloc(&env.par, 3, &err))
		return 1;
	blobs();
	tissue();
	ct_par_free(env.par);
	ct_vol_free(&ref);
	ct_vol_free(&test);
	ct_vol_free(&mask);
	return tap_done();
}
