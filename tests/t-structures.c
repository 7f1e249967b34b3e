/* What a result has and the truth has not. Structures that one volume shows and the other does not:
 * Gaussian blobs, whose contrast after the difference of Gaussians is known in closed form.
 * Banding: stripes of a known amplitude and period in soft tissue.
 * Tissues: slabs of one value each, and what is deep, looked for voxel by voxel.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/par.h"
#include "core/rng.h"
#include "operator/degrade.h"
#include "operator/regrid.h"
#include "quality/banding.h"
#include "quality/structures.h"
#include "quality/tissue.h"
#include "tap.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { N = 60, COUNT = N * N * N, INSIDE = (N - 2) * (N - 2) * (N - 2) };
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
	OK(counts(0, 0, 0, 0) && s.soft == INSIDE, "nothing in nothing, all of it soft");
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
	OK(counts(0, 0, 0, 1) && s.soft == INSIDE / (N - 2) * 29, "where the mask is");
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
	OK(s.soft < INSIDE && s.soft > INSIDE - 2000, "its middle is not soft (%zu voxels)",
		(size_t)INSIDE - s.soft);
	flat(0);
	for (size_t i = 0; i < COUNT; i++)
		ref.data[i] = i % N < 30 ? 0 : 1000;
	OK(counts(0, 0, 0, 0) && s.soft > COUNT / 4 && s.soft < COUNT / 2,
		"nor beside an edge (%zu)", s.soft);
}

static void one_slice(void)
{
	flat(0);
	blob(&test, 30, 20, 0, 5 * STEP);
	blob(&ref, 40, 40, 0, 5 * STEP);
	ref.n[2] = test.n[2] = mask.n[2] = 1;
	OK(counts(1, 0, 1, 0) && s.soft == (N - 2) * (N - 2), "a single slice is searched, too");
	ref.n[2] = test.n[2] = mask.n[2] = 2;
	OK(counts(1, 0, 1, 0) && s.soft == 2 * (N - 2) * (N - 2), "as are two slices");
	ref.n[2] = test.n[2] = mask.n[2] = N;
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
	one_slice();
	ct_par_free(env.par);
	env.par = NULL;
	ct_vol_free(&ref);
	ct_vol_free(&test);
	ct_vol_free(&mask);
}

/* Banding. */
static const size_t banded[3] = {32, 36, 80};
static unsigned char *map;
static struct ct_banding b;

/* Soft tissue of 40 HU, beyond x = 24 bone. */
static void layers(void)
{
	for (size_t i = 0; i < ct_vol_count(&ref); i++)
		test.data[i] = ref.data[i] = i % banded[0] < 24 ? 40 : 700;
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
		const size_t at[3] = {
			i % banded[0], i / banded[0] % banded[1], i / banded[0] / banded[1]};
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
		wave(2, periods[p], 6, 0, banded[0]);
		NEAR(run(1, 1, periods[p], NULL), 6 / sqrt(2), 0.06, "a wave of 6 HU");
		noise(10);
		NEAR(run(1, 1, periods[p], NULL), 6 / sqrt(2), 0.2, "in noise");
	}
	OK(b.axis == 2 && b.pieces == 19 * banded[1] * 2, "along z: %zu pieces", b.pieces);
	layers();
	wave(2, 8, 6, 0, banded[0]);
	wave(2, 4, 3, 0, banded[0]);
	NEAR(run(1, 1, 8, NULL), sqrt(18 + 4.5), 0.06, "a harmonic counts");
	layers();
	for (size_t i = 0; i < ct_vol_count(&ref); i++)
		test.data[i] += i / banded[0] / banded[1] % 2 ? 3 : -3;
	NEAR(run(1, 1, 2, NULL), 3, 0.03, "every other slice");
	layers();
	wave(0, 4, 6, 0, banded[0]);
	wave(1, 4, 2, 0, banded[0]);
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
	wave(2, 8, 20, 0, banded[0]);
	NEAR(run(1, 1, 4, NULL), 0, 0, "of twice the period");
	layers();
	wave(2, 8.0 / 3, 20, 0, banded[0]);
	NEAR(run(1, 1, 4, NULL), 0, 0, "between the harmonics");
	layers();
	wave(2, 4, 50, 24, banded[0]);
	NEAR(run(1, 1, 4, NULL), 0, 0, "in bone");
	layers();
	wave(2, 4, 6, 8, banded[0]);
	for (size_t i = 0; i < ct_vol_count(&mask); i++)
		mask.data[i] = i % banded[0] < 8;
	NEAR(run(1, 1, 4, &mask), 0, 0, "outside the mask");
	OK(isnan(run(1, 1, 40, NULL)) && b.pieces == 0 && b.axis == -1, "slices too thick");
	OK(isnan(run(1, 1, 1, NULL)), "no axis refined");
}

