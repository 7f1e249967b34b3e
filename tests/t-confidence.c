/* The confidence weights of the slice prior, by how the scan was made.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "numbers.h"
#include "restore/restore.h"
#include "core/rng.h"
#include "restore/steps.h"
#include "tests/tap.h"
#include "restore/predict.h"
#include "slice-make.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const size_t size[3] = {16, 16, 16};

/* Of networks for that very factor. */
static size_t cell_of(const struct ct_degrade *d)
{
	return (size_t)fmax(d->factor[0], fmax(d->factor[1], d->factor[2]));
}

/* When what is flat becomes linear. */
static void flat_points(void)
{
	struct ct_restore_rule rule = {.by = {.factor = {4, 4, 4}}};
	bool little, ok = true;

	for (int protocol = 1; protocol <= 3; protocol++)
		for (int noise = 0; noise < 2; noise++) {
			ct_degrade_protocol(&rule.by, protocol);
			rule.noise = noise;
			must(ct_restore_confidence(&rule, &little, cell_of(&rule.by), size, &err));
			ok = ok && rule.flat == (protocol == 3 && !noise);
		}
	rule.by.decimate = CT_DECIMATE_MEAN;
	rule.noise = 0;
	must(ct_restore_confidence(&rule, &little, cell_of(&rule.by), size, &err));
	OK(ok && !rule.flat, "point-sampled, aliased scans, without noise, are flat");
}

/* The confidence weights of ct-upsample -m prior, by how the scan was made. */
static void weights(void)
{
	static const struct {
		struct ct_degrade by;
		double noise, doubt, gate, second_gate, steps, cap, second_cap;
		int passes;
		bool little;
	} want[] = {
		{{{4, 4, 4}, {1.7, 1.7, 1.7}, CT_DECIMATE_SINC, {0}}, 0, 1.2, 15, 10, 0.05, 360, 80,
			2, false},
		{{{4, 4, 4}, {1.7, 1.7, 1.7}, CT_DECIMATE_SINC, {0}}, 15, 0.5, 0, 10, 0.05, 500, 80,
			2, false},
		{{{4, 2, 1}, {1.7, 0.85, 0}, CT_DECIMATE_SINC, {0}}, 0, 1.2, 15, 10, 0.05, 360, 80,
			2, false},
		{{{2, 2, 2}, {0.85, 0.85, 0.85}, CT_DECIMATE_SINC, {0}}, 0, 1.2, 15, 10, 0.05, 250,
			40, 2, false},
		{{{4, 4, 4}, {0.5, 0.5, 0.5}, CT_DECIMATE_POINT, {0}}, 0, 0, 4, 4, 0, 0, 0, 2,
			false},
		{{{4, 4, 4}, {0.5, 0.5, 0.5}, CT_DECIMATE_POINT, {0}}, 15, 0, 0, 10, 0, 0, 0, 2,
			false},
		{{{4, 4, 4}, {0.5, 1.7, 1.7}, CT_DECIMATE_POINT, {0}}, 0, 0, 4, 4, 0, 0, 0, 2,
			false},
		{{{4, 4, 4}, {1.7, 1.7, 1.7}, CT_DECIMATE_POINT, {0}}, 0, 1.2, 4, 4, 0.05, 360, 80,
			2, false},
		{{{4, 4, 4}, {1.7, 1.7, 1.7}, CT_DECIMATE_POINT, {0}}, 15, 0.5, 0, 10, 0.05, 500,
			80, 2, false},
		{{{4, 4, 4}, {0}, CT_DECIMATE_MEAN, {0}}, 0, 0.6, 0, 10, 0, 0, 0, 2, false},
		{{{4, 4, 4}, {0}, CT_DECIMATE_MEAN, {0}}, 15, 0.5, 0, 10, 0, 0, 0, 2, false},
		{{{2, 2, 2}, {0}, CT_DECIMATE_MEAN, {0}}, 15, 0, 0, 10, 0.05, 250, 40, 2, false},
		{{{1, 1, 4}, {0}, CT_DECIMATE_MEAN, {0}}, 15, 0, 0, 10, 0, 0, 0, 2, false},
		{{{1, 1, 4}, {0, 0, 1.7}, CT_DECIMATE_SINC, {0}}, 0, 0.6, 4, 10, 0.05, 500, 80, 2,
			true},
		{{{1, 1, 4}, {0, 0, 1.5}, CT_DECIMATE_POINT, {0}}, 0, 0.6, 4, 10, 0.05, 500, 80, 2,
			false},
		{{{1, 1, 4}, {0}, CT_DECIMATE_MEAN, {0}}, 0, 0.6, 0, 10, 0, 0, 0, 2, false},
		{{{1, 8, 8}, {0, 3.4, 3.4}, CT_DECIMATE_SINC, {0}}, 0, 1.2, 15, 10, 0.05, 1000, 160,
			2, false},
	};

	for (size_t k = 0; k < sizeof want / sizeof *want; k++) {
		struct ct_restore_rule got = {.by = want[k].by, .noise = want[k].noise};
		const double *f = want[k].by.factor;
		const bool thick = (f[0] > 1) + (f[1] > 1) + (f[2] > 1) == 1;
		bool little;

		must(ct_restore_confidence(&got, &little, cell_of(&want[k].by), size, &err));
		OK(got.weight == 1 && got.doubt == want[k].doubt && got.gate == want[k].gate &&
				got.steps == want[k].steps && got.cap == want[k].cap &&
				got.second_gate == want[k].second_gate &&
				got.least == (thick                              ? 3
						     : cell_of(&want[k].by) == 2 ? 14
										 : 10) &&
				got.second_cap == want[k].second_cap &&
				got.passes == want[k].passes && little == want[k].little,
			"weights of scan %zu: %g, %g HU, %g, %g HU, %d passes", k, got.doubt,
			got.gate, got.steps, got.cap, got.passes);
	}
}

