/* hessian-tv.c: see tv.h. Two passes over rows an iteration: the dual ascends along H of
 * the extrapolated volume, then the volume descends along its adjoint.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "inverse/hessian-row.h"
#include "inverse/tv.h"
#include "inverse/tv-row.h"
#include "solve/vector.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { II, JJ, KK, IJ, IK, JK, PARTS = CT_HESSIAN_PARTS, SLAB = CT_CONSISTENCY_SLAB };

/* Iterations that halve the primal step, and the part of it that stays. */
#define HALVES 30
#define LEAST_PART 0.05

struct hessian_tv_job {
	float *x, *ahead;  /* the volume; extrapolated, and then the next one */
	int16_t *q[PARTS]; /* the dual */
	int16_t *zero;     /* a row of zeros */
	float *row;        /* of each worker: what is measured */
	double *moved;     /* of each plane, squared */
	struct ct_consistency *dc;
	size_t n[3], plane;
	float weight[PARTS], s, t;
	float part; /* of the first primal step */
	bool measure;
};

/* What is left of a component at a border has no weight. */
static struct ct_hessian_ascent ascent(const struct hessian_tv_job *v, size_t j, size_t k)
{
	const size_t at = k * v->plane + j * v->n[0];
	const ptrdiff_t row = (ptrdiff_t)v->n[0], plane = (ptrdiff_t)v->plane;
	struct ct_hessian_ascent r = {.x = v->ahead + at,
		.j0 = j > 0 ? -row : 0,
		.j1 = j + 1 < v->n[1] ? row : 0,
		.k0 = k > 0 ? -plane : 0,
		.k1 = k + 1 < v->n[2] ? plane : 0};

	for (int c = 0; c < PARTS; c++)
		r.q[c] = v->q[c] + at;
	memcpy(r.weight, v->weight, sizeof r.weight);
	if (r.j0 == 0 || r.j1 == 0)
		r.weight[JJ] = 0;
	if (r.k0 == 0 || r.k1 == 0)
		r.weight[KK] = 0;
	if (r.j1 == 0 || r.k1 == 0)
		r.weight[JK] = 0;
	return r;
}

static void ascend(void *arg, size_t k, size_t worker)
{
	const struct hessian_tv_job *v = arg;

	(void)worker;
	for (size_t j = 0; j < v->n[1]; j++) {
		const struct ct_hessian_ascent r = ascent(v, j, k);

		CT_SIMD(ct_hessian_row_ascend)(&r, v->n[0], v->s / v->part);
	}
}

/* Row (j,k) of component c, zeros outside. */
static const int16_t *dual_row(const struct hessian_tv_job *v, int c, ptrdiff_t j, ptrdiff_t k)
{
	if (j < 0 || k < 0 || (size_t)j >= v->n[1] || (size_t)k >= v->n[2])
		return v->zero;
	return v->q[c] + (size_t)k * v->plane + (size_t)j * v->n[0];
}

/* Cross components are zero at the last voxel, second ones at both ends, of their axes. */
static struct ct_hessian_descent descent(const struct hessian_tv_job *v, ptrdiff_t j, ptrdiff_t k)
{
	struct ct_hessian_descent r = {.ii = dual_row(v, II, j, k),
		.jk = {dual_row(v, JK, j, k), dual_row(v, JK, j - 1, k), dual_row(v, JK, j, k - 1),
			dual_row(v, JK, j - 1, k - 1)}};

	for (int d = 0; d < 3; d++) {
		r.jj[d] = dual_row(v, JJ, j + d - 1, k);
		r.kk[d] = dual_row(v, KK, j, k + d - 1);
	}
	for (int d = 0; d < 2; d++) {
		r.ij[d] = dual_row(v, IJ, j + d - 1, k);
		r.ik[d] = dual_row(v, IK, j, k + d - 1);
	}
	memcpy(r.weight, v->weight, sizeof r.weight);
	return r;
}

