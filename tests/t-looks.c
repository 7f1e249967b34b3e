/* Where the slice prior looks again: after the axes before, and after the pass before.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/vol.h"
#include "numbers.h"
#include "restore/predict.h"
#include "restore/restore.h"

#include "slice-make.h"

#include <string.h>

static const size_t size[3] = {14, 12, 10};
enum { ALL = 14 * 12 * 10, CELL = 4 };
static const bool every[3] = {true, true, true};

static struct ct_slice_network network(size_t side, size_t slices, bool swap)
{
	struct ct_slice_network r = {
		.shape = {CELL, side, slices + 4, slices, swap}, .components = 9, .width = 13};

	random_network(&r);
	r.spread[0] = 0.8f;
	for (size_t i = 0; i < r.at[CT_PARTS]; i++)
		r.all[i] *= 0.3f;
	/* Deaf to noise. */
	for (size_t i = 0; i < r.out; i++)
		r.all[r.at[CT_PART_LINEAR] + i * r.inputs + r.components + 6] = 0;
	for (size_t i = 0; i < r.width; i++)
		r.all[r.at[CT_PART_1] + i * r.inputs + r.components + 6] = 0;
	return r;
}

/* Of one place more texture than of another. */
static float *scene(void)
{
	float *x = normals(ALL, 31, 0, 1);

	for (size_t i = 0; i < ALL; i++)
		x[i] *= (float)(20 + 5 * (i % 14) + 8 * (i / 14 % 12));
	return x;
}

static double rise(double t)
{
	const double u = fmin(fmax(t, 0), 1);

	return u * u * (3 - 2 * u);
}

static size_t block_of(size_t i, const size_t m[3])
{
	return (i / 14 / 12 / CELL * m[1] + i / 14 % 12 / CELL) * m[0] + i % 14 / CELL;
}

/* RMS of h over the voxels of the cell that voxel i is in, of slices across an axis. */
static double cell_rms(const double *h, size_t i, int axis, size_t slices)
{
	const size_t at[3] = {i % 14, i / 14 % 12, i / 14 / 12};
	double sum = 0, count = 0;

	for (size_t v = 0; v < ALL; v++) {
		const size_t to[3] = {v % 14, v / 14 % 12, v / 14 / 12};
		bool in = true;

		for (int a = 0; a < 3; a++) {
			const size_t of = a == axis ? slices : CELL;

			in = in && to[a] / of == at[a] / of;
		}
		sum += in ? h[v] * h[v] : 0;
		count += in;
	}
	return sqrt(sum / count);
}

/* One axis after the other: every voxel has its share of what the network says and of what the mean
 * was. */
static void test_axes(size_t slices, const struct ct_added *before, double least)
{
	struct ct_slice_network r = network(12, slices, true);
	float *x = scene(), *h = calloc(4 * ALL, sizeof *h), *v = h + ALL, *square = h + 2 * ALL;
	double *sum = calloc(4 * ALL, sizeof *sum), *of_v = sum + ALL, *squares = sum + 2 * ALL,
	       *mean = sum + 3 * ALL, worst = 0, unit = 0, axes = 0;
	const struct ct_scene s = {.x = x,
		.n = {size[0], size[1], size[2]},
		.coarse = {true, true, true},
		.regime = {.sigma = 0.4}};
	struct ct_guess g = {.h = h, .square = square, .v = v, .least = least, .before = before};
	size_t textured = 0, cells = 0, all = 0, none = 0, some = 0;

	must(!h || !sum);
	for (int a = 0; a < 3; a++) {
		const bool axis[3] = {a == 0, a == 1, a == 2};
		float *one = calloc(2 * ALL, sizeof *one);
		struct ct_guess alone = {.h = one, .v = one + ALL};

		must(!one ||
			ct_predict(&alone, &s, &r, axis, &all, &cells, &(struct ct_env){0}, &err));
		for (size_t i = 0; i < ALL; i++)
			mean[i] = axes > 0 ? sum[i] / axes : 0;
		for (size_t i = 0; i < ALL; i++) {
			const double known = axes > 0 ? cell_rms(mean, i, a, slices)
					     : before ? (double)before->rms[block_of(i, before->m)]
						      : 1e9;
			const double part = rise(known / least - 1);
			const double is = part * (double)one[i] + (1 - part) * mean[i];

			none += part <= 0;
			some += part > 0 && part < 1;
			sum[i] += is;
			squares[i] += is * is;
			of_v[i] += part * (double)one[ALL + i] +
				   (axes > 0 ? (1 - part) * of_v[i] / axes : 0);
		}
		axes++;
		free(one);
	}
	must(ct_predict(&g, &s, &r, every, &textured, &cells, &(struct ct_env){0}, &err));
	for (size_t i = 0; i < ALL; i++) {
		worst = fmax(worst, fabs((double)h[i] - sum[i]) / 100);
		worst = fmax(worst, fabs((double)square[i] - squares[i]) / 1e4);
		worst = fmax(worst, fabs((double)v[i] - of_v[i]) / 1e4);
		unit = fmax(unit, fabs(sum[i]));
	}
	OK(worst < 1e-5 && unit > 50, "slices of %zu%s: what is looked at again (%.2g of %.3g)",
		slices, before ? ", a second pass" : "", worst, unit);
	OK(textured < all && none > 100 && some > 100,
		"which some places are not: %zu of %zu cells", textured, all);
	ct_slice_network_free(&r);
	free(x);
	free(h);
	free(sum);
}

