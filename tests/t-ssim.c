/* SSIM against its definition written out, and its gradient against finite differences.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "ssim-plain.h"
#include "tap.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

enum { H = 23, W = 37, N = H * W };

/* Multiples of 2^-12: sums and steps are exact. */
static void images(float *x, float *y)
{
	for (size_t i = 0; i < N; i++) {
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
	static float x[N], y[N], weight[N], g[N];
	struct ct_ssim_rule r;
	double total = 0, s;

	images(x, y);
	for (size_t i = 0; i < N; i++) {
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
	s = back(&r, g, x, y, NULL, N);
	OK(fabs(s - plain_ssim(&r, H, W, x, y, NULL)) < 1e-6, "R2 is its definition");
	OK(s > 0.1 && s < 0.99, "and no trivial value");
	NEAR(back(&r, g, x, y, weight, total), plain_ssim(&r, H, W, x, y, weight), 1e-6,
		"with weights");
	NEAR(back(&r, g, x, x, NULL, N), 1, 1e-6, "an image is itself");
	NEAR(back(&r, g, y, x, NULL, N), s, 1e-6, "symmetric");
}

static void test_gradient(void)
{
	static float x[N], y[N], g[N], moved[N];
	const float step = 0x1p-10f;
	struct ct_ssim_rule r;
	double worst = 0, largest = 0, s;

	images(x, y);
	ct_ssim_rule(&r, CT_SSIM_R2, 1.0);
	s = back(&r, g, x, y, NULL, N);
	NEAR(s, plain_ssim(&r, H, W, x, y, NULL), 1e-6, "the same value with gradient");
	for (size_t i = 0; i < N; i++)
		moved[i] = x[i];
	for (size_t i = 0; i < N; i++) {
		double up, down, d;

		moved[i] = x[i] + step;
		up = plain_ssim(&r, H, W, moved, y, NULL);
		moved[i] = x[i] - step;
		down = plain_ssim(&r, H, W, moved, y, NULL);
		moved[i] = x[i];
		d = -0.25 * (up - down) / (2 * (double)step);
		worst = fmax(worst, fabs(d - (double)g[i]));
		largest = fmax(largest, fabs(d));
	}
	OK(worst < 1e-4 * largest, "gradient is the slope everywhere (%.2g of %.2g)", worst,
		largest);
	for (size_t i = 0; i < N; i++)
		moved[i] = g[i];
	back(&r, g, x, y, NULL, N);
	worst = 0;
	for (size_t i = 0; i < N; i++)
		worst = fmax(worst, fabs((double)g[i] - 2 * (double)moved[i]));
	OK(worst < 1e-6 * largest, "the gradient is added to what is there");
}

/* Wider than what is worked on at a time, weighted, and cut into rows anywhere. */
static void test_parts(void)
{
	enum { HH = 43, WW = 277, NN = HH * WW };
	static float x[NN], y[NN], weight[NN], g[3][NN];
	const size_t cut[] = {0, 1, 19, 20, HH};
	const float step = 0x1p-8f;
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
			g[2][i] = x[i] + (s ? step : -step) * 0.1f * ct_rng_normal(4, 3, i);
		value[s] = total * plain_ssim(&r, HH, WW, g[2], y, weight);
	}
	for (size_t i = 0; i < NN; i++)
		slope += (double)g[0][i] * 0.1 * (double)ct_rng_normal(4, 3, i);
	NEAR((value[1] - value[0]) / (2 * (double)step) / slope, 1, 1e-3,
		"and a slope that is its");
}

int main(void)
{
	test_rules();
	test_value();
	test_parts();
	test_gradient();
	return tap_done();
}
