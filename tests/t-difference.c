/* Sums over voxels, of the whole and of every slice, against plain loops. Fourier shell
 * correlation: of waves whose frequency and phase are known. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/fourier.h"
#include "core/mem.h"
#include "core/rng.h"
#include "quality/data-residual.h"
#include "quality/difference.h"
#include "quality/fsc.h"
#include "numbers.h"
#include "tap.h"

#include <stdlib.h>
#include <string.h>

enum { MOST = 41 * 7 * 5 };

static const struct ct_ssim_map map = {-300, 900, 1150, 1.0 / 700};
static float ref[MOST], test[MOST], mask[MOST];

static double mapped(float v)
{
	return (fmin(fmax((double)v, map.lo), map.hi) - map.zero) * map.scale;
}

/* The sums of the voxels whose index along axis a is k; of all if a is 3. */
static struct ct_sums plain(const size_t n[3], bool masked, int a, size_t k)
{
	const size_t step[3] = {1, n[0], n[0] * n[1]};
	struct ct_sums s = {0};

	for (size_t i = 0; i < n[0] * n[1] * n[2]; i++) {
		const size_t at[3] = {i % n[0], i / n[0] % n[1], i / step[2]};
		const double d = (double)test[i] - (double)ref[i];

		if (a < 3 && at[a] != k)
			continue;
		s.top = fmax(s.top, fmax(fabs((double)ref[i]), fabs((double)test[i])));
		if (masked && mask[i] == 0.0f)
			continue;
		s.count++;
		s.square += d * d;
		s.abs += fabs(d);
		s.diff += d;
		s.max = fmax(s.max, fabs(d));
		s.mapped += pow(mapped(test[i]) - mapped(ref[i]), 2);
		for (int b = 0; b < 3; b++) {
			const size_t j = i + step[b];

			if (at[b] + 1 == n[b] || (masked && mask[j] == 0.0f))
				continue;
			s.pairs[b]++;
			s.gradient[b] += pow((double)test[j] - (double)ref[j] - d, 2);
		}
	}
	return s;
}

static bool near(double a, double b)
{
	return fabs(a - b) <= 1e-10 * (1 + fabs(b));
}

/* Are they the same? Of slices across an axis only what they have. */
static bool same_sums(const struct ct_sums *s, struct ct_sums want, int axis)
{
	bool ok = s->count == want.count && near(s->square, want.square) &&
		  near(s->abs, want.abs) && near(s->diff, want.diff) &&
		  near(s->mapped, want.mapped);

	if (axis > 0)
		ok = ok && s->max == want.max && s->top == want.top;
	for (int b = 0; b < 3; b++)
		if (axis == 3 || b == axis)
			ok = ok && s->pairs[b] == want.pairs[b] &&
			     near(s->gradient[b], want.gradient[b]);
	return ok;
}

static bool any_above(const size_t n[3], int a, size_t k)
{
	const size_t step[3] = {1, n[0], n[0] * n[1]};

	for (size_t i = 0; i < n[0] * n[1] * n[2]; i++)
		if (i / step[a] % n[a] == k && (double)ref[i] > map.zero)
			return true;
	return false;
}

static void compare(const size_t n[3], bool masked, bool slices)
{
	const struct ct_env env = {0};
	struct ct_difference d;
	bool whole, parts = true, above = true;
	size_t seen = 0;

	must(ct_difference(&d, n, ref, test, masked ? mask : NULL, &map, slices, true, &env, &err));
	whole = same_sums(&d.total, plain(n, masked, 3, 0), 3);
	for (int a = 0; a < 3; a++) {
		parts = parts && (a == 2 || slices) == (d.slice[a] != NULL);
		for (size_t k = 0; k < n[a]; k++) {
			if (d.slice[a])
				parts = parts &&
					same_sums(&d.slice[a][k], plain(n, masked, a, k), a);
			above = above && d.above[a][k] == any_above(n, a, k);
			seen += d.above[a][k];
		}
	}
	OK(whole && parts, "%zux%zux%zu%s%s: all sums", n[0], n[1], n[2], masked ? ", masked" : "",
		slices ? ", slices" : "");
	OK(above && seen > 0 && seen < n[0] + n[1] + n[2],
		"and slices with a voxel above the zero of the map: %zu", seen);
	ct_difference_free(&d);
}

/* What is not finite shows, even where the mask is 0. */
static void test_not_finite(void)
{
	const size_t n[3] = {11, 2, 2};
	const struct ct_env env = {0};
	struct ct_difference d;
	bool shows = true;

	memset(mask, 0, sizeof mask);
	mask[3] = 1;
	for (size_t i = 0; i < 44; i++) {
		float *v = i % 3 ? ref : test, was = v[i];

		v[i] = i % 2 ? NAN : INFINITY;
		must(ct_difference(&d, n, ref, test, mask, &map, false, false, &env, &err));
		shows = shows && !isfinite(d.total.square) && !d.above[0];
		ct_difference_free(&d);
		v[i] = was;
	}
	OK(shows,
		"a voxel that is not finite is seen, counted or not; nothing else unless asked for");
}

