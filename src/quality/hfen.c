/* hfen.c: see hfen.h. L * test - L * ref is L * (test - ref).
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "quality/hfen.h"
#include "core/mem.h"
#include "operator/degrade.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The second derivative of the Gaussian; by: its variance, and the sum of its samples. */
static double second(double d, const double *by)
{
	const double r = d * d / by[0];

	return (r - 1) / by[0] * exp(-0.5 * r) / by[1];
}

/* out += the second derivative of x along `axis`, smoothed along the others. */
static int add(float *out, const float *x, const size_t n[3], int axis, struct ct_par *par,
	struct ct_err *e)
{
	const double reach = floor(4 * CT_HFEN_SIGMA + 0.5);
	double by[2] = {CT_HFEN_SIGMA * CT_HFEN_SIGMA, 0};
	struct ct_separable s = {0};
	int rc = -1;

	for (double d = -reach; d <= reach; d++)
		by[1] += exp(-0.5 * (d * d) / by[0]);
	for (int a = 0; a < 3; a++)
		if (a == axis ? ct_taps_filter(&s.t[a], n[a], (size_t)reach, second, by, e)
			      : ct_degrade_taps(
					&s.t[a], n[a], 1, CT_HFEN_SIGMA, CT_DECIMATE_SINC, e))
			goto out;
	if (ct_separable_plan(&s, par, e))
		goto out;
	ct_separable_add(&s, out, x, par);
	rc = 0;
out:
	ct_separable_free(&s);
	return rc;
}

/* The norm of L * x; work is a volume. */
static int norm(double *out, const float *x, const size_t n[3], float *work,
	const struct ct_vol *mask, const struct ct_env *env, struct ct_err *e)
{
	const size_t plane = n[0] * n[1];

	memset(work, 0, plane * n[2] * sizeof *work);
	for (int a = 0; a < 3; a++)
		if (add(work, x, n, a, env->par, e) || ct_check_stop(env, e))
			return -1;
	*out = 0;
	for (size_t k = 0; k < n[2]; k++) {
		double sum = 0;

		for (size_t i = k * plane; i < (k + 1) * plane; i++)
			if (!mask || mask->data[i] != 0)
				sum += (double)work[i] * (double)work[i];
		*out += sum;
	}
	*out = sqrt(*out);
	return 0;
}

int ct_hfen(double *out, const struct ct_vol *ref, const struct ct_vol *test,
	const struct ct_vol *mask, const struct ct_env *env, struct ct_err *e)
{
	const size_t n = ct_vol_count(ref);
	double of_ref, of_error;
	float *work, *error;
	bool flat = true; /* L of a constant is 0 but for what is cut off of L */
	int rc = -1;

	if (ct_alloc(&work, 2 * n, sizeof *work, e))
		return -1;
	error = work + n;
	for (size_t i = 0; i < n; i++) {
		error[i] = test->data[i] - ref->data[i];
		flat = flat && ref->data[i] == ref->data[0];
	}
	if (norm(&of_ref, ref->data, ref->n, work, mask, env, e) == 0 &&
		norm(&of_error, error, ref->n, work, mask, env, e) == 0) {
		*out = of_ref > 0 && !flat ? of_error / of_ref : (double)NAN;
		rc = 0;
	}
	free(work);
	return rc;
}
