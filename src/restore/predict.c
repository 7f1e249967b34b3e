/* predict.c: see predict.h. */
#include "config.h"
#include "core/mem.h"
#include "restore/predict.h"
#include "unet/dnn.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ROWS = 128 };

struct side {
	struct ct_regressor_work w;
	struct ct_patch_pose pose[ROWS];
	size_t at[ROWS][3], rows, looked, cells;
	struct ct_err failed;
};

struct job {
	const struct ct_regressor *r;
	const struct ct_scene *scene;
	struct ct_patch_turns turns;
	struct ct_slicing s;
	struct side *side;
	struct ct_guess *g;
	bool coarse; /* the axis across */
	int last;    /* the last axis of the volume, among u, v and across */
	const struct ct_env *env;
};

size_t ct_predict_axes(bool axes[static 3], const struct ct_regressor *r, const struct ct_scene *s)
{
	size_t count = 0;

	for (int a = 0; a < 3; a++) {
		bool u = s->coarse[a == 0 ? 1 : 0], v = s->coarse[a == 2 ? 1 : 2];

		axes[a] = r->shape.swap ? u && v : u != v;
		count += axes[a];
	}
	return count;
}

/* What the rows that are gathered hold, to h. */
static void flush(struct job *j, struct side *d)
{
	const size_t out = ct_regressor_out(j->r);

	if (d->failed.code || d->rows == 0)
		return;
	if (ct_regressor_run(j->r, &d->w, d->rows, &d->failed))
		return;
	for (size_t i = 0; i < d->rows; i++) {
		const struct ct_patch_pose *pose = &d->pose[i];
		const float *said = d->w.out + i * out;

		ct_patch_put(j->g->h, j->g->square, said, &j->s, &j->r->shape, &j->turns, pose,
			d->at[i]);
		if (j->g->v)
			ct_patch_fill(j->g->v,
				j->r->spread[0] * pose->s * pose->s *
					expf(fminf(said[out - 1], 20)),
				&j->s, &j->r->shape, d->at[i]);
	}
	d->looked += d->rows;
	d->rows = 0;
}

static void look(struct job *j, struct side *d, const size_t at[static 3])
{
	const size_t count = ct_patch_count(&j->r->shape), i = d->rows;

	if (j->scene->to && (at[j->last] < j->scene->from || at[j->last] >= j->scene->to))
		return;
	d->cells++;
	if (!ct_patch_cut(d->w.patch + i * count, &d->pose[i], &j->s, &j->r->shape, &j->turns, at))
		return;
	memcpy(d->at[i], at, sizeof d->at[i]);
	ct_regressor_tell(ct_regressor_told(&d->w, j->r, i), &d->pose[i], &j->scene->regime, at[2],
		j->coarse ? j->r->shape.cell : 1);
	if (++d->rows == ROWS)
		flush(j, d);
}

static void slice(void *arg, size_t k, size_t worker)
{
	struct job *j = arg;
	struct side *d = &j->side[worker];
	const size_t cell = j->r->shape.cell;
	int was;

	if (d->failed.code || ct_stopping(j->env))
		return;
	was = ct_dnn_enter();
	for (size_t v = 0; v + cell <= j->s.n[1]; v += cell)
		for (size_t u = 0; u + cell <= j->s.n[0]; u += cell)
			look(j, d, (const size_t[3]){u, v, k});
	flush(j, d);
	ct_dnn_leave(was);
}

static int across(struct job *j, int axis, struct ct_err *e)
{
	const size_t threads = ct_par_threads(j->env->par);

	ct_slicing_of(&j->s, j->scene->x, j->scene->n, axis, j->scene->coarse);
	j->coarse = j->scene->coarse[axis];
	j->last = 0;
	while (j->last < 2 && j->s.stride[j->last] != j->scene->n[0] * j->scene->n[1])
		j->last++;
	ct_par_for(j->env->par, j->s.n[2], slice, j);
	for (size_t t = 0; t < threads; t++)
		if (j->side[t].failed.code) {
			*e = j->side[t].failed;
			return -1;
		}
	return ct_check_stop(j->env, e);
}

static int sides(struct job *j, size_t threads, struct ct_err *e)
{
	if (ct_alloc0(&j->side, threads, sizeof *j->side, e))
		return -1;
	for (size_t t = 0; t < threads; t++)
		if (ct_regressor_work_alloc(&j->side[t].w, j->r, ROWS, e))
			return -1;
	return 0;
}

int ct_predict(struct ct_guess *g, const struct ct_scene *s, const struct ct_regressor *r,
	const bool axes[static 3], size_t *looked, size_t *cells, const struct ct_env *env,
	struct ct_err *e)
{
	const size_t threads = ct_par_threads(env->par);
	struct job j = {.r = r, .scene = s, .g = g, .env = env};
	bool can[3];
	size_t used = 0, done = 0;
	int rc = -1;

	ct_predict_axes(can, r, s);
	for (int a = 0; a < 3; a++)
		used += can[a] && axes[a];
	if (used == 0)
		return ct_fail(e, CT_EGEOM, "no axis has slices that the prior knows");
	if (ct_patch_turns_alloc(&j.turns, &r->shape, e) || sides(&j, threads, e))
		goto out;
	for (int a = 0; a < 3; a++)
		if (can[a] && axes[a]) {
			ct_progress(env, "axes", done++, used);
			if (across(&j, a, e))
				goto out;
		}
	ct_progress(env, "axes", used, used);
	g->axes += used;
	for (size_t t = 0; t < threads; t++) {
		*looked += j.side[t].looked;
		*cells += j.side[t].cells;
	}
	rc = 0;
out:
	for (size_t t = 0; j.side && t < threads; t++)
		ct_regressor_work_free(&j.side[t].w);
	free(j.side);
	ct_patch_turns_free(&j.turns);
	return rc;
}
