/* SSIM of volumes against that of each slice by itself, and in 3-D against the definition.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "quality/ssim.h"
#include "core/mem.h"
#include "quality/ms-ssim.h"
#include "ssim-plain.h"
#include "tap.h"

#include <stdbool.h>
#include <stddef.h>
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

/* SSIM against its definition written out, and its gradient against finite differences. */

enum { H = 23, W = 37, PIXELS = H * W };

/* Multiples of 2^-12: sums and steps are exact. */
static void images(float *x, float *y)
{
	for (size_t i = 0; i < PIXELS; i++) {
		double smooth = 0.5 + 0.3 * sin(0.4 * (double)(i % W)) * cos(0.3 * (double)(i / W));

		x[i] = (float)(floor(4096 * (smooth + 0.1 * ct_rng_uniform(1, 0, i))) / 4096);
		y[i] = (float)(floor(4096 * (smooth + 0.2 * ct_rng_uniform(2, 0, i))) / 4096);
	}
}

/* Mean SSIM, whose weights sum to total, and g += its gradient times -0.25. */
static double back(const struct ct_ssim_rule *r, float *g, const float *x, const float *y,
	const float *weight, double total)
{
	return 1 - ct_ssim_back_rows(r, H, W, 0, H, g, x, y, weight, -0.25) / total;
}

/* The constants and windows of each definition, as they are published. */
static void test_rules(void)
{
	static const struct {
		enum ct_ssim_kind kind;
		int dims;
		size_t radius, crop;
		double unbias;
		bool box;
	} want[] = {{CT_SSIM_R2, 2, 5, 0, 1, false}, {CT_SSIM_SKIMAGE, 2, 3, 3, 49 / 48.0, true},
		{CT_SSIM_WANG, 2, 5, 5, 1, false}, {CT_SSIM_SKIMAGE11, 2, 5, 5, 121 / 120.0, true},
		{CT_SSIM_3D, 3, 3, 3, 343 / 342.0, true}, {CT_SSIM_3D_GAUSS, 3, 5, 5, 1, false}};

	for (size_t k = 0; k < sizeof want / sizeof *want; k++) {
		struct ct_ssim_rule r;
		double worst = 0;

		ct_ssim_rule(&r, want[k].kind, 200);
		OK(r.dims == want[k].dims && r.radius == want[k].radius && r.crop == want[k].crop,
			"definition %zu: its window", k);
		OK(fabs(r.c1 - 4) < 1e-12 && fabs(r.c2 - 36) < 1e-12 &&
				fabs(r.unbias - want[k].unbias) < 1e-15,
			"and constants");
		for (size_t q = 0; q <= 2 * r.radius; q++) {
			const double d = (double)q - (double)r.radius;

			worst = fmax(worst, fabs(r.tap[q] / r.tap[r.radius] -
						    (want[k].box ? 1 : exp(-d * d / 4.5))));
		}
		OK(worst < 1e-15, "and weights");
	}
}

/* The value, and that the windows sum to one. */
static void test_value(void)
{
	static float x[PIXELS], y[PIXELS], weight[PIXELS], g[PIXELS];
	struct ct_ssim_rule r;
	double total = 0, s;

	images(x, y);
	for (size_t i = 0; i < PIXELS; i++) {
		weight[i] = i % 3 == 0;
		total += (double)weight[i];
	}
	for (int kind = 0; kind < CT_SSIM_KINDS; kind++) {
		double sum = 0;

		ct_ssim_rule(&r, (enum ct_ssim_kind)kind, 1.0);
		for (size_t k = 0; k <= 2 * r.radius; k++)
			sum += r.tap[k];
		NEAR(sum, 1, 1e-15, "the window sums to one");
	}
	ct_ssim_rule(&r, CT_SSIM_R2, 1.0);
	s = back(&r, g, x, y, NULL, PIXELS);
	OK(fabs(s - plain_ssim(&r, H, W, x, y, NULL)) < 1e-6, "R2 is its definition");
	OK(s > 0.1 && s < 0.99, "and no trivial value");
	NEAR(back(&r, g, x, y, weight, total), plain_ssim(&r, H, W, x, y, weight), 1e-6,
		"with weights");
	NEAR(back(&r, g, x, x, NULL, PIXELS), 1, 1e-6, "an image is itself");
	NEAR(back(&r, g, y, x, NULL, PIXELS), s, 1e-6, "symmetric");
}

