/* learn-begin.c: what is known before the first step: mean, components, the linear part. All sums
 * over patches in double, piece by piece in their order. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "restore/learn.h"
#include "solve/jacobi.h"
#include "nn/dnn.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define FLOOR 1e-4     /* of the largest eigenvalue, added to all */
#define RIDGE 1e-3     /* of the mean of the diagonal */
#define SPREAD (-3.0f) /* where the logarithm of a cell's error begins */
enum { PIECE = CT_LEARN_PIECE, GROUP = 8 };

/* Products of the rows of a piece, of n columns: those of x with x and y with weights. */
struct sums {
	struct ct_learn *l;
	size_t first, n;
	float *part; /* [GROUP][n][n] */
	bool solve;  /* features and targets, not patches */
};

/* Rows (feature, 1, target) or (patch, 1), each times the root of its weight or 1. */
static void rows(float *to, const struct ct_learn_side *d, const struct sums *s)
{
	const struct ct_slice_network *r = &s->l->r;
	const size_t m = s->solve ? r->inputs : ct_patch_count(&r->shape);
	const size_t out = s->solve ? r->cell : 0;
	const float *from = s->solve ? d->w.feature : d->w.patch;

	for (size_t i = 0; i < PIECE; i++, to += s->n) {
		const float w = s->solve ? sqrtf(d->weight[i]) : 1;

		for (size_t j = 0; j < m; j++)
			to[j] = w * from[i * m + j];
		to[m] = w;
		for (size_t j = 0; j < out; j++)
			to[m + 1 + j] = w * d->target[i * out + j];
	}
}

static void sum_piece(void *arg, size_t i, size_t worker)
{
	struct sums *s = arg;
	struct ct_learn *l = s->l;
	struct ct_learn_side *d = &l->side[worker];
	const int was = ct_dnn_enter();
	float *work = NULL;
	struct ct_err *e = &l->failed[i];

	if (ct_learn_draw(l, d, l->pairs, l->n, CT_LEARN_BEGIN_STREAM + s->first + i, e) == 0 &&
		ct_alloc(&work, PIECE * s->n, sizeof *work, e) == 0) {
		rows(work, d, s);
		(void)ct_dnn_sgemm(true, false, s->n, s->n, PIECE, 1, work, s->n, work, s->n, 0,
			s->part + i * s->n * s->n, s->n, e);
	}
	free(work);
	ct_dnn_leave(was);
}

/* sum (n,n) over the first CT_LEARN_BEGIN patches. */
static int gram(double *sum, struct ct_learn *l, size_t n, bool solve, struct ct_err *e)
{
	struct sums s = {.l = l, .n = n, .solve = solve};
	int rc = -1;

	if (ct_alloc(&s.part, GROUP * n * n, sizeof *s.part, e))
		return -1;
	memset(sum, 0, n * n * sizeof *sum);
	for (s.first = 0; s.first < CT_LEARN_BEGIN / PIECE; s.first += GROUP) {
		memset(l->failed, 0, GROUP * sizeof *l->failed);
		ct_par_for(l->env.par, GROUP, sum_piece, &s);
		if (ct_err_first(e, GROUP, l->failed, sizeof *l->failed) ||
			ct_check_stop(&l->env, e))
			goto out;
		for (size_t p = 0; p < GROUP; p++)
			for (size_t i = 0; i < n * n; i++)
				sum[i] += (double)s.part[p * n * n + i];
	}
	rc = 0;
out:
	free(s.part);
	return rc;
}

/* a (n,n; lda) <- L with L L^T = a, the part above the diagonal zero. */
static int cholesky(double *a, size_t n, size_t lda, struct ct_err *e)
{
	for (size_t j = 0; j < n; j++) {
		double d = a[j * lda + j] - ct_jacobi_dot(j, a + j * lda, a + j * lda);

		if (!(d > 0))
			return ct_fail(e, CT_ENUMERIC, "the patches do not differ");
		a[j * lda + j] = sqrt(d);
		for (size_t i = j + 1; i < n; i++)
			a[i * lda + j] =
				(a[i * lda + j] - ct_jacobi_dot(j, a + i * lda, a + j * lda)) /
				a[j * lda + j];
		for (size_t i = j + 1; i < n; i++)
			a[j * lda + i] = 0;
	}
	return 0;
}

