/* consistency-exact.c: data consistency in double (consistency.h). */
#include "config.h"
#include "core/mem.h"
#include "resolution/consistency.h"
#include "resolution/svd.h"

#include <math.h>
#include <stdlib.h>

int ct_consistency_pinv_plan(struct ct_separable *s, const struct ct_degrade *d,
	const size_t n[static 3], const struct ct_par *par, struct ct_err *e)
{
	int rc = 0;

	*s = (struct ct_separable){0};
	for (int a = 0; a < 3 && rc == 0; a++) {
		struct ct_taps down = {0};
		struct ct_svd f = {0};

		rc = ct_degrade_axis_taps(&down, d, a, n[a], e) || ct_svd_alloc(&f, &down, e) ||
		     ct_svd_pinv(&s->t[a], &f, e);
		ct_svd_free(&f);
		ct_taps_free(&down);
	}
	if (rc == 0)
		return ct_separable_plan(s, par, e);
	ct_separable_free(s);
	return -1;
}

/* Root of the mean square of a - b. */
static double rms(const float *a, const float *b, size_t n)
{
	double sum = 0;

	for (size_t i = 0; i < n; i++)
		sum += ((double)a[i] - (double)b[i]) * ((double)a[i] - (double)b[i]);
	return sqrt(sum / (double)n);
}

int ct_consistency_settle(float *x, const float *y, const struct ct_degrade *d,
	const size_t n[static 3], double most, double *residual, struct ct_par *par,
	struct ct_err *e)
{
	struct ct_separable down = {0}, up = {0};
	float *lo = NULL;
	size_t m = 1;
	int rc = -1;

	if (ct_degrade_plan(&down, d, n, par, e))
		return -1;
	for (int a = 0; a < 3; a++)
		m *= down.t[a].n_out;
	if (ct_alloc(&lo, m, sizeof *lo, e))
		goto out;
	if (isfinite(most)) {
		if (ct_consistency_pinv_plan(&up, d, n, par, e))
			goto out;
		ct_separable_apply(&down, lo, x, par);
		for (size_t i = 0; i < m; i++) {
			const double r = (double)y[i] - (double)lo[i];

			lo[i] = (float)(r - fmin(fmax(r, -most), most));
		}
		ct_separable_add(&up, x, lo, par);
	}
	if (residual) {
		ct_separable_apply(&down, lo, x, par);
		*residual = rms(lo, y, m);
	}
	rc = 0;
out:
	ct_separable_free(&down);
	ct_separable_free(&up);
	free(lo);
	return rc;
}
