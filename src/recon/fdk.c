/* fdk.c: see fdk.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "recon/fdk.h"
#include "recon/upright.h"
#include "core/mem.h"
#include "core/vec3.h"

#include <math.h>
#include <stdlib.h>

#define BLOCK_BYTES ((size_t)128 << 20)

/* Of the cylinder about the orbit's axis that holds the grid. The axis is not known before the
 * orbit is studied, so the corners are kept to the line that a first study finds. */
static double radius_about(const struct ct_fdk_weights *o, const struct ct_vol *grid)
{
	double most = 0;

	for (unsigned k = 0; k < 8; k++) {
		double mm[3], along;

		ct_vol_corner(grid, k, mm);
		ct_vec3_minus(mm, mm, o->centre);
		along = ct_vec3_dot(mm, o->axis);
		most = fmax(most, sqrt(fmax(ct_vec3_dot(mm, mm) - along * along, 0)));
	}
	return most;
}

/* Do all corners of the grid fall into the rows of a view and, if so asked, its columns? */
static bool sees_all(const struct ct_backprojector *b, size_t view, bool columns)
{
	for (unsigned c = 0; c < 8; c++) {
		double x[3], at[3];

		ct_cell_corner(x, b->n, c, 0);
		ct_backproject_at(b, view, x, at);
		if (!(at[1] >= -0.5 && at[1] <= (double)b->h - 0.5))
			return false;
		if (columns && !(at[0] >= -0.5 && at[0] <= (double)b->w - 0.5))
			return false;
	}
	return true;
}

/* A fan sees one plane: every voxel must be within half a row of it. */
static int check_fan(const struct ct_backprojector *b, struct ct_err *e)
{
	if (b->h != 1)
		return ct_fail(
			e, CT_EGEOM, "a fan has one detector row, not %zu: use a cone", b->h);
	for (size_t k = 0; k < b->views; k++)
		if (!sees_all(b, k, false))
			return ct_fail(e, CT_EGEOM,
				"a fan sees one plane, and the grid of %zux%zux%zu leaves it: a "
				"single slice in the plane of the fan is needed",
				b->n[0], b->n[1], b->n[2]);
	return 0;
}

/* Pixel at the centre over the smallest voxel across the axis. */
static double voxel_cutoff(const struct ct_fdk_weights *o, const struct ct_vol *grid)
{
	double pixel = HUGE_VAL, voxel = HUGE_VAL, mm[3];

	ct_vol_spacing(grid, mm);
	for (int a = 0; a < 3; a++) {
		double along = 0;

		for (int r = 0; r < 3; r++)
			along += grid->affine[r][a] * o->axis[r];
		if (fabs(along) < 0.9 * mm[a])
			voxel = fmin(voxel, mm[a]);
	}
	for (size_t k = 0; k < o->views; k++) {
		const struct ct_fdk_weights_view *v = &o->view[k];

		pixel = fmin(pixel, o->beam == CT_PARALLEL ? v->pitch[0]
							   : v->pitch[0] * o->radius / v->distance);
	}
	return fmin(1, pixel / voxel);
}

int ct_fdk_alloc(struct ct_fdk *f, const struct ct_vol *grid, const struct ct_stack *scan,
	enum ct_ramp_kind kind, double cutoff, bool parker, struct ct_par *par, struct ct_err *e)
{
	size_t threads = ct_par_threads(par), size;
	const size_t *widen = f->orbit.widen;
	const struct ct_stack *data = scan;
	double radius;
	int leans;

