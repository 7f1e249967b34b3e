/* Fourier shell correlation: of waves whose frequency and phase are known.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "quality/fsc.h"
#include "core/rng.h"
#include "tap.h"
#include "core/fourier.h"
#include "core/mem.h"

#include <string.h>

static const size_t n[3] = {40, 36, 30};
static struct ct_vol ref, test;
static struct ct_env env;
static struct ct_fsc f;

static void spacing(double x, double y, double z)
{
	const double mm[3] = {x, y, z};

	for (int a = 0; a < 3; a++)
		ref.affine[a][a] = test.affine[a][a] = mm[a];
}

/* v += cos(2 pi cycles (i + phase)/n) along an axis. */
static void wave(struct ct_vol *v, int axis, double cycles, double phase, double size)
{
	for (size_t i = 0; i < ct_vol_count(v); i++) {
		const size_t at[3] = {i % n[0], i / n[0] % n[1], i / n[0] / n[1]};

		v->data[i] +=
			(float)(size * cos(2 * M_PI * cycles * (double)at[axis] / (double)n[axis] +
					       phase));
	}
}

static void noise(struct ct_vol *v)
{
	ct_rng_normals(ct_vol_count(v), v->data, 3, 0, 0);
}

static void run(void)
{
	ct_fsc_free(&f);
	must(ct_fsc(&f, &ref, &test, &env, &err));
}

static bool all(double value)
{
	for (size_t s = 1; s < f.n; s++)
		if (!(fabs(f.value[s] - value) < 1e-6))
			return false;
	return true;
}

static void same(void)
{
	const size_t count = ct_vol_count(&ref);

	spacing(1, 1, 1);
	noise(&ref);
	memcpy(test.data, ref.data, count * sizeof *test.data);
	run();
	OK(all(1) && isnan(ct_fsc_cross(&f, 0.5)), "a volume and itself");
	for (size_t i = 0; i < count; i++)
		test.data[i] = 700 + 3 * ref.data[i];
	run();
	OK(all(1), "contrast and level do not count");
	for (size_t i = 0; i < count; i++)
		test.data[i] = -ref.data[i];
	run();
	OK(all(-1), "its negative");
	NEAR(ct_fsc_cross(&f, 0.5), 0.25 * f.width, 1e-5, "crosses before the first shell");
	memset(test.data, 0, count * sizeof *test.data);
	run();
	OK(all(0), "nothing shares nothing");
}

/* Shells as they should be: of which frequencies the counts are. */
static void shells(double x, double y, double z)
{
	double most = 0;
	size_t bad = 0;

	spacing(x, y, z);
	run();
	most = 0.5 / fmin(x, fmin(y, z));
	NEAR(f.width, fmax(1 / (40 * x), fmax(1 / (36 * y), 1 / (30 * z))), 1e-12,
		"shells as wide as the coarsest step");
	NEAR(f.width * (double)(f.n - 1), most, 0.5 * f.width, "up to the highest frequency");
	for (size_t s = 0; s < f.n; s++) {
		double count = 0;

		for (int k = -15; k < 15; k++)
			for (int j = -18; j < 18; j++)
				for (int i = -20; i < 20; i++) {
					const double r =
						sqrt(pow(i / (40 * x), 2) + pow(j / (36 * y), 2) +
							pow(k / (30 * z), 2)) /
						f.width;

					count += r >= (double)s - 0.5 && r < (double)s + 0.5;
				}
		bad += count != f.count[s];
	}
	OK(bad == 0, "every frequency in its shell");
}

/* Two waves, the second a quarter of a wave apart: it is shared no longer. */
static void waves(int axis, double low, double high)
{
	double spaces[3];
	size_t at[2];

	ct_vol_spacing(&ref, spaces);
	memset(ref.data, 0, ct_vol_count(&ref) * sizeof *ref.data);
	memset(test.data, 0, ct_vol_count(&ref) * sizeof *ref.data);
	wave(&ref, axis, low, 0.3, 100);
	wave(&test, axis, low, 0.3, 100);
	wave(&ref, axis, high, 0.3, 30);
	wave(&test, axis, high, 0.3 + M_PI / 2, 30);
	run();
	for (int k = 0; k < 2; k++)
		at[k] = (size_t)((k ? high : low) / ((double)n[axis] * spaces[axis]) / f.width +
				 0.5);
	NEAR(f.value[at[0]], 1, 1e-4, "a wave that both have");
	NEAR(f.value[at[1]], 0, 1e-4, "one a quarter apart");
}

