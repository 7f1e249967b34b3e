/* hessian-tv.c: see hessian-tv.h. Two passes over rows an iteration: the dual ascends along H of
 * the extrapolated volume, then the volume descends along its adjoint. */
#include "config.h"
#pragma GCC optimize("O3", "no-trapping-math") /* else square roots stay scalar */
#include "core/mem.h"
#include "resolution/hessian-tv.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__)
#define CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define CLONES
#endif

enum { II, JJ, KK, IJ, IK, JK, PARTS, MEASURE = 5 };

struct job {
	float *x, *ahead; /* the volume; extrapolated, and then the next one */
	float *q[PARTS];  /* the dual */
	float *zero;      /* a row of zeros with one before and one after */
	float *scratch;   /* of each worker: rows, and that of dc */
	double *sums;     /* of each plane: variation, and squared movement */
	struct ct_dc *dc;
	size_t n[3], plane, share;
	float weight[PARTS], s, t;
};

static size_t clamp(ptrdiff_t i, size_t n)
{
	return i < 0 ? 0 : (size_t)i >= n ? n - 1 : (size_t)i;
}

/* Rows of the volume about (j,k): [1][1] is it, [0] and [2] its neighbours, itself at a border, so
 * that differences of what is outside vanish; `inner` tells which components exist. */
struct around {
	const float *x[3][3]; /* [k][j] */
	bool inner[3];        /* JJ, KK interior; JK not at the last row or plane */
	bool last_j, last_k;
};

static void look_around(struct around *a, const struct job *v, const float *x, size_t j, size_t k)
{
	for (int dk = -1; dk <= 1; dk++)
		for (int dj = -1; dj <= 1; dj++)
			a->x[dk + 1][dj + 1] = x + clamp((ptrdiff_t)k + dk, v->n[2]) * v->plane +
					       clamp((ptrdiff_t)j + dj, v->n[1]) * v->n[0];
	a->last_j = j + 1 == v->n[1];
	a->last_k = k + 1 == v->n[2];
	a->inner[0] = j > 0 && !a->last_j;
	a->inner[1] = k > 0 && !a->last_k;
	a->inner[2] = !a->last_j && !a->last_k;
}

/* h[PARTS] <- H x along a row. */
CLONES static void hessian_row(
	float *const h[PARTS], const struct around *a, size_t n, const float weight[PARTS])
{
	const float *x = a->x[1][1], *j0 = a->x[1][0], *j1 = a->x[1][2];
	const float *k0 = a->x[0][1], *k1 = a->x[2][1], *jk = a->x[2][2];
	float *ii = h[II], *jj = h[JJ], *kk = h[KK], *ij = h[IJ], *ik = h[IK], *hjk = h[JK];
	float wii = weight[II], wjj = a->inner[0] ? weight[JJ] : 0.0f;
	float wkk = a->inner[1] ? weight[KK] : 0.0f, wjk = a->inner[2] ? weight[JK] : 0.0f;
	float wij = weight[IJ], wik = weight[IK];

	ii[0] = ii[n - 1] = 0;
#pragma GCC ivdep
	for (size_t i = 1; i + 1 < n; i++)
		ii[i] = wii * (x[i - 1] + x[i + 1] - 2.0f * x[i]);
#pragma GCC ivdep
	for (size_t i = 0; i < n; i++) {
		jj[i] = wjj * (j0[i] + j1[i] - 2.0f * x[i]);
		kk[i] = wkk * (k0[i] + k1[i] - 2.0f * x[i]);
		hjk[i] = wjk * (jk[i] - j1[i] - k1[i] + x[i]);
	}
	ij[n - 1] = ik[n - 1] = 0;
#pragma GCC ivdep
	for (size_t i = 0; i + 1 < n; i++) {
		ij[i] = wij * ((j1[i + 1] - j1[i]) - (x[i + 1] - x[i]));
		ik[i] = wik * ((k1[i + 1] - k1[i]) - (x[i + 1] - x[i]));
	}
}

/* q <- project onto |q|_F <= 1 of q + s h; norm <- |h|^2, work: a row. */
CLONES static void ascend_row(
	float *const q[PARTS], float *const h[PARTS], float *norm, float *work, size_t n, float s)
{
	memset(norm, 0, n * sizeof *norm);
	memset(work, 0, n * sizeof *work);
	for (int c = 0; c < PARTS; c++) {
		float *p = q[c], *g = h[c];

#pragma GCC ivdep
		for (size_t i = 0; i < n; i++) {
			norm[i] += g[i] * g[i];
			p[i] += s * g[i];
			work[i] += p[i] * p[i];
		}
	}
#pragma GCC ivdep
	for (size_t i = 0; i < n; i++)
		work[i] = work[i] > 1.0f ? work[i] : 1.0f;
#pragma GCC ivdep
	for (size_t i = 0; i < n; i++)
		work[i] = 1.0f / sqrtf(work[i]);
	for (int c = 0; c < PARTS; c++) {
		float *p = q[c];

#pragma GCC ivdep
		for (size_t i = 0; i < n; i++)
			p[i] *= work[i];
	}
}

