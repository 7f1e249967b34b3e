/* Patches of slices by their definition, and the limits of their shapes. Where the slice prior
 * looks again: after the axes before, and after the pass before.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/vol.h"
#include "restore/patch.h"
#include "restore/predict.h"
#include "restore/restore.h"
#include "numbers.h"
#include "slice-make.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* Value (u, v, w) of slices across an axis, held at the borders. */
static double value(const float *x, const size_t n[3], int axis, const bool coarse[3], ptrdiff_t u,
	ptrdiff_t v, ptrdiff_t w)
{
	const int a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;
	const int first = coarse[a] && !coarse[b] ? b : a, second = a + b - first;
	ptrdiff_t at[3] = {0};

	at[first] = u;
	at[second] = v;
	at[axis] = w;
	for (int k = 0; k < 3; k++) {
		at[k] = at[k] < 0 ? 0 : at[k];
		at[k] = at[k] >= (ptrdiff_t)n[k] ? (ptrdiff_t)n[k] - 1 : at[k];
	}
	return (double)x[((size_t)at[2] * n[1] + (size_t)at[1]) * n[0] + (size_t)at[0]];
}

/* The largest error of a patch and its pose; NaN if the turn is another. */
static double patch_error(const float *x, const size_t n[3], int axis, const bool coarse[3],
	const struct ct_patch_shape *shape, const size_t at[3])
{
	const ptrdiff_t side = (ptrdiff_t)shape->side, depth = (ptrdiff_t)shape->depth;
	const ptrdiff_t slices = (ptrdiff_t)shape->slices, before = (depth - slices) / 2;
	const ptrdiff_t cell = (ptrdiff_t)shape->cell, margin = (side - cell) / 2;
	const ptrdiff_t twice = 2 * cell + cell % 2;
	const ptrdiff_t about = twice < side ? twice : side, from = (side - about) / 2;
	static float got[40 * 40 * 6];
	double p[6][40][40], mu = 0, mean = 0, square = 0, x1 = 0, y1 = 0, z1 = 0, worst = 0;
	const double all = (double)(side * side * depth);
	struct ct_patch_pose pose;
	struct ct_slicing s;
	unsigned turn;

	for (ptrdiff_t k = 0; k < depth; k++)
		for (ptrdiff_t j = 0; j < side; j++)
			for (ptrdiff_t i = 0; i < side; i++) {
				p[k][j][i] =
					value(x, n, axis, coarse, (ptrdiff_t)at[0] - margin + i,
						(ptrdiff_t)at[1] - margin + j,
						(ptrdiff_t)at[2] - before + k);
				mean += p[k][j][i] / all;
			}
	for (ptrdiff_t k = before; k < before + slices; k++)
		for (ptrdiff_t j = margin - 1; j <= margin + cell; j++)
			for (ptrdiff_t i = margin - 1; i <= margin + cell; i++)
				mu += p[k][j][i] / (double)((cell + 2) * (cell + 2) * slices);
	for (ptrdiff_t k = 0; k < depth; k++)
		for (ptrdiff_t j = 0; j < side; j++)
			for (ptrdiff_t i = 0; i < side; i++)
				square += pow(p[k][j][i] - mean, 2) / all;
	for (ptrdiff_t k = 0; k < depth; k++)
		for (ptrdiff_t j = from; j < from + about; j++)
			for (ptrdiff_t i = from; i < from + about; i++) {
				const double d = p[k][j][i] - mu, middle = (double)(side - 1) / 2;

				x1 += d * ((double)i - middle);
				y1 += d * ((double)j - middle);
				z1 += d * ((double)k - (double)(depth - 1) / 2);
			}
	turn = (x1 < 0) | (unsigned)(y1 < 0) << 1 | (unsigned)(z1 < 0) << 2 |
	       (unsigned)(shape->swap && fabs(y1) > fabs(x1)) << 3;
	ct_slicing_of(&s, x, n, axis, coarse);
	if (!ct_patch_cut(got, &pose, &s, shape, at) || pose.turn != turn)
		return (double)NAN;
	worst = fmax(fabs((double)pose.mu - mu), fabs((double)pose.s - sqrt(square)));
	for (ptrdiff_t k = 0; k < depth; k++)
		for (ptrdiff_t j = 0; j < side; j++)
			for (ptrdiff_t i = 0; i < side; i++) {
				ptrdiff_t u = turn & 8 ? j : i, v = turn & 8 ? i : j, w = k;
				double want;

				u = turn & 1 ? side - 1 - u : u;
				v = turn & 2 ? side - 1 - v : v;
				w = turn & 4 ? depth - 1 - w : w;
				want = (p[w][v][u] - mu) / sqrt(square);
				worst = fmax(
					worst, fabs(want - (double)got[(k * side + j) * side + i]));
			}
	return worst;
}

