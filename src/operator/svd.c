/* svd.c: see svd.h. All in double; sums in a fixed order. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "operator/svd.h"
#include "core/mem.h"
#include "operator/cosine.h"
#include "solve/jacobi.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A weight of so little of the largest is what rounding left of none. */
#define NOTHING 1e-15

/* v = u A, (m,m) (m,n). */
static void transformed(double *v, const double *u, const struct ct_taps *a)
{
	size_t m = a->n_out, n = a->n_in;

	memset(v, 0, m * n * sizeof *v);
	for (size_t k = 0; k < m; k++)
		for (size_t i = 0; i < m; i++) {
			const double *w = a->w + i * a->taps;
			double *out = v + k * n + a->first[i], f = u[k * m + i];

			for (size_t q = 0; q < a->taps; q++)
				out[q] += f * w[q];
		}
}

/* g from the rows of v, which become unit vectors, or zero. */
static int normalise(struct ct_svd *f, struct ct_err *e)
{
	double most = 0, least = (double)INFINITY;

	for (size_t k = 0; k < f->m; k++) {
		f->g[k] = sqrt(ct_jacobi_dot(f->n, f->v + k * f->n, f->v + k * f->n));
		most = fmax(most, f->g[k]);
	}
	if (!(most > 0) || !isfinite(most))
		return ct_fail(e, CT_EINPUT, "an operator without weights");
	for (size_t k = 0; k < f->m; k++) {
		bool keep = f->g[k] * CT_SVD_LIMIT >= most;

		for (size_t j = 0; j < f->n; j++)
			f->v[k * f->n + j] *= keep ? 1 / f->g[k] : 0;
		f->g[k] = keep ? f->g[k] : 0;
		f->lost += !keep;
		least = keep ? fmin(least, f->g[k]) : least;
	}
	f->condition = most / least;
	return 0;
}

static int room(struct ct_svd *f, size_t m, size_t n, struct ct_err *e)
{
	size_t uu, vv;

	*f = (struct ct_svd){.m = m, .n = n};
	if (ct_size_mul(&uu, m, m, "operator", e) || ct_size_mul(&vv, m, n, "operator", e) ||
		ct_alloc(&f->u, uu + vv + m, sizeof *f->u, e))
		return -1;
	f->v = f->u + uu;
	f->g = f->v + vv;
	return 0;
}

int ct_svd_cosines(struct ct_svd *f, size_t m, size_t n, double sigma, struct ct_err *e)
{
	const size_t reach = (size_t)floor(4.0 * sigma + 0.5);

	if (room(f, m, n, e))
		return -1;
	ct_cosine_rows(f->u, m, m);
	ct_cosine_rows(f->v, m, n);
	for (size_t k = 0; k < m; k++) {
		double sum = 1.0, mass = 1.0;

		for (size_t d = 1; d <= reach; d++) {
			const double x = (double)d / sigma, w = 2.0 * exp(-0.5 * x * x);

			sum += w * cos(M_PI * (double)(k * d % (2 * n)) / (double)n);
			mass += w;
		}
		f->g[k] = sum / mass;
		if (f->g[k] * CT_SVD_LIMIT < 1.0)
			f->g[k] = 0.0;
	}
	return 0;
}

int ct_svd_alloc(struct ct_svd *f, const struct ct_taps *a, struct ct_err *e)
{
	size_t m = a->n_out, n = a->n_in;

	if (m > n)
		return ct_fail(e, CT_EINPUT, "an operator from %zu to %zu samples", n, m);
	if (room(f, m, n, e))
		return -1;
	if (!ct_taps_is_identity(a))
		ct_cosine_rows(f->u, m, m);
	else
		for (size_t i = 0; i < m * m; i++)
			f->u[i] = i / m == i % m;
	transformed(f->v, f->u, a);
	if (ct_jacobi(f->m, f->n, f->v, f->u, e) || normalise(f, e)) {
		ct_svd_free(f);
		return -1;
	}
	return 0;
}

void ct_svd_free(struct ct_svd *f)
{
	free(f->u);
	*f = (struct ct_svd){0};
}

/* A full table without what is nothing. */
static int trim(struct ct_taps *t, struct ct_err *e)
{
	struct ct_taps turned = {0}, narrow = {0};
	double most = 0;
	int rc;

	for (size_t i = 0; i < t->n_out * t->taps; i++)
		most = fmax(most, fabs(t->w[i]));
	for (size_t i = 0; i < t->n_out * t->taps; i++)
		if (!(fabs(t->w[i]) > NOTHING * most))
			t->w[i] = 0;
	rc = ct_err_any(ct_taps_transpose(&turned, t, e) || ct_taps_transpose(&narrow, &turned, e));
	ct_taps_free(&turned);
	ct_taps_free(t);
	*t = narrow;
	return rc;
}

int ct_svd_pinv(struct ct_taps *t, const struct ct_svd *f, struct ct_err *e)
{
	if (ct_taps_alloc(t, f->m, f->n, f->m, e))
		return -1;
	for (size_t k = 0; k < f->m; k++) {
		if (f->g[k] == 0.0)
			continue;
		for (size_t j = 0; j < f->n; j++) {
			double w = f->v[k * f->n + j] / f->g[k], *row = t->w + j * f->m;

			for (size_t i = 0; i < f->m; i++)
				row[i] += w * f->u[k * f->m + i];
		}
	}
	return trim(t, e);
}
