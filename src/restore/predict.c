/* predict.c: see predict.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "restore/predict.h"
#include "nn/dnn.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ROWS = 128 };

struct side {
	struct ct_slice_network_work w;
	struct ct_patch_pose pose[ROWS];
	float part[ROWS];                                       /* of the cell from there */
	size_t at[ROWS][3], poses[ROWS], rows, textured, cells; /* poses: of the cell from there */
	struct ct_err failed;
};

struct predict_job {
	const struct ct_slice_network *r;
	const struct ct_scene *scene;
	struct ct_slicing s;
	struct ct_slice_network_ready ready;
	struct side *side;
	struct ct_guess *g;
	bool coarse; /* the axis across */
	const struct ct_env *env;
};

size_t ct_predict_axes(bool axes[static 3], const struct ct_slice_network *r,
	const struct ct_scene *s, const bool *of)
{
	size_t count = 0;

	for (int a = 0; a < 3; a++) {
		axes[a] = (!of || of[a]) && ct_patch_shape_fits(&r->shape, a, s->coarse);
		count += axes[a];
	}
	return count;
}

/* What the axes before expect of a cell, once more, times `rest`; added. */
static void recall(float *cell, const struct predict_job *j, const float *sum,
	const size_t at[static 3], float rest)
{
	float was[CT_PATCH_CELL_MOST];

	if (!(rest > 0) || j->g->axes == 0)
		return;
	ct_patch_take(was, sum, &j->s, &j->r->shape, at);
	for (size_t k = 0; k < j->r->cell; k++)
		cell[k] += rest / (float)j->g->axes * was[k];
}

/* A cell and its error v, both times `part`, to h. */
static void add(
	const struct predict_job *j, float *cell, float v, const size_t at[static 3], float part)
{
	const struct ct_patch_shape *shape = &j->r->shape;

	recall(cell, j, j->g->h, at, 1 - part);
	ct_patch_put(j->g->h, j->g->square, cell, &j->s, shape, at);
	if (!j->g->v)
		return;
	for (size_t k = 0; k < j->r->cell; k++)
		cell[k] = j->r->spread[0] * v;
	recall(cell, j, j->g->v, at, 1 - part);
	ct_patch_put(j->g->v, NULL, cell, &j->s, shape, at);
}

/* What the rows from i on, the poses of a cell, hold, to h. */
static void put(struct predict_job *j, const struct side *d, size_t i)
{
	const size_t out = j->r->out, end = i + d->poses[i];
	float cell[CT_PATCH_CELL_MOST] = {0}, v = 0;
	const size_t first = i;

	for (; i < end; i++) {
		const struct ct_patch_pose *pose = &d->pose[i];
		const float *said = d->w.out + i * out;

		ct_patch_back(cell, said, &j->r->shape, pose);
		v += pose->share * pose->s * pose->s * expf(fminf(said[out - 1], 0));
	}
	add(j, cell, v, d->at[first], d->part[first]);
}

/* What the rows that are gathered hold, to h. */
static void flush(struct predict_job *j, struct side *d)
{
	if (d->rows && !d->failed.code &&
		ct_slice_network_run(j->r, &j->ready, &d->w, d->rows, &d->failed) == 0)
		for (size_t i = 0; i < d->rows; i += d->poses[i])
			put(j, d, i);
	d->rows = 0;
}

/* What a pass before added to the block of a cell, RMS. */
static double added(const struct predict_job *j, const size_t at[static 3])
{
	const struct ct_added *b = j->g->before;
	const size_t *n = j->scene->n, *stride = j->s.stride;
	const size_t i = at[0] * stride[0] + at[1] * stride[1] + at[2] * stride[2];
	const size_t of[3] = {i % n[0], i / n[0] % n[1], i / n[0] / n[1]};
	size_t block = 0;

	for (int a = 2; a >= 0; a--)
		block = block * b->m[a] + of[a] * b->m[a] / n[a];
	return (double)b->rms[block];
}

/* What the axes before expect of a cell, RMS of what of it is in the volume. */
static double expected(const struct predict_job *j, const size_t at[static 3])
{
	const struct ct_patch_shape *shape = &j->r->shape;
	const size_t side[3] = {shape->cell, shape->cell, shape->slices};
	float was[CT_PATCH_CELL_MOST];
	double square = 0, count = 1;

	ct_patch_take(was, j->g->h, &j->s, shape, at);
	for (size_t k = 0; k < j->r->cell; k++)
		square += (double)was[k] * (double)was[k];
	for (int a = 0; a < 3; a++)
		count *= fmin((double)side[a], (double)(j->s.n[a] - at[a]));
	return sqrt(square / count) / (double)j->g->axes;
}

