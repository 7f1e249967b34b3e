/* flat.c: see flat.h. */
#include "config.h"
#include "resolution/flat.h"
#include "core/room.h"
#include "resolution/resample.h"

#include <math.h>

/* Cell (i,j,k) lies between points i and i + 1, j and j + 1, k and k + 1; the last counts on beyond
 * the border, where the solver knows slopes and interpolation none. */
struct job {
	const float *y;
	float *w; /* of the cells; then of the voxels */
	float *x, *l;
	size_t m[3], cells[3], plane;
	double edge; /* HU^2 */
};

static double variance(const struct job *v, size_t i, size_t j, size_t k)
{
	const size_t *m = v->m;
	double first = 0, sum = 0, square = 0;

	for (int c = 0; c < 8; c++) {
		const size_t p = i + (m[0] > 1 && c & 1), q = j + (m[1] > 1 && c & 2);
		const size_t r = k + (m[2] > 1 && c & 4);
		const double y = (double)v->y[(r * m[1] + q) * m[0] + p];

		if (c == 0)
			first = y; /* keeps the squares small */
		sum += y - first;
		square += (y - first) * (y - first);
	}
	return fmax(square - sum * sum / 8, 0) / 7;
}

static void weigh(void *arg, size_t k, size_t worker)
{
	const struct job *v = arg;
	float *w = v->w + k * v->cells[1] * v->cells[0];

	(void)worker;
	for (size_t j = 0; j < v->cells[1]; j++)
		for (size_t i = 0; i < v->cells[0]; i++) {
			const double part = variance(v, i, j, k) / v->edge;

			*w++ = (float)(1 / (1 + part * part));
		}
}

static void mix(void *arg, size_t k, size_t worker)
{
	const struct job *v = arg;

	(void)worker;
	for (size_t i = k * v->plane; i < (k + 1) * v->plane; i++)
		v->x[i] += v->w[i] * (v->l[i] - v->x[i]);
}

/* From the cells to the voxels. */
static int weights_plan(struct ct_separable *s, const struct job *v, const struct ct_vol *x,
	const double factor[3], const struct ct_par *par, struct ct_err *e)
{
	double start[3], step[3];

	for (int a = 0; a < 3; a++) {
		const double gap = (double)x->n[a] - (double)v->m[a] * factor[a];

		step[a] = 1 / factor[a];
		start[a] = ct_cell_index((ct_cell_centre(0) - 0.5 * gap) * step[a]) - 0.5;
	}
	return ct_resample_plan(s, v->cells, x->n, start, step, CT_LINEAR, false, par, e);
}

int ct_flat_mix(struct ct_vol *x, const struct ct_vol *lo, const double factor[static 3],
	double texture, const struct ct_env *env, struct ct_err *e)
{
	const double level = CT_FLAT_EDGE * texture;
	struct job v = {.y = lo->data,
		.x = x->data,
		.m = {lo->n[0], lo->n[1], lo->n[2]},
		.plane = x->n[0] * x->n[1],
		.edge = level * level};
	struct ct_separable points = {0}, cells = {0};
	float *w = NULL, *fine = NULL;
	int rc = -1;

	if (!(v.edge > 0))
		return 0;
	for (int a = 0; a < 3; a++)
		v.cells[a] = v.m[a] > 1 ? v.m[a] - 1 : 1;
	if (ct_resample_up_plan(&points, lo->n, factor, CT_LINEAR, env->par, e) ||
		ct_room_alloc(&v.l, ct_vol_count(x), sizeof *v.l, e))
		goto out;
	ct_separable_apply(&points, v.l, lo->data, env->par);
	ct_separable_free(&points);
	if (weights_plan(&cells, &v, x, factor, env->par, e) ||
		ct_room_alloc(&w, v.cells[0] * v.cells[1] * v.cells[2], sizeof *w, e) ||
		ct_room_alloc(&fine, ct_vol_count(x), sizeof *fine, e))
		goto out;
	v.w = w;
	ct_par_for(env->par, v.cells[2], weigh, &v);
	ct_separable_apply(&cells, fine, w, env->par);
	v.w = fine;
	ct_par_for(env->par, x->n[2], mix, &v);
	rc = 0;
out:
	ct_separable_free(&points);
	ct_separable_free(&cells);
	ct_room_free(v.l);
	ct_room_free(w);
	ct_room_free(fine);
	return rc;
}
