/* prior-time.c: how long a call of a network takes (prior.h). */
#include "config.h"
#include "core/clock.h"
#include "core/mem.h"
#include "diffusion/prior.h"

#include <stdlib.h>

#define LEAST_SECONDS 0.5 /* seconds of calls that are enough */
enum { CALLS = 16 };

int ct_prior_time(double *call, double *back, const struct ct_prior *p, struct ct_err *e)
{
	const struct ct_denoiser net = ct_prior_denoiser(p);
	size_t n = p->channels * p->high * p->wide;
	float *x = NULL, *y = NULL;
	double start;
	int rc = -1;

	if (ct_alloc0(&x, n, sizeof *x, e) || ct_alloc(&y, n, sizeof *y, e) ||
		net.eps(net.ctx[0], 500, x, y, e)) /* the first is slower */
		goto out;
	start = ct_clock_cpu();
	for (int k = 1; k <= CALLS && (k == 1 || ct_clock_cpu() - start < LEAST_SECONDS); k++) {
		if (net.eps(net.ctx[0], 500, x, y, e))
			goto out;
		*call = (ct_clock_cpu() - start) / k;
	}
	for (int k = 0; back && k < 2; k++) {
		start = ct_clock_cpu();
		if (net.back(net.ctx[0], 500, x, y, x, e))
			goto out;
		*back = ct_clock_cpu() - start;
	}
	rc = 0;
out:
	free(x);
	free(y);
	return rc;
}