static void ascend(void *arg, size_t k, size_t worker)
{
	const struct job *j = arg;
	size_t n = j->n[0];
	float *rows = j->scratch + worker * j->share + ct_dc_scratch(j->dc);
	float *h[PARTS], *norm = rows + PARTS * n, *work = norm + n;
	double sum = 0;

	for (int c = 0; c < PARTS; c++)
		h[c] = rows + (size_t)c * n;
	for (size_t y = 0; y < j->n[1]; y++) {
		size_t at = k * j->plane + y * n;
		float *q[PARTS];
		struct around a;

		for (int c = 0; c < PARTS; c++)
			q[c] = j->q[c] + at;
		look_around(&a, j, j->ahead, y, k);
		hessian_row(h, &a, n, j->weight);
		ascend_row(q, h, norm, work, n, j->s);
		for (size_t i = 0; i < n; i++)
			sum += sqrt((double)norm[i]);
	}
	j->sums[2 * k] = sum;
}

/* out = x - t H^T q along a row; q[c][k][j]: rows of component c below, before, here, after. Cross
 * components are zero at the last voxel, second ones at both ends, of their axes. */
struct duals {
	const float *ii, *jj[3], *kk[3], *ij[2], *ik[2], *jk[4];
};

CLONES static void descend_row(float *out, const float *x, const struct duals *d, size_t n,
	const float weight[PARTS], float t)
{
	const float *ii = d->ii, *j0 = d->jj[0], *j1 = d->jj[1], *j2 = d->jj[2];
	const float *k0 = d->kk[0], *k1 = d->kk[1], *k2 = d->kk[2];
	const float *ij0 = d->ij[0], *ij1 = d->ij[1], *ik0 = d->ik[0], *ik1 = d->ik[1];
	const float *jk = d->jk[0], *jkj = d->jk[1], *jkk = d->jk[2], *jkb = d->jk[3];
	float wii = weight[II], wjj = weight[JJ], wkk = weight[KK];
	float wij = weight[IJ], wik = weight[IK], wjk = weight[JK];

#pragma GCC ivdep
	for (size_t i = 0; i < n; i++) {
		float g = wjj * (j0[i] + j2[i] - 2.0f * j1[i]) +
			  wkk * (k0[i] + k2[i] - 2.0f * k1[i]) +
			  wjk * ((jkb[i] - jkj[i]) - (jkk[i] - jk[i]));

		g += wij * (ij1[i] - ij0[i]) + wik * (ik1[i] - ik0[i]) - 2.0f * wii * ii[i];
		out[i] = x[i] - t * g;
	}
#pragma GCC ivdep
	for (size_t i = 1; i < n; i++)
		out[i] -= t * (wii * ii[i - 1] + wij * (ij0[i - 1] - ij1[i - 1]) +
				      wik * (ik0[i - 1] - ik1[i - 1]));
#pragma GCC ivdep
	for (size_t i = 0; i + 1 < n; i++)
		out[i] -= t * wii * ii[i + 1];
}

/* Row (j,k) of component c, zeros outside. */
static const float *dual_row(const struct job *v, int c, ptrdiff_t j, ptrdiff_t k)
{
	if (j < 0 || k < 0 || (size_t)j >= v->n[1] || (size_t)k >= v->n[2])
		return v->zero;
	return v->q[c] + (size_t)k * v->plane + (size_t)j * v->n[0];
}

/* Plane k of the next volume before its correction, and reduced. */
static void descend(void *arg, size_t plane, size_t worker)
{
	const struct job *v = arg;
	ptrdiff_t k = (ptrdiff_t)plane;
	size_t at = plane * v->plane;
	double moved = 0;

	for (ptrdiff_t j = 0; j < (ptrdiff_t)v->n[1]; j++) {
		size_t row = at + (size_t)j * v->n[0];
		struct duals d = {dual_row(v, II, j, k),
			{dual_row(v, JJ, j - 1, k), dual_row(v, JJ, j, k),
				dual_row(v, JJ, j + 1, k)},
			{dual_row(v, KK, j, k - 1), dual_row(v, KK, j, k),
				dual_row(v, KK, j, k + 1)},
			{dual_row(v, IJ, j - 1, k), dual_row(v, IJ, j, k)},
			{dual_row(v, IK, j, k - 1), dual_row(v, IK, j, k)},
			{dual_row(v, JK, j, k), dual_row(v, JK, j - 1, k),
				dual_row(v, JK, j, k - 1), dual_row(v, JK, j - 1, k - 1)}};

		descend_row(v->ahead + row, v->x + row, &d, v->n[0], v->weight, v->t);
		for (size_t i = 0; i < v->n[0]; i++) {
			double step = (double)v->ahead[row + i] - (double)v->x[row + i];

			moved += step * step;
		}
	}
	v->sums[2 * plane + 1] = moved;
	ct_dc_reduce(v->dc, plane, v->ahead + at, v->scratch + worker * v->share);
}