static void test_predictions(void)
{
	float rms[4 * 3 * 3];
	const struct ct_added before = {rms, {4, 3, 3}};

	for (size_t i = 0; i < 36; i++)
		rms[i] = (float)(i % 7 * 6);
	test_axes(4, NULL, 32);
	test_axes(1, NULL, 25);
	test_axes(4, &before, 15);
}

/* Two passes of a scan of so much noise that nothing is made to agree. */
static void test_passes(void)
{
	struct ct_slice_prior p = {.n = 2, .again = {false, true}};
	struct ct_restore_rule rule = {.by = {.factor = {4, 4, 4}, .sigma = {1, 1, 1}},
		.weight = 1,
		.noise = 1e5,
		.least = 30,
		.passes = 2,
		.axes = {true, true, true}};
	struct ct_vol x = {0}, lo = {0};
	struct ct_scene s = {.n = {size[0], size[1], size[2]},
		.coarse = {true, true, true},
		.regime = {.sigma = 0.25, .noise = 1e5}};
	float *was = scene(), *h = calloc(ALL, sizeof *h), rms[4 * 3 * 3] = {0}, sd[ALL];
	struct ct_guess g = {.h = h, .least = 30, .before = &(struct ct_added){rms, {4, 3, 3}}};
	size_t textured = 0, cells = 0, count[4 * 3 * 3] = {0};
	struct ct_restore_report did;
	const struct ct_env env = {0};

	p.r[0] = network(12, 4, true);
	p.r[1] = network(10, 1, true);
	must(!h || ct_vol_alloc(&x, size, &err));
	memcpy(x.data, was, ALL * sizeof *was);
	for (int a = 0; a < 3; a++)
		x.affine[a][a] = 1;
	must(ct_degrade_volume(&lo, &x, &rule.by, 0, 0, NULL, &err));
	rule.passes = 1;
	must(ct_restore(&x, NULL, &lo, &p, &rule, &did, &env, &err));
	for (size_t i = 0; i < ALL; i++) {
		const double d = (double)x.data[i] - (double)was[i];
		const size_t b = block_of(i, (const size_t[3]){4, 3, 3});

		rms[b] += (float)(d * d);
		count[b]++;
	}
	for (size_t b = 0; b < 36; b++)
		rms[b] = (float)sqrt((double)rms[b] / (double)count[b]);
	s.x = x.data;
	must(ct_predict(&g, &s, &p.r[1], every, &textured, &cells, &env, &err));
	for (size_t i = 0; i < ALL; i++)
		h[i] = x.data[i] + h[i] / 3;
	memcpy(x.data, was, ALL * sizeof *was);
	rule.passes = 2;
	must(ct_restore(&x, sd, &lo, &p, &rule, &did, &env, &err));
	NEAR(maxdiff(ALL, x.data, h), 0, 0.01, "the second pass looks where the first added much");
	OK(did.textured == textured && textured < cells / 2, "at %zu of %zu cells", did.textured,
		cells);
	rule.least = 1e6;
	memcpy(h, was, ALL * sizeof *was);
	memcpy(x.data, was, ALL * sizeof *was);
	must(ct_restore(&x, NULL, &lo, &p, &rule, &did, &env, &err));
	OK(did.textured == 0 && did.added <= 0, "nowhere if that is not enough");
	ct_slice_prior_free(&p);
	ct_vol_free(&x);
	ct_vol_free(&lo);
	free(was);
	free(h);
}

int main(void)
{
	test_predictions();
	test_passes();
	return tap_done();
}
