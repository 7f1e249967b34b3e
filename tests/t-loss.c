/* t-loss.c: the loss of the fit: values, and gradients against finite differences.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "gs/rasterise.h"
#include "gs/loss.h"
#include "ssim-plain.h"
#include "tap.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { H = 19, W = 23 };

struct weights {
	double l1, ssim, scale, mean_weight;
};

static const struct weights weights = {2, 0.5, 0.02, 1}, weighted = {2, 0.5, 0.02, 0.6};

static void gradient(struct ct_loss_image *l, struct ct_loss_terms *t, float *d, const float *img,
	size_t pitch, const float *base, const float *y, const float *weight,
	const struct weights *k, struct ct_par *par)
{
	const struct ct_loss_view v = {
		d, img, base, y, weight, pitch, k->l1, k->ssim, k->scale, k->mean_weight, false};

	ct_loss_image_gradient(l, t, &v, par);
}

static double image_loss(struct ct_loss_image *l, float *d, const float *img, size_t pitch,
	const float *base, const float *y, const float *weight)
{
	const struct weights *k = weight ? &weighted : &weights;
	struct ct_loss_terms t = {0};

	gradient(l, &t, d, img, pitch, base, y, weight, k, NULL);
	return k->l1 * t.l1 + k->ssim * t.dssim;
}

static void image(bool weigh)
{
	const struct weights *k = weigh ? &weighted : &weights;
	size_t pitch = ct_rasterise_pitch(W);
	float *img, *d, *waste, base[H * W], y[H * W], w[H * W], *weight = weigh ? w : NULL;
	struct ct_loss_terms t = {0};
	struct ct_loss_image l;
	double sum = 0, num, dot = 0, h = 0.01, val[2];

	must(ct_loss_image_init(&l, H, W, false, &err) ||
		ct_alloc0(&img, H * pitch, sizeof *img, &err) ||
		ct_alloc(&d, H * pitch, sizeof *d, &err) ||
		ct_alloc(&waste, H * pitch, sizeof *d, &err));
	for (size_t i = 0; i < H * W; i++) {
		/* differences stay away from zero, where |x| has no derivative */
		base[i] = (float)(40 * ct_rng_uniform(1, 0, i));
		y[i] = base[i] + (i % 2 ? 3.0f : -3.0f);
		img[i / W * pitch + i % W] = ct_rng_normal(1, 2, i) * 0.5f;
		w[i] = (float)ct_rng_uniform(1, 4, i);
		sum += (weigh ? (double)w[i] : 1) *
		       fabs((double)(img[i / W * pitch + i % W] + base[i] - y[i]));
	}
	gradient(&l, &t, d, img, pitch, base, y, weight, k, NULL);
	NEAR(t.l1, 0.02 * sum / (H * W) / k->mean_weight, 1e-6, "L1 of the scaled images");
	OK(t.dssim > 0 && t.dssim < 1, "1 - SSIM in (0, 1)");
	image_loss(&l, d, img, pitch, base, y, weight);
	for (int s = 0; s < 2; s++) { /* along a random direction */
		for (size_t i = 0; i < H * W; i++)
			img[i / W * pitch + i % W] +=
				(float)((s ? 2 : -1) * h) * ct_rng_normal(1, 3, i);
		val[s] = image_loss(&l, waste, img, pitch, base, y, weight);
	}
	num = (val[1] - val[0]) / (2 * h);
	for (size_t i = 0; i < H * W; i++)
		dot += (double)d[i / W * pitch + i % W] * (double)ct_rng_normal(1, 3, i);
	NEAR(num / dot, 1, 1e-3,
		weigh ? "gradient along a direction, weighted"
		      : "gradient of L1 and SSIM along a direction");
	gradient(&l, &t, d, y, W, NULL, y, weight, k, NULL);
	NEAR(t.l1 + fabs(t.dssim), 0, 1e-6, "nothing is lost on the truth");
	free(img);
	free(d);
	free(waste);
	ct_loss_image_free(&l);
}

