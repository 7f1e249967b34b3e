/* resample.c: see resample.h. */
#include "config.h"
#include "kern/resample.h"
#include "core/mem.h"

#include <math.h>

static double kernel(enum ct_interp interp, double x)
{
	double a = fabs(x);

	if (interp == CT_LINEAR)
		return a < 1 ? 1 - a : 0;
	if (a < 1)
		return (1.5 * a - 2.5) * a * a + 1;
	return a < 2 ? ((-0.5 * a + 2.5) * a - 4) * a + 2 : 0;
}

/* Weights of row m about input index c: normalised, since a widened kernel sums to one only
 * nearly; what falls outside goes to the border sample. */
static void fill_row(struct ct_taps *t, size_t m, double c, double widen, enum ct_interp interp)
{
	double support = widen * (interp == CT_LINEAR ? 1 : 2), sum = 0;
	double lo = floor(c - support) + 1, hi = ceil(c + support) - 1, last = (double)t->n_in - 1;

	for (double k = lo; k <= hi; k++)
		sum += kernel(interp, (k - c) / widen);
	ct_taps_place(t, m, (ptrdiff_t)fmin(fmax(lo, 0), last));
	for (double k = lo; k <= hi; k++)
		ct_taps_add(t, m, (size_t)fmin(fmax(k, 0), last),
			kernel(interp, (k - c) / widen) / sum);
}

int ct_resample_taps(struct ct_taps *t, size_t n_in, size_t n_out, double start, double step,
	enum ct_interp interp, bool antialias, struct ct_err *e)
{
	double widen = antialias && step > 1 ? step : 1;
	double taps = 2 * ceil(widen * (interp == CT_LINEAR ? 1 : 2));

	if (!(step > 0 && step <= 1e6) || !(fabs(start) <= 1e9))
		return ct_fail(e, CT_EINPUT, "resampling from %g in steps of %g", start, step);
	if (ct_taps_alloc(t, n_in, n_out, (size_t)taps, e))
		return -1;
	for (size_t m = 0; m < n_out; m++) /* a grid centre off by rounding is a centre */
		fill_row(t, m, nearbyint((start + (double)m * step) * 0x1p30) * 0x1p-30, widen,
			interp);
	return 0;
}

int ct_resample_plan(struct ct_separable *s, const size_t n_in[static 3],
	const size_t n_out[static 3], const double start[static 3], const double step[static 3],
	enum ct_interp interp, bool antialias, const struct ct_par *par, struct ct_err *e)
{
	struct ct_taps t[3] = {{0}};
	int rc = -1;

	*s = (struct ct_separable){0};
	for (int a = 0; a < 3; a++)
		if (ct_resample_taps(&t[a], n_in[a], n_out[a], start[a], step[a], interp,
			antialias, e))
			goto out;
	rc = ct_separable_plan(s, t, par, e);
out:
	for (int a = 0; a < 3; a++)
		ct_taps_free(&t[a]);
	return rc;
}

int ct_upsample_plan(struct ct_separable *s, const size_t n_in[static 3],
	const size_t factor[static 3], enum ct_interp interp, const struct ct_par *par,
	struct ct_err *e)
{
	double start[3], step[3];
	size_t n_out[3];

	for (int a = 0; a < 3; a++) {
		step[a] = 1.0 / (double)factor[a];
		start[a] = 0.5 * step[a] - 0.5;
		if (ct_size_mul(&n_out[a], n_in[a], factor[a], "volume", e))
			return -1;
	}
	return ct_resample_plan(s, n_in, n_out, start, step, interp, false, par, e);
}
