/* band.c: see band.h. */
#include "config.h"
#include "recon/band.h"
#include "core/mem.h"
#include "resolution/separable.h"

#include <math.h>
#include <stdlib.h>

#define FULL 0.6 /* of f, to which G passes all */
#define LOBES 3

static double sample(double f, double x)
{
	double a = M_PI * f * x;

	return x == 0 ? f : f * (sin(a) / a) * (sin(a) / a);
}

static int make(struct ct_taps *t, size_t n, double f, struct ct_err *e)
{
	ptrdiff_t half = (ptrdiff_t)fmin(floor(LOBES / (f - FULL * f)), (double)n - 1);
	double sum = 0;

	if (ct_taps_alloc(t, n, n, 2 * (size_t)half + 1, e))
		return -1;
	for (ptrdiff_t k = -half; k <= half; k++)
		sum += sample(f, (double)k) - FULL * sample(FULL * f, (double)k);
	for (size_t m = 0; m < n; m++) {
		ct_taps_place(t, m, (ptrdiff_t)m - half);
		for (ptrdiff_t k = -half; k <= half; k++)
			ct_taps_add(t, m, ct_taps_reflect((ptrdiff_t)m + k, n),
				(sample(f, (double)k) - FULL * sample(FULL * f, (double)k)) / sum);
	}
	return 0;
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