/* Two images that Python makes likewise. */
static void pattern(float *x, float *y, size_t h, size_t w)
{
	for (size_t i = 0; i < h * w; i++) {
		const double k = (double)(i * i % 997) / 997, r = (double)(i / w) / (double)h;

		x[i] = (float)(k * 0.5 + r * 0.4);
		y[i] = (float)(k * 0.4 + r * 0.45 + (double)(i % 7) / 7 * 0.1);
	}
}

/* MS-SSIM against a plain one in numpy: one to five resolutions, odd sides and even ones. */
static void test_multi(void)
{
	static const struct {
		size_t h, w, levels;
		double want;
	} is[] = {{11, 11, 1, 0.9710102446745368}, {23, 19, 1, 0.9548644651127003},
		{45, 90, 3, 0.9636291894721958}, {163, 176, 5, 0.967624766102671},
		{162, 161, 5, 0.9539678931781839}};
	static float x[163 * 176], y[163 * 176];
	struct ct_par *par;
	struct ct_ms_ssim s;

	must(ct_par_alloc(&par, 3, &err));
	for (size_t k = 0; k < sizeof is / sizeof *is; k++) {
		const size_t n = is[k].h * is[k].w;
		double worst = 0, largest = 0, *first, ms;

		must(ct_ms_ssim_alloc(&s, is[k].h, is[k].w, &err) ||
			ct_alloc(&first, n, sizeof *first, &err));
		pattern(x, y, is[k].h, is[k].w);
		ms = ct_ms_ssim_gradient(&s, x, y, NULL);
		OK(s.n == is[k].levels, "%zux%zu pixels have %zu resolutions", is[k].h, is[k].w,
			s.n);
		OK(fabs(ms - is[k].want) < 1e-12, "MS-SSIM of %zux%zu pixels is that of numpy",
			is[k].h, is[k].w);
		memcpy(first, s.level[0].x, n * sizeof *first);
		ct_ms_ssim_gradient(&s, x, y, par);
		OK(memcmp(first, s.level[0].x, n * sizeof *first) == 0,
			"MS-SSIM of %zux%zu pixels: three threads, the same bytes", is[k].h,
			is[k].w);
		for (size_t i = 0; i < n; i += n / 37) {
			const float was = x[i];
			double up;

			x[i] = was + 0x1p-8f;
			up = ct_ms_ssim_gradient(&s, x, y, NULL);
			x[i] = was - 0x1p-8f;
			up = (up - ct_ms_ssim_gradient(&s, x, y, NULL)) / 0x1p-7;
			x[i] = was;
			worst = fmax(worst, fabs(up - first[i]));
			largest = fmax(largest, fabs(first[i]));
		}
		OK(worst < 1e-3 * largest, "MS-SSIM of %zux%zu pixels: its gradient", is[k].h,
			is[k].w);
		free(first);
		ct_ms_ssim_free(&s);
	}
	OK(ct_ms_ssim_alloc(&s, 10, 200, &err) == -1 && err.code == CT_EGEOM,
		"MS-SSIM of less than eleven pixels is refused");
	must(ct_ms_ssim_alloc(&s, 45, 90, &err));
	for (size_t i = 0; i < 45 * 90; i++)
		y[i] = (i / 90 + i % 90) % 2 ? 1 : 0, x[i] = 1 - y[i];
	OK(ct_ms_ssim_gradient(&s, x, y, NULL) == 0 && s.level[0].x[0] == 0,
		"images that contradict have no MS-SSIM and no gradient");
	ct_ms_ssim_free(&s);
	ct_par_free(par);
}

