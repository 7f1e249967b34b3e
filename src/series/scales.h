/* scales.h: is the scale of a slice that of its values? RescaleSlope and RescaleIntercept may
 * differ from slice to slice; then the values go on as they were. Where one is wrong they jump from
 * a slice to the next, and would not if both had one scale. And are the values those of a CT?
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_SERIES_SCALES_H
#define CT_SERIES_SCALES_H
#include "core/env.h"
#include "series/slice.h"

enum { CT_SCALES_CLASSES = 3 };
/* Two slices that follow on each other: the medians of how much the values of the second are above
 * those of the first, in thirds of the pixels by value. In HU. */
struct ct_scales_pair {
	size_t a, b;
	bool one;                                               /* scale for both */
	double own[CT_SCALES_CLASSES], same[CT_SCALES_CLASSES]; /* as scaled, by one scale */
};

/* Owns what it points to; zeroes are empty, and take nothing. */
struct ct_scales {
	const struct ct_slice *s;
	size_t n;
	bool nameless; /* files are not to be named in warnings: the caller says so once it began */
	bool differ;   /* there is more than one scale */
	size_t last;   /* slice that was taken before, or n */
	float *before;
	struct sample *sample;
	double *work;
	struct ct_scales_pair *pair;
	size_t pairs;
	double least, most; /* HU of all but padding */
	size_t padded;      /* pixels that are padding */
	size_t high;        /* a slice, + 1, of which a part is beyond what metal has; 0: none */
	bool varied;        /* a slice before had more than one value; */
	size_t flat, lost;  /* since then this one, + 1, had one; and such a one between others */
};

/* For n slices in order of place, which must outlive it. CT_ENOMEM. */
int ct_scales_begin(struct ct_scales *c, const struct ct_slice *s, size_t n, struct ct_err *e);
/* The stored values of slice k, less its base; the slices come in order, some not at all. */
void ct_scales_take(struct ct_scales *c, size_t k, const float *stored);
/* CT_EINPUT, naming slice and field, if values jump where the scale does and would not by one
 * scale. Warnings of what no CT shows: values that lie close together because of a small
 * RescaleSlope, all of them above water or below air, many beyond metal, tissue that is padding, a
 * slice of one value between others. */
int ct_scales_check(const struct ct_scales *c, const struct ct_env *env, struct ct_err *e);
void ct_scales_free(struct ct_scales *c);

#endif
