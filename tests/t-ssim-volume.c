/* SSIM of volumes against that of each slice by itself, and in 3-D against the definition.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "quality/ssim.h"
#include "ssim-plain.h"
#include "tap.h"

#include <stdlib.h>
#include <string.h>

/* More than a tile of columns, a chunk of rows and a block of slices, and whole numbers of none. */
enum { NX = 141, NY = 21, NZ = 18, N = NX * NY * NZ };

static const size_t size[3] = {NX, NY, NZ}, step[3] = {1, NX, NX *NY};
static const struct ct_ssim_map map = {-800, 900, -500, 1e-3};
static float ref[N], test[N], mask[N];

static void make(void)
{
	for (size_t i = 0; i < N; i++) {
		ref[i] = 900 * sinf((float)(i % NX) * 0.1f) * cosf((float)(i / NX % NY) * 0.3f) +
			 10 * (float)(i / (NX * NY));
		test[i] = ref[i] + 120 * ct_rng_normal(1, 0, i);
		mask[i] = ct_rng_below(2, 0, i, 4) == 0 ? -1.0f : 0.0f;
	}
}

static float mapped(float v)
{
	double a = fmin(fmax((double)v, map.lo), map.hi);

	return (float)((a - map.zero) * map.scale);
}

/* Slices of one axis, gathered. */
static double by_slices(const struct ct_ssim_rule *r, int axis, size_t slice, bool masked)
{
	static float x[N], y[N], w[N];
	int p = axis == 2 ? 1 : 2, q = axis == 0 ? 1 : 0;

	for (size_t i = 0; i < size[p]; i++)
		for (size_t j = 0; j < size[q]; j++) {
			size_t at = slice * step[axis] + i * step[p] + j * step[q];

			x[i * size[q] + j] = mapped(ref[at]);
			y[i * size[q] + j] = mapped(test[at]);
			w[i * size[q] + j] = mask[at] != 0.0f;
		}
	return plain_ssim(r, size[p], size[q], x, y, masked ? w : NULL);
}

static void test_slices(enum ct_ssim_kind kind, int axis, bool masked)
{
	static double sum[NX], count[NX];
	const struct ct_env env = {0};
	struct ct_ssim_rule r;
	struct ct_err e;
	double worst = 0;

	ct_ssim_rule(&r, kind, 1.7);
	if (ct_ssim_volume(
		    sum, count, &r, axis, size, ref, test, masked ? mask : NULL, &map, &env, &e))
		exit(1);
	for (size_t k = 0; k < size[axis]; k++) {
		double off = fabs(sum[k] / count[k] - by_slices(&r, axis, k, masked));

		worst = off >= 0 ? fmax(worst, off) : HUGE_VAL;
	}
	OK(worst < 1e-5, "definition %d across axis %d%s: %.1e", (int)kind, axis,
		masked ? ", masked" : "", worst);
}

/* S of one voxel by the definition. */
static double direct(const struct ct_ssim_rule *r, const size_t at[3])
{
	double mx = 0, my = 0, xx = 0, yy = 0, xy = 0, sx, sy, sxy;
	size_t w = 2 * r->radius + 1;

	for (size_t k = 0; k < w * w * w; k++) {
		const size_t t[3] = {k % w, k / w % w, k / (w * w)};
		double tap = r->tap[t[0]] * r->tap[t[1]] * r->tap[t[2]], a, b;
		size_t i = 0;

		for (int d = 0; d < 3; d++)
			i += (at[d] + t[d] - r->radius) * step[d];
		a = (double)mapped(ref[i]);
		b = (double)mapped(test[i]);
		mx += tap * a;
		my += tap * b;
		xx += tap * a * a;
		yy += tap * b * b;
		xy += tap * a * b;
	}
	sx = r->unbias * (xx - mx * mx);
	sy = r->unbias * (yy - my * my);
	sxy = r->unbias * (xy - mx * my);
	return (2 * mx * my + r->c1) * (2 * sxy + r->c2) /
	       ((mx * mx + my * my + r->c1) * (sx + sy + r->c2));
}