/* An axis of one voxel has no frequencies, whatever its spacing; one voxel has none at all. */
static void thin(void)
{
	struct ct_vol a = {0}, b = {0};
	size_t count = 0;

	must(ct_vol_alloc(&a, (const size_t[3]){40, 1, 35}, &err) ||
		ct_vol_alloc(&b, (const size_t[3]){1, 1, 1}, &err));
	ct_rng_normals(40 * 35, a.data, 3, 0, 0);
	a.affine[1][1] = 0.25;
	ct_fsc_free(&f);
	must(ct_fsc(&f, &a, &a, &env, &err));
	for (size_t s = 0; s < f.n; s++)
		count += (size_t)f.count[s];
	OK(all(1) && f.n == 19 && count > 1000 && count < 1400, "one voxel thick (%zu of %zu)", f.n,
		count);
	NEAR(f.width, 1. / 35, 1e-12, "no frequency across");
	ct_fsc_free(&f);
	OK(ct_fsc(&f, &b, &b, &env, &err) == -1 && err.code == CT_EGEOM, "one voxel is refused");
	ct_vol_free(&a);
	ct_vol_free(&b);
}

/* Transforms of any length against direct sums. */

enum { MOST = 360, WIDE = 8 };

static double re[MOST * WIDE], im[MOST * WIDE], from[2][MOST * WIDE], work[2 * MOST * WIDE];

/* Largest difference of the transforms of w random lines of count from their sums. */
static double miss(size_t count, size_t w)
{
	struct ct_fourier forward;
	float z[2 * MOST * WIDE];
	double most = 0;

	must(ct_fourier_plan(&forward, count, &err));
	ct_rng_normals(2 * count * w, z, 7, 0, 0);
	for (size_t i = 0; i < count * w; i++) {
		re[i] = from[0][i] = (double)z[2 * i];
		im[i] = from[1][i] = (double)z[2 * i + 1];
	}
	CT_SIMD(ct_fourier_apply)(&forward, w, re, im, work);
	ct_fourier_free(&forward);
	for (size_t l = 0; l < w; l++)
		for (size_t k = 0; k < count; k++) {
			double x = 0, y = 0;

			for (size_t t = 0; t < count; t++) {
				const double a = -2 * M_PI * (double)(k * t % count) /
						 (double)count,
					     p = from[0][t * w + l], q = from[1][t * w + l];

				x += p * cos(a) - q * sin(a);
				y += p * sin(a) + q * cos(a);
			}
			most = fmax(most, hypot(re[k * w + l] - x, im[k * w + l] - y));
		}
	return most;
}

static void t_fourier(void)
{
	static const size_t sizes[] = {
		1, 2, 3, 4, 5, 6, 7, 8, 9, 12, 15, 16, 31, 32, 49, 60, 64, 97, 128, 250, 256, 360};

	for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
		const double one = miss(sizes[i], 1), three = miss(sizes[i], 3),
			     all = miss(sizes[i], WIDE);

		OK(one < 1e-12 * (double)sizes[i] && three < 1e-12 * (double)sizes[i] &&
				all < 1e-12 * (double)sizes[i],
			"%zu samples (%.1e)", sizes[i], fmax(one, fmax(three, all)));
	}
}

int main(void)
{
	struct ct_fsc one = {0};
	double cross;

	must(ct_vol_alloc(&ref, n, &err) || ct_vol_alloc(&test, n, &err) ||
		ct_par_alloc(&env.par, 3, &err));
	same();
	thin();
	shells(1.01, 1.03, 0.97);
	shells(0.71, 0.69, 2.5);
	waves(0, 4, 15);
	waves(1, 4, 14);
	spacing(0.71, 0.69, 2.5);
	waves(2, 3, 12);
	noise(&ref);
	for (size_t i = 0; i < ct_vol_count(&ref); i++)
		test.data[i] = ref.data[i] + (i % 2 ? 1.0F : -0.5F) * ref.data[i * 7 % 43200];
	run();
	cross = ct_fsc_cross(&f, 0.9);
	must(ct_fsc(&one, &ref, &test, &(struct ct_env){0}, &err));
	OK(cross > 0 && cross == ct_fsc_cross(&one, 0.9) &&
			memcmp(one.value, f.value, f.n * sizeof *f.value) == 0,
		"1 and 3 threads, same bytes");
	ct_fsc_free(&one);
	for (size_t s = 0; s < f.n; s++)
		f.value[s] = s < 4 ? 1 : 0.2;
	NEAR(ct_fsc_cross(&f, 0.5), f.width * 3.625, 1e-12, "crosses between two shells");
	ct_fsc_free(&f);
	ct_par_free(env.par);
	ct_vol_free(&ref);
	ct_vol_free(&test);
	t_fourier();
	return tap_done();
}
