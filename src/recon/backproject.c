/* backproject.c: see backproject.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "recon/backproject.h"
#include "core/mem.h"
#include "core/vec3.h"
#include "xray/geometry.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Voxel indices to (depth col, depth row, depth); false if the view is degenerate. */
static bool map_view(double map[3][4], const struct ct_vol *grid, const struct ct_stack *scan,
	size_t view, const double origin[3])
{
	double m[3][4];

	if (!ct_view_map(m, scan, view, origin))
		return false;
	ct_vec3_after(map, (const double(*)[4])m, (const double(*)[4])grid->affine);
	return true;
}

/* Is every voxel in front of the source? */
static bool in_front(const struct ct_backprojector *b, const double map[3][4])
{
	for (unsigned k = 0; k < 8; k++) {
		double x[3];

		ct_cell_corner(x, b->n, k, 0.5);
		if (!(ct_backproject_map(map[2], x) > 0))
			return false;
	}
	return true;
}

/* Are depth and column the same along the axis, and the rows not too far apart? The drift over the
 * whole line is within 1e-4 of a pixel. */
static bool lines_along(const struct ct_backprojector *b, int axis)
{
	double n = (double)b->n[axis];

	for (size_t k = 0; k < b->views; k++) {
		const double(*m)[4] = (const double(*)[4])b->map[k];

		for (unsigned corner = 0; corner < 8; corner++) {
			double x[3], depth;

			ct_cell_corner(x, b->n, corner, 0);
			depth = ct_backproject_map(m[2], x);
			if (!(fabs(m[0][axis]) * n <= 1e-4 * depth) ||
				!(fabs(m[2][axis]) * n <= 1e-7 * depth) ||
				!(fabs(m[1][axis]) <= (CT_BP_LONGEST - 1) * depth))
				return false;
		}
	}
	return true;
}

/* Offsets within a stored view are 32 bits. */
static int check_size(const struct ct_backprojector *b, struct ct_err *e)
{
	if (b->h > INT32_MAX / 4 || b->w > INT32_MAX / b->pitch - 3)
		return ct_fail(
			e, CT_EINPUT, "a detector of %zux%zu pixels is too large", b->w, b->h);
	return 0;
}

int ct_backprojector_alloc(struct ct_backprojector *b, const struct ct_vol *grid,
	const struct ct_stack *scan, const double origin[static 3], struct ct_err *e)
{
	*b = (struct ct_backprojector){
		.views = scan->views, .h = scan->h, .w = scan->w, .line = -1};
	memcpy(b->n, grid->n, sizeof b->n);
	/* a vector that begins in the last row may end fifteen later */
	b->pitch = (CT_BP_PAD + scan->h + 1 + 15 + 15) / 16 * 16;
	if (ct_vol_check_grid(grid, e) || ct_stack_check(scan, e))
		return -1;
	if (check_size(b, e) || ct_alloc(&b->map, b->views, sizeof *b->map, e))
		return -1;
	for (size_t k = 0; k < b->views; k++) {
		const bool sound = map_view(b->map[k], grid, scan, k, origin);

		if (sound && in_front(b, (const double(*)[4])b->map[k]))
			continue;
		ct_backprojector_free(b);
		return ct_fail(e, CT_EGEOM, "view %zu: %s", k,
			sound ? "a part of the volume is not in front of the source"
			      : "the geometry is degenerate");
	}
	for (int a = 2; a >= 0 && b->line < 0; a--)
		if (lines_along(b, a))
			b->line = a;
	return 0;
}

int ct_backprojector_widen(
	struct ct_backprojector *b, size_t before, size_t after, struct ct_err *e)
{
	b->w += before + after;
	for (size_t k = 0; k < b->views; k++)
		for (int i = 0; i < 4; i++)
			b->map[k][0][i] += (double)before * b->map[k][2][i];
	return check_size(b, e);
}

void ct_backprojector_free(struct ct_backprojector *b)
{
	free(b->map);
	*b = (struct ct_backprojector){.line = -1};
}

void ct_backproject_frame(const struct ct_backprojector *b, float *view)
{
	for (size_t c = 1; c <= b->w; c++) {
		float *col = view + c * b->pitch + CT_BP_PAD;

		col[-1] = col[0];
		col[b->h] = col[b->h - 1];
	}
	memcpy(view, view + b->pitch, b->pitch * sizeof *view);
	memcpy(view + (b->w + 1) * b->pitch, view + b->w * b->pitch, b->pitch * sizeof *view);
}