static void test_solid(enum ct_ssim_kind kind, bool masked)
{
	static double sum[NZ], count[NZ];
	const struct ct_env env = {0};
	struct ct_ssim_rule r;
	struct ct_err e;
	double worst = 0;

	ct_ssim_rule(&r, kind, 1.7);
	if (ct_ssim_volume(
		    sum, count, &r, 2, size, ref, test, masked ? mask : NULL, &map, &env, &e))
		exit(1);
	for (size_t k = 0; k < NZ; k++) {
		double want = 0, n = 0;

		for (size_t j = r.crop; j + r.crop < NY && k >= r.crop && k + r.crop < NZ; j++)
			for (size_t i = r.crop; i + r.crop < NX; i++) {
				if (masked && mask[i + j * step[1] + k * step[2]] == 0.0f)
					continue;
				want += direct(&r, (const size_t[3]){i, j, k});
				n++;
			}
		if (n != count[k])
			worst = 1;
		worst = fmax(worst, fabs(sum[k] - want) / fmax(n, 1));
	}
	OK(worst < 1e-6, "definition %d in 3-D%s: %.1e", (int)kind, masked ? ", masked" : "",
		worst);
}

/* Values that are many times the data range are compared in double. */
static void test_large(void)
{
	static const struct ct_ssim_map wide = {-4e5, 4e5, 0, 4};
	static float x[NX * NY], y[NX * NY];
	static double sum[NZ], count[NZ];
	const struct ct_env env = {0};
	struct ct_ssim_rule r;
	struct ct_err e;
	double worst = 0;

	ct_ssim_rule(&r, CT_SSIM_WANG, 1e5);
	if (ct_ssim_volume(sum, count, &r, 2, size, ref, test, NULL, &wide, &env, &e))
		exit(1);
	for (size_t k = 0; k < NZ; k++) {
		for (size_t i = 0; i < NX * NY; i++) {
			x[i] = 4 * ref[k * NX * NY + i];
			y[i] = 4 * test[k * NX * NY + i];
		}
		worst = fmax(worst, fabs(sum[k] / count[k] - plain_ssim(&r, NY, NX, x, y, NULL)));
	}
	OK(worst < 1e-11, "beyond twice the data range: %.1e", worst);
}

static void test_threads(void)
{
	static double sum[NX], count[NX], sum4[NX], count4[NX];
	struct ct_env one = {0}, four = {0};
	struct ct_ssim_rule r;
	struct ct_err e;

	if (ct_par_alloc(&four.par, 4, &e))
		exit(1);
	for (int axis = 0; axis < 3; axis++) {
		ct_ssim_rule(&r, axis == 2 ? CT_SSIM_3D_GAUSS : CT_SSIM_R2, 1);
		ct_ssim_volume(sum, count, &r, axis, size, ref, test, mask, &map, &one, &e);
		ct_ssim_volume(sum4, count4, &r, axis, size, ref, test, mask, &map, &four, &e);
		OK(memcmp(sum, sum4, size[axis] * sizeof *sum) == 0 &&
				memcmp(count, count4, size[axis] * sizeof *count) == 0,
			"axis %d: 1 and 4 threads, same bits", axis);
	}
	ct_par_free(four.par);
}

static volatile sig_atomic_t stop = 1;

int main(void)
{
	const struct ct_env stopped = {.stop = &stop};
	static double sum[NX], count[NX];
	struct ct_ssim_rule r;
	struct ct_err e;

	make();
	for (int kind = CT_SSIM_R2; kind <= CT_SSIM_SKIMAGE11; kind++)
		for (int axis = 0; axis < 3; axis++)
			test_slices((enum ct_ssim_kind)kind, axis, axis == kind % 3);
	for (int masked = 0; masked < 2; masked++) {
		test_solid(CT_SSIM_3D, masked);
		test_solid(CT_SSIM_3D_GAUSS, masked);
	}
	test_large();
	test_threads();
	ct_ssim_rule(&r, CT_SSIM_R2, 1);
	OK(ct_ssim_volume(sum, count, &r, 2, size, ref, test, NULL, &map, &stopped, &e) < 0 &&
			e.code == CT_ESTOP,
		"stops on request");
	return tap_done();
}
