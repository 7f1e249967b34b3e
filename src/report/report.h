/* report.h: what one of our files holds, as JSON; the text of ct-info is made of the same. */
#ifndef CT_REPORT_REPORT_H
#define CT_REPORT_REPORT_H
#include "core/err.h"
#include "formats/any.h"
#include "resolution/blur.h"
#include "resolution/profile.h"

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

/* An object of `path`; `all` lists every tensor too. NULL with CT_ENOMEM. */
json_t *ct_report_make(const struct ct_any *a, const char *path, bool all, struct ct_err *e);
/* What was estimated of the operator of a CT. */
struct ct_report_operator {
	const char *assumed;                          /* in words; "": nothing */
	const struct ct_profile *seen, *told, *joint; /* three each: edges, DICOM, both */
	const struct ct_blur *least;
};
/* Add the estimates of v to the object: what is assumed, in words; "profile-..." and "blur-..." as
 * three numbers, with DICOM "dicom-..." and "joint-..." too, "edge-..." of each axis that shows
 * edges, "noise-...". CT_ENOMEM. */
int ct_report_estimate(json_t *report, const struct ct_report_operator *is, const struct ct_vol *v,
	struct ct_err *e);
/* The object as lines "name value", indented. Control characters become '?': what a file says of
 * itself cannot steer a terminal. */
void ct_report_print(FILE *f, const json_t *report);

#endif
