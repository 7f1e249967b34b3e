/* A volume that differs by little gets a prediction that differs by little: between two neighbours
 * on a way from one volume to another, what is predicted moves the less the nearer they are. Where
 * a decision is hard it jumps, however near they are. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "restore/predict.h"
#include "restore/steps.h"
#include "tests/tap.h"
#include "slice-network-make.h"
#include "texture-make.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N = 8, COUNT = N * N * N, FEW = 200, FINER = 16 };
static const size_t n3[3] = {N, N, N};

/* What becomes of a volume. */
typedef void made_fn(float *h, const float *x, const void *of);

static void predicted(float *h, const float *x, const void *of)
{
	static const bool all[3] = {true, true, true};
	const struct ct_scene s = {.x = x, .n = {N, N, N}, .coarse = {true, true, true}};
	struct ct_guess g = {.h = h};
	struct ct_env env = {0};
	size_t textured, cells;

	memset(h, 0, COUNT * sizeof *h);
	must(ct_predict(&g, &s, of, all, &textured, &cells, &env, &err));
}

static void kept(float *h, const float *x, const void *of)
{
	struct ct_steps s = {h, x, {N, N, N}, 4, 0.5};

	memcpy(h, of, COUNT * sizeof *h);
	ct_steps_keep(&s, NULL);
}

/* The largest change of what is made between neighbours, of `steps` from `from` of the way from a
 * to b. */
static double jump(made_fn *make, const void *of, const float *a, const float *b, size_t steps)
{
	float x[COUNT], h[2][COUNT];
	double most = 0;

	for (size_t k = 0; k <= steps; k++) {
		const float t = (float)k / (float)steps;

		for (size_t i = 0; i < COUNT; i++)
			x[i] = (1 - t) * a[i] + t * b[i];
		make(h[k % 2], x, of);
		for (size_t i = 0; k > 0 && i < COUNT; i++)
			most = fmax(most, fabs((double)h[1][i] - (double)h[0][i]));
	}
	return most;
}

static void smooth(made_fn *make, const void *of, const float *a, const float *b, const char *what)
{
	const double few = jump(make, of, a, b, FEW), many = jump(make, of, a, b, FINER * FEW);

	OK(many > 0 && many < few / (FINER / 4), "%s (%.3g, %.3g)", what, few, many);
}

/* The shares of the poses of a patch, all together, where it is 2 to 50 HU. */
static void shares(const float *x)
{
	const struct ct_patch_shape shape = {4, 8, 3, 1, true};
	const size_t at[3] = {4, 4, 5};
	static float raw[CT_PATCH_MOST];
	float y[COUNT];
	double worst = 0;

	for (int k = 2; k < 50; k++) {
		struct ct_patch_pose pose[CT_PATCH_POSES];
		struct ct_slicing s;
		double sum = 0, t;
		size_t count;

		for (size_t i = 0; i < COUNT; i++)
			y[i] = (float)k / 100 * x[i];
		ct_slicing_of(&s, y, n3, 2, (const bool[3]){true, true, true});
		count = ct_patch_look(raw, pose, &s, &shape, at);
		for (size_t p = 0; p < count; p++)
			sum += (double)pose[p].share;
		t = count ? fmin(fmax((double)pose[0].s / 10 - 1, 0), 1) : 0;
		worst = fmax(worst, fabs(sum - t * t * (3 - 2 * t)));
		for (size_t p = 1; p < count; p++)
			worst = pose[p].share > pose[0].share ? 1 : worst;
	}
	NEAR(worst, 0, 1e-5, "shares are none at 10 HU and all at 20, the first the largest");
}

int main(void)
{
	struct ct_slice_network r = {.shape = {4, 8, 3, 1, true}, .components = 9, .width = 21};
	float a[COUNT], b[COUNT], h[COUNT];

	random_network(&r);
	texture(a, n3, 1);
	texture(b, n3, 2);
	shares(a);
	smooth(predicted, &r, a, b, "from a texture to another");
	for (size_t i = 0; i < COUNT; i++)
		b[i] = a[i] / 100;
	smooth(predicted, &r, a, b, "and to what is flat");
	for (size_t i = 0; i < COUNT; i++)
		h[i] = (float)(100 * (double)ct_rng_normal(7, 0, i));
	smooth(kept, h, a, b, "and what would soften a step, there");
	texture(b, n3, 2);
	smooth(kept, h, a, b, "and from a texture to another");
	ct_slice_network_free(&r);
	return tap_done();
}
