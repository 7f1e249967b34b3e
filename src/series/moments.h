/* moments.h: stacks that lie in one another: the times, phases, energies and kernels of one series.
 *
 * A stack is divided by a field of its headers where slices share a place, or where those of one
 * value lie between those of another. What follows on another is not divided: a scan that steps
 * and shoots is one stack, as is one whose exposure or acquisition is that of each slice.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_SERIES_MOMENTS_H
#define CT_SERIES_MOMENTS_H
#include "series/slice.h"

enum { CT_MOMENT_TEXT = 120 };

/* Room for the work on n slices; zeroes are empty. */
struct ct_moments {
	struct ct_slice **order; /* [n] */
	double *gap, *typical;   /* [n] */
	size_t *last;            /* [n] */
};

int ct_moments_alloc(struct ct_moments *m, size_t n, struct ct_err *e);
void ct_moments_free(struct ct_moments *m);
/* The places of n parallel slices along their normal, and their order by it. */
void ct_moments_place(struct ct_slice *s, size_t n);
/* Divide n slices that are in order of place: their ranks become those of their parts, and the
 * parts adjacent, each in order of place. False: they are one. `near`: of ct_slice_near. */
bool ct_moments_divide(struct ct_moments *m, struct ct_slice *s, size_t n, double near, int *field);
/* Append what tells the part with slice s from others: "AcquisitionNumber 2". */
void ct_moments_say(char text[CT_MOMENT_TEXT], const struct ct_slice *s, int field);

#endif
