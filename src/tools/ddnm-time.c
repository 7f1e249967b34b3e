/* ddnm-time.c: see ddnm.h. */
#include "config.h"
#include "core/clock.h"
#include "core/mem.h"
#include "tools/ddnm.h"

#include <stdio.h>
#include <stdlib.h>

#define LEAST_SECONDS 0.5 /* seconds of calls that are enough */
enum { CALLS = 16 };

/* Of one call, the mean of some if they are short. */
static int try(double *once, double *slope, const struct ct_prior *p, bool back, struct ct_err *e)
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
	start = ct_clock_cpu();
	for (int k = 1; k <= CALLS && (k == 1 || ct_clock_cpu() - start < LEAST_SECONDS); k++) {
		if (net.eps(net.ctx[0], 500, x, y, e))
			goto out;
		*once = (ct_clock_cpu() - start) / k;
	}
	for (int k = 0; back && k < 2; k++) {
		start = ct_clock_cpu();
		if (net.back(net.ctx[0], 500, x, y, x, e))
			goto out;
		*slope = ct_clock_cpu() - start;
	}
	rc = 0;
out:
	free(x);
	free(y);
	return rc;
}

int ddnm_time(struct ct_cost *cost, const struct ct_prior *p, const struct ddnm_calls *n,
	struct ct_err *e)
{
	const double before = ct_clock_cpu();
	const size_t calls = n->each * n->views, back = n->gradients * n->views;
	double once, slope;
	int at;

	if (try(&once, &slope, p, back > 0, e))
		return -1;
	cost->seconds = (before + once * (double)calls + slope * (double)back) / (double)n->threads;
	at = snprintf(cost->work, sizeof cost->work,
		"%zu calls of %.3f s of the network of %zux%zu", calls, once, p->wide, p->high);
	if (back && at > 0)
		snprintf(cost->work + at, sizeof cost->work - (size_t)at,
			", %zu of %.3f s of its derivative", back, slope);
	return 0;
}
