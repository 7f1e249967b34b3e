/* tv.c: see tv.h.
 *
 * A slab task sweeps its planes upwards. In place, it may neither read the first plane of the slab
 * above, which its neighbour is changing, nor know the dual of the last plane below. So before the
 * sweep the first plane of every slab is set aside, corrected (`first`), and after it every slab
 * leaves the k-component of the dual of its last plane (`last`), which is then taken off the first
 * plane above before that is reduced.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "inverse/tv.h"
#include "core/mem.h"
#include "inverse/tv-row.h"
#include "solve/vector.h"
#include "solve/trend.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SLAB = CT_CONSISTENCY_SLAB, MEASURE = 5 };

struct tv_job {
	float *x;            /* the volume before its correction */
	int16_t *p[3];       /* the dual */
	float *first, *last; /* a plane of each slab */
	float *scratch;      /* of each worker: three planes, three rows */
	double *moved;       /* of each slab: |x' - x|^2 */
	struct ct_consistency *dc;
	size_t n[3], plane, slabs, share; /* share: floats of scratch a worker */
	float s[3], t[3];                 /* steps of the row */
	const float *to; /* drawn towards this, a part `pull` of the way an iteration; else x */
	float pull;
	bool measure, lent; /* lent: the dual is the caller's */
};

static void set_aside(void *arg, size_t slab, size_t worker)
{
	const struct tv_job *j = arg;

	ct_consistency_expand(j->dc, slab * SLAB, j->first + slab * j->plane,
		j->x + slab * SLAB * j->plane, worker);
}

/* Corrected planes: of k, and of k + 1, which is ahead + by plus, and made so, unless there is no
 * `ahead`. */
struct planes {
	float *x, *xk, by;
	const float *ahead, *plus;
};

/* Dual and out of plane k. `below` is the plane of k-components of 2 p' - p below it, and then its
 * own. */
static void sweep_plane(const struct tv_job *j, size_t k, const struct planes *v, float *below,
	float *rows, double *moved)
{
	size_t n = j->n[0];
	float *turn[2] = {rows, rows + n};

	memset(turn[1], 0, n * sizeof *rows);
	for (size_t y = 0; y < j->n[1]; y++) {
		size_t at = k * j->plane + y * n, up = y + 1 < j->n[1] ? n : 0;
		struct ct_tv_row r = {.out = j->x + at,
			.p = {j->p[0] + at, j->p[1] + at, j->p[2] + at},
			.below = below + y * n,
			.before = turn[(y + 1) % 2],
			.after = turn[y % 2],
			.step = j->measure ? rows + 2 * n : NULL,
			.x = v->x + y * n,
			.xj = v->x + y * n + up,
			.xk = v->xk + y * n,
			.ahead = v->ahead ? v->ahead + y * n : NULL,
			.plus = v->ahead ? v->plus + y * n : NULL,
			.by = v->by,
			.to = j->to ? j->to + at : NULL,
			.pull = j->pull,
			.s = {j->s[0], j->s[1], j->s[2]},
			.t = {j->t[0], j->t[1], j->t[2]}};

		CT_SIMD(ct_tv_row_sweep)(&r, n);
		if (j->measure)
			*moved += CT_SIMD(ct_vector_dot)(
				n, &(struct ct_vector){.x = r.step, .w = r.step});
	}
}

static void sweep_slab(void *arg, size_t slab, size_t worker)
{
	const struct tv_job *j = arg;
	size_t from = slab * SLAB, to = from + SLAB < j->n[2] ? from + SLAB : j->n[2];
	float *below = j->scratch + worker * j->share;
	float *plane[2] = {below + j->plane, below + 2 * j->plane}, *rows = below + 3 * j->plane;
	struct planes v = {.x = j->first + slab * j->plane};
	double moved = 0, skip = 0;

	memset(below, 0, j->plane * sizeof *below);
	for (size_t k = from; k < to; k++) {
		bool whole = k > from || from == 0;

		v.ahead = NULL;
		v.xk = k + 1 < j->n[2] ? j->first + (slab + 1) * j->plane : v.x;
		if (k + 1 < to) {
			v.xk = plane[k % 2];
			v.ahead = j->x + (k + 1) * j->plane;
			v.plus = ct_consistency_multiple(j->dc, k + 1, &v.by);
			if (!v.plus) {
				ct_consistency_expand(j->dc, k + 1, v.xk, NULL, worker);
				v.plus = v.xk;
				v.by = 1;
			}
		}
		sweep_plane(j, k, &v, below, rows, whole ? &moved : &skip);
		if (whole)
			ct_consistency_reduce(j->dc, k, j->x + k * j->plane, worker);
		v.x = v.xk;
	}
	memcpy(j->last + slab * j->plane, below, j->plane * sizeof *below);
	j->moved[slab] = moved;
}

/* The first plane of every slab but the lowest, when the dual below it is known. */
static void mend(void *arg, size_t index, size_t worker)
{
	const struct tv_job *j = arg;
	size_t slab = index + 1, k = slab * SLAB;
	const float *before = j->first + slab * j->plane, *below = j->last + index * j->plane;
	float *x = j->x + k * j->plane;

	j->moved[slab] +=
		CT_SIMD(ct_tv_row_mend)(x, j->measure ? before : NULL, below, j->t[2], j->plane);
	ct_consistency_reduce(j->dc, k, x, worker);
}