	*f = (struct ct_fdk){.scan = data, .kind = kind};
	if (ct_stack_check(data, e) || (leans = ct_upright_views(&f->upright, data, e)) < 0)
		return -1;
	scan = leans ? data : &f->upright;
	if (scan->w < 2) {
		ct_fail(e, CT_EGEOM,
			"rows of one pixel cannot be filtered; the iterative methods accept them");
		goto fail;
	}
	if (ct_fdk_weights_alloc(&f->orbit, scan, (double)INFINITY, false, e))
		goto fail;
	radius = radius_about(&f->orbit, grid);
	ct_fdk_weights_free(&f->orbit);
	if (ct_fdk_weights_alloc(&f->orbit, scan, radius, parker, e))
		goto fail;
	f->cutoff = cutoff > 0 ? cutoff : voxel_cutoff(&f->orbit, grid);
	if (ct_backprojector_alloc(&f->back, grid, scan, f->orbit.centre, e) ||
		(scan->beam == CT_FAN && check_fan(&f->back, e)) ||
		ct_backprojector_widen(&f->back, widen[0], widen[1], e) ||
		ct_ramp_alloc(&f->filter, kind, f->cutoff, f->back.w, e))
		goto fail;
	size = ct_backprojector_size(&f->back);
	f->block = BLOCK_BYTES / (size * sizeof *f->views);
	f->block = f->block < 1 ? 1 : f->block > scan->views ? scan->views : f->block;
	if (ct_alloc0(&f->views, f->block * size, sizeof *f->views, e) ||
		ct_alloc(&f->weight, threads * scan->h * scan->w, sizeof *f->weight, e) ||
		(f->upright.views &&
			ct_alloc(&f->stood, threads * scan->h * scan->w, sizeof *f->stood, e)) ||
		ct_alloc(&f->scratch, threads * ct_ramp_scratch(&f->filter), sizeof *f->scratch, e))
		goto fail;
	return 0;
fail:
	ct_fdk_free(f);
	return -1;
}

void ct_fdk_free(struct ct_fdk *f)
{
	ct_fdk_weights_free(&f->orbit);
	ct_ramp_free(&f->filter);
	ct_backprojector_free(&f->back);
	ct_stack_free(&f->upright);
	free(f->views);
	free(f->stood);
	free(f->weight);
	free(f->scratch);
	*f = (struct ct_fdk){0};
}

struct fdk_job {
	struct ct_fdk *f;
	size_t first;
};

/* Weigh, filter and transpose one view. */
static void filter_view(void *arg, size_t i, size_t worker)
{
	const struct fdk_job *j = arg;
	struct ct_fdk *f = j->f;
	const struct ct_stack *stood = f->upright.views ? &f->upright : f->scan;
	size_t h = stood->h, w = stood->w, pitch = f->back.pitch;
	float *out = f->views + i * ct_backprojector_size(&f->back);
	float *weight = f->weight + worker * h * w;
	double *scratch = f->scratch + worker * ct_ramp_scratch(&f->filter);
	const float *in = ct_stack_view(f->scan, j->first + i);

	if (f->upright.views) {
		ct_upright_pixels(f->stood + worker * h * w, &f->upright, f->scan, j->first + i);
		in = f->stood + worker * h * w;
	}
	ct_fdk_weights_of(&f->orbit, j->first + i, f->kind == CT_RAMP_NONE, weight);
	for (size_t r = 0; r < h; r += CT_RAMP_ROWS) {
		size_t rows = h - r < CT_RAMP_ROWS ? h - r : CT_RAMP_ROWS;

		CT_SIMD(ct_ramp_rows)
		(&f->filter, rows, out + pitch + CT_BP_PAD + r, pitch, in + r * w, weight + r * w,
			f->orbit.widen[0], w, scratch);
	}
	ct_backproject_frame(&f->back, out);
}

void ct_fdk_views(
	struct ct_fdk *f, size_t first, size_t count, float *restrict vol, struct ct_par *par)
{
	struct fdk_job j = {.f = f, .first = first};

	ct_par_for(par, count, filter_view, &j);
	ct_backproject(&f->back, first, count, vol, f->views, par);
}

int ct_fdk_all(struct ct_fdk *f, float *restrict vol, const struct ct_env *env, struct ct_err *e)
{
	const size_t views = f->scan->views;

	for (size_t k = 0, n; k < views; k += n) {
		n = views - k < f->block ? views - k : f->block;
		ct_progress(env, "views", k, views);
		if (ct_check_stop(env, e))
			return -1;
		ct_fdk_views(f, k, n, vol, env->par);
	}
	ct_progress(env, "views", views, views);
	return 0;
}

size_t ct_fdk_bytes(const struct ct_fdk *f, size_t threads)
{
	return f->block * ct_backprojector_size(&f->back) * sizeof *f->views +
	       threads * (f->scan->h * f->scan->w * (f->upright.views ? 2 : 1) * sizeof *f->weight +
				 ct_ramp_scratch(&f->filter) * sizeof *f->scratch);
}

size_t ct_fdk_truncated(const struct ct_fdk *f)
{
	size_t n = 0;

	for (size_t k = 0; k < f->back.views; k++)
		n += !sees_all(&f->back, k, true);
	return n;
}