/* Planes of the next volume before its correction, and reduced. */
static void descend(void *arg, size_t slab, size_t worker)
{
	const struct hessian_tv_job *v = arg;
	const size_t n = v->n[0];
	float *step = v->row + worker * n;

	for (size_t k = slab * SLAB; k < (slab + 1) * SLAB && k < v->n[2]; k++) {
		const size_t at = k * v->plane;

		v->moved[k] = 0;
		for (size_t j = 0; j < v->n[1]; j++) {
			struct ct_hessian_descent r = descent(v, (ptrdiff_t)j, (ptrdiff_t)k);

			r.out = v->ahead + at + j * n;
			r.step = v->measure ? step : NULL;
			r.x = v->x + at + j * n;
			CT_SIMD(ct_hessian_row_descend)(&r, n, v->t * v->part);
			if (v->measure)
				v->moved[k] += CT_SIMD(ct_vector_dot)(
					n, &(struct ct_vector){.x = step, .w = step});
		}
		ct_consistency_reduce(v->dc, k, v->ahead + at, worker);
	}
}

/* Correct the next volume; it becomes x, and what it extrapolates to lies ahead. */
static void extrapolate(void *arg, size_t k, size_t worker)
{
	const struct hessian_tv_job *j = arg;
	float *x = j->x + k * j->plane, *next = j->ahead + k * j->plane;

	ct_consistency_expand(j->dc, k, next, next, worker);
	CT_SIMD(ct_hessian_row_ahead)(j->plane, x, next);
}

static int job_alloc(struct hessian_tv_job *j, struct ct_consistency *dc,
	const struct ct_tv_rule *rule, size_t threads, struct ct_err *e)
{
	const double *w = rule->weight;
	const double part[PARTS] = {w[0] * w[0], w[1] * w[1], w[2] * w[2], M_SQRT2 * w[0] * w[1],
		M_SQRT2 * w[0] * w[2], M_SQRT2 * w[1] * w[2]};
	const double norm = ct_tv_norm(w, dc->n); /* of H */
	size_t count;

	j->dc = dc;
	memcpy(j->n, dc->n, sizeof j->n);
	for (int c = 0; c < PARTS; c++)
		j->weight[c] = (float)part[c];
	j->t = (float)(rule->step / norm) / CT_TV_ONE;
	j->s = (float)(1 / (rule->step * norm)) * CT_TV_ONE;
	j->plane = j->n[0] * j->n[1];
	if (ct_size_mul(&count, j->plane, j->n[2], "volume", e) ||
		ct_alloc(&j->ahead, count, sizeof(float), e) ||
		ct_alloc0(&j->zero, j->n[0], sizeof *j->zero, e) ||
		ct_alloc(&j->row, threads * j->n[0], sizeof(float), e) ||
		ct_alloc(&j->moved, j->n[2], sizeof(double), e))
		return -1;
	for (int c = 0; c < PARTS; c++)
		if (ct_alloc0(&j->q[c], count, sizeof *j->q[c], e))
			return -1;
	return 0;
}

static void job_free(struct hessian_tv_job *j)
{
	for (int c = 0; c < PARTS; c++)
		free(j->q[c]);
	free(j->ahead);
	free(j->zero);
	free(j->row);
	free(j->moved);
}

static double iterate(void *job, size_t it, bool measure, struct ct_par *par)
{
	struct hessian_tv_job *j = job;
	double moved;

	j->measure = measure;
	j->part = (float)fmax(exp2(-(double)it / HALVES), LEAST_PART);
	ct_par_for(par, j->n[2], ascend, j);
	ct_par_for(par, (j->n[2] + SLAB - 1) / SLAB, descend, j);
	moved = ct_consistency_correct(j->dc, measure, par);
	ct_par_for(par, j->n[2], extrapolate, j);
	for (size_t k = 0; k < j->n[2]; k++)
		moved += j->moved[k];
	return moved;
}

int ct_tv_hessian(float *x, struct ct_consistency *dc, const struct ct_tv_rule *rule,
	struct ct_tv_report *report, const struct ct_env *env, struct ct_err *e)
{
	struct hessian_tv_job j = {.x = x};
	const struct ct_tv_loop loop = {.what = "second-order variation",
		.known = 1, /* how far the start was from consistency is not */
		.least = HALVES,
		.iterate = iterate,
		.job = &j,
		.voxels = dc->n[0] * dc->n[1] * dc->n[2]};
	int rc = -1;

	*report = (struct ct_tv_report){0};
	if (job_alloc(&j, dc, rule, ct_par_threads(env->par), e))
		goto out;
	memcpy(j.ahead, x, loop.voxels * sizeof *x);
	rc = ct_tv_run(&loop, rule, report, env, e);
out:
	job_free(&j);
	return rc;
}