/* One iteration; leaves x before its correction, and the correction in dc. */
static double iterate(void *job, size_t it, bool measure, struct ct_par *par)
{
	struct tv_job *j = job;
	double moved;

	(void)it;
	j->measure = measure;
	ct_par_for(par, j->slabs, set_aside, j);
	ct_par_for(par, j->slabs, sweep_slab, j);
	ct_par_for(par, j->slabs - 1, mend, j);
	moved = ct_consistency_correct(j->dc, measure, par);
	for (size_t s = 0; s < j->slabs; s++)
		moved += j->moved[s];
	return moved;
}

static int job_alloc(struct tv_job *j, struct ct_consistency *dc, const struct ct_tv_rule *rule,
	size_t threads, struct ct_err *e)
{
	const double norm = sqrt(ct_tv_norm(rule->weight, dc->n));
	const float s = (float)(1 / (rule->step * norm));
	float t = (float)(rule->step / norm);
	size_t count;

	j->dc = dc;
	memcpy(j->n, dc->n, sizeof j->n);
	j->plane = j->n[0] * j->n[1];
	j->slabs = (j->n[2] + SLAB - 1) / SLAB;
	j->share = 3 * j->plane + 3 * j->n[0];
	if (rule->near.to) {
		/* The proximal step of |x - to|^2 / (2 mu) goes from x to (x + b to) / (1 + b). */
		const float b = (float)((double)t / rule->near.mu);

		j->to = rule->near.to;
		j->pull = b / (1 + b);
		t /= 1 + b;
	}
	for (int a = 0; a < 3; a++) {
		j->s[a] = s * CT_TV_ONE * (float)rule->weight[a];
		j->t[a] = t / CT_TV_ONE * (float)rule->weight[a];
	}
	if (ct_size_mul(&count, j->plane, j->n[2], "volume", e))
		return -1;
	j->lent = rule->near.dual;
	for (size_t a = 0; a < CT_TV_DUAL; a++)
		if (j->lent)
			j->p[a] = rule->near.dual + a * count;
		else if (ct_alloc0(&j->p[a], count, sizeof *j->p[a], e))
			return -1;
	if (ct_alloc(&j->first, j->slabs * j->plane, sizeof(float), e) ||
		ct_alloc(&j->last, j->slabs * j->plane, sizeof(float), e) ||
		ct_alloc(&j->scratch, threads * j->share, sizeof(float), e) ||
		ct_alloc(&j->moved, j->slabs, sizeof(double), e))
		return -1;
	return 0;
}

static void job_free(struct tv_job *j)
{
	for (int a = 0; a < CT_TV_DUAL && !j->lent; a++)
		free(j->p[a]);
	free(j->first);
	free(j->last);
	free(j->scratch);
	free(j->moved);
}

double ct_tv_norm(const double weight[static 3], const size_t n[static 3])
{
	double norm = 0;

	for (int a = 0; a < 3; a++)
		norm += n[a] > 1 ? 4 * weight[a] * weight[a] : 0;
	return norm > 0 ? norm : 1;
}

int ct_tv_run(const struct ct_tv_loop *loop, const struct ct_tv_rule *rule,
	struct ct_tv_report *report, const struct ct_env *env, struct ct_err *e)
{
	struct ct_trend trend = ct_trend_begin(rule->tolerance, rule->iterations);
	const double count = (double)loop->voxels;
	double moved;
	int rc = 0;

	for (size_t it = 0; it < rule->iterations && rc == 0; it++) {
		const bool measure = it % MEASURE == MEASURE - 1 || it + 1 == rule->iterations;

		ct_progress_until(env, "iterations", it, rule->iterations, ct_trend_likely(&trend));
		moved = loop->iterate(loop->job, it, measure, env->par);
		report->iterations = it + 1;
		if (measure) {
			report->change =
				isfinite(moved) ? sqrt(fmax(moved, 0) / count) : (double)NAN;
			ct_trend_see(&trend, it + 1, report->change);
		}
		if (measure && it >= loop->known && !isfinite(report->change))
			rc = ct_fail(e, CT_ENUMERIC, "%s: no finite step in iteration %zu",
				loop->what, it + 1);
		else if (measure && it >= loop->least && report->change < rule->tolerance)
			break;
		else
			rc = ct_check_stop(env, e);
	}
	ct_progress(env, "iterations", rule->iterations, rule->iterations);
	return rc;
}

int ct_tv(float *x, struct ct_consistency *dc, const struct ct_tv_rule *rule,
	struct ct_tv_report *report, const struct ct_env *env, struct ct_err *e)
{
	struct tv_job j = {.x = x};
	const struct ct_tv_loop loop = {.what = "total variation",
		.iterate = iterate,
		.job = &j,
		.voxels = dc->n[0] * dc->n[1] * dc->n[2]};
	int rc = -1;

	*report = (struct ct_tv_report){0};
	if (job_alloc(&j, dc, rule, ct_par_threads(env->par), e))
		goto out;
	ct_consistency_take(dc, x, env->par);
	ct_consistency_correct(dc, false, env->par);
	rc = ct_tv_run(&loop, rule, report, env, e);
	if (rc == 0 || !rule->near.to)
		ct_consistency_add(dc, x, env->par);
out:
	job_free(&j);
	return rc;
}