static void threads(void)
{
	struct ct_banding one;

	layers();
	wave(2, 4, 6, 0, banded[0]);
	noise(10);
	run(1, 1, 4, NULL);
	one = b;
	must(ct_par_alloc(&env.par, 3, &err));
	run(1, 1, 4, NULL);
	OK(memcmp(&one, &b, sizeof b) == 0, "the same bytes with three threads");
	ct_par_free(env.par);
	env.par = NULL;
}

/* The last: the volumes are stored from other ends, in another order. */
static void stored_otherwise(void)
{
	static const int axis[3] = {1, 2, 0}, sign[3] = {-1, 1, -1};
	struct ct_banding one;
	double share[2];
	size_t voxels[2];

	layers();
	wave(2, 4, 1, 0, banded[0] / 4);
	noise(1);
	run(1, 1, 4, NULL);
	one = b;
	must(ct_tissue_flat(&share[0], &voxels[0], map, &test, NULL, 1, &env, &err));
	must(ct_regrid_turn(&ref, axis, sign, &err) || ct_regrid_turn(&test, axis, sign, &err));
	free(map);
	must(ct_tissue_map(&map, &ref, 4, &env, &err));
	NEAR(run(1, 4, 1, NULL), one.rms, 1e-9, "banding of a volume that is stored otherwise");
	OK(b.axis == 1 && b.pieces == one.pieces && b.rms > 0, "in as many pieces: %zu", b.pieces);
	must(ct_tissue_flat(&share[1], &voxels[1], map, &test, NULL, 1, &env, &err));
	OK(share[0] == share[1] && voxels[0] == voxels[1] && share[0] > 0,
		"and the same share is without texture: %g, %g", share[0], share[1]);
}

static void test_banding(void)
{
	must(ct_vol_alloc(&ref, banded, &err));
	must(ct_vol_alloc(&test, banded, &err));
	must(ct_vol_alloc(&mask, banded, &err));
	layers();
	must(ct_tissue_map(&map, &ref, 4, &env, &err));
	known();
	none();
	threads();
	stored_otherwise();
	free(map);
	map = NULL;
	ct_vol_free(&ref);
	ct_vol_free(&test);
	ct_vol_free(&mask);
}

static void t_structures(void)
{
	test_structures();
	test_banding();
}

static const size_t n[3] = {70, 22, 20};
static struct ct_tissue_errors errors;

static void make(size_t deep)
{
	free(map);
	must(ct_tissue_map(&map, &ref, deep, &env, &err));
}

static void measure(const struct ct_vol *in)
{
	must(ct_tissue_errors(&errors, map, &ref, &test, in, &env, &err));
}

static bool is(size_t i, enum ct_tissue t)
{
	return map[i] >> t & 1;
}

