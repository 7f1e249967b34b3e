/* Patches of slices by their definition, and the limits of their shapes.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "numbers.h"
#include "restore/patch.h"

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
	char words[100];

	for (size_t k = 0; k < sizeof good / sizeof *good; k++)
		OK(ct_patch_shape_check(&good[k], &err) == 0, "a shape at the limits");
	for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
		snprintf(words, sizeof words,
			"no patch has cell %zu, side %zu, depth %zu and slices %zu", bad[k].cell,
			bad[k].side, bad[k].depth, bad[k].slices);
		OK(ct_patch_shape_check(&bad[k], &err) == -1 && err.code == CT_EINPUT &&
				strcmp(err.msg, words) == 0,
			"%s", err.msg);
	}
}

int main(void)
{
	patches();
	cells();
	shares();
	shapes();
	return tap_done();
}
