/* inversion.h: a scan inverted by one method, or as the mean of two.
 *
 * TV joins what lies between edges to plateaus, HTV to smooth surfaces, DC adds nothing of its own.
 * All three agree with the scan, and so does every mean of them. What two of them make wrong has
 * often opposite signs: the mean is nearer to the truth than either. How much of HTV, the scan
 * itself tells (trial.h). doc/prior.md, "The mean of two inversions".
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_INVERSE_INVERSION_H
#define CT_INVERSE_INVERSION_H
#include "inverse/pilot.h"
#include "inverse/upsample.h"

struct ct_inversion {
	struct ct_upsample_rule first; /* of TV or DC, if there is a second */
	double second; /* share of HTV by the same rule, 0 to below 1; 0: none is made */
};

/* Of both methods. */
struct ct_inversion_pilots {
	struct ct_pilot first, second;
};

/* The rule of the second method. */
struct ct_upsample_rule ct_inversion_second(const struct ct_inversion *v);
/* Bytes at the most, as ct_upsample_bytes. */
int ct_inversion_bytes(double *bytes, enum ct_upsample method, const struct ct_inversion *v,
	const size_t n[static 3], struct ct_err *e);
/* As ct_pilot_run. */
int ct_inversion_pilot(struct ct_inversion_pilots *p, const struct ct_vol *lo,
	const struct ct_inversion *v, bool part, const struct ct_env *env, struct ct_err *e);
void ct_inversion_pilot_free(struct ct_inversion_pilots *p);
/* As ct_upsample; pilots may be NULL. The report is that of the first, with the iterations of both
 * and the residual of the mean. */
int ct_inversion_run(struct ct_vol *hi, const struct ct_vol *lo, const struct ct_inversion *v,
	struct ct_inversion_pilots *pilots, struct ct_upsample_report *report,
	const struct ct_env *env, struct ct_err *e);

#endif