/* Mean and whitened components, the largest first, of the sums (n+1,n+1) of the patches. */
static int components(struct ct_slice_network *r, double *sum, struct ct_err *e)
{
	const size_t n = ct_patch_count(&r->shape), ld = n + 1;
	const double count = sum[n * ld + n];
	double *c, *u, trace = 0, most = 0;
	int rc = -1;

	if (ct_alloc0(&c, 2 * n * n, sizeof *c, e))
		return -1;
	u = c + n * n;
	for (size_t i = 0; i < n; i++)
		r->mean[i] = (float)(sum[n * ld + i] / count);
	for (size_t i = 0; i < n; i++)
		for (size_t j = 0; j < n; j++)
			c[i * n + j] = sum[i * ld + j] / count -
				       sum[n * ld + i] / count * (sum[n * ld + j] / count);
	for (size_t i = 0; i < n; i++)
		trace += c[i * n + i];
	for (size_t i = 0; i < n; i++) {
		c[i * n + i] +=
			FLOOR * trace; /* positive, but for rounding, until it is factored */
		u[i * n + i] = 1;
	}
	if (cholesky(c, n, n, e) || ct_jacobi(n, n, c, u, e))
		goto out;
	for (size_t i = 0; i < n; i++) {
		sum[i] = ct_jacobi_dot(n, c + i * n, c + i * n) - FLOOR * trace;
		most = fmax(most, sum[i]);
	}
	for (size_t k = 0; k < r->components; k++) {
		size_t best = 0;

		for (size_t i = 1; i < n; i++)
			best = sum[i] > sum[best] ? i : best;
		for (size_t j = 0; j < n; j++)
			r->basis[k * n + j] =
				(float)(u[best * n + j] / sqrt(sum[best] + FLOOR * most));
		sum[best] = -most;
	}
	rc = 0;
out:
	free(c);
	return rc;
}

/* Least squares from the sums (f + 1 + out)^2 of the features, 1 and the targets. */
static int linear(struct ct_slice_network *r, double *sum, struct ct_err *e)
{
	const size_t f = r->inputs, out = r->cell, ld = f + 1 + out;
	double trace = 0;

	for (size_t i = 0; i < f; i++)
		trace += sum[i * ld + i];
	for (size_t i = 0; i < f; i++)
		sum[i * ld + i] += RIDGE * trace / (double)f;
	sum[f * ld + f] *= 1 + 1e-9;
	if (cholesky(sum, f + 1, ld, e))
		return -1;
	for (size_t o = 0; o < out; o++) {
		double *b = sum + (f + 1 + o) * ld; /* row o of the targets' products */

		for (size_t i = 0; i <= f; i++)
			b[i] = (b[i] - ct_jacobi_dot(i, sum + i * ld, b)) / sum[i * ld + i];
		for (size_t i = f + 1; i-- > 0;) {
			for (size_t j = i + 1; j <= f; j++)
				b[i] -= sum[j * ld + i] * b[j];
			b[i] /= sum[i * ld + i];
		}
		for (size_t i = 0; i < f; i++)
			r->all[r->at[CT_PART_LINEAR] + o * f + i] = (float)b[i];
		r->all[r->at[CT_PART_LINEAR_BIAS] + o] = (float)b[f];
	}
	r->all[r->at[CT_PART_LINEAR_BIAS] + out] = SPREAD;
	return 0;
}

/* Hidden layers at random, of the size that keeps the variance; those after the second, and the
 * last one, begin at 0. */
static void hidden(struct ct_learn *l)
{
	struct ct_slice_network *r = &l->r;
	const size_t f = r->inputs, w = r->width;
	float *all = r->all;

	ct_rng_normals(w * f, all + r->at[CT_PART_1], l->rule.seed, 1, 0);
	ct_rng_normals(w * w, all + r->at[CT_PART_2], l->rule.seed, 2, 0);
	for (size_t i = 0; i < w * f; i++)
		all[r->at[CT_PART_1] + i] *= sqrtf(2 / (float)f);
	for (size_t i = 0; i < w * w; i++)
		all[r->at[CT_PART_2] + i] *= sqrtf(2 / (float)w);
}

int ct_learn_begin(struct ct_learn *l, struct ct_err *e)
{
	struct ct_slice_network *r = &l->r;
	const size_t n = ct_patch_count(&r->shape) + 1;
	const size_t m = r->inputs + 1 + r->cell;
	double *sum;
	int rc;

	if (ct_alloc(&sum, n * n > m * m ? n * n : m * m, sizeof *sum, e))
		return -1;
	/* A draw takes the mean off: what a run knew that was stopped before its first step. */
	memset(r->mean, 0, (n - 1) * (1 + r->components) * sizeof *r->mean);
	rc = ct_err_any(gram(sum, l, n, false, e) || components(r, sum, e) ||
			gram(sum, l, m, true, e) || linear(r, sum, e));
	free(sum);
	if (rc)
		return -1;
	hidden(l);
	memcpy(l->trainer.weights, r->all, r->at[CT_PARTS] * sizeof *r->all);
	return 0;
}
