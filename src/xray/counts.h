/* counts.h: what a detector measured, as line integrals: flat and dark fields, negative logarithm,
 * bad pixels, rings. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_XRAY_COUNTS_H
#define CT_XRAY_COUNTS_H
#include "core/env.h"
#include "core/stack.h"

#include <stdbool.h>

struct ct_counts_rule {
	bool counts;       /* values are what was counted; false: line integrals already */
	const float *flat; /* [h][w] without object; needed for counts */
	const float *dark; /* [h][w] without rays; NULL: zeros */
	size_t rings;      /* width of the median that rings are told by, columns, odd; 0: kept */
};

struct ct_counts_report {
	size_t bad;     /* pixels of the detector that were replaced in every view */
	size_t lost;    /* values that were not finite, and replaced */
	size_t starved; /* values below 1e-4 of the flat field, which count as that */
};

/* In place: -log((I - dark)/(flat - dark)) of counts. A pixel of the detector is bad if flat - dark
 * is below a tenth of the median about it, or (of 8 views or more) if its value never changes,
 * though in one view others on either side of it in its row have other values, and change. Bad
 * pixels, and values that are not finite, become the mean of the good pixels nearest to them.
 * Rings: each column of a row loses what its mean over all views differs from the median of those
 * about it. CT_EINPUT if a fifth of the detector is bad, CT_ENOMEM. */
int ct_counts_correct(struct ct_stack *s, const struct ct_counts_rule *rule,
	struct ct_counts_report *report, const struct ct_env *env, struct ct_err *e);

#endif
