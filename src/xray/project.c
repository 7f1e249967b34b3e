/* project.c: see project.h. The plan, and the rays of all pixels one at a time where columns.h
 * does not take them together. */
#include "config.h"
#include "xray/project.h"
#include "core/vec3.h"
#include "xray/columns.h"
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

static struct ct_box whole(const struct ct_projector *g)
{
	struct ct_box b = {.stride = {1, (ptrdiff_t)g->n[0], (ptrdiff_t)(g->n[0] * g->n[1])}};

	for (int a = 0; a < 3; a++)
		b.hi[a] = (ptrdiff_t)g->n[a];
	return b;
}

int ct_projector_reserve(struct ct_projector *g, struct ct_err *e)
{
	int up = ct_columns_axis(g);

	return up < 0 || g->columns ? 0 : ct_columns_alloc(&g->columns, g, up, e);
}

size_t ct_projector_bytes(const struct ct_projector *g)
{
	return ct_columns_bytes(g->columns);
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

struct forward {
	const struct ct_projector *g;
	size_t first;
	float *p;
	const float *vol;
};

/* One detector row of one view. */
static void forward_row(void *arg, size_t i, size_t worker)
{
	const struct forward *f = arg;
	const struct ct_stack *s = f->g->scan;
	size_t view = f->first + i / s->h, at = i % s->h, row[2], col[2];
	float *p = f->p + i * s->w;
	struct ct_box box = whole(f->g);

	(void)worker;
	memset(p, 0, s->w * sizeof *p);
	ct_ray_shadow(f->g, view, &box, row, col);
	if (at < row[0] || at >= row[1])
		return;
	for (size_t c = col[0]; c < col[1]; c++)
		p[c] = (float)ct_ray_sum(f->g, view, at, c, f->vol, &box);
}

void ct_project(const struct ct_projector *g, size_t first, size_t count, float *restrict p,
	const float *restrict vol, struct ct_par *par)
{
	struct forward f = {.g = g, .first = first, .p = p, .vol = vol ? vol : g->loaded};

	if (!g->columns) {
		ct_par_for(par, count * g->scan->h, forward_row, &f);
		return;
	}
	if (vol)
		ct_columns_load(g->columns, vol, par);
	ct_columns_project(g, g->columns, first, count, p, par);
}

struct adjoint {
	const struct ct_projector *g;
	size_t first, count;
	float *vol;
	const float *p;
	int axis;         /* the volume is cut across this axis */
	size_t thickness; /* into slabs of so many voxels, each the work of one task */
};

static void adjoint_slab(void *arg, size_t i, size_t worker)
{
	const struct adjoint *f = arg;
	const struct ct_stack *s = f->g->scan;
	struct ct_box box = whole(f->g);
	ptrdiff_t end = box.hi[f->axis];

	(void)worker;
	box.lo[f->axis] = (ptrdiff_t)(i * f->thickness);
	box.hi[f->axis] = box.lo[f->axis] + (ptrdiff_t)f->thickness;
	if (box.hi[f->axis] > end)
		box.hi[f->axis] = end;
	for (size_t v = 0; v < f->count; v++) {
		size_t row[2], col[2];

		ct_ray_shadow(f->g, f->first + v, &box, row, col);
		for (size_t at = row[0]; at < row[1]; at++)
			for (size_t c = col[0]; c < col[1]; c++)
				ct_ray_spread(f->g, f->first + v, at, c, f->vol, &box,
					(double)f->p[(v * s->h + at) * s->w + c]);
	}
}

void ct_project_adjoint(const struct ct_projector *g, size_t first, size_t count,
	float *restrict vol, const float *restrict p, struct ct_par *par)
{
	struct adjoint f = {.g = g, .first = first, .count = count, .vol = vol, .p = p};
	const double *v = g->scan->view[first].v;
	double most = -1;
	size_t n;

	if (g->columns) {
		ct_columns_load(g->columns, NULL, par);
		ct_columns_adjoint(g, g->columns, first, count, p, par);
		ct_columns_add(g->columns, vol, par);
		return;
	}
	for (int a = 0; a < 3; a++) { /* slabs along the rows meet the fewest rays */
		const double *m = g->inverse[a];
		double along = fabs(m[0] * v[0] + m[1] * v[1] + m[2] * v[2]);

		if (along > most) {
			most = along;
			f.axis = a;
		}
	}
	n = g->n[f.axis];
	f.thickness = n > 512 ? n / 32 : 16;
	ct_par_for(par, (n + f.thickness - 1) / f.thickness, adjoint_slab, &f);
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
			p + k * g->scan->h * g->scan->w, NULL, env->par);
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
		ct_project(&g, k, 1, ct_stack_view(s, k), NULL, env->par);
	}
	ct_progress(env, "views", s->views, s->views);
	rc = 0;
out:
	ct_projector_free(&g);
	return rc;
}
