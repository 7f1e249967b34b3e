/* resample.c: see resample.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "operator/resample.h"
#include "operator/degrade.h"
#include "core/vol.h"

#include <math.h>

/* |z|^REACH < 2^-53, z = sqrt(3) - 2 the pole of the spline's inverse filter */
enum { REACH = 28 };

static double support(enum ct_interp interp)
{
	return interp == CT_LINEAR ? 1 : interp == CT_LANCZOS ? 3 : 2;
}

static double kernel(enum ct_interp interp, double x)
{
	double a = fabs(x), b = 2 - a;

	if (a >= support(interp))
		return 0;
	switch (interp) {
	case CT_LINEAR: return 1 - a;
	case CT_CUBIC:
		return a < 1 ? (1.5 * a - 2.5) * a * a + 1 : ((-0.5 * a + 2.5) * a - 4) * a + 2;
	case CT_BSPLINE: return a < 1 ? 2.0 / 3 - 0.5 * a * a * b : b * b * b / 6;
	case CT_LANCZOS: break;
	}
	return a > 0 ? 3 * sin(M_PI * a) * sin(M_PI * a / 3) / (M_PI * M_PI * a * a) : 1;
}

/* Weights of row m about input index c: normalised, since a widened kernel sums to one only
 * nearly. */
static void fill_row(struct ct_taps *t, size_t m, double c, double widen, enum ct_interp interp)
{
	double reach = widen * support(interp), sum = 0, last = (double)t->n_in - 1, lo, hi;

	if (interp == CT_BSPLINE) /* one reflection is enough */
		c = fmin(fmax(c, -0.5), last + 0.5);
	lo = floor(c - reach) + 1;
	hi = ceil(c + reach) - 1;
	for (double k = lo; k <= hi; k++)
		sum += kernel(interp, (k - c) / widen);
	ct_taps_place(t, m, (ptrdiff_t)fmin(fmax(lo, 0), last));
	for (double k = lo; k <= hi; k++)
		ct_taps_add(t, m,
			interp == CT_BSPLINE ? ct_taps_reflect((ptrdiff_t)k, t->n_in)
					     : (size_t)fmin(fmax(k, 0), last),
			kernel(interp, (k - c) / widen) / sum);
}

/* Samples to spline coefficients: the inverse of the filter (1 4 1)/6. */
static double inverse_spline(double d, const double *by)
{
	(void)by;
	return sqrt(3) * pow(sqrt(3) - 2, fabs(d));
}

int ct_resample_taps(struct ct_taps *t, size_t n_in, size_t n_out, double start, double step,
	enum ct_interp interp, bool antialias, struct ct_err *e)
{
	double widen = antialias && step > 1 ? step : 1;
	struct ct_taps basis = {0}, spline = {0};
	int rc = -1;

	if (!(step > 0 && step <= 1e6) || !(fabs(start) <= 1e9))
		return ct_fail(e, CT_EINPUT, "resampling from %g in steps of %g", start, step);
	if (n_in == n_out && start == 0.0 && step == 1.0)
		return ct_taps_identity(t, n_in, e);
	if (ct_taps_alloc(&basis, n_in, n_out, 2 * (size_t)ceil(widen * support(interp)), e))
		return -1;
	for (size_t m = 0; m < n_out; m++) /* a grid centre off by rounding is a centre */
		fill_row(&basis, m, nearbyint((start + (double)m * step) * 0x1p30) * 0x1p-30, widen,
			interp);
	if (interp != CT_BSPLINE) {
		*t = basis;
		return 0;
	}
	if (ct_taps_filter(&spline, n_in, REACH, inverse_spline, NULL, e) == 0)
		rc = ct_taps_product(t, &basis, &spline, e);
	ct_taps_free(&spline);
	ct_taps_free(&basis);
	return rc;
}

int ct_resample_up_taps(
	struct ct_taps *t, size_t n_in, double factor, enum ct_interp interp, struct ct_err *e)
{
	const size_t n_out = ct_degrade_cover(n_in, factor);
	const double over = (double)n_out - (double)n_in * factor;

	return ct_resample_taps(t, n_in, n_out,
		ct_cell_index((ct_cell_centre(0) - 0.5 * over) * (1.0 / factor)), 1.0 / factor,
		interp, false, e);
}

int ct_resample_plan(struct ct_separable *s, const size_t n_in[static 3],
	const size_t n_out[static 3], const double start[static 3], const double step[static 3],
	enum ct_interp interp, bool antialias, const struct ct_par *par, struct ct_err *e)
{
	*s = (struct ct_separable){0};
	for (int a = 0; a < 3; a++)
		if (ct_resample_taps(
			    &s->t[a], n_in[a], n_out[a], start[a], step[a], interp, antialias, e)) {
			ct_separable_free(s);
			return -1;
		}
	return ct_separable_plan(s, par, e);
}

int ct_resample_up_plan(struct ct_separable *s, const size_t n_in[static 3],
	const double factor[static 3], enum ct_interp interp, const struct ct_par *par,
	struct ct_err *e)
{
	*s = (struct ct_separable){0};
	for (int a = 0; a < 3; a++)
		if (ct_resample_up_taps(&s->t[a], n_in[a], factor[a], interp, e)) {
			ct_separable_free(s);
			return -1;
		}
	return ct_separable_plan(s, par, e);
}