void ct_backproject_at(const struct ct_backprojector *b, size_t view, const double x[static 3],
	double at[static 3])
{
	const double(*m)[4] = (const double(*)[4])b->map[view];

	at[2] = ct_backproject_map(m[2], x);
	at[0] = ct_backproject_map(m[0], x) / at[2];
	at[1] = ct_backproject_map(m[1], x) / at[2];
}

struct backproject_job {
	const struct ct_backprojector *b;
	size_t first, count;
	float *vol;
	const float *views;
	int axis[3];      /* line, and the two others */
	size_t stride[3]; /* of them */
	size_t tiles[3];  /* segments of lines, and tiles */
};

static const size_t tile_size[3] = {CT_BP_SEGMENT, CT_BP_TILE, CT_BP_TILE};

/* Begin to fetch the voxels that follow `out` in AHEAD planes: each is a page of its own, which the
 * processor does not see coming. */
static void fetch(const float *out, const struct backproject_job *j, size_t k, const size_t n[3])
{
	enum { AHEAD = 16, LINE = 16 /* floats */ };

	if (j->stride[1] == 1 && k + AHEAD < n[0])
		for (size_t i = 0; i < n[1]; i += LINE)
			__builtin_prefetch(out + AHEAD * j->stride[0] + i, 1);
}

/* A tile of lines in all views; then it is added to the volume. */
static void tile(void *arg, size_t task, size_t worker)
{
	const struct backproject_job *j = arg;
	const struct ct_backprojector *b = j->b;
	size_t at[3] = {task % j->tiles[0], task / j->tiles[0] % j->tiles[1],
		task / j->tiles[0] / j->tiles[1]};
	_Alignas(64) float acc[CT_BP_TILE][CT_BP_TILE][CT_BP_SEGMENT];
	_Alignas(64) float blend[CT_BP_SLACK + CT_BP_BLEND + CT_BP_SLACK];
	struct ct_bp_tile t = {.b = b};

	(void)worker;
	memset(acc, 0, sizeof acc);
	memset(blend, 0, sizeof blend);
	for (int a = 0; a < 3; a++) {
		size_t left;

		at[a] *= tile_size[a];
		left = b->n[j->axis[a]] - at[a];
		t.axis[a] = j->axis[a];
		t.n[a] = left < tile_size[a] ? left : tile_size[a];
		t.x[j->axis[a]] = (double)at[a];
	}
	for (size_t view = 0; view < j->count; view += CT_BP_GROUP) {
		size_t left = j->count - view;

		CT_SIMD(ct_backproject_line_tile)
		(acc, &t, j->first + view, left < CT_BP_GROUP ? left : CT_BP_GROUP,
			j->views + view * ct_backprojector_size(b), blend + CT_BP_SLACK);
	}
	for (size_t c = 0; c < t.n[2]; c++)
		for (size_t k = 0; k < t.n[0]; k++) {
			float *out = j->vol + (at[0] + k) * j->stride[0] + at[1] * j->stride[1] +
				     (at[2] + c) * j->stride[2];

			fetch(out, j, k, t.n);
			for (size_t i = 0; i < t.n[1]; i++)
				out[i * j->stride[1]] += acc[c][i][k];
		}
}

/* The general case: a row of voxels along axis 0 in all views. */
static void row_of_voxels(void *arg, size_t task, size_t worker)
{
	const struct backproject_job *j = arg;
	const struct ct_backprojector *b = j->b;

	(void)worker;
	CT_SIMD(ct_backproject_row)
	(j->vol + task * b->n[0], b, task % b->n[1], task / b->n[1], j->first, j->count, j->views);
}

void ct_backproject(const struct ct_backprojector *b, size_t first, size_t count,
	float *restrict vol, const float *restrict views, struct ct_par *par)
{
	struct backproject_job j = {
		.b = b, .first = first, .count = count, .vol = vol, .views = views};
	const size_t stride[3] = {1, b->n[0], b->n[0] * b->n[1]};

	if (b->line < 0) {
		ct_par_for(par, b->n[1] * b->n[2], row_of_voxels, &j);
		return;
	}
	j.axis[0] = b->line;
	j.axis[1] = b->line == 0;
	j.axis[2] = b->line == 2 ? 1 : 2;
	for (int a = 0; a < 3; a++) {
		j.stride[a] = stride[j.axis[a]];
		j.tiles[a] = (b->n[j.axis[a]] + tile_size[a] - 1) / tile_size[a];
	}
	ct_par_for(par, j.tiles[0] * j.tiles[1] * j.tiles[2], tile, &j);
}
