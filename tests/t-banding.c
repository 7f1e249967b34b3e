/* Banding: stripes of a known amplitude and period in soft tissue.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "quality/banding.h"
#include "quality/tissue.h"
#include "tap.h"

#include <string.h>

static const size_t n[3] = {32, 36, 80};
static struct ct_vol ref, test, mask;
static struct ct_env env;
static unsigned char *map;
static struct ct_banding b;

/* Soft tissue of 40 HU, beyond x = 24 bone. */
static void flat(void)
{
	for (size_t i = 0; i < ct_vol_count(&ref); i++)
		test.data[i] = ref.data[i] = i % n[0] < 24 ? 40 : 700;
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
		const size_t at[3] = {i % n[0], i / n[0] % n[1], i / n[0] / n[1]};
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

	flat();
	NEAR(run(1, 1, 4, NULL), 0, 0, "the same volume has none");
	for (size_t p = 0; p < sizeof periods / sizeof *periods; p++) {
		flat();
		wave(2, periods[p], 6, 0, n[0]);
		NEAR(run(1, 1, periods[p], NULL), 6 / sqrt(2), 0.06, "a wave of 6 HU");
		noise(10);
		NEAR(run(1, 1, periods[p], NULL), 6 / sqrt(2), 0.2, "in noise");
	}
	OK(b.axis == 2 && b.pieces == 19 * n[1] * 2, "along z: %zu pieces", b.pieces);
	flat();
	wave(2, 8, 6, 0, n[0]);
	wave(2, 4, 3, 0, n[0]);
	NEAR(run(1, 1, 8, NULL), sqrt(18 + 4.5), 0.06, "a harmonic counts");
	flat();
	for (size_t i = 0; i < ct_vol_count(&ref); i++)
		test.data[i] += i / n[0] / n[1] % 2 ? 3 : -3;
	NEAR(run(1, 1, 2, NULL), 3, 0.03, "every other slice");
	flat();
	wave(0, 4, 6, 0, n[0]);
	wave(1, 4, 2, 0, n[0]);
	NEAR(run(4, 4, 4, NULL), 6 / sqrt(2), 0.06, "of three axes the worst");
	OK(b.axis == 0, "is x");
}

static void none(void)
{
	flat();
	noise(10);
	run(1, 1, 4, NULL);
	OK(b.rms < 0.7, "of noise alone: %g HU", b.rms);
	flat();
	wave(2, 8, 20, 0, n[0]);
	NEAR(run(1, 1, 4, NULL), 0, 0, "of twice the period");
	flat();
	wave(2, 8.0 / 3, 20, 0, n[0]);
	NEAR(run(1, 1, 4, NULL), 0, 0, "between the harmonics");
	flat();
	wave(2, 4, 50, 24, n[0]);
	NEAR(run(1, 1, 4, NULL), 0, 0, "in bone");
	flat();
	wave(2, 4, 6, 8, n[0]);
	for (size_t i = 0; i < ct_vol_count(&mask); i++)
		mask.data[i] = i % n[0] < 8;
	NEAR(run(1, 1, 4, &mask), 0, 0, "outside the mask");
	OK(isnan(run(1, 1, 40, NULL)) && b.pieces == 0 && b.axis == -1, "slices too thick");
	OK(isnan(run(1, 1, 1, NULL)), "no axis refined");
}

static void threads(void)
{
	struct ct_banding one;

	flat();
	wave(2, 4, 6, 0, n[0]);
	noise(10);
	run(1, 1, 4, NULL);
	one = b;
	must(ct_par_alloc(&env.par, 3, &err));
	run(1, 1, 4, NULL);
	OK(memcmp(&one, &b, sizeof b) == 0, "the same bytes with three threads");
	ct_par_free(env.par);
	env.par = NULL;
}

int main(void)
{
	must(ct_vol_alloc(&ref, n, &err));
	must(ct_vol_alloc(&test, n, &err));
	must(ct_vol_alloc(&mask, n, &err));
	flat();
	must(ct_tissue_map(&map, &ref, 4, &env, &err));
	known();
	none();
	threads();
	free(map);
	ct_vol_free(&ref);
	ct_vol_free(&test);
	ct_vol_free(&mask);
	return tap_done();
}