/* The data residual: residuals that are known, order statistics, and grids that do not fit. */

static const size_t fine[3] = {26, 21, 17};
static const struct ct_degrade cells = {{4, 3, 2}, {1.1, 0.6, 0}, CT_DECIMATE_MEAN, {0}};

static void make(struct ct_vol *hi, struct ct_vol *lo)
{
	struct ct_separable s = {0};
	struct ct_err e;
	size_t n[3];

	*hi = *lo = (struct ct_vol){0};
	if (ct_vol_alloc(hi, fine, &e) || ct_degrade_plan(&s, &cells, fine, NULL, &e))
		exit(1);
	for (size_t i = 0; i < ct_vol_count(hi); i++)
		hi->data[i] = 500 * ct_rng_normal(1, 0, i);
	for (int a = 0; a < 3; a++)
		n[a] = s.t[a].n_out;
	if (ct_vol_alloc(lo, n, &e))
		exit(1);
	ct_separable_apply(&s, lo->data, hi->data, NULL);
	ct_degrade_affine(lo->affine, hi->affine, fine, &cells);
	ct_separable_free(&s);
}

static void test_residual(void)
{
	struct ct_vol hi, lo, where = {0};
	struct ct_data_residual c, d;
	struct ct_env env = {0}, four = {0};
	struct ct_err e;
	size_t n;

	make(&hi, &lo);
	n = ct_vol_count(&lo);
	OK(ct_data_residual(&c, &where, &lo, &hi, &cells, &env, &e) == 0, "runs");
	OK(c.max == 0 && c.p95 == 0 && c.rms == 0 && c.mean == 0 && c.voxels == n,
		"the volume that was degraded leaves nothing");
	ct_vol_free(&where);
	for (size_t i = 0; i < n; i++)
		lo.data[i] -= i == 3 ? 20.0f : 1.0f;
	ct_data_residual(&c, &where, &lo, &hi, &cells, &env, &e);
	NEAR(c.max, 20, 1e-3, "the largest residual");
	NEAR(c.p95, 1, 1e-3, "most are smaller");
	NEAR(c.mean, 1 + 19.0 / (double)n, 1e-4, "the sign is degraded minus measured");
	NEAR(c.rms, sqrt(1 + 399.0 / (double)n), 1e-4, "root mean square");
	NEAR((double)where.data[3], 20, 1e-3, "the where says where");
	OK(ct_vol_same_grid(&where, &lo, &e) == 0, "on the coarse grid");
	if (ct_par_alloc(&four.par, 4, &e))
		exit(1);
	ct_vol_free(&where);
	ct_data_residual(&d, &where, &lo, &hi, &cells, &four, &e);
	OK(memcmp(&c, &d, sizeof c) == 0, "1 and 4 threads, same bits");
	ct_par_free(four.par);
	ct_vol_free(&where);
	lo.affine[0][3] += 1;
	OK(ct_data_residual(&c, &where, &lo, &hi, &cells, &env, &e) < 0 && e.code == CT_EGEOM,
		"a coarse grid elsewhere is refused");
	ct_vol_free(&where);
	ct_vol_free(&hi);
	ct_vol_free(&lo);
}

static int ascending(const void *a, const void *b)
{
	float x = fabsf(*(const float *)a), y = fabsf(*(const float *)b);

	return (x > y) - (x < y);
}

/* Many ties, ascending, negative, random: selection gives what sorting by size gives. */
static void test_quantile(void)
{
	static const double q[] = {0, 0.05, 0.5, 0.95, 1};
	static float v[1000], sorted[1000];
	double worst = 0;

	for (int kind = 0; kind < 4; kind++)
		for (size_t n = 1; n <= 1000; n = n * 5 / 3 + 1)
			for (size_t k = 0; k < 5; k++) {
				double at = q[k] * (double)(n - 1), part = at - floor(at), want;
				size_t lo = (size_t)at, hi = lo + 1 < n ? lo + 1 : lo;
				double got;

				for (size_t i = 0; i < n; i++)
					v[i] = kind == 0   ? (float)ct_rng_below(3, 0, i, 5)
					       : kind == 1 ? (float)i
					       : kind == 2 ? -(float)i
							   : ct_rng_normal(4, 0, i);
				memcpy(sorted, v, sizeof v);
				qsort(sorted, n, sizeof *sorted, ascending);
				want = fabs((double)sorted[lo]);
				want += part * (fabs((double)sorted[hi]) - want);
				must(ct_data_residual_quantile(&got, v, n, q[k], &err));
				worst = fmax(worst, fabs(got - want));
			}
	OK(worst < 1e-6, "quantiles are those of the sorted values: %.1e", worst);
}

static void t_data_residual(void)
{
	test_residual();
	test_quantile();
}