/* Weights that are all their mean change nothing; a pixel of weight 0 pulls nowhere. */
static void same_weights(void)
{
	struct weights k = weights;
	float *d[3], x[H * W], y[H * W], w[H * W];
	struct ct_loss_terms t[3];
	double off = 0;
	struct ct_loss_image l;

	must(ct_loss_image_init(&l, H, W, false, &err));
	for (size_t i = 0; i < H * W; i++) {
		x[i] = ct_rng_normal(2, 0, i);
		y[i] = ct_rng_normal(2, 1, i);
		w[i] = 0.25f;
	}
	for (size_t i = 0; i < 3; i++) {
		must(ct_alloc(&d[i], H * W, sizeof(float), &err));
		k.mean_weight = i ? 0.25 : 1;
		k.ssim = i < 2 ? weights.ssim : 0;
		w[77] = i < 2 ? 0.25f : 0;
		gradient(&l, &t[i], d[i], x, W, NULL, y, i ? w : NULL, &k, NULL);
	}
	for (size_t i = 0; i < H * W; i++)
		off = fmax(off, fabs((double)(d[1][i] - d[0][i])));
	NEAR(t[1].l1 + t[1].dssim, t[0].l1 + t[0].dssim, 1e-9, "equal weights are none: terms");
	OK(off < 1e-9, "and gradient");
	OK(fabs((double)d[2][77]) <= 0 && fabs((double)d[2][78]) > 0,
		"a pixel of weight 0 has no gradient");
	for (size_t i = 0; i < 3; i++)
		free(d[i]);
	ct_loss_image_free(&l);
}

static void tv(void)
{
	const size_t n[3] = {7, 5, 6};
	const size_t one[3] = {1, 1, 1};
	size_t pitch = ct_rasterise_pitch(7);
	float *f, *d, *waste, base[7 * 5 * 6], single = 3;
	double want = 0, num, dot = 0, h = 1e-3, val[2], part[6];

	must(ct_alloc0(&f, 30 * pitch, sizeof *f, &err) ||
		ct_alloc(&d, 30 * pitch, sizeof *d, &err) ||
		ct_alloc(&waste, 30 * pitch, sizeof *d, &err));
	for (size_t i = 0; i < 210; i++) {
		base[i] = ct_rng_normal(4, 0, i);
		f[i / 7 * pitch + i % 7] = ct_rng_normal(4, 1, i);
	}
	for (size_t i = 0; i < 210; i++) {
		double v = (double)f[i / 7 * pitch + i % 7] + (double)base[i];
		const size_t step[3] = {1, 7, 35};
		const size_t left[3] = {6 - i % 7, 4 - i / 7 % 5, 5 - i / 35};

		for (int a = 0; a < 3; a++)
			if (left[a]) {
				size_t j = i + step[a];

				want += fabs(
					(double)f[j / 7 * pitch + j % 7] + (double)base[j] - v);
			}
	}
	want /= 6 * 5 * 6 + 7 * 4 * 6 + 7 * 5 * 5;
	NEAR(ct_loss_tv_gradient(d, part, f, pitch, base, n, n, 0.7, NULL), want, 1e-6,
		"TV is the mean difference");
	for (int s = 0; s < 2; s++) {
		for (size_t i = 0; i < 210; i++)
			f[i / 7 * pitch + i % 7] +=
				(float)((s ? 2 : -1) * h) * ct_rng_normal(4, 2, i);
		val[s] = ct_loss_tv_gradient(waste, part, f, pitch, base, n, n, 1, NULL);
	}
	num = 0.7 * (val[1] - val[0]) / (2 * h);
	for (size_t i = 0; i < 210; i++)
		dot += (double)d[i / 7 * pitch + i % 7] * (double)ct_rng_normal(4, 2, i);
	NEAR(num / dot, 1, 2e-2, "gradient of TV along a direction");
	for (size_t i = 0; i < 210; i++)
		f[i / 7 * pitch + i % 7] = 2 - base[i];
	OK(ct_loss_tv_gradient(d, part, f, pitch, base, n, n, 1, NULL) < 1e-6,
		"a flat sum has none");
	OK(ct_loss_tv_gradient(
		   waste, part, &single, ct_rasterise_pitch(1), NULL, one, one, 1, NULL) <= 0,
		"nor has one voxel");
	free(f);
	free(d);
	free(waste);
}

