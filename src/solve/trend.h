/* trend.h: how many iterations a loop will take that stops when what it measures is small enough.
 *
 * Solvers of first order slow down as they go, so that what is measured falls like a power of the
 * iteration: between the last one and one half to a quarter as far. Where it falls faster than that
 * too many are expected, never too few.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_SOLVE_TREND_H
#define CT_SOLVE_TREND_H
#include <stddef.h>

struct ct_trend {
	double tolerance; /* 0: the loop stops at none */
	size_t most;      /* iterations at the most */
	size_t likely;    /* what is expected; `most` if nothing tells */
	size_t at[2];     /* iterations of which the second is twice the first or more */
	double value[2];  /* measured there; 0: not yet */
};

struct ct_trend ct_trend_begin(double tolerance, size_t most);
/* `value` was measured after `at` iterations, in rising order. */
void ct_trend_see(struct ct_trend *t, size_t at, double value);
/* What to tell ct_progress_until: t->likely, or 0 if the loop stops at no tolerance. */
size_t ct_trend_likely(const struct ct_trend *t);

#endif