/* Plain steps: what would soften one is left out of an expectation, and nothing else. */

enum { X = 26, Y = 24, Z = 30, ALL = X * Y * Z };

/* Of a distance from a plane, voxels. */
typedef double shape_fn(double d);

static double sharp(double d)
{
	return 1000 * fmin(fmax(d + 0.5, 0), 1);
}

static double blurred(double d)
{
	return (sharp(d - 1) + 2 * sharp(d) + sharp(d + 1)) / 4;
}

static double sharper(double d)
{
	return 2 * sharp(d) - blurred(d);
}

static double beyond(double d)
{
	return sharp(d + 0.3);
}

static double bar(double d)
{
	return sharp(d + 1) - sharp(d - 1);
}

static double bar_blurred(double d)
{
	return blurred(d + 1) - blurred(d - 1);
}

/* The distance of voxel i from an oblique plane through the middle. */
static double distance(size_t i, double dx, double dy, double dz)
{
	const double length = sqrt(dx * dx + dy * dy + dz * dz);

	return (((double)(i % X) - X / 2.0) * dx + ((double)(i / X % Y) - Y / 2.0) * dy +
		       ((double)(i / X / Y) - Z / 2.0) * dz) /
	       length;
}

/* How much of h = is - was, of planes, is left: of its sum of squares. */
static double left(const double plane[3], shape_fn *was, shape_fn *is, double limit, double noise)
{
	float *x = malloc(2 * ALL * sizeof *x), *h = x + ALL;
	struct ct_steps s = {h, x, {X, Y, Z}, 4, limit};
	double before = 0, after = 0;

	if (!x)
		exit(99);
	for (size_t i = 0; i < ALL; i++) {
		const double d = distance(i, plane[0], plane[1], plane[2]);

		x[i] = (float)(was(d) + noise * (double)ct_rng_normal(1, 0, i));
		h[i] = (float)(is(d) - was(d));
		before += (double)h[i] * (double)h[i];
	}
	ct_steps_keep(&s, NULL);
	for (size_t i = 0; i < ALL; i++)
		after += (double)h[i] * (double)h[i];
	free(x);
	return after / before;
}