/* Slabs of ten along x. */
static void slabs(void)
{
	static const float hu[7] = {-1000, -700, -100, 40, 100, 200, 700};
	static const unsigned want[7] = {1 << CT_TISSUE_AIR, 1 << CT_TISSUE_LUNG,
		1 << CT_TISSUE_FAT, 1 << CT_TISSUE_SOFT | 1 << CT_TISSUE_BRAIN, 1 << CT_TISSUE_SOFT,
		0, 1 << CT_TISSUE_BONE};
	static const double from[] = {-950, -500, -190, -30, 15, 60, 150, 300};
	const unsigned below[] = {want[0], want[1], 0, want[2], want[4], want[3], want[4], 0},
		       above[] = {want[1], 0, want[2], want[4], want[3], want[4], 0, want[6]};
	bool good = true;

	for (size_t i = 0; i < ct_vol_count(&ref); i++) {
		ref.data[i] = hu[i % n[0] / 10];
		test.data[i] = ref.data[i] + (float)(i % n[0] / 10) + (i % 2 ? 1.0F : -1.0F);
	}
	make(4);
	for (size_t i = 0; i < ct_vol_count(&ref); i++)
		if (i % 10 == 5)
			good = good && (map[i] & ~(1u << CT_TISSUE_DEEP)) == want[i % n[0] / 10];
	OK(good, "the middles of slabs are what their HU say");
	for (size_t k = 0; k < sizeof from / sizeof *from; k++) {
		for (size_t i = 0; i < ct_vol_count(&ref); i++)
			ref.data[i] = (float)from[k];
		make(4);
		OK((map[0] & 0x3f) == above[k], "the lower end of a range is in it, the upper not");
		for (size_t i = 0; i < ct_vol_count(&ref); i++)
			ref.data[i] = (float)from[k] + (i % n[0] < 35 ? -0.01F : 0.01F);
		make(4);
		OK((map[0] & 0x3f) == below[k] && (map[69] & 0x3f) == above[k],
			"another tissue beyond %g HU", from[k]);
	}
}

/* How many voxels are deep where they should not, or the reverse. */
static size_t wrong(long deep)
{
	const long size[3] = {(long)n[0], (long)n[1], (long)n[2]};
	size_t bad = 0;

	for (long i = 0; i < size[0] * size[1] * size[2]; i++) {
		const long at[3] = {i % size[0], i / size[0] % size[1], i / size[0] / size[1]};
		bool all = true;

		for (long z = at[2] - deep; z <= at[2] + deep; z++)
			for (long y = at[1] - deep; y <= at[1] + deep; y++)
				for (long x = at[0] - deep; x <= at[0] + deep; x++)
					if (x >= 0 && x < size[0] && y >= 0 && y < size[1] &&
						z >= 0 && z < size[2])
						all = all &&
						      is((size_t)((z * size[1] + y) * size[0] + x),
							      CT_TISSUE_SOFT);
		bad += all != is((size_t)i, CT_TISSUE_DEEP);
	}
	return bad;
}

static void depth(void)
{
	static const size_t spots[] = {3000, 9001, 15555, 22222, 30100};
	static const size_t deep[] = {0, 1, 4, 7};

	for (size_t i = 0; i < ct_vol_count(&ref); i++)
		ref.data[i] = 40;
	for (size_t k = 0; k < sizeof spots / sizeof *spots; k++)
		ref.data[spots[k]] = 6000;
	for (size_t k = 0; k < sizeof deep / sizeof *deep; k++) {
		make(deep[k]);
		measure(NULL);
		OK(wrong((long)deep[k]) == 0, "%zu deep (%zu voxels)", deep[k],
			errors.row[CT_TISSUE_DEEP].voxels);
	}
}

static void wrongs(void)
{
	double one;

	for (size_t i = 0; i < ct_vol_count(&ref); i++) {
		const bool odd = (i % n[0] + i / n[0] + i / n[0] / n[1]) % 2;

		ref.data[i] = i % n[0] < 35 ? 40 : 700;
		test.data[i] = ref.data[i] + (i % n[0] < 35 ? 3 : -20) + (odd ? 4.0F : -4.0F);
		mask.data[i] = i % n[0] < 36;
	}
	make(4);
	measure(NULL);
	NEAR(errors.row[CT_TISSUE_SOFT].bias, 3, 0.01, "mean error in soft tissue");
	NEAR(errors.row[CT_TISSUE_SOFT].rmse, 5, 0.01, "root mean square");
	NEAR(errors.row[CT_TISSUE_BONE].bias, -20, 0.8, "mean error in bone");
	NEAR(errors.row[CT_TISSUE_DEEP].rmse, 5, 1e-3, "root mean square, deep");
	NEAR(errors.smooth, 3, 1e-3, "a checkerboard is gone under the Gaussian");
	OK(errors.row[CT_TISSUE_LUNG].voxels == 0 && isnan(errors.row[CT_TISSUE_LUNG].rmse) &&
			isnan(errors.row[CT_TISSUE_LUNG].bias),
		"no lung, no number");
	one = errors.smooth;
	env.par = NULL;
	measure(NULL);
	OK(errors.smooth == one, "1 and 3 threads, the same");
	measure(&mask);
	OK(errors.row[CT_TISSUE_BONE].voxels == n[1] * n[2], "in the mask only (%zu)",
		errors.row[CT_TISSUE_BONE].voxels);
}