/* Of an image of several strips: every pixel of the gradient of L1, and SSIM by its definition. */
static void strips(void)
{
	enum { HH = 129, WW = 21 };
	static float base[HH * WW], y[HH * WW], w[HH * WW], sx[HH * WW], sy[HH * WW];
	const size_t pitch = ct_rasterise_pitch(WW);
	struct weights k = {1.5, 0.5, 0.25, 0};
	struct ct_loss_terms t;
	struct ct_loss_image l;
	float *img, *d;

	must(ct_loss_image_init(&l, HH, WW, false, &err) ||
		ct_alloc(&img, HH * pitch, sizeof *img, &err) ||
		ct_alloc(&d, HH * pitch, sizeof *d, &err));
	for (size_t i = 0; i < HH * pitch; i++)
		img[i] = ct_rng_normal(6, 0, i);
	for (size_t i = 0; i < HH * WW; i++) {
		base[i] = (float)(i % 5);
		y[i] = i % 7 ? base[i] + ct_rng_normal(6, 1, i)
			     : base[i] + img[i / WW * pitch + i % WW]; /* no error, no slope */
		w[i] = (float)ct_rng_uniform(6, 2, i);
	}
	for (int way = 0; way < 8; way++) { /* base, weights, SSIM */
		double sum = 0, off = 0, pad = 0;

		k.mean_weight = way & 2 ? 0.5 : 1;
		k.ssim = way & 4 ? 0 : 0.5;
		for (size_t i = 0; i < HH * pitch; i++)
			d[i] = 9;
		gradient(&l, &t, d, img, pitch, way & 1 ? base : NULL, y, way & 2 ? w : NULL, &k,
			NULL);
		for (size_t r = 0; r < HH; r++)
			for (size_t c = 0; c < pitch; c++) {
				const size_t i = r * WW + c;
				double want, step;

				if (c >= WW) {
					pad = fmax(pad, fabs((double)d[r * pitch + c]));
					continue;
				}
				sx[i] = 0.25f * (img[r * pitch + c] + (way & 1 ? base[i] : 0));
				sy[i] = 0.25f * y[i];
				want = (double)sx[i] - (double)sy[i];
				step = way & 2 ? (double)w[i] : 1;
				sum += step * fabs(want);
				step *= 0.25 * 1.5 / (HH * WW * k.mean_weight);
				want = want > 0 ? step : want < 0 ? -step : 0;
				off = fmax(off, fabs((double)d[r * pitch + c] - want));
			}
		NEAR(t.l1 / (sum / (HH * WW) / k.mean_weight), 1, 1e-6, "L1 of several strips");
		OK(pad <= 0, "nothing beyond the columns");
		if (way & 4)
			OK(off < 1e-9 && fabs(t.dssim) <= 0, "the sign of every pixel, no SSIM");
		else if (!(way & 2))
			NEAR(t.dssim, 1 - plain_ssim(&l.rule, HH, WW, sx, sy, NULL), 1e-5, "SSIM");
	}
	free(img);
	free(d);
	ct_loss_image_free(&l);
}

enum base { NONE, ALIKE, LARGER }; /* of a block; the block is all of it, or a part */