static void kinds(void)
{
	static const double planes[][3] = {{1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {1, 2, -1}, {3, 1, 2}};

	for (size_t k = 0; k < sizeof planes / sizeof *planes; k++) {
		const double *p = planes[k];
		double soft = left(p, sharp, blurred, 0.05, 0);
		double back = left(p, sharp, sharper, 0.05, 0);
		double moved = left(p, sharp, beyond, 0.05, 0);
		double thin = left(p, bar, bar_blurred, 0.05, 0);
		double rough = left(p, sharp, blurred, 0.05, 300);

		OK(soft < 0.15, "plane %zu: what softens a step is left out (%.3f is left)", k,
			soft);
		OK(back > 0.999, "what sharpens it stays (%.3f)", back);
		OK(moved > 0.6, "most of what moves it stays (%.3f)", moved);
		OK(thin > 0.85, "a bar is no step (%.3f)", thin);
		OK(rough > 0.8, "nor is one between no plateaus (%.3f)", rough);
	}
	OK(left(planes[3], sharp, blurred, 0.01, 20) >
			left(planes[3], sharp, blurred, 0.1, 20) + 0.3,
		"the limit says what a plateau is");
}

static void threads(void)
{
	static const size_t cells[] = {2, 3, 4, 8};
	float *x = malloc(3 * ALL * sizeof *x), *a = x + ALL, *b = a + ALL;
	struct ct_par *par = NULL;

	if (!x || ct_par_alloc(&par, 3, &err))
		exit(99);
	for (size_t i = 0; i < ALL; i++) {
		x[i] = (float)sharp(distance(i, 1, 1, -2));
		a[i] = b[i] = (float)(100 * (double)ct_rng_normal(2, 0, i));
	}
	for (size_t k = 0; k < 4; k++) {
		struct ct_steps s[] = {
			{a, x, {X, Y, Z}, cells[k], 0.05}, {b, x, {X, Y, Z}, cells[k], 0.05}};

		ct_steps_keep(&s[0], NULL);
		ct_steps_keep(&s[1], par);
		OK(memcmp(a, b, ALL * sizeof *a) == 0,
			"blocks of %zu: any number of threads, the same bytes", cells[k]);
	}
	ct_par_free(par);
	free(x);
}

static void t_steps(void)
{
	kinds();
	threads();
}

/* A volume that differs by little gets a prediction that differs by little: between two neighbours
 * on a way from one volume to another, what is predicted moves the less the nearer they are. Where
 * a decision is hard it jumps, however near they are. */

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

static void t_continuous(void)
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
}

/* What is left of an expectation of 400 HU at a vessel of 40 HU in the middle of 20^3 voxels of
 * `about` HU; side^3 voxels from `far` voxels beside it on have `near` HU, one voxel `rings`. */
static float left_of(float about, float near, ptrdiff_t far, size_t side, float rings)
{
	static float x[8000], h[8000];
	struct ct_steps s = {h, x, {20, 20, 20}, 4, 0};
	const size_t middle = (8 * 20 + 8) * 20 + 8;

	for (size_t i = 0; i < 8000; i++) {
		x[i] = about;
		h[i] = 0;
	}
	for (size_t i = 0; i < side * side * side; i++)
		x[middle + (size_t)far + i / side / side * 400 + i / side % side * 20 + i % side] =
			near;
	x[middle] = 40;
	x[middle - 3] = rings;
	h[middle] = 400;
	h[1] = -300;
	must(ct_steps_dim(&s, NULL, &err));
	OK(h[1] == -300, "what makes it darker stays");
	return h[middle];
}

static void t_dim(void)
{
	const float x = -850;

	OK(left_of(x, x, 1, 1, x) == 10, "a vessel in the lung becomes no brighter than tissue");
	OK(left_of(x, 120, 2, 1, x) == 80, "nor than what is beside it");
	OK(left_of(x, 120, 7, 1, x) == 80, "also in the next block");
	OK(left_of(x, 600, 7, 1, x) == 400, "where there is bone, it may");
	OK(left_of(x, x, 7, 1, -1100) == 10, "not where one voxel rings below air");
	OK(left_of(x, -1000, 4, 4, x) == 400, "and where there is air, as in a nose");
	OK(left_of(x, -1000, -8, 4, -1100) == 400, "also one block further, where it rings");
	OK(left_of(20, 20, 1, 1, 20) == 400, "and where there is no lung");
}

int main(void)
{
	t_dim();
	flat_points();
	weights();
	t_steps();
	t_continuous();
	return tap_done();
}
