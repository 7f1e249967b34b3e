/* What a result has and the truth has not. Structures that one volume shows and the other does not:
 * Gaussian blobs, whose contrast after the difference of Gaussians is known in closed form.
 * Banding: stripes of a known amplitude and period in soft tissue.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/par.h"
#include "core/rng.h"
#include "quality/banding.h"
#include "quality/structures.h"
#include "quality/tissue.h"
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

static void test_structures(void)
{
	static const size_t n[3] = {N, N, N};

	must(ct_vol_alloc(&ref, n, &err));
	must(ct_vol_alloc(&test, n, &err));
	must(ct_vol_alloc(&mask, n, &err));
	must(ct_par_alloc(&env.par, 3, &err));
	blobs();
	tissue();
	ct_par_free(env.par);
	env.par = NULL;
	ct_vol_free(&ref);
	ct_vol_free(&test);
	ct_vol_free(&mask);
}

/* Banding. */
static const size_t size[3] = {32, 36, 80};
static unsigned char *map;
static struct ct_banding b;

/* Soft tissue of 40 HU, beyond x = 24 bone. */
static void layers(void)
{
	for (size_t i = 0; i < ct_vol_count(&ref); i++)
		test.data[i] = ref.data[i] = i % size[0] < 24 ? 40 : 700;
}

static void noise(double hu)
{
	for (size_t i = 0; i < ct_vol_count(&ref); i++)
		test.data[i] += (float)hu * ct_rng_normal(5, 0, i);
}

/* A wave along an axis, of other phase in every tile, in the voxels of x from `from` to `to`. */
static void wave(int axis, double period, double amplitude, size_t from, size_t to)
{
	for (size_t i = 0; i < ct_vol_count(&ref); i++) {
		const size_t at[3] = {i % size[0], i / size[0] % size[1], i / size[0] / size[1]};
		const double phase = (double)(at[(axis + 1) % 3] / 16);

		if (at[0] >= from && at[0] < to)
			test.data[i] += (float)(amplitude *
						cos(2 * M_PI * (double)at[axis] / period + phase));
	}
}

static double run(double x, double y, double z, const struct ct_vol *where)
{
	must(ct_banding(&b, map, &ref, &test, where, (double[]){x, y, z}, &env, &err));
	return b.rms;
}

static void known(void)
{
	static const double periods[] = {3, 4, 5, 3.5, 8};

	layers();
	NEAR(run(1, 1, 4, NULL), 0, 0, "the same volume has none");
	for (size_t p = 0; p < sizeof periods / sizeof *periods; p++) {
		layers();
		wave(2, periods[p], 6, 0, size[0]);
		NEAR(run(1, 1, periods[p], NULL), 6 / sqrt(2), 0.06, "a wave of 6 HU");
		noise(10);
		NEAR(run(1, 1, periods[p], NULL), 6 / sqrt(2), 0.2, "in noise");
	}
	OK(b.axis == 2 && b.pieces == 19 * size[1] * 2, "along z: %zu pieces", b.pieces);
	layers();
	wave(2, 8, 6, 0, size[0]);
	wave(2, 4, 3, 0, size[0]);
	NEAR(run(1, 1, 8, NULL), sqrt(18 + 4.5), 0.06, "a harmonic counts");
	layers();
	for (size_t i = 0; i < ct_vol_count(&ref); i++)
		test.data[i] += i / size[0] / size[1] % 2 ? 3 : -3;
	NEAR(run(1, 1, 2, NULL), 3, 0.03, "every other slice");
	layers();
	wave(0, 4, 6, 0, size[0]);
	wave(1, 4, 2, 0, size[0]);
	NEAR(run(4, 4, 4, NULL), 6 / sqrt(2), 0.06, "of three axes the worst");
	OK(b.axis == 0, "is x");
}

static void none(void)
{
	layers();
	noise(10);
	run(1, 1, 4, NULL);
	OK(b.rms < 0.7, "of noise alone: %g HU", b.rms);
	layers();
	wave(2, 8, 20, 0, size[0]);
	NEAR(run(1, 1, 4, NULL), 0, 0, "of twice the period");
	layers();
	wave(2, 8.0 / 3, 20, 0, size[0]);
	NEAR(run(1, 1, 4, NULL), 0, 0, "between the harmonics");
	layers();
	wave(2, 4, 50, 24, size[0]);
	NEAR(run(1, 1, 4, NULL), 0, 0, "in bone");
	layers();
	wave(2, 4, 6, 8, size[0]);
	for (size_t i = 0; i < ct_vol_count(&mask); i++)
		mask.data[i] = i % size[0] < 8;
	NEAR(run(1, 1, 4, &mask), 0, 0, "outside the mask");
	OK(isnan(run(1, 1, 40, NULL)) && b.pieces == 0 && b.axis == -1, "slices too thick");
	OK(isnan(run(1, 1, 1, NULL)), "no axis refined");
}

static void threads(void)
{
	struct ct_banding one;

	layers();
	wave(2, 4, 6, 0, size[0]);
	noise(10);
	run(1, 1, 4, NULL);
	one = b;
	must(ct_par_alloc(&env.par, 3, &err));
	run(1, 1, 4, NULL);
	OK(memcmp(&one, &b, sizeof b) == 0, "the same bytes with three threads");
	ct_par_free(env.par);
	env.par = NULL;
}

static void test_banding(void)
{
	must(ct_vol_alloc(&ref, size, &err));
	must(ct_vol_alloc(&test, size, &err));
	must(ct_vol_alloc(&mask, size, &err));
	layers();
	must(ct_tissue_map(&map, &ref, 4, &env, &err));
	known();
	none();
	threads();
	free(map);
	ct_vol_free(&ref);
	ct_vol_free(&test);
	ct_vol_free(&mask);
}

int main(void)
{
	test_structures();
	test_banding();
	return tap_done();
}