/* The gradient of every voxel: a sign for each of its neighbours; none where two are equal. */
static void tv_signs(enum base base, size_t x, size_t y, size_t z)
{
	const size_t n[3] = {x, y, z}, pitch = ct_rasterise_pitch(x), count = x * y * z;
	static const char *const name[] = {"no base", "a base", "a part of a base"};
	const size_t step[3] = {1, x, x * y};
	const double pairs = (double)((x - 1) * y * z + x * (y - 1) * z + x * y * (z - 1));
	const size_t more = base == LARGER, grid[3] = {x + 3 * more, y + 2 * more, z + more};
	const size_t volume = grid[0] * grid[1] * grid[2];
	double sum = 0, got, off = 0, pad = 0, *part;
	float *f, *d, *b, *wide, *first;

	must(ct_alloc(&f, pitch * y * z, sizeof *f, &err) ||
		ct_alloc(&d, pitch * y * z, sizeof *d, &err) ||
		ct_alloc0(&b, count, sizeof *b, &err) ||
		ct_alloc(&wide, volume, sizeof *wide, &err) ||
		ct_alloc(&part, z, sizeof *part, &err));
	for (size_t i = 0; i < pitch * y * z; i++) {
		f[i] = (float)(int)(2 * ct_rng_normal(7, 0, i));
		d[i] = 9;
	}
	for (size_t i = 0; i < volume; i++)
		wide[i] = 50;
	first = wide + more * (2 + grid[0] + grid[0] * grid[1]);
	for (size_t i = 0; i < count && base != NONE; i++) {
		b[i] = (float)(int)(2 * ct_rng_normal(7, 1, i));
		first[(i / x / y * grid[1] + i / x % y) * grid[0] + i % x] = b[i];
	}
	got = ct_loss_tv_gradient(
		d, part, f, pitch, base == NONE ? NULL : first, grid, n, 0.6, NULL);
	for (size_t i = 0; i < count; i++) {
		const size_t at[3] = {i % x, i / x % y, i / x / y};
		const float v = f[i / x * pitch + i % x] + b[i];
		double want = 0;

		for (int a = 0; a < 3; a++)
			for (int to = -1; to < 2; to += 2) {
				const size_t j = to < 0 ? i - step[a] : i + step[a];
				float u;

				if (to < 0 ? at[a] == 0 : at[a] + 1 == n[a])
					continue;
				u = f[j / x * pitch + j % x] + b[j];
				want += (v > u) - (v < u);
				sum += fabs((double)(v - u)) / 2;
			}
		off = fmax(off, fabs((double)d[i / x * pitch + i % x] - want * 0.6 / pairs));
	}
	for (size_t i = 0; i < pitch * y * z; i++)
		pad = fmax(pad, i % pitch < x ? 0 : fabs((double)d[i]));
	OK(off < 1e-6 * 0.6 && pad <= 0 && fabs(got - sum / pairs) < 1e-6,
		"TV of %zu x %zu x %zu, %s: every voxel", x, y, z, name[base]);
	free(f);
	free(d);
	free(b);
	free(wide);
	free(part);
}

/* Images of several strips and a block of several slices: four threads, the bytes of one. */
static void threads(void)
{
	enum { HH = 150, WW = 140, M = 18 };
	static float x[HH * WW], y[HH * WW], w[HH * WW], d[2][HH * WW], f[M * M * (M + 64)];
	static float df[2][M * M * (M + 64)];
	const size_t n[3] = {M, M, M}, pitch = ct_rasterise_pitch(M);
	struct ct_loss_terms t[2] = {0};
	struct ct_par *par;
	struct ct_loss_image l;
	double part[M], v[2];

	must(ct_loss_image_init(&l, HH, WW, false, &err) || ct_par_alloc(&par, 4, &err) ||
		pitch > M + 64);
	for (size_t i = 0; i < (size_t)HH * WW; i++) {
		x[i] = 40 * (float)ct_rng_uniform(5, 0, i);
		y[i] = x[i] + ct_rng_normal(5, 1, i);
		w[i] = (float)ct_rng_uniform(5, 2, i);
	}
	for (size_t i = 0; i < pitch * M * M; i++)
		f[i] = ct_rng_normal(5, 3, i);
	for (int k = 0; k < 2; k++) {
		struct ct_par *p = k ? par : NULL;

		gradient(&l, &t[k], d[k], x, WW, NULL, y, w, &weighted, p);
		v[k] = ct_loss_tv_gradient(df[k], part, f, pitch, NULL, n, n, 1, p);
	}
	OK(memcmp(d[0], d[1], sizeof d[0]) == 0 && memcmp(&t[0], &t[1], sizeof t[0]) == 0,
		"image: the same bytes with four threads and with one");
	OK(memcmp(df[0], df[1], sizeof df[0]) == 0 && memcmp(&v[0], &v[1], sizeof v[0]) == 0,
		"and TV");
	ct_par_free(par);
	ct_loss_image_free(&l);
}

