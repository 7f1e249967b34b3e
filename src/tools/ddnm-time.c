/* ddnm-time.c: see ddnm-time.h. */
#include "config.h"
#include "core/clock.h"
#include "core/mem.h"
#include "tools/ddnm-time.h"

#include <stdlib.h>

int ddnm_time(const struct ct_prior *p, bool back, double *once, double *slope, struct ct_err *e)
{
	const struct ct_denoiser net = ct_prior_denoiser(p);
	size_t n = p->channels * p->high * p->wide;
	float *x = NULL, *y = NULL;
	double start;
	int rc = -1;

	*slope = 0;
	if (ct_alloc0(&x, n, sizeof *x, e) || ct_alloc(&y, n, sizeof *y, e) ||
		net.eps(net.ctx[0], 500, x, y, e)) /* the first is slower */
		goto out;
	start = ct_clock_wall();
	if (net.eps(net.ctx[0], 500, x, y, e))
		goto out;
	*once = ct_clock_wall() - start;
	for (int k = 0; back && k < 2; k++) {
		start = ct_clock_wall();
		if (net.back(net.ctx[0], 500, x, y, x, e))
			goto out;
		*slope = ct_clock_wall() - start;
	}
	rc = 0;
out:
	free(x);
	free(y);
	return rc;
}
