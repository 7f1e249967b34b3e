/* project.c: see project.h. The plan, and what its threads do: rays one at a time (ray.h), or
 * together where columns.h takes them. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "xray/project.h"
#include "core/vec3.h"
#include "xray/columns.h"
#include "xray/packet.h"
#include "xray/ray.h"
#include "xray/geometry.h"

#include <math.h>
#include <string.h>

#define MOST_SLICE_VOXELS                                                                          \
	((size_t)1 << 26) /* voxels of a slice: offsets within a block are 32 bits */

int ct_projector_init(struct ct_projector *g, const struct ct_vol *grid,
	const struct ct_stack *scan, struct ct_err *e)
{
	const double(*m)[4] = (const double(*)[4])grid->affine;
	double dual[3][3], det;

	if (ct_vol_check_grid(grid, e) || ct_stack_check(scan, e) ||
		ct_geometry_check(scan, grid, e))
		return -1;
	if (grid->n[2] > MOST_SLICE_VOXELS || grid->n[0] > MOST_SLICE_VOXELS / grid->n[1])
		return ct_fail(e, CT_EGEOM,
			"a volume of %zux%zux%zu voxels is too large to project", grid->n[0],
			grid->n[1], grid->n[2]);
	*g = (struct ct_projector){.scan = scan};
	memcpy(g->n, grid->n, sizeof g->n);
	memcpy(g->affine, grid->affine, sizeof g->affine);
	det = ct_vec3_dual(dual, m[0], m[1], m[2]);
	for (int c = 0; c < 3; c++) {
		g->inverse[c][3] = 0.5;
		for (int r = 0; r < 3; r++) {
			g->inverse[c][r] = dual[r][c] / det;
			g->inverse[c][3] -= g->inverse[c][r] * m[r][3];
		}
	}
	return 0;
}

int ct_projector_reserve(struct ct_projector *g, struct ct_err *e)
{
	int up = ct_columns_axis(g);

	return up < 0 || g->columns ? 0 : ct_columns_alloc(&g->columns, g, up, e);
}

size_t ct_projector_bytes(const struct ct_projector *g)
{
	const struct ct_columns *c = g->columns;

	return c ? c->n[c->p] * c->n[c->q] * (c->pitch * sizeof *c->data + sizeof *c->span) : 0;
}

void ct_projector_free(struct ct_projector *g)
{
	ct_columns_free(g->columns);
	*g = (struct ct_projector){0};
}

void ct_projector_load(struct ct_projector *g, const float *vol, struct ct_par *par)
{
	g->loaded = vol;
	if (g->columns)
		ct_columns_load(g->columns, vol, par);
}

/* All voxels; of columns those that are not zero. */
static struct ct_box box_of(const struct ct_projector *g)
{
	struct ct_box b = {.stride = {1, (ptrdiff_t)g->n[0], (ptrdiff_t)(g->n[0] * g->n[1])}};

	if (g->columns)
		return g->columns->box;
	for (int a = 0; a < 3; a++)
		b.hi[a] = (ptrdiff_t)g->n[a];
	return b;
}

/* Columns of a tile of the detector, whose rays meet the same voxels; its rows are CT_ROWS, or so
 * many where rays go one at a time. */
enum { ACROSS = 32, DOWN = 8 };

struct forward {
	const struct ct_projector *g;
	struct ct_box box;
	size_t first, rows, down, across; /* view; rows of a tile; tiles of a view */
	float *p;
};

/* A tile of one view. */
static void forward_tile(void *arg, size_t i, size_t worker)
{
	const struct forward *f = arg;
	const struct ct_projector *g = f->g;
	const size_t h = g->scan->h, w = g->scan->w, k = i / f->across / f->down;
	size_t r0 = i / f->across % f->down * f->rows, c0 = i % f->across * ACROSS;
	size_t r1 = r0 + f->rows < h ? r0 + f->rows : h, c1 = c0 + ACROSS < w ? c0 + ACROSS : w;
	size_t row[2], col[2];
	float *p = f->p + k * h * w;

	(void)worker;
	for (size_t r = r0; r < r1; r++)
		memset(p + r * w + c0, 0, (c1 - c0) * sizeof *p);
	ct_ray_shadow(g, f->first + k, &f->box, row, col);
	r0 = r0 > row[0] ? r0 : row[0];
	r1 = r1 < row[1] ? r1 : row[1];
	c0 = c0 > col[0] ? c0 : col[0];
	c1 = c1 < col[1] ? c1 : col[1];
	for (size_t c = c0; c < c1 && r0 < r1 && g->columns; c++)
		ct_columns_sum(g, f->first + k, c, r0, r1, p);
	for (size_t r = r0; r < r1 && !g->columns; r++)
		for (size_t c = c0; c < c1; c++)
			p[r * w + c] = (float)ct_ray_sum(g, f->first + k, r, c, g->loaded, &f->box);
}

void ct_project(const struct ct_projector *g, size_t first, size_t count, float *restrict p,
	struct ct_par *par)
{
	const size_t rows = g->columns ? CT_ROWS : DOWN;
	struct forward f = {.g = g,
		.box = box_of(g),
		.first = first,
		.rows = rows,
		.down = (g->scan->h + rows - 1) / rows,
		.across = (g->scan->w + ACROSS - 1) / ACROSS,
		.p = p};