static void flat_parts(void)
{
	static const size_t steps[3] = {1, 70, 70 * 22};
	double share;
	size_t voxels;

	for (size_t i = 0; i < ct_vol_count(&ref); i++) {
		ref.data[i] = 40;
		mask.data[i] = i % n[0] < 30;
	}
	make(1);
	must(ct_tissue_flat(&share, &voxels, map, &ref, NULL, 0.5, &env, &err));
	OK(share == 1 && voxels == 69 * 21 * 19, "all is flat, but for the last (%zu)", voxels);
	for (int a = 0; a < 3; a++) {
		for (size_t i = 0; i < ct_vol_count(&ref); i++)
			test.data[i] = 0.75F * (float)(i / steps[a] % n[a]);
		must(ct_tissue_flat(&share, &voxels, map, &test, NULL, 0.75, &env, &err));
		OK(share == 0, "a ramp is not");
		must(ct_tissue_flat(&share, &voxels, map, &test, NULL, 0.751, &env, &err));
		OK(share == 1, "unless its steps are smaller");
	}
	for (size_t i = 0; i < ct_vol_count(&ref); i++)
		test.data[i] = i % n[0] < 15 ? 0 : -2.0F * (float)(i % n[0]);
	must(ct_tissue_flat(&share, &voxels, map, &test, &mask, 0.5, &env, &err));
	OK(share == 14.0 / 30 && voxels == 30 * 21 * 19, "a part is, in the mask (%g)", share);
	memset(mask.data, 0, ct_vol_count(&ref) * sizeof *mask.data);
	must(ct_tissue_flat(&share, &voxels, map, &test, &mask, 0.5, &env, &err));
	OK(isnan(share) && voxels == 0, "of nothing no number");
}

static void thin(void)
{
	static const size_t sizes[3][3] = {{1, 9, 8}, {9, 1, 8}, {9, 8, 1}};
	double share;
	size_t voxels;

	for (int a = 0; a < 3; a++) {
		struct ct_vol v = {0};

		must(ct_vol_alloc(&v, sizes[a], &err));
		memset(v.data, 0, 72 * sizeof *v.data);
		free(map);
		must(ct_tissue_map(&map, &v, 2, &env, &err));
		must(ct_tissue_flat(&share, &voxels, map, &v, NULL, 0.5, &env, &err));
		OK(share == 1 && voxels == 8 * 7, "one voxel thick (%zu)", voxels);
		ct_vol_free(&v);
	}
}

/* A wave along an axis is exp(-k^2 sigma^2/2) of it. */
static void smooth(void)
{
	static const double sigma[3] = {1, 1.5, 2.5};

	for (int a = 0; a < 3; a++) {
		const double wave = M_PI * 4 / (double)n[a];
		double most = 0;

		for (size_t i = 0; i < ct_vol_count(&ref); i++) {
			const size_t at[3] = {i % n[0], i / n[0] % n[1], i / n[0] / n[1]};

			ref.data[i] = (float)cos(wave * ct_cell_centre((double)at[a]));
		}
		must(ct_degrade_smooth(test.data, ref.data, n, sigma, env.par, &err));
		for (size_t i = 0; i < ct_vol_count(&ref); i++)
			most = fmax(most,
				fabs((double)test.data[i] -
					(double)ref.data[i] * exp(-0.5 * pow(wave * sigma[a], 2))));
		NEAR(most, 0, 1e-3, "a Gaussian of its own along each axis");
	}
}

int main(void)
{
	struct ct_par *par;

	t_structures();
	must(ct_vol_alloc(&ref, n, &err) || ct_vol_alloc(&test, n, &err) ||
		ct_vol_alloc(&mask, n, &err) || ct_par_alloc(&env.par, 3, &err));
	par = env.par;
	slabs();
	depth();
	wrongs();
	flat_parts();
	thin();
	smooth();
	free(map);
	ct_par_free(par);
	ct_vol_free(&ref);
	ct_vol_free(&test);
	ct_vol_free(&mask);
	return tap_done();
}