/* The share of a cell that is looked at. */
static float part_of(const struct predict_job *j, const size_t at[static 3])
{
	const struct ct_guess *g = j->g;

	if (!(g->least > 0) || (g->axes == 0 && !g->before))
		return 1;
	return ct_patch_rise((float)((g->axes ? expected(j, at) : added(j, at)) / g->least) - 1);
}

static void look(struct predict_job *j, struct side *d, const size_t at[static 3])
{
	const struct ct_patch_shape *shape = &j->r->shape;
	const float part = part_of(j, at);
	struct ct_patch_pose pose[CT_PATCH_POSES];
	float raw[CT_PATCH_MOST], none[CT_PATCH_CELL_MOST] = {0};
	size_t count = 0;

	d->cells++;
	if (part > 0)
		count = ct_patch_look(raw, pose, &j->s, shape, at);
	if (count == 0) {
		if (part < 1)
			add(j, none, 0, at, part);
		return;
	}
	d->textured++;
	if (d->rows + count > ROWS)
		flush(j, d);
	d->poses[d->rows] = count;
	for (size_t p = 0; p < count; p++) {
		const size_t i = d->rows++;

		ct_patch_turn(d->w.patch + i * ct_patch_count(shape), raw, shape, &pose[p]);
		ct_slice_network_describe(ct_slice_network_features(&d->w, j->r, i), &pose[p],
			&j->scene->regime, at[2], j->coarse ? shape->cell : 1, shape->slices);
		d->pose[i] = pose[p];
		d->pose[i].share *= part;
		d->part[i] = part;
		memcpy(d->at[i], at, sizeof d->at[i]);
	}
}

/* The cells of a group of slices. */
static void slices(void *arg, size_t group, size_t worker)
{
	struct predict_job *j = arg;
	struct side *d = &j->side[worker];
	const size_t cell = j->r->shape.cell, k = group * j->r->shape.slices;
	int was;

	if (d->failed.code || ct_stopping(j->env))
		return;
	if (worker == 0 && j->g->slices) /* the calling thread */
		ct_progress(j->env, "slices", j->g->done + k, j->g->slices);
	was = ct_dnn_enter();
	for (size_t v = 0; v < j->s.n[1]; v += cell)
		for (size_t u = 0; u < j->s.n[0]; u += cell)
			look(j, d, (const size_t[3]){u, v, k});
	flush(j, d);
	ct_dnn_leave(was);
}

static int across(struct predict_job *j, int axis, struct ct_err *e)
{
	const size_t threads = ct_par_threads(j->env->par), deep = j->r->shape.slices;

	ct_slicing_of(&j->s, j->scene->x, j->scene->n, axis, j->scene->coarse);
	j->coarse = j->scene->coarse[axis];
	ct_par_for(j->env->par, (j->s.n[2] + deep - 1) / deep, slices, j);
	j->g->done += j->s.n[2];
	return ct_err_any(ct_err_first(e, threads, &j->side->failed, sizeof *j->side) ||
			  ct_check_stop(j->env, e));
}

static int sides(struct predict_job *j, size_t threads, struct ct_err *e)
{
	if (ct_alloc0(&j->side, threads, sizeof *j->side, e))
		return -1;
	for (size_t t = 0; t < threads; t++)
		if (ct_slice_network_work_alloc(&j->side[t].w, j->r, ROWS, e))
			return -1;
	return 0;
}

double ct_predict_bytes(const struct ct_slice_network *r, size_t threads)
{
	return ct_slice_network_bytes(r, ROWS, threads) + (double)threads * sizeof(struct side);
}

int ct_predict(struct ct_guess *g, const struct ct_scene *s, const struct ct_slice_network *r,
	const bool axes[static 3], size_t *textured, size_t *cells, const struct ct_env *env,
	struct ct_err *e)
{
	const size_t threads = ct_par_threads(env->par);
	struct predict_job j = {.r = r, .scene = s, .g = g, .env = env};
	bool use[3];
	int rc = -1;

	if (ct_predict_axes(use, r, s, axes) == 0)
		return ct_fail(e, CT_EGEOM, "the prior has no network for the slices of any axis");
	if (sides(&j, threads, e) || ct_slice_network_ready_alloc(&j.ready, r, e))
		goto out;
	for (int a = 0; a < 3; a++)
		if (use[a]) {
			if (across(&j, a, e))
				goto out;
			g->axes++;
		}
	if (g->slices)
		ct_progress(env, "slices", g->done, g->slices);
	for (size_t t = 0; t < threads; t++) {
		*textured += j.side[t].textured;
		*cells += j.side[t].cells;
	}
	rc = 0;
out:
	for (size_t t = 0; j.side && t < threads; t++)
		ct_slice_network_work_free(&j.side[t].w);
	free(j.side);
	ct_slice_network_ready_free(&j.ready);
	return rc;
}