	ct_par_for(par, count * f.down * f.across, forward_tile, &f);
}

struct adjoint {
	const struct ct_projector *g;
	struct ct_box box;
	size_t first, count;
	float *vol;
	const float *p;
	int axis;         /* the volume is cut across this axis */
	size_t thickness; /* into slabs of so many voxels, each the work of one task */
};

static void adjoint_slab(void *arg, size_t i, size_t worker)
{
	const struct adjoint *f = arg;
	const struct ct_projector *g = f->g;
	const size_t h = g->scan->h, w = g->scan->w;
	struct ct_box box = f->box;
	ptrdiff_t end = box.hi[f->axis];

	(void)worker;
	box.lo[f->axis] = (ptrdiff_t)(i * f->thickness);
	box.hi[f->axis] = box.lo[f->axis] + (ptrdiff_t)f->thickness;
	if (box.hi[f->axis] > end)
		box.hi[f->axis] = end;
	for (size_t k = 0; k < f->count; k++) {
		const float *p = f->p + k * h * w;
		const size_t view = f->first + k, rows = g->columns ? CT_ROWS : 1;
		size_t row[2], col[2];

		ct_ray_shadow(g, view, &box, row, col);
		for (size_t r = row[0]; r < row[1]; r += rows)
			for (size_t c = col[0]; c < col[1]; c++)
				if (g->columns)
					ct_columns_spread(g, view, c, r,
						r + rows < row[1] ? r + rows : row[1], p, &box);
				else
					ct_ray_spread(
						g, view, r, c, f->vol, &box, (double)p[r * w + c]);
	}
}

/* The axis of the grid, but for `but`, that is nearest to the direction u: slabs across it meet the
 * fewest of the rays that lie side by side along u. */
static int axis_along(const struct ct_projector *g, const double u[3], int but)
{
	double most = -1;
	int axis = 0;

	for (int a = 0; a < 3; a++) {
		double along = fabs(ct_vec3_dot(g->inverse[a], u));

		if (a != but && along > most) {
			most = along;
			axis = a;
		}
	}
	return axis;
}

void ct_project_adjoint(const struct ct_projector *g, size_t first, size_t count,
	float *restrict vol, const float *restrict p, struct ct_par *par)
{
	const struct ct_view *v = &g->scan->view[first];
	struct ct_columns *columns = g->columns;
	struct adjoint f = {.g = g, .first = first, .count = count, .vol = vol, .p = p};
	size_t n;

	if (columns)
		ct_columns_load(columns, NULL, par);
	f.box = box_of(g);
	f.axis = columns ? axis_along(g, v->u, columns->up) : axis_along(g, v->v, -1);
	n = g->n[f.axis];
	f.thickness = n > 512 ? n / 32 : 16;
	ct_par_for(par, (n + f.thickness - 1) / f.thickness, adjoint_slab, &f);
	if (columns)
		ct_columns_add(columns, vol, par);
}

enum { BLOCK = 64 }; /* views between two looks whether to stop */

static int forward(void *ctx, float *p, size_t views, const float *x, const struct ct_env *env,
	struct ct_err *e)
{
	struct ct_projector *g = ctx;

	ct_projector_load(g, x, env->par);
	for (size_t k = 0; k < views; k += BLOCK) {
		if (ct_check_stop(env, e))
			return -1;
		ct_project(g, k, views - k < BLOCK ? views - k : BLOCK,
			p + k * g->scan->h * g->scan->w, env->par);
	}
	return 0;
}

static int adjoint(void *ctx, float *x, size_t views, const float *p, const struct ct_env *env,
	struct ct_err *e)
{
	struct ct_projector *g = ctx;

	memset(x, 0, g->n[0] * g->n[1] * g->n[2] * sizeof *x);
	for (size_t k = 0; k < views; k += BLOCK) {
		if (ct_check_stop(env, e))
			return -1;
		ct_project_adjoint(g, k, views - k < BLOCK ? views - k : BLOCK, x,
			p + k * g->scan->h * g->scan->w, env->par);
	}
	return 0;
}

struct ct_linear ct_project_linear(struct ct_projector *g)
{
	const struct ct_stack *s = g->scan;

	return (struct ct_linear){
		g->n[0] * g->n[1] * g->n[2], s->views, s->h * s->w, forward, adjoint, g};
}

int ct_project_all(struct ct_stack *s, const struct ct_vol *density, const struct ct_env *env,
	struct ct_err *e)
{
	struct ct_projector g = {0};
	int rc = -1;

	if (ct_projector_init(&g, density, s, e) || ct_projector_reserve(&g, e))
		goto out;
	ct_projector_load(&g, density->data, env->par);
	for (size_t k = 0; k < s->views; k++) {
		ct_progress(env, "views", k, s->views);
		if (ct_check_stop(env, e))
			goto out;
		ct_project(&g, k, 1, ct_stack_view(s, k), env->par);
	}
	ct_progress(env, "views", s->views, s->views);
	rc = 0;
out:
	ct_projector_free(&g);
	return rc;
}