/* As the published program has it: L1 of the residual, and of what is not below zero, and MS-SSIM
 * of that, by hand and by differences. */
static void released(void)
{
	const struct ct_loss_view how = {
		.pitch = W, .l1 = 2, .ssim = 0.5, .scale = 0.02, .mean_weight = 1, .clamp = true};
	static float img[H * W], base[H * W], y[H * W], d[H * W], waste[H * W], x[H * W], z[H * W];
	struct ct_loss_terms t = {0}, u = {0};
	struct ct_loss_image l;
	struct ct_loss_view v = how;
	struct ct_ms_ssim ms;
	double l1 = 0, worst = 0, most = 0;
	size_t below = 0;

	must(ct_loss_image_init(&l, H, W, true, &err) || ct_ms_ssim_alloc(&ms, H, W, &err));
	for (size_t i = 0; i < H * W; i++) {
		base[i] = (float)(20 * ct_rng_uniform(3, 0, i));
		img[i] = (float)(40 * ct_rng_uniform(3, 1, i) - 25);
		y[i] = base[i] + img[i] + (i % 2 ? 6.0f : -6.0f);
		x[i] = 0.02f * fmaxf(img[i] + base[i], 0);
		z[i] = 0.02f * y[i];
		below += img[i] + base[i] < 0;
		l1 += fabs((double)(img[i] - (y[i] - base[i]))) +
		      fabs(fmax((double)(img[i] + base[i]), 0) - (double)y[i]);
	}
	v.dimg = d;
	v.img = img;
	v.base = base;
	v.y = y;
	ct_loss_image_gradient(&l, &t, &v, NULL);
	OK(below > 20, "some of the projections are below zero");
	NEAR(t.l1, 0.02 * l1 / (H * W) / 2, 1e-7,
		"the two L1 terms of the release are those by hand");
	NEAR(t.dssim, 1 - ct_ms_ssim_gradient(&ms, x, z, NULL), 1e-6,
		"MS-SSIM is of what is not below zero");
	v.dimg = waste;
	for (size_t i = 0; i < H * W; i += 5) {
		const float was = img[i];
		double slope;

		if (fabsf(was + base[i]) < 0.5f || fabsf(y[i]) < 0.5f)
			continue;
		img[i] = was + 0.25f;
		ct_loss_image_gradient(&l, &t, &v, NULL);
		img[i] = was - 0.25f;
		ct_loss_image_gradient(&l, &u, &v, NULL);
		img[i] = was;
		slope = (2 * (t.l1 - u.l1) + 0.5 * (t.dssim - u.dssim)) / 0.5;
		worst = fmax(worst, fabs(slope - (double)d[i]));
		most = fmax(most, fabs((double)d[i]));
	}
	OK(worst < 0.01 * most,
		"the gradient of the release's loss is that of differences (%g of %g)", worst,
		most);
	ct_loss_image_free(&l);
	ct_ms_ssim_free(&ms);
}

int main(void)
{
	released();
	image(false);
	image(true);
	same_weights();
	tv();
	strips();
	for (enum base k = NONE; k <= LARGER; k++) {
		tv_signs(k, 35, 5, 4);
		tv_signs(k, 16, 1, 3);
		tv_signs(k, 17, 6, 1);
		tv_signs(k, 1, 4, 5);
	}
	threads();
	return tap_done();
}