/* Correct the next volume; it becomes x, and what it extrapolates to lies ahead. */
static void extrapolate(void *arg, size_t k, size_t worker)
{
	const struct job *j = arg;
	float *x = j->x + k * j->plane, *next = j->ahead + k * j->plane;

	ct_dc_expand(j->dc, k, next, next, j->scratch + worker * j->share);
	for (size_t i = 0; i < j->plane; i++) {
		float now = next[i];

		next[i] = 2.0f * now - x[i];
		x[i] = now;
	}
}

static int job_alloc(struct job *j, struct ct_dc *dc, const struct ct_tv_rule *rule, size_t threads,
	struct ct_err *e)
{
	const double *w = rule->weight;
	const double part[PARTS] = {w[0] * w[0], w[1] * w[1], w[2] * w[2], M_SQRT2 * w[0] * w[1],
		M_SQRT2 * w[0] * w[2], M_SQRT2 * w[1] * w[2]};
	double norm = 0; /* of H */
	size_t count;

	j->dc = dc;
	for (int a = 0; a < 3; a++) {
		j->n[a] = dc->n[a];
		norm += dc->n[a] > 1 ? 4 * w[a] * w[a] : 0;
	}
	norm = norm > 0 ? norm : 1;
	for (int c = 0; c < PARTS; c++)
		j->weight[c] = (float)part[c];
	j->t = (float)(rule->step / norm);
	j->s = (float)(1 / (rule->step * norm));
	j->plane = j->n[0] * j->n[1];
	j->share = ct_dc_scratch(dc) + (PARTS + 2) * j->n[0];
	if (ct_size_mul(&count, j->plane, j->n[2], "volume", e) ||
		ct_alloc(&j->ahead, count, sizeof(float), e) ||
		ct_alloc0(&j->zero, j->n[0], sizeof(float), e) ||
		ct_alloc(&j->scratch, threads * j->share, sizeof(float), e) ||
		ct_alloc(&j->sums, 2 * j->n[2], sizeof(double), e))
		return -1;
	for (int c = 0; c < PARTS; c++)
		if (ct_alloc0(&j->q[c], count, sizeof(float), e))
			return -1;
	memcpy(j->ahead, j->x, count * sizeof *j->x);
	return 0;
}

static void job_free(struct job *j)
{
	for (int c = 0; c < PARTS; c++)
		free(j->q[c]);
	free(j->ahead);
	free(j->zero);
	free(j->scratch);
	free(j->sums);
}

static void iterate(struct job *j, struct ct_tv_report *report, struct ct_par *par)
{
	double count = (double)j->plane * (double)j->n[2], variation = 0, moved;

	ct_par_for(par, j->n[2], ascend, j);
	ct_par_for(par, j->n[2], descend, j);
	moved = ct_dc_correct(j->dc, par);
	ct_par_for(par, j->n[2], extrapolate, j);
	for (size_t k = 0; k < j->n[2]; k++) {
		variation += j->sums[2 * k];
		moved += j->sums[2 * k + 1];
	}
	report->objective = variation / count;
	report->change = isfinite(moved) ? sqrt(fmax(moved, 0) / count) : (double)NAN;
}

int ct_htv(float *x, struct ct_dc *dc, const struct ct_tv_rule *rule, struct ct_tv_report *report,
	const struct ct_env *env, struct ct_err *e)
{
	struct job j = {.x = x};
	int rc = -1;

	*report = (struct ct_tv_report){0};
	if (job_alloc(&j, dc, rule, ct_par_threads(env->par), e))
		goto out;
	rc = 0;
	for (size_t it = 0; it < rule->iterations && rc == 0; it++) {
		bool first = it == 0; /* how far the start was from consistency is not known */

		ct_progress(env, "iterations", it, rule->iterations);
		iterate(&j, report, env->par);
		report->iterations = it + 1;
		if (!first && !isfinite(report->change))
			rc = ct_fail(e, CT_ENUMERIC,
				"second-order variation: no finite step in iteration %zu", it + 1);
		else if (it % MEASURE == MEASURE - 1 && report->change < rule->tolerance)
			break;
		else
			rc = ct_check_stop(env, e);
	}
	ct_progress(env, "iterations", rule->iterations, rule->iterations);
out:
	job_free(&j);
	return rc;
}
