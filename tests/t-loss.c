/* t-loss.c: the loss of the fit: values, and gradients against finite differences. */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "gs/dab.h"
#include "gs/loss.h"
#include "tap.h"

#include <stdlib.h>
#include <string.h>

enum { H = 19, W = 23 };

static const struct ct_loss_weights weights = {2, 0.5, 0.05, 0.02};

static double image_loss(struct ct_loss *l, float *d, const float *img, size_t pitch,
	const float *base, const float *y)
{
	struct ct_loss_terms t = {0};

	ct_loss_image(l, &t, d, img, pitch, base, y, &weights, NULL);
	return weights.l1 * t.l1 + weights.ssim * t.dssim;
}

static void image(void)
{
	size_t pitch = ct_dab_pitch(W);
	float *img, *d, *waste, base[H * W], y[H * W];
	struct ct_loss_terms t = {0};
	struct ct_loss l;
	struct ct_err e;
	double sum = 0, num, dot = 0, h = 0.01, val[2];

	if (ct_loss_init(&l, H, W, 1, &e) || ct_alloc0(&img, H * pitch, sizeof *img, &e) ||
		ct_alloc(&d, H * pitch, sizeof *d, &e) ||
		ct_alloc(&waste, H * pitch, sizeof *d, &e))
		exit(1);
	for (size_t i = 0; i < H * W; i++) {
		/* differences stay away from zero, where |x| has no derivative */
		base[i] = (float)(40 * ct_rng_uniform(1, 0, i));
		y[i] = base[i] + (i % 2 ? 3.0f : -3.0f);
		img[i / W * pitch + i % W] = ct_rng_normal(1, 2, i) * 0.5f;
		sum += fabs((double)(img[i / W * pitch + i % W] + base[i] - y[i]));
	}
	ct_loss_image(&l, &t, d, img, pitch, base, y, &weights, NULL);
	NEAR(t.l1, 0.02 * sum / (H * W), 1e-6, "L1 of the scaled images");
	OK(t.dssim > 0 && t.dssim < 1, "1 - SSIM in (0, 1)");
	image_loss(&l, d, img, pitch, base, y);
	for (int s = 0; s < 2; s++) { /* along a random direction */
		for (size_t i = 0; i < H * W; i++)
			img[i / W * pitch + i % W] +=
				(float)((s ? 2 : -1) * h) * ct_rng_normal(1, 3, i);
		val[s] = image_loss(&l, waste, img, pitch, base, y);
	}
	num = (val[1] - val[0]) / (2 * h);
	for (size_t i = 0; i < H * W; i++)
		dot += (double)d[i / W * pitch + i % W] * (double)ct_rng_normal(1, 3, i);
	NEAR(num / dot, 1, 1e-3, "gradient of L1 and SSIM along a direction");
	ct_loss_image(&l, &t, d, y, W, NULL, y, &weights, NULL);
	NEAR(t.l1 + fabs(t.dssim), 0, 1e-6, "nothing is lost on the truth");
	free(img);
	free(d);
	free(waste);
	ct_loss_free(&l);
}

static void tv(void)
{
	const size_t n[3] = {7, 5, 6};
	const size_t one[3] = {1, 1, 1};
	size_t pitch = ct_dab_pitch(7);
	float *f, *d, *waste, base[7 * 5 * 6], single = 3;
	double want = 0, num, dot = 0, h = 1e-3, val[2];
	struct ct_err e;

	if (ct_alloc0(&f, 30 * pitch, sizeof *f, &e) || ct_alloc(&d, 30 * pitch, sizeof *d, &e) ||
		ct_alloc(&waste, 30 * pitch, sizeof *d, &e))
		exit(1);
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
	NEAR(ct_loss_tv(d, f, pitch, base, n, 0.7), want, 1e-6, "TV is the mean difference");
	for (int s = 0; s < 2; s++) {
		for (size_t i = 0; i < 210; i++)
			f[i / 7 * pitch + i % 7] +=
				(float)((s ? 2 : -1) * h) * ct_rng_normal(4, 2, i);
		val[s] = ct_loss_tv(waste, f, pitch, base, n, 1);
	}
	num = 0.7 * (val[1] - val[0]) / (2 * h);
	for (size_t i = 0; i < 210; i++)
		dot += (double)d[i / 7 * pitch + i % 7] * (double)ct_rng_normal(4, 2, i);
	NEAR(num / dot, 1, 2e-2, "gradient of TV along a direction");
	for (size_t i = 0; i < 210; i++)
		f[i / 7 * pitch + i % 7] = 2 - base[i];
	OK(ct_loss_tv(d, f, pitch, base, n, 1) < 1e-6, "a flat sum has none");
	OK(ct_loss_tv(waste, &single, ct_dab_pitch(1), NULL, one, 1) <= 0, "nor has one voxel");
	free(f);
	free(d);
	free(waste);
}

int main(void)
{
	image();
	tv();
	return tap_done();
}