static void t_difference(void)
{
	static const size_t sizes[][3] = {
		{41, 7, 5}, {40, 3, 4}, {8, 2, 9}, {9, 1, 3}, {1, 6, 5}, {7, 5, 1}, {17, 1, 1}};

	for (size_t i = 0; i < MOST; i++) {
		ref[i] = 400 * ct_rng_normal(1, 0, i);
		test[i] = ref[i] + 90 * ct_rng_normal(2, 0, i) - 20;
		mask[i] = ct_rng_below(3, 0, i, 3) ? (i % 2 ? 0.5f : -2) : 0;
	}
	ref[0] = 1200; /* so that some slice of each size is above */
	for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++)
		for (int k = 0; k < 4; k++)
			compare(sizes[s], k % 2, k / 2);
	test_not_finite();
	t_data_residual();
}

static const size_t n[3] = {40, 36, 30};
static struct ct_vol one, other;
static struct ct_env env;
static struct ct_fsc f;

static void spacing(double x, double y, double z)
{
	const double mm[3] = {x, y, z};

	for (int a = 0; a < 3; a++)
		one.affine[a][a] = other.affine[a][a] = mm[a];
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
	must(ct_fsc(&f, &one, &other, &env, &err));
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
	const size_t count = ct_vol_count(&one);

	spacing(1, 1, 1);
	noise(&one);
	memcpy(other.data, one.data, count * sizeof *other.data);
	run();
	OK(all(1) && isnan(ct_fsc_cross(&f, 0.5)), "a volume and itself");
	for (size_t i = 0; i < count; i++)
		other.data[i] = 700 + 3 * one.data[i];
	run();
	OK(all(1), "contrast and level do not count");
	for (size_t i = 0; i < count; i++)
		other.data[i] = -one.data[i];
	run();
	OK(all(-1), "its negative");
	NEAR(ct_fsc_cross(&f, 0.5), 0.25 * f.width, 1e-5, "crosses before the first shell");
	memset(other.data, 0, count * sizeof *other.data);
	run();
	OK(all(0), "nothing shares nothing");
	memset(one.data, 0, count * sizeof *one.data);
	run();
	OK(all(1) && isnan(ct_fsc_cross(&f, 0.5)), "a volume of one value and itself agree");
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

	ct_vol_spacing(&one, spaces);
	memset(one.data, 0, ct_vol_count(&one) * sizeof *one.data);
	memset(other.data, 0, ct_vol_count(&one) * sizeof *one.data);
	wave(&one, axis, low, 0.3, 100);
	wave(&other, axis, low, 0.3, 100);
	wave(&one, axis, high, 0.3, 30);
	wave(&other, axis, high, 0.3 + M_PI / 2, 30);
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

enum { LONGEST = 360, WIDE = 8 };

static double re[LONGEST * WIDE], im[LONGEST * WIDE], from[2][LONGEST * WIDE],
	work[2 * LONGEST * WIDE];

/* Largest difference of the transforms of w random lines of count from their sums. */
static double miss(size_t count, size_t w)
{
	struct ct_fourier forward;
	float z[2 * LONGEST * WIDE];
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
		const double alone = miss(sizes[i], 1), three = miss(sizes[i], 3),
			     all = miss(sizes[i], WIDE);

		OK(alone < 1e-12 * (double)sizes[i] && three < 1e-12 * (double)sizes[i] &&
				all < 1e-12 * (double)sizes[i],
			"%zu samples (%.1e)", sizes[i], fmax(alone, fmax(three, all)));
	}
}

int main(void)
{
	struct ct_fsc alone = {0};
	double cross;

	must(ct_vol_alloc(&one, n, &err) || ct_vol_alloc(&other, n, &err) ||
		ct_par_alloc(&env.par, 3, &err));
	same();
	thin();
	shells(1.01, 1.03, 0.97);
	shells(0.71, 0.69, 2.5);
	waves(0, 4, 15);
	waves(1, 4, 14);
	spacing(0.71, 0.69, 2.5);
	waves(2, 3, 12);
	noise(&one);
	for (size_t i = 0; i < ct_vol_count(&one); i++)
		other.data[i] = one.data[i] + (i % 2 ? 1.0F : -0.5F) * one.data[i * 7 % 43200];
	run();
	cross = ct_fsc_cross(&f, 0.9);
	must(ct_fsc(&alone, &one, &other, &(struct ct_env){0}, &err));
	OK(cross > 0 && cross == ct_fsc_cross(&alone, 0.9) &&
			memcmp(alone.value, f.value, f.n * sizeof *f.value) == 0,
		"1 and 3 threads, same bytes");
	ct_fsc_free(&alone);
	for (size_t s = 0; s < f.n; s++)
		f.value[s] = s < 4 ? 1 : 0.2;
	NEAR(ct_fsc_cross(&f, 0.5), f.width * 3.625, 1e-12, "crosses between two shells");
	ct_fsc_free(&f);
	ct_par_free(env.par);
	ct_vol_free(&one);
	ct_vol_free(&other);
	t_fourier();
	t_difference();
	return tap_done();
}
