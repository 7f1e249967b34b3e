/* report.h: what one of our files holds, as JSON; the text of ct-info is made of the same.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_REPORT_REPORT_H
#define CT_REPORT_REPORT_H
#include "core/gauss.h"
#include "core/stack.h"
#include "core/vol.h"
#include "formats/any.h"
#include "estimate/noise.h"
#include "estimate/profile.h"

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

/* An object of `path`; `all` lists every tensor too. NULL with CT_ENOMEM. */
json_t *ct_report_make(const struct ct_any *a, const char *path, bool all, struct ct_err *e);
/* What was estimated of the operator of a CT. */
struct ct_report_operator {
	const char *assumed;                          /* in words; "": nothing */
	const struct ct_profile *seen, *told, *joint; /* three each: edges, DICOM, both */
	const struct ct_noise *noise;
};
/* Add the estimates to the object: what is assumed, in words; "profile-..." as three numbers, with
 * DICOM "dicom-..." and "joint-..." too, "edge-..." of each axis that shows edges, "noise-...".
 * CT_ENOMEM. */
int ct_report_estimate(json_t *report, const struct ct_report_operator *is, struct ct_err *e);
/* The object as lines "name value", indented. Control characters become '?': what a file says of
 * itself cannot steer a terminal. */
void ct_report_print(FILE *f, const json_t *report);

/* What a file holds in a few numbers: ranges, and the scan behind a stack (survey.c). Pure;
 * thread-safe. */

struct ct_survey_range {
	size_t nan, inf;           /* values that are not finite */
	double min, max, mean, sd; /* of the finite ones; NaN if there are none */
};

void ct_survey_range_of(struct ct_survey_range *r, size_t n, const float *x);

/* The geometry of a stack, from its vectors alone. The principal ray of a view leaves the source
 * along the normal of the detector (parallel: along the beam). */
struct ct_survey {
	double pitch[2], size[2]; /* of the first detector along u and v, mm */
	double angle[2], step;    /* of the first and last view, mean step, degrees */
	bool has_iso;             /* two principal rays that are not parallel; no parallel beam */
	double iso[3], miss;      /* point nearest to the principal rays, largest distance */
	/* least and largest of the views, mm: */
	double dso[2], dsd[2]; /* source to isocentre, source to detector */
	double offset[2][2];   /* of the detector's centre from the principal ray along u, v */
};

/* Geometry as ct_stack_check accepts it. */
void ct_survey_of(struct ct_survey *r, const struct ct_stack *s);

struct ct_survey_gauss {
	size_t positive, negative, bad; /* density above, below 0; not finite */
	double sigma[2], mean_sigma;    /* least, largest, geometric mean standard deviation, mm */
	double raw[2];                  /* least and largest raw density */
	double lo[3], hi[3];            /* box around the centres, mm */
};

/* Ranges over the finite Gaussians; NaN if there are none. */
void ct_survey_gauss_of(struct ct_survey_gauss *r, const struct ct_gauss *g);

/* "RAS", "LPS", ...: where the axes of the grid point, by the largest part of each column; "?" for
 * a letter if two columns share one. */
void ct_survey_orientation(char code[4], const double affine[3][4]);

#endif
