/* field-fit-volume.c: the values of a fitted field on a grid (field-fit.h).
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "field/field-fit-step.h"
#include "field/render.h"
#include "core/mem.h"
#include "core/vec3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STREAM = 0x66694100, STRIP = 1 << 14 }; /* voxels between two looks at `stop` */

struct volume_job {
	const struct ct_field_fit *f;
	struct ct_vol *out;
	double grid[3][4];
	size_t first, count, piece;
	struct ct_err *e; /* of each worker */
	float *x;         /* of each worker, the points of both passes */
};

/* The field at the centres, rounded up to whole segments. */
static int centres(const struct volume_job *j, struct ct_field_scratch *s, float *x, size_t first,
	size_t n, struct ct_err *e)
{
	const size_t seg = j->f->pass[0].field->segment, all = (n + seg - 1) / seg * seg;

	for (size_t k = 0; k < all; k++) {
		const size_t v = first + (k < n ? k : n - 1);
		struct ct_field_item it;

		ct_field_item_voxel(&it, j->grid, j->out->n, v);
		for (int a = 0; a < 3; a++)
			x[3 * k + (size_t)a] = (float)fmin(fmax(it.centre[a], 0), 1);
	}
	if (ct_field_forward(j->f->pass[0].field, s->work[0], all, x, s->y, e))
		return -1;
	memcpy(j->out->data + first, s->y, n * sizeof *s->y);
	return 0;
}

/* Voxels as lines or cubes: the second pass is the value. */
static int rendered(const struct volume_job *j, struct ct_field_scratch *s, float *x, size_t first,
	size_t n, struct ct_err *e)
{
	const struct ct_samples *how = &j->f->rule.samples;
	const double end = ct_samples_end(how->kind);
	const bool cube = how->kind == CT_SAMPLES_CUBES;
	float *const at[2] = {x, x + 3 * j->piece * how->n};

	for (size_t p = 0; p < 2; p++) {
		const size_t per = ct_samples_count(how, p);

		for (size_t k = 0; k < n; k++) {
			const struct ct_samples_draw draw = {
				j->f->seed, STREAM, (uint32_t)(first + k)};
			struct ct_field_item it;

			ct_field_item_voxel(&it, j->grid, j->out->n, first + k);
			ct_field_item_place(
				at[p] + 3 * k * per, s, how, &it, p, k, x + 3 * k * how->n, &draw);
		}
		if (ct_field_forward(j->f->pass[p].field, s->work[p], n * per, at[p], s->y, e))
			return -1;
		for (size_t k = 0; k < n; k++)
			j->out->data[first + k] = (float)ct_render(per, s->w[p] + k * per,
				s->t[p] + k * per, end, cube, s->y + 2 * k * per);
	}
	return 0;
}

static void piece(void *arg, size_t i, size_t worker)
{
	struct volume_job *j = arg;
	const struct ct_samples *how = &j->f->rule.samples;
	struct ct_field_scratch *s = &j->f->own[worker];
	const size_t first = i * j->piece, left = j->count - first;
	const size_t n = left < j->piece ? left : j->piece;
	float *x = j->x + worker * 3 * j->piece * (how->n + how->n + how->fine);

	if (j->e[worker].code == CT_OK)
		(void)(how->fine ? rendered : centres)(j, s, x, j->first + first, n, &j->e[worker]);
}

static int strips(struct volume_job *j, const struct ct_env *env, struct ct_err *e)
{
	const size_t all = ct_vol_count(j->out), strip = j->piece * (STRIP / j->piece + 1);

	for (j->first = 0; j->first < all; j->first += strip) {
		j->count = all - j->first < strip ? all - j->first : strip;
		ct_par_for(env->par, (j->count + j->piece - 1) / j->piece, piece, j);
		if (ct_err_first(e, j->f->workers, j->e, sizeof *j->e))
			return -1;
		ct_progress(env, "evaluating", j->first + j->count, all);
		if (j->first + j->count < all && ct_check_stop(env, e))
			return -1;
	}
	return 0;
}

int ct_field_fit_volume(struct ct_vol *out, const struct ct_field_fit *f,
	const struct ct_field_data *d, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_samples *how = &f->rule.samples;
	struct volume_job j = {.f = f, .out = out};
	int rc = -1;

	j.piece = how->fine ? ct_field_step_piece(&f->rule) : CT_FIELD_STEP_POINTS;
	if (!how->fine && how->n > 1) /* of rays: as many points as a piece of them */
		j.piece = ct_field_step_piece(&f->rule) * how->n;
	ct_vec3_after(j.grid, d->box, (const double(*)[4])out->affine);
	if (ct_alloc0(&j.e, f->workers, sizeof *j.e, e) ||
		ct_alloc(&j.x, f->workers * 3 * j.piece * (2 * how->n + how->fine), sizeof *j.x, e))
		goto out;
	rc = strips(&j, env, e);
out:
	free(j.e);
	free(j.x);
	return rc;
}