static void test_gradient(void)
{
	static float x[PIXELS], y[PIXELS], g[PIXELS], moved[PIXELS];
	const float small = 0x1p-10f;
	struct ct_ssim_rule r;
	double worst = 0, largest = 0, s;

	images(x, y);
	ct_ssim_rule(&r, CT_SSIM_R2, 1.0);
	s = back(&r, g, x, y, NULL, PIXELS);
	NEAR(s, plain_ssim(&r, H, W, x, y, NULL), 1e-6, "the same value with gradient");
	for (size_t i = 0; i < PIXELS; i++)
		moved[i] = x[i];
	for (size_t i = 0; i < PIXELS; i++) {
		double up, down, d;

		moved[i] = x[i] + small;
		up = plain_ssim(&r, H, W, moved, y, NULL);
		moved[i] = x[i] - small;
		down = plain_ssim(&r, H, W, moved, y, NULL);
		moved[i] = x[i];
		d = -0.25 * (up - down) / (2 * (double)small);
		worst = fmax(worst, fabs(d - (double)g[i]));
		largest = fmax(largest, fabs(d));
	}
	OK(worst < 1e-4 * largest, "gradient is the slope everywhere (%.2g of %.2g)", worst,
		largest);
	for (size_t i = 0; i < PIXELS; i++)
		moved[i] = g[i];
	back(&r, g, x, y, NULL, PIXELS);
	worst = 0;
	for (size_t i = 0; i < PIXELS; i++)
		worst = fmax(worst, fabs((double)g[i] - 2 * (double)moved[i]));
	OK(worst < 1e-6 * largest, "the gradient is added to what is there");
}

/* Wider than what is worked on at a time, weighted, and cut into rows anywhere. */
static void test_parts(void)
{
	enum { HH = 43, WW = 277, NN = HH * WW };
	static float x[NN], y[NN], weight[NN], g[3][NN];
	const size_t cut[] = {0, 1, 19, 20, HH};
	const float small = 0x1p-8f;
	struct ct_ssim_rule r;
	double whole, parts = 0, slope = 0, value[2] = {0}, total = 0;

	for (size_t i = 0; i < NN; i++) {
		x[i] = (float)ct_rng_uniform(4, 0, i);
		y[i] = x[i] + 0.1f * ct_rng_normal(4, 1, i);
		weight[i] = (float)ct_rng_uniform(4, 2, i);
		total += (double)weight[i];
	}
	ct_ssim_rule(&r, CT_SSIM_R2, 1.0);
	whole = ct_ssim_back_rows(&r, HH, WW, 0, HH, g[0], x, y, weight, NN);
	NEAR(1 - whole / total, plain_ssim(&r, HH, WW, x, y, weight), 1e-6,
		"a wide image with weights has the same value");
	for (size_t i = 0; i < 4; i++)
		parts += ct_ssim_back_rows(&r, HH, WW, cut[i], cut[i + 1], g[1], x, y, weight, NN);
	OK(memcmp(g[0], g[1], sizeof g[0]) == 0, "rows cut anywhere: the same bytes");
	NEAR(parts / whole, 1, 1e-6, "and the same sum");
	for (int s = 0; s < 2; s++) { /* along a random direction */
		for (size_t i = 0; i < NN; i++)
			g[2][i] = x[i] + (s ? small : -small) * 0.1f * ct_rng_normal(4, 3, i);
		value[s] = total * plain_ssim(&r, HH, WW, g[2], y, weight);
	}
	for (size_t i = 0; i < NN; i++)
		slope += (double)g[0][i] * 0.1 * (double)ct_rng_normal(4, 3, i);
	NEAR((value[1] - value[0]) / (2 * (double)small) / slope, 1, 1e-3,
		"and a slope that is its");
}

static void t_ssim(void)
{
	test_rules();
	test_value();
	test_parts();
	test_gradient();
	test_multi();
}

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
	t_ssim();
	return tap_done();
}