static void patches(void)
{
	static const struct ct_patch_shape shapes[] = {{2, 6, 1, 1, true}, {3, 5, 5, 1, false},
		{8, 40, 3, 1, true}, {4, 10, 3, 1, false}, {4, 10, 6, 2, true}, {4, 8, 4, 4, false},
		{3, 7, 5, 3, true}};
	static const bool coarse[][3] = {{true, true, true}, {true, false, false},
		{false, true, false}, {false, false, true}};
	const size_t n[3] = {13, 17, 11};
	float *x = normals(13 * 17 * 11, 21, 0, 200);
	double worst = 0;

	for (size_t k = 0; k < sizeof shapes / sizeof *shapes; k++)
		for (int axis = 0; axis < 3; axis++)
			for (uint64_t q = 0; q < 40; q++) {
				struct ct_slicing s;
				size_t at[3];
				double error;

				ct_slicing_of(&s, x, n, axis, coarse[q % 4]);
				for (int a = 0; a < 3; a++)
					at[a] = ct_rng_below(22, k, 3 * q + (uint64_t)a,
						s.n[a] -
							(a < 2 ? shapes[k].cell
							       : shapes[k].slices) +
							1);
				error = patch_error(x, n, axis, coarse[q % 4], &shapes[k], at);
				worst = isnan(worst) || error <= worst ? worst : error;
			}
	NEAR(worst, 0, 1e-3, "patches, levels, spreads and turns, inside and at borders");
	/* two values along u, as far apart as a row of the patch is long */
	worst = patch_error(
		x, (const size_t[]){9, 2, 11}, 0, coarse[0], &shapes[3], (const size_t[]){0, 4, 4});
	NEAR(worst, 0, 1e-3, "values of a border that lie a patch's row apart are no row");
	free(x);
}

/* The values of a cell, turned, come back to their voxels, those behind the last slice to none. */
static void cells(void)
{
	static const struct ct_patch_shape shape = {4, 6, 4, 2, true};
	static const bool coarse[3] = {true, true, true};
	const size_t n[3] = {13, 12, 14}, all = 13 * 12 * 14;
	float *x = normals(all, 23, 0, 200), *back = calloc(all, sizeof *back), patch[6 * 6 * 4];
	double worst = 0;
	unsigned turns = 0;

	if (!back)
		exit(99);
	for (int axis = 0; axis < 3; axis++)
		for (uint64_t q = 0; q < 40; q++) {
			float cell[32], lies[32] = {0};
			struct ct_patch_pose pose;
			struct ct_slicing s;
			size_t at[3];

			ct_slicing_of(&s, x, n, axis, coarse);
			for (int a = 0; a < 3; a++)
				at[a] = ct_rng_below(24, q, (uint64_t)a, s.n[a] - (a < 2 ? 3 : 1));
			if (!ct_patch_cut(patch, &pose, &s, &shape, at))
				exit(99);
			turns |= 1u << pose.turn;
			ct_patch_cell(cell, &s, &shape, &pose, at);
			ct_patch_back(lies, cell, &shape, &pose);
			s.n[2] = at[2] + 1; /* the second slice of the cell is not there */
			memset(back, 0, all * sizeof *back);
			ct_patch_put(back, NULL, lies, &s, &shape, at);
			for (size_t k = 0; k < 16; k++) {
				const size_t place = (at[0] + k % 4) * s.stride[0] +
						     (at[1] + k / 4) * s.stride[1] +
						     at[2] * s.stride[2];

				back[place] -= pose.share * x[place];
			}
			worst = fmax(worst, maxdiff(all, back, NULL));
		}
	NEAR(worst, 0, 1e-3, "a cell that is turned is put back where it was");
	OK(turns == 0xffff, "in every pose (%x)", turns);
	free(x);
	free(back);
}

