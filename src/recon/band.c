/* band.c: see band.h. */
#include "config.h"
#include "recon/band.h"
#include "core/mem.h"
#include "resolution/separable.h"

#include <math.h>
#include <stdlib.h>

#define FULL 0.6 /* of f, to which G passes all */
#define LOBES 3

static double sinc2(double f, double x)
{
	double a = M_PI * f * x;

	return x == 0 ? f : f * (sin(a) / a) * (sin(a) / a);
}

/* by: f, and what the sum is divided by. */
static double sample(double x, const double *by)
{
	return (sinc2(by[0], x) - FULL * sinc2(FULL * by[0], x)) / by[1];
}

static int make(struct ct_taps *t, size_t n, double f, struct ct_err *e)
{
	const double half = fmin(floor(LOBES / (f - FULL * f)), (double)n - 1);
	double by[2] = {f, 1}, sum = 0;

	for (double x = -half; x <= half; x++)
		sum += sample(x, by);
	by[1] = sum;
	return ct_taps_filter(t, n, (size_t)half, sample, by, e);
}

int ct_band_clear(float *p, size_t count, size_t rows, size_t cols, double f, struct ct_par *par,
	struct ct_err *e)
{
	struct ct_separable s = {0};
	size_t n = rows * cols;
	float *low = NULL;
	int rc = -1;

	if (make(&s.t[0], cols, f, e) || make(&s.t[1], rows, f, e) ||
		ct_taps_identity(&s.t[2], 1, e) || ct_separable_plan(&s, par, e) ||
		ct_alloc(&low, n, sizeof *low, e))
		goto out;
	for (size_t v = 0; v < count; v++) {
		ct_separable_apply(&s, low, p + v * n, par);
		for (size_t i = 0; i < n; i++)
			p[v * n + i] -= low[i];
	}
	rc = 0;
out:
	ct_separable_free(&s);
	free(low);
	return rc;
}