/* A patch that hardly changes across its slices is looked at in both poses: the share of each, from
 * its moment over s and the sum of |position|, for even and odd depths. */
static void shares(void)
{
	static const struct ct_patch_shape shapes[] = {{4, 8, 6, 2, true}, {4, 8, 5, 1, true}};
	static const bool coarse[3] = {true, true, true};
	enum { SIDE = 8, COUNT = SIDE * SIDE * SIDE };
	const size_t n[3] = {SIDE, SIDE, SIDE}, at[3] = {2, 2, 3};
	float x[COUNT], raw[COUNT];

	for (size_t q = 0; q < 2; q++) {
		const double depth = (double)shapes[q].depth, half = (depth - 1) / 2;
		const size_t count = ct_patch_count(&shapes[q]);
		double square = 0, moment = 0, reach = 0, t;
		struct ct_patch_pose pose[CT_PATCH_POSES];
		struct ct_slicing s;

		for (size_t i = 0; i < COUNT; i++)
			x[i] = (float)(i % SIDE * 90 + i / SIDE % SIDE * 40) +
			       0.7f * (float)(i / SIDE / SIDE);
		ct_slicing_of(&s, x, n, 2, coarse);
		OK(ct_patch_look(raw, pose, &s, &shapes[q], at) == 2, "two poses");
		for (size_t i = 0; i < count; i++) /* of a ramp: its mean is that of its cell */
			square += pow((double)(raw[i] - pose[0].mu), 2) / (double)count;
		for (size_t i = 0; i < count; i++)
			moment +=
				(double)(raw[i] - pose[0].mu) * ((double)(i / SIDE / SIDE) - half);
		for (size_t k = 0; k < shapes[q].depth; k++)
			reach += fabs((double)k - half);
		t = 0.5 + moment / (sqrt(square) * SIDE * SIDE * reach) / 0.02;
		OK(t > 0.6 && t < 0.9, "near the middle (%g)", t);
		NEAR((double)pose[0].share, t * t * (3 - 2 * t), 1e-3, "the share of one");
		NEAR((double)(pose[0].share + pose[1].share), 1, 1e-6, "the other has the rest");
		OK(pose[0].turn == 0 && pose[1].turn == 4, "mirrored across");
	}
}

static void shapes(void)
{
	static const struct ct_patch_shape good[] = {{2, 4, 1, 1, true}, {8, 40, 7, 1, true},
		{8, 10, 3, 1, false}, {4, 6, 8, 4, true}, {2, 4, 2, 2, true}, {3, 5, 5, 3, true}},
					   bad[] = {{1, 5, 1, 1, true}, {9, 11, 1, 1, true},
						   {8, 42, 1, 1, true}, {2, 4, 9, 1, true},
						   {2, 4, 0, 1, true}, {2, 4, 2, 1, true},
						   {3, 4, 1, 1, true}, {2, 5, 1, 1, true},
						   {2, 4, 4, 0, true}, {2, 4, 7, 5, true},
						   {4, 6, 2, 4, true}, {2, 4, 5, 2, true},
						   {3, 5, 4, 3, true}, {2, 4, 4, 4, true},
						   {6, 8, 4, 4, true}};
	char words[300];

	for (size_t k = 0; k < sizeof good / sizeof *good; k++)
		OK(ct_patch_shape_check(&good[k], &err) == 0, "a shape at the limits");
	for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
		snprintf(words, sizeof words,
			"no patch has cell %zu, side %zu, depth %zu and slices %zu: cell is a multiple of "
			"slices, 2 to 8; side an even number more, up to 40; slices 1 to 4; depth as many "
			"or an even number more, up to 8",
			bad[k].cell, bad[k].side, bad[k].depth, bad[k].slices);
		OK(ct_patch_shape_check(&bad[k], &err) == -1 && err.code == CT_EINPUT &&
				strcmp(err.msg, words) == 0,
			"%s", err.msg);
	}
}

static void t_patch(void)
{
	patches();
	cells();
	shares();
	shapes();
}

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
	t_patch();
	return tap_done();
}
